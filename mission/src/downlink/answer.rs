//! The schedule, explained.

use protocol::{DownlinkSchedule, DownlinkSlot};
use tle::Propagator;

use crate::clock::UtcUs;
use crate::sky::instant;

use super::battery;
use super::bound;
use super::coverage::Coverage;
use super::pointing::nadir_mrp;
use super::search;
use super::task::{Task, TaskError};
use super::value::{Block, Value, losses_db};

/// A schedule and what it may be expected to bring.
#[derive(Debug, Clone, PartialEq)]
pub struct DownlinkPlan {
    /// The entries, in order of time.
    pub entries: Vec<Entry>,
    /// Missing chunks that are expected to be heard by anybody.
    pub expected_chunks: f64,
    /// The same of sending everything in turn from the beginning of the window.
    pub round_robin_chunks: f64,
    /// What no schedule under these rules can exceed.
    pub upper_bound_chunks: f64,
    /// Missing chunks.
    pub missing: usize,
    /// Passes over listeners in the window.
    pub visits: usize,
    /// The share of the window in which a listener has the satellite in view.
    pub coverage: f64,
}

/// One entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// When it begins.
    pub at: UtcUs,
    /// When its last frame ends, heartbeats in between included.
    pub end_at: UtcUs,
    /// First chunk.
    pub first: u16,
    /// How many chunks.
    pub count: u16,
    /// Of them missing.
    pub missing: u16,
    /// The attitude to take, modified Rodrigues parameters; `None`: it is left.
    pub attitude_mrp: Option<[f32; 3]>,
    /// The mean probability that somebody hears a frame of it.
    pub heard: f64,
    /// Chunks that it adds to what the entries before it are expected to bring.
    pub expected_chunks: f64,
    /// Who has it in view, the best first.
    pub ears: Vec<Ear>,
}

/// A listener with an entry in view.
#[derive(Debug, Clone, PartialEq)]
pub struct Ear {
    /// Which of the listeners.
    pub listener: usize,
    /// The probability that it listens at all.
    pub listening: f64,
    /// Frames of the entry that it is expected to hear.
    pub expected_frames: f64,
    /// Greatest elevation of the pass, degrees.
    pub max_elevation_deg: f64,
}

impl DownlinkPlan {
    /// The telecommand's content.
    #[must_use]
    pub fn schedule(&self) -> DownlinkSchedule {
        let slots = self.entries.iter().map(|entry| DownlinkSlot {
            time_ms: u64::try_from(entry.at.0 / 1000).unwrap_or(0),
            first: entry.first,
            count: entry.count,
            attitude_mrp: entry.attitude_mrp,
        });
        DownlinkSchedule { slots: slots.take(8).collect() }
    }
}

/// Finds a schedule.
///
/// # Errors
/// A task that makes no sense, or elements without a state in the window.
pub fn plan(task: &Task) -> Result<DownlinkPlan, TaskError> {
    let coverage = Coverage::of(task)?;
    let losses_db = losses_db(task);
    let mut blocks = search::best(task, &coverage, &losses_db);
    let expected = |blocks: &[Block]| Value::of(task, &coverage, &losses_db, blocks).expected();
    let naive = in_turn(task, &coverage);
    let round_robin_chunks = expected(&naive);
    // The search is no proof: where everybody hears everything, sending in turn can be a hair better.
    if round_robin_chunks > expected(&blocks) && battery::lasts(task, &coverage, &naive) {
        blocks = naive;
    }
    let mut found = explained(task, &coverage, &losses_db, &blocks)?;
    found.round_robin_chunks = round_robin_chunks;
    found.upper_bound_chunks = bound::upper(task, &coverage, found.expected_chunks);
    Ok(found)
}

/// The schedule of somebody who does not look at the map: everything in turn from the beginning of the window.
///
/// # Errors
/// As [`plan`].
pub fn round_robin(task: &Task) -> Result<DownlinkPlan, TaskError> {
    let coverage = Coverage::of(task)?;
    explained(task, &coverage, &losses_db(task), &in_turn(task, &coverage))
}

