//! What each kind of step does, until it ends.

use protocol::Telecommand;

use super::asks::Asked;
use super::{Move, PlanRun};
use crate::clock::UtcUs;
use crate::plan::condition::{Condition, Holds, seconds};
use crate::plan::progress::{Frame, StepEnd};
use crate::plan::step::{Ordinal, Send, Step};
use crate::plan::view::{RunView, Wish};

/// A clock setting that waits longer than this would set an old time.
const STAMP_FRESH_US: i64 = 15_000_000;

const NO_TRANSMIT: &str = "the plan says transmit = false";

impl PlanRun {
    /// The conditions of the current step: `Some` is what must be done instead of beginning it.
    pub(super) fn not_before(
        &mut self,
        view: &RunView<'_>,
        when: &Condition,
        wishes: &mut Vec<Wish>,
    ) -> Option<Move> {
        match when.holds(view) {
            Holds::Yes => None,
            Holds::NotYet { look_after_us, .. } => Some(Move::Wait(look_after_us)),
            Holds::Never(why) => Some(self.fail(view, self.deepest(), why, wishes)),
        }
    }

    /// Marks the current step as begun once its conditions hold.
    pub(super) fn begin(
        &mut self,
        view: &RunView<'_>,
        step: &Step,
        wishes: &mut Vec<Wish>,
    ) -> Result<u64, Move> {
        let depth = self.deepest();
        if let Some(begun_us) = self.progress.cursor[depth].begun_us {
            return Ok(begun_us);
        }
        if let Some(instead) = self.not_before(view, &step.when, wishes) {
            return Err(instead);
        }
        self.progress.cursor[depth].begun_us = Some(self.progress.ran_us);
        self.revision += 1;
        Ok(self.progress.ran_us)
    }

    pub(super) fn enter(
        &mut self,
        view: &RunView<'_>,
        step: &Step,
        steps: &[Step],
        at_most: u32,
        wishes: &mut Vec<Wish>,
    ) -> Move {
        if let Err(instead) = self.begin(view, step, wishes) {
            return instead;
        }
        if steps.is_empty() || at_most == 0 {
            return self.done(view, self.deepest(), StepEnd::Done);
        }
        self.progress.cursor.push(Frame::default());
        Move::On
    }

    /// Listening, and waiting for something.
    pub(super) fn time_passes(
        &mut self,
        view: &RunView<'_>,
        step: &Step,
        length_us: u64,
        until: Option<&Condition>,
        wishes: &mut Vec<Wish>,
    ) -> Move {
        let begun_us = match self.begin(view, step, wishes) {
            Ok(begun_us) => begun_us,
            Err(instead) => return instead,
        };
        let left_us = begun_us.saturating_add(length_us).saturating_sub(self.progress.ran_us);
        match until.map(|until| until.holds(view)) {
            Some(Holds::Yes) => self.done(view, self.deepest(), StepEnd::Done),
            Some(Holds::Never(why)) => self.fail(view, self.deepest(), why, wishes),
            Some(Holds::NotYet { why, .. }) if left_us == 0 => {
                let why = format!("waited {} s in vain: {why}", seconds(length_us));
                self.fail(view, self.deepest(), why, wishes)
            }
            Some(Holds::NotYet { look_after_us, .. }) => {
                Move::Wait(Some(look_after_us.map_or(left_us, |look| look.min(left_us))))
            }
            None if left_us == 0 => self.done(view, self.deepest(), StepEnd::Done),
            None => Move::Wait(Some(left_us)),
        }
    }

    pub(super) fn send(
        &mut self,
        view: &RunView<'_>,
        step: &Step,
        send: &Send,
        wishes: &mut Vec<Wish>,
    ) -> Move {
        let depth = self.deepest();
        let part = self.progress.cursor[depth].part;
        let Some(telecommand) = send.telecommands.get(part as usize) else {
            return self.done(view, depth, StepEnd::Done);
        };
        let ordinal = self.ordinal();
        match self.asked(view, ordinal, Some(telecommand)) {
            Some(Asked::Done) => {
                self.progress.cursor[depth].part = part.saturating_add(1);
                Move::On
            }
            Some(Asked::Failed(why)) => self.fail(view, depth, why, wishes),
            Some(Asked::Pending) => Move::Wait(None),
            None if view.held => Move::Wait(None),
            None => {
                if let Err(instead) = self.begin(view, step, wishes) {
                    return instead;
                }
                if let Some(instead) = self.not_before(view, &step.when, wishes) {
                    return instead;
                }
                if let Err(why) = self.may_send(view, send, telecommand) {
                    return self.fail(view, depth, why, wishes);
                }
                let wish = self.command(view, ordinal, send, telecommand);
                self.wish(ordinal, wish, wishes);
                Move::Wait(None)
            }
        }
    }

