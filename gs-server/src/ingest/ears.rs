//! The one way of reports into the archive: what is known already is left out, the rest goes to the engine, and what was
//! refused is counted by its reason.

use std::collections::{BTreeMap, HashSet};
use std::sync::{Arc, Mutex, PoisonError};

use mission::reception::{Delivered, Ear, NotTaken, Reception, Refusal, Taken};
use mission::{SatelliteId, UtcUs};
use tokio::sync::{Semaphore, oneshot};

use super::formats::Read;
use crate::clock::Timer;
use crate::engine::{EngineInbox, EngineMessage};
use crate::storage::{Store, StoreError};

/// Reports that go to the engine together.
pub const TOGETHER: usize = 1_000;
/// Between two tries, microseconds.
const AGAIN_US: u64 = 1_000_000;
/// Deliveries under way at once, of all sources; others wait.
const UNDER_WAY: usize = 3;

/// What a delivery came to. Durable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Outcome {
    /// Frames that nobody had heard before.
    pub frames: u64,
    /// Receptions of frames that were there.
    pub merged: u64,
    /// Detections and damaged packets.
    pub without_frame: u64,
    /// Reports that were stored before: nothing happened.
    pub repeated: u64,
    /// Reports that were refused.
    pub refused: u64,
}

impl Outcome {
    /// Both together.
    pub const fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.merged += other.merged;
        self.without_frame += other.without_frame;
        self.repeated += other.repeated;
        self.refused += other.refused;
    }
}

/// Why reports were not taken. Nothing is lost by delivering them again.
#[derive(Debug, thiserror::Error)]
pub enum EarsError {
    /// The engine does not take them now.
    #[error("the station takes no reports: {0}")]
    NotTaken(#[from] NotTaken),
    /// The archive could not be asked what is there already.
    #[error("the archive cannot be read")]
    Storage(#[from] StoreError),
    /// The server is ending.
    #[error("the server is ending")]
    Ending,
}

/// What was counted of one ear since the start of the server.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EarCounts {
    /// What became of its reports.
    pub outcome: Outcome,
    /// Refused reports by reason.
    pub refused: BTreeMap<&'static str, u64>,
    /// Values that were dropped, by reason; their receptions were kept.
    pub doubts: BTreeMap<&'static str, u64>,
    /// When something came in last.
    pub last_at: Option<UtcUs>,
    /// When something new came in last.
    pub last_new_at: Option<UtcUs>,
}

/// The way in. Cheap to clone; all clones are one.
#[derive(Clone)]
pub struct Ears(Arc<Inner>);

struct Inner {
    store: Store,
    engine: EngineInbox,
    timer: Arc<dyn Timer>,
    room: Semaphore,
    counts: Mutex<BTreeMap<Ear, EarCounts>>,
}

impl Ears {
    /// A way into this archive, by this engine.
    pub fn new(store: Store, engine: EngineInbox, timer: Arc<dyn Timer>) -> Self {
        let counts = Mutex::new(BTreeMap::new());
        Self(Arc::new(Inner { store, engine, timer, room: Semaphore::new(UNDER_WAY), counts }))
    }

    /// The time now, by the station's clock.
    pub fn now(&self) -> UtcUs {
        self.0.timer.now().utc
    }

    /// Takes reports of a satellite in. `ear` is under which what was refused is counted. Comes back when everything is
    /// durable; the same reports again change nothing.
    ///
    /// # Errors
    /// [`EarsError`]: a part may have been taken, so deliver all of it again.
    pub async fn take(
        &self,
        satellite: &SatelliteId,
        ear: Ear,
        found: Vec<Read>,
    ) -> Result<Outcome, EarsError> {
        self.take_patiently(satellite, ear, found, 0).await
    }

