//! What is asked of the scheduler: passes, antennas, and what stands in the way.

use std::sync::Arc;

use super::PassKey;
use crate::clock::UtcUs;
use crate::id::{AntennaId, SatelliteId, StationId};

/// From `start` until just before `stop`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Window {
    /// The first instant inside.
    pub start: UtcUs,
    /// The first instant after it.
    pub stop: UtcUs,
}

impl Window {
    /// Whether the two have an instant in common.
    pub const fn overlaps(&self, other: &Self) -> bool {
        self.start.0 < other.stop.0 && other.start.0 < self.stop.0
    }
}

/// What a part of a pass is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Partial {
    /// Nothing: the pass is taken from AOS to LOS, or not at all.
    Worthless,
    /// As much of the value as of the time is kept, from the minimum duration on.
    Proportional,
}

/// A pass that could be had.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The pass, under a name that outlives new elements; see [`super::identify`].
    pub key: PassKey,
    /// Whose pass.
    pub satellite: SatelliteId,
    /// Over which station.
    pub station: StationId,
    /// The antennas that can serve it; empty means every antenna of the station.
    pub antennas: Vec<AntennaId>,
    /// Acquisition of signal.
    pub aos: UtcUs,
    /// Loss of signal.
    pub los: UtcUs,
    /// The highest elevation, for the explanation only: what it is worth is in `value`.
    pub max_elevation_deg: f64,
    /// What the whole pass is worth, in points; at most [`Candidate::MAX_VALUE`]. [`points`] makes them from a priority.
    pub value: u32,
    /// A contact shorter than this is of no use.
    pub min_duration_s: u32,
    /// What a part of it is worth.
    pub partial: Partial,
    /// Whether the contact wants to transmit: then the licence's windows bind it.
    pub transmit: bool,
    /// The plan that waits for this pass, if one is attached.
    pub plan: Option<Arc<str>>,
}

impl Candidate {
    /// The most points that one pass may be worth.
    pub const MAX_VALUE: u32 = 1_000_000;
    /// The longest pass that is taken for one, in seconds: a day.
    pub const MAX_DURATION_S: i64 = 86_400;

    /// How far ahead is planned, in seconds from the first AOS: a month. Memory grows with it.
    pub const MAX_HORIZON_S: i64 = 31 * 86_400;

    /// AOS to LOS.
    pub const fn window(&self) -> Window {
        Window { start: self.aos, stop: self.los }
    }
}

/// Points for a pass by its priority (1 to 10, one step doubles), duration and height: a pass that stays in view for
/// ten minutes and culminates at 90° at priority 1 is worth 200, one that just clears the horizon half of that.
pub fn points(priority: u8, duration_s: u32, max_elevation_deg: f64) -> u32 {
    let height = if max_elevation_deg.is_finite() { max_elevation_deg.clamp(0.0, 90.0) } else { 0.0 };
    let steps = i32::from(priority.clamp(1, 10)) - 1;
    let points = f64::from(duration_s) / 600.0 * 100.0 * (1.0 + height / 90.0) * 2.0_f64.powi(steps);
    // In range by the clamp: the cast cannot cut.
    points.round().clamp(1.0, f64::from(Candidate::MAX_VALUE)) as u32
}

/// What can follow one satellite at a time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Antenna {
    /// Its name, unique over all stations.
    pub id: AntennaId,
    /// Where it stands.
    pub station: StationId,
    /// From the end of one contact to the begin of the next: slewing, tuning, preparing.
    pub switch_over_s: u32,
}

/// Whether a station can be relied on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Health {
    /// It can.
    Fit,
    /// It cannot, and this is why; nothing is planned there.
    Unfit(String),
}

/// What is known of a station besides its antennas. A station that is not described is fit and has no licence window.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Site {
    /// Which.
    pub station: StationId,
    /// Whether it can be relied on.
    pub health: Health,
    /// When it may transmit; `None` means always. Contacts that only listen are not bound by it.
    pub licence: Option<Vec<Window>>,
}

/// What a blackout covers.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Scope {
    /// Every antenna of a station.
    Station(StationId),
    /// One antenna.
    Antenna(AntennaId),
    /// One satellite, everywhere.
    Satellite(SatelliteId),
}

/// A time without contacts: maintenance, wind, people on the roof, a satellite that is to be left alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Blackout {
    /// What it covers.
    pub scope: Scope,
    /// When.
    pub window: Window,
    /// Why, as the operator wrote it.
    pub reason: String,
}

/// How the scheduler weighs change, and how hard it may think.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Policy {
    /// How far an AOS or LOS may move without the choice being thought over; every choice is laid with this much in
    /// hand, so that it still fits after such a move.
    pub drift_s: u32,
    /// How much better, in thousandths of its worth, another choice must be before a promised contact gives way.
    pub keep_permille: u32,
    /// The bound on the work: search states looked at. What it does not reach shows as a gap, never as a wait.
    pub max_states: usize,
}

impl Default for Policy {
    fn default() -> Self {
        Self { drift_s: 5, keep_permille: 100, max_states: 50_000 }
    }
}

/// Everything that the schedule depends on.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Problem {
    /// The passes that could be had, in any order.
    pub candidates: Vec<Candidate>,
    /// The antennas of all stations.
    pub antennas: Vec<Antenna>,
    /// What is known of the stations.
    pub sites: Vec<Site>,
    /// Times without contacts.
    pub blackouts: Vec<Blackout>,
    /// How to weigh and how hard to think.
    pub policy: Policy,
}
