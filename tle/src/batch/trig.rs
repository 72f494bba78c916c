//! Sine and cosine in lanes.

use std::f64::consts::FRAC_1_PI;

use fearless_simd::{Simd, prelude::*};

/// Pi in three parts. The first has 33 bits, so that its product with a whole number below 2^20 is exact even where the
/// machine has no fused multiply-add (the split is that of fdlibm, doubled).
const PI_1: f64 = 2.0 * 1.570_796_326_734_125_6;
const PI_2: f64 = 2.0 * 6.077_100_506_303_966e-11;
const PI_3: f64 = 2.0 * 2.022_266_248_795_950_6e-21;

/// Inverse factorials, alternating: sin x = x + x^3 (S3 + x^2 (S5 + ...)).
const SIN: [f64; 10] = [
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 355_687_428_096_000.0,
    -1.0 / 121_645_100_408_832_000.0,
    1.0 / 51_090_942_171_709_440_000.0,
];
/// The same for the cosine: cos x = 1 + x^2 (C2 + x^2 (C4 + ...)).
const COS: [f64; 11] = [
    -1.0 / 2.0,
    1.0 / 24.0,
    -1.0 / 720.0,
    1.0 / 40_320.0,
    -1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 20_922_789_888_000.0,
    -1.0 / 6_402_373_705_728_000.0,
    1.0 / 2_432_902_008_176_640_000.0,
    -1.0 / 1_124_000_727_777_607_680_000.0,
];

/// Horner's scheme over coefficients in ascending order.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(simd: S, x: S::f64s, coefficients: [f64; N]) -> S::f64s {
    let mut sum = S::f64s::splat(simd, coefficients[N - 1]);
    for &coefficient in coefficients[..N - 1].iter().rev() {
        sum = sum.mul_add(x, S::f64s::splat(simd, coefficient));
    }
    sum
}

/// Sine and cosine of any angle below 3e6 rad in size, to about 2e-16. Above, or not a number: worthless, not harmful.
///
/// Reduced by whole multiples of pi rather than of pi/2: two more terms of each series, and no lane has to swap.
#[inline(always)]
pub(super) fn sin_cos<S: Simd>(simd: S, x: S::f64s) -> (S::f64s, S::f64s) {
    let turns = (x * FRAC_1_PI).round_ties_even();
    let r = turns.mul_add(S::f64s::splat(simd, -PI_1), x);
    let r = turns.mul_add(S::f64s::splat(simd, -PI_2), r);
    let r = turns.mul_add(S::f64s::splat(simd, -PI_3), r);
    let odd = (turns * 0.5).round_ties_even().mul_add(S::f64s::splat(simd, -2.0), turns);
    let sign = (odd * odd).mul_add(S::f64s::splat(simd, -2.0), S::f64s::splat(simd, 1.0));
    let (sin, cos) = within_half_turn(simd, r);
    (sin * sign, cos * sign)
}

/// Sine and cosine of an angle within pi/2.
#[inline(always)]
pub(super) fn within_half_turn<S: Simd>(simd: S, r: S::f64s) -> (S::f64s, S::f64s) {
    let r2 = r * r;
    let sin = (r2 * r).mul_add(polynomial(simd, r2, SIN), r);
    let cos = r2.mul_add(polynomial(simd, r2, COS), S::f64s::splat(simd, 1.0));
    (sin, cos)
}

/// Sine and cosine of an angle within 0.05 rad, to 1e-17.
#[inline(always)]
pub(super) fn small_sin_cos<S: Simd>(simd: S, r: S::f64s) -> (S::f64s, S::f64s) {
    let r2 = r * r;
    let sin = (r2 * r).mul_add(polynomial(simd, r2, [SIN[0], SIN[1], SIN[2]]), r);
    let cos = r2.mul_add(polynomial(simd, r2, [COS[0], COS[1], COS[2], COS[3]]), S::f64s::splat(simd, 1.0));
    (sin, cos)
}

/// The direction (sin, cos) turned on by a small angle within 0.01 rad, to 1e-17.
#[inline(always)]
pub(super) fn turned_little<S: Simd>(
    simd: S,
    (sin, cos): (S::f64s, S::f64s),
    by: S::f64s,
) -> (S::f64s, S::f64s) {
    let by2 = by * by;
    let sin_by = (by2 * by).mul_add(polynomial(simd, by2, [SIN[0], SIN[1]]), by);
    let cos_less_1 = by2 * polynomial(simd, by2, [COS[0], COS[1], COS[2]]);
    (cos.mul_add(sin_by, sin.mul_add(cos_less_1, sin)), (-sin).mul_add(sin_by, cos.mul_add(cos_less_1, cos)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    #[inline(always)]
    fn worst<S: Simd>(simd: S, xs: &[f64]) -> f64 {
        let mut worst = 0.0f64;
        for &x in xs {
            let (sin, cos) = sin_cos(simd, S::f64s::splat(simd, x));
            worst = worst.max((sin[0] - x.sin()).abs()).max((cos[0] - x.cos()).abs());
        }
        worst
    }

    #[test]
    fn lanes_agree_with_the_library_over_a_hundred_years_of_angle() {
        let xs: Vec<f64> = (-4000..=4000)
            .map(|k| f64::from(k) * 0.37)
            .chain((-4000..4000).map(|k| f64::from(k) * 701.123))
            .collect();
        for level in [Level::new(), Level::baseline()] {
            let worst = dispatch!(level, simd => worst(simd, &xs));
            assert!(worst < 5e-16, "{level:?} {worst:e}");
        }
    }
}
