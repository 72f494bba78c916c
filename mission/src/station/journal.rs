//! What is to be made durable, in order, one batch at a time; and what may happen only after that.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::clock::MonoUs;
use crate::id::BatchId;
use crate::port::{Effect, ReservedFrame};
use crate::record::{Batch, FrameRecord, ReceptionRecord, Record};
use crate::status::StorageStatus;

/// Above this many waiting records, derived ones are dropped: redecode makes them again.
const DERIVED_BOUND: usize = 50_000;
/// Above this many waiting records, raw frames find no place in memory either (the reserve has them if it had room),
/// and nothing follows from them: a row that names a frame which is not stored would spoil its batch for ever.
const FRAME_BOUND: usize = 100_000;

/// The batch that will hold what was pushed; durable once that batch is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Ticket(u64);

/// The queue of records between the engine and its storage.
#[derive(Debug, Default)]
pub(super) struct Journal {
    pending: Vec<Record>,
    in_flight: Option<Arc<Batch>>,
    retry_at: Option<MonoUs>,
    issued: u64,
    durable: u64,
    replies: VecDeque<(Ticket, Effect)>,
    status: StorageStatus,
    reserve_dirty: bool,
    newly_reserved: Vec<ReservedFrame>,
}

impl Journal {
    /// Adds a record to the batch that goes out next.
    pub(super) fn push(&mut self, record: Record) -> Ticket {
        let is_derived = matches!(record, Record::Telemetry(_) | Record::ReceptionRssi(_) | Record::Event(_));
        if is_derived && self.pending.len() >= DERIVED_BOUND {
            self.status.derived_dropped += 1;
        } else {
            self.pending.push(record);
        }
        Ticket(self.issued + 1)
    }

    /// Adds a raw frame with its reception; false when there is no room for it. While storage fails, and when there is
    /// no room, it goes to the reserve as well.
    pub(super) fn push_frame(&mut self, frame: FrameRecord, reception: ReceptionRecord) -> bool {
        let fits = !self.is_full();
        if self.status.failing.is_some() || !fits {
            self.reserve(&frame, &reception);
        }
        if fits {
            self.pending.push(Record::Frame(frame));
            self.pending.push(Record::Reception(reception));
        } else {
            self.status.frames_lost += 1;
        }
        fits
    }

    /// Adds another reception of a frame that is there already; dropped when there is no room.
    pub(super) fn push_reception(&mut self, reception: ReceptionRecord) {
        if self.is_full() {
            self.status.derived_dropped += 1;
        } else {
            self.pending.push(Record::Reception(reception));
        }
    }

    /// Records that wait.
    pub(super) const fn waiting(&self) -> usize {
        self.pending.len()
    }

    /// Nothing more is taken: storage has been behind for too long.
    pub(super) fn is_full(&self) -> bool {
        self.pending.len() >= FRAME_BOUND
    }

    /// The ticket for everything that was pushed so far.
    pub(super) fn ticket(&self) -> Ticket {
        Ticket(if self.pending.is_empty() { self.issued } else { self.issued + 1 })
    }

    pub(super) fn is_durable(&self, ticket: Ticket) -> bool {
        ticket.0 <= self.durable
    }

    /// Everything that was pushed is durable.
    pub(super) fn is_settled(&self) -> bool {
        self.pending.is_empty() && self.in_flight.is_none()
    }

    /// Lets `effect` happen once everything that was pushed so far is durable.
    pub(super) fn when_durable(&mut self, effect: Effect) {
        self.replies.push_back((self.ticket(), effect));
    }

