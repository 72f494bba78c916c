//! One command after another along a route, and what the readings say of the mount's health.

use super::direction::Position;
use super::mount::Mount;
use crate::clock::MonoUs;

/// Commands are at least this far apart, microseconds.
pub const COMMAND_INTERVAL_US: u64 = 1_000_000;
/// A mount that is not where it was told to be and has not moved for this long, s, has not heard the command or is stuck.
/// Slow ones get as long as they need for [`COARSE_DEG`].
const PATIENCE_S: f64 = 8.0;
/// The coarsest dial that is expected, degrees: a potentiometer behind eight bits, and some noise.
const COARSE_DEG: f64 = 6.0;
/// Moving by less is noise, degrees.
const MOVED_DEG: f64 = 0.5;
/// A reading that differs from the last one by more than this beyond what the rates allow is a jump, degrees.
const JUMP_DEG: f64 = 10.0;

/// What a reading says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Observation {
    /// It is where it was told to be, within the dead band.
    pub is_on_target: bool,
    /// It is not where it was before.
    pub is_moving: bool,
    /// It does not come nearer to where it was told to be, and was told again.
    pub is_stuck: bool,
    /// The reading is further from the one before than the mount can turn: no measurement of where it stands.
    pub has_jumped: bool,
}

/// Decides when a mount is told something.
#[derive(Debug, Clone)]
pub struct Pointer {
    mount: Mount,
    commanded: Option<(MonoUs, Position)>,
    reading: Option<(MonoUs, Position)>,
    /// Where it was when it last moved or was on target, and when that was.
    rested: Option<(MonoUs, Position)>,
    repeat: bool,
    stuck: bool,
}

impl Pointer {
    /// Nothing is commanded, nothing read.
    #[must_use]
    pub fn new(mount: Mount) -> Self {
        Self { mount, commanded: None, reading: None, rested: None, repeat: false, stuck: false }
    }

    /// The mount.
    #[must_use]
    pub fn mount(&self) -> &Mount {
        &self.mount
    }

    /// Where it was last told to be.
    #[must_use]
    pub fn target(&self) -> Option<Position> {
        self.commanded.map(|(_, position)| position)
    }

    /// Takes a reading.
    pub fn observe(&mut self, now: MonoUs, reading: Position) -> Observation {
        let settings = self.mount.settings();
        let before = self.reading.replace((now, reading));
        let (mut is_moving, mut has_jumped) = (false, false);
        if let Some((at, before)) = before {
            let dt_s = seconds(at, now);
            let may = 3.0 * settings.azimuth_rate_deg_s.max(settings.elevation_rate_deg_s) * dt_s + JUMP_DEG;
            has_jumped = reading.way_deg(before) > may;
            is_moving = reading.way_deg(before) > 0.05;
        }
        let Some((_, target)) = self.commanded else {
            return Observation { is_moving, has_jumped, ..Observation::default() };
        };
        if has_jumped {
            // It says nothing of motion, and the next one has nothing to be compared with.
            self.rested = None;
            return Observation { is_moving, has_jumped, is_on_target: false, is_stuck: self.stuck };
        }
        let is_on_target = reading.way_deg(target) <= settings.dead_band_deg.max(1.0);
        match self.rested {
            Some((since, at)) if !is_on_target && reading.way_deg(at) <= MOVED_DEG => {
                let slowest = settings.azimuth_rate_deg_s.min(settings.elevation_rate_deg_s);
                if seconds(since, now) >= PATIENCE_S.max(COARSE_DEG / slowest) {
                    self.stuck = true;
                    self.repeat = true;
                    self.rested = Some((now, at));
                }
            }
            _ => {
                self.rested = Some((now, reading));
                self.stuck = false;
            }
        }
        Observation { is_on_target, is_moving, is_stuck: self.stuck, has_jumped: false }
    }

    /// The position to command now, if one is worth it: the first one; one that is off the last one by more than the dead
    /// band; the last one again, when nothing came of it. Never outside the limits, never one that is not finite, and at most
    /// one in [`COMMAND_INTERVAL_US`].
    pub fn next(&mut self, now: MonoUs, wanted: Position) -> Option<Position> {
        let wanted = self.mount.clamp(wanted)?;
        if let Some((at, commanded)) = self.commanded {
            let is_worth_it = wanted.way_deg(commanded) > self.mount.settings().dead_band_deg || self.repeat;
            if !is_worth_it || now.since(at) < COMMAND_INTERVAL_US {
                return None;
            }
        }
        self.repeat = false;
        self.commanded = Some((now, wanted));
        Some(wanted)
    }

    /// Forgets what was commanded and read: after a stop, or when the connection was lost.
    pub fn forget(&mut self) {
        *self = Self::new(self.mount);
    }
}

#[expect(clippy::cast_precision_loss, reason = "microseconds stay far below 2^53 for 285 years")]
fn seconds(from: MonoUs, until: MonoUs) -> f64 {
    until.since(from) as f64 / 1e6
}