/// What any schedule may be expected to bring in a task, in chunks. Beginnings are taken to the next beat (1.2 s).
///
/// # Errors
/// As [`plan`].
pub fn expected_of(task: &Task, schedule: &DownlinkSchedule) -> Result<f64, TaskError> {
    let coverage = Coverage::of(task)?;
    let blocks: Vec<Block> = schedule
        .slots
        .iter()
        .filter_map(|slot| {
            let since_us = i64::try_from(slot.time_ms).ok()?.checked_mul(1000)?.checked_sub(task.from.0)?;
            let start =
                usize::try_from((since_us + coverage.beat_us / 2).div_euclid(coverage.beat_us)).ok()?;
            let count = slot.count.min(task.rules.chunks_max);
            Some(Block { start, first: slot.first, count })
        })
        .collect();
    Ok(Value::of(task, &coverage, &losses_db(task), &blocks).expected())
}

fn in_turn(task: &Task, coverage: &Coverage) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let (Some(&lowest), Some(&highest)) = (task.missing.first(), task.missing.last()) else { return blocks };
    let pause = usize::try_from(task.rules.pause_us.div_euclid(coverage.beat_us) + 1).unwrap_or(1);
    let (mut start, mut first) = (0, lowest);
    while blocks.len() < task.rules.entries_max && start < coverage.beats() {
        if coverage.is_silent[start] {
            start += 1;
            continue;
        }
        let left = highest - first + 1;
        let count = left.min(task.rules.chunks_max);
        blocks.push(Block { start, first, count });
        start += usize::from(count) + pause;
        let next = task.missing.iter().find(|&&chunk| chunk > first + (count - 1));
        first = next.copied().unwrap_or(lowest);
    }
    blocks
}

fn explained(
    task: &Task,
    coverage: &Coverage,
    losses_db: &[f64],
    blocks: &[Block],
) -> Result<DownlinkPlan, TaskError> {
    let orbit = Propagator::new(&task.elements)?;
    let mut value = Value::new(task);
    let mut entries = Vec::with_capacity(blocks.len());
    for &block in blocks {
        let at = coverage.at(block.start);
        let end_at = coverage.at(block.end());
        let attitude_mrp = match task.pointing {
            Some(pointing) => {
                let middle = UtcUs(at.0 + (end_at.0 - at.0) / 2);
                nadir_mrp(pointing.axis_body, orbit.at(instant(middle))?.r_teme_km)
            }
            None => None,
        };
        let expected_chunks = value.gain(task, coverage, losses_db, block);
        value.add(task, coverage, losses_db, block);
        let missing = (0..usize::from(block.count))
            .filter(|k| value.place_of(usize::from(block.first) + k).is_some())
            .count();
        let (heard, ears) = heard_by(task, coverage, losses_db, block);
        entries.push(Entry {
            at,
            end_at,
            first: block.first,
            count: block.count,
            missing: missing as u16,
            attitude_mrp,
            heard,
            expected_chunks,
            ears,
        });
    }
    Ok(DownlinkPlan {
        entries,
        expected_chunks: value.expected(),
        round_robin_chunks: 0.0,
        upper_bound_chunks: 0.0,
        missing: task.missing.len(),
        visits: coverage.visits(),
        coverage: coverage.share(),
    })
}

/// The mean probability that somebody hears a frame of an entry, and who.
fn heard_by(task: &Task, coverage: &Coverage, losses_db: &[f64], block: Block) -> (f64, Vec<Ear>) {
    let mut by_visit: Vec<(u32, f64)> = Vec::new();
    let mut heard = 0.0;
    for (beat, loss_db) in (block.start..block.end()).zip(losses_db) {
        let mut nobody = 1.0;
        for &number in coverage.in_view.get(beat).into_iter().flatten() {
            let visit = &coverage.visits[number as usize];
            let frame = visit.listening * visit.heard(task, beat, *loss_db);
            nobody *= 1.0 - frame;
            match by_visit.iter_mut().find(|(known, _)| *known == number) {
                Some(known) => known.1 += frame,
                None => by_visit.push((number, frame)),
            }
        }
        heard += 1.0 - nobody;
    }
    by_visit.sort_by(|a, b| b.1.total_cmp(&a.1));
    let ears = by_visit
        .into_iter()
        .map(|(number, expected_frames)| {
            let visit = &coverage.visits[number as usize];
            Ear {
                listener: visit.listener,
                listening: visit.listening,
                expected_frames,
                max_elevation_deg: visit.elevation_deg,
            }
        })
        .collect();
    (heard / f64::from(block.count.max(1)), ears)
}
