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

/// Publishes what other stations commit, until `stop`. Ours comes from the engine.
/// What they heard of our satellites goes to the engine.
pub(crate) async fn follow(
    store: Store,
    own: StationId,
    hub: Hub,
    engine: EngineInbox,
    stop: CancellationToken,
) {
    let follower = Follower { store, own, hub, engine };
    tokio::select! {
        () = stop.cancelled() => {}
        () = follower.run() => {}
    }
}

struct Follower {
    store: Store,
    own: StationId,
    hub: Hub,
    engine: EngineInbox,
}

impl Follower {
    async fn run(&self) {
        let mut place = None;
        let mut pause = BACK_OFF.0;
        loop {
            match self.connect(&mut place).await {
                Ok(Some(mut others)) => {
                    pause = BACK_OFF.0;
                    let error = self.tell(&mut others).await;
                    place = Some(others.place());
                    tracing::warn!("other stations cannot be followed: {error}; trying again");
                }
                Ok(None) => return,
                Err(error) => tracing::debug!("other stations cannot be followed yet: {error}"),
            }
            wall_sleep(pause).await;
            pause = (pause * 2).min(BACK_OFF.1);
        }
    }

    async fn connect(&self, place: &mut Option<i64>) -> Result<Option<Others>, StoreError> {
        let after = match *place {
            Some(after) => after,
            None => *place.insert(self.store.last_event_seq().await?),
        };
        self.store.others(after).await
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

    /// Tells what comes until it fails.
    async fn tell(&self, others: &mut Others) -> StoreError {
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
                for event in events.into_iter().filter(|event| event.record.station != self.own) {
                    if let Err(error) = self.pass_on(&event).await {
                        return error;
                    }
                    self.hub.publish(event);
                }
            }
            if let Err(error) = others.wait().await {
                return error;
            }
        }
    }
}
