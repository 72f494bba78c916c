//! `GET /api/v1/runs`: what became of plans in passes.

use std::collections::BTreeMap;

use api::{Page, RunReport, RunView};
use axum::Json;
use axum::extract::State;
use mission::plan::Ticket;

use super::extract::{Id, ListQuery, Query, number, paged};
use super::problem::Failure;
use super::{App, commands, downloads};
use crate::report::{run_view, step_report};
use crate::storage::{PlanRow, RunRow, Store, StoreError};

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<ListQuery>,
) -> Result<Json<Page<RunView>>, Failure> {
    let page = asked.page()?;
    let store = &app.state.store;
    let mut names: BTreeMap<i64, String> = BTreeMap::new();
    let mut views = Vec::new();
    for row in store.runs(&asked.scope()?, &page).await? {
        let name = match names.get(&row.plan) {
            Some(name) => name.clone(),
            None => {
                let name = plan_of(store, row.plan).await?.name;
                names.insert(row.plan, name.clone());
                name
            }
        };
        views.push(run_view(&row.record()?, name));
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
        steps: record.progress.results.iter().map(|result| step_report(result, &text)).collect(),
        steps_dropped: record.progress.results_dropped,
        run: run_view(&record, plan.name),
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
    Ok(run_view(&row.record()?, name))
}

async fn plan_of(store: &Store, id: i64) -> Result<PlanRow, StoreError> {
    let row = store.plan(id).await?;
    row.ok_or_else(|| StoreError::damaged(format!("plan {id} of a run is not in the archive")))
}
