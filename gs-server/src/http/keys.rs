//! `POST /api/v1/keys/{id}/confirm-counter`: an operator knows why counter and witness disagree.

use api::{CounterConfirmation, ProblemKind};
use axum::extract::State;
use axum::response::Response;
use mission::Intent;
use protocol::{Counter, KeyId};

use super::App;
use super::extract::Name;
use super::problem::Failure;
use super::write::Write;

pub(super) async fn confirm_counter(
    State(app): State<App>,
    Name(id): Name,
    write: Write<CounterConfirmation>,
) -> Result<Response, Failure> {
    let key: KeyId = id.parse().map_err(|error: protocol::TextError| {
        Failure::field(ProblemKind::UnknownKey, "id", error.to_string())
    })?;
    let above = write.body.above.map(Counter);
    write.submit(&app, Intent::ConfirmCounter { key, above }).await
}
