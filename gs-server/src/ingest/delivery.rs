//! Reports on their way to the engine, some at a time: while one part is being stored the next is looked up.

use std::collections::HashSet;
use std::sync::Arc;

use mission::SatelliteId;
use mission::reception::{Delivered, Ear, NotTaken, Reception, Taken};
use tokio::sync::{OwnedSemaphorePermit, oneshot};

use super::ears::{Ears, EarsError, Outcome};
use super::formats::Read;
use crate::engine::EngineMessage;
use crate::storage::StoreError;

/// Between two tries, microseconds.
const AGAIN_US: u64 = 1_000_000;

/// What tells a report from all others.
type Key = (Ear, String, String);

/// Many reports of one satellite, delivered part by part.
pub struct Delivery {
    ears: Ears,
    satellite: SatelliteId,
    ear: Ear,
    together: usize,
    patience: u32,
    under_way: Option<UnderWay>,
    _room: OwnedSemaphorePermit,
}

/// A part that the engine has, and storage perhaps not yet.
struct UnderWay {
    keys: HashSet<Key>,
    receptions: Vec<Delivered>,
    repeated: u64,
    answered: oneshot::Receiver<Result<Taken, NotTaken>>,
}

impl Delivery {
    pub(super) fn new(
        ears: Ears,
        (satellite, ear): (SatelliteId, Ear),
        (together, patience): (usize, u32),
        room: OwnedSemaphorePermit,
    ) -> Self {
        Self { ears, satellite, ear, together, patience, under_way: None, _room: room }
    }

    /// Hands reports over. What it comes back with is durable: all that was handed over before, but for the last part,
    /// which is on its way.
    ///
    /// # Errors
    /// [`EarsError`]: a part may have been taken, so deliver all of it again.
    pub async fn push(&mut self, found: Vec<Read>) -> Result<Outcome, EarsError> {
        let mut outcome = Outcome::default();
        let mut receptions = Vec::with_capacity(found.len());
        for read in found {
            match read {
                Ok(reception) => receptions.push(reception),
                Err(refused) => {
                    outcome.refused += 1;
                    self.ears.refuse(self.ear, refused.reason);
                }
            }
        }
        self.ears.doubt(&receptions);
        let mut rest = receptions.into_iter();
        while rest.len() > 0 {
            let part: Vec<Reception> = rest.by_ref().take(self.together).collect();
            outcome.add(&self.part(part).await?);
        }
        self.ears.took(self.ear, &outcome);
        Ok(outcome)
    }

    /// Waits until the last part is durable as well.
    ///
    /// # Errors
    /// [`EarsError`]: a part may have been taken, so deliver all of it again.
    pub async fn end(mut self) -> Result<Outcome, EarsError> {
        let outcome = self.settle().await?;
        self.ears.took(self.ear, &outcome);
        Ok(outcome)
    }

    async fn part(&mut self, part: Vec<Reception>) -> Result<Outcome, EarsError> {
        let came = part.len() as u64;
        // Looked up while the part before is stored; what is new in that one the engine remembers.
        let receptions = self.new_ones(part).await?;
        let outcome = self.settle().await?;
        let repeated = came - receptions.len() as u64;
        if receptions.is_empty() {
            return Ok(Outcome { repeated: outcome.repeated + repeated, ..outcome });
        }
        let keys = receptions.iter().map(|delivered| key(&delivered.reception)).collect();
        let answered = self.hand_over(&receptions).await;
        self.under_way = Some(UnderWay { keys, receptions, repeated, answered });
        Ok(outcome)
    }

    /// What the part that is under way came to.
    async fn settle(&mut self) -> Result<Outcome, EarsError> {
        let Some(UnderWay { receptions, repeated, mut answered, .. }) = self.under_way.take() else {
            return Ok(Outcome::default());
        };
        let mut tries = self.patience;
        loop {
            match answered.await.map_err(|_| EarsError::Ending)? {
                Ok(taken) => return Ok(Outcome { repeated, ..Outcome::from(taken) }),
                Err(NotTaken::Busy) if tries > 0 => {
                    tries -= 1;
                    let timer = self.ears.timer();
                    drop(timer.sleep_until(timer.now().mono.plus(AGAIN_US)).await);
                    answered = self.hand_over(&receptions).await;
                }
                Err(refusal) => {
                    if refusal == NotTaken::Busy {
                        self.ears.no_room(self.ear, receptions.len());
                    }
                    return Err(refusal.into());
                }
            }
        }
    }

    async fn hand_over(&self, receptions: &[Delivered]) -> oneshot::Receiver<Result<Taken, NotTaken>> {
        let (answer, answered) = oneshot::channel();
        let message = EngineMessage::Outside { receptions: receptions.to_vec(), answer };
        self.ears.engine().send(message).await;
        answered
    }

    /// Those of these reports that are not known, with the frames that are.
    async fn new_ones(&self, receptions: Vec<Reception>) -> Result<Vec<Delivered>, StoreError> {
        let store = self.ears.store();
        let mut known = store.known_reports(&receptions.iter().collect::<Vec<_>>()).await?;
        let before = self.under_way.as_ref().map(|under_way| &under_way.keys);
        let new: Vec<Reception> = receptions
            .into_iter()
            .filter(|report| {
                let key = key(report);
                !before.is_some_and(|before| before.contains(&key)) && known.insert(key)
            })
            .collect();
        let frames = store.known_frames(&self.satellite, &new.iter().collect::<Vec<_>>()).await?;
        let delivered = new.into_iter().zip(frames).map(|(reception, known)| Delivered {
            satellite: self.satellite.clone(),
            reception: Arc::new(reception),
            known,
        });
        Ok(delivered.collect())
    }
}

fn key(report: &Reception) -> Key {
    (report.ear, report.source_id.clone(), report.receiver_id().to_owned())
}
