//! SGP4's near-earth propagation, one object or instant per lane, without branches.

use fearless_simd::{Simd, prelude::*};

use super::coefficients::{Coefficients, J2, KE};
use super::trig::{sin_cos, small_sin_cos, turned_little};
use crate::propagator::{LONGEST_SPAN_MIN, SGP4_EARTH_RADIUS_KM};

/// Up to this mean eccentricity the two Newton steps below reach the last bit; drag lets it grow before the epoch.
const ECCENTRICITY_NOW_BOUND: f64 = 0.03;

/// Position (km) and velocity (km/s) in TEME after `t` minutes: x, y, z, vx, vy, vz; all NaN where the theory has no
/// answer or the formulas would not hold.
///
/// Follows `sgp4()` of AIAA 2006-6753 with two liberties that change nothing beyond rounding. Kepler's equation is
/// solved for the small difference of eccentric and mean argument, by a first guess and two Newton steps on short
/// series: exact to 1e-16 below an eccentricity of 0.03. And the short-period corrections turn known sines and cosines
/// by small angles instead of going through an arc tangent.
#[inline(always)]
pub(super) fn propagate<S: Simd>(simd: S, c: &Coefficients<S::f64s>, t: S::f64s) -> [S::f64s; 6] {
    let all = |value: f64| S::f64s::splat(simd, value);
    let one = all(1.0);

    // Secular terms of gravity and drag.
    let xmdf = c.mdot.mul_add(t, c.mo);
    let (_, cos_xmdf) = sin_cos(simd, xmdf);
    let swing = c.eta.mul_add(cos_xmdf, one);
    let drift = c.xmcof.mul_add(swing * swing * swing - c.delmo, c.omgcof * t);
    let argpm = c.argpdot.mul_add(t, c.argpo) - drift;
    let mp = xmdf + drift;
    let (sin_mp, _) = sin_cos(simd, mp);
    let t2 = t * t;
    let node = c.nodecf.mul_add(t2, c.nodedot.mul_add(t, c.nodeo));
    let templ = t2 * t.mul_add(t.mul_add(t.mul_add(c.t5cof, c.t4cof), c.t3cof), c.t2cof);
    let tempa = one - t * t.mul_add(t.mul_add(t.mul_add(c.d4, c.d3), c.d2), c.cc1);
    let em = c.ecco - c.cc4.mul_add(t, c.cc5 * (sin_mp - c.sinmao));
    let e = em.max(all(1.0e-6));
    let mm = c.no.mul_add(templ, mp);
    let a = c.ao * tempa * tempa;

    // Long-period terms.
    let (sin_argp, cos_argp) = sin_cos(simd, argpm);
    let temp = one / (a * (one - e * e));
    let axn = e * cos_argp;
    let ayn = e.mul_add(sin_argp, temp * c.aycof);
    let u = (temp * c.xlcof).mul_add(axn, mm + argpm);
    let (sin_u, cos_u) = sin_cos(simd, u);

    // Kepler's equation for d = (E + w) - u: d = p cos d + q sin d.
    let p = axn * sin_u - ayn * cos_u;
    let q = axn * cos_u + ayn * sin_u;
    let mut d = p * (one + q.mul_add(q, q));
    for _ in 0..2 {
        let (sin_d, cos_d) = small_sin_cos(simd, d);
        let error = d - p.mul_add(cos_d, q * sin_d);
        let slope = p.mul_add(sin_d, one - q * cos_d);
        d -= error / slope;
    }
    let (sin_d, cos_d) = small_sin_cos(simd, d);
    let (sin_eo, cos_eo) = (sin_u.mul_add(cos_d, cos_u * sin_d), cos_u.mul_add(cos_d, -(sin_u * sin_d)));

    // Short-period preliminaries.
    let ecose = axn.mul_add(cos_eo, ayn * sin_eo);
    let esine = axn.mul_add(sin_eo, -(ayn * cos_eo));
    let el2 = axn.mul_add(axn, ayn * ayn);
    let pl = a * (one - el2);
    let r = a * (one - ecose);
    let inverse_r = one / r;
    let inverse_pl = one / pl;
    let sqrt_a = a.sqrt();
    let rdot = sqrt_a * esine * inverse_r;
    let rvdot = pl.sqrt() * inverse_r;
    let betal = (one - el2).sqrt();
    let temp = esine / (one + betal);
    let a_by_r = a * inverse_r;
    let su = a_by_r * (sin_eo - ayn - axn * temp);
    let cu = a_by_r * (cos_eo - axn + ayn * temp);
    let sin2u = (cu + cu) * su;
    let cos2u = one - (su + su) * su;
    let temp1 = inverse_pl * (0.5 * J2);
    let temp2 = temp1 * inverse_pl;

    // Short-period terms.
    let mrt = r.mul_add(one - temp2 * betal * c.con41 * 1.5, temp1 * c.x1mth2 * cos2u * 0.5);
    let (sin_su, cos_su) = turned_little(simd, (su, cu), temp2 * c.x7thm1 * sin2u * -0.25);
    let temp2_cosi = temp2 * c.cosio * 1.5;
    let (sin_node, cos_node) = turned_little(simd, sin_cos(simd, node), temp2_cosi * sin2u);
    let (sin_i, cos_i) = turned_little(simd, (c.sinio, c.cosio), temp2_cosi * c.sinio * cos2u);
    let n_by_ke = one / (a * sqrt_a);
    let mvt = rdot - n_by_ke * temp1 * c.x1mth2 * sin2u;
    let rvdot = (n_by_ke * temp1).mul_add(c.x1mth2.mul_add(cos2u, c.con41 * 1.5), rvdot);

    // Orientation.
    let xmx = -(sin_node * cos_i);
    let xmy = cos_node * cos_i;
    let u_xyz =
        [xmx.mul_add(sin_su, cos_node * cos_su), xmy.mul_add(sin_su, sin_node * cos_su), sin_i * sin_su];
    let v_xyz = [
        xmx.mul_add(cos_su, -(cos_node * sin_su)),
        xmy.mul_add(cos_su, -(sin_node * sin_su)),
        sin_i * cos_su,
    ];

    let holds = em.simd_ge(all(-0.001))
        & em.simd_lt(all(ECCENTRICITY_NOW_BOUND))
        & mrt.simd_ge(one)
        & t.simd_le(all(LONGEST_SPAN_MIN))
        & t.simd_ge(all(-LONGEST_SPAN_MIN));
    let km = holds.select(mrt * SGP4_EARTH_RADIUS_KM, all(f64::NAN));
    let km_s = holds.select(all(SGP4_EARTH_RADIUS_KM * KE / 60.0), all(f64::NAN));
    let velocity = |axis: usize| mvt.mul_add(u_xyz[axis], rvdot * v_xyz[axis]) * km_s;
    [km * u_xyz[0], km * u_xyz[1], km * u_xyz[2], velocity(0), velocity(1), velocity(2)]
}
