//! One exchange at a time: seal, commit, witness, mark, hand over, await.
//!
//! The order is the whole point. The sealed bytes are durable before the witness is raised, the witness before the
//! command is marked `radiating`, the mark before the radio gets a byte. A [`Effect::Transmit`] is built in one place,
//! in [`Station::hand_over`], and only from a frame that has come this way.

use std::sync::Arc;

use protocol::{Nonce, RequestTag, Telecommand, UP_PLAINTEXT_LEN, seal};

use super::gate::{Need, Wait};
use super::satellite::{Before, Exchange, Prepared, Step};
use super::{About, Station};
use crate::clock::Now;
use crate::id::{CommandId, TxId};
use crate::level::Level;
use crate::port::{Effect, MaybeRadiated, Transmit};
use crate::record::{EventKind, Gate, Record, SealedRecord};
use crate::stage::Stage;

/// A radio that says nothing for this long has taken the frame to its grave.
const GIVE_UP_US: u64 = 30_000_000;
/// So many unanswered CaptureImages are remembered; one is enough to expect a new image.
const CAPTURES_MAX: usize = 16;
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
        self.satellites[s].wants_lease = false;
        if let Some(wait) = self.raise_witness_again(now, s) {
            self.satellites[s].note = wait;
            return false;
        }
        let mut first_wait: Option<Wait> = None;
        // What waits for conditions of its own holds up nothing else.
        let mut held_back: Option<Wait> = None;
        for id in self.satellites[s].queue() {
            if let Err(wait) = self.condition_gate(now, s, id) {
                if self.satellites[s].commands.get(&id).is_some_and(|c| c.stage == Stage::Sealed) {
                    self.unseal(now, s, id, "its conditions do not hold any more");
                }
                if let Some(at) = wait.until {
                    self.satellites[s].wake_at(at);
                }
                held_back.get_or_insert(wait);
                continue;
            }
            match self.try_command(now, s, id) {
                Ok(()) => return true,
                Err(wait) => {
                    if let Some(at) = wait.until {
                        self.satellites[s].wake_at(at);
                    }
                    self.satellites[s].wants_lease |= self.is_for_lease(now, s, &wait);
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
                    self.satellites[s].wants_lease = self.is_for_lease(now, s, &wait);
                    first_wait = Some(wait);
                }
            }
        }
        self.satellites[s].note =
            first_wait.or(held_back).map_or_else(|| "nothing to send".to_owned(), |w| w.why.into_owned());
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
    pub(super) fn mark(&mut self, now: Now, s: usize, frame: Prepared) {
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
    pub(super) fn unseal(&mut self, now: Now, s: usize, id: CommandId, why: &str) {
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

    /// The gate of requests that the machine makes itself.
    pub(super) const fn machine_gate() -> Gate {
        Gate::Heard
    }
}
