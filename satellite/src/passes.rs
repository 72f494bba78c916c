//! When the satellite stands above the ground station's horizon, and how high: by its orbit, or by a stored profile of
//! passes.
//!
//! The shape of a stored pass is that of a circular orbit of 500 km over a sphere, so elevation and range rise and fall as
//! they do in life; only the times are stored instead of computed from orbital elements. [`crate::Sky`] answers for both.

use tle::{EarthOrientation, Station};

/// Mean radius of the Earth, km (IUGG).
const EARTH_RADIUS_KM: f64 = 6371.0;
/// Height of the circular orbit, km.
const ORBIT_HEIGHT_KM: f64 = 500.0;
/// What a station sees of a satellite far below its horizon, degrees.
const BELOW_DEG: f64 = -90.0;

/// One pass: how long it lasts from horizon to horizon and how high it climbs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassShape {
    /// From acquisition to loss of signal, at elevation 0, microseconds. Never 0.
    pub duration_us: u64,
    /// Elevation at the middle of the pass, degrees, 0..=90.
    pub max_elevation_deg: f64,
}

/// Elevation of the satellite over time.
#[derive(Clone, Debug, PartialEq)]
pub enum PassProfile {
    /// The satellite stands still in the sky: a bench, or a test that wants no horizon.
    Always {
        /// Elevation at all times, degrees.
        elevation_deg: f64,
    },
    /// A pass every `period_us`; the shapes are used in turn, over and over.
    Repeating {
        /// Acquisition of signal of the first pass, microseconds.
        first_aos_us: u64,
        /// From one acquisition to the next, microseconds; longer than each pass.
        period_us: u64,
        /// The shapes in turn. With none the satellite is never in view.
        passes: Vec<PassShape>,
    },
    /// As the satellite's orbit ([`crate::Orbit`]) says, seen from a place on Earth.
    Orbit {
        /// The place, and what its horizon hides.
        station: Box<Station>,
        /// How far the Earth has turned.
        orientation: EarthOrientation,
    },
}

impl Default for PassProfile {
    /// A pass of 8 to 10 minutes every 95 minutes, the first 20 s after the start.
    fn default() -> Self {
        const MINUTE_US: u64 = 60_000_000;
        let shape = |duration_s: u64, max_elevation_deg| PassShape {
            duration_us: duration_s * 1_000_000,
            max_elevation_deg,
        };
        Self::Repeating {
            first_aos_us: 20_000_000,
            period_us: 95 * MINUTE_US,
            passes: vec![
                shape(600, 78.0),
                shape(520, 31.0),
                shape(565, 52.0),
                shape(480, 22.0),
                shape(585, 66.0),
            ],
        }
    }
}

/// Where in its pass the satellite is.
#[derive(Clone, Copy, Debug)]
struct InPass {
    shape: PassShape,
    since_aos_us: u64,
    los_us: u64,
}

impl PassProfile {
    /// The orbit as seen from here, with UT1 taken as UTC.
    #[must_use]
    pub fn seen_from(station: Station) -> Self {
        Self::Orbit { station: Box::new(station), orientation: EarthOrientation::UT1_IS_UTC }
    }

    /// Elevation above the horizon at this time by what is stored, degrees; -90 between passes.
    pub(crate) fn elevation_deg(&self, now_us: u64) -> f64 {
        match self {
            Self::Always { elevation_deg } => *elevation_deg,
            Self::Repeating { .. } | Self::Orbit { .. } => match self.pass_at(now_us) {
                Some(pass) => pass_elevation_deg(&pass),
                None => BELOW_DEG,
            },
        }
    }

    /// Whether the satellite is above the horizon by what is stored.
    pub(crate) fn in_view(&self, now_us: u64) -> bool {
        match self {
            Self::Always { elevation_deg } => *elevation_deg >= 0.0,
            Self::Repeating { .. } | Self::Orbit { .. } => self.pass_at(now_us).is_some(),
        }
    }

    /// The next moment after `now_us` at which [`Self::in_view`] changes; `None` if it never does.
    pub(crate) fn next_change_us(&self, now_us: u64) -> Option<u64> {
        let Self::Repeating { first_aos_us, period_us, passes } = self else { return None };
        if passes.is_empty() {
            return None;
        }
        if let Some(pass) = self.pass_at(now_us) {
            return Some(pass.los_us);
        }
        if now_us < *first_aos_us {
            return Some(*first_aos_us);
        }
        let number = (now_us - first_aos_us) / (*period_us).max(1);
        first_aos_us.checked_add((number + 1).checked_mul(*period_us)?)
    }

