//! The table of all paths, each with who may take it: a row without a [`Policy`] does not compile.
//!
//! Tests walk it, so a new write is tried without token, key, origin and the rest by itself.

use axum::Router;
use axum::handler::Handler;
use axum::middleware::{from_fn, from_fn_with_state};
use axum::routing::{MethodRouter, delete, get, post};

use super::admit::Policy::{Anyone, LoggedIn, Needs};
use super::admit::{Policy, admit};
use super::write::{guard_door, guard_write};
use super::{
    App, alerts, antenna, approvals, clock, commands, downloads, elements, events, forwards, frames, images,
    keys, links, metrics, openapi, page, people, plans, receivers, receptions, rehearsals, reports, runs,
    schedule, session, sky, station, status, stream, telemetry,
};
use crate::people::Right::{Approve, Command, Look, ManagePeople, ManageStation, Plan};

/// What a path is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Access {
    /// Changes nothing.
    Read,
    /// The origin checked, and everything of [`guard_write`].
    Write,
    /// The same by DELETE.
    Remove,
    /// As a write, by somebody who is not known yet: no idempotency key.
    Door,
    /// WebSocket: the origin checked.
    Stream,
}

/// One row of the table.
pub(super) struct Route {
    pub(super) path: &'static str,
    pub(super) access: Access,
    pub(super) policy: Policy,
    handler: MethodRouter<App>,
}

impl Route {
    pub(super) fn add_to(self, router: Router<App>, app: &App) -> Router<App> {
        let handler = match self.access {
            Access::Write | Access::Remove => self.handler.route_layer(from_fn(guard_write)),
            Access::Door => self.handler.route_layer(from_fn(guard_door)),
            Access::Read | Access::Stream => self.handler,
        };
        let handler = match (self.path, self.access) {
            (receptions::PATH, Access::Write) => {
                handler.route_layer(from_fn_with_state(app.clone(), receptions::gate))
            }
            _ => handler,
        };
        let door = (app.clone(), self.policy, self.access);
        router.route(self.path, handler.route_layer(from_fn_with_state(door, admit)))
    }
}

fn read<T: 'static, H: Handler<T, App>>(path: &'static str, policy: Policy, handler: H) -> Route {
    Route { path, access: Access::Read, policy, handler: get(handler) }
}

fn write<T: 'static, H: Handler<T, App>>(path: &'static str, policy: Policy, handler: H) -> Route {
    Route { path, access: Access::Write, policy, handler: post(handler) }
}

fn remove<T: 'static, H: Handler<T, App>>(path: &'static str, policy: Policy, handler: H) -> Route {
    Route { path, access: Access::Remove, policy, handler: delete(handler) }
}

fn door<T: 'static, H: Handler<T, App>>(path: &'static str, policy: Policy, handler: H) -> Route {
    Route { path, access: Access::Door, policy, handler: post(handler) }
}

fn stream<T: 'static, H: Handler<T, App>>(path: &'static str, policy: Policy, handler: H) -> Route {
    Route { path, access: Access::Stream, policy, handler: get(handler) }
}

