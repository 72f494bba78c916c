//! Directions in the sky, and the positions of a mount that look there.

/// A direction in a station's sky, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// From north over east, 0 to below 360.
    pub azimuth_deg: f64,
    /// Above the horizon, -90 to 90.
    pub elevation_deg: f64,
}

impl Direction {
    /// Any azimuth is brought into 0..360, elevations beyond the zenith or the nadir are held there.
    #[must_use]
    pub fn new(azimuth_deg: f64, elevation_deg: f64) -> Self {
        Self { azimuth_deg: turn(azimuth_deg), elevation_deg: elevation_deg.clamp(-90.0, 90.0) }
    }

    /// The angle between two directions, degrees, 0 to 180.
    #[must_use]
    pub fn angle_deg(self, other: Self) -> f64 {
        let (a, b) = (self.unit(), other.unit());
        let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let sine = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
        sine.atan2(dot).to_degrees()
    }

    /// Neither angle is NaN or infinite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.azimuth_deg.is_finite() && self.elevation_deg.is_finite()
    }

    fn unit(self) -> [f64; 3] {
        let (sin_az, cos_az) = self.azimuth_deg.to_radians().sin_cos();
        let (sin_el, cos_el) = self.elevation_deg.to_radians().sin_cos();
        [cos_el * sin_az, cos_el * cos_az, sin_el]
    }
}

/// Into 0..360; `rem_euclid` alone gives 360 for tiny negative angles.
fn turn(azimuth_deg: f64) -> f64 {
    let turned = azimuth_deg.rem_euclid(360.0);
    if turned >= 360.0 { 0.0 } else { turned }
}

/// Where the two axes of a mount stand, degrees, as its dials show it.
///
/// The azimuth may be below 0 or beyond 360 (overlap), the elevation beyond 90 (flip: the boom leans over the zenith and
/// looks behind itself).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Azimuth axis.
    pub azimuth_deg: f64,
    /// Elevation axis.
    pub elevation_deg: f64,
}

impl Position {
    /// Where the antenna looks.
    #[must_use]
    pub fn direction(self) -> Direction {
        if self.elevation_deg > 90.0 {
            Direction::new(self.azimuth_deg + 180.0, 180.0 - self.elevation_deg)
        } else {
            Direction::new(self.azimuth_deg, self.elevation_deg)
        }
    }

    /// The larger of the two axes' ways to `other`, degrees.
    #[must_use]
    pub fn way_deg(self, other: Self) -> f64 {
        let azimuth = (self.azimuth_deg - other.azimuth_deg).abs();
        azimuth.max((self.elevation_deg - other.elevation_deg).abs())
    }

    /// Neither angle is NaN or infinite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.azimuth_deg.is_finite() && self.elevation_deg.is_finite()
    }
}
