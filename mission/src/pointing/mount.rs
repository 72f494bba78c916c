//! What a mount can do.

use super::direction::{Direction, Position};

/// What is said of a mount. [`Mount::new`] checks it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountSettings {
    /// First and last azimuth that may be commanded: (0, 360), (-180, 180), (0, 450), ...
    pub azimuth_deg: (f64, f64),
    /// First and last elevation that may be commanded: (0, 90), or (0, 180) for a mount that can flip.
    pub elevation_deg: (f64, f64),
    /// Elevations beyond 90 may be used, where that avoids turning round in the middle of a pass.
    pub flip: bool,
    /// How fast the azimuth axis turns, degrees/s.
    pub azimuth_rate_deg_s: f64,
    /// How fast the elevation axis turns, degrees/s.
    pub elevation_rate_deg_s: f64,
    /// A move smaller than this is not worth a command.
    pub dead_band_deg: f64,
    /// Lower than this the antenna is not pointed while it follows something.
    pub minimum_elevation_deg: f64,
    /// Where it rests.
    pub park: Option<Position>,
}

impl Default for MountSettings {
    /// A common azimuth and elevation rotator: 0 to 360 and 0 to 90 degrees, 6 and 3 degrees/s.
    fn default() -> Self {
        Self {
            azimuth_deg: (0.0, 360.0),
            elevation_deg: (0.0, 90.0),
            flip: false,
            azimuth_rate_deg_s: 6.0,
            elevation_rate_deg_s: 3.0,
            dead_band_deg: 2.0,
            minimum_elevation_deg: 0.0,
            park: None,
        }
    }
}

/// A setting that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key}: {problem}. {remedy}")]
pub struct MountFault {
    /// The setting.
    pub key: &'static str,
    /// What was found.
    pub problem: String,
    /// What to do.
    pub remedy: &'static str,
}

/// A mount whose settings make sense.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount(MountSettings);

/// The slowest and the fastest rotator that is believed, degrees/s.
const RATES_DEG_S: (f64, f64) = (0.1, 180.0);

