//! A schedule of blind downlinks on the twin: what it sends and when, who would hear it, and what comes home.
//!
//! The planner of [`mission::downlink`] reckons with a raster of time and with expectations. Here the flight software gets the
//! schedule as a telecommand, keeps its own heartbeats and queue, and sends frame by frame; then each listener listens in a
//! pass or does not, and hears each frame or does not, by a seed. What the two say must agree, and a test holds them to it.

use mission::UtcUs;
use mission::downlink::{Listener, Task};
use mission::sky::instant;
use protocol::{Counter, DownFrame, Downlink, DownlinkSchedule, Key, Nonce, RequestTag, Telecommand, seal};
use radio::airtime::LinkTiming;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satellite::{ImageSource, Orbit, Twin, TwinConfig, TwinState};
use tle::propagator::ElementsError;
use tle::{Propagator, ecef_from_teme, gmst_rad};

/// The satellite is switched on this long before the window, microseconds: it boots and is given clock and schedule.
const BEFORE_US: i64 = 30_000_000;
/// Frames of a listener that are further apart belong to different passes, microseconds.
const PASS_GAP_US: i64 = 1_800_000_000;
/// From the end of a frame to the next that waits, microseconds.
const GAP_US: u64 = 5_000;

/// A chunk that the twin sent by its schedule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SentChunk {
    /// When the frame began.
    pub at: UtcUs,
    /// Which chunk.
    pub index: u16,
}

/// What came home in many runs.
#[derive(Debug, Clone, PartialEq)]
pub struct DownlinkOutcome {
    /// Missing chunks that somebody heard, run by run, ascending.
    pub chunks: Vec<u32>,
    /// Chunks that the twin sent in the first run.
    pub sent: usize,
}

impl DownlinkOutcome {
    /// The mean over the runs; 0 of none.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.chunks.iter().map(|&chunks| f64::from(chunks)).sum::<f64>() / self.chunks.len().max(1) as f64
    }

    /// What a share of the runs (0 to 1) stays at or below.
    #[must_use]
    pub fn quantile(&self, share: f64) -> u32 {
        let last = self.chunks.len().saturating_sub(1);
        let index = (share.clamp(0.0, 1.0) * last as f64).round() as usize;
        self.chunks.get(index).copied().unwrap_or(0)
    }

    /// One sigma of the mean.
    #[must_use]
    pub fn mean_error(&self) -> f64 {
        let (mean, count) = (self.mean(), self.chunks.len().max(2) as f64);
        let squares: f64 = self.chunks.iter().map(|&chunks| (f64::from(chunks) - mean).powi(2)).sum();
        (squares / (count - 1.0) / count).sqrt()
    }
}

/// Runs a schedule so often, each time with other listeners awake, other frames lost, and heartbeats in another phase. The
/// satellite comes late by what a bell curve of `timing_s` draws.
///
/// # Errors
/// Elements that describe no orbit. Where they have no state, nobody hears anything.
pub fn downlink(
    task: &Task,
    schedule: &DownlinkSchedule,
    timing_s: f64,
    seeds: std::ops::Range<u64>,
) -> Result<DownlinkOutcome, ElementsError> {
    let orbit = Propagator::new(&task.elements)?;
    let mut outcome = DownlinkOutcome { chunks: Vec::new(), sent: 0 };
    for seed in seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6561_7273);
        let frames = sent_by_twin(task, schedule, seed, &mut rng)?;
        if outcome.chunks.is_empty() {
            outcome.sent = frames.len();
        }
        let late_s = if timing_s > 0.0 { timing_s * bell(&mut rng) } else { 0.0 };
        outcome.chunks.push(heard(task, schedule, &orbit, &frames, late_s, &mut rng));
    }
    outcome.chunks.sort_unstable();
    Ok(outcome)
}

