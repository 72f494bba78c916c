//! One exchange at a time: seal, commit, witness, mark, hand over, await.
//!
//! The order is the whole point. The sealed bytes are durable before the witness is raised, the witness before the
//! command is marked `radiating`, the mark before the radio gets a byte. A [`Effect::Transmit`] is built in one place,
//! in [`Station::hand_over`], and only from a frame that has come this way.

use std::borrow::Cow;
use std::sync::Arc;

use protocol::{Answer, Counter, FRAME_LEN, KeyId, Nonce, RequestTag, Telecommand, UP_PLAINTEXT_LEN, seal};

use super::gate::{Need, Wait};
use super::satellite::{Awaited, Before, Exchange, Prepared, Settling, Step, chunks_asked, setting};
use super::{About, Station};
use crate::clock::{MonoUs, Now};
use crate::id::{CommandId, TxId};
use crate::level::Level;
use crate::port::{Effect, MaybeRadiated, Transmit};
use crate::record::{CounterFloorRecord, EventKind, Gate, Record, SealedRecord, Subject};
use crate::snapshot::SealedSnapshot;
use crate::stage::Stage;

/// A radio that says nothing for this long has taken the frame to its grave.
const GIVE_UP_US: u64 = 30_000_000;
/// So many unanswered CaptureImages are remembered; one is enough to expect a new image.
const CAPTURES_MAX: usize = 16;
/// A witness that could not be raised is tried again after this.
const WITNESS_RETRY_US: u64 = 2_000_000;
/// A picture may take this long.
const CAPTURE_US: u64 = 15_000_000;
/// Answers that are further away than this do not hold up the uplink.
const HOLD_US: u64 = 20_000_000;
/// Telemetry has so many heartbeat periods to tell an outcome.
const SETTLE_PERIODS: u64 = 3;
/// Two Resets are this far apart, in microseconds.
const RESETS_APART_US: i64 = 60_000_000;
/// After the radio refused a frame, nothing is tried for this long.
pub(super) const REFUSED_US: u64 = 2_000_000;

impl Station {
    /// Does whatever the uplink of this satellite can do now.
    pub(super) fn uplink_step(&mut self, now: Now, s: usize) {
        // Each turn either changes the state or stops: five steps lead from idle to the air.
        for _ in 0..8 {
            let changed = match &self.satellites[s].exchange {
                Exchange::Idle => self.begin(now, s),
                Exchange::Preparing(frame, step) => {
                    let (frame, step) = (frame.clone(), *step);
                    self.prepare(now, s, frame, step)
                }
                Exchange::OnAir { tx, give_up_at, .. } => {
                    let (tx, at) = (*tx, *give_up_at);
                    self.satellites[s].note = "on the air".to_owned();
                    if now.mono >= at {
                        self.tx_failed(
                            now,
                            tx,
                            MaybeRadiated::Maybe,
                            "the radio did not say what became of it",
                        );
                        true
                    } else {
                        self.satellites[s].wake_at(at);
                        false
                    }
                }
                Exchange::Awaiting(awaited) => {
                    let (command, got, at) = (awaited.command, awaited.got, awaited.deadline);
                    self.satellites[s].note = "awaiting the answer".to_owned();
                    if now.mono >= at {
                        self.satellites[s].exchange = Exchange::Idle;
                        if got == 0 {
                            self.unanswered(now, s, command, "no answer came in time");
                        }
                        true
                    } else {
                        self.satellites[s].wake_at(at);
                        false
                    }
                }
            };
            if !changed {
                return;
            }
        }
    }

