//! From SGP4's frame to the turning Earth: sidereal time, TEME to Earth-fixed.
//!
//! Polar motion is neglected (it moves a pass by about a millisecond), and no equation of the equinoxes is added: TEME
//! already refers to the mean equinox in that direction.

use crate::propagator::State;
use crate::time::{EarthOrientation, UtcInstant};
use crate::vector::Vec3;

/// The Earth's rate of rotation, rad/s.
pub const EARTH_RATE_RAD_S: f64 = 7.292_115_147e-5;

/// Position and velocity in the frame that turns with the Earth (pseudo Earth-fixed: no polar motion).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EarthFixed {
    /// Position, km.
    pub r_ecef_km: Vec3,
    /// Velocity as seen from the turning Earth, km/s.
    pub v_ecef_km_s: Vec3,
}

/// Greenwich mean sidereal time of the IAU 1982 model, 0 to 2 pi rad.
#[must_use]
pub fn gmst_rad(at: UtcInstant, orientation: EarthOrientation) -> f64 {
    let (days, fraction) = at.days_since_j2000();
    let fraction = fraction + orientation.ut1_minus_utc_s() / 86_400.0;
    let t = (days + fraction) / 36_525.0;
    // 876600 h of the published polynomial are the Earth's whole turns, one a day: only the fraction of a day is left.
    let seconds =
        67_310.548_41 + 86_400.0 * fraction + 8_640_184.812_866 * t + 0.093_104 * t * t - 6.2e-6 * t * t * t;
    (seconds / 86_400.0).rem_euclid(1.0) * std::f64::consts::TAU
}

/// Turns a vector by an angle about the z axis: R3(angle) v.
#[must_use]
pub fn turn_z(angle_rad: f64, v: Vec3) -> Vec3 {
    let (sin, cos) = angle_rad.sin_cos();
    [cos * v[0] + sin * v[1], cos * v[1] - sin * v[0], v[2]]
}

/// Position and velocity from TEME to Earth-fixed at a sidereal time.
#[must_use]
pub fn ecef_from_teme(state: &State, gmst_rad: f64) -> EarthFixed {
    let r = turn_z(gmst_rad, state.r_teme_km);
    let v = turn_z(gmst_rad, state.v_teme_km_s);
    EarthFixed {
        r_ecef_km: r,
        v_ecef_km_s: [v[0] + EARTH_RATE_RAD_S * r[1], v[1] - EARTH_RATE_RAD_S * r[0], v[2]],
    }
}

/// Position and velocity from Earth-fixed to TEME at a sidereal time.
#[must_use]
pub fn teme_from_ecef(fixed: &EarthFixed, gmst_rad: f64) -> State {
    let (r, v) = (fixed.r_ecef_km, fixed.v_ecef_km_s);
    let inertial = [v[0] - EARTH_RATE_RAD_S * r[1], v[1] + EARTH_RATE_RAD_S * r[0], v[2]];
    State { r_teme_km: turn_z(-gmst_rad, r), v_teme_km_s: turn_z(-gmst_rad, inertial) }
}
