//! `/api/v1/forwards`: what is passed on to others, how it stands, and the exact request.

use api::{ForwardRequest, ForwardTargetView, ForwardView, ForwardWhole, Nothing, Page, ProblemKind, Time};
use axum::Json;
use axum::extract::State;

use super::App;
use super::extract::{Id, Name, Query, list_query, paged, whole};
use super::problem::Failure;
use super::write::Write;
use crate::config::ForwardKind;
use crate::forward::ForwardTargetNow;
use crate::storage::{ForwardQuery, ForwardRow, ForwardState};

list_query! { Asked { target: String, state: String } }

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<Page<ForwardView>>, Failure> {
    let state = match asked.state.as_deref() {
        None => None,
        Some(word) => Some(ForwardState::from_name(word).ok_or_else(|| {
            let shown: String = word.chars().take(40).collect();
            let there_are = ForwardState::ALL.map(ForwardState::name).join(", ");
            let message = format!("'{shown}' is none; there are {there_are}");
            Failure::field(ProblemKind::BadParameter, "state", message)
        })?),
    };
    let (during, page) = (asked.during()?, asked.page()?);
    let query = ForwardQuery { target: asked.target, state, during, page };
    let rows = app.state.store.forwards(&query).await?;
    Ok(Json(paged(rows.iter().map(view).collect(), &query.page, |one: &ForwardView| one.id)))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<ForwardWhole>, Failure> {
    let row = app.state.store.forward(id.row()).await?.ok_or_else(|| Failure::no_such("forward", id.0))?;
    let form = app.state.forwards.form(&row).await?;
    let request =
        form.map(|form| ForwardRequest { content_type: form.content_type.to_owned(), body: form.body });
    Ok(Json(ForwardWhole { forward: view(&row), request }))
}

pub(super) async fn retry(
    State(app): State<App>,
    id: Id,
    write: Write<Nothing>,
) -> Result<Json<ForwardView>, Failure> {
    let row = app.state.store.forward(id.row()).await?.ok_or_else(|| Failure::no_such("forward", id.0))?;
    let (who, ..) = write.who();
    let again = app.state.forwards.retry(row.id, &who).await?;
    let again = again.ok_or_else(|| {
        let text =
            format!("It is {}; only what is unknown, refused or of a dry run can be sent again.", row.state);
        Failure::new(ProblemKind::TooLate, text)
    })?;
    Ok(Json(view(&again)))
}

pub(super) async fn targets(State(app): State<App>) -> Result<Json<Page<ForwardTargetView>>, Failure> {
    let mut views = Vec::new();
    for target in app.state.forwards.targets() {
        views.push(target_view(&app, target).await?);
    }
    Ok(Json(whole(views)))
}

pub(super) async fn pause(
    State(app): State<App>,
    Name(name): Name,
    write: Write<Nothing>,
) -> Result<Json<ForwardTargetView>, Failure> {
    set(&app, &name, true, &write).await
}

pub(super) async fn resume(
    State(app): State<App>,
    Name(name): Name,
    write: Write<Nothing>,
) -> Result<Json<ForwardTargetView>, Failure> {
    set(&app, &name, false, &write).await
}

async fn set(
    app: &App,
    name: &str,
    pause: bool,
    write: &Write<Nothing>,
) -> Result<Json<ForwardTargetView>, Failure> {
    let unknown = || {
        let shown: String = name.chars().take(40).collect();
        Failure::new(ProblemKind::UnknownTarget, format!("No [[forward]] section has the name '{shown}'."))
    };
    let (who, ..) = write.who();
    app.state.forwards.pause(name, pause, &who).await?.ok_or_else(unknown)?;
    let target = app.state.forwards.targets().into_iter().find(|target| target.name == name);
    Ok(Json(target_view(app, target.ok_or_else(unknown)?).await?))
}

async fn target_view(app: &App, target: ForwardTargetNow) -> Result<ForwardTargetView, Failure> {
    let counts = app.state.store.forward_counts(&target.name).await?;
    let place = app.state.store.find_forward_target(&target.name).await?;
    let count = |state: ForwardState| {
        counts.states.get(state.name()).and_then(|number| u64::try_from(*number).ok()).unwrap_or(0)
    };
    Ok(ForwardTargetView {
        kind: match target.kind {
            ForwardKind::Sids => "sids",
            ForwardKind::Webhook => "webhook",
        }
        .to_owned(),
        leads_to: target.shown,
        live: target.live,
        paused_by: place.as_ref().and_then(|place| place.paused_by.clone()),
        paused_at: place.and_then(|place| place.paused_at_us).map(Time::from_unix_us),
        waiting: count(ForwardState::Waiting) + count(ForwardState::Sending),
        sent: count(ForwardState::Sent),
        unknown: count(ForwardState::Unknown),
        refused: count(ForwardState::Refused),
        dry: count(ForwardState::Dry),
        oldest_waiting_at: counts.oldest_waiting_us.map(Time::from_unix_us),
        last_sent_at: counts.last_sent_us.map(Time::from_unix_us),
        failing: target.failing,
        name: target.name,
    })
}

fn view(row: &ForwardRow) -> ForwardView {
    let number = |value: i64| u64::try_from(value).unwrap_or(0);
    ForwardView {
        id: number(row.id),
        target: row.target.clone(),
        state: row.state.clone(),
        satellite: row.satellite.clone(),
        frame: number(row.frame),
        source: row.source.clone(),
        receiver: row.receiver.clone(),
        received_at: Time::from_unix_us(row.received_at_us),
        made_at: Time::from_unix_us(row.made_at_us),
        attempts: number(row.attempts),
        sent_at: row.sent_at_us.map(Time::from_unix_us),
        error: row.error.clone(),
        message_id: row.message_id.clone(),
    }
}
