//! The WGS84 ellipsoid: latitude, longitude and height, and the Earth-fixed vector they stand for.

use crate::vector::Vec3;

/// Equatorial radius, km.
pub const WGS84_RADIUS_KM: f64 = 6378.137;
/// Flattening.
pub const WGS84_FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Square of the first eccentricity.
pub const WGS84_E2: f64 = WGS84_FLATTENING * (2.0 - WGS84_FLATTENING);

/// A place by geodetic coordinates on WGS84.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodetic {
    /// Geodetic latitude, rad, north positive.
    pub latitude_rad: f64,
    /// Longitude, rad, east positive, -pi to pi when computed.
    pub longitude_rad: f64,
    /// Height above the ellipsoid, km.
    pub height_km: f64,
}

/// The Earth-fixed vector of a place, km.
#[must_use]
pub fn ecef_km(place: Geodetic) -> Vec3 {
    let (sin_lat, cos_lat) = place.latitude_rad.sin_cos();
    let (sin_lon, cos_lon) = place.longitude_rad.sin_cos();
    let n_km = WGS84_RADIUS_KM / (1.0 - WGS84_E2 * sin_lat * sin_lat).sqrt();
    let across_km = (n_km + place.height_km) * cos_lat;
    [across_km * cos_lon, across_km * sin_lon, (n_km * (1.0 - WGS84_E2) + place.height_km) * sin_lat]
}

/// The place below an Earth-fixed vector, by Bowring's closed form, applied twice: 1e-9 rad and 1 mm from the
/// Earth's surface (a few km below it too) out to 40,000 km and beyond. At the Earth's centre everything is 0 but the
/// height.
#[must_use]
pub fn geodetic(r_ecef_km: Vec3) -> Geodetic {
    let [x, y, z] = r_ecef_km;
    let p_km = x.hypot(y);
    let b_km = WGS84_RADIUS_KM * (1.0 - WGS84_FLATTENING);
    let second_e2 = WGS84_E2 / (1.0 - WGS84_E2);
    // The parametric latitude, first guessed as if the place lay on the ellipsoid.
    let mut beta = (z * WGS84_RADIUS_KM).atan2(p_km * b_km);
    let mut latitude_rad = 0.0;
    for _ in 0..3 {
        let (sin_b, cos_b) = beta.sin_cos();
        latitude_rad =
            (z + second_e2 * b_km * sin_b.powi(3)).atan2(p_km - WGS84_E2 * WGS84_RADIUS_KM * cos_b.powi(3));
        let (sin_lat, cos_lat) = latitude_rad.sin_cos();
        beta = ((1.0 - WGS84_FLATTENING) * sin_lat).atan2(cos_lat);
    }
    let (sin_lat, cos_lat) = latitude_rad.sin_cos();
    // Along the normal: no division by a cosine or a sine that vanishes at a pole or at the equator.
    let height_km =
        p_km * cos_lat + z * sin_lat - WGS84_RADIUS_KM * (1.0 - WGS84_E2 * sin_lat * sin_lat).sqrt();
    Geodetic { latitude_rad, longitude_rad: y.atan2(x), height_km }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn place_survives_the_way_there_and_back() {
        for latitude in (-90_i32..=90).step_by(3) {
            for longitude in (-180_i32..180).step_by(45) {
                for height_km in [-5.0, 0.0, 0.4, 500.0, 20_000.0, 40_000.0] {
                    let place = Geodetic {
                        latitude_rad: f64::from(latitude).to_radians(),
                        longitude_rad: f64::from(longitude).to_radians(),
                        height_km,
                    };
                    let back = geodetic(ecef_km(place));
                    assert!((back.latitude_rad - place.latitude_rad).abs() < 1e-12, "{place:?} {back:?}");
                    assert!((back.height_km - height_km).abs() < 1e-8, "{place:?} {back:?}");
                    if latitude.abs() < 90 && longitude > -180 {
                        assert!((back.longitude_rad - place.longitude_rad).abs() < 1e-12, "{place:?}");
                    }
                }
            }
        }
        assert!(geodetic([0.0; 3]).height_km.is_finite());
    }
}
