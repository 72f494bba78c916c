//! A place on Earth that looks at the sky.

use crate::frames::EarthFixed;
use crate::geodetic::{Geodetic, ecef_km};
use crate::look::LookAngles;
use crate::mask::HorizonMask;
use crate::vector::Vec3;

/// A ground station: where it stands (WGS84), its local axes, and what its horizon hides.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    latitude_deg: f64,
    longitude_deg: f64,
    height_m: f64,
    mask: HorizonMask,
    axes: LocalAxes,
}

/// The station's position and its directions, Earth-fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalAxes {
    /// Position, km.
    pub r_ecef_km: Vec3,
    /// Unit vector east. At a pole the given longitude fixes it.
    pub east: Vec3,
    /// Unit vector north.
    pub north: Vec3,
    /// Unit vector up, along the ellipsoid's normal.
    pub up: Vec3,
}

impl Station {
    /// A station by geodetic latitude (north positive), longitude (east positive, -180 to 360) and height above the
    /// WGS84 ellipsoid (-12,000 m to 100,000 m), with an open horizon.
    ///
    /// # Errors
    /// A coordinate outside its range, or no number.
    pub fn new(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Result<Self, StationError> {
        if !(-90.0..=90.0).contains(&latitude_deg) {
            return Err(StationError::Latitude { found_deg: latitude_deg });
        }
        if !(-180.0..=360.0).contains(&longitude_deg) {
            return Err(StationError::Longitude { found_deg: longitude_deg });
        }
        if !(-12_000.0..=100_000.0).contains(&height_m) {
            return Err(StationError::Height { found_m: height_m });
        }
        let (latitude_rad, longitude_rad) = (latitude_deg.to_radians(), longitude_deg.to_radians());
        let (sin_lat, cos_lat) = latitude_rad.sin_cos();
        let (sin_lon, cos_lon) = longitude_rad.sin_cos();
        let axes = LocalAxes {
            r_ecef_km: ecef_km(Geodetic { latitude_rad, longitude_rad, height_km: height_m / 1000.0 }),
            east: [-sin_lon, cos_lon, 0.0],
            north: [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
            up: [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
        };
        Ok(Self { latitude_deg, longitude_deg, height_m, mask: HorizonMask::OPEN, axes })
    }

    /// The same station with a horizon of its own.
    #[must_use]
    pub fn with_mask(mut self, mask: HorizonMask) -> Self {
        self.mask = mask;
        self
    }

    /// Geodetic latitude, degrees, north positive.
    #[must_use]
    pub const fn latitude_deg(&self) -> f64 {
        self.latitude_deg
    }

    /// Longitude, degrees, east positive, as it was given.
    #[must_use]
    pub const fn longitude_deg(&self) -> f64 {
        self.longitude_deg
    }

    /// Height above the WGS84 ellipsoid, metres.
    #[must_use]
    pub const fn height_m(&self) -> f64 {
        self.height_m
    }

    /// What the horizon hides.
    #[must_use]
    pub const fn mask(&self) -> &HorizonMask {
        &self.mask
    }

    /// Position and directions, Earth-fixed.
    #[must_use]
    pub const fn axes(&self) -> &LocalAxes {
        &self.axes
    }

    /// Where an object stands in this station's sky. Geometric: no refraction, no light time.
    #[must_use]
    pub fn look(&self, object: &EarthFixed) -> LookAngles {
        LookAngles::from_axes(&self.axes, object)
    }

    /// Whether something at these angles is above the mask.
    #[must_use]
    pub fn sees(&self, look: &LookAngles) -> bool {
        look.elevation_deg > self.mask.elevation_deg(look.azimuth_deg)
    }
}

/// A place that is not on Earth.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StationError {
    /// Latitude outside -90 to 90.
    #[error(
        "the latitude {found_deg} is outside -90 to 90 degrees: give latitude first, then longitude, in decimal degrees"
    )]
    Latitude {
        /// Degrees given.
        found_deg: f64,
    },
    /// Longitude outside -180 to 360.
    #[error("the longitude {found_deg} is outside -180 to 360 degrees: give decimal degrees, east positive")]
    Longitude {
        /// Degrees given.
        found_deg: f64,
    },
    /// Height outside -12 km to 100 km.
    #[error("the height {found_m} m is outside -12000 to 100000 m: give metres above the WGS84 ellipsoid")]
    Height {
        /// Metres given.
        found_m: f64,
    },
}
