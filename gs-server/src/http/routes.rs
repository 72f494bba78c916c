//! The table of all paths. Tests walk it, so a new write is tried without token, key, origin and the rest by itself.

use axum::Router;
use axum::handler::Handler;
use axum::middleware::from_fn_with_state;
use axum::routing::{MethodRouter, delete, get, post};

use super::write::guard_write;
use super::{
    App, antenna, clock, commands, downloads, elements, events, frames, images, keys, links, page, plans,
    runs, schedule, sky, station, status, stream, telemetry,
};

/// What a path is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Access {
    /// Changes nothing; no token.
    Read,
    /// Everything of [`guard_write`].
    Write,
    /// The same by DELETE.
    Remove,
    /// WebSocket: origin checked, no token.
    Stream,
}

/// One row of the table.
pub(super) struct Route {
    pub(super) path: &'static str,
    pub(super) access: Access,
    handler: MethodRouter<App>,
}

impl Route {
    pub(super) fn add_to(self, router: Router<App>, app: &App) -> Router<App> {
        let handler = match self.access {
            Access::Write | Access::Remove => {
                self.handler.route_layer(from_fn_with_state(app.clone(), guard_write))
            }
            Access::Read | Access::Stream => self.handler,
        };
        router.route(self.path, handler)
    }
}

fn read<T: 'static, H: Handler<T, App>>(path: &'static str, handler: H) -> Route {
    Route { path, access: Access::Read, handler: get(handler) }
}

fn write<T: 'static, H: Handler<T, App>>(path: &'static str, handler: H) -> Route {
    Route { path, access: Access::Write, handler: post(handler) }
}

fn remove<T: 'static, H: Handler<T, App>>(path: &'static str, handler: H) -> Route {
    Route { path, access: Access::Remove, handler: delete(handler) }
}

fn stream<T: 'static, H: Handler<T, App>>(path: &'static str, handler: H) -> Route {
    Route { path, access: Access::Stream, handler: get(handler) }
}

/// Every path of the server.
pub(super) fn table() -> Vec<Route> {
    vec![
        read("/", page::index),
        read("/favicon.ico", page::favicon),
        read("/page/{file}", page::file),
        read("/api/v1/health", status::health),
        read("/api/v1/version", status::version),
        read("/api/v1/station", station::get),
        read("/api/v1/antenna", antenna::get),
        read("/api/v1/frames", frames::list),
        read("/api/v1/frames/{id}", frames::get),
        read("/api/v1/telemetry", telemetry::series),
        read("/api/v1/telemetry/latest", telemetry::latest),
        read("/api/v1/parameters", telemetry::parameters),
        read("/api/v1/commands", commands::list),
        write("/api/v1/commands", commands::create),
        read("/api/v1/commands/{id}", commands::get),
        write("/api/v1/commands/{id}/cancel", commands::cancel),
        read("/api/v1/downloads", downloads::list),
        write("/api/v1/downloads", downloads::create),
        read("/api/v1/downloads/{id}", downloads::get),
        write("/api/v1/downloads/{id}/cancel", downloads::cancel),
        read("/api/v1/images", images::list),
        read("/api/v1/images/{id}", images::get),
        read("/api/v1/images/{id}/chunks", images::chunks),
        read("/api/v1/images/{id}/file", images::file),
        read("/api/v1/elements", elements::list),
        write("/api/v1/elements", elements::add),
        read("/api/v1/elements/sources", elements::sources),
        write("/api/v1/elements/fetch", elements::fetch),
        read("/api/v1/passes", sky::passes),
        read("/api/v1/passes/history", sky::history),
        read("/api/v1/passes/sky.svg", sky::sky),
        read("/api/v1/passes/timeline.svg", sky::timeline),
        read("/api/v1/passes.ics", sky::calendar),
        read("/api/v1/look", sky::look),
        read("/api/v1/plans", plans::list),
        write("/api/v1/plans", plans::add),
        remove("/api/v1/plans/{name}", plans::withdraw),
        write("/api/v1/plans/{name}/arm", plans::arm),
        write("/api/v1/plans/{name}/disarm", plans::disarm),
        write("/api/v1/plans/{name}/attach", plans::attach),
        write("/api/v1/plans/{name}/detach", plans::detach),
        read("/api/v1/schedule", schedule::get),
        read("/api/v1/runs", runs::list),
        read("/api/v1/runs/{id}", runs::get),
        write("/api/v1/satellites/{name}/hold", plans::hold),
        write("/api/v1/satellites/{name}/release", plans::release),
        read("/api/v1/events", events::list),
        read("/api/v1/limits", events::limits),
        read("/api/v1/audit", events::audit),
        write("/api/v1/links/{id}/arm", links::arm),
        write("/api/v1/links/{id}/disarm", links::disarm),
        write("/api/v1/clock/vouch", clock::vouch),
        write("/api/v1/keys/{id}/confirm-counter", keys::confirm_counter),
        stream("/api/v1/stream", stream::open),
    ]
}
