//! `/api/v1/alerts`: what should not be, who knows of it, and who is told.

use api::{
    AlertNote, AlertView, AssignRequest, Nothing, Page, ProblemKind, ShelveRequest, TargetTested, TargetView,
};
use axum::Json;
use axum::extract::State;
use axum::http::HeaderValue;
use axum::response::{IntoResponse as _, Response};
use mission::alert::ActionError;
use mission::{AlertId, Level, UtcUs};
use serde::de::DeserializeOwned;

use super::App;
use super::extract::{Id, Name, Query, list_query, paged, whole};
use super::problem::Failure;
use super::write::{IDEMPOTENCY_REPLAYED, Write};
use crate::alerts::{Action, ActionFailure, TestFailure, view};
use crate::config::TargetKind;
use crate::storage::AlertQuery;

list_query! { Asked { state: String, satellite: String, level: String } }

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<Page<AlertView>>, Failure> {
    let wrong = |field, message: String| Failure::field(ProblemKind::BadParameter, field, message);
    let open = match asked.state.as_deref() {
        None | Some("open") => Some(true),
        Some("closed") => Some(false),
        Some("all") => None,
        Some(other) => {
            let shown: String = other.chars().take(40).collect();
            return Err(wrong("state", format!("'{shown}' is none; there are open, closed and all")));
        }
    };
    let level = asked.level.as_deref().map_or(Ok(Level::Normal), str::parse);
    let (during, page) = (asked.during()?, asked.page()?);
    let query = AlertQuery {
        open,
        satellite: asked.satellite,
        level: level.map_err(|error: mission::level::UnknownLevel| wrong("level", error.to_string()))?,
        during,
        page,
    };
    let alerts = app.state.store.alerts(&query).await?;
    let views = alerts.iter().map(view).collect();
    Ok(Json(paged(views, &query.page, |alert: &AlertView| alert.id)))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<AlertView>, Failure> {
    let alert = app.state.store.alert(id.row()).await?;
    Ok(Json(view(&alert.ok_or_else(|| Failure::no_such("alert", id.0))?)))
}

pub(super) async fn acknowledge(
    State(app): State<App>,
    id: Id,
    write: Write<AlertNote>,
) -> Result<Response, Failure> {
    let note = write.body.note.clone();
    act(&app, id, Action::Acknowledge, note, write).await
}

pub(super) async fn shelve(
    State(app): State<App>,
    id: Id,
    write: Write<ShelveRequest>,
) -> Result<Response, Failure> {
    let (until, note) = (UtcUs(write.body.until.unix_us()), write.body.note.clone());
    act(&app, id, Action::Shelve { until }, note, write).await
}

pub(super) async fn unshelve(
    State(app): State<App>,
    id: Id,
    write: Write<AlertNote>,
) -> Result<Response, Failure> {
    let note = write.body.note.clone();
    act(&app, id, Action::Unshelve, note, write).await
}

pub(super) async fn assign(
    State(app): State<App>,
    id: Id,
    write: Write<AssignRequest>,
) -> Result<Response, Failure> {
    let AssignRequest { to, note } = write.body.clone();
    act(&app, id, Action::Assign { to }, note, write).await
}

async fn act<T: DeserializeOwned>(
    app: &App,
    id: Id,
    action: Action,
    note: Option<String>,
    write: Write<T>,
) -> Result<Response, Failure> {
    if app.state.store.alert(id.row()).await?.is_none() {
        return Err(Failure::no_such("alert", id.0));
    }
    let done = app.state.alerts.act(AlertId(id.0), action, note, write.who()).await?;
    let mut response = Json(view(&done.alert)).into_response();
    if done.replayed {
        response.headers_mut().insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
    }
    Ok(response)
}

pub(super) async fn targets(State(app): State<App>) -> Json<Page<TargetView>> {
    let views = app.state.alerts.targets().into_iter().map(|target| TargetView {
        name: target.name,
        kind: kind(target.kind).to_owned(),
        leads_to: target.shown,
        failing: target.failing,
    });
    Json(whole(views.collect()))
}

/// Sends a message that says that nothing is wrong. Not kept and not repeated: whoever asks waits for what comes of it.
pub(super) async fn test(
    State(app): State<App>,
    Name(target): Name,
    write: Write<Nothing>,
) -> Result<Json<TargetTested>, Failure> {
    let (who, ..) = write.who();
    app.state.alerts.test(&target, &who).await.map_err(|error| {
        let kind = match error {
            TestFailure::Unknown(_) => ProblemKind::UnknownTarget,
            TestFailure::Busy => ProblemKind::Overloaded,
            TestFailure::Failed { .. } => ProblemKind::DeliveryFailed,
        };
        Failure::new(kind, error.to_string())
    })?;
    Ok(Json(TargetTested { target }))
}

const fn kind(kind: TargetKind) -> &'static str {
    match kind {
        TargetKind::Email => "email",
        TargetKind::Webhook => "webhook",
        TargetKind::Matrix => "matrix",
        TargetKind::Slack => "slack",
        TargetKind::Discord => "discord",
    }
}

impl From<ActionFailure> for Failure {
    fn from(error: ActionFailure) -> Self {
        let kind = match &error {
            ActionFailure::Refused(ActionError::NotOpen(_)) => ProblemKind::AlertNotOpen,
            ActionFailure::Refused(ActionError::Shelf) => {
                return Self::field(ProblemKind::BadArgument, "until", error.to_string());
            }
            ActionFailure::Refused(ActionError::TooLong) => {
                return Self::field(ProblemKind::BadArgument, "note", error.to_string());
            }
            ActionFailure::KeyReused => ProblemKind::IdempotencyKeyReused,
            ActionFailure::Overloaded => ProblemKind::Overloaded,
            ActionFailure::Storage => ProblemKind::StorageFailing,
            ActionFailure::Stopping => ProblemKind::Stopping,
        };
        Self::new(kind, error.to_string())
    }
}
