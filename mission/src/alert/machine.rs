//! The machine: conditions in, changes out.

use std::collections::BTreeMap;

use super::condition::{AlertKind, Condition};
use super::model::Alert;
use super::notice::{Notice, NoticeKind, news, notices, step_at, step_due};
use super::policy::{Policy, Rule};
use crate::clock::{MonoUs, Now, UtcUs};
use crate::id::{AlertId, SatelliteId};
use crate::level::Level;
use crate::record::EventKind;

/// What an input has changed. To be kept whole, before anybody is told.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// Alerts as they are now, each once.
    pub alerts: Vec<Alert>,
    /// Who is to be told what.
    pub notices: Vec<Notice>,
    /// What is to stand among the events: about whom, how grave, one sentence.
    pub events: Vec<(Option<SatelliteId>, Level, String)>,
}

impl Changes {
    /// Nothing has changed.
    pub fn is_empty(&self) -> bool {
        self.alerts.is_empty()
    }
}

/// A level that may come into force; `None`: gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Candidate {
    level: Option<Level>,
    since: MonoUs,
}

/// One rule and subject over time.
#[derive(Debug, Clone, Default)]
pub(super) struct Track {
    pub(super) alert: Option<Alert>,
    candidate: Option<Candidate>,
}

type Key = (String, String);

/// All alerts that are not history. See the [module](super).
#[derive(Debug, Clone)]
pub struct Alerts {
    policy: Policy,
    pub(super) tracks: BTreeMap<Key, Track>,
    last_id: u64,
}

impl Alerts {
    /// The machine with the alerts that were open, and the highest number ever given.
    #[must_use]
    pub fn new(policy: Policy, open: Vec<Alert>, last_id: u64, _now: Now) -> Self {
        let tracks = open.into_iter().filter(|alert| alert.closed_at.is_none()).map(|alert| {
            let key = (alert.rule.clone(), alert.subject.clone());
            (key, Track { alert: Some(alert), candidate: None })
        });
        Self { policy, tracks: tracks.collect(), last_id }
    }

    /// The alerts that are not history.
    pub fn open(&self) -> impl Iterator<Item = &Alert> {
        self.tracks.values().filter_map(|track| track.alert.as_ref())
    }

    /// What it goes by.
    #[must_use]
    pub fn policy(&self) -> &Policy {
        &self.policy
    }

    /// Takes **all** that holds now. What held and is not among it is over.
    pub fn observe(&mut self, now: Now, conditions: &[Condition]) -> Changes {
        let mut wanted: BTreeMap<Key, (Level, &Condition)> = BTreeMap::new();
        for condition in conditions {
            let Some(rule) = self.policy.rule_for(condition) else { continue };
            let level = rule.level.unwrap_or(condition.level);
            let found =
                wanted.entry((rule.name.clone(), condition.subject.clone())).or_insert((level, condition));
            if level > found.0 {
                *found = (level, condition);
            }
        }
        for key in wanted.keys() {
            self.tracks.entry(key.clone()).or_default();
        }
        let mut changes = Changes::default();
        let keys: Vec<Key> = self.tracks.keys().cloned().collect();
        for key in keys {
            let found = wanted.get(&key);
            self.weigh(
                now,
                &key,
                found.map(|(level, _)| *level),
                found.map(|(_, condition)| *condition),
                &mut changes,
            );
        }
        self.settle(now, &mut changes);
        changes
    }

    /// Takes what has merely happened. It makes an alert that has returned already, or counts with the one that is open.
    pub fn happened(&mut self, now: Now, condition: &Condition) -> Changes {
        let mut changes = Changes::default();
        if let Some(rule) = self.policy.rule_for(condition).cloned() {
            self.occurred(now, &rule, condition, &mut changes);
        }
        self.settle(now, &mut changes);
        changes
    }

    /// Takes an event of the station, as [`Self::happened`], by every rule that names it.
    pub fn event(&mut self, now: Now, event: EventKind, condition: &Condition) -> Changes {
        let mut changes = Changes::default();
        if event != EventKind::Alert {
            let rules: Vec<Rule> =
                self.policy.rules_for_event(event, condition.level, &condition.subject).cloned().collect();
            for rule in rules {
                self.occurred(now, &rule, condition, &mut changes);
            }
        }
        self.settle(now, &mut changes);
        changes
    }

    /// Lets time pass: shelves end, escalation goes on, what is over closes.
    pub fn tick(&mut self, now: Now) -> Changes {
        let mut changes = Changes::default();
        self.settle(now, &mut changes);
        changes
    }

