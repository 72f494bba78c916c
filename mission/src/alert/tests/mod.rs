//! The machine by itself, in stepped time.

mod due;
mod escalation;
mod life;
mod noise;

use super::{Alert, AlertKind, Alerts, Changes, Condition, Notice, NoticeKind, Policy, Rule, TargetPolicy};
use crate::clock::{MonoUs, Now, UtcUs};
use crate::id::Principal;
use crate::level::Level;

/// Midnight of some day.
const DAY: i64 = 20_000 * 86_400;

/// So many seconds after it.
fn at(s: u64) -> Now {
    Now { mono: MonoUs(s * 1_000_000), utc: UtcUs((DAY + s.cast_signed()) * 1_000_000) }
}

fn target(name: &str) -> TargetPolicy {
    TargetPolicy { name: name.into(), min_level: Level::Watch, quiet: true }
}

/// Told at first: `chat`.
fn policy() -> Policy {
    Policy {
        targets: vec![target("chat"), target("lead"), target("phone")],
        notify: vec!["chat".into()],
        ..Policy::default()
    }
}

fn with(kind: AlertKind, change: impl FnOnce(&mut Rule)) -> Policy {
    let mut policy = policy();
    change(policy.rules.iter_mut().find(|rule| rule.kind == kind).unwrap());
    policy
}

fn machine(policy: Policy) -> Alerts {
    Alerts::new(policy, Vec::new(), 0, at(0))
}

fn condition(level: Level) -> Condition {
    Condition::new(AlertKind::Limit, "pixelsat-1 heartbeat.temp", level, format!("it is {level}"))
}

fn told(changes: &Changes) -> Vec<(NoticeKind, &str)> {
    changes.notices.iter().map(|notice| (notice.kind, notice.target.as_str())).collect()
}

fn only(alerts: &Alerts) -> Alert {
    let open: Vec<&Alert> = alerts.open().collect();
    assert_eq!(open.len(), 1, "{open:?}");
    open[0].clone()
}

fn anna() -> Principal {
    Principal::new("anna")
}
