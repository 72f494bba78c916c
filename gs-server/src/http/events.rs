//! `GET /api/v1/events`, `/api/v1/limits` and `/api/v1/audit`: what happened, which values are out of bounds, and who
//! did what.

use api::{AuditView, EventView, LimitView, Page, ProblemKind};
use axum::Json;
use axum::extract::State;
use mission::Level;
use mission::record::EventKind;

use super::App;
use super::extract::{Query, Within, list_query, number, paged, scope, time, whole};
use super::problem::Failure;
use crate::storage::{EventQuery, StoredEvent};

list_query! {
    Asked { satellite: String, station: String, link: String, key: String, kind: String, level: String }
}

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<Page<EventView>>, Failure> {
    let wrong = |field, message: String| Failure::field(ProblemKind::BadParameter, field, message);
    let level = asked.level.as_deref().map_or(Ok(Level::Normal), str::parse);
    let kinds = asked.kind.as_deref().map_or(Ok(Vec::new()), kinds);
    let page = asked.page()?;
    let query = EventQuery {
        scope: scope(&asked.satellite, &asked.station, &asked.link, asked.during()?),
        key: asked.key,
        kinds: kinds.map_err(|word| {
            let known: Vec<&str> = EventKind::ALL.iter().map(|kind| kind.name()).collect();
            wrong("kind", format!("'{word}' is no kind of event; there are {}", known.join(", ")))
        })?,
        level: level.map_err(|error: mission::level::UnknownLevel| wrong("level", error.to_string()))?,
        page,
    };
    let events = app.state.store.events(&query).await?;
    let views = events.iter().map(view).collect();
    Ok(Json(paged(views, &query.page, |event: &EventView| number(event.sequence))))
}

fn kinds(words: &str) -> Result<Vec<EventKind>, String> {
    let find = |word: &str| {
        EventKind::ALL
            .into_iter()
            .find(|kind| kind.name() == word)
            .ok_or_else(|| word.chars().take(40).collect())
    };
    words.split(',').map(find).collect()
}

pub(super) async fn limits(
    State(app): State<App>,
    Query(asked): Query<Within>,
) -> Result<Json<Page<LimitView>>, Failure> {
    let during = asked.during()?;
    let mut rows = app.state.store.limits().await?;
    rows.retain(|row| during.holds(row.since_us));
    let views = rows.into_iter().map(|row| LimitView {
        satellite: row.satellite,
        station: row.station,
        parameter: row.parameter,
        level: row.level,
        since: time(row.since_us),
        value: row.value,
    });
    Ok(Json(whole(views.collect())))
}

list_query! { AuditAsked {} }

pub(super) async fn audit(
    State(app): State<App>,
    Query(asked): Query<AuditAsked>,
) -> Result<Json<Page<AuditView>>, Failure> {
    let page = asked.page()?;
    let rows = app.state.store.audit(&asked.during()?, &page).await?;
    let views = rows.into_iter().map(|row| AuditView {
        id: number(row.id),
        station: row.station,
        at: time(row.at_us),
        who: row.who,
        action: row.action,
        detail: row.detail,
    });
    Ok(Json(paged(views.collect(), &page, |row: &AuditView| row.id)))
}

/// An event as the wire has it.
pub(super) fn view(event: &StoredEvent) -> EventView {
    let record = &event.record;
    let subject = &record.subject;
    EventView {
        sequence: event.sequence,
        at: time(record.at.0),
        kind: record.kind.name().to_owned(),
        level: record.level.name().to_owned(),
        satellite: record.satellite.as_ref().map(ToString::to_string),
        station: record.station.to_string(),
        link: record.link.as_ref().map(ToString::to_string),
        key: record.key.map(|key| key.to_string()),
        frame: subject.frame.map(|id| id.0),
        command: subject.command.map(|id| id.0),
        image: subject.image.map(|id| id.0),
        download: subject.download.map(|id| id.0),
        message: record.message.clone(),
    }
}
