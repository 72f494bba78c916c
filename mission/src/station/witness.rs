//! The witness of counters beside the database: raised before every transmission, and after an operator's word.

use protocol::{Counter, KeyId};

use super::satellite::{Exchange, Step};
use super::{About, Station};
use crate::clock::Now;
use crate::id::Principal;
use crate::level::Level;
use crate::port::{Effect, Lease};
use crate::record::{CounterFloorRecord, EventKind, Record, Subject};

/// A witness that could not be raised is tried again after this.
const WITNESS_RETRY_US: u64 = 2_000_000;

impl Station {
    /// Who may seal with a key that several servers share.
    pub(super) fn lease(&mut self, key: KeyId, lease: &Lease) {
        for sealer in self.satellites.iter_mut().filter_map(|sat| sat.sealer.as_mut()) {
            if sealer.id == key {
                sealer.leased(lease);
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
    pub(super) fn raise_witness_again(&mut self, now: Now, s: usize) -> Option<String> {
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
    pub(super) fn confirm_counter(&mut self, now: Now, s: usize, who: &Principal, floor: Counter) {
        let Some(sealer) = self.satellites[s].sealer.as_mut() else { return };
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
}
