//! True SGP4 where it counts: at crossings, at summits, and wherever the pieces leave a doubt.

use crate::frames::EarthFixed;
use crate::gravity::acceleration_ecef_km_s2;
use crate::propagator::{PropagationError, SGP4_MU_KM3_S2};
use crate::vector::{Vec3, dot, norm, scale, sub};

use super::motion::Motion;
use super::sky::Sky;

/// The two states about a summit are asked for this far from it, s.
pub(super) const SUMMIT_OFFSET_S: f64 = 1.0;
/// A crossing is settled when the next Newton step would move it by less than this, s: by what the velocity of a state near
/// it may be wrong, and by what secants leave.
const SETTLED_S: f64 = 5e-7;
const SETTLED_BY_BOUND_S: f64 = 2e-6;
/// A summit is settled by a step of this part of the time in which the orbit turns by a radian there: 0.2 s in low orbits.
const SUMMIT_STEP: f64 = 2.5e-4;

/// A time and the true state at it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) t_s: f64,
    pub(super) state: EarthFixed,
}

/// One Newton step from a true state towards the crossing; whether that settles it. SGP4's velocity is not the derivative
/// of its position, but off by so much at most: so much of a step is wrong.
pub(super) fn step_to_crossing(sky: &Sky<'_>, at: &Place, velocity_flaw_km_s: f64) -> (Place, bool) {
    let (sight, bend) = sky.sight_of(&at.state);
    let dt = -sight.clearance / sight.clearance1;
    // The flaw matters as a whole, not by its part along the clearance: the more, the flatter the crossing.
    let left = (0.5 * bend / sight.clearance1).abs() * dt * dt
        + velocity_flaw_km_s / sight.clearance1.abs() * dt.abs();
    // NaN and infinity settle nothing.
    let settled = dt.abs() < 0.05 && left < SETTLED_BY_BOUND_S;
    let dt = if dt.is_finite() { dt.clamp(-60.0, 60.0) } else { 0.0 };
    (moved(at, dt, at.state.v_ecef_km_s), settled)
}

/// A state a little later by gravity's acceleration, with a velocity for the way and its own for the state.
fn moved(at: &Place, dt: f64, velocity: Vec3) -> Place {
    let a = acceleration_ecef_km_s2(&at.state);
    let (r, v) = (at.state.r_ecef_km, at.state.v_ecef_km_s);
    Place {
        t_s: at.t_s + dt,
        state: EarthFixed {
            r_ecef_km: std::array::from_fn(|k| r[k] + dt * (velocity[k] + 0.5 * dt * a[k])),
            v_ecef_km_s: std::array::from_fn(|k| v[k] + dt * a[k]),
        },
    }
}

/// The crossing near a true state from which one Newton step did not settle it, and the state to which that step led:
/// secants, which need no velocity, then halving.
pub(super) fn crossing_from(
    sky: &Sky<'_>,
    motion: &mut Motion<'_>,
    first: &Place,
    second: Place,
    bracket: [f64; 2],
    rising: bool,
) -> Result<Place, PropagationError> {
    let (mut before, mut at) = (*first, second);
    for _ in 0..12 {
        let (clearance0, clearance) =
            (sky.clearance(before.state.r_ecef_km), sky.clearance(at.state.r_ecef_km));
        let last_s = at.t_s - before.t_s;
        let dt = -clearance * last_s / (clearance - clearance0);
        let (sight, bend) = sky.sight_of(&at.state);
        let left = (bend / sight.clearance1 * dt * (dt + last_s)).abs();
        if clearance == 0.0 || (dt.abs() < 0.02 && left < SETTLED_S) {
            return Ok(moved(&at, if dt.is_finite() { dt } else { 0.0 }, at.state.v_ecef_km_s));
        }
        // A secant that leads far away has lost its root.
        let next_s = at.t_s + dt;
        if !(next_s > bracket[0] - 5.0 && next_s < bracket[1] + 5.0) {
            break;
        }
        before = at;
        at = Place { t_s: next_s, state: motion.at(next_s)? };
    }
    let t_s = crossing_between(sky, motion, bracket[0], bracket[1], rising);
    Ok(Place { t_s, state: motion.at(t_s)? })
}

