//! The newest wish and nothing older: whoever steers an antenna wants the last word to count.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

use crate::clock::{BusyToken, Timer};

/// One place for one wish; a new one takes the place of one that nobody has read.
pub(super) struct Inbox<T> {
    slot: Mutex<Slot<T>>,
    arrival: Notify,
    timer: Arc<dyn Timer>,
}

struct Slot<T> {
    wish: Option<T>,
    /// Holds a stepped clock until the wish is read.
    token: Option<BusyToken>,
    is_closed: bool,
}

impl<T> Inbox<T> {
    pub(super) fn new(timer: Arc<dyn Timer>) -> Self {
        let slot = Mutex::new(Slot { wish: None, token: None, is_closed: false });
        Self { slot, arrival: Notify::new(), timer }
    }

    fn slot(&self) -> MutexGuard<'_, Slot<T>> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn put(&self, wish: T) {
        let token = self.timer.busy("wish for the antenna");
        let mut slot = self.slot();
        slot.wish = Some(wish);
        let old = slot.token.replace(token);
        drop(slot);
        drop(old);
        self.arrival.notify_one();
    }

    /// Nobody is left who could wish.
    pub(super) fn close(&self) {
        let token = self.timer.busy("end of the antenna's handle");
        let mut slot = self.slot();
        slot.is_closed = true;
        let old = slot.token.replace(token);
        drop(slot);
        drop(old);
        self.arrival.notify_one();
    }

    /// What is wished now, once.
    pub(super) fn take(&self) -> Option<T> {
        self.slot().wish.take()
    }

    pub(super) fn is_closed(&self) -> bool {
        self.slot().is_closed
    }

    /// Waits for a wish or for the end of all wishes; the token belongs to it. Safe to drop.
    pub(super) async fn arrived(&self) -> BusyToken {
        self.arrival.notified().await;
        let token = self.slot().token.take();
        token.unwrap_or_else(|| self.timer.busy("wish for the antenna"))
    }
}
