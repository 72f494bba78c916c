//! `POST /api/v1/clock/vouch`: an operator has looked, the clock of this machine is right.

use api::Nothing;
use axum::extract::State;
use axum::response::Response;
use mission::Intent;

use super::App;
use super::problem::Failure;
use super::write::Write;

pub(super) async fn vouch(State(app): State<App>, write: Write<Nothing>) -> Result<Response, Failure> {
    write.submit(&app, Intent::VouchClock).await
}
