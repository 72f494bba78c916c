//! Who takes part: two stations, three satellites close to each other, and what ground is told of their orbits.

use mission::config::Times;
use mission::schedule::Window;
use mission::{LinkId, SatelliteId, Site, StationId, UtcUs};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use satellite::Orbit;
use tle::{EarthOrientation, Elements, Station, UtcInstant};

/// 2027-06-01T00:00:00Z, when a fleet begins.
pub(super) const ZERO: UtcInstant = UtcInstant::from_unix_us(1_811_808_000_000_000);
/// Microseconds in a second, a minute, an hour and a day.
pub(super) const SECOND_US: u64 = 1_000_000;
pub(super) const MINUTE_US: u64 = 60 * SECOND_US;
pub(super) const HOUR_US: u64 = 60 * MINUTE_US;
pub(super) const DAY_US: u64 = 24 * HOUR_US;

/// Satellites and stations.
pub(super) const SATELLITES: usize = 3;
pub(super) const STATIONS: usize = 2;
/// The station that commands each satellite: a key is used at one place only, because its nonces are.
pub(super) const COMMANDED_FROM: [usize; SATELLITES] = [0, 0, 1];

#[expect(clippy::expect_used, reason = "a literal that keeps the rule of names")]
pub(super) fn satellite_name(s: usize) -> SatelliteId {
    SatelliteId::new(["alpha", "bravo", "charlie"][s]).expect("a legal name")
}

#[expect(clippy::expect_used, reason = "a literal that keeps the rule of names")]
pub(super) fn station_name(g: usize) -> StationId {
    StationId::new(["lausanne", "vienna"][g]).expect("a legal name")
}

#[expect(clippy::expect_used, reason = "a literal that keeps the rule of names")]
pub(super) fn link_name(s: usize) -> LinkId {
    LinkId::new(["radio-alpha", "radio-bravo", "radio-charlie"][s]).expect("a legal name")
}

/// UTC of a moment of the fleet's own scale.
pub(super) fn utc_at(us: u64) -> UtcUs {
    UtcUs(ZERO.unix_us().saturating_add(i64::try_from(us).unwrap_or(i64::MAX)))
}

/// Where a station stands, and the elevation below which it neither plans nor transmits.
#[expect(clippy::expect_used, reason = "places on Earth")]
pub(super) fn site(g: usize) -> Site {
    let (latitude_deg, longitude_deg, height_m, min_elevation_deg) =
        [(46.5191, 6.5668, 410.0, 5.0), (48.2082, 16.3738, 170.0, 3.0)][g];
    Site {
        place: Station::new(latitude_deg, longitude_deg, height_m).expect("a place on Earth"),
        min_elevation_deg,
        orientation: EarthOrientation::UT1_IS_UTC,
    }
}

/// When a station may transmit and when it is closed: Lausanne not between 23:00 and 01:30, both with closures that begin or
/// end in the middle of a pass (`passes`: AOS and LOS).
pub(super) fn times(g: usize, days: u64, passes: &[(u64, u64)], rng: &mut ChaCha8Rng) -> Times {
    let window = |from_us: u64, to_us: u64| Window { start: utc_at(from_us), stop: utc_at(to_us) };
    let licence = (g == 0).then(|| {
        let day = |day: u64| window(day * DAY_US + 90 * MINUTE_US, day * DAY_US + 23 * HOUR_US);
        (0..days + 3).map(day).collect()
    });
    let mut blackouts = Vec::new();
    for reason in ["people on the roof", "storm", "work on the mains"] {
        let Some(&(aos, los)) = passes.get(rng.random_range(0..passes.len().max(1))) else { continue };
        let middle = aos + los.saturating_sub(aos) / 2;
        let length_us = rng.random_range(20 * MINUTE_US..4 * HOUR_US);
        let from = if rng.random() { middle } else { middle.saturating_sub(length_us) };
        blackouts.push((window(from, from + length_us), reason.to_owned()));
    }
    Times { licence, blackouts, switch_over_s: [40, 20][g] }
}

/// The orbits that are flown: one plane and two near it, minutes apart, so that the passes of two satellites overlap.
#[expect(clippy::expect_used, reason = "a closed orbit, turned a little")]
pub(super) fn orbits(seed: u64) -> [Orbit; SATELLITES] {
    let first = Orbit::fictional(seed, ZERO);
    let beside = |name: &str, raan_deg: f64, behind_deg: f64| {
        let base = first.elements();
        let turned = Elements {
            name: Some(name.to_owned()),
            raan_deg: (base.raan_deg + raan_deg).rem_euclid(360.0),
            mean_anomaly_deg: (base.mean_anomaly_deg - behind_deg).rem_euclid(360.0),
            ..base.clone()
        };
        Orbit::new(turned).expect("a closed orbit")
    };
    [beside("ALPHA", 0.0, 0.0), beside("BRAVO", 4.0, 14.0), beside("CHARLIE", -9.0, -11.0)]
}

/// The elements of an orbit as they are issued at `epoch`: the same orbit by its secular rates (good to a second or two over a
/// fortnight), wrong by `late_s` along the track.
pub(super) fn issued(orbit: &Orbit, epoch: UtcInstant, late_s: f64) -> Elements {
    const J2: f64 = 1.082_616e-3;
    const RADIUS_KM: f64 = 6378.135;
    const MU_KM3_S2: f64 = 398_600.8;
    let base = orbit.elements();
    let days = epoch.seconds_since(base.epoch) / 86_400.0;
    let rate_deg_day = base.mean_motion_rev_day * 360.0;
    let rate_rad_s = base.mean_motion_rev_day * std::f64::consts::TAU / 86_400.0;
    let axis_km = (MU_KM3_S2 / (rate_rad_s * rate_rad_s)).cbrt();
    let level_km = axis_km * (1.0 - base.eccentricity * base.eccentricity);
    let cosine = base.inclination_deg.to_radians().cos();
    let turn = 1.5 * J2 * (RADIUS_KM / level_km).powi(2) * rate_deg_day;
    let along_deg = rate_deg_day * (days - late_s / 86_400.0);
    Elements {
        epoch,
        raan_deg: (base.raan_deg - turn * cosine * days).rem_euclid(360.0),
        arg_of_perigee_deg: (base.arg_of_perigee_deg + turn * (2.0 - 2.5 * (1.0 - cosine * cosine)) * days)
            .rem_euclid(360.0),
        mean_anomaly_deg: (base.mean_anomaly_deg + along_deg).rem_euclid(360.0),
        ..base.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tle::Propagator;

    #[test]
    fn issued_elements_tell_the_orbit_that_is_flown() {
        for orbit in orbits(7) {
            let truth = Propagator::new(orbit.elements()).unwrap();
            for days in [0.5, 5.0, 14.0] {
                let epoch = ZERO.plus_seconds(days * 86_400.0);
                let told = Propagator::new(&issued(&orbit, epoch, 0.0)).unwrap();
                for hours in [0.0, 7.3, 48.0] {
                    let at = epoch.plus_seconds(hours * 3600.0);
                    let (a, b) = (truth.at(at).unwrap().r_teme_km, told.at(at).unwrap().r_teme_km);
                    let off_km = (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
                    assert!(off_km < 20.0, "{off_km:.1} km after {days} days and {hours} hours");
                }
            }
        }
    }
}
