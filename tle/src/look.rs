//! Look angles: where to point, how far, how fast.

use crate::frames::EarthFixed;
use crate::station::LocalAxes;
use crate::vector::{dot, norm, sub};

/// An object in a station's sky. Geometric: no refraction, no light time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LookAngles {
    /// From north through east, 0 to 360 degrees. Undefined at the zenith.
    pub azimuth_deg: f64,
    /// Above the plane across the ellipsoid's normal, degrees.
    pub elevation_deg: f64,
    /// Distance, km.
    pub range_km: f64,
    /// How the azimuth changes, degrees/s. Grows without bound towards the zenith; 0 exactly there.
    pub azimuth_rate_deg_s: f64,
    /// How the elevation changes, degrees/s.
    pub elevation_rate_deg_s: f64,
    /// How the distance changes, km/s: negative while approaching.
    pub range_rate_km_s: f64,
}

impl LookAngles {
    /// From a station's axes and an object, both Earth-fixed.
    #[must_use]
    pub fn from_axes(axes: &LocalAxes, object: &EarthFixed) -> Self {
        let d = sub(object.r_ecef_km, axes.r_ecef_km);
        let v = object.v_ecef_km_s;
        let range_km = norm(d);
        let (east, north, up) = (dot(d, axes.east), dot(d, axes.north), dot(d, axes.up));
        let level_km = east.hypot(north);
        let elevation = up.atan2(level_km);
        let range_rate_km_s = if range_km > 0.0 { dot(d, v) / range_km } else { 0.0 };
        let (azimuth_rate, elevation_rate) = if level_km > 0.0 {
            (
                (dot(v, axes.east) * north - dot(v, axes.north) * east) / (level_km * level_km),
                (dot(v, axes.up) - range_rate_km_s * elevation.sin()) / level_km,
            )
        } else {
            (0.0, 0.0)
        };
        Self {
            azimuth_deg: east.atan2(north).to_degrees().rem_euclid(360.0),
            elevation_deg: elevation.to_degrees(),
            range_km,
            azimuth_rate_deg_s: azimuth_rate.to_degrees(),
            elevation_rate_deg_s: elevation_rate.to_degrees(),
            range_rate_km_s,
        }
    }
}
