//! Events to come, in order of time, and of insertion where times are equal.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// More than this and new events are refused; a full buffer each way needs far fewer.
const MOST_EVENTS: usize = 4096;

/// A step inside the module.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Event {
    Booted {
        life: u32,
    },
    Reset {
        life: u32,
    },
    ModeLow {
        life: u32,
    },
    ModeDone {
        life: u32,
    },
    /// The foremost piece from the host has arrived whole.
    Arrived,
    /// Three byte times after the last byte of this burst.
    BurstEnd {
        burst: u32,
    },
    RadioDone {
        life: u32,
    },
    /// Bytes reach the host.
    Output {
        bytes: Vec<u8>,
    },
    OutputDone {
        life: u32,
    },
    Chatter,
}

#[derive(Debug, Default)]
pub(super) struct Timeline {
    events: BinaryHeap<Reverse<(u64, u64, Event)>>,
    inserted: u64,
}

impl Timeline {
    pub(super) fn push(&mut self, at_us: u64, event: Event) {
        if self.events.len() < MOST_EVENTS {
            self.inserted += 1;
            self.events.push(Reverse((at_us, self.inserted, event)));
        }
    }

    pub(super) fn next_us(&self) -> Option<u64> {
        self.events.peek().map(|Reverse((at_us, ..))| *at_us)
    }

    /// The first event, if it is due.
    pub(super) fn pop(&mut self, now_us: u64) -> Option<(u64, Event)> {
        if self.next_us()? > now_us {
            return None;
        }
        self.events.pop().map(|Reverse((at_us, _, event))| (at_us, event))
    }

    /// Drops bytes that have not reached the host.
    pub(super) fn forget_output(&mut self) {
        self.events.retain(|Reverse((_, _, event))| !matches!(event, Event::Output { .. }));
    }
}