    /// When time alone changes something next, if nothing else happens: a delay is over, a shelf ends, a step of escalation
    /// or a message is due, what is over closes.
    #[must_use]
    pub fn next_due(&self, now: Now) -> Option<UtcUs> {
        let dues = self.tracks.iter().flat_map(|((rule, _), track)| {
            let rule = self.policy.rule(rule);
            let alert = track.alert.as_ref();
            [
                track.candidate.map(|candidate| weighed_at(candidate, alert, rule, now)),
                alert.and_then(|alert| alert.shelved.as_ref()).map(|shelf| shelf.until),
                alert.and_then(|alert| step_at(alert, &self.policy, rule)),
                alert.and_then(|alert| alert.told).map(|told| told.at.plus(us_signed(self.policy.settle_s))),
                alert.and_then(|alert| alert.returned_at).map(|at| at.plus(us_signed(self.policy.settle_s))),
            ]
        });
        dues.flatten().filter(|due| *due > now.utc).min()
    }

    /// Weighs what a track should be against what it is, over time.
    fn weigh(
        &mut self,
        now: Now,
        key: &Key,
        wanted: Option<Level>,
        condition: Option<&Condition>,
        changes: &mut Changes,
    ) {
        let rule = self.policy.rule(&key.0);
        let (on_us, off_us) = rule.map_or((0, 0), |rule| (us(rule.on_delay_s), us(rule.off_delay_s)));
        let Some(track) = self.tracks.get_mut(key) else { return };
        let held = track.alert.as_ref().filter(|alert| alert.active).map(|alert| alert.level);
        if wanted == held {
            track.candidate = None;
            return;
        }
        let rises = wanted > held;
        let before = track.candidate.filter(|candidate| (candidate.level > held) == rises);
        let candidate = match before {
            // The mildest of those on one side is what has lasted.
            Some(before) => Candidate {
                level: if rises { before.level.min(wanted) } else { before.level.max(wanted) },
                since: before.since,
            },
            None => Candidate { level: wanted, since: now.mono },
        };
        track.candidate = Some(candidate);
        if now.mono.since(candidate.since) < if rises { on_us } else { off_us } {
            return;
        }
        track.candidate = None;
        match (candidate.level, condition, &mut track.alert) {
            (None, _, Some(alert)) => {
                alert.active = false;
                (alert.returned_at, alert.changed_at) = (Some(now.utc), now.utc);
                changes.note(alert, Level::Normal, "returned to normal");
            }
            (Some(level), Some(condition), Some(alert)) => {
                let (came, worse) = (!alert.active, level > alert.level);
                if came {
                    alert.times = alert.times.saturating_add(1);
                }
                if (came || worse) && alert.acknowledged.take().is_some() {
                    (alert.waiting_since, alert.escalated) = (now.utc, 0);
                }
                (alert.active, alert.returned_at) = (true, None);
                alert.level = level;
                alert.worst = alert.worst.max(level);
                alert.message.clone_from(&condition.message);
                alert.changed_at = now.utc;
                let word = if came {
                    "is back"
                } else if worse {
                    "is worse"
                } else {
                    "is milder"
                };
                changes.note(alert, level, word);
            }
            (Some(level), Some(condition), none) => {
                self.last_id += 1;
                let id = AlertId(self.last_id);
                let alert = fresh(id, key, condition, level, true, now);
                changes.note(&alert, level, "raised");
                *none = Some(alert);
            }
            // A milder level that lasted, and now it is gone: that has to last, too.
            (Some(_), None, _) => track.candidate = Some(Candidate { level: None, since: now.mono }),
            (None, _, None) => {}
        }
    }

    fn occurred(&mut self, now: Now, rule: &Rule, condition: &Condition, changes: &mut Changes) {
        let level = rule.level.unwrap_or(condition.level);
        let key = (rule.name.clone(), condition.subject.clone());
        let track = self.tracks.entry(key.clone()).or_default();
        let alert = match &mut track.alert {
            Some(alert) => {
                alert.times = alert.times.saturating_add(1);
                if alert.acknowledged.take().is_some() {
                    (alert.waiting_since, alert.escalated) = (now.utc, 0);
                }
                alert.level = level;
                alert.worst = alert.worst.max(level);
                alert.message.clone_from(&condition.message);
                (alert.changed_at, alert.returned_at) = (now.utc, Some(now.utc));
                alert
            }
            none => {
                self.last_id += 1;
                none.insert(fresh(AlertId(self.last_id), &key, condition, level, false, now))
            }
        };
        let word = if alert.times > 1 { "happened again" } else { "raised" };
        changes.note(alert, level, word);
    }

