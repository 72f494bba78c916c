//! Counters: which one a frame may be sealed with, and when none may be.

use protocol::{Counter, Key, KeyId};

use super::journal::Ticket;
use crate::clock::UtcUs;
use crate::config::CounterRule;
use crate::intent::Refusal;
use crate::port::Lease;
use crate::snapshot::{KeySnapshot, Witness};

/// A clock further ahead of the last counter than this needs somebody who vouches for it.
const UNVOUCHED_LEAP_US: u64 = 48 * 3600 * 1_000_000;

/// The database holds counters as signed integers: above this there is none.
const COUNTER_MAX: Counter = Counter(i64::MAX as u64);

/// Why nothing is sealed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum Lock {
    #[error(
        "the witness stands at {witness}, the database at {database:?}: the database went back (a restored backup?). Confirm the counter to go on above the witness"
    )]
    WitnessAhead { database: Option<u64>, witness: u64 },
    #[error(
        "the witness file is missing, but counters up to {database} were used. Confirm the counter if the file was lost"
    )]
    WitnessMissing { database: u64 },
    #[error("the witness file cannot be read ({0}). Confirm the counter if the file was damaged")]
    WitnessDamaged(String),
    #[error(
        "this archive was restored from a backup and does not know the counters that were radiated since. See that the clock is right, then confirm the counter to go on above it"
    )]
    Restored,
    #[error(
        "this archive was restored from a backup and does not know the counters that were radiated since (it knows of {known}), and this key counts them one by one. Find out the last one (the satellite may tell), then confirm the counter with a number that is not below it"
    )]
    RestoredSequence { known: u64 },
    #[error("the witness could not be raised: {0}")]
    WitnessStuck(String),
    #[error("no counter was used yet and nobody vouches for the clock: synchronise it, or vouch for it")]
    NoVoucher,
    #[error("the counter of this key is used up: take a new key")]
    Exhausted,
}

/// The counters of one key.
#[derive(Debug)]
pub(super) struct Sealer {
    pub(super) key: Key,
    pub(super) id: KeyId,
    rule: CounterRule,
    last: Option<Counter>,
    witness: Option<Counter>,
    lock: Option<Lock>,
    /// An operator confirmed: the floor waits for its batch, then for the witness.
    pub(super) unlocking: Option<(Ticket, Counter)>,
    /// The witness was asked to follow the confirmed floor.
    pub(super) unlock_asked: bool,
    /// The leap was told already.
    pub(super) leap_told: bool,
    /// Who may seal, when several servers share the key.
    pub(super) lease: Option<Lease>,
}

/// A counter to seal with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Permit {
    pub(super) counter: Counter,
    /// The clock leapt further than anybody vouches for: last + 1 was taken instead.
    pub(super) leapt: bool,
}

impl Sealer {
    /// The counters of a key as the last life left them.
    pub(super) fn new(key: Key, rule: CounterRule, found: Option<&KeySnapshot>) -> Self {
        let id = key.id();
        let database = found.and_then(|k| k.counter);
        let witness = found.map_or(Witness::Missing, |k| k.witness.clone());
        let mut sealer = Self {
            key,
            id,
            rule,
            last: database,
            witness: None,
            lock: None,
            unlocking: None,
            unlock_asked: false,
            leap_told: false,
            lease: None,
        };
        match (database, witness) {
            (None, Witness::Missing) => {}
            (Some(database), Witness::Missing) => {
                sealer.lock = Some(Lock::WitnessMissing { database: database.0 });
            }
            (_, Witness::Restored(witness)) => {
                sealer.witness = witness;
                let known = database.max(witness).unwrap_or(Counter(0)).0;
                sealer.lock = Some(match rule {
                    CounterRule::Time => Lock::Restored,
                    CounterRule::Sequence => Lock::RestoredSequence { known },
                });
            }
            (_, Witness::Damaged(why)) => sealer.lock = Some(Lock::WitnessDamaged(why)),
            (database, Witness::At(witness)) => {
                sealer.witness = Some(witness);
                if database.is_none_or(|d| d < witness) {
                    sealer.lock =
                        Some(Lock::WitnessAhead { database: database.map(|d| d.0), witness: witness.0 });
                }
            }
        }
        sealer
    }

    /// The database is ahead of the witness: it is raised without a word.
    pub(super) fn witness_to_raise(&self) -> Option<Counter> {
        match (self.lock.as_ref(), self.last, self.witness) {
            (None, Some(last), Some(witness)) if witness < last => Some(last),
            _ => None,
        }
    }

