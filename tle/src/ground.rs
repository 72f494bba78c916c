//! What lies below: sub-satellite point, ground track and footprint.

use crate::frames::{EarthFixed, ecef_from_teme, gmst_rad};
use crate::geodetic::{Geodetic, WGS84_RADIUS_KM, geodetic};
use crate::propagator::{PropagationError, Propagator};
use crate::time::{EarthOrientation, UtcInstant};
use crate::vector::norm;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Points that a ground track or a footprint may have.
pub const POINTS_MAX: usize = 100_000;

/// The place straight below an object (along the ellipsoid's normal), and its height above it.
#[must_use]
pub fn subpoint(object: &EarthFixed) -> Geodetic {
    geodetic(object.r_ecef_km)
}

/// A place of a ground track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackPoint {
    /// When the object stands above it.
    pub at: UtcInstant,
    /// The place, and the object's height.
    pub place: Geodetic,
}

/// Sub-satellite points from `start` to `stop`, every `step_s` seconds and at `stop`; at most [`POINTS_MAX`]. A step of
/// less than 1 ms, or a reversed window, gives no points.
///
/// # Errors
/// Where propagation ends; shorten the window.
pub fn ground_track(
    propagator: &Propagator,
    orientation: EarthOrientation,
    start: UtcInstant,
    stop: UtcInstant,
    step_s: f64,
) -> Result<Vec<TrackPoint>, PropagationError> {
    let mut track = Vec::new();
    if !(1e-3..=1e9).contains(&step_s) || stop < start {
        return Ok(track);
    }
    let mut at = start;
    while track.len() < POINTS_MAX {
        let fixed = ecef_from_teme(&propagator.at(at)?, gmst_rad(at, orientation));
        track.push(TrackPoint { at, place: subpoint(&fixed) });
        if at >= stop {
            break;
        }
        at = at.plus_seconds(step_s).min(stop);
    }
    Ok(track)
}

/// Cuts a line of (longitude, latitude) in radians where it crosses the 180 degree meridian, so that a flat map does not
/// draw it all across. Each piece ends, and the next begins, on the meridian itself.
#[must_use]
pub fn split_at_date_line(line: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    let mut piece: Vec<(f64, f64)> = Vec::new();
    for &(longitude, latitude) in line {
        if let Some(&(before, latitude_before)) = piece.last() {
            let leap = longitude - before;
            if leap.abs() > PI {
                // Eastwards over the meridian the longitude leaps by almost minus a turn.
                let edge = if leap < 0.0 { PI } else { -PI };
                let way = leap - TAU.copysign(leap);
                let part = if way == 0.0 { 0.5 } else { ((edge - before) / way).clamp(0.0, 1.0) };
                let crossing = latitude_before + (latitude - latitude_before) * part;
                piece.push((edge, crossing));
                pieces.push(std::mem::replace(&mut piece, vec![(-edge, crossing)]));
            }
        }
        piece.push((longitude, latitude));
    }
    if !piece.is_empty() {
        pieces.push(piece);
    }
    pieces
}

/// The angle at the Earth's centre between the sub-satellite point and the places that see the object at
/// `min_elevation_deg`, rad, on a sphere; 0 for an object below the surface.
#[must_use]
pub fn footprint_half_angle_rad(object: &EarthFixed, min_elevation_deg: f64) -> f64 {
    let elevation = min_elevation_deg.to_radians();
    let ratio = WGS84_RADIUS_KM * elevation.cos() / norm(object.r_ecef_km);
    if ratio <= 1.0 { (ratio.acos() - elevation).max(0.0) } else { 0.0 }
}

/// The footprint's edge as `points` places (longitude, latitude) in radians, on a sphere, starting north of the
/// sub-satellite point and turning east; at most [`POINTS_MAX`].
#[must_use]
pub fn footprint(object: &EarthFixed, min_elevation_deg: f64, points: usize) -> Vec<(f64, f64)> {
    let points = points.min(POINTS_MAX);
    let half = footprint_half_angle_rad(object, min_elevation_deg);
    let [x, y, z] = object.r_ecef_km;
    let (latitude, longitude) = (z.atan2(x.hypot(y)), y.atan2(x));
    (0..points)
        .map(|index| {
            let bearing = TAU * index as f64 / points as f64;
            let sine = latitude.sin() * half.cos() + latitude.cos() * half.sin() * bearing.cos();
            let edge = sine.clamp(-1.0, 1.0).asin().clamp(-FRAC_PI_2, FRAC_PI_2);
            let east =
                (bearing.sin() * half.sin() * latitude.cos()).atan2(half.cos() - latitude.sin() * sine);
            ((longitude + east + PI).rem_euclid(TAU) - PI, edge)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::station::Station;

    #[test]
    fn line_over_the_date_line_is_cut_on_it() {
        let degrees = |line: &[(f64, f64)]| -> Vec<(f64, f64)> {
            line.iter().map(|(a, b)| (a.to_radians(), b.to_radians())).collect()
        };
        let pieces =
            split_at_date_line(&degrees(&[(170.0, 0.0), (-170.0, 10.0), (-160.0, 20.0), (160.0, 0.0)]));
        assert_eq!(pieces.len(), 3);
        let (edge, latitude) = pieces[0][1];
        assert_eq!(edge, PI);
        assert!((latitude.to_degrees() - 5.0).abs() < 1e-9);
        assert_eq!(pieces[1][0], (-PI, latitude));
        assert_eq!(pieces[1].last().unwrap().0, -PI);
        assert_eq!(pieces[2][0].0, PI);
        assert!(split_at_date_line(&[]).is_empty());
    }

    #[test]
    fn edge_of_the_footprint_sees_the_object_at_its_elevation() {
        let object = EarthFixed { r_ecef_km: [-5000.0, 3000.0, 4000.0], v_ecef_km_s: [0.0; 3] };
        for minimum in [0.0, 10.0, 60.0] {
            for (longitude, latitude) in footprint(&object, minimum, 36) {
                // The sphere of the footprint, not the ellipsoid: its latitudes are geocentric.
                let geodetic = (latitude.tan() / (1.0 - crate::geodetic::WGS84_E2)).atan();
                let station = Station::new(geodetic.to_degrees(), longitude.to_degrees(), 0.0).unwrap();
                let elevation = station.look(&object).elevation_deg;
                assert!((elevation - minimum).abs() < 0.5, "{elevation} for {minimum}");
            }
        }
    }
}
