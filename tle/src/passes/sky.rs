//! One station's sky: on which side of the threshold, and which way the elevation goes.

use crate::frames::EarthFixed;
use crate::gravity::acceleration_ecef_km_s2;
use crate::station::LocalAxes;
use crate::vector::{Vec3, dot, norm, sub};

/// A station and the elevation above which a pass is a pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sky<'a> {
    pub(super) axes: &'a LocalAxes,
    sin_threshold: f64,
}

/// The clearance and the climb at one place, with derivatives by the parameter in which the motion was given.
///
/// The clearance, d.u - |d| sin(threshold) in km, has the sign of elevation minus threshold; its root is the crossing, and
/// an error of position changes it by no more than twice that error. The climb, (v.u) d^2 - (d.u)(d.v), has the sign
/// of the elevation's derivative; its root is a greatest or least elevation. Both are smooth where angles are not.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    pub(super) clearance: f64,
    pub(super) clearance1: f64,
    pub(super) climb: f64,
    pub(super) climb1: f64,
}

impl<'a> Sky<'a> {
    pub(super) fn new(axes: &'a LocalAxes, threshold_deg: f64) -> Self {
        Self { axes, sin_threshold: threshold_deg.to_radians().sin() }
    }

    /// Clearance and climb of a motion: position, first and second derivative.
    pub(super) fn sight(&self, r: Vec3, r1: Vec3, r2: Vec3) -> Sight {
        let d = sub(r, self.axes.r_ecef_km);
        let up = self.axes.up;
        let (d_u, v_u, a_u) = (dot(d, up), dot(r1, up), dot(r2, up));
        let d_d = dot(d, d);
        let d_v = dot(d, r1);
        let range = d_d.sqrt().max(1e-9);
        Sight {
            clearance: d_u - range * self.sin_threshold,
            clearance1: v_u - d_v / range * self.sin_threshold,
            climb: v_u * d_d - d_u * d_v,
            climb1: a_u * d_d + v_u * d_v - d_u * (dot(r1, r1) + dot(d, r2)),
        }
    }

    /// The clearance of a position, and its derivative by the parameter of `r1`.
    #[inline]
    pub(super) fn clearance_and_slope(&self, r: Vec3, r1: Vec3) -> (f64, f64) {
        let d = sub(r, self.axes.r_ecef_km);
        let up = self.axes.up;
        let range = norm(d).max(1e-9);
        (dot(d, up) - range * self.sin_threshold, dot(r1, up) - dot(d, r1) / range * self.sin_threshold)
    }

    /// The clearance of a position, km.
    pub(super) fn clearance(&self, r: Vec3) -> f64 {
        let d = sub(r, self.axes.r_ecef_km);
        dot(d, self.axes.up) - norm(d) * self.sin_threshold
    }

    /// The sight of a true state, with gravity's acceleration, and the clearance's second derivative by time.
    pub(super) fn sight_of(&self, state: &EarthFixed) -> (Sight, f64) {
        let (r, v) = (state.r_ecef_km, state.v_ecef_km_s);
        let a = acceleration_ecef_km_s2(state);
        let d = sub(r, self.axes.r_ecef_km);
        let range = norm(d).max(1e-9);
        let range_rate = dot(d, v) / range;
        let range_bend = (dot(v, v) + dot(d, a) - range_rate * range_rate) / range;
        (self.sight(r, v, a), dot(a, self.axes.up) - range_bend * self.sin_threshold)
    }
}
