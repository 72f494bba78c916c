//! `/api/v1/plans`: plans handed over, armed, attached, withdrawn; and taking a satellite out of a plan's hands.

use api::{AttachRequest, Nothing, Page, PlanText, PlanView, ProblemKind};
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use mission::plan::{CheckContext, Severity};
use mission::status::PlanStatus;
use mission::{Intent, PlanName, UtcUs};

use super::App;
use super::extract::{Name, Query, Within, satellite, time, whole};
use super::problem::Failure;
use super::write::Write;
use crate::plan::check_words;
use crate::storage::StoreError;

/// Those in use.
pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Within>,
) -> Result<Json<Page<PlanView>>, Failure> {
    let during = asked.during()?;
    let status = app.state.engine.status();
    let mut views = Vec::with_capacity(status.plans.len());
    for plan in status.plans.iter().filter(|plan| during.holds(plan.added_at.0)) {
        views.push(view(&app, plan).await?);
    }
    Ok(Json(whole(views)))
}

async fn view(app: &App, status: &PlanStatus) -> Result<PlanView, Failure> {
    let id = status.id.0;
    let row = app.state.store.plan(i64::try_from(id).unwrap_or(i64::MAX)).await?;
    let row =
        row.ok_or_else(|| StoreError::damaged(format!("plan {id} is in use and not in the archive")))?;
    Ok(PlanView {
        id,
        name: status.plan.name.to_string(),
        satellite: status.plan.satellite.to_string(),
        armed: status.armed,
        added_at: time(status.added_at.0),
        added_by: status.who.to_string(),
        picks: status.picks.iter().map(|pick| time(pick.0)).collect(),
        plan: row.text()?,
        station: row.station,
    })
}

pub(super) async fn add(State(app): State<App>, write: Write<PlanText>) -> Result<Response, Failure> {
    let words = &write.body;
    let id = satellite(&app, Some(&words.satellite))?;
    let known = app.state.identity.satellites.iter().find(|known| known.id == id);
    let context = CheckContext {
        timing: known.map(|known| known.timing).unwrap_or_default(),
        profile: known.map(|known| known.profile),
        pass: None,
        // What lies in the past the engine finds, and only of a plan that is new: an answer is repeated at any time.
        now: None,
    };
    let (plan, mut findings) = check_words(words, &context);
    findings.retain(|finding| finding.severity == Severity::Error);
    let plan = match plan {
        Some(plan) if findings.is_empty() => plan,
        _ => return Err(Failure::findings(ProblemKind::PlanRefused, &findings)),
    };
    let text = serde_json::to_string(words).map_err(|error| {
        tracing::error!(%error, "A plan that was read cannot be written.");
        Failure::new(ProblemKind::Internal, "The plan cannot be written.")
    })?;
    write.submit(&app, Intent::AddPlan { plan: plan.into(), text: text.into() }).await
}

pub(super) async fn withdraw(
    State(app): State<App>,
    name: Name,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    write.submit(&app, Intent::WithdrawPlan(plan_name(&name)?)).await
}

pub(super) async fn arm(
    State(app): State<App>,
    name: Name,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    write.submit(&app, Intent::ArmPlan { plan: plan_name(&name)?, armed: true }).await
}

pub(super) async fn disarm(
    State(app): State<App>,
    name: Name,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    write.submit(&app, Intent::ArmPlan { plan: plan_name(&name)?, armed: false }).await
}

pub(super) async fn attach(
    State(app): State<App>,
    name: Name,
    write: Write<AttachRequest>,
) -> Result<Response, Failure> {
    choose(&app, &name, write, true).await
}

pub(super) async fn detach(
    State(app): State<App>,
    name: Name,
    write: Write<AttachRequest>,
) -> Result<Response, Failure> {
    choose(&app, &name, write, false).await
}

async fn choose(
    app: &App,
    name: &Name,
    write: Write<AttachRequest>,
    attach: bool,
) -> Result<Response, Failure> {
    let at = UtcUs(write.body.at.unix_us());
    write.submit(app, Intent::AttachPlan { plan: plan_name(name)?, at, attach }).await
}

pub(super) async fn hold(
    State(app): State<App>,
    name: Name,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    take_over(&app, &name, write, true).await
}

pub(super) async fn release(
    State(app): State<App>,
    name: Name,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    take_over(&app, &name, write, false).await
}

async fn take_over(
    app: &App,
    Name(name): &Name,
    write: Write<Nothing>,
    held: bool,
) -> Result<Response, Failure> {
    let satellite = satellite(app, Some(name))?;
    write.submit(app, Intent::TakeOver { satellite, held }).await
}

/// A plan's name; whether there is such a plan is the engine's business.
fn plan_name(Name(name): &Name) -> Result<PlanName, Failure> {
    PlanName::new(name).map_err(|error| Failure::field(ProblemKind::UnknownPlan, "plan", error.to_string()))
}
