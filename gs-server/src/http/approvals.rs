//! `/api/v1/approvals`: what waits for a second person. `/api/v1/transmissions`: who answered for what.

use api::{ApprovalView, ApproveRequest, Outcome, Page, RefuseRequest, TransmissionView};
use axum::Json;
use axum::extract::State;

use super::App;
use super::admit::may;
use super::extract::{Id, ListQuery, Query, list_query, number, paged, small, time};
use super::problem::Failure;
use super::release::{release, remake};
use super::write::Write;
use crate::people::{Caller, Decision, People, Right};
use crate::storage::{ApprovalRow, TransmissionRow};

list_query! {
    Which {
        /// `true`: only what still waits.
        open: bool,
    }
}

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Which>,
) -> Result<Json<Page<ApprovalView>>, Failure> {
    let people = &app.state.people;
    let page = asked.page()?;
    let during = asked.during()?;
    let rows = people.approvals(asked.open.unwrap_or(false), &during, &page).await?;
    let views = rows.iter().map(|row| view(people, row)).collect();
    Ok(Json(paged(views, &page, |approval: &ApprovalView| approval.id)))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<ApprovalView>, Failure> {
    let people = &app.state.people;
    Ok(Json(view(people, &people.approval(id.row()).await?)))
}

/// Yes. The answer is what the engine made of it.
pub(super) async fn approve(
    State(app): State<App>,
    id: Id,
    caller: Caller,
    write: Write<ApproveRequest>,
) -> Result<Json<Outcome>, Failure> {
    let people = &app.state.people;
    // From the look at what it is to the engine's answer no plan is exchanged.
    let _same_plans = people.releasing().await;
    let row = people.approval(id.row()).await?;
    let intent = remake(&app, &row).await?;
    let decision = Decision::Approve { digest: &write.body.digest };
    let row = people.decide(&caller, id.row(), decision).await?;
    release(&app, &row, intent).await.map(Json)
}

/// No, or never mind.
pub(super) async fn refuse(
    State(app): State<App>,
    id: Id,
    caller: Caller,
    write: Write<RefuseRequest>,
) -> Result<Json<ApprovalView>, Failure> {
    let people = &app.state.people;
    let row = people.approval(id.row()).await?;
    if row.principal != caller.name() {
        may(&caller, Right::Approve)?;
    }
    let why = write.body.why.as_deref().unwrap_or("");
    let row = people.decide(&caller, id.row(), Decision::Refuse { why }).await?;
    Ok(Json(view(people, &row)))
}

/// Who answered for each radiation, by the numbers of the commands.
pub(super) async fn transmissions(
    State(app): State<App>,
    Query(asked): Query<ListQuery>,
) -> Result<Json<Page<TransmissionView>>, Failure> {
    let page = asked.page()?;
    let mut rows = app.state.store.transmissions(&asked.scope()?, &page).await?;
    // A command's attempts stay together: those of one that may be cut off come with the next page.
    let last = rows.last().map(|row| row.command);
    let is_full = rows.len() >= page.limit as usize;
    let is_whole = !is_full || rows.first().map(|row| row.command) == last;
    if !is_whole {
        rows.retain(|row| Some(row.command) != last);
    }
    let next = rows.last().filter(|_| is_full).map(|row| number(row.command));
    Ok(Json(Page { items: rows.into_iter().map(transmission).collect(), next }))
}

fn transmission(row: TransmissionRow) -> TransmissionView {
    TransmissionView {
        command: number(row.command),
        attempt: small(row.attempt),
        satellite: row.satellite,
        station: row.station,
        link: row.link,
        at: time(row.at_us),
        principal: row.principal,
        person: row.person,
        call_sign: row.call_sign,
        licence: row.licence,
    }
}

pub(super) fn view(people: &People, row: &ApprovalRow) -> ApprovalView {
    ApprovalView {
        id: number(row.id),
        kind: row.kind.clone(),
        summary: row.summary.clone(),
        request: serde_json::from_str(&row.request).unwrap_or_default(),
        digest: hex::encode(&row.digest),
        principal: row.principal.clone(),
        person: row.person.clone(),
        asked_at: time(row.asked_at_us),
        expires_at: time(row.expires_at_us),
        state: people.state_of(row).name().to_owned(),
        decided_by: row.decided_by.clone(),
        decided_at: row.decided_at_us.map(time),
        why: row.why.clone(),
        command: row.command.map(number),
    }
}
