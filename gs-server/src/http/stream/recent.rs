//! The events that came last, made ready: a stream that begins or goes on within them needs no archive.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::feed::Batch;

/// So many events are held at least, once there were as many: seconds of a busy station.
const HELD: usize = 2048;

#[derive(Default)]
pub(super) struct Recent(Mutex<Held>);

#[derive(Default)]
struct Held {
    /// In order, each event following the one before.
    batches: VecDeque<Arc<Batch>>,
    events: usize,
    /// The newest event; `None` until somebody has said.
    last: Option<i64>,
}

/// What there is after some event.
pub(super) struct After {
    /// The newest event of all.
    pub(super) last: i64,
    /// All that follow; the first batch may begin earlier.
    pub(super) batches: Vec<Arc<Batch>>,
}

impl Recent {
    fn lock(&self) -> MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The archive says which event is the newest, at the beginning.
    pub(super) fn begin(&self, last: i64) {
        let mut held = self.lock();
        held.last = held.last.max(Some(last));
    }

    /// Takes in what comes next.
    pub(super) fn add(&self, batch: &Arc<Batch>) {
        let mut held = self.lock();
        let (Some(first), Some(end)) = (batch.first(), batch.last()) else { return };
        let follows =
            batch.is_whole() && held.batches.back().is_none_or(|before| before.last() == Some(first - 1));
        if !follows {
            // After a hole nothing of before serves: the archive tells what lies in it.
            held.batches.clear();
            held.events = 0;
        }
        if batch.is_whole() {
            held.events += batch.events.len();
            held.batches.push_back(Arc::clone(batch));
        }
        held.last = held.last.max(Some(end));
        while let Some(oldest) = held.batches.front().map(|batch| batch.events.len())
            && held.events - oldest >= HELD
        {
            held.batches.pop_front();
            held.events -= oldest;
        }
    }

    /// The newest event that is known of; 0 while that is nobody's knowledge.
    pub(super) fn last(&self) -> i64 {
        self.lock().last.unwrap_or_default()
    }

    /// All after this event (after the newest when there is none named). `None` when the archive must be asked.
    pub(super) fn after(&self, event: Option<i64>) -> Option<After> {
        let held = self.lock();
        let last = held.last?;
        let event = event.unwrap_or(last);
        if event == last {
            return Some(After { last, batches: Vec::new() });
        }
        let reaches = held.batches.back().and_then(|batch| batch.last()) == Some(last);
        let first = held.batches.front().and_then(|batch| batch.first())?;
        if !reaches || event > last || event < first - 1 {
            return None;
        }
        let known = held.batches.partition_point(|batch| batch.last().is_some_and(|end| end <= event));
        Some(After { last, batches: held.batches.iter().skip(known).cloned().collect() })
    }
}

#[cfg(test)]
mod tests {
    use mission::record::{EventKind, EventRecord, Subject};
    use mission::{Level, StationId, UtcUs};

    use super::super::feed::Prepared;
    use super::*;
    use crate::storage::StoredEvent;

    fn batch(sequences: impl IntoIterator<Item = i64>) -> Arc<Batch> {
        let event = |sequence| {
            let record = EventRecord {
                at: UtcUs(0),
                kind: EventKind::Link,
                level: Level::Normal,
                satellite: None,
                station: StationId::new("roof").unwrap(),
                link: None,
                key: None,
                subject: Subject::default(),
                message: String::new(),
            };
            Prepared::new(Arc::new(StoredEvent { sequence, record }))
        };
        Arc::new(Batch { events: sequences.into_iter().map(event).collect() })
    }

    /// The events after one, without those of the first batch that were before.
    fn after(recent: &Recent, event: Option<i64>) -> Option<(i64, Vec<i64>)> {
        let found = recent.after(event)?;
        let events = found.batches.iter().flat_map(|batch| batch.events.iter().map(Prepared::sequence));
        Some((found.last, events.filter(|one| *one > event.unwrap_or(found.last)).collect()))
    }

    #[test]
    fn what_was_said_lately_is_at_hand_and_what_was_before_is_not() {
        let recent = Recent::default();
        assert_eq!(after(&recent, None), None, "nobody has said yet where the archive ends");
        recent.begin(10);
        assert_eq!(
            (after(&recent, None), after(&recent, Some(10))),
            (Some((10, vec![])), Some((10, vec![])))
        );
        assert_eq!((after(&recent, Some(9)), after(&recent, Some(11))), (None, None));
        recent.add(&batch(11..=13));
        recent.add(&batch(14..=14));
        assert_eq!(after(&recent, Some(10)), Some((14, vec![11, 12, 13, 14])));
        assert_eq!(after(&recent, Some(12)), Some((14, vec![13, 14])));
        assert_eq!(after(&recent, Some(13)), Some((14, vec![14])));
        assert_eq!((after(&recent, Some(9)), after(&recent, Some(15))), (None, None));
    }

    #[test]
    fn a_hole_makes_it_forget_what_was_before() {
        let recent = Recent::default();
        recent.begin(0);
        recent.add(&batch(1..=3));
        recent.add(&batch(5..=6));
        assert_eq!(after(&recent, Some(2)), None);
        assert_eq!(after(&recent, Some(4)), Some((6, vec![5, 6])));
        recent.add(&batch([7, 9]));
        assert_eq!((after(&recent, Some(6)), after(&recent, None)), (None, Some((9, vec![]))));
        recent.begin(20);
        assert_eq!(after(&recent, Some(9)), None, "the archive knows of more");
    }

    #[test]
    fn it_holds_no_more_than_it_should() {
        let recent = Recent::default();
        for first in (1..=10_000).step_by(10) {
            recent.add(&batch(first..first + 10));
        }
        let held = recent.lock().events;
        assert!((HELD..HELD + 10).contains(&held), "{held}");
        assert_eq!(after(&recent, Some(10_000 - 2000)).unwrap().1.len(), 2000);
        assert_eq!(after(&recent, Some(7000)), None);
    }
}
