//! `GET /api/v1/runs`: what became of plans in passes.

use std::collections::BTreeMap;

use api::{Page, PlanText, RunReport, RunView, StepReport};
use axum::Json;
use axum::extract::State;
use mission::plan::{RunEnd, StepEnd, StepResult, Ticket};
use mission::run::RunRecord;

use super::extract::{Id, ListQuery, Query, number, paged, time};
use super::problem::Failure;
use super::{App, commands, downloads};
use crate::storage::{PlanRow, RunRow, Store, StoreError};

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<ListQuery>,
) -> Result<Json<Page<RunView>>, Failure> {
    let page = asked.page()?;
    let store = &app.state.store;
    let mut names: BTreeMap<i64, String> = BTreeMap::new();
    let mut views = Vec::new();
    for row in store.runs(&asked.scope(), &page).await? {
        let name = match names.get(&row.plan) {
            Some(name) => name.clone(),
            None => {
                let name = plan_of(store, row.plan).await?.name;
                names.insert(row.plan, name.clone());
                name
            }
        };
        views.push(view(&row.record()?, name));
    }
    Ok(Json(paged(views, &page, |run: &RunView| run.id)))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<RunReport>, Failure> {
    let store = &app.state.store;
    let row = store.run(id.row()).await?.ok_or_else(|| Failure::no_such("run", id.0))?;
    let plan = plan_of(store, row.plan).await?;
    let text = plan.text()?;
    let heard = store.heard_between(&row.satellite, &row.station, row.aos_at_us, row.los_at_us).await?;
    let record = row.record()?;
    let (mut asked, mut ordered) = (Vec::new(), Vec::new());
    for ask in record.progress.asked.values() {
        let subject = |id: u64| i64::try_from(id).unwrap_or(i64::MAX);
        match ask.ticket {
            Ticket::Command(id) => {
                if let Some(life) = store.command(subject(id.0)).await? {
                    asked.push(commands::whole_life(&life)?);
                }
            }
            Ticket::Download(id) => ordered.extend(store.download(subject(id.0)).await?.map(downloads::view)),
        }
    }
    Ok(Json(RunReport {
        steps: record.progress.results.iter().map(|result| step(result, &text)).collect(),
        steps_dropped: record.progress.results_dropped,
        run: view(&record, plan.name),
        plan: text,
        commands: asked,
        downloads: ordered,
        frames_heard: number(heard.frames),
        chunks_gained: number(heard.chunks),
    }))
}

/// A run of the archive as the wire has it.
pub(super) async fn view_of(store: &Store, row: &RunRow) -> Result<RunView, StoreError> {
    let name = plan_of(store, row.plan).await?.name;
    Ok(view(&row.record()?, name))
}

async fn plan_of(store: &Store, id: i64) -> Result<PlanRow, StoreError> {
    let row = store.plan(id).await?;
    row.ok_or_else(|| StoreError::damaged(format!("plan {id} of a run is not in the archive")))
}

fn view(record: &RunRecord, name: String) -> RunView {
    let progress = &record.progress;
    RunView {
        id: record.id.0,
        plan: record.plan.0,
        name,
        satellite: record.satellite.to_string(),
        station: record.station.to_string(),
        link: record.link.as_ref().map(ToString::to_string),
        pass: record.pass.map(|pass| pass.0),
        aos: time(record.aos_at.0),
        los: time(record.los_at.0),
        state: record.state.name().to_owned(),
        why: record.state.why().map(str::to_owned),
        outcome: progress.end.as_ref().map(|end| end.name().to_owned()),
        outcome_why: progress.end.as_ref().and_then(outcome_why),
        started_at: progress.started_at.map(|at| time(at.0)),
        steps_ended: (progress.results.len() as u64).saturating_add(progress.results_dropped),
        at: time(record.at.0),
    }
}

fn outcome_why(end: &RunEnd) -> Option<String> {
    match end {
        RunEnd::Completed { failures: 0 } | RunEnd::OutOfTime | RunEnd::Unfinished | RunEnd::Later => None,
        RunEnd::Completed { failures: 1 } => Some("1 step failed and was passed over".to_owned()),
        RunEnd::Completed { failures } => Some(format!("{failures} steps failed and were passed over")),
        RunEnd::Aborted { step, why } => Some(format!("{step}: {why}")),
        RunEnd::Stopped(why) => Some(why.clone()),
    }
}

fn step(result: &StepResult, plan: &PlanText) -> StepReport {
    let (end, why) = match &result.end {
        StepEnd::Done => ("done", None),
        StepEnd::Partly(why) => ("partly", Some(why)),
        StepEnd::Skipped => ("skipped", None),
        StepEnd::Failed(why) => ("failed", Some(why)),
        StepEnd::Unfinished(why) => ("unfinished", Some(why)),
    };
    StepReport {
        what: what(plan, &result.step),
        step: result.step.clone(),
        rounds: result.rounds.clone(),
        entered_at: time(result.entered_at.0),
        ended_at: time(result.ended_at.0),
        end: end.to_owned(),
        why: why.cloned(),
    }
}

/// What the step at `steps[3].steps[0]` does: `command Ping`, `listen`.
fn what(plan: &PlanText, place: &str) -> Option<String> {
    let mut steps = Some(&plan.steps);
    let mut found = None;
    for part in place.split('.') {
        let index: usize = part.strip_prefix("steps[")?.strip_suffix(']')?.parse().ok()?;
        let step = steps?.get(index)?;
        steps = step.steps.as_ref();
        found = Some(step);
    }
    let step = found?;
    Some(match &step.command {
        Some(command) => format!("{} {command}", step.what),
        None => step.what.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_found_by_its_place() {
        let plan: PlanText = serde_json::from_value(serde_json::json!({
            "name": "a", "satellite": "s",
            "steps": [
                {"do": "listen", "for_s": 1},
                {"do": "repeat-until", "at_most": 2, "steps": [{"do": "command", "command": "Ping"}]},
            ],
        }))
        .unwrap();
        let told = |place: &str| what(&plan, place);
        assert_eq!(told("steps[0]").as_deref(), Some("listen"));
        assert_eq!(told("steps[1].steps[0]").as_deref(), Some("command Ping"));
        for nowhere in ["", "steps[2]", "steps[0].steps[0]", "steps[1].until", "steps[x]"] {
            assert_eq!(told(nowhere), None, "{nowhere}");
        }
    }
}
