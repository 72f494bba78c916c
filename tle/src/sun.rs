//! The Sun's place, to about 0.01 degrees from 1950 to 2050 (the Astronomical Almanac's low-precision formula).

use crate::frames::{gmst_rad, turn_z};
use crate::station::Station;
use crate::time::{EarthOrientation, UtcInstant};
use crate::vector::{Vec3, dot, norm, scale, sub};

/// Astronomical unit, km.
pub const ASTRONOMICAL_UNIT_KM: f64 = 149_597_870.7;
/// TT-UTC since 2017, s. Before, and after the next leap second, it is a few seconds off: 1e-5 degrees of the Sun.
const TT_MINUS_UTC_S: f64 = 69.184;

/// The Sun from the Earth's centre, km, in the equator and equinox of date. Good enough against TEME: the equation of
/// the equinoxes is 0.005 degrees.
#[must_use]
pub fn sun_teme_km(at: UtcInstant) -> Vec3 {
    let (days, fraction) = at.days_since_j2000();
    let n = days + (fraction + TT_MINUS_UTC_S / 86_400.0);
    let mean_longitude_deg = (280.460 + 0.985_647_4 * n).rem_euclid(360.0);
    let g = (357.528 + 0.985_600_3 * n).rem_euclid(360.0).to_radians();
    let longitude = (mean_longitude_deg + 1.915 * g.sin() + 0.020 * (2.0 * g).sin()).to_radians();
    let obliquity = (23.439 - 4e-7 * n).to_radians();
    let distance_au = 1.000_14 - 0.016_71 * g.cos() - 0.000_14 * (2.0 * g).cos();
    let direction = [longitude.cos(), obliquity.cos() * longitude.sin(), obliquity.sin() * longitude.sin()];
    scale(direction, distance_au * ASTRONOMICAL_UNIT_KM)
}

/// The Sun's elevation at a station, degrees, without refraction.
#[must_use]
pub fn sun_elevation_deg(station: &Station, at: UtcInstant, orientation: EarthOrientation) -> f64 {
    let sun_ecef_km = turn_z(gmst_rad(at, orientation), sun_teme_km(at));
    let d = sub(sun_ecef_km, station.axes().r_ecef_km);
    (dot(d, station.axes().up) / norm(d)).clamp(-1.0, 1.0).asin().to_degrees()
}
