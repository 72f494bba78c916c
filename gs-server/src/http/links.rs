//! `POST /api/v1/links/{id}/arm` and `/disarm`: whether a link may transmit.

use api::Nothing;
use axum::extract::State;
use axum::response::Response;
use mission::Intent;

use super::App;
use super::commands::link;
use super::extract::Name;
use super::problem::Failure;
use super::write::Write;

pub(super) async fn arm(
    State(app): State<App>,
    name: Name,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    set(&app, &name, true, write).await
}

pub(super) async fn disarm(
    State(app): State<App>,
    name: Name,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    set(&app, &name, false, write).await
}

async fn set(app: &App, Name(name): &Name, armed: bool, write: Write<Nothing>) -> Result<Response, Failure> {
    write.submit(app, Intent::ArmLink { link: link(name)?, armed }).await
}
