//! Where the twin is: a circular, nearly polar orbit of 500 km, the sun and the Earth's field there. Pure functions
//! of time, plausible rather than exact.

use crate::{
    noise::{mix, unit},
    passes::{EARTH_RADIUS_KM, ORBIT_HEIGHT_KM},
    vector::{Vec3, add, cross, dot, scale, unit_of},
};

/// Gravitational parameter of the Earth, km³/s².
const MU_KM3_S2: f64 = 398_600.441_8;
const INCLINATION_DEG: f64 = 97.4;
/// Strength of the Earth's dipole at the equator on the ground, T.
const DIPOLE_T: f64 = 3.12e-5;
/// A vernal equinox, ms since 1970 UTC (2000-03-20T07:35Z).
const EQUINOX_MS: f64 = 953_537_700_000.0;
const YEAR_DAYS: f64 = 365.2422;
const OBLIQUITY_DEG: f64 = 23.44;
const DAY_MS: f64 = 86_400_000.0;

/// The surroundings of the satellite at one moment. Axes are TEME.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) r_teme_km: Vec3,
    pub(crate) v_teme_km_s: Vec3,
    /// Unit vector to the sun.
    pub(crate) sun_teme: Vec3,
    pub(crate) in_eclipse: bool,
    /// Magnetic field, T.
    pub(crate) field_teme_t: Vec3,
    /// Geographic latitude of the point below, degrees (sphere).
    pub(crate) latitude_deg: f64,
    /// Geographic longitude of the point below, degrees, -180..=180.
    pub(crate) longitude_deg: f64,
}

/// The orbit, turned by the seed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Orbit {
    node_rad: f64,
    phase_rad: f64,
}

impl Orbit {
    pub(crate) fn new(seed: u64) -> Self {
        let turn = |key: u64| f64::from(unit(mix(seed) ^ key)) * std::f64::consts::TAU;
        Self { node_rad: turn(1), phase_rad: turn(2) }
    }

    pub(crate) fn at(&self, utc_ms: u64) -> Place {
        let radius_km = EARTH_RADIUS_KM + ORBIT_HEIGHT_KM;
        let rate_rad_s = (MU_KM3_S2 / radius_km.powi(3)).sqrt();
        let period_ms = std::f64::consts::TAU / rate_rad_s * 1000.0;
        let turns = (utc_ms as f64 % period_ms) / period_ms;
        let argument = self.phase_rad + turns * std::f64::consts::TAU;
        let inclination = INCLINATION_DEG.to_radians();
        let ascending = [self.node_rad.cos(), self.node_rad.sin(), 0.0];
        let across = [
            -self.node_rad.sin() * inclination.cos(),
            self.node_rad.cos() * inclination.cos(),
            inclination.sin(),
        ];
        let along = |angle: f64| add(scale(ascending, angle.cos()), scale(across, angle.sin()));
        let up = along(argument);
        let r_teme_km = scale(up, radius_km);
        let v_teme_km_s = scale(along(argument + std::f64::consts::FRAC_PI_2), radius_km * rate_rad_s);

        let sun_teme = sun_direction(utc_ms);
        let towards_sun = dot(r_teme_km, sun_teme);
        let off_axis = cross(r_teme_km, sun_teme);
        let in_eclipse = towards_sun < 0.0 && dot(off_axis, off_axis) < EARTH_RADIUS_KM.powi(2);

        // the dipole points south
        let south = [0.0, 0.0, -1.0];
        let strength_t = DIPOLE_T * (EARTH_RADIUS_KM / radius_km).powi(3);
        let field_teme_t = scale(add(scale(up, 3.0 * dot(south, up)), scale(south, -1.0)), strength_t);

        let longitude = up[1].atan2(up[0]) - earth_angle_rad(utc_ms);
        Place {
            r_teme_km,
            v_teme_km_s,
            sun_teme,
            in_eclipse,
            field_teme_t,
            latitude_deg: up[2].clamp(-1.0, 1.0).asin().to_degrees(),
            longitude_deg: (longitude.to_degrees() + 180.0).rem_euclid(360.0) - 180.0,
        }
    }
}

/// Unit vector from the satellite to a place on the ground.
pub(crate) fn towards_ground(place: &Place, latitude_deg: f64, longitude_deg: f64, utc_ms: u64) -> Vec3 {
    let latitude = latitude_deg.to_radians();
    let angle = longitude_deg.to_radians() + earth_angle_rad(utc_ms);
    let target = [latitude.cos() * angle.cos(), latitude.cos() * angle.sin(), latitude.sin()];
    unit_of(add(scale(target, EARTH_RADIUS_KM), scale(place.r_teme_km, -1.0)))
}

fn sun_direction(utc_ms: u64) -> Vec3 {
    let years = (utc_ms as f64 - EQUINOX_MS) / DAY_MS / YEAR_DAYS;
    let longitude = years.fract() * std::f64::consts::TAU;
    let obliquity = OBLIQUITY_DEG.to_radians();
    [longitude.cos(), longitude.sin() * obliquity.cos(), longitude.sin() * obliquity.sin()]
}

/// Turn of the Earth since the vernal equinox stood over Greenwich, rad (Earth rotation angle, IERS).
fn earth_angle_rad(utc_ms: u64) -> f64 {
    const J2000_MS: f64 = 946_728_000_000.0;
    let days = (utc_ms as f64 - J2000_MS) / DAY_MS;
    (0.779_057_273_264 + 1.002_737_811_911_354_5 * days).fract() * std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::length;

    const NOW_MS: u64 = 1_790_000_000_000;

    #[test]
    fn position_and_velocity_are_those_of_a_circular_orbit() {
        let orbit = Orbit::new(7);
        for minute in 0..200_u64 {
            let at_ms = NOW_MS + minute * 60_000;
            let (here, soon) = (orbit.at(at_ms), orbit.at(at_ms + 100));
            assert!((length(here.r_teme_km) - 6_871.0).abs() < 1e-6);
            assert!((length(here.v_teme_km_s) - 7.6166).abs() < 1e-3);
            let moved = scale(add(soon.r_teme_km, scale(here.r_teme_km, -1.0)), 10.0);
            assert!(length(add(moved, scale(here.v_teme_km_s, -1.0))) < 0.01, "minute {minute}");
        }
    }

    #[test]
    fn there_is_day_and_night_and_a_field_of_the_right_size() {
        let orbit = Orbit::new(3);
        let places: Vec<Place> = (0..95).map(|minute| orbit.at(NOW_MS + minute * 60_000)).collect();
        assert!(places.iter().any(|place| !place.in_eclipse));
        for place in &places {
            assert!((2.0e-5..6.0e-5).contains(&length(place.field_teme_t)));
            assert!((length(place.sun_teme) - 1.0).abs() < 1e-9);
            assert!(place.latitude_deg.abs() < 83.0 && place.longitude_deg.abs() <= 180.0);
        }
    }

    #[test]
    fn the_sun_stands_north_in_june() {
        let june_2026_ms = 1_782_000_000_000;
        assert!(sun_direction(june_2026_ms)[2] > 0.39);
    }
}