    fn pass_at(&self, now_us: u64) -> Option<InPass> {
        let Self::Repeating { first_aos_us, period_us, passes } = self else { return None };
        let since_first_us = now_us.checked_sub(*first_aos_us)?;
        let period_us = (*period_us).max(1);
        let number = since_first_us / period_us;
        let turn = usize::try_from(number % u64::try_from(passes.len()).ok()?.max(1)).ok()?;
        let shape = *passes.get(turn)?;
        let since_aos_us = since_first_us % period_us;
        (since_aos_us < shape.duration_us).then(|| InPass {
            shape,
            since_aos_us,
            los_us: now_us.saturating_add(shape.duration_us - since_aos_us),
        })
    }
}

/// Distance to the satellite at this elevation, km: a spherical Earth, a circular orbit.
#[must_use]
pub fn range_km(elevation_deg: f64) -> f64 {
    let sin_elevation = elevation_deg.clamp(0.0, 90.0).to_radians().sin();
    let orbit_km = EARTH_RADIUS_KM + ORBIT_HEIGHT_KM;
    let along = EARTH_RADIUS_KM * sin_elevation;
    (along * along + orbit_km * orbit_km - EARTH_RADIUS_KM * EARTH_RADIUS_KM).sqrt() - along
}

/// Elevation within a pass: the satellite runs along a great circle that comes within `nearest` (the Earth's
/// central angle at the greatest elevation) of the station.
fn pass_elevation_deg(pass: &InPass) -> f64 {
    let ratio = EARTH_RADIUS_KM / (EARTH_RADIUS_KM + ORBIT_HEIGHT_KM);
    let max_elevation = pass.shape.max_elevation_deg.clamp(0.0, 90.0).to_radians();
    let nearest = (ratio * max_elevation.cos()).acos() - max_elevation;
    let half_arc = (ratio / nearest.cos()).clamp(-1.0, 1.0).acos();
    let from_middle = pass.since_aos_us as f64 / pass.shape.duration_us as f64 * 2.0 - 1.0;
    let central = (nearest.cos() * (half_arc * from_middle).cos()).clamp(-1.0, 1.0).acos();
    (central.cos() - ratio).atan2(central.sin()).to_degrees().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_US: u64 = 1_000_000;

    #[test]
    fn a_pass_climbs_to_its_height_and_sinks_again() {
        let profile = PassProfile::default();
        assert!(!profile.in_view(19 * SECOND_US));
        assert!(profile.in_view(20 * SECOND_US));
        assert!(profile.elevation_deg(20 * SECOND_US) < 0.1);
        assert!((profile.elevation_deg(320 * SECOND_US) - 78.0).abs() < 0.01);
        assert!(profile.elevation_deg(170 * SECOND_US) < 35.0, "half way up in time is low in the sky");
        assert!(!profile.in_view(620 * SECOND_US));
        assert!(profile.elevation_deg(620 * SECOND_US) < 0.0);
    }

    #[test]
    fn view_changes_are_found_one_after_another() {
        let profile = PassProfile::default();
        let mut now_us = 0;
        let mut seen = Vec::new();
        for _ in 0..4 {
            now_us = profile.next_change_us(now_us).unwrap();
            seen.push((now_us / SECOND_US, profile.in_view(now_us)));
        }
        assert_eq!(seen, [(20, true), (620, false), (5720, true), (6240, false)]);
        assert_eq!(PassProfile::Always { elevation_deg: 45.0 }.next_change_us(7), None);
    }

    #[test]
    fn range_and_delay_agree_with_the_link_budget() {
        assert!((range_km(90.0) - 500.0).abs() < 1.0);
        assert!((range_km(5.0) - 2078.0).abs() < 5.0);
        let delay_us = |elevation_deg| {
            crate::SkyLook { elevation_deg, range_km: range_km(elevation_deg), range_rate_km_s: 0.0 }
                .delay_us()
        };
        assert!((1_600..1_800).contains(&delay_us(90.0)));
        assert!((6_800..7_000).contains(&delay_us(5.0)));
    }
}
