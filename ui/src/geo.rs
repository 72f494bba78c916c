//! Places on the Earth as the maps need them: degrees, and lines cut where a flat map ends.

/// A place: longitude east and latitude north in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Place {
    /// East of Greenwich, degrees; any turn is understood.
    pub longitude_deg: f64,
    /// North of the equator, degrees, −90 to 90.
    pub latitude_deg: f64,
}

impl Place {
    /// A place by longitude east and latitude north, degrees.
    #[must_use]
    pub const fn new(longitude_deg: f64, latitude_deg: f64) -> Self {
        Self { longitude_deg, latitude_deg }
    }
}

/// The angle brought to −180 (included) .. 180 degrees.
#[must_use]
pub fn wrap_deg(angle_deg: f64) -> f64 {
    if (-180.0..180.0).contains(&angle_deg) {
        return angle_deg;
    }
    let turned = (angle_deg + 180.0).rem_euclid(360.0) - 180.0;
    // rem_euclid of a tiny negative number rounds to the divisor itself
    if turned >= 180.0 { -180.0 } else { turned }
}
