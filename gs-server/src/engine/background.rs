//! What the engine's actor has others do meanwhile: disks that may take their time.

use std::collections::VecDeque;

use mission::port::ReservedFrame;
use mission::{BatchId, IntentId};
use protocol::{Counter, KeyId};
use tokio::task::{JoinError, JoinSet};

use crate::clock::BusyToken;
use crate::storage::{Store, StoreError, StoredEvent, StoredIntent};

/// Something that was done.
pub(super) enum Outcome {
    Persisted {
        batch: BatchId,
        result: Result<Vec<StoredEvent>, StoreError>,
    },
    Witness {
        key: KeyId,
        counter: Counter,
        result: Result<(), StoreError>,
    },
    LookedUp {
        intent: IntentId,
        result: Result<Option<StoredIntent>, StoreError>,
    },
    /// Why a raw frame found no place in the reserve, if so.
    Reserve {
        refused: Option<String>,
    },
    Clock {
        synchronised: bool,
    },
}

pub(super) enum ReserveWork {
    Push(Box<ReservedFrame>),
    Clear,
}

/// Reserve work that may wait; beyond it a frame is only in memory.
const RESERVE_QUEUE: usize = 4096;

/// Tasks under way, each holding the clock.
#[derive(Default)]
pub(super) struct Background {
    tasks: JoinSet<(Outcome, BusyToken)>,
    reserve: VecDeque<ReserveWork>,
    reserving: bool,
}

impl Background {
    pub(super) fn start(&mut self, busy: BusyToken, work: impl Future<Output = Outcome> + Send + 'static) {
        self.tasks.spawn(async move { (work.await, busy) });
    }

    /// Reserve work is done in its order, one after the other. False when even the queue is full.
    #[must_use]
    pub(super) fn queue_reserve(&mut self, work: ReserveWork) -> bool {
        if self.reserve.len() >= RESERVE_QUEUE {
            tracing::error!(
                "the disk takes neither records nor the reserve: a raw frame is held in memory only"
            );
            return false;
        }
        self.reserve.push_back(work);
        true
    }

    pub(super) fn reserve_step(&mut self, store: &Store, busy: impl FnOnce() -> BusyToken) {
        if self.reserving {
            return;
        }
        let Some(work) = self.reserve.pop_front() else { return };
        self.reserving = true;
        let store = store.clone();
        self.start(busy(), async move {
            let (is_frame, result) = match work {
                ReserveWork::Push(frame) => (true, store.reserve_push(*frame).await),
                ReserveWork::Clear => (false, store.reserve_clear().await),
            };
            let refused = result.err().map(|error| error.to_string());
            if let Some(error) = &refused {
                tracing::error!(%error, "the reserve does not do as it is told: {error}");
            }
            Outcome::Reserve { refused: refused.filter(|_| is_frame) }
        });
    }

    pub(super) fn is_idle(&self) -> bool {
        self.tasks.is_empty() && self.reserve.is_empty()
    }

    /// The next outcome; pending while nothing is under way.
    pub(super) async fn next(&mut self) -> Result<(Outcome, BusyToken), JoinError> {
        match self.tasks.join_next().await {
            Some(result) => {
                if matches!(result, Ok((Outcome::Reserve { .. }, _))) {
                    self.reserving = false;
                }
                result
            }
            None => std::future::pending().await,
        }
    }
}
