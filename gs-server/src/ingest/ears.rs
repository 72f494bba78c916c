//! The one way of reports into the archive: what is known already is left out, the rest goes to the engine, and what was
//! refused is counted by its reason.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use mission::reception::{Ear, NotTaken, Reception, Refusal, Taken};
use mission::{SatelliteId, UtcUs};
use tokio::sync::Semaphore;

use super::delivery::Delivery;
use super::formats::Read;
use crate::clock::Timer;
use crate::engine::EngineInbox;
use crate::storage::{Store, StoreError};

/// Reports that go to the engine together.
pub const TOGETHER: usize = 1_000;
/// The same where no radio waits behind them: fewer and larger transactions.
pub const TOGETHER_ALONE: usize = 8_000;
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
    room: Arc<Semaphore>,
    counts: Mutex<BTreeMap<Ear, EarCounts>>,
}

impl Ears {
    /// A way into this archive, by this engine.
    pub fn new(store: Store, engine: EngineInbox, timer: Arc<dyn Timer>) -> Self {
        let counts = Mutex::new(BTreeMap::new());
        Self(Arc::new(Inner { store, engine, timer, room: Arc::new(Semaphore::new(UNDER_WAY)), counts }))
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
        let mut delivery = self.deliver(satellite, ear, TOGETHER, patience).await?;
        let mut outcome = delivery.push(found).await?;
        outcome.add(&delivery.end().await?);
        Ok(outcome)
    }

    /// Begins a delivery of many reports, of which `together` go to the engine at a time. It waits while as many others
    /// are under way as may be.
    ///
    /// # Errors
    /// [`EarsError::Ending`].
    pub async fn deliver(
        &self,
        satellite: &SatelliteId,
        ear: Ear,
        together: usize,
        patience: u32,
    ) -> Result<Delivery, EarsError> {
        let room = Arc::clone(&self.0.room).acquire_owned().await.map_err(|_| EarsError::Ending)?;
        Ok(Delivery::new(self.clone(), (satellite.clone(), ear), (together, patience), room))
    }

    /// What was counted, by ear.
    pub fn counts(&self) -> BTreeMap<Ear, EarCounts> {
        self.0.counts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Counts a message that never became a report, such as one for which there was no room.
    pub fn refuse(&self, ear: Ear, reason: Refusal) {
        self.count(ear, |counts| *counts.refused.entry(reason.name()).or_default() += 1);
    }

    /// Counts reports for which there was no room.
    pub(super) fn no_room(&self, ear: Ear, reports: usize) {
        self.count(ear, |counts| {
            *counts.refused.entry(Refusal::NoRoom.name()).or_default() += reports as u64;
        });
    }

    fn count(&self, ear: Ear, change: impl FnOnce(&mut EarCounts)) {
        change(self.0.counts.lock().unwrap_or_else(PoisonError::into_inner).entry(ear).or_default());
    }

    /// Counts what was not believed of reports.
    pub(super) fn doubt(&self, receptions: &[Reception]) {
        for reception in receptions.iter().filter(|reception| !reception.doubts.is_empty()) {
            self.count(reception.ear, |counts| {
                for doubt in reception.doubts.iter() {
                    *counts.doubts.entry(doubt.name()).or_default() += 1;
                }
            });
        }
    }

    /// Counts what reports came to.
    pub(super) fn took(&self, ear: Ear, outcome: &Outcome) {
        let now = self.now();
        self.count(ear, |counts| {
            counts.outcome.add(outcome);
            counts.last_at = Some(now);
            if outcome.frames + outcome.merged + outcome.without_frame > 0 {
                counts.last_new_at = Some(now);
            }
        });
    }

    pub(super) fn timer(&self) -> &Arc<dyn Timer> {
        &self.0.timer
    }

    pub(super) fn store(&self) -> &Store {
        &self.0.store
    }

    pub(super) fn engine(&self) -> &EngineInbox {
        &self.0.engine
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
