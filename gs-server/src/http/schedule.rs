//! `GET /api/v1/schedule`: which plan gets which pass, and why.

use api::{ClosedView, ContactView, OpenView, ScheduleView};
use axum::Json;
use axum::extract::State;
use mission::Status;
use mission::schedule::{Contact, Window};

use super::App;
use super::extract::time;
use crate::schedule::{self, Taker};

pub(super) async fn get(State(app): State<App>) -> Json<ScheduleView> {
    let status = app.state.engine.status();
    let drawn = &status.schedule;
    let times = &app.state.identity.times;
    Json(ScheduleView {
        station: status.station.to_string(),
        at: time(app.state.timer.now().utc.0),
        contacts: drawn.contacts.iter().map(|contact| contact_view(contact, &status)).collect(),
        refused: drawn.refused.iter().map(schedule::refused).collect(),
        worth: drawn.worth.points(),
        bound: drawn.bound.points(),
        gap: drawn.gap(),
        proved: drawn.is_proved(),
        closed: times.blackouts.iter().map(|(window, why)| closed(*window, why)).collect(),
        licence: times.licence.as_ref().map(|open| open.iter().copied().map(opened).collect()),
    })
}

fn closed(window: Window, why: &str) -> ClosedView {
    ClosedView { start: time(window.start.0), stop: time(window.stop.0), why: why.to_owned() }
}

fn opened(window: Window) -> OpenView {
    OpenView { start: time(window.start.0), stop: time(window.stop.0) }
}

fn contact_view(contact: &Contact, status: &Status) -> ContactView {
    let plan = contact.plan.as_deref();
    let held = status.plans.iter().find(|held| Some(held.plan.name.as_str()) == plan);
    let picked = held
        .is_some_and(|held| held.picks.iter().any(|pick| contact.start <= *pick && *pick <= contact.stop));
    let wants = if picked { "an operator chose it for the plan" } else { "the plan's own rule takes it" };
    schedule::contact(contact, Taker { armed: held.is_some_and(|held| held.armed), wants })
}