    /// Sends the next batch if none is out, and lets go what waited for durability.
    pub(super) fn flush(&mut self, now: MonoUs, out: &mut VecDeque<Effect>) {
        out.extend(self.newly_reserved.drain(..).map(Effect::Reserve));
        if self.in_flight.is_some() {
            if self.retry_at.is_some_and(|at| at <= now) {
                self.retry_at = None;
                out.extend(self.in_flight.clone().map(Effect::Persist));
            }
        } else if !self.pending.is_empty() {
            self.issued += 1;
            let records = std::mem::take(&mut self.pending);
            let batch = Arc::new(Batch { id: BatchId(self.issued), records });
            self.in_flight = Some(Arc::clone(&batch));
            out.push_back(Effect::Persist(batch));
        }
        while self.replies.front().is_some_and(|(ticket, _)| ticket.0 <= self.durable) {
            out.extend(self.replies.pop_front().map(|(_, effect)| effect));
        }
    }

    /// The batch is durable. The reason for which storage had failed, when this ends it.
    pub(super) fn done(&mut self, id: BatchId) -> Option<String> {
        if self.in_flight.as_ref().is_none_or(|batch| batch.id != id) {
            return None;
        }
        self.in_flight = None;
        self.retry_at = None;
        self.durable = id.0;
        self.status.failing.take()
    }

    /// Nothing of the batch is durable: it is kept and tried again then. True when this is news.
    pub(super) fn failed(&mut self, again: MonoUs, id: BatchId, reason: &str) -> bool {
        if self.in_flight.as_ref().is_none_or(|batch| batch.id != id) {
            return false;
        }
        self.retry_at = Some(again);
        let is_news = self.status.failing.is_none();
        self.status.failing = Some(reason.to_owned());
        if is_news {
            self.reserve_waiting();
        }
        is_news
    }

    /// The reserve had no place for a frame. True when this is news.
    pub(super) fn unreserved(&mut self) -> bool {
        self.status.unreserved += 1;
        self.status.unreserved == 1
    }

    /// What was put into the reserve is all in the database: it may be emptied. Never in this life once a frame found
    /// a place in the reserve alone: the next start brings it back.
    pub(super) fn take_reserve_clear(&mut self) -> bool {
        self.status.failing.is_none()
            && self.status.frames_lost == 0
            && self.is_settled()
            && std::mem::take(&mut self.reserve_dirty)
    }

    /// Frames came back from the reserve: it is to be emptied once they are durable.
    pub(super) fn mark_reserve_dirty(&mut self) {
        self.reserve_dirty = true;
    }

    pub(super) fn failing(&self) -> Option<&str> {
        self.status.failing.as_deref()
    }

    pub(super) fn retry_at(&self) -> Option<MonoUs> {
        self.retry_at
    }

    pub(super) fn status(&self) -> StorageStatus {
        let waiting = self.pending.len() + self.in_flight.as_ref().map_or(0, |batch| batch.records.len());
        StorageStatus { waiting, ..self.status.clone() }
    }

    /// Puts every raw frame that waits into the reserve.
    fn reserve_waiting(&mut self) {
        let mut pairs: Vec<(FrameRecord, Option<ReceptionRecord>)> = Vec::new();
        let batch = self.in_flight.iter().flat_map(|batch| batch.records.iter());
        for record in batch.chain(&self.pending) {
            match record {
                Record::Frame(frame) => pairs.push((frame.clone(), None)),
                Record::Reception(reception) => {
                    // The first reception of a frame follows it at once.
                    if let Some(pair) = pairs.last_mut().filter(|(frame, _)| frame.id == reception.frame) {
                        pair.1.get_or_insert_with(|| reception.clone());
                    }
                }
                _ => {}
            }
        }
        for (frame, reception) in pairs {
            if let Some(reception) = reception {
                self.reserve(&frame, &reception);
            }
        }
    }

    fn reserve(&mut self, frame: &FrameRecord, reception: &ReceptionRecord) {
        self.status.reserved += 1;
        self.reserve_dirty = true;
        self.newly_reserved.push(ReservedFrame {
            route: frame.route.clone(),
            source: reception.source,
            received_at: reception.received_at,
            rssi_dbm: reception.rssi_dbm,
            bytes: frame.bytes.clone(),
        });
    }
}
