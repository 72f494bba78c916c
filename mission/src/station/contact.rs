//! When the satellite was heard, and when it will transmit of its own accord.

use crate::clock::{MonoUs, Now, UtcUs};

/// Heard within this many half heartbeat periods: in contact.
const CONTACT_HALF_PERIODS: u64 = 5;
/// A heartbeat may be this much late because it waited for a chunk; its rhythm is not moved by that.
const LATENESS_US: u64 = 4_000_000;
/// The rhythm follows a later heartbeat by at most this much at a time (drift of two clocks).
const DRIFT_US: u64 = 50_000;
/// Nothing of ours is on the air this long before a heartbeat is due (it may come that much early against a rhythm
/// that was learnt from a late one)...
const GUARD_BEFORE_US: u64 = 2_000_000;
/// ...and this long after its slot.
const GUARD_AFTER_US: u64 = 700_000;

/// A stretch of time in which the satellite is expected to transmit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Slot {
    pub(super) start: MonoUs,
    pub(super) end: MonoUs,
}

impl Slot {
    pub(super) fn overlaps(&self, start: MonoUs, end: MonoUs) -> bool {
        start < self.end && self.start < end
    }
}

/// What is known of the satellite's presence and rhythm.
#[derive(Debug)]
pub(super) struct Contact {
    period_us: u64,
    frame_us: u64,
    heard: Option<Now>,
    heartbeat_at: Option<UtcUs>,
    /// Start on the air of one heartbeat; the others lie whole periods away.
    rhythm: Option<MonoUs>,
    /// The satellite sends an answer that we cannot place: nothing of ours before this.
    pub(super) quiet_until: MonoUs,
    /// In contact, as the last event said.
    pub(super) told: bool,
    /// What the orbit says: `Some(None)` not in view, `Some(Some(los))` in view.
    view: Option<Option<Option<UtcUs>>>,
}

impl Contact {
    pub(super) fn new(period_us: u64, frame_us: u64) -> Self {
        Self {
            period_us: period_us.max(1),
            frame_us,
            heard: None,
            heartbeat_at: None,
            rhythm: None,
            quiet_until: MonoUs(0),
            told: false,
            view: None,
        }
    }

    /// Takes up the rhythm of the last life.
    pub(super) fn restore(&mut self, heard_at: UtcUs, now: Now, delay_us: u64) {
        self.heartbeat_at = Some(heard_at);
        let ago = u64::try_from(now.utc.0.saturating_sub(heard_at.0)).unwrap_or(0).saturating_add(delay_us);
        // Whole periods forward, so that a young monotonic scale can express it.
        let periods = ago / self.period_us + 1;
        self.rhythm = Some(now.mono.plus(periods.saturating_mul(self.period_us).saturating_sub(ago)));
    }

    /// A frame of the satellite was received live.
    pub(super) fn heard(&mut self, now: Now) {
        self.heard = Some(now);
    }

    /// A scheduled heartbeat was received; it began on the air `delay_us` before that.
    pub(super) fn heartbeat(&mut self, now: Now, delay_us: u64) {
        self.heartbeat_at = Some(now.utc);
        let Some(start) = now.mono.0.checked_sub(delay_us).map(MonoUs) else { return };
        let fresh = match self.rhythm {
            None => start,
            Some(rhythm) => {
                // How late against the rhythm, in 0..period.
                let late = if start >= rhythm {
                    start.since(rhythm) % self.period_us
                } else {
                    (self.period_us - rhythm.since(start) % self.period_us) % self.period_us
                };
                if late <= LATENESS_US {
                    MonoUs(start.0 - late.min(start.0)).plus(late.min(DRIFT_US))
                } else {
                    start
                }
            }
        };
        self.rhythm = Some(fresh);
    }

    pub(super) fn set_view(&mut self, view: Option<Option<UtcUs>>) {
        self.view = Some(view);
    }

    /// Nobody says whether it is in view any more.
    pub(super) fn forget_view(&mut self) {
        self.view = None;
    }

    /// How long one heartbeat period is, microseconds.
    pub(super) fn period_us(&self) -> u64 {
        self.period_us
    }

    /// `None` when nobody says.
    pub(super) fn in_view(&self) -> Option<bool> {
        self.view.map(|view| view.is_some())
    }