    /// Takes the next command in hand, if the gate is open.
    fn begin(&mut self, now: Now, s: usize) -> bool {
        if let Some(wait) = self.raise_witness_again(now, s) {
            self.satellites[s].note = wait;
            return false;
        }
        let mut first_wait: Option<Wait> = None;
        for id in self.satellites[s].queue() {
            match self.try_command(now, s, id) {
                Ok(()) => return true,
                Err(wait) => {
                    if let Some(at) = wait.until {
                        self.satellites[s].wake_at(at);
                    }
                    first_wait.get_or_insert(wait);
                    // What was sealed already goes first, or nothing does.
                    if self.satellites[s].commands.get(&id).is_some_and(|c| c.stage == Stage::Sealed) {
                        break;
                    }
                }
            }
        }
        if first_wait.is_none() {
            match self.next_request(now, s) {
                Ok(Some(id)) => return self.try_command(now, s, id).is_ok(),
                Ok(None) => {}
                Err(wait) => {
                    if let Some(at) = wait.until {
                        self.satellites[s].wake_at(at);
                    }
                    first_wait = Some(wait);
                }
            }
        }
        self.satellites[s].note =
            first_wait.map_or_else(|| "nothing to send".to_owned(), |w| w.why.into_owned());
        false
    }

    fn try_command(&mut self, now: Now, s: usize, id: CommandId) -> Result<(), Wait> {
        let nothing = || Wait { why: "nothing to send".into(), until: None };
        let command = self.satellites[s].commands.get(&id).ok_or_else(nothing)?;
        let l = self.link_index(&command.record.route.link).ok_or_else(nothing)?;
        if now.mono < command.not_before {
            return Err(Wait {
                why: "waiting before it is repeated".into(),
                until: Some(command.not_before),
            });
        }
        if let Some((stage, why)) = self.unwanted(now, s, id) {
            let me = self.me.clone();
            self.give_up(now, s, id, stage, &me, why);
            return Err(nothing());
        }
        if let Some(until) = self.other_reset_until(now, s, id) {
            return Err(Wait { why: "an earlier Reset is not settled yet".into(), until: Some(until) });
        }
        let need =
            Need { gate: command.record.gate, answer_us: self.answer_us(s, l, &command.record.telecommand) };
        self.gate(now, s, l, need)?;
        match command.sealed.clone() {
            Some(sealed) if !self.may_go_on(s, &sealed) => {
                self.unseal(now, s, id, "its counter is not the newest of its key any more");
                Err(nothing())
            }
            Some(sealed) => {
                // Sealed in the last life: the same bytes go on, their counter is still the newest.
                let frame = Prepared {
                    command: id,
                    attempt: command.attempt,
                    link: l,
                    tag: sealed.tag,
                    counter: sealed.counter,
                    bytes: sealed.bytes,
                };
                let ticket = self.journal.ticket();
                self.satellites[s].exchange = Exchange::Preparing(frame, Step::Sealing(ticket));
                Ok(())
            }
            None => self.seal(now, s, l, id),
        }
    }

    /// Bytes that were sealed in the last life may still be radiated: with the key of now, and nothing came after them.
    fn may_go_on(&self, s: usize, sealed: &SealedSnapshot) -> bool {
        let sealer = self.satellites[s].sealer.as_ref();
        sealer.is_some_and(|sealer| sealer.id == sealed.key && sealer.is_newest(sealed.counter))
    }

    /// Why a command is not wanted on the air any more, though it was.
    fn unwanted(&self, now: Now, s: usize, id: CommandId) -> Option<(Stage, &'static str)> {
        let sat = &self.satellites[s];
        let record = &sat.commands.get(&id)?.record;
        let is_over = |of| sat.download.as_ref().is_none_or(|active| active.record.id != of);
        if record.expires_at.is_some_and(|at| at <= now.utc) {
            Some((Stage::Expired, "its time ran out"))
        } else if record.download.is_some_and(is_over) {
            Some((Stage::Cancelled, "its download is over"))
        } else {
            None
        }
    }

