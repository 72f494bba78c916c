//! `GET /api/v1/schedule`: which plan gets which pass, and why.

use api::{ContactView, RefusedView, RivalView, ScheduleView};
use axum::Json;
use axum::extract::State;
use mission::Status;
use mission::schedule::{Contact, Cut, PassKey, Reason, Refused, Rival, Role};

use super::App;
use super::extract::time;

pub(super) async fn get(State(app): State<App>) -> Json<ScheduleView> {
    let status = app.state.engine.status();
    let schedule = &status.schedule;
    Json(ScheduleView {
        station: status.station.to_string(),
        at: time(app.state.timer.now().utc.0),
        contacts: schedule.contacts.iter().map(|contact| contact_view(contact, &status)).collect(),
        refused: schedule.refused.iter().map(refused_view).collect(),
        worth: schedule.worth.points(),
        bound: schedule.bound.points(),
        gap: schedule.gap(),
        proved: schedule.is_proved(),
    })
}

fn contact_view(contact: &Contact, status: &Status) -> ContactView {
    let plan = contact.plan.as_deref();
    let held = status.plans.iter().find(|held| Some(held.plan.name.as_str()) == plan);
    let armed = held.is_some_and(|held| held.armed);
    let picked = held
        .is_some_and(|held| held.picks.iter().any(|pick| contact.start <= *pick && *pick <= contact.stop));
    ContactView {
        satellite: contact.satellite.to_string(),
        station: contact.station.to_string(),
        antenna: contact.antenna.to_string(),
        start: time(contact.start.0),
        stop: time(contact.stop.0),
        plan: plan.map(str::to_owned),
        armed,
        why: why(contact, armed, picked),
        cut_start: contact.cut_start.as_ref().map(|cut| cut_text(cut, "before")),
        cut_stop: contact.cut_stop.as_ref().map(|cut| cut_text(cut, "next")),
        kept: contact.kept,
        listens_along: matches!(contact.role, Role::Ear(_)),
        worth: contact.worth.points(),
        transmit_from: contact.transmit.map(|window| time(window.start.0)),
        transmit_until: contact.transmit.map(|window| time(window.stop.0)),
        refused_for_it: contact.over.len() as u64,
    }
}

/// `an operator chose it; the whole pass; 1 other pass was refused for it`.
fn why(contact: &Contact, armed: bool, picked: bool) -> String {
    let mut parts = vec![match &contact.role {
        Role::Ear(lead) => format!("an idle antenna listens along with {}", station_of(lead)),
        Role::Lead if picked => "an operator chose it for the plan".to_owned(),
        Role::Lead => "the plan's own rule takes it".to_owned(),
    }];
    parts.push(if contact.whole { "the whole pass" } else { "a part of the pass" }.to_owned());
    match contact.over.len() {
        0 => {}
        1 => parts.push("1 other pass was refused for it".to_owned()),
        n => parts.push(format!("{n} other passes were refused for it")),
    }
    if !armed {
        parts.push("the plan is not armed, so nothing will happen".to_owned());
    }
    parts.join("; ")
}

fn station_of(key: &PassKey) -> &str {
    key.station.as_str()
}

fn cut_text(cut: &Cut, order: &str) -> String {
    match cut {
        Cut::Contact(key) => format!("the antenna serves {} {order}", key.satellite),
        Cut::Closed(why) => why.clone(),
    }
}

fn refused_view(refused: &Refused) -> RefusedView {
    let rivals: Vec<&Rival> = match &refused.reason {
        Reason::Loses { to } => to.iter().collect(),
        Reason::HeardElsewhere(lead) => vec![lead],
        Reason::Invalid(_)
        | Reason::NoAntenna
        | Reason::Unfit(_)
        | Reason::Closed { .. }
        | Reason::TooShort { .. } => Vec::new(),
    };
    RefusedView {
        satellite: refused.satellite.to_string(),
        station: refused.station.to_string(),
        aos: time(refused.aos.0),
        los: time(refused.los.0),
        plan: refused.plan.as_deref().map(str::to_owned),
        why: refused.to_string(),
        worth: refused.worth.points(),
        rivals: rivals.into_iter().map(rival_view).collect(),
    }
}

fn rival_view(rival: &Rival) -> RivalView {
    RivalView {
        satellite: rival.key.satellite.to_string(),
        antenna: rival.antenna.to_string(),
        start: time(rival.start.0),
        stop: time(rival.stop.0),
        worth: rival.worth.points(),
        kept: rival.kept,
    }
}
