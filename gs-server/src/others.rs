//! The other stations on the same database: what they commit is told to our watchers, too.

use std::time::Duration;

use mission::StationId;
use mission::record::EventKind;
use tokio_util::sync::CancellationToken;

use crate::clock::wall_sleep;
use crate::engine::{EngineInbox, EngineMessage};
use crate::hub::Hub;
use crate::storage::{Others, Store, StoreError, StoredEvent};

/// Before a lost connection is tried again: twice as long each time, up to the second.
const BACK_OFF: (Duration, Duration) = (Duration::from_millis(500), Duration::from_secs(30));

/// Publishes what other stations commit. Ours comes from the engine. What they heard of our satellites goes to the engine.
pub(crate) struct Follower {
    pub(crate) store: Store,
    pub(crate) own: StationId,
    pub(crate) hub: Hub,
    pub(crate) engine: EngineInbox,
}

impl Follower {
    /// Follows from this place of the events on, until `stop`.
    pub(crate) async fn follow(self, place: i64, stop: CancellationToken) {
        tokio::select! {
            () = stop.cancelled() => {}
            () = self.run(place) => {}
        }
    }

    async fn run(&self, mut place: i64) {
        let mut pause = BACK_OFF.0;
        loop {
            match self.store.others(place).await {
                Ok(Some(mut others)) => {
                    pause = BACK_OFF.0;
                    let error = self.tell(&mut others, &mut place).await;
                    tracing::warn!("other stations cannot be followed: {error}; trying again");
                }
                Ok(None) => return,
                Err(error) => tracing::debug!("other stations cannot be followed yet: {error}"),
            }
            wall_sleep(pause).await;
            pause = (pause * 2).min(BACK_OFF.1);
        }
    }

    /// What they heard may belong to an image of ours.
    async fn pass_on(&self, event: &StoredEvent) -> Result<(), StoreError> {
        let (EventKind::FrameHeard, Some(id)) = (event.record.kind, event.record.subject.frame) else {
            return Ok(());
        };
        if let Some(frame) = self.store.frame_as_kept(id).await? {
            self.engine.send(EngineMessage::Elsewhere { id, frame: Box::new(frame) }).await;
        }
        Ok(())
    }

    /// Tells what comes until it fails, and how far it came.
    async fn tell(&self, others: &mut Others, place: &mut i64) -> StoreError {
        loop {
            // First the archive: what was committed before we listened is told by nobody.
            loop {
                let events = match others.read().await {
                    Ok(events) => events,
                    Err(error) => return error,
                };
                if events.is_empty() {
                    break;
                }
                for event in events {
                    let sequence = event.sequence;
                    if event.record.station != self.own {
                        if let Err(error) = self.pass_on(&event).await {
                            return error;
                        }
                        self.hub.publish(event);
                    }
                    *place = sequence;
                }
            }
            if let Err(error) = others.wait().await {
                return error;
            }
            *place = others.place();
        }
    }
}
