//! What watchers see of the station: only what is durable, and not more often than an eye can follow.

use std::sync::Arc;

use mission::{MonoUs, Now, Station, Status};
use tokio::sync::watch;

/// The shortest time between two statuses, in microseconds of the station's clock.
const INTERVAL_US: u64 = 100_000;

pub(super) struct StatusView {
    sender: watch::Sender<Arc<Status>>,
    last_look: MonoUs,
    changed: bool,
}

impl StatusView {
    pub(super) fn new(station: &Station, now: Now) -> (Self, watch::Receiver<Arc<Status>>) {
        let (sender, receiver) = watch::channel(Arc::new(station.status(now)));
        (Self { sender, last_look: now.mono, changed: true }, receiver)
    }

    /// Something was taken in.
    pub(super) fn note(&mut self) {
        self.changed = true;
    }

    /// When to look again, if nothing else happens before.
    pub(super) fn due(&self, settled: bool) -> Option<MonoUs> {
        (self.changed && settled).then(|| self.last_look.plus(INTERVAL_US))
    }

    /// Shows the status if it is time, it is durable, and it has changed; whether it has. While storage fails only that
    /// is shown.
    pub(super) fn look(&mut self, station: &Station, now: Now, at_once: bool) -> bool {
        if !self.changed || (!at_once && now.mono.since(self.last_look) < INTERVAL_US) {
            return false;
        }
        let mut next = station.status(now);
        if station.is_settled() {
            self.changed = false;
        } else if next.storage.failing.is_some() {
            next = Status { storage: next.storage, at: next.at, ..Status::clone(&self.sender.borrow()) };
        } else {
            return false;
        }
        self.last_look = now.mono;
        self.sender.send_if_modified(|shown| {
            let same = Status { at: next.at, ..Status::clone(shown) } == next;
            if !same {
                *shown = Arc::new(next);
            }
            !same
        })
    }
}