    /// Why nothing is sealed now.
    pub(super) fn lock(&self, vouched: bool) -> Option<Lock> {
        match &self.lock {
            Some(lock) => Some(lock.clone()),
            // A floor of 0 (confirmed where nothing was known) is no counter.
            None if self.last.is_none_or(|last| last == Counter(0)) && !vouched => Some(Lock::NoVoucher),
            None if self.last >= Some(COUNTER_MAX) => Some(Lock::Exhausted),
            None => None,
        }
    }

    /// Who may seal now. What others spent is spent.
    pub(super) fn leased(&mut self, lease: &Lease) {
        if let Lease::Ours { spent: Some(spent), .. } = lease {
            self.spend(*spent);
        }
        self.lease = Some(lease.clone());
    }

    /// Whether an operator can unlock it.
    pub(super) fn is_locked_by_witness(&self) -> bool {
        self.lock.is_some()
    }

    /// The counter for the next frame.
    pub(super) fn permit(&self, utc: UtcUs, vouched: bool) -> Result<Permit, Lock> {
        if let Some(lock) = self.lock(vouched) {
            return Err(lock);
        }
        let clock = u64::try_from(utc.0).unwrap_or(0);
        let Some(last) = self.last else {
            let first = match self.rule {
                CounterRule::Time => clock.max(1),
                CounterRule::Sequence => 1,
            };
            return Ok(Permit { counter: Counter(first), leapt: false });
        };
        let next = last.0.checked_add(1).ok_or(Lock::Exhausted)?;
        Ok(match self.rule {
            CounterRule::Sequence => Permit { counter: Counter(next), leapt: false },
            CounterRule::Time if clock > last.0.saturating_add(UNVOUCHED_LEAP_US) && !vouched => {
                Permit { counter: Counter(next), leapt: true }
            }
            CounterRule::Time => Permit { counter: Counter(next.max(clock)), leapt: false },
        })
    }

    /// The counter is spent, whatever becomes of the frame.
    pub(super) fn spend(&mut self, counter: Counter) {
        self.last = self.last.max(Some(counter));
    }

    /// The witness stands here now.
    pub(super) fn witness_done(&mut self, counter: Counter) {
        self.witness = self.witness.max(Some(counter));
        if matches!(self.lock, Some(Lock::WitnessStuck(_))) {
            self.lock = None;
        }
        if self.unlocking.is_some_and(|(_, floor)| floor <= counter) {
            self.unlocking = None;
            self.lock = None;
        }
    }

    /// The witness could not be raised.
    pub(super) fn witness_failed(&mut self, why: &str) {
        if self.lock.is_none() {
            self.lock = Some(Lock::WitnessStuck(why.to_owned()));
        }
    }

    /// Above this an operator lets us go on.
    pub(super) fn floor(&self, utc: UtcUs, vouched: bool) -> Counter {
        let clock = match self.rule {
            CounterRule::Time if vouched => Some(Counter(u64::try_from(utc.0).unwrap_or(0))),
            _ => None,
        };
        self.last.max(self.witness).max(clock).unwrap_or(Counter(0)).min(COUNTER_MAX)
    }

    /// Above this an operator lets us go on who gave this number, or none.
    pub(super) fn floor_above(
        &self,
        utc: UtcUs,
        vouched: bool,
        above: Option<Counter>,
    ) -> Result<Counter, Refusal> {
        let floor = self.floor(utc, vouched);
        let known = self.last.max(self.witness).unwrap_or(Counter(0));
        match above {
            None if self.has_forgotten_a_sequence() => Err(Refusal::FloorNeeded { key: self.id, known }),
            None => Ok(floor),
            Some(above) if above < known || above >= COUNTER_MAX => {
                Err(Refusal::FloorOutOfRange { above, known })
            }
            Some(above) => Ok(floor.max(above)),
        }
    }

    /// Counters may have been used that neither database nor witness tells of, and no clock leads above them. A witness
    /// that is whole has seen all of them.
    fn has_forgotten_a_sequence(&self) -> bool {
        self.rule == CounterRule::Sequence
            && matches!(
                self.lock,
                Some(
                    Lock::Restored
                        | Lock::RestoredSequence { .. }
                        | Lock::WitnessMissing { .. }
                        | Lock::WitnessDamaged(_)
                )
            )
    }