/// The crossing between two times, by true states alone: the side of `to` is above if `rising`. Widens the bracket when the
/// signs at its ends do not fit.
pub(super) fn crossing_between(
    sky: &Sky<'_>,
    motion: &mut Motion<'_>,
    from_s: f64,
    to_s: f64,
    rising: bool,
) -> f64 {
    let sign = if rising { 1.0 } else { -1.0 };
    let mut value = |t_s: f64| motion.at(t_s).map_or(f64::NAN, |state| sign * sky.clearance(state.r_ecef_km));
    let (mut low_s, mut high_s) = (from_s, to_s);
    let (mut low, mut high) = (value(low_s), value(high_s));
    // Each end moves out by ever larger steps, to twice the bracket's length and half a minute.
    let widest_s = (to_s - from_s).abs() + 30.0;
    let mut widen_s = 0.01;
    while low > 0.0 && widen_s < widest_s {
        low_s -= widen_s;
        low = value(low_s);
        widen_s *= 2.0;
    }
    widen_s = 0.01;
    while high <= 0.0 && widen_s < widest_s {
        high_s += widen_s;
        high = value(high_s);
        widen_s *= 2.0;
    }
    if low > 0.0 || high <= 0.0 || low.is_nan() || high.is_nan() {
        return if low.abs() < high.abs() { low_s } else { high_s };
    }
    // Illinois: the secant, but never the same end three times.
    let mut side = 0;
    for _ in 0..80 {
        if high_s - low_s < SETTLED_S {
            break;
        }
        let secant_s = low_s - low * (high_s - low_s) / (high - low);
        let t_s = if secant_s > low_s && secant_s < high_s { secant_s } else { 0.5 * (low_s + high_s) };
        let here = value(t_s);
        if here.is_nan() {
            break;
        }
        if here > 0.0 {
            if side == 1 {
                low *= 0.5;
            }
            (high_s, high, side) = (t_s, here, 1);
        } else {
            if side == -1 {
                high *= 0.5;
            }
            (low_s, low, side) = (t_s, here, -1);
        }
        if here.abs() < 1e-10 {
            return t_s;
        }
    }
    0.5 * (low_s + high_s)
}

/// The summit near two true states, [`SUMMIT_OFFSET_S`] before and after a first guess, and whether one step settled it.
///
/// The velocity is taken from the two positions: SGP4's own would move a low summit by tens of milliseconds. The state handed back keeps SGP4's velocity, for Doppler.
pub(super) fn step_to_summit(
    sky: &Sky<'_>,
    t_s: f64,
    before: &EarthFixed,
    after: &EarthFixed,
) -> (Place, bool) {
    let h = SUMMIT_OFFSET_S;
    let mean = |a: Vec3, b: Vec3| -> Vec3 { std::array::from_fn(|k| 0.5 * (a[k] + b[k])) };
    let mut middle = EarthFixed {
        r_ecef_km: mean(before.r_ecef_km, after.r_ecef_km),
        v_ecef_km_s: mean(before.v_ecef_km_s, after.v_ecef_km_s),
    };
    let a = acceleration_ecef_km_s2(&middle);
    let radius = norm(middle.r_ecef_km);
    // The jerk of two bodies: what a mean over two seconds leaves out.
    let jerk = SGP4_MU_KM3_S2 / (radius * radius * radius);
    let v = middle.v_ecef_km_s;
    let chord = scale(sub(after.r_ecef_km, before.r_ecef_km), 0.5 / h);
    let by_position: Vec3 = std::array::from_fn(|k| chord[k] + h * h / 6.0 * jerk * v[k]);
    for k in 0..3 {
        middle.r_ecef_km[k] -= 0.5 * h * h * a[k];
        middle.v_ecef_km_s[k] += 0.5 * h * h * jerk * v[k];
    }
    let sight = sky.sight(middle.r_ecef_km, by_position, a);
    let dt = -sight.climb / sight.climb1;
    let settled = dt.abs() < SUMMIT_STEP / jerk.sqrt() && sight.climb1 < 0.0;
    let dt = if dt.is_finite() { dt.clamp(-300.0, 300.0) } else { 0.0 };
    (moved(&Place { t_s, state: middle }, dt, by_position), settled)
}

/// The turning point of the elevation (summit or valley) near a guess, by true states alone.
pub(super) fn summit(
    sky: &Sky<'_>,
    motion: &mut Motion<'_>,
    guess_s: f64,
) -> Result<Place, PropagationError> {
    let mut t_s = guess_s;
    for _ in 0..3 {
        let place = step_from_pair(sky, motion, t_s)?;
        if (place.t_s - t_s).abs() < 0.05 {
            return Ok(place);
        }
        t_s = place.t_s;
    }
    step_from_pair(sky, motion, t_s)
}

fn step_from_pair(sky: &Sky<'_>, motion: &mut Motion<'_>, t_s: f64) -> Result<Place, PropagationError> {
    let (before, after) = (motion.at(t_s - SUMMIT_OFFSET_S)?, motion.at(t_s + SUMMIT_OFFSET_S)?);
    Ok(step_to_summit(sky, t_s, &before, &after).0)
}

/// The sine of the elevation, as a measure to compare heights.
pub(super) fn sine_elevation(sky: &Sky<'_>, r: Vec3) -> f64 {
    let d = sub(r, sky.axes.r_ecef_km);
    dot(d, sky.axes.up) / norm(d).max(1e-9)
}