/// Every path of the server, and who may take it.
pub(super) fn table() -> Vec<Route> {
    vec![
        read("/", Anyone, page::index),
        read("/plan", Anyone, page::plan),
        read("/favicon.ico", Anyone, page::favicon),
        read("/page/{file}", Anyone, page::file),
        read("/healthz", Anyone, status::alive),
        read("/readyz", Anyone, status::ready),
        read("/metrics", Needs(Look), metrics::get),
        read("/login", Anyone, page::login),
        read("/welcome", Anyone, page::welcome),
        read("/api/v1/session", Anyone, session::get),
        door("/api/v1/session", Anyone, session::log_in),
        remove("/api/v1/session", LoggedIn, session::log_out),
        write("/api/v1/session/end-all", LoggedIn, session::log_out_everywhere),
        write("/api/v1/session/password", LoggedIn, session::change_password),
        door("/api/v1/welcome", Anyone, session::welcome),
        write("/api/v1/welcome/link", Needs(ManagePeople), people::first_link),
        read("/api/v1/users", Needs(ManagePeople), people::users),
        write("/api/v1/users", Needs(ManagePeople), people::add_user),
        write("/api/v1/users/{name}", Needs(ManagePeople), people::change_user),
        write("/api/v1/users/{name}/link", Needs(ManagePeople), people::user_link),
        read("/api/v1/tokens", Needs(ManagePeople), people::tokens),
        write("/api/v1/tokens", Needs(ManagePeople), people::new_token),
        remove("/api/v1/tokens/{name}", Needs(ManagePeople), people::revoke_token),
        read("/api/v1/approvals", Needs(Look), approvals::list),
        read("/api/v1/approvals/{id}", Needs(Look), approvals::get),
        write("/api/v1/approvals/{id}/approve", Needs(Approve), approvals::approve),
        write("/api/v1/approvals/{id}/refuse", Needs(Command), approvals::refuse),
        read("/api/v1/transmissions", Needs(Look), approvals::transmissions),
        read("/api/docs", Anyone, openapi::docs),
        read("/api/v1/openapi.json", Anyone, openapi::serve),
        read("/api/v1/health", Anyone, status::health),
        read("/api/v1/version", Needs(Look), status::version),
        read("/api/v1/station", Needs(Look), station::get),
        read("/api/v1/antenna", Needs(Look), antenna::get),
        read("/api/v1/frames", Needs(Look), frames::list),
        read("/api/v1/frames/{id}", Needs(Look), frames::get),
        read(receptions::PATH, Needs(Look), receptions::list),
        write(receptions::PATH, Needs(Plan), receptions::import),
        read("/api/v1/ears", Needs(Look), receptions::ears),
        read("/api/v1/ears/ways", Needs(Look), receivers::ways),
        read("/api/v1/receivers", Needs(Look), receivers::list),
        read("/api/v1/telemetry", Needs(Look), telemetry::series),
        read("/api/v1/telemetry/latest", Needs(Look), telemetry::latest),
        read("/api/v1/parameters", Needs(Look), telemetry::parameters),
        read("/api/v1/commands", Needs(Look), commands::list),
        write("/api/v1/commands", Needs(Command), commands::create),
        read("/api/v1/commands/{id}", Needs(Look), commands::get),
        write("/api/v1/commands/{id}/cancel", Needs(Command), commands::cancel),
        read("/api/v1/downloads", Needs(Look), downloads::list),
        write("/api/v1/downloads", Needs(Command), downloads::create),
        read("/api/v1/downloads/{id}", Needs(Look), downloads::get),
        write("/api/v1/downloads/{id}/cancel", Needs(Command), downloads::cancel),
        read("/api/v1/images", Needs(Look), images::list),
        read("/api/v1/images/{id}", Needs(Look), images::get),
        read("/api/v1/images/{id}/chunks", Needs(Look), images::chunks),
        read("/api/v1/images/{id}/file", Needs(Look), images::file),
        read("/api/v1/elements", Needs(Look), elements::list),
        write("/api/v1/elements", Needs(Plan), elements::add),
        read("/api/v1/elements/sources", Needs(Look), elements::sources),
        write("/api/v1/elements/fetch", Needs(Plan), elements::fetch),
        read("/api/v1/passes", Needs(Look), sky::passes),
        read("/api/v1/passes/history", Needs(Look), sky::history),
        read("/api/v1/passes/sky.svg", Needs(Look), sky::sky),
        read("/api/v1/passes/timeline.svg", Needs(Look), sky::timeline),
        read("/api/v1/passes.ics", Needs(Look), sky::calendar),
        read("/api/v1/look", Needs(Look), sky::look),
        read("/api/v1/plans", Needs(Look), plans::list),
        write("/api/v1/plans", Needs(Plan), plans::add),
        remove("/api/v1/plans/{name}", Needs(Plan), plans::withdraw),
        write("/api/v1/plans/{name}/arm", Needs(Plan), plans::arm),
        write("/api/v1/plans/{name}/disarm", Needs(Plan), plans::disarm),
        write("/api/v1/plans/{name}/attach", Needs(Plan), plans::attach),
        write("/api/v1/plans/{name}/detach", Needs(Plan), plans::detach),
        read("/api/v1/rehearsals", Needs(Look), rehearsals::list),
        write("/api/v1/rehearsals", Needs(Plan), rehearsals::begin),
        read("/api/v1/rehearsals/{id}", Needs(Look), rehearsals::get),
        remove("/api/v1/rehearsals/{id}", Needs(Plan), rehearsals::cancel),
        read("/api/v1/schedule", Needs(Look), schedule::get),
        read("/api/v1/runs", Needs(Look), runs::list),
        read("/api/v1/runs/{id}", Needs(Look), runs::get),
        read("/api/v1/reports/passes/{id}", Needs(Look), reports::pass),
        read("/api/v1/reports/handover", Needs(Look), reports::handover),
        read("/api/v1/reports/handover.html", Needs(Look), reports::handover_page),
        read("/api/v1/reports/handover.md", Needs(Look), reports::handover_text),
        read("/api/v1/reports/months/{month}", Needs(Look), reports::month),
        write("/api/v1/satellites/{name}/hold", Needs(Command), plans::hold),
        write("/api/v1/satellites/{name}/release", Needs(Command), plans::release),
        read("/api/v1/alerts", Needs(Look), alerts::list),
        read("/api/v1/alerts/targets", Needs(Look), alerts::targets),
        write("/api/v1/alerts/targets/{name}/test", Needs(ManageStation), alerts::test),
        read("/api/v1/alerts/{id}", Needs(Look), alerts::get),
        write("/api/v1/alerts/{id}/acknowledge", Needs(Command), alerts::acknowledge),
        write("/api/v1/alerts/{id}/shelve", Needs(Command), alerts::shelve),
        write("/api/v1/alerts/{id}/unshelve", Needs(Command), alerts::unshelve),
        write("/api/v1/alerts/{id}/assign", Needs(Command), alerts::assign),
        read("/api/v1/forwards", Needs(Look), forwards::list),
        read("/api/v1/forwards/targets", Needs(Look), forwards::targets),
        write("/api/v1/forwards/targets/{name}/pause", Needs(Command), forwards::pause),
        write("/api/v1/forwards/targets/{name}/resume", Needs(Command), forwards::resume),
        read("/api/v1/forwards/{id}", Needs(Look), forwards::get),
        write("/api/v1/forwards/{id}/retry", Needs(Command), forwards::retry),
        read("/api/v1/events", Needs(Look), events::list),
        read("/api/v1/limits", Needs(Look), events::limits),
        read("/api/v1/audit", Needs(Look), events::audit),
        write("/api/v1/links/{id}/arm", Needs(Command), links::arm),
        write("/api/v1/links/{id}/disarm", Needs(Command), links::disarm),
        write("/api/v1/clock/vouch", Needs(Command), clock::vouch),
        write("/api/v1/keys/{id}/confirm-counter", Needs(ManageStation), keys::confirm_counter),
        stream("/api/v1/stream", Needs(Look), stream::open),
    ]
}
