//! `GET /api/v1/health` and `/api/v1/version`: is it there, is it well, what can it do.

use api::{API_VERSION, CAPABILITIES, Health, Version};
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse as _, Response};
use mission::LinkState;

use super::App;
use super::extract::time;
use super::problem::OwnBody;

/// 200 when frames are stored, 503 when not; a body with the reasons in both cases.
pub(super) async fn health(State(app): State<App>) -> Response {
    let status = app.state.engine.status();
    let mut reasons = Vec::new();
    if let Some(failing) = &status.storage.failing {
        reasons.push(format!("storage: {failing}"));
    }
    let readable = app.state.store.last_event_seq().await;
    if readable.is_err() {
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
    let health = Health { live: true, ready, reasons, at: time(app.state.timer.now().utc.0) };
    if ready {
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
