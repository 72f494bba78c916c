//! `GET /healthz`, `/readyz`, `/api/v1/health` and `/api/v1/version`: is it there, is it well, what can it do.

use std::time::Duration;

use api::{API_VERSION, CAPABILITIES, Health, Version};
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse as _, Response};
use mission::LinkState;

use super::App;
use super::extract::time;
use super::problem::OwnBody;
use crate::clock::within;

/// The engine answers within this, or it does not live.
const ANSWERS_WITHIN: Duration = Duration::from_secs(2);

/// 200 when frames are stored, 503 when not; a body with the reasons in both cases.
pub(super) async fn health(State(app): State<App>) -> Response {
    answer(view(&app, true).await)
}

/// 200 when the process lives and the engine answers, 503 when not. For whoever restarts what hangs.
pub(super) async fn alive(State(app): State<App>) -> Response {
    let mut health = view(&app, true).await;
    health.live = engine_answers(&app).await;
    health.ready = health.live;
    answer(health)
}

/// 200 when requests should come here, 503 with the reasons when not. For whoever stands before several servers.
pub(super) async fn ready(State(app): State<App>) -> Response {
    let answers = engine_answers(&app).await;
    answer(view(&app, answers).await)
}

async fn engine_answers(app: &App) -> bool {
    within(ANSWERS_WITHIN, app.state.engine.answers()).await == Some(true)
}

async fn view(app: &App, engine_answers: bool) -> Health {
    let status = app.state.engine.status();
    let mut reasons = Vec::new();
    if !engine_answers {
        reasons.push("the engine does not answer".to_owned());
    }
    if let Some(failing) = &status.storage.failing {
        reasons.push(format!("storage: {failing}"));
    }
    if app.state.store.last_event_seq().await.is_err() {
        reasons.push("storage: the archive cannot be read".to_owned());
    }
    if app.state.stop.is_cancelled() {
        reasons.push("the server is stopping".to_owned());
    }
    let ready = reasons.is_empty();
    // A link that is away does not make the server unfit, but whoever asks wants to know.
    for link in &status.links {
        if let LinkState::Unavailable { reason } | LinkState::Failed { reason } = &link.state {
            reasons.push(format!("link {}: {reason}", link.link));
        }
    }
    Health { live: engine_answers, ready, reasons, at: time(app.state.timer.now().utc.0) }
}

fn answer(health: Health) -> Response {
    if health.ready {
        return Json(health).into_response();
    }
    let mut response = (StatusCode::SERVICE_UNAVAILABLE, Json(health)).into_response();
    response.extensions_mut().insert(OwnBody);
    response
}

pub(super) async fn version(State(app): State<App>) -> Json<Version> {
    let identity = &app.state.identity;
    Json(Version {
        server: "gs-server".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        api: API_VERSION,
        capabilities: CAPABILITIES.map(str::to_owned).into(),
        decoder: mission::record::DECODER_VERSION,
        station: identity.station.to_string(),
        simulated: identity.simulated,
    })
}
