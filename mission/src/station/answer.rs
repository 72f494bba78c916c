//! After the hand-over: what the radio says, and how long the satellite's answer is awaited.

use protocol::{Answer, FRAME_LEN, Telecommand};

use super::Station;
use super::satellite::{Awaited, Exchange, Prepared, Settling, chunks_asked, setting};
use crate::clock::{MonoUs, Now};
use crate::id::{CommandId, TxId};
use crate::port::MaybeRadiated;
use crate::stage::Stage;

/// A picture may take this long.
const CAPTURE_US: u64 = 15_000_000;
/// Answers that are further away than this do not hold up the uplink.
const HOLD_US: u64 = 20_000_000;
/// Telemetry has so many heartbeat periods to tell an outcome.
const SETTLE_PERIODS: u64 = 3;

impl Station {
    /// A command that sets something was radiated: what waits to be repeated and sets the same thing is out of date, and
    /// would undo it.
    fn supersede(&mut self, now: Now, s: usize, by: CommandId) {
        let commands = &self.satellites[s].commands;
        let Some(set) = commands.get(&by).and_then(|c| setting(&c.record.telecommand)) else { return };
        let is_old = |id: CommandId| {
            id != by
                && commands.get(&id).is_some_and(|c| {
                    c.stage == Stage::Queued
                        && c.on_air_at.is_some()
                        && setting(&c.record.telecommand) == Some(set)
                })
        };
        let old: Vec<CommandId> = commands.keys().copied().filter(|id| is_old(*id)).collect();
        for id in old {
            let why = format!("command {by} sets the same thing and went out after it: it is not repeated");
            self.stage(now, s, id, Stage::Unknown, &why, None);
        }
    }

    fn exchange_of(&self, tx: TxId) -> Option<(usize, Prepared)> {
        self.satellites.iter().enumerate().find_map(|(s, sat)| match &sat.exchange {
            Exchange::OnAir { frame, tx: on_air, .. } if *on_air == tx => Some((s, frame.clone())),
            _ => None,
        })
    }

    pub(super) fn tx_started(&mut self, tx: TxId) {
        if let Some((s, _)) = self.exchange_of(tx) {
            self.satellites[s].note = "on the air".to_owned();
        }
    }

    pub(super) fn tx_done(&mut self, now: Now, tx: TxId, airtime_us: u64) {
        let Some((s, frame)) = self.exchange_of(tx) else { return };
        let link = &mut self.links[frame.link];
        link.on_air = None;
        link.radiated += 1;
        link.airtime_us = link.airtime_us.saturating_add(airtime_us);
        self.supersede(now, s, frame.command);
        let sat = &mut self.satellites[s];
        let open = sat.commands.get_mut(&frame.command).filter(|c| c.stage == Stage::Radiating);
        let is_open = open.is_some();
        if let Some(command) = open {
            command.goes_on_air(now);
        }
        if is_open {
            let why = format!("{} ms on the air", airtime_us / 1_000);
            self.stage(now, s, frame.command, Stage::Radiated, &why, None);
        }
        self.await_answer(now, s, &frame);
    }

    pub(super) fn tx_failed(&mut self, now: Now, tx: TxId, radiated: MaybeRadiated, reason: &str) {
        let Some((s, frame)) = self.exchange_of(tx) else { return };
        self.links[frame.link].on_air = None;
        let still_open =
            self.satellites[s].commands.get(&frame.command).is_some_and(|c| c.stage == Stage::Radiating);
        match radiated {
            MaybeRadiated::No if still_open => {
                self.unseal(now, s, frame.command, &format!("nothing was radiated: {reason}"));
            }
            MaybeRadiated::No => self.satellites[s].exchange = Exchange::Idle,
            MaybeRadiated::Maybe => {
                // It may be on its way: leave the satellite the time to answer, whatever is done next.
                self.supersede(now, s, frame.command);
                self.await_answer(now, s, &frame);
                if let Exchange::Awaiting(awaited) = &self.satellites[s].exchange {
                    let until = awaited.deadline;
                    let contact = &mut self.satellites[s].contact;
                    contact.quiet_until = contact.quiet_until.max(until);
                }
                self.satellites[s].exchange = Exchange::Idle;
                self.satellites[s].settling.retain(|w| w.command != frame.command);
                if still_open {
                    self.unanswered(now, s, frame.command, &format!("it may have been radiated: {reason}"));
                }
            }
        }
    }

    /// The bytes have left: wait for what the satellite says to them.
    fn await_answer(&mut self, now: Now, s: usize, frame: &Prepared) {
        let link = &self.links[frame.link];
        let margin_us = link.margin_us();
        let sat = &self.satellites[s];
        let Some(command) = sat.commands.get(&frame.command) else {
            // Answered before the radio had reported.
            self.satellites[s].exchange = Exchange::Idle;
            return;
        };
        let answer = command.record.telecommand.answer();
        let answer_us = self.answer_us(s, frame.link, &command.record.telecommand);
        let settle_us = sat.profile.heartbeat_period_us.saturating_mul(SETTLE_PERIODS);
        let settling = |busy_until, deadline| Settling {
            command: frame.command,
            tag: frame.tag,
            answer,
            busy_until,
            deadline,
        };
        let expected = now.mono.plus(answer_us);
        match answer {
            Answer::None => {
                let waiting = settling(None, now.mono.plus(settle_us));
                self.satellites[s].settling.push(waiting);
                self.satellites[s].exchange = Exchange::Idle;
            }
            Answer::One(_) if answer_us > HOLD_US && sat.profile.tags => {
                let busy = (MonoUs(expected.0.saturating_sub(3_000_000)), expected.plus(margin_us));
                let waiting = settling(Some(busy), expected.plus(margin_us));
                self.satellites[s].settling.push(waiting);
                self.satellites[s].exchange = Exchange::Idle;
            }
            _ => {
                let chunks_in_image = sat.image.as_ref().map(|image| image.record.chunks);
                let chunks = chunks_asked(&command.record.telecommand, chunks_in_image);
                self.satellites[s].exchange = Exchange::Awaiting(Awaited {
                    command: frame.command,
                    link: frame.link,
                    tag: frame.tag,
                    answer,
                    chunks,
                    got: 0,
                    deadline: expected.plus(margin_us),
                });
            }
        }
    }

    /// From the end of our transmission to the expected end of the answer, delivered to us.
    pub(super) fn answer_us(&self, s: usize, l: usize, telecommand: &Telecommand) -> u64 {
        let (sat, link) = (&self.satellites[s], &self.links[l]);
        let timing = link.config.timing;
        let one = |length: usize| timing.turn_round_us + timing.frame_us(length) + timing.delivery_us(length);
        let extra = match telecommand {
            Telecommand::ExecuteTorqueProfile(profile) => profile.duration_ms() * 1_000,
            Telecommand::CaptureImage { .. } => CAPTURE_US,
            _ => 0,
        };
        match telecommand.answer() {
            Answer::None => timing.turn_round_us,
            // A satellite may send any packet as a full frame.
            Answer::One(_) => one(FRAME_LEN) + extra,
            Answer::Chunks => {
                let in_image = sat.image.as_ref().map(|image| image.record.chunks);
                let count: u64 =
                    chunks_asked(telecommand, in_image).iter().map(|&(_, count)| u64::from(count)).sum();
                let stretch = count.max(1) * link.chunk_period_us();
                let heartbeats = sat.contact.heartbeats_within(stretch) * timing.frame_us(FRAME_LEN);
                timing.turn_round_us + stretch + heartbeats + timing.delivery_us(FRAME_LEN)
            }
        }
    }
}
