//! The orbit that the satellite flies: mean elements with SGP4 made ready, given, or made up for the time of the start.

use std::sync::Arc;

use tle::{
    EarthOrientation, Elements, PropagationError, Propagator, Station, UtcInstant,
    frames::turn_z,
    gmst_rad,
    passes::PassFinder,
    propagator::{ElementsError, SGP4_EARTH_RADIUS_KM, SGP4_MU_KM3_S2, State},
};

use crate::{
    noise::{mix, unit},
    vector::unit_of,
};

/// Height of the orbits that are made up, km: where CubeSats are put.
const HEIGHT_KM: f64 = 510.0;
/// Inclination that makes an orbit of this height sun-synchronous, degrees.
const INCLINATION_DEG: f64 = 97.4;
/// How far beside the station an orbit runs that is made up to pass over it, degrees at the Earth's centre: it
/// culminates at about 75 degrees.
const ASIDE_DEG: f64 = 1.25;

/// An orbit: elements that SGP4 takes, made ready. Cheap to clone.
///
/// The satellite's own telemetry and the ground's view of it come from one and the same.
#[derive(Clone, Debug)]
pub struct Orbit(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    elements: Elements,
    finder: PassFinder,
}

impl PartialEq for Orbit {
    fn eq(&self, other: &Self) -> bool {
        self.0.elements == other.0.elements
    }
}

impl Orbit {
    /// The orbit of these elements.
    ///
    /// # Errors
    /// Elements that describe no closed orbit.
    pub fn new(elements: Elements) -> Result<Self, ElementsError> {
        let finder = PassFinder::new(&elements)?;
        Ok(Self(Arc::new(Inner { elements, finder })))
    }

    /// An orbit that nobody flies: circular, 510 km high, sun-synchronous, turned by the seed, without drag. Its epoch is
    /// the start of the twin, so that the twin runs at any date.
    #[must_use]
    pub fn fictional(seed: u64, epoch: UtcInstant) -> Self {
        let turn_deg = |key: u64| f64::from(unit(mix(seed) ^ key)) * 360.0;
        Self::circular(epoch, turn_deg(1), turn_deg(2))
    }

    /// An orbit that nobody flies, like [`Self::fictional`], on its way north: at the epoch it culminates, about 75 degrees
    /// high, over the station. No orbit of this kind passes over a place within 7.4 degrees of a pole: there it culminates
    /// lower.
    #[must_use]
    pub fn passing_over(station: &Station, epoch: UtcInstant) -> Self {
        let inclination = INCLINATION_DEG.to_radians();
        let gmst = gmst_rad(epoch, EarthOrientation::UT1_IS_UTC);
        let place = unit_of(turn_z(-gmst, station.axes().r_ecef_km));
        let level = place[0].hypot(place[1]).max(1e-3);
        // The flight's direction over the station, from north through east, and a step across it.
        let heading = (inclination.cos() / level).clamp(-1.0, 1.0).asin();
        let across = heading + std::f64::consts::FRAC_PI_2;
        let aside = ASIDE_DEG.to_radians();
        let latitude = place[2].atan2(level) + aside * across.cos();
        let right_ascension = place[1].atan2(place[0]) + aside * across.sin() / level;
        let from_node = (latitude.sin() / inclination.sin()).clamp(-1.0, 1.0).asin();
        let east_of_node = (inclination.cos() * from_node.sin()).atan2(from_node.cos());
        Self::circular(epoch, (right_ascension - east_of_node).to_degrees(), from_node.to_degrees())
    }

