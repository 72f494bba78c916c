//! The hub: committed events on their way to whoever watches.
//!
//! Watchers that fall behind lose their place (`RecvError::Lagged`) and read what they missed from storage by its
//! sequence; nothing is lost, and nobody waits for them.
//!
//! Who only needs to know *that* something is new has a bell (`Hub::bell`).

use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::{broadcast, mpsc};

use crate::clock::{BusyToken, Timer};
use crate::storage::StoredEvent;

/// Events that a watcher may lag behind before it has to read from storage.
pub const HUB_CAPACITY: usize = 1024;

/// Cheap to clone.
#[derive(Clone)]
pub struct Hub {
    events: broadcast::Sender<Arc<StoredEvent>>,
    bells: Arc<Mutex<Vec<Bell>>>,
}

struct Bell {
    timer: Arc<dyn Timer>,
    who: &'static str,
    rings: mpsc::Sender<BusyToken>,
}

impl Hub {
    /// A hub that nobody watches yet.
    pub fn new() -> Self {
        Self { events: broadcast::Sender::new(HUB_CAPACITY), bells: Arc::default() }
    }

    /// Every event that is published from now on.
    pub fn subscribe(&self) -> broadcast::Receiver<Arc<StoredEvent>> {
        self.events.subscribe()
    }

    /// Publishes an event **that is committed**.
    pub fn publish(&self, event: StoredEvent) {
        // No watcher is no error.
        let _ = self.events.send(Arc::new(event));
        self.ring();
    }

    /// A bell that rings at each event and at each [`Self::ring`]. Rings that nobody has taken yet are one, and hold a
    /// stepped clock: whoever has a bell listens to it all the time.
    pub(crate) fn bell(&self, timer: Arc<dyn Timer>, who: &'static str) -> mpsc::Receiver<BusyToken> {
        let (rings, bell) = mpsc::channel(1);
        self.lock().push(Bell { timer, who, rings });
        bell
    }

    /// Something else has changed than what events tell: the status, or what somebody found.
    pub(crate) fn ring(&self) {
        self.lock().retain(|bell| {
            // Taken before it is known whether there is room: in between, a stepped clock might jump.
            let busy = bell.timer.busy(bell.who);
            !matches!(bell.rings.try_send(busy), Err(mpsc::error::TrySendError::Closed(_)))
        });
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Bell>> {
        self.bells.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Default for Hub {
    fn default() -> Self {
        Self::new()
    }
}

impl std::fmt::Debug for Hub {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Hub").field("events", &self.events).field("bells", &self.lock().len()).finish()
    }
}