impl Mount {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`MountFault`]: the first setting that cannot be.
    pub fn new(settings: MountSettings) -> Result<Self, MountFault> {
        let fault = |key, problem: String, remedy| Err(MountFault { key, problem, remedy });
        let s = &settings;
        let range = |range: (f64, f64), least: f64, most: f64| {
            range.0.is_finite()
                && range.1.is_finite()
                && range.0 < range.1
                && range.0 >= least
                && range.1 <= most
        };
        if !range(s.azimuth_deg, -360.0, 720.0) {
            return fault(
                "azimuth_range",
                format!("{} to {} degrees", s.azimuth_deg.0, s.azimuth_deg.1),
                "Give the first and the last azimuth, as in [0, 360], [-180, 180] or [0, 450].",
            );
        }
        if !range(s.elevation_deg, -90.0, 180.0) {
            return fault(
                "elevation_range",
                format!("{} to {} degrees", s.elevation_deg.0, s.elevation_deg.1),
                "Give the first and the last elevation, as in [0, 90] or [0, 180].",
            );
        }
        if s.flip && s.elevation_deg.1 <= 90.0 {
            return fault(
                "flip",
                format!("the elevation ends at {}", s.elevation_deg.1),
                "Give elevation_range = [0, 180], or leave flip out.",
            );
        }
        for (key, rate) in
            [("azimuth_rate_deg_s", s.azimuth_rate_deg_s), ("elevation_rate_deg_s", s.elevation_rate_deg_s)]
        {
            if !(RATES_DEG_S.0..=RATES_DEG_S.1).contains(&rate) {
                return fault(key, format!("{rate}"), "Give 0.1 to 180 degrees a second.");
            }
        }
        if !(0.05..=30.0).contains(&s.dead_band_deg) {
            return fault(
                "dead_band_deg",
                format!("{}", s.dead_band_deg),
                "Give 0.05 to 30 degrees; a tenth of the antenna's beam is a good choice.",
            );
        }
        if !(s.elevation_deg.0..=s.elevation_deg.1.min(90.0)).contains(&s.minimum_elevation_deg) {
            return fault(
                "minimum_elevation",
                format!("{}", s.minimum_elevation_deg),
                "Give an elevation inside elevation_range, 90 at most.",
            );
        }
        if let Some(park) = s.park
            && !inside(park, s)
        {
            return fault(
                "park",
                format!("azimuth {}, elevation {}", park.azimuth_deg, park.elevation_deg),
                "Give [azimuth, elevation] inside azimuth_range and elevation_range.",
            );
        }
        Ok(Self(settings))
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &MountSettings {
        &self.0
    }

    /// The same mount, held to the limits that its daemon told as well. A park position outside them is brought inside.
    ///
    /// # Errors
    /// [`MountFault`] when both have no angle in common, or what is told is no range.
    pub fn held_to(&self, azimuth_deg: (f64, f64), elevation_deg: (f64, f64)) -> Result<Self, MountFault> {
        let common = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.min(b.1));
        let mut settings = self.0;
        settings.azimuth_deg = common(settings.azimuth_deg, azimuth_deg);
        settings.elevation_deg = common(settings.elevation_deg, elevation_deg);
        settings.flip &= settings.elevation_deg.1 > 90.0;
        settings.park = None;
        let (low, high) = (settings.elevation_deg.0, settings.elevation_deg.1.min(90.0));
        settings.minimum_elevation_deg = settings.minimum_elevation_deg.max(low).min(high);
        let mut held = Self::new(settings)?;
        held.0.park = self.0.park.and_then(|park| held.clamp(park));
        Ok(held)
    }

    /// Whether a position may be commanded.
    #[must_use]
    pub fn allows(&self, position: Position) -> bool {
        inside(position, &self.0)
    }

    /// The nearest position that may be commanded; `None` when it is not finite.
    #[must_use]
    pub fn clamp(&self, position: Position) -> Option<Position> {
        position.is_finite().then(|| Position {
            azimuth_deg: position.azimuth_deg.clamp(self.0.azimuth_deg.0, self.0.azimuth_deg.1),
            elevation_deg: position.elevation_deg.clamp(self.0.elevation_deg.0, self.0.elevation_deg.1),
        })
    }

    /// Seconds that the slower axis takes from one position to another.
    #[must_use]
    pub fn slew_s(&self, from: Position, to: Position) -> f64 {
        let azimuth = (from.azimuth_deg - to.azimuth_deg).abs() / self.0.azimuth_rate_deg_s;
        azimuth.max((from.elevation_deg - to.elevation_deg).abs() / self.0.elevation_rate_deg_s)
    }

    /// Seconds that the longest way takes.
    #[must_use]
    pub fn longest_slew_s(&self) -> f64 {
        let (azimuth, elevation) = (self.0.azimuth_deg, self.0.elevation_deg);
        self.slew_s(
            Position { azimuth_deg: azimuth.0, elevation_deg: elevation.0 },
            Position { azimuth_deg: azimuth.1, elevation_deg: elevation.1 },
        )
    }

    /// Where a mount that was at `from` and wants to be at `to` is after this many seconds.
    #[must_use]
    pub fn after(&self, from: Position, to: Position, seconds: f64) -> Position {
        let axis = |from: f64, to: f64, rate: f64| from + (to - from).clamp(-rate * seconds, rate * seconds);
        Position {
            azimuth_deg: axis(from.azimuth_deg, to.azimuth_deg, self.0.azimuth_rate_deg_s),
            elevation_deg: axis(from.elevation_deg, to.elevation_deg, self.0.elevation_rate_deg_s),
        }
    }

    /// The direction that is asked of the antenna for an object in this one: not below the least elevation.
    #[must_use]
    pub fn wanted(&self, direction: Direction) -> Direction {
        Direction::new(direction.azimuth_deg, direction.elevation_deg.max(self.0.minimum_elevation_deg))
    }

    /// Where the mount must stand to look into a direction on one of its branches: turned round this many times, flipped
    /// or not. Outside its limits the nearest position inside.
    pub(super) fn on_branch(&self, direction: Direction, branch: Branch) -> Position {
        let wanted = self.wanted(direction);
        let turns = 360.0 * f64::from(branch.turns);
        let (azimuth, elevation) = if branch.flipped {
            (Direction::new(wanted.azimuth_deg + 180.0, 0.0).azimuth_deg, 180.0 - wanted.elevation_deg)
        } else {
            (wanted.azimuth_deg, wanted.elevation_deg)
        };
        Position {
            azimuth_deg: (azimuth + turns).clamp(self.0.azimuth_deg.0, self.0.azimuth_deg.1),
            elevation_deg: elevation.clamp(self.0.elevation_deg.0, self.0.elevation_deg.1),
        }
    }

    /// Its branches, the plain ones first.
    pub(super) fn branches(&self) -> impl Iterator<Item = Branch> + '_ {
        let flips = if self.0.flip { 2 } else { 1 };
        (0..flips).flat_map(|flip| [0, 1, -1].map(|turns| Branch { turns, flipped: flip == 1 }))
    }
}

/// One of the ways in which a mount can look into a direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Branch {
    /// Whole turns added to an azimuth of 0 to 360.
    pub(super) turns: i8,
    /// Over the zenith, looking backwards.
    pub(super) flipped: bool,
}

fn inside(position: Position, settings: &MountSettings) -> bool {
    (settings.azimuth_deg.0..=settings.azimuth_deg.1).contains(&position.azimuth_deg)
        && (settings.elevation_deg.0..=settings.elevation_deg.1).contains(&position.elevation_deg)
}
