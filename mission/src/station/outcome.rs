//! How commands reach their stages, and how they end: answered, disproved, out of time, or honestly unknown.

use protocol::Telecommand;

use super::intake::Heard;
use super::satellite::{Command, Exchange, Satellite};
use super::{About, Station};
use crate::clock::{MonoUs, Now, UtcUs};
use crate::id::{CommandId, FrameId, Principal};
use crate::level::Level;
use crate::record::{EventKind, Record, StageRecord, Subject};
use crate::stage::Stage;

/// An unknown outcome may be settled by telemetry for this long; then the command is forgotten (the archive keeps it).
const UNKNOWN_KEPT_US: i64 = 24 * 3_600 * 1_000_000;
/// Of the machine's own requests nothing but a late answer can tell more: microseconds.
const REQUEST_KEPT_US: i64 = 300_000_000;
/// So many unknown outcomes are kept for telemetry to settle; the oldest go first.
const UNKNOWN_MAX: usize = 256;
/// Slack when uptime is held against the clock.
const UPTIME_SLACK_US: i64 = 2_000_000;
/// A satellite that obeys a Reset has booted within this time.
const BOOT_WITHIN_US: i64 = 20_000_000;
/// An idempotent command that nobody answered waits this long before it is repeated.
const REPEAT_AFTER_US: u64 = 1_000_000;

impl Station {
    /// Appends a stage by the machine's own doing.
    pub(super) fn stage(
        &mut self,
        now: Now,
        s: usize,
        command: CommandId,
        stage: Stage,
        why: &str,
        frame: Option<FrameId>,
    ) {
        let who = self.me.clone();
        self.stage_by(now, s, command, stage, &who, why, frame);
    }

    /// Appends a stage, with its event. What is over is forgotten here; the archive keeps it.
    #[expect(clippy::too_many_arguments, reason = "a stage is who, when, what, why and its proof")]
    pub(super) fn stage_by(
        &mut self,
        now: Now,
        s: usize,
        id: CommandId,
        stage: Stage,
        who: &Principal,
        why: &str,
        frame: Option<FrameId>,
    ) {
        let sat = &mut self.satellites[s];
        let Some(command) = sat.commands.get_mut(&id) else { return };
        let idempotent = command.record.telecommand.is_idempotent();
        if !command.stage.may_be_followed_by(stage, idempotent) {
            debug_assert!(false, "command {id}: {} cannot be followed by {stage}", command.stage);
            return;
        }
        command.stage = stage;
        command.stage_at = now.utc;
        let record = StageRecord {
            command: id,
            attempt: command.attempt,
            stage,
            at: now.utc,
            who: who.clone(),
            why: why.to_owned(),
            frame,
        };
        let message = format!("{} (command {id}) is {stage}: {why}", command.record.telecommand.name());
        let about = About {
            route: Some(command.record.route.clone()),
            key: Some(command.record.key),
            subject: Subject { frame, command: Some(id), ..Subject::default() },
        };
        if stage.is_final() && stage != Stage::Unknown {
            sat.commands.remove(&id);
        }
        self.journal.push(Record::Stage(record));
        for run in &mut self.runs {
            run.note_stage(id, stage);
        }
        let level = match stage {
            Stage::Failed | Stage::Rejected => Level::Warning,
            Stage::Unknown | Stage::Expired => Level::Watch,
            _ => Level::Normal,
        };
        self.event(now.utc, EventKind::CommandStage, level, about, message);
    }

    /// Nobody answered in time, or nobody knows whether it was radiated: unknown, and again if that is harmless.
    pub(super) fn unanswered(&mut self, now: Now, s: usize, id: CommandId, why: &str) {
        let Some(command) = self.satellites[s].commands.get(&id) else { return };
        if command.stage.is_final() {
            return;
        }
        let again = command.may_repeat() && !self.is_left_by_plan(s, id);
        let (attempt, allowed) = (command.attempt, command.record.attempts_allowed);
        self.stage(now, s, id, Stage::Unknown, why, None);
        if again {
            let why = format!("attempt {} of {allowed} follows, with a new tag and nonce", attempt + 1);
            self.stage(now, s, id, Stage::Queued, &why, None);
            if let Some(command) = self.satellites[s].commands.get_mut(&id) {
                command.not_before = now.mono.plus(REPEAT_AFTER_US);
            }
        }
    }

    /// What waits too long expires, and what stayed unknown for a day is left to the archive.
    pub(super) fn expire(&mut self, now: Now, s: usize) {
        let sat = &mut self.satellites[s];
        sat.forget_unknown(now);
        let in_hand = sat.outstanding();
        let mut expired = Vec::new();
        let mut next: Option<i64> = None;
        for command in sat.commands.values() {
            let waits = matches!(command.stage, Stage::Queued | Stage::Sealed);
            match command.record.expires_at {
                Some(at) if waits && at <= now.utc => expired.push(command.record.id),
                Some(at) if waits => next = Some(next.map_or(at.0, |n| n.min(at.0))),
                _ => {}
            }
        }
        if let Some(at) = next {
            sat.wake_at(mono_of(now, UtcUs(at)));
        }
        let me = self.me.clone();
        for id in expired {
            // Sealed, and on its way to the radio: it stops here. Once marked it is `radiating`, and no part of this.
            if in_hand == Some(id) {
                self.satellites[s].exchange = Exchange::Idle;
            }
            self.give_up(now, s, id, Stage::Expired, &me, "its time ran out before it could be radiated");
        }
    }