    pub(super) fn download(&mut self, view: &RunView<'_>, step: &Step, wishes: &mut Vec<Wish>) -> Move {
        let depth = self.deepest();
        let ordinal = self.ordinal();
        match self.asked(view, ordinal, None) {
            Some(Asked::Done) => self.done(view, depth, StepEnd::Done),
            Some(Asked::Failed(why)) => self.fail(view, depth, why, wishes),
            Some(Asked::Pending) => Move::Wait(None),
            None if view.held => Move::Wait(None),
            None => {
                if let Err(instead) = self.begin(view, step, wishes) {
                    return instead;
                }
                if let Some(instead) = self.not_before(view, &step.when, wishes) {
                    return instead;
                }
                if !self.plan.transmit {
                    return self.fail(view, depth, NO_TRANSMIT.to_owned(), wishes);
                }
                let wish = Wish::Download { ordinal, step: self.current_step() };
                self.wish(ordinal, wish, wishes);
                Move::Wait(None)
            }
        }
    }

    pub(super) fn wish(&mut self, ordinal: Ordinal, wish: Wish, wishes: &mut Vec<Wish>) {
        self.wished.insert(ordinal);
        self.revision += 1;
        wishes.push(wish);
    }

    pub(super) fn command(
        &self,
        view: &RunView<'_>,
        ordinal: Ordinal,
        send: &Send,
        telecommand: &Telecommand,
    ) -> Wish {
        let utc = view.now.utc;
        let mut expires_at = view.window.los;
        if let Some(left_us) = self.until_a_limit(&self.plan) {
            expires_at = expires_at.min(utc.plus(i64::try_from(left_us).unwrap_or(i64::MAX)));
        }
        if let Some(limit_us) = self.plan.limit_us {
            let left_us = limit_us.saturating_sub(self.progress.ran_us);
            expires_at = expires_at.min(utc.plus(i64::try_from(left_us).unwrap_or(i64::MAX)));
        }
        let mut attempts = send.attempts;
        let mut telecommand = telecommand.clone();
        if let Telecommand::SetTimestamp { utc_ms } = &mut telecommand
            && *utc_ms == 0
        {
            *utc_ms = u64::try_from(utc.0 / 1000).unwrap_or(0);
            // Repeated later it would set the clock back.
            attempts = Some(1);
            expires_at = expires_at.min(utc.plus(STAMP_FRESH_US));
        }
        let critical = telecommand.is_critical();
        Wish::Command {
            ordinal,
            step: self.current_step(),
            telecommand,
            priority: send.priority.unwrap_or(self.plan.priority),
            attempts,
            gate: send.gate,
            expires_at,
            approved_by: send.approval.as_ref().filter(|_| critical).map(|approval| approval.by.clone()),
        }
    }

    /// What the checker said already, once more before it matters.
    pub(super) fn may_send(
        &self,
        view: &RunView<'_>,
        send: &Send,
        telecommand: &Telecommand,
    ) -> Result<(), String> {
        if !self.plan.transmit {
            return Err(NO_TRANSMIT.to_owned());
        }
        if telecommand.is_critical() {
            let Some(approval) = &send.approval else {
                return Err(format!("{} is critical, and nobody approved it", telecommand.name()));
            };
            approval.allows(&send.telecommands, Some(view.now.utc))?;
        }
        match first_past_entry(telecommand, view.now.utc) {
            Some(entry) => Err(format!("entry {entry} of the schedule lies in the past")),
            None => Ok(()),
        }
    }
}

/// The first entry of a schedule that is not ahead of `now`, from 0.
pub(in crate::plan) fn first_past_entry(telecommand: &Telecommand, now: UtcUs) -> Option<usize> {
    let is_past = |ms: u64| i64::try_from(ms).is_ok_and(|ms| ms.saturating_mul(1000) <= now.0);
    match telecommand {
        Telecommand::SetDownlinkSchedule(schedule) => {
            schedule.slots.iter().position(|slot| is_past(slot.time_ms))
        }
        Telecommand::UploadSchedule(upload) => upload.entries.iter().position(|entry| is_past(entry.time_ms)),
        _ => None,
    }
}
