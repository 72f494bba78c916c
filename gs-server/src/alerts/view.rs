//! An alert as it goes over the wire.

use api::{AlertView, Time};
use mission::UtcUs;
use mission::alert::Alert;

pub(crate) fn view(alert: &Alert) -> AlertView {
    let at = |at: Option<UtcUs>| at.map(|at| Time::from_unix_us(at.0));
    AlertView {
        id: alert.id.0,
        state: alert.state().name().to_owned(),
        level: alert.level.name().to_owned(),
        worst: alert.worst.name().to_owned(),
        active: alert.active,
        rule: alert.rule.clone(),
        kind: alert.kind.name().to_owned(),
        subject: alert.subject.clone(),
        satellite: alert.satellite.as_ref().map(ToString::to_string),
        message: alert.message.clone(),
        times: alert.times,
        raised_at: Time::from_unix_us(alert.raised_at.0),
        changed_at: Time::from_unix_us(alert.changed_at.0),
        returned_at: at(alert.returned_at),
        acknowledged_by: alert.acknowledged.as_ref().map(|signed| signed.who.to_string()),
        acknowledged_at: at(alert.acknowledged.as_ref().map(|signed| signed.at)),
        shelved_until: at(alert.shelved.as_ref().map(|shelf| shelf.until)),
        shelved_by: alert.shelved.as_ref().map(|shelf| shelf.who.to_string()),
        assignee: alert.assignee.clone(),
        note: alert.note.clone(),
        closed_at: at(alert.closed_at),
    }
}
