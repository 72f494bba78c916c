//! What is an alert, when, and who is to know: what the configuration says.

use super::condition::{AlertKind, Condition};
use super::quiet::QuietHours;
use crate::level::Level;
use crate::record::EventKind;

/// All rules and targets.
#[derive(Debug, Clone, PartialEq)]
pub struct Policy {
    /// The rules; of those that take a condition the last one counts, so built-in ones come first.
    pub rules: Vec<Rule>,
    /// Where messages go.
    pub targets: Vec<TargetPolicy>,
    /// Who is told at first, by name of the target, where a rule does not say it.
    pub notify: Vec<String>,
    /// Who is told later, while nobody acknowledges, where a rule does not say it.
    pub escalate: Vec<Escalation>,
    /// When only critical and severe alerts are sent at once.
    pub quiet_hours: Vec<QuietHours>,
    /// A change that is not for the worse is told this long after the last message at the earliest, seconds.
    pub settle_s: u32,
    /// Numbers of the kinds that have some.
    pub thresholds: Thresholds,
}

/// One rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Its name; no two have the same.
    pub name: String,
    /// What it watches.
    pub kind: AlertKind,
    /// It counts; one that does not silences its kind and subject.
    pub enabled: bool,
    /// Only this subject; `None`: all.
    pub subject: Option<String>,
    /// Of events: only these; empty for all. No meaning for other kinds.
    pub events: Vec<EventKind>,
    /// Conditions below this are no alerts.
    pub min_level: Level,
    /// The level of its alerts, whatever the condition says.
    pub level: Option<Level>,
    /// A condition must hold this long before it counts, seconds.
    pub on_delay_s: u32,
    /// It must be gone this long before it counts as gone, seconds.
    pub off_delay_s: u32,
    /// What returned to normal stays until somebody acknowledges. Otherwise it closes by itself after a while.
    pub latch: bool,
    /// Who is told at first; `None`: as the policy says.
    pub notify: Option<Vec<String>>,
    /// Who is told later; `None`: as the policy says.
    pub escalate: Option<Vec<Escalation>>,
}

/// A step of escalation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Escalation {
    /// After so many minutes without an acknowledgement.
    pub after_min: u32,
    /// These targets are told.
    pub to: Vec<String>,
}

/// What a target takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TargetPolicy {
    /// Its name.
    pub name: String,
    /// Nothing below this is sent to it.
    pub min_level: Level,
    /// Quiet hours hold for it.
    pub quiet: bool,
}

/// Numbers of the kinds that have some.
#[derive(Debug, Clone, PartialEq)]
pub struct Thresholds {
    /// Heartbeat periods in view without a frame.
    pub beacon_intervals: u32,
    /// Passes in a row without a frame: distress; twice as many: critical.
    pub silent_passes: u32,
    /// Passes that stay below this elevation say nothing about silence, degrees.
    pub min_elevation_deg: f64,
    /// Free space of the disk below which it is watch, warning and critical, percent.
    pub disk_free_percent: [f64; 3],
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            beacon_intervals: 2,
            silent_passes: 2,
            min_elevation_deg: 10.0,
            disk_free_percent: [10.0, 5.0, 2.0],
        }
    }
}

impl Rule {
    /// The rule of a kind as it is built in.
    #[must_use]
    pub fn built_in(kind: AlertKind) -> Self {
        let (on_delay_s, off_delay_s) = match kind {
            // Judged over samples or passes already.
            AlertKind::Limit | AlertKind::Beacon | AlertKind::Silent => (0, 0),
            // A station that starts may be given its elements a moment later.
            AlertKind::Elements => (120, 0),
            AlertKind::Disk => (60, 300),
            AlertKind::Storage => (5, 60),
            AlertKind::Clock => (600, 60),
            AlertKind::Link => (30, 60),
            AlertKind::Rotator => (15, 60),
            AlertKind::Sealing => (60, 0),
            AlertKind::Plan | AlertKind::Event | AlertKind::Backup | AlertKind::Ear | AlertKind::Delivery => {
                (0, 0)
            }
        };
        let (events, min_level) = match kind {
            AlertKind::Event => (vec![EventKind::SatelliteError, EventKind::ChunkConflict], Level::Warning),
            _ => (Vec::new(), Level::Watch),
        };
        Self {
            name: kind.name().to_owned(),
            kind,
            enabled: true,
            subject: None,
            events,
            min_level,
            level: None,
            on_delay_s,
            off_delay_s,
            latch: true,
            notify: None,
            escalate: None,
        }
    }

    fn takes(&self, condition: &Condition) -> bool {
        self.kind == condition.kind
            && self.subject.as_ref().is_none_or(|subject| *subject == condition.subject)
    }
}

impl Default for Policy {
    /// All built-in rules, no targets.
    fn default() -> Self {
        Self {
            rules: AlertKind::ALL.into_iter().map(Rule::built_in).collect(),
            targets: Vec::new(),
            notify: Vec::new(),
            escalate: Vec::new(),
            quiet_hours: Vec::new(),
            settle_s: 600,
            thresholds: Thresholds::default(),
        }
    }
}

impl Policy {
    /// The rule for a condition that is no event; `None`: it is no alert.
    pub(super) fn rule_for(&self, condition: &Condition) -> Option<&Rule> {
        let rule = self.rules.iter().rev().find(|rule| rule.takes(condition))?;
        (rule.enabled && condition.level >= rule.min_level.max(Level::Watch)).then_some(rule)
    }

    /// The rules for an event; each makes an alert of its own.
    pub(super) fn rules_for_event(
        &self,
        event: EventKind,
        level: Level,
        subject: &str,
    ) -> impl Iterator<Item = &Rule> {
        self.rules.iter().filter(move |rule| {
            rule.kind == AlertKind::Event
                && rule.enabled
                && (rule.events.is_empty() || rule.events.contains(&event))
                && rule.subject.as_deref().is_none_or(|wanted| wanted == subject)
                && level >= rule.min_level.max(Level::Watch)
        })
    }

    /// The rule of this name.
    #[must_use]
    pub fn rule(&self, name: &str) -> Option<&Rule> {
        self.rules.iter().find(|rule| rule.name == name)
    }

    /// Who is told at first of an alert of this rule. A rule that is gone tells whom the policy names.
    pub(super) fn notify_of<'p>(&'p self, rule: Option<&'p Rule>) -> &'p [String] {
        rule.and_then(|rule| rule.notify.as_deref()).unwrap_or(&self.notify)
    }

    /// Who is told later.
    pub(super) fn escalate_of<'p>(&'p self, rule: Option<&'p Rule>) -> &'p [Escalation] {
        rule.and_then(|rule| rule.escalate.as_deref()).unwrap_or(&self.escalate)
    }

    /// The target of this name.
    #[must_use]
    pub fn target(&self, name: &str) -> Option<&TargetPolicy> {
        self.targets.iter().find(|target| target.name == name)
    }

    /// Only critical and severe alerts are sent at once now.
    #[must_use]
    pub fn is_quiet(&self, now: crate::UtcUs) -> bool {
        self.quiet_hours.iter().any(|hours| hours.holds(now))
    }
}