    fn circular(epoch: UtcInstant, raan_deg: f64, from_node_deg: f64) -> Self {
        const DAY_S: f64 = 86_400.0;
        let axis_km = SGP4_EARTH_RADIUS_KM + HEIGHT_KM;
        let rate_rad_s = (SGP4_MU_KM3_S2 / axis_km.powi(3)).sqrt();
        let elements = Elements {
            name: Some("FICTIONAL CUBESAT".to_owned()),
            object_id: None,
            norad_cat_id: None,
            epoch,
            mean_motion_rev_day: rate_rad_s * DAY_S / std::f64::consts::TAU,
            eccentricity: 0.0005,
            inclination_deg: INCLINATION_DEG,
            raan_deg: raan_deg.rem_euclid(360.0),
            arg_of_perigee_deg: 0.0,
            mean_anomaly_deg: from_node_deg.rem_euclid(360.0),
            bstar: 0.0,
            mean_motion_dot: 0.0,
            mean_motion_ddot: 0.0,
            ephemeris_type: Some(0),
            classification: Some('U'),
            element_set_no: None,
            rev_at_epoch: None,
            further: Vec::new(),
        };
        #[expect(clippy::expect_used, reason = "a circle of constant size, whatever the angles")]
        Self::new(elements).expect("a closed orbit")
    }

    /// The elements.
    #[must_use]
    pub fn elements(&self) -> &Elements {
        &self.0.elements
    }

    /// The same elements under another name: what a configuration calls the satellite.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        let elements = Elements { name: Some(name.to_owned()), ..self.0.elements.clone() };
        Self(Arc::new(Inner { elements, finder: self.0.finder.clone() }))
    }

    pub(crate) fn finder(&self) -> &PassFinder {
        &self.0.finder
    }

    /// Where it is, by SGP4.
    pub(crate) fn at(&self, at: UtcInstant) -> Result<State, PropagationError> {
        self.propagator().at(at)
    }

    fn propagator(&self) -> &Propagator {
        self.0.finder.propagator()
    }
}

#[cfg(test)]
mod tests {
    use tle::passes::PassSearch;

    use super::*;

    /// 2026, 2036, 2099.
    const STARTS_S: [i64; 3] = [1_790_000_000, 2_100_000_000, 4_090_000_000];

    fn start(index: usize) -> UtcInstant {
        UtcInstant::from_unix_us(STARTS_S[index] * 1_000_000)
    }

    #[test]
    fn a_made_up_orbit_passes_over_its_station_at_its_epoch() {
        for (index, &(latitude_deg, longitude_deg)) in
            [(78.2, 15.4), (46.5, 6.6), (0.0, -78.0), (-33.9, 151.2), (-77.8, 166.7)].iter().enumerate()
        {
            let station = Station::new(latitude_deg, longitude_deg, 100.0).unwrap();
            let epoch = start(index % 3);
            let orbit = Orbit::passing_over(&station, epoch);
            let search = PassSearch::new(epoch.plus_seconds(-900.0), epoch.plus_seconds(900.0), 0.0);
            let found = orbit.finder().find(&[station], &search).unwrap();
            let [pass] = &found.stations[0][..] else { unreachable!("one pass: {latitude_deg}") };
            assert!((68.0..82.0).contains(&pass.tca.look.elevation_deg), "{latitude_deg}: {pass:?}");
            assert!(pass.tca.at.seconds_since(epoch).abs() < 15.0, "{latitude_deg}: {pass:?}");
        }
    }

    #[test]
    fn made_up_orbits_stay_510_km_high_for_a_year_and_differ_by_seed() {
        for seed in 0..3 {
            let epoch = start(seed as usize);
            let orbit = Orbit::fictional(seed, epoch);
            for hour in 0..8_760 {
                let state = orbit.at(epoch.plus_seconds(f64::from(hour) * 3_600.0)).unwrap();
                let height_km = crate::vector::length(state.r_teme_km) - SGP4_EARTH_RADIUS_KM;
                assert!((490.0..530.0).contains(&height_km), "{height_km} km after {hour} h");
            }
        }
        assert_ne!(Orbit::fictional(1, start(0)), Orbit::fictional(2, start(0)));
        assert_eq!(Orbit::fictional(1, start(0)), Orbit::fictional(1, start(0)));
    }
}
