//! Alerts in words.

use api::Time;
use mission::alert::{Alert, Notice, NoticeKind};
use mission::{Level, Principal, UtcUs};
use serde_json::json;

use super::target::Letter;
use crate::storage::{Delivery, DeliveryRow, DeliveryState};

/// Messages that a digest tells one by one; of the rest it tells the number.
const DIGEST_MAX: usize = 100;

/// The shape beside the word: neither depends on colour.
pub(crate) const fn shape(level: Level) -> &'static str {
    match level {
        Level::Normal => "·",
        Level::Watch => "○",
        Level::Warning => "△",
        Level::Distress => "◇",
        Level::Critical => "⬠",
        Level::Severe => "■",
    }
}

fn marked(station: &str, simulated: bool) -> String {
    if simulated { format!("[SIMULATED {station}]") } else { format!("[{station}]") }
}

/// A message about an alert, to be kept and sent.
pub(super) fn delivery(
    (station, simulated): (&str, bool),
    alert: &Alert,
    notice: &Notice,
    now: UtcUs,
) -> Delivery {
    let word = match notice.kind {
        NoticeKind::Raised => "",
        NoticeKind::Worse => ", worse",
        NoticeKind::Again => ", again",
        NoticeKind::Returned => ", returned to normal",
        NoticeKind::Escalated => ", not acknowledged",
    };
    let level = alert.level;
    let title = format!(
        "{} {} {}: {} {}{word}",
        marked(station, simulated),
        shape(level),
        level.name().to_uppercase(),
        alert.kind,
        alert.subject
    );
    let at = |at: UtcUs| Time::from_unix_us(at.0);
    let mut body = format!("{}\n\n", alert.message);
    body.push_str(&format!("Raised {}", at(alert.raised_at)));
    if alert.times > 1 {
        body.push_str(&format!(", {} times", alert.times));
    }
    if let Some(returned) = alert.returned_at.filter(|_| notice.kind == NoticeKind::Returned) {
        body.push_str(&format!(", over since {}", at(returned)));
    }
    if let Some(assignee) = &alert.assignee {
        body.push_str(&format!(". It is {assignee}'s"));
    }
    body.push_str(".\n");
    if alert.acknowledged.is_none() {
        body.push_str(&format!("Take note of it: gs-server alert acknowledge {}\n", alert.id));
    }
    Delivery {
        message_id: uuid::Uuid::new_v4().to_string(),
        alert: Some(alert.id),
        target: notice.target.clone(),
        what: notice.kind.name(),
        level: notice.level,
        title: one_line(&title),
        body,
        made_at: now,
        state: if notice.held { DeliveryState::Held } else { DeliveryState::Waiting },
    }
}

/// Title and text of a digest.
pub(super) fn digest((station, simulated): (&str, bool), held: &[DeliveryRow]) -> (String, String) {
    let title = format!("{} {} messages of the quiet hours", marked(station, simulated), held.len());
    let mut body = String::new();
    let skipped = held.len().saturating_sub(DIGEST_MAX);
    if skipped > 0 {
        body.push_str(&format!(
            "The first {skipped} are left out here; `gs-server alert list --all` has them.\n"
        ));
    }
    for row in &held[skipped..] {
        let title = row.title.split_once("] ").map_or(row.title.as_str(), |(_, title)| title);
        let sentence = row.body.lines().next().unwrap_or_default();
        body.push_str(&format!("{} {title}\n  {sentence}\n", Time::from_unix_us(row.made_at_us)));
    }
    (title, body)
}

/// What a test says.
pub(super) fn test(station: &str, simulated: bool, who: &Principal, now: UtcUs) -> Letter {
    Letter {
        message_id: uuid::Uuid::new_v4().to_string(),
        kind: "alert.test".to_owned(),
        title: one_line(&format!("{} test of the alerts", marked(station, simulated))),
        text: format!("{who} has asked for this message. Nothing is wrong.\n"),
        made_at_us: now.0,
        data: json!({ "station": station, "simulated": simulated }),
    }
}

/// A kept message, with what programs read.
pub(super) fn letter(row: &DeliveryRow, alert: Option<&Alert>, simulated: bool) -> Letter {
    let alert = alert.map(|alert| {
        json!({
            "id": alert.id.0,
            "rule": alert.rule,
            "kind": alert.kind.name(),
            "subject": alert.subject,
            "satellite": alert.satellite.as_ref().map(ToString::to_string),
            "raised_at": Time::from_unix_us(alert.raised_at.0),
            "message": alert.message,
        })
    });
    Letter {
        message_id: row.message_id.clone(),
        kind: format!("alert.{}", row.what),
        title: row.title.clone(),
        text: row.body.clone(),
        made_at_us: row.made_at_us,
        data: json!({
            "station": row.station,
            "simulated": simulated,
            "level": row.level,
            "alert": alert,
        }),
    }
}

/// A message that the archive has not taken.
pub(super) fn unkept(delivery: &Delivery, station: &str, simulated: bool) -> Letter {
    Letter {
        message_id: delivery.message_id.clone(),
        kind: format!("alert.{}", delivery.what),
        title: delivery.title.clone(),
        text: delivery.body.clone(),
        made_at_us: delivery.made_at.0,
        data: json!({
            "station": station,
            "simulated": simulated,
            "level": delivery.level.name(),
            "alert": null,
        }),
    }
}

/// A title goes into headers.
fn one_line(text: &str) -> String {
    text.chars().take(200).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