    pub(super) fn los(&self) -> Option<UtcUs> {
        self.view.flatten().flatten()
    }

    /// How long ago a frame was received in this life, microseconds.
    pub(super) fn heard_ago_us(&self, now: MonoUs) -> Option<u64> {
        self.heard.map(|heard| now.since(heard.mono))
    }

    pub(super) fn heard_at(&self) -> Option<UtcUs> {
        self.heard.map(|now| now.utc)
    }

    pub(super) fn heartbeat_at(&self) -> Option<UtcUs> {
        self.heartbeat_at
    }

    /// Heard lately, and not known to be below the horizon.
    pub(super) fn is_open(&self, now: MonoUs) -> bool {
        self.in_view() != Some(false) && self.closes_at().is_some_and(|at| now < at)
    }

    /// When it counts as lost if nothing more is heard.
    pub(super) fn closes_at(&self) -> Option<MonoUs> {
        self.heard.map(|heard| heard.mono.plus((self.period_us / 2).saturating_mul(CONTACT_HALF_PERIODS)))
    }

    /// The heartbeat slot, guards included, that ends after `now` first.
    pub(super) fn next_slot(&self, now: MonoUs) -> Option<Slot> {
        let rhythm = self.rhythm?;
        let length = self.frame_us + GUARD_AFTER_US;
        // The earliest heartbeat whose slot has not ended. The rhythm may lie ahead of now by periods (taken up from the
        // last life) or behind it.
        let end = rhythm.0.saturating_add(length);
        let start = if end <= now.0 {
            rhythm.plus(((now.0 - end) / self.period_us + 1).saturating_mul(self.period_us))
        } else {
            let back = ((end - now.0 - 1) / self.period_us).min(rhythm.0 / self.period_us);
            MonoUs(rhythm.0 - back * self.period_us)
        };
        Some(Slot { start: MonoUs(start.0.saturating_sub(GUARD_BEFORE_US)), end: start.plus(length) })
    }

    /// When the next heartbeat is due on the air.
    pub(super) fn next_heartbeat(&self, now: MonoUs) -> Option<MonoUs> {
        let slot = self.next_slot(now)?;
        Some(slot.start.plus(GUARD_BEFORE_US))
    }

    /// How many heartbeats fall due in a stretch of this length from `now` at the most.
    pub(super) fn heartbeats_within(&self, length_us: u64) -> u64 {
        length_us / self.period_us + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: u64) -> Now {
        Now { mono: MonoUs(s * 1_000_000), utc: UtcUs(0) }
    }

    #[test]
    fn a_late_heartbeat_does_not_move_the_rhythm() {
        let mut contact = Contact::new(60_000_000, 700_000);
        contact.heartbeat(at(100), 0);
        contact.heartbeat(at(161), 0);
        let due = contact.next_heartbeat(at(170).mono).unwrap();
        assert!(due.0 <= 220_050_000 && due.0 >= 220_000_000, "{due:?}");
    }

    #[test]
    fn an_early_heartbeat_moves_it_at_once() {
        let mut contact = Contact::new(60_000_000, 700_000);
        contact.heartbeat(at(100), 0);
        contact.heartbeat(at(158), 0);
        assert_eq!(contact.next_heartbeat(at(170).mono), Some(at(218).mono));
    }

    #[test]
    fn the_slot_in_which_we_stand_is_the_next_one() {
        let mut contact = Contact::new(60_000_000, 700_000);
        contact.heartbeat(at(100), 0);
        let slot = contact.next_slot(MonoUs(160_300_000)).unwrap();
        assert!(slot.start.0 == 158_000_000 && slot.end.0 == 161_400_000, "{slot:?}");
        assert_eq!(contact.next_slot(at(162).mono).unwrap().start, at(218).mono);
    }

    #[test]
    fn the_rhythm_of_the_last_life_is_taken_up() {
        let mut contact = Contact::new(60_000_000, 700_000);
        let now = Now { mono: MonoUs(5_000_000), utc: UtcUs(1_000_000_000) };
        contact.restore(UtcUs(1_000_000_000 - 130_000_000), now, 0);
        assert_eq!(contact.next_heartbeat(now.mono), Some(MonoUs(55_000_000)));
        assert!(!contact.is_open(now.mono));
    }
}