    /// It will not be radiated any more: `stage` if it never was, unknown if an earlier attempt may have been obeyed.
    pub(super) fn give_up(
        &mut self,
        now: Now,
        s: usize,
        id: CommandId,
        stage: Stage,
        who: &Principal,
        why: &str,
    ) {
        let Some(command) = self.satellites[s].commands.get(&id) else { return };
        if command.on_air_at.is_some() {
            let why = format!("{why}; an earlier attempt may have been obeyed");
            self.stage_by(now, s, id, Stage::Unknown, who, &why, None);
        } else {
            self.stage_by(now, s, id, stage, who, why, None);
        }
    }

    /// Outcomes that were left to telemetry, and did not show in time.
    pub(super) fn settle_overdue(&mut self, now: Now, s: usize) {
        let sat = &mut self.satellites[s];
        let (over, still) =
            std::mem::take(&mut sat.settling).into_iter().partition(|w| w.deadline <= now.mono);
        sat.settling = still;
        let over: Vec<_> = over;
        if let Some(at) = sat.settling.iter().map(|w| w.deadline).min() {
            sat.wake_at(at);
        }
        for waiting in over {
            self.unanswered(now, s, waiting.command, "neither an answer nor telemetry told in time");
        }
    }

    /// A heartbeat tells whether the satellite was reset, and whether it still transmits.
    pub(super) fn settle_by_heartbeat(&mut self, heard: &Heard, s: usize, uptime_ms: u32) {
        let sat = &self.satellites[s];
        let now = heard.at.utc;
        let mut proofs = Vec::new();
        for command in sat.commands.values() {
            let Some(since_us) = command.since_on_air_us(heard.at) else { continue };
            if !matches!(command.stage, Stage::Radiated | Stage::Unknown) || since_us <= 0 {
                continue;
            }
            match command.record.telecommand {
                Telecommand::Reset => {
                    let uptime_us = i64::from(uptime_ms) * 1_000;
                    let wraps = sat.uptime.is_some_and(|(at, before)| {
                        i64::from(before)
                            .saturating_add(now.0.saturating_sub(at.0) / 1_000 + UPTIME_SLACK_US / 1_000)
                            > i64::from(u32::MAX)
                    });
                    // How long after the radiation the satellite booted; negative: it has run since before.
                    let booted_after_us = since_us.saturating_sub(uptime_us);
                    if wraps {
                        // The 49.7-day wrap looks like a reset: it proves nothing.
                    } else if booted_after_us < -UPTIME_SLACK_US && since_us <= 2 * UPTIME_SLACK_US {
                        // This heartbeat may have waited in the satellite's radio since before the reset.
                    } else if booted_after_us < -UPTIME_SLACK_US {
                        let why =
                            format!("the heartbeat shows an uptime of {} s: no reset", uptime_ms / 1_000);
                        proofs.push((command.record.id, Stage::Failed, why));
                    } else if booted_after_us < BOOT_WITHIN_US {
                        let why = format!("the heartbeat shows an uptime of {} s", uptime_ms / 1_000);
                        proofs.push((command.record.id, Stage::Answered, why));
                    }
                    // Booted much later: another reset did that, and has wiped out what this one may have done.
                }
                Telecommand::SetTransmitter { on: false } if since_us > 2 * UPTIME_SLACK_US => {
                    let why = "a heartbeat was heard after it: the satellite still transmits".to_owned();
                    proofs.push((command.record.id, Stage::Failed, why));
                }
                _ => {}
            }
        }
        for (id, stage, why) in proofs {
            self.stage(heard.at, s, id, stage, &why, Some(heard.id));
            self.satellites[s].settling.retain(|w| w.command != id);
        }
    }
}

impl Satellite {
    /// What stayed unknown is left to the archive after a day, or when there is too much of it. A clock that steps leaves
    /// nothing behind for ever: what lies a day ahead goes as well.
    fn forget_unknown(&mut self, now: Now) {
        let kept_us = |c: &Command| match c.record.download {
            Some(_) => REQUEST_KEPT_US.unsigned_abs(),
            None => UNKNOWN_KEPT_US.unsigned_abs(),
        };
        let is_over =
            |c: &Command| c.stage == Stage::Unknown && now.utc.0.abs_diff(c.stage_at.0) > kept_us(c);
        self.commands.retain(|_, c| !is_over(c));
        let unknown = self.commands.values().filter(|c| c.stage == Stage::Unknown).count();
        let mut surplus = unknown.saturating_sub(UNKNOWN_MAX);
        if surplus > 0 {
            self.commands.retain(|_, c| {
                let goes = c.stage == Stage::Unknown && surplus > 0;
                surplus -= usize::from(goes);
                !goes
            });
        }
    }
}

/// The monotonic time at which UTC will be `at`, if it does not step.
pub(super) fn mono_of(now: Now, at: UtcUs) -> MonoUs {
    now.mono.plus(u64::try_from(at.0.saturating_sub(now.utc.0)).unwrap_or(0))
}
