//! `POST /api/v1/keys/{id}/confirm-counter`: an operator knows why counter and witness disagree.

use api::{Nothing, ProblemKind};
use axum::extract::State;
use axum::response::Response;
use mission::Intent;
use protocol::KeyId;

use super::App;
use super::extract::Name;
use super::problem::Failure;
use super::write::Write;

pub(super) async fn confirm_counter(
    State(app): State<App>,
    Name(id): Name,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    let key: KeyId = id.parse().map_err(|error: protocol::TextError| {
        Failure::field(ProblemKind::UnknownKey, "id", error.to_string())
    })?;
    write.submit(&app, Intent::ConfirmCounter(key)).await
}