/// What the twin sends of a schedule from the beginning of the window to its end.
fn sent_by_twin(
    task: &Task,
    schedule: &DownlinkSchedule,
    seed: u64,
    rng: &mut impl Rng,
) -> Result<Vec<SentChunk>, ElementsError> {
    let key = Key::from_bytes([7; 16]);
    let zero_us = (task.from.0 - BEFORE_US).div_euclid(1000) * 1000;
    let utc_ms = |now_us: u64| u64::try_from(zero_us / 1000).unwrap_or(0) + now_us / 1000;
    let chunks = schedule.slots.iter().map(|slot| usize::from(slot.first) + usize::from(slot.count)).max();
    let config = TwinConfig {
        utc_at_zero_ms: utc_ms(0),
        orbit: Some(Orbit::new(task.elements.clone())?),
        first_heartbeat_us: rng.random_range(0..60_000_000),
        image: ImageSource::Bytes {
            bytes: vec![seed as u8; chunks.unwrap_or(0) * 222].into(),
            width_px: 408,
            height_px: 304,
        },
        ..TwinConfig::new(seed, key.clone())
    };
    let mut twin = Twin::new(config, TwinState::default());
    let commands = [
        Telecommand::SetTimestamp { utc_ms: utc_ms(5_000_000) },
        Telecommand::SetDownlinkSchedule(schedule.clone()),
    ];
    let mut now_us = 5_000_000;
    drained(&mut twin);
    for (number, command) in commands.iter().enumerate() {
        let nonce = Nonce::new(Counter(number as u64 + 1), [0; 4]);
        twin.receive(now_us, seal(&key, nonce, RequestTag::FIRST, command, &[0; 200]).as_bytes());
        drained(&mut twin);
    }
    let end_us = u64::try_from(task.until.0 - zero_us).unwrap_or(0);
    let timing = LinkTiming::default();
    let mut sent = Vec::new();
    while let Some(due_us) = twin.next_event_us() {
        now_us = due_us.max(now_us);
        if now_us >= end_us {
            break;
        }
        let frame = twin.poll(now_us);
        drained(&mut twin);
        let Some(frame) = frame.or_else(|| twin.poll(now_us)) else { continue };
        if let Ok(parsed) = DownFrame::parse(&frame)
            && let Ok(Downlink::ImageChunk(chunk)) = parsed.packet()
        {
            let at = UtcUs(zero_us + i64::try_from(now_us).unwrap_or(i64::MAX / 2));
            sent.push(SentChunk { at, index: chunk.index.0 });
        }
        now_us += timing.frame_us(frame.len()) + GAP_US;
        twin.sent(now_us);
    }
    Ok(sent)
}

/// The journal is durable at once here.
fn drained(twin: &mut Twin) {
    while twin.next_journal().is_some() {}
}

/// How many missing chunks somebody hears.
fn heard(
    task: &Task,
    schedule: &DownlinkSchedule,
    orbit: &Propagator,
    frames: &[SentChunk],
    late_s: f64,
    rng: &mut impl Rng,
) -> u32 {
    let mut home = std::collections::BTreeSet::new();
    let states: Vec<_> = frames
        .iter()
        .map(|frame| {
            let middle = instant(frame.at).plus_us(task.rules.chunk_us / 2);
            let state = orbit.at(middle.plus_seconds(-late_s)).ok()?;
            Some(ecef_from_teme(&state, gmst_rad(middle, task.orientation)))
        })
        .collect();
    for listener in &task.listeners {
        let mut awake: Option<(UtcUs, bool)> = None;
        for (frame, state) in frames.iter().zip(&states) {
            let Some(object) = state else { continue };
            let look = listener.place.look(object);
            if look.elevation_deg <= 0.0 || !listener.place.sees(&look) {
                continue;
            }
            let listens = match awake {
                Some((last, listens)) if frame.at.0 - last.0 < PASS_GAP_US => listens,
                _ => rng.random::<f64>() < Listener::listening(listener, frame.at),
            };
            awake = Some((frame.at, listens));
            let margin_db =
                task.link.margin_db(look.elevation_deg, look.range_km) - loss_db(task, schedule, frame.at);
            if rng.random::<f64>() < task.link.heard(margin_db) && listens {
                home.insert(frame.index);
            }
        }
    }
    task.missing.iter().filter(|chunk| home.contains(chunk)).count() as u32
}

/// What the antenna loses while the satellite turns, dB.
fn loss_db(task: &Task, schedule: &DownlinkSchedule, at: UtcUs) -> f64 {
    task.pointing.map_or(0.0, |pointing| {
        let at_ms = u64::try_from(at.0 / 1000).unwrap_or(0);
        let begun = schedule.slots.iter().rev().find(|slot| slot.time_ms <= at_ms);
        let since_s = begun.map_or(0.0, |slot| (at_ms - slot.time_ms) as f64 / 1000.0);
        let turning = (-since_s / pointing.settle_s.max(1e-3)).exp();
        pointing.held_loss_db + (pointing.loose_loss_db - pointing.held_loss_db) * turning
    })
}

/// Around 0 with a deviation of 1, after Box and Muller.
fn bell(rng: &mut impl Rng) -> f64 {
    let (a, b) = (1.0 - rng.random::<f64>(), rng.random::<f64>());
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}
