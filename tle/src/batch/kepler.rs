//! Kepler's equation in lanes, for the difference of eccentric and mean argument: d = p cos d + q sin d, where
//! (p, q) = e (sin M, cos M). Gives sine and cosine of d.

use fearless_simd::{Simd, prelude::*};

use super::trig::{small_sin_cos, within_half_turn};

/// Steps that the general solution may take; from its first guess three do up to an eccentricity of 0.7.
const STEPS_MAX: usize = 8;
/// A step this short was the last: the next would be about its cube, times e / (1 - e).
const LAST_STEP: f64 = 2e-6;

/// A first guess and two Newton steps on short series: exact to 1e-16 below an eccentricity of 0.03.
#[inline(always)]
pub(super) fn round<S: Simd>(simd: S, p: S::f64s, q: S::f64s) -> (S::f64s, S::f64s) {
    let one = S::f64s::splat(simd, 1.0);
    let mut d = p * (one + q.mul_add(q, q));
    for _ in 0..2 {
        let (sin_d, cos_d) = small_sin_cos(simd, d);
        let error = d - p.mul_add(cos_d, q * sin_d);
        let slope = p.mul_add(sin_d, one - q * cos_d);
        d -= error / slope;
    }
    small_sin_cos(simd, d)
}

/// Halley's steps until the slowest lane has arrived; NaN in a lane that has not.
#[inline(always)]
pub(super) fn eccentric<S: Simd>(simd: S, p: S::f64s, q: S::f64s) -> (S::f64s, S::f64s) {
    let all = |value: f64| S::f64s::splat(simd, value);
    let one = all(1.0);
    // The sine rule in the triangle of focus, centre and the place on the circle at the mean anomaly.
    let mut d = p / (p.mul_add(p, q.mul_add(q, one)) - (q + q)).max(all(1e-12)).sqrt();
    let mut arrived = d.abs().simd_lt(all(-1.0));
    for _ in 0..STEPS_MAX {
        // |d| never exceeds the eccentricity.
        d = d.max(all(-1.0)).min(one);
        let (sin_d, cos_d) = within_half_turn(simd, d);
        let bend = p.mul_add(cos_d, q * sin_d);
        let error = d - bend;
        let slope = p.mul_add(sin_d, one - q * cos_d);
        let step = error * slope / (slope * slope - error * bend * 0.5);
        d -= step;
        arrived = step.abs().simd_lt(all(LAST_STEP));
        if arrived.all_true() {
            break;
        }
    }
    within_half_turn(simd, arrived.select(d, all(f64::NAN)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    #[inline(always)]
    fn worst<S: Simd>(simd: S) -> f64 {
        let mut worst = 0.0f64;
        for e in [0.0, 1e-6, 0.02, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.979] {
            for k in -1000..=1000 {
                // Close together at the perigee, where the equation is hardest.
                let eccentric = (f64::from(k) / 1000.0).powi(3) * std::f64::consts::PI;
                let mean = eccentric - e * eccentric.sin();
                let all = |value: f64| S::f64s::splat(simd, value);
                let (sin, cos) = super::eccentric(simd, all(e * mean.sin()), all(e * mean.cos()));
                let found = sin[0].atan2(cos[0]);
                // What rounding of the mean anomaly costs is not the solver's.
                let slope = 1.0 - e * eccentric.cos();
                worst = worst.max((found - (eccentric - mean)).abs() * slope);
            }
        }
        worst
    }

    #[test]
    fn every_eccentricity_is_solved_to_the_last_digits() {
        for level in [Level::new(), Level::baseline()] {
            let worst = dispatch!(level, simd => worst(simd));
            assert!(worst < 1e-15, "{level:?} {worst:e}");
        }
    }
}
