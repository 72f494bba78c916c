//! A schedule in the words of the API: the same from a server and from files.

use api::{ContactView, RefusedView, RivalView, Time};
use mission::schedule::{Contact, Cut, PassKey, Reason, Refused, Rival, Role};

fn time(us: i64) -> Time {
    Time::from_unix_us(us)
}

/// What is known of the plan that gets a contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Taker<'a> {
    /// It may run.
    pub(crate) armed: bool,
    /// Why it wants this pass.
    pub(crate) wants: &'a str,
}

/// A pass that was chosen.
pub(crate) fn contact(contact: &Contact, taker: Taker<'_>) -> ContactView {
    ContactView {
        satellite: contact.satellite.to_string(),
        station: contact.station.to_string(),
        antenna: contact.antenna.to_string(),
        start: time(contact.start.0),
        stop: time(contact.stop.0),
        plan: contact.plan.as_deref().map(str::to_owned),
        armed: taker.armed,
        why: why(contact, taker),
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
fn why(contact: &Contact, taker: Taker<'_>) -> String {
    let mut parts = vec![match &contact.role {
        Role::Ear(lead) => format!("an idle antenna listens along with {}", station_of(lead)),
        Role::Lead => taker.wants.to_owned(),
    }];
    parts.push(if contact.whole { "the whole pass" } else { "a part of the pass" }.to_owned());
    match contact.over.len() {
        0 => {}
        1 => parts.push("1 other pass was refused for it".to_owned()),
        n => parts.push(format!("{n} other passes were refused for it")),
    }
    if !taker.armed {
        parts.push("the plan is not armed, so nothing will happen".to_owned());
    }
    parts.retain(|part| !part.is_empty());
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

/// A pass that was refused.
pub(crate) fn refused(refused: &Refused) -> RefusedView {
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
        rivals: rivals.into_iter().map(rival).collect(),
    }
}

fn rival(rival: &Rival) -> RivalView {
    RivalView {
        satellite: rival.key.satellite.to_string(),
        antenna: rival.antenna.to_string(),
        start: time(rival.start.0),
        stop: time(rival.stop.0),
        worth: rival.worth.points(),
        kept: rival.kept,
    }
}
