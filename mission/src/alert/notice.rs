//! Who is told what, and when: once when it comes, again when it gets worse, and when it is over.

use super::condition::AlertKind;
use super::model::{Alert, Told};
use super::policy::{Policy, Rule};
use crate::clock::UtcUs;
use crate::id::AlertId;
use crate::level::Level;

/// One message to one target.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Notice {
    /// About which alert.
    pub alert: AlertId,
    /// To whom.
    pub target: String,
    /// Why.
    pub kind: NoticeKind,
    /// How grave.
    pub level: Level,
    /// It waits for the end of the quiet hours, and goes with a digest.
    pub held: bool,
}

/// Why a target is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum NoticeKind {
    /// It came.
    Raised,
    /// It got worse.
    Worse,
    /// It came again.
    Again,
    /// It is over.
    Returned,
    /// Nobody has acknowledged it in time.
    Escalated,
}

impl NoticeKind {
    /// All kinds.
    pub const ALL: [Self; 5] = [Self::Raised, Self::Worse, Self::Again, Self::Returned, Self::Escalated];

    /// The word in the database and in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Raised => "raised",
            Self::Worse => "worse",
            Self::Again => "again",
            Self::Returned => "returned",
            Self::Escalated => "escalated",
        }
    }
}

/// What there is to tell of an alert now; notes that it was told. `ends`: there is no later.
pub(super) fn news(alert: &mut Alert, policy: &Policy, now: UtcUs, ends: bool) -> Option<NoticeKind> {
    if alert.shelved.is_some() {
        return None;
    }
    let settled =
        |told: &Told| ends || now.0.saturating_sub(told.at.0) >= i64::from(policy.settle_s) * 1_000_000;
    let kind = match &alert.told {
        None => NoticeKind::Raised,
        Some(told) if alert.level > told.level && (alert.active || alert.times > told.times) => {
            NoticeKind::Worse
        }
        Some(told) if !alert.active && told.active && settled(told) => NoticeKind::Returned,
        Some(told) if alert.active != told.active || (!alert.active && alert.times > told.times) => {
            // What came and went meanwhile, and what happened again, is told when the last word is old enough.
            let is_news = alert.active || !told.active;
            if !(is_news && settled(told)) {
                return None;
            }
            NoticeKind::Again
        }
        Some(_) => return None,
    };
    let level = alert.told.map_or(alert.level, |told| told.level.max(alert.level));
    alert.told = Some(Told { active: alert.active, level, times: alert.times, at: now });
    Some(kind)
}

/// When the next step of escalation is due.
pub(super) fn step_at(alert: &Alert, policy: &Policy, rule: Option<&Rule>) -> Option<UtcUs> {
    if !alert.wants_eyes() {
        return None;
    }
    let step = policy.escalate_of(rule).get(usize::try_from(alert.escalated).ok()?)?;
    Some(alert.waiting_since.plus(i64::from(step.after_min) * 60_000_000))
}

/// The step of escalation that is due; notes that it was taken.
pub(super) fn step_due<'p>(
    alert: &mut Alert,
    policy: &'p Policy,
    rule: Option<&'p Rule>,
    now: UtcUs,
) -> Option<&'p [String]> {
    if step_at(alert, policy, rule)? > now {
        return None;
    }
    let step = policy.escalate_of(rule).get(usize::try_from(alert.escalated).ok()?)?;
    alert.escalated = alert.escalated.saturating_add(1);
    Some(&step.to)
}

/// The messages to these targets: each that is there and takes this level, once.
pub(super) fn notices<'a>(
    alert: &'a Alert,
    kind: NoticeKind,
    to: &'a [String],
    policy: &'a Policy,
    now: UtcUs,
) -> impl Iterator<Item = Notice> + 'a {
    // Whoever heard that it came hears that it went.
    let weight = if kind == NoticeKind::Returned { alert.worst } else { alert.level };
    let quiet = policy.is_quiet(now) && weight < Level::Critical;
    let once = move |(at, name): &(usize, &String)| !to[..*at].contains(*name);
    // That messages do not reach a target is not told to that target.
    let reaches = |name: &&String| alert.kind != AlertKind::Delivery || alert.subject != **name;
    to.iter().enumerate().filter(once).map(|(_, name)| name).filter(reaches).filter_map(move |name| {
        let target = policy.target(name).filter(|target| weight >= target.min_level)?;
        Some(Notice {
            alert: alert.id,
            target: target.name.clone(),
            kind,
            level: weight,
            held: quiet && target.quiet,
        })
    })
}
