//! Whether a command that waits may go on: it may be out of time, out of date, or not wanted any more.

use std::borrow::Cow;

use protocol::Telecommand;

use super::Station;
use super::gate::Need;
use super::satellite::Prepared;
use crate::clock::{MonoUs, Now};
use crate::id::CommandId;
use crate::snapshot::SealedSnapshot;
use crate::stage::Stage;

/// Whoever queues a plan's commands is called so, before the plan's name.
pub(super) const BY_PLAN: &str = "plan:";
/// Two Resets are this far apart, in microseconds.
const RESETS_APART_US: i64 = 60_000_000;

impl Station {
    /// Bytes that were sealed in the last life may still be radiated: with the key of now, and nothing came after them.
    pub(super) fn may_go_on(&self, s: usize, sealed: &SealedSnapshot) -> bool {
        let sealer = self.satellites[s].sealer.as_ref();
        sealer.is_some_and(|sealer| sealer.id == sealed.key && sealer.is_newest(sealed.counter))
    }

    /// Why a command is not wanted on the air any more, though it was.
    pub(super) fn unwanted(&self, now: Now, s: usize, id: CommandId) -> Option<(Stage, &'static str)> {
        let sat = &self.satellites[s];
        let record = &sat.commands.get(&id)?.record;
        let is_over = |of| sat.download.as_ref().is_none_or(|active| active.record.id != of);
        if record.expires_at.is_some_and(|at| at <= now.utc) {
            Some((Stage::Expired, "its time ran out"))
        } else if record.download.is_some_and(is_over) {
            Some((Stage::Cancelled, "its download is over"))
        } else if self.is_left_by_plan(s, id) {
            Some((Stage::Cancelled, "its plan does not run any more"))
        } else {
            None
        }
    }

    /// A run asked for it, and the run is over.
    pub(super) fn is_left_by_plan(&self, s: usize, id: CommandId) -> bool {
        let Some(command) = self.satellites[s].commands.get(&id) else { return false };
        let is_of_plan =
            command.record.download.is_none() && command.record.principal.as_str().starts_with(BY_PLAN);
        is_of_plan && !self.runs.iter().any(|run| run.is_on() && run.asks_for(id))
    }

    /// Two Resets shortly after each other could not be told apart by telemetry: the second waits until then.
    pub(super) fn other_reset_until(&self, now: Now, s: usize, id: CommandId) -> Option<MonoUs> {
        let commands = &self.satellites[s].commands;
        if commands.get(&id)?.record.telecommand != Telecommand::Reset {
            return None;
        }
        let others =
            commands.values().filter(|c| c.record.id != id && c.record.telecommand == Telecommand::Reset);
        let newest_us = others.filter_map(|c| c.since_on_air_us(now)).min()?;
        let left_us = RESETS_APART_US.saturating_sub(newest_us).min(RESETS_APART_US);
        u64::try_from(left_us).ok().filter(|left| *left > 0).map(|left| now.mono.plus(left))
    }

    /// Why this frame must not be handed over any more.
    pub(super) fn no_more(&self, now: Now, s: usize, frame: &Prepared) -> Option<Cow<'static, str>> {
        let Some(command) = self.satellites[s].commands.get(&frame.command) else {
            return Some("the command is over".into());
        };
        if let Some((_, why)) = self.unwanted(now, s, frame.command) {
            return Some(why.into());
        }
        let answer_us = self.answer_us(s, frame.link, &command.record.telecommand);
        self.gate(now, s, frame.link, Need { gate: command.record.gate, answer_us })
            .err()
            .map(|wait| wait.why)
    }
}
