//! Reports on their way to the engine, some at a time: while one part is being stored the next is looked up.

use std::collections::{HashSet, VecDeque};
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use mission::SatelliteId;
use mission::reception::{Delivered, Ear, NotTaken, Reception, Taken};
use tokio::sync::{OwnedSemaphorePermit, oneshot};

use super::ears::{Ears, EarsError, Outcome, TOGETHER};
use super::formats::Read;
use crate::engine::EngineMessage;
use crate::storage::StoreError;

/// Between two tries, microseconds.
const AGAIN_US: u64 = 1_000_000;

/// A report, as what tells it from all others.
struct Key(Arc<Reception>);

impl Key {
    fn parts(&self) -> (Ear, &str, &str) {
        (self.0.ear, &self.0.source_id, self.0.receiver_id())
    }
}

impl PartialEq for Key {
    fn eq(&self, other: &Self) -> bool {
        self.parts() == other.parts()
    }
}

impl Eq for Key {}

impl Hash for Key {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.parts().hash(state);
    }
}

/// Many reports of one satellite, delivered part by part.
pub struct Delivery {
    ears: Ears,
    satellite: SatelliteId,
    ear: Ear,
    together: usize,
    patience: u32,
    /// Oldest first.
    under_way: VecDeque<UnderWay>,
    _room: OwnedSemaphorePermit,
}

/// A part that the engine has, and storage perhaps not yet.
struct UnderWay {
    keys: HashSet<Key>,
    receptions: Vec<Delivered>,
    answered: oneshot::Receiver<Result<Taken, NotTaken>>,
}

impl Delivery {
    pub(super) fn new(
        ears: Ears,
        (satellite, ear): (SatelliteId, Ear),
        (together, patience): (usize, u32),
        room: OwnedSemaphorePermit,
    ) -> Self {
        Self { ears, satellite, ear, together, patience, under_way: VecDeque::new(), _room: room }
    }

    /// Hands reports over. What it comes back with is durable: all that was handed over before, but for the last parts,
    /// which are on their way.
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

    /// Waits until the last parts are durable as well.
    ///
    /// # Errors
    /// [`EarsError`]: a part may have been taken, so deliver all of it again.
    pub async fn end(mut self) -> Result<Outcome, EarsError> {
        let mut outcome = Outcome::default();
        while !self.under_way.is_empty() {
            outcome.add(&self.settle().await?);
        }
        self.ears.took(self.ear, &outcome);
        Ok(outcome)
    }

    /// Parts that the engine may have at once. Where nothing else is done it reads one while the one before is stored.
    const fn ahead(&self) -> usize {
        if self.together > TOGETHER { 2 } else { 1 }
    }

    async fn part(&mut self, part: Vec<Reception>) -> Result<Outcome, EarsError> {
        let came = part.len() as u64;
        // Looked up while the parts before are stored; what is new in those the engine remembers.
        let (receptions, keys) = self.new_ones(part).await?;
        let mut outcome = Outcome { repeated: came - receptions.len() as u64, ..Outcome::default() };
        if receptions.is_empty() {
            return Ok(outcome);
        }
        if self.under_way.len() >= self.ahead() {
            outcome.add(&self.settle().await?);
        }
        let answered = self.hand_over(&receptions).await;
        self.under_way.push_back(UnderWay { keys, receptions, answered });
        Ok(outcome)
    }

    /// What the oldest part that is under way came to.
    async fn settle(&mut self) -> Result<Outcome, EarsError> {
        let Some(UnderWay { mut receptions, mut answered, .. }) = self.under_way.pop_front() else {
            return Ok(Outcome::default());
        };
        let mut tries = self.patience;
        loop {
            match answered.await.map_err(|_| EarsError::Ending)? {
                Ok(taken) => return Ok(Outcome::from(taken)),
                Err(NotTaken::Busy) if tries > 0 => {
                    tries -= 1;
                    let timer = self.ears.timer();
                    drop(timer.sleep_until(timer.now().mono.plus(AGAIN_US)).await);
                    // What it was looked up for is some time ago.
                    let reports = receptions.into_iter().map(|delivered| delivered.reception).collect();
                    receptions = self.with_known(reports).await?;
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
    async fn new_ones(
        &self,
        receptions: Vec<Reception>,
    ) -> Result<(Vec<Delivered>, HashSet<Key>), StoreError> {
        let known = self.ears.store().known_reports(&receptions.iter().collect::<Vec<_>>()).await?;
        let is_known = |report: &Reception| {
            let key = || (report.ear, report.source_id.clone(), report.receiver_id().to_owned());
            !known.is_empty() && known.contains(&key())
        };
        let mut keys = HashSet::with_capacity(receptions.len());
        let mut new = Vec::with_capacity(receptions.len());
        for reception in receptions.into_iter().filter(|report| !is_known(report)).map(Arc::new) {
            let key = Key(Arc::clone(&reception));
            let is_under_way = self.under_way.iter().any(|part| part.keys.contains(&key));
            if !is_under_way && keys.insert(key) {
                new.push(reception);
            }
        }
        Ok((self.with_known(new).await?, keys))
    }

    /// These reports with the frames of the archive that they may be of.
    async fn with_known(&self, reports: Vec<Arc<Reception>>) -> Result<Vec<Delivered>, StoreError> {
        let asked = reports.iter().map(Arc::as_ref).collect::<Vec<_>>();
        let frames = self.ears.store().known_frames(&self.satellite, &asked).await?;
        let delivered = reports.into_iter().zip(frames).map(|(reception, known)| Delivered {
            satellite: self.satellite.clone(),
            reception,
            known,
        });
        Ok(delivered.collect())
    }
}
