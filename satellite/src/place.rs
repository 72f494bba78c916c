//! What surrounds the satellite: Sun and shadow, the Earth's field, the ground below. Position, Sun, shadow and ground by
//! `tle`; the field is a dipole, plausible rather than exact.

use tle::{
    EarthOrientation, Geodetic, PropagationError, UtcInstant, ecef_from_teme, frames::turn_z,
    geodetic::ecef_km, gmst_rad, ground::subpoint, shadow::Discs, sun::sun_teme_km,
};

use crate::{
    orbit::Orbit,
    vector::{Vec3, add, dot, length, scale, unit_of},
};

/// Mean radius of the Earth, km (IUGG): what the dipole's strength refers to.
const EARTH_RADIUS_KM: f64 = 6371.0;
/// Strength of the Earth's dipole at the equator on the ground, T.
const DIPOLE_T: f64 = 3.12e-5;

/// The surroundings of the satellite at one moment. Axes are TEME.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) r_teme_km: Vec3,
    pub(crate) v_teme_km_s: Vec3,
    /// Unit vector to the sun.
    pub(crate) sun_teme: Vec3,
    /// Uncovered part of the Sun's disc, 0 to 1.
    pub(crate) lit: f64,
    /// Magnetic field, T.
    pub(crate) field_teme_t: Vec3,
    /// Geodetic latitude of the point below, degrees.
    pub(crate) latitude_deg: f64,
    /// Longitude of the point below, degrees, -180..=180.
    pub(crate) longitude_deg: f64,
}

impl Place {
    /// The satellite's place. Where the elements have no state, everything that hangs on it is NaN, and the Sun shines.
    pub(crate) fn of(orbit: &Orbit, utc_ms: u64) -> Self {
        let at = instant(utc_ms);
        let sun_teme_km = sun_teme_km(at);
        Self::at(orbit, at, sun_teme_km).unwrap_or(Self {
            r_teme_km: [f64::NAN; 3],
            v_teme_km_s: [f64::NAN; 3],
            sun_teme: unit_of(sun_teme_km),
            lit: 1.0,
            field_teme_t: [f64::NAN; 3],
            latitude_deg: f64::NAN,
            longitude_deg: f64::NAN,
        })
    }

    fn at(orbit: &Orbit, at: UtcInstant, sun_teme_km: Vec3) -> Result<Self, PropagationError> {
        let state = orbit.at(at)?;
        let below = subpoint(&ecef_from_teme(&state, gmst_rad(at, EarthOrientation::UT1_IS_UTC)));
        let up = unit_of(state.r_teme_km);
        // the dipole points south
        let south = [0.0, 0.0, -1.0];
        let strength_t = DIPOLE_T * (EARTH_RADIUS_KM / length(state.r_teme_km)).powi(3);
        Ok(Self {
            r_teme_km: state.r_teme_km,
            v_teme_km_s: state.v_teme_km_s,
            sun_teme: unit_of(sun_teme_km),
            lit: Discs::seen_from(state.r_teme_km, sun_teme_km).light().lit(),
            field_teme_t: scale(add(scale(up, 3.0 * dot(south, up)), scale(south, -1.0)), strength_t),
            latitude_deg: below.latitude_rad.to_degrees(),
            longitude_deg: below.longitude_rad.to_degrees(),
        })
    }

    /// Unit vector from the satellite to a place on the ground.
    pub(crate) fn towards_ground(&self, latitude_deg: f64, longitude_deg: f64, utc_ms: u64) -> Vec3 {
        let target_ecef_km = ecef_km(Geodetic {
            latitude_rad: latitude_deg.to_radians(),
            longitude_rad: longitude_deg.to_radians(),
            height_km: 0.0,
        });
        let gmst = gmst_rad(instant(utc_ms), EarthOrientation::UT1_IS_UTC);
        unit_of(add(turn_z(-gmst, target_ecef_km), scale(self.r_teme_km, -1.0)))
    }
}

fn instant(utc_ms: u64) -> UtcInstant {
    UtcInstant::from_unix_us(i64::try_from(utc_ms).unwrap_or(i64::MAX).saturating_mul(1000))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW_MS: u64 = 1_790_000_000_000;

    #[test]
    fn place_is_what_tle_says_of_the_elements() {
        let orbit = Orbit::fictional(11, instant(NOW_MS));
        let propagator = tle::Propagator::new(orbit.elements()).unwrap();
        let (mut dark, mut half) = (0, 0);
        for second in 0..6_000_u64 {
            let at_ms = NOW_MS + second * 1_000;
            let at = instant(at_ms);
            let place = Place::of(&orbit, at_ms);
            let state = propagator.at(at).unwrap();
            assert_eq!((place.r_teme_km, place.v_teme_km_s), (state.r_teme_km, state.v_teme_km_s));
            assert_eq!(place.lit, tle::shadow::light(state.r_teme_km, at).lit());
            let fixed = ecef_from_teme(&state, gmst_rad(at, EarthOrientation::UT1_IS_UTC));
            assert_eq!(place.longitude_deg, subpoint(&fixed).longitude_rad.to_degrees());
            assert!((2.0e-5..6.0e-5).contains(&length(place.field_teme_t)));
            dark += u32::from(place.lit == 0.0);
            half += u32::from(place.lit > 0.0 && place.lit < 1.0);
        }
        assert!(dark > 0 && half > 0, "an orbit has a night and two dusks: {dark}, {half}");
    }

    #[test]
    fn the_point_below_lies_straight_down() {
        let orbit = Orbit::fictional(3, instant(NOW_MS));
        let place = Place::of(&orbit, NOW_MS);
        let below = place.towards_ground(place.latitude_deg, place.longitude_deg, NOW_MS);
        assert!(dot(below, unit_of(place.r_teme_km)) < -0.99);
    }

    #[test]
    fn without_a_state_the_position_is_unknown_and_not_zero() {
        // Elements of 1900.
        let orbit = Orbit::fictional(3, UtcInstant::EARLIEST);
        let place = Place::of(&orbit, NOW_MS);
        assert!(place.r_teme_km.iter().all(|axis| axis.is_nan()) && place.lit == 1.0);
    }
}