    /// Two Resets shortly after each other could not be told apart by telemetry: the second waits until then.
    fn other_reset_until(&self, now: Now, s: usize, id: CommandId) -> Option<MonoUs> {
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

    fn seal(&mut self, now: Now, s: usize, l: usize, id: CommandId) -> Result<(), Wait> {
        let vouched = self.is_vouched();
        let route = self.route(l);
        let sat = &mut self.satellites[s];
        let nothing = || Wait { why: "nothing to seal".into(), until: None };
        let sealer = sat.sealer.as_mut().ok_or_else(nothing)?;
        let permit = sealer
            .permit(now.utc, vouched)
            .map_err(|lock| Wait { why: lock.to_string().into(), until: None })?;
        let mut random = [0; 4];
        let mut padding = [0; UP_PLAINTEXT_LEN];
        self.entropy.fill(&mut random);
        self.entropy.fill(&mut padding);
        sealer.spend(permit.counter);
        let told = std::mem::replace(&mut sealer.leap_told, permit.leapt);
        let tell_leap = permit.leapt && !told;
        let (nonce, key) = (Nonce::new(permit.counter, random), sealer.id);
        let tag = sat.last_tag.map_or(RequestTag::FIRST, RequestTag::next);
        let command = sat.commands.get_mut(&id).ok_or_else(nothing)?;
        let bytes =
            Arc::new(*seal(&sealer.key, nonce, tag, &command.record.telecommand, &padding).as_bytes());
        sat.last_tag = Some(tag);
        command.before =
            Before { tag: command.tag, on_air_at: command.on_air_at, on_air_mono: command.on_air_mono };
        command.attempt = command.attempt.saturating_add(1);
        command.tag = Some(tag);
        let attempt = command.attempt;
        // Satellites that share a key share its counter.
        for other in self.satellites.iter_mut().filter_map(|sat| sat.sealer.as_mut()) {
            if other.id == key {
                other.spend(permit.counter);
            }
        }
        let sealed_at = now.utc;
        self.journal.push(Record::Sealed(SealedRecord {
            key,
            counter: permit.counter,
            nonce,
            command: id,
            attempt,
            tag,
            route: route.clone(),
            bytes: Box::new(*bytes),
            sealed_at,
        }));
        self.stage(now, s, id, Stage::Sealed, &format!("counter {}, tag {tag}", permit.counter), None);
        if tell_leap {
            let about = About { route: Some(route), key: Some(key), ..About::default() };
            let message = "the clock stands more than 48 h past the last counter and nobody vouches for it: sealing with last + 1";
            self.event(now.utc, EventKind::Sealing, Level::Distress, about, message.to_owned());
        }
        let frame = Prepared { command: id, attempt, link: l, tag, counter: permit.counter, bytes };
        let ticket = self.journal.ticket();
        self.satellites[s].exchange = Exchange::Preparing(frame, Step::Sealing(ticket));
        Ok(())
    }

    /// One step towards the air. Anything that has changed meanwhile sends it back, not on.
    fn prepare(&mut self, now: Now, s: usize, frame: Prepared, step: Step) -> bool {
        self.satellites[s].note = "sealing".to_owned();
        let Some(key) = self.satellites[s].sealer.as_ref().map(|sealer| sealer.id) else { return false };
        match step {
            Step::Sealing(ticket) => {
                if !self.journal.is_durable(ticket) {
                    return false;
                }
                self.effects.push_back(Effect::Witness { key, counter: frame.counter });
                self.satellites[s].exchange = Exchange::Preparing(frame, Step::Witnessing(None));
                false
            }
            Step::Witnessing(None) => false,
            Step::Witnessing(Some(at)) if now.mono < at => {
                self.satellites[s].wake_at(at);
                false
            }
            Step::Witnessing(Some(_)) => {
                self.effects.push_back(Effect::Witness { key, counter: frame.counter });
                self.satellites[s].exchange = Exchange::Preparing(frame, Step::Witnessing(None));
                false
            }
            Step::Marking(ticket) => {
                if !self.journal.is_durable(ticket) {
                    return false;
                }
                self.hand_over(now, s, frame);
                true
            }
        }
    }

    /// The witness stands: mark the command, unless the moment has passed.
    fn mark(&mut self, now: Now, s: usize, frame: Prepared) {
        let need = self.satellites[s].commands.get(&frame.command).map(|c| Need {
            gate: c.record.gate,
            answer_us: self.answer_us(s, frame.link, &c.record.telecommand),
        });
        let Some(need) = need else {
            self.satellites[s].exchange = Exchange::Idle;
            return;
        };
        if let Some((_, why)) = self.unwanted(now, s, frame.command) {
            self.unseal(now, s, frame.command, why);
            return;
        }
        if let Err(wait) = self.gate(now, s, frame.link, need) {
            if wait.until.is_none() {
                let why = format!("not radiated: {}", wait.why);
                self.unseal(now, s, frame.command, &why);
                return;
            }
            // Only for a moment: keep the sealed bytes and try again.
            if let Some(at) = wait.until {
                self.satellites[s].wake_at(at);
            }
            self.satellites[s].exchange = Exchange::Preparing(frame, Step::Witnessing(wait.until));
            return;
        }
        let why = format!("handed to {}", self.links[frame.link].config.id);
        self.stage(now, s, frame.command, Stage::Radiating, &why, None);
        let who = self.me.clone();
        let detail = format!(
            "command {} attempt {} counter {} tag {} link {}",
            frame.command, frame.attempt, frame.counter, frame.tag, self.links[frame.link].config.id
        );
        self.audit(now.utc, &who, "uplink.radiate", detail);
        let ticket = self.journal.ticket();
        self.satellites[s].exchange = Exchange::Preparing(frame, Step::Marking(ticket));
    }

    /// Back to the queue: nothing was radiated, and these bytes never will be. A request of the machine ends here: what
    /// it asked for may have come meanwhile, so it is worked out anew.
    fn unseal(&mut self, now: Now, s: usize, id: CommandId, why: &str) {
        let again_at = now.mono.plus(REFUSED_US);
        let sat = &mut self.satellites[s];
        sat.exchange = Exchange::Idle;
        sat.captures.remove(&id);
        self.stage(now, s, id, Stage::Queued, why, None);
        let sat = &mut self.satellites[s];
        let Some(command) = sat.commands.get_mut(&id) else { return };
        command.sealed = None;
        // What was not radiated was no attempt.
        command.attempt = command.attempt.saturating_sub(1);
        command.not_before = again_at;
        let before = command.before;
        (command.tag, command.on_air_at, command.on_air_mono) =
            (before.tag, before.on_air_at, before.on_air_mono);
        if let Some(download) = command.record.download {
            if let Some(active) = sat.download.as_mut().filter(|active| active.record.id == download) {
                active.not_before = active.not_before.max(again_at);
            }
            let me = self.me.clone();
            self.give_up(
                now,
                s,
                id,
                Stage::Cancelled,
                &me,
                "not radiated: what is missing is asked for anew",
            );
        }
    }

    /// The only place where bytes are handed to a radio.
    fn hand_over(&mut self, now: Now, s: usize, frame: Prepared) {
        // The commit may have taken a while: everything that held before it must hold now.
        if let Some(why) = self.no_more(now, s, &frame) {
            self.unseal(now, s, frame.command, &format!("not handed over: {why}"));
            return;
        }
        let sat = &mut self.satellites[s];
        let link = &mut self.links[frame.link];
        self.last_tx += 1;
        let tx = TxId(self.last_tx);
        link.on_air = Some(tx);
        if let Some(command) = sat.commands.get_mut(&frame.command) {
            command.goes_on_air(now);
            command.sealed = None;
            if matches!(command.record.telecommand, Telecommand::CaptureImage { .. }) {
                sat.captures.insert(frame.command);
                if sat.captures.len() > CAPTURES_MAX {
                    sat.captures.pop_first();
                }
            }
        }
        self.effects.push_back(Effect::Transmit(Transmit {
            tx,
            link: link.config.id.clone(),
            command: frame.command,
            target_address: sat.profile.address,
            frame: Arc::clone(&frame.bytes),
        }));
        sat.exchange = Exchange::OnAir { frame, tx, give_up_at: now.mono.plus(GIVE_UP_US) };
    }

    /// Why this frame must not be handed over any more.
    fn no_more(&self, now: Now, s: usize, frame: &Prepared) -> Option<Cow<'static, str>> {
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

    pub(super) fn witness_done(&mut self, now: Now, key: KeyId, counter: Counter) {
        for s in 0..self.satellites.len() {
            let sat = &mut self.satellites[s];
            let Some(sealer) = sat.sealer.as_mut().filter(|sealer| sealer.id == key) else { continue };
            let was_locked = sealer.is_locked_by_witness();
            sealer.witness_done(counter);
            sat.witness_retry_at = None;
            let opened = was_locked && !sealer.is_locked_by_witness();
            if let Exchange::Preparing(frame, Step::Witnessing(_)) = &sat.exchange
                && frame.counter <= counter
            {
                let frame = frame.clone();
                self.mark(now, s, frame);
            }
            if opened {
                let about = About { key: Some(key), ..About::default() };
                let message = format!("sealing with key {key} goes on above counter {counter}");
                self.event(now.utc, EventKind::Sealing, Level::Normal, about, message);
            }
        }
    }

    pub(super) fn witness_failed(&mut self, now: Now, key: KeyId, reason: &str) {
        for s in 0..self.satellites.len() {
            let sat = &mut self.satellites[s];
            let Some(sealer) = sat.sealer.as_mut().filter(|sealer| sealer.id == key) else { continue };
            let was_locked = sealer.is_locked_by_witness();
            sealer.witness_failed(reason);
            let again = now.mono.plus(WITNESS_RETRY_US);
            if let Exchange::Preparing(_, step @ Step::Witnessing(_)) = &mut sat.exchange {
                *step = Step::Witnessing(Some(again));
            } else {
                sat.witness_retry_at = Some(again);
            }
            if !was_locked {
                let about = About { key: Some(key), ..About::default() };
                let message =
                    format!("the witness of key {key} could not be raised: {reason}. Nothing is radiated");
                self.event(now.utc, EventKind::Sealing, Level::Critical, about, message);
            }
        }
    }

    /// A witness that could not be raised outside an exchange is tried again.
    fn raise_witness_again(&mut self, now: Now, s: usize) -> Option<String> {
        let sat = &mut self.satellites[s];
        let at = sat.witness_retry_at?;
        let sealer = sat.sealer.as_ref()?;
        if now.mono < at {
            sat.wake_at(at);
        } else {
            sat.witness_retry_at = None;
            let counter = sealer.unlocking.map_or_else(|| sealer.floor(now.utc, false), |(_, floor)| floor);
            self.effects.push_back(Effect::Witness { key: sealer.id, counter });
        }
        Some("the witness could not be raised".to_owned())
    }

    /// An operator confirmed: once the floor is durable, the witness follows.
    pub(super) fn unlock_step(&mut self, s: usize) {
        let Some(sealer) = self.satellites[s].sealer.as_mut() else { return };
        let Some((ticket, floor)) = sealer.unlocking else { return };
        if self.journal.is_durable(ticket) && !sealer.unlock_asked {
            sealer.unlock_asked = true;
            self.effects.push_back(Effect::Witness { key: sealer.id, counter: floor });
        }
    }

    /// The floor that an operator confirmed.
    pub(super) fn confirm_counter(&mut self, now: Now, s: usize, who: &crate::id::Principal) {
        let vouched = self.is_vouched();
        let Some(sealer) = self.satellites[s].sealer.as_mut() else { return };
        let floor = sealer.floor(now.utc, vouched);
        sealer.spend(floor);
        let key = sealer.id;
        let record = CounterFloorRecord { key, counter: floor, at: now.utc, who: who.clone() };
        let ticket = self.journal.push(Record::CounterFloor(record));
        if let Some(sealer) = self.satellites[s].sealer.as_mut() {
            sealer.unlocking = Some((ticket, floor));
            sealer.unlock_asked = false;
        }
        let about = About { key: Some(key), subject: Subject::default(), route: None };
        let message = format!("{who} confirmed: sealing with key {key} goes on above counter {floor}");
        self.event(now.utc, EventKind::Sealing, Level::Watch, about, message);
    }

    /// The gate of requests that the machine makes itself.
    pub(super) const fn machine_gate() -> Gate {
        Gate::Heard
    }
}
