//! How an object is accelerated: two bodies, the Earth's flattening, and the turning frame.

use crate::frames::{EARTH_RATE_RAD_S, EarthFixed};
use crate::propagator::{SGP4_EARTH_RADIUS_KM, SGP4_MU_KM3_S2};
use crate::vector::{Vec3, dot};

/// J2 of SGP4 (WGS72).
pub const SGP4_J2: f64 = 0.001_082_616;

/// Acceleration by the Earth's point mass and J2 at a position, km/s^2, in any frame whose z axis is the Earth's.
#[must_use]
pub fn gravity_km_s2(r_km: Vec3) -> Vec3 {
    let r2 = dot(r_km, r_km);
    let central = -SGP4_MU_KM3_S2 / (r2 * r2.sqrt());
    let flattening = 1.5 * SGP4_J2 * (SGP4_EARTH_RADIUS_KM * SGP4_EARTH_RADIUS_KM / r2);
    let z2 = 5.0 * r_km[2] * r_km[2] / r2;
    let level = central * (1.0 + flattening * (1.0 - z2));
    [r_km[0] * level, r_km[1] * level, r_km[2] * central * (1.0 + flattening * (3.0 - z2))]
}

/// Acceleration as seen from the turning Earth, km/s^2: gravity, Coriolis and centrifugal terms. Drag, Sun and Moon are
/// left out: a few 1e-9 km/s^2 in low orbits.
#[must_use]
pub fn acceleration_ecef_km_s2(object: &EarthFixed) -> Vec3 {
    let (r, v) = (object.r_ecef_km, object.v_ecef_km_s);
    let g = gravity_km_s2(r);
    let w = EARTH_RATE_RAD_S;
    [g[0] + 2.0 * w * v[1] + w * w * r[0], g[1] - 2.0 * w * v[0] + w * w * r[1], g[2]]
}