    /// What time alone does, and who is to be told of it all.
    pub(super) fn settle(&mut self, now: Now, changes: &mut Changes) {
        let policy = &self.policy;
        for track in self.tracks.values_mut() {
            let Some(alert) = &mut track.alert else { continue };
            let rule = policy.rule(&alert.rule);
            if alert.shelved.as_ref().is_some_and(|shelf| now.utc >= shelf.until) {
                alert.shelved = None;
                (alert.waiting_since, alert.escalated) = (now.utc, 0);
                changes.note(alert, alert.level, "left its shelf");
            }
            let ends = alert.shelved.is_none() && !alert.active && is_over(alert, rule, policy, now);
            if let Some(kind) = news(alert, policy, now.utc, ends) {
                changes.notices.extend(notices(alert, kind, policy.notify_of(rule), policy, now.utc));
                changes.keep(alert);
            }
            while let Some(to) = step_due(alert, policy, rule, now.utc) {
                changes.notices.extend(notices(alert, NoticeKind::Escalated, to, policy, now.utc));
                changes.note(alert, alert.level, "was not acknowledged in time");
            }
            if ends {
                alert.closed_at = Some(now.utc);
                changes.keep(alert);
            }
        }
        self.tracks.retain(|_, track| {
            track.candidate.is_some() || track.alert.as_ref().is_some_and(|alert| alert.closed_at.is_none())
        });
        // A candidate outlives the alert that is history.
        for track in self.tracks.values_mut() {
            if track.alert.as_ref().is_some_and(|alert| alert.closed_at.is_some()) {
                track.alert = None;
            }
        }
    }
}

/// When a candidate has lasted long enough.
fn weighed_at(candidate: Candidate, alert: Option<&Alert>, rule: Option<&Rule>, now: Now) -> UtcUs {
    let held = alert.filter(|alert| alert.active).map(|alert| alert.level);
    let delay_s =
        rule.map_or(0, |rule| if candidate.level > held { rule.on_delay_s } else { rule.off_delay_s });
    let left_us = us(delay_s).saturating_sub(now.mono.since(candidate.since));
    now.utc.plus(i64::try_from(left_us).unwrap_or(i64::MAX))
}

/// Over, and known to somebody, or of a kind that nobody needs to have known.
fn is_over(alert: &Alert, rule: Option<&Rule>, policy: &Policy, now: Now) -> bool {
    if alert.acknowledged.is_some() {
        return true;
    }
    let returned = alert.returned_at.unwrap_or(alert.changed_at);
    rule.is_some_and(|rule| !rule.latch) && now.utc.0.saturating_sub(returned.0) >= us_signed(policy.settle_s)
}

fn fresh(id: AlertId, key: &Key, condition: &Condition, level: Level, active: bool, now: Now) -> Alert {
    Alert {
        id,
        rule: key.0.clone(),
        kind: condition.kind,
        subject: key.1.clone(),
        satellite: condition.satellite.clone(),
        level,
        worst: level,
        active,
        message: condition.message.clone(),
        times: 1,
        raised_at: now.utc,
        changed_at: now.utc,
        waiting_since: now.utc,
        returned_at: (!active).then_some(now.utc),
        acknowledged: None,
        shelved: None,
        assignee: None,
        note: None,
        closed_at: None,
        told: None,
        escalated: 0,
    }
}

const fn us(seconds: u32) -> u64 {
    seconds as u64 * 1_000_000
}

const fn us_signed(seconds: u32) -> i64 {
    seconds as i64 * 1_000_000
}

impl Changes {
    /// This alert has changed.
    pub(super) fn keep(&mut self, alert: &Alert) {
        match self.alerts.iter_mut().find(|kept| kept.id == alert.id) {
            Some(kept) => kept.clone_from(alert),
            None => self.alerts.push(alert.clone()),
        }
    }

    /// This alert has changed, and the events say so.
    pub(super) fn note(&mut self, alert: &Alert, level: Level, what: &str) {
        self.keep(alert);
        let about = if alert.kind == AlertKind::Event || alert.subject.is_empty() {
            alert.kind.name().to_owned()
        } else {
            format!("{} {}", alert.kind, alert.subject)
        };
        let message = format!("alert {} ({about}) {what}: {}", alert.id, alert.message);
        self.events.push((alert.satellite.clone(), level, message));
    }
}
