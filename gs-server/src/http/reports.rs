//! `GET /api/v1/reports/…`: as values, and with `.html` or `.md` behind the name as a page or a text.

use api::{ProblemKind, Time};
use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use serde::{Deserialize, Serialize};

use super::App;
use super::extract::{Name, Query, time};
use super::problem::Failure;
use crate::report::{
    Document, Month, Style, handover_document, handover_report, html, markdown, month_document, month_report,
    pass_document, pass_report,
};

/// A handover goes back so far when nobody says since when.
const SHIFT_US: i64 = 8 * 3_600_000_000;

/// In which form a report is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Json,
    Html,
    Markdown,
}

/// `17.html` is 17 as a page.
fn form_of(name: &str) -> (&str, Form) {
    match name.rsplit_once('.') {
        Some((name, "html")) => (name, Form::Html),
        Some((name, "md")) => (name, Form::Markdown),
        _ => (name, Form::Json),
    }
}

fn answer<T: Serialize>(report: &T, document: impl FnOnce(&T) -> Document, form: Form) -> Response {
    match form {
        Form::Json => Json(report).into_response(),
        Form::Html => {
            let page = html(&document(report), Style::Linked);
            ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], page).into_response()
        }
        Form::Markdown => {
            let text = markdown(&document(report));
            ([(header::CONTENT_TYPE, "text/markdown; charset=utf-8")], text).into_response()
        }
    }
}

pub(super) async fn pass(State(app): State<App>, Name(name): Name) -> Result<Response, Failure> {
    let (id, form) = form_of(&name);
    let Ok(id) = id.parse::<u64>() else {
        let shown: String = name.chars().take(40).collect();
        return Err(Failure::field(
            ProblemKind::BadParameter,
            "id",
            format!(
                "'{shown}' is no pass: write its number from /passes/history, with .html or .md behind it if you like"
            ),
        ));
    };
    let state = &app.state;
    let row = i64::try_from(id).unwrap_or(i64::MAX);
    let report = pass_report(&state.store, &state.identity, row, state.timer.now().utc).await?;
    let report = report.ok_or_else(|| Failure::no_such("pass", id))?;
    Ok(answer(&report, pass_document, form))
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Since {
    since: Option<Time>,
}

async fn handover_in(app: &App, asked: &Since, form: Form) -> Result<Response, Failure> {
    let state = &app.state;
    let last_sequence = state.store.last_event_seq().await?;
    let now = super::station::view(app, &state.engine.status(), last_sequence);
    let at_us = now.at.unix_us();
    let since_us = asked.since.map_or_else(|| at_us.saturating_sub(SHIFT_US), Time::unix_us);
    if since_us > at_us {
        let message = format!("must not lie after the station's time ({}), found {}", now.at, time(since_us));
        return Err(Failure::field(ProblemKind::BadParameter, "since", message));
    }
    let report = handover_report(&state.store, now, since_us).await?;
    Ok(answer(&report, handover_document, form))
}

pub(super) async fn handover(
    State(app): State<App>,
    Query(asked): Query<Since>,
) -> Result<Response, Failure> {
    handover_in(&app, &asked, Form::Json).await
}

pub(super) async fn handover_page(
    State(app): State<App>,
    Query(asked): Query<Since>,
) -> Result<Response, Failure> {
    handover_in(&app, &asked, Form::Html).await
}

pub(super) async fn handover_text(
    State(app): State<App>,
    Query(asked): Query<Since>,
) -> Result<Response, Failure> {
    handover_in(&app, &asked, Form::Markdown).await
}

pub(super) async fn month(State(app): State<App>, Name(name): Name) -> Result<Response, Failure> {
    let (text, form) = form_of(&name);
    let month: Month = text.parse().map_err(|error: crate::report::MonthError| {
        Failure::field(ProblemKind::BadParameter, "month", error.to_string())
    })?;
    let state = &app.state;
    let report = month_report(&state.store, &state.identity, month, state.timer.now().utc).await?;
    Ok(answer(&report, month_document, form))
}