    /// As [`Ears::take`]; where storage does not keep up it is asked again so many times, with a second between.
    ///
    /// # Errors
    /// [`EarsError`].
    pub async fn take_patiently(
        &self,
        satellite: &SatelliteId,
        ear: Ear,
        found: Vec<Read>,
        patience: u32,
    ) -> Result<Outcome, EarsError> {
        let mut outcome = Outcome::default();
        let mut receptions = Vec::new();
        for read in found {
            match read {
                Ok(reception) => receptions.push(reception),
                Err(refused) => {
                    outcome.refused += 1;
                    self.count(ear, |counts| *counts.refused.entry(refused.reason.name()).or_default() += 1);
                }
            }
        }
        while !receptions.is_empty() {
            let rest = receptions.split_off(receptions.len().min(TOGETHER));
            let part = self.together(satellite, std::mem::replace(&mut receptions, rest), patience).await?;
            outcome.add(&part);
        }
        let now = self.now();
        self.count(ear, |counts| {
            counts.outcome.add(&outcome);
            counts.last_at = Some(now);
            if outcome.frames + outcome.merged + outcome.without_frame > 0 {
                counts.last_new_at = Some(now);
            }
        });
        Ok(outcome)
    }

    /// What was counted, by ear.
    pub fn counts(&self) -> BTreeMap<Ear, EarCounts> {
        self.0.counts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Counts a message that never became a report, such as one for which there was no room.
    pub fn refuse(&self, ear: Ear, reason: Refusal) {
        self.count(ear, |counts| *counts.refused.entry(reason.name()).or_default() += 1);
    }

    fn count(&self, ear: Ear, change: impl FnOnce(&mut EarCounts)) {
        change(self.0.counts.lock().unwrap_or_else(PoisonError::into_inner).entry(ear).or_default());
    }

    async fn together(
        &self,
        satellite: &SatelliteId,
        receptions: Vec<Reception>,
        patience: u32,
    ) -> Result<Outcome, EarsError> {
        let _room = self.0.room.acquire().await.map_err(|_| EarsError::Ending)?;
        let came = receptions.len() as u64;
        for reception in &receptions {
            if !reception.doubts.is_empty() {
                self.count(reception.ear, |counts| {
                    for doubt in reception.doubts.iter() {
                        *counts.doubts.entry(doubt.name()).or_default() += 1;
                    }
                });
            }
        }
        let delivered = new_ones(&self.0.store, satellite, receptions).await?;
        let repeated = came - delivered.len() as u64;
        if delivered.is_empty() {
            return Ok(Outcome { repeated, ..Outcome::default() });
        }
        let mut tries = patience;
        loop {
            let (answer, answered) = oneshot::channel();
            self.0.engine.send(EngineMessage::Outside { receptions: delivered.clone(), answer }).await;
            match answered.await.map_err(|_| EarsError::Ending)? {
                Ok(taken) => return Ok(Outcome { repeated, ..Outcome::from(taken) }),
                Err(NotTaken::Busy) if tries > 0 => {
                    tries -= 1;
                    let at = self.0.timer.now().mono.plus(AGAIN_US);
                    drop(self.0.timer.sleep_until(at).await);
                }
                Err(refusal) => return Err(refusal.into()),
            }
        }
    }
}

impl From<Taken> for Outcome {
    fn from(taken: Taken) -> Self {
        Self {
            frames: taken.frames.into(),
            merged: taken.merged.into(),
            without_frame: taken.without_frame.into(),
            ..Self::default()
        }
    }
}

/// Those of these reports that the archive does not have, with the frames that it does.
async fn new_ones(
    store: &Store,
    satellite: &SatelliteId,
    receptions: Vec<Reception>,
) -> Result<Vec<Delivered>, StoreError> {
    let all: Vec<&Reception> = receptions.iter().collect();
    let known = store.known_reports(&all).await?;
    let mut seen = HashSet::new();
    let new: Vec<Reception> = receptions
        .into_iter()
        .filter(|report| {
            let key = (report.ear, report.source_id.clone(), report.receiver_id().to_owned());
            !known.contains(&key) && seen.insert(key)
        })
        .collect();
    let frames = store.known_frames(satellite, &new.iter().collect::<Vec<_>>()).await?;
    let delivered = new.into_iter().zip(frames).map(|(reception, known)| Delivered {
        satellite: satellite.clone(),
        reception: Arc::new(reception),
        known,
    });
    Ok(delivered.collect())
}
