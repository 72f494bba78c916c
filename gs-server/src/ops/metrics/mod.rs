//! What is counted while the server runs, for `GET /metrics`.
//!
//! Counts are of this process: they begin at 0 with each start, as Prometheus expects. What the engine or the archive
//! knows anyway is asked when somebody looks (`http/metrics.rs`), and not counted twice.
//!
//! Labels have few values: names of the configuration and words of the program, never anything that was heard.

mod histogram;
pub mod machine;
pub mod text;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use mission::{Batch, UtcUs, record::Record};

pub use histogram::{Histogram, Reading};

use super::disk::DiskView;

/// The counters. Cheap to clone; all clones are one.
#[derive(Clone, Default)]
pub struct Metrics(Arc<Inner>);

#[derive(Default)]
struct Inner {
    engine_input: Histogram,
    persist: Histogram,
    stored: Mutex<Stored>,
    persist_failures: AtomicU64,
    streams: AtomicI64,
    streams_ended: Mutex<BTreeMap<&'static str, u64>>,
    clock_good: AtomicBool,
    upkeep: Mutex<Upkeep>,
}

/// Satellite and link.
pub type SatelliteLink = (String, String);

/// What became durable since the start.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Stored {
    /// Frames that were new, by satellite and link.
    pub frames: BTreeMap<SatelliteLink, u64>,
    /// Receptions: one station heard one frame.
    pub receptions: BTreeMap<SatelliteLink, u64>,
    /// Commands that reached a stage, by its word.
    pub stages: BTreeMap<&'static str, u64>,
    /// Events by the word of their level.
    pub events: BTreeMap<&'static str, u64>,
    /// Values.
    pub values: u64,
    /// Batches.
    pub batches: u64,
}

/// What the upkeep has seen and done.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Upkeep {
    /// The disk of the data folder; `None` before the first look.
    pub disk: Option<DiskView>,
    /// How far the machine's clock is off, seconds; `None` when nobody can tell.
    pub clock_offset_s: Option<f64>,
    /// When the newest backup was finished by this process.
    pub backup_at: Option<UtcUs>,
    /// Its size.
    pub backup_bytes: Option<u64>,
    /// Backups that failed.
    pub backup_failures: u64,
    /// The newest attempt failed, and why.
    pub backup_trouble: Option<String>,
    /// Values that retention has removed.
    pub values_removed: u64,
}

impl Metrics {
    /// The engine took something in that had waited this long.
    pub fn engine_input(&self, waited_us: u64) {
        self.0.engine_input.observe(waited_us);
    }

    /// A batch is durable, after this long.
    pub fn stored(&self, batch: &Batch, took_us: u64) {
        self.0.persist.observe(took_us);
        let mut stored = self.0.stored.lock().unwrap_or_else(PoisonError::into_inner);
        stored.batches += 1;
        for record in &batch.records {
            stored.count(record);
        }
    }

    /// A batch could not be stored.
    pub fn not_stored(&self) {
        self.0.persist_failures.fetch_add(1, Ordering::Relaxed);
    }

    /// Somebody says, or does not say, that the machine's clock is right.
    pub fn clock(&self, good: bool) {
        self.0.clock_good.store(good, Ordering::Relaxed);
    }

    /// A stream was opened; it counts until the guard is dropped.
    #[must_use]
    pub fn stream(&self) -> OpenStream {
        self.0.streams.fetch_add(1, Ordering::Relaxed);
        OpenStream(self.clone())
    }

    /// A stream ended, for this reason.
    pub fn stream_ended(&self, why: &'static str) {
        *self.0.streams_ended.lock().unwrap_or_else(PoisonError::into_inner).entry(why).or_default() += 1;
    }

    /// Changes what is known of the upkeep.
    pub fn upkeep(&self, change: impl FnOnce(&mut Upkeep)) {
        change(&mut self.0.upkeep.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// How long inputs waited for the engine.
    pub fn engine_inputs(&self) -> Reading {
        self.0.engine_input.read()
    }

    /// How long batches took to become durable.
    pub fn persists(&self) -> Reading {
        self.0.persist.read()
    }

    /// What became durable.
    pub fn what_was_stored(&self) -> Stored {
        self.0.stored.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Batches that could not be stored; each is tried again.
    pub fn persist_failures(&self) -> u64 {
        self.0.persist_failures.load(Ordering::Relaxed)
    }

    /// Streams that are open.
    pub fn streams(&self) -> i64 {
        self.0.streams.load(Ordering::Relaxed)
    }

    /// Streams that ended, by reason.
    pub fn streams_that_ended(&self) -> BTreeMap<&'static str, u64> {
        self.0.streams_ended.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The machine's clock counts as right.
    pub fn is_clock_good(&self) -> bool {
        self.0.clock_good.load(Ordering::Relaxed)
    }

    /// What the upkeep has seen and done.
    pub fn what_upkeep_saw(&self) -> Upkeep {
        self.0.upkeep.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Stored {
    fn count(&mut self, record: &Record) {
        match record {
            Record::Frame(frame) => {
                let route = (frame.route.satellite.to_string(), frame.route.link.to_string());
                *self.frames.entry(route).or_default() += 1;
            }
            Record::Reception(reception) => {
                let route = (reception.route.satellite.to_string(), reception.route.link.to_string());
                *self.receptions.entry(route).or_default() += 1;
            }
            Record::Stage(stage) => *self.stages.entry(stage.stage.name()).or_default() += 1,
            Record::Event(event) => *self.events.entry(event.level.name()).or_default() += 1,
            Record::Telemetry(telemetry) => self.values += telemetry.points.len() as u64,
            _ => {}
        }
    }
}

/// An open stream.
pub struct OpenStream(Metrics);

impl Drop for OpenStream {
    fn drop(&mut self) {
        self.0.0.streams.fetch_sub(1, Ordering::Relaxed);
    }
}