    /// Whether this counter is the newest one, so that a frame sealed with it may still go out.
    pub(super) fn is_newest(&self, counter: Counter) -> bool {
        self.last == Some(counter)
    }

    /// The database is behind what was radiated, or may be: what happened in between is lost.
    pub(super) fn database_went_back(&self) -> bool {
        matches!(self.lock, Some(Lock::WitnessAhead { .. } | Lock::Restored | Lock::RestoredSequence { .. }))
    }

    /// Only a clock that is right leads above counters that nobody remembers.
    pub(super) fn needs_the_clock_to_unlock(&self) -> bool {
        self.rule == CounterRule::Time && matches!(self.lock, Some(Lock::Restored))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: UtcUs = UtcUs(1_800_000_000_000_000);

    fn sealer(rule: CounterRule, counter: Option<u64>, witness: Witness) -> Sealer {
        let key = Key::from_bytes([7; 16]);
        let found = KeySnapshot { key: key.id(), counter: counter.map(Counter), witness };
        Sealer::new(key, rule, Some(&found))
    }

    #[test]
    fn no_counter_and_no_voucher_is_a_refusal() {
        let fresh = sealer(CounterRule::Time, None, Witness::Missing);
        assert_eq!(fresh.permit(NOW, false), Err(Lock::NoVoucher));
        assert_eq!(fresh.permit(NOW, true).map(|p| p.counter.0), Ok(1_800_000_000_000_000));
    }

    #[test]
    fn a_database_that_went_back_locks_until_confirmed() {
        let mut locked = sealer(CounterRule::Time, Some(10), Witness::At(Counter(20)));
        assert!(matches!(locked.permit(NOW, true), Err(Lock::WitnessAhead { .. })));
        let floor = locked.floor(UtcUs(0), false);
        assert_eq!(floor, Counter(20));
        locked.unlocking = Some((super::super::journal::Journal::default().ticket(), floor));
        locked.spend(floor);
        locked.witness_done(floor);
        assert_eq!(locked.permit(UtcUs(0), false).map(|p| p.counter.0), Ok(21));
    }

    #[test]
    fn what_was_restored_locks_whatever_it_knows_and_goes_on_above_the_clock() {
        for (database, witness) in [(Some(10), None), (None, None), (Some(10), Some(Counter(20)))] {
            let locked = sealer(CounterRule::Time, database, Witness::Restored(witness));
            assert_eq!(locked.permit(NOW, true), Err(Lock::Restored));
            assert!(locked.database_went_back() && locked.needs_the_clock_to_unlock());
            assert_eq!(locked.floor(NOW, true), Counter(1_800_000_000_000_000));
            let known = database.map(Counter).max(witness).unwrap_or(Counter(0));
            assert_eq!(locked.floor(NOW, false), known, "the witness of the backup counts");
        }
    }

    #[test]
    fn a_sequence_that_was_forgotten_goes_on_above_a_number_that_somebody_gives_and_no_other() {
        let forgotten = [
            (Some(10), Witness::Restored(None), 10),
            (Some(10), Witness::Restored(Some(Counter(20))), 20),
            (None, Witness::Restored(None), 0),
            (Some(10), Witness::Missing, 10),
            (Some(10), Witness::Damaged("torn".into()), 10),
        ];
        for (database, witness, known) in forgotten {
            let locked = sealer(CounterRule::Sequence, database, witness.clone());
            assert!(locked.permit(NOW, true).is_err() && !locked.needs_the_clock_to_unlock());
            let (key, known) = (locked.id, Counter(known));
            let needed = Err(Refusal::FloorNeeded { key, known });
            assert_eq!(locked.floor_above(NOW, true, None), needed, "{witness:?}");
            assert_eq!(locked.floor_above(NOW, true, Some(Counter(1_000))), Ok(Counter(1_000)));
            assert_eq!(locked.floor_above(NOW, true, Some(known)), Ok(known));
            for above in [Counter(u64::MAX), COUNTER_MAX] {
                let refused = Err(Refusal::FloorOutOfRange { above, known });
                assert_eq!(locked.floor_above(NOW, true, Some(above)), refused);
            }
            if known.0 > 0 {
                let above = Counter(known.0 - 1);
                let refused = Err(Refusal::FloorOutOfRange { above, known });
                assert_eq!(locked.floor_above(NOW, true, Some(above)), refused);
            }
        }
        // A witness that is whole has seen every counter that was radiated.
        let ahead = sealer(CounterRule::Sequence, Some(10), Witness::At(Counter(20)));
        assert_eq!(ahead.floor_above(NOW, true, None), Ok(Counter(20)));
        // The clock leads above what was forgotten; a number may lead further.
        let by_time = sealer(CounterRule::Time, Some(10), Witness::Restored(None));
        let clock = Counter(u64::try_from(NOW.0).unwrap());
        assert_eq!(by_time.floor_above(NOW, true, None), Ok(clock));
        assert_eq!(by_time.floor_above(NOW, true, Some(Counter(11))), Ok(clock));
        assert_eq!(by_time.floor_above(NOW, true, Some(Counter(clock.0 + 5))), Ok(Counter(clock.0 + 5)));
    }

    #[test]
    fn a_hundred_thousand_seals_after_a_restore_repeat_no_counter_of_the_lost_time() {
        let mut utc = NOW;
        let seal = |sealer: &mut Sealer, utc: UtcUs| {
            let counter = sealer.permit(utc, true).unwrap().counter;
            sealer.spend(counter);
            counter.0
        };
        let mut first = sealer(CounterRule::Time, Some(10), Witness::At(Counter(10)));
        let at_backup = seal(&mut first, utc);
        // The clock stands still, creeps, leaps and goes back a little: what a machine's clock does.
        let steps = [0, 0, 1, 2, 700, -300, 1_000_000];
        let mut spent = std::collections::BTreeSet::new();
        for n in 0..100_000_usize {
            utc = utc.plus(steps[n % steps.len()]);
            assert!(spent.insert(seal(&mut first, utc)));
        }
        let mut second =
            sealer(CounterRule::Time, Some(at_backup), Witness::Restored(Some(Counter(at_backup))));
        assert!(second.permit(utc, true).is_err());
        let floor = second.floor(utc.plus(1), true);
        second.unlocking = Some((super::super::journal::Journal::default().ticket(), floor));
        second.spend(floor);
        second.witness_done(floor);
        for n in 0..100_000_usize {
            utc = utc.plus(steps[n % steps.len()]);
            assert!(spent.insert(seal(&mut second, utc)), "a counter was spent twice");
        }
    }

    #[test]
    fn a_hundred_thousand_seals_of_a_sequence_after_a_restore_lie_above_what_was_given() {
        let mut first = sealer(CounterRule::Sequence, Some(10), Witness::At(Counter(10)));
        let mut spent = std::collections::BTreeSet::new();
        let mut seal = |sealer: &mut Sealer| {
            let counter = sealer.permit(NOW, true).unwrap().counter;
            sealer.spend(counter);
            assert!(spent.insert(counter), "a counter was spent twice");
            counter
        };
        let newest = (0..100_000).map(|_| seal(&mut first)).last();
        let mut second = sealer(CounterRule::Sequence, Some(10), Witness::Restored(Some(Counter(10))));
        assert!(second.floor_above(NOW, true, None).is_err());
        let floor = second.floor_above(NOW, true, newest).unwrap();
        second.unlocking = Some((super::super::journal::Journal::default().ticket(), floor));
        second.spend(floor);
        second.witness_done(floor);
        for _ in 0..100_000 {
            seal(&mut second);
        }
    }

    #[test]
    fn a_missing_witness_beside_counters_locks_and_one_behind_is_raised_silently() {
        assert!(sealer(CounterRule::Time, Some(10), Witness::Missing).lock(true).is_some());
        assert!(sealer(CounterRule::Time, None, Witness::At(Counter(3))).lock(true).is_some());
        assert!(sealer(CounterRule::Time, None, Witness::Damaged("torn".into())).lock(true).is_some());
        let behind = sealer(CounterRule::Time, Some(10), Witness::At(Counter(9)));
        assert_eq!((behind.lock(false), behind.witness_to_raise()), (None, Some(Counter(10))));
    }

    #[test]
    fn a_clock_thrown_ahead_does_not_poison_the_counter() {
        let last = 1_700_000_000_000_000;
        let sealer = sealer(CounterRule::Time, Some(last), Witness::At(Counter(last)));
        let permit = sealer.permit(NOW, false).unwrap();
        assert_eq!((permit.counter.0, permit.leapt), (last + 1, true));
        assert_eq!(sealer.permit(NOW, true).unwrap().counter.0, 1_800_000_000_000_000);
        assert_eq!(
            sealer.permit(UtcUs(5), true).unwrap().counter.0,
            last + 1,
            "a clock behind never goes back"
        );
    }
}
