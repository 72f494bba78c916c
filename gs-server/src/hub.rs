//! The hub: committed events on their way to whoever watches.
//!
//! Watchers that fall behind lose their place (`RecvError::Lagged`) and read what they missed from storage by its
//! sequence; nothing is lost, and nobody waits for them.

use std::sync::Arc;

use tokio::sync::broadcast;

use crate::storage::StoredEvent;

/// Events that a watcher may lag behind before it has to read from storage.
pub const HUB_CAPACITY: usize = 1024;

/// Cheap to clone.
#[derive(Debug, Clone)]
pub struct Hub {
    events: broadcast::Sender<Arc<StoredEvent>>,
}

impl Hub {
    /// A hub that nobody watches yet.
    pub fn new() -> Self {
        Self { events: broadcast::Sender::new(HUB_CAPACITY) }
    }

    /// Every event that is published from now on.
    pub fn subscribe(&self) -> broadcast::Receiver<Arc<StoredEvent>> {
        self.events.subscribe()
    }

    /// Publishes an event **that is committed**.
    pub fn publish(&self, event: StoredEvent) {
        // No watcher is no error.
        let _ = self.events.send(Arc::new(event));
    }
}

impl Default for Hub {
    fn default() -> Self {
        Self::new()
    }
}
