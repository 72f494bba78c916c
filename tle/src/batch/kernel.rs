//! SGP4 in lanes, one object or instant per lane, without branches: near-earth's secular terms, and the way from mean
//! elements to position and velocity that deep space shares.

use fearless_simd::{Simd, prelude::*};

use super::coefficients::{Coefficients, J2, KE};
use super::kepler;
use super::trig::{sin_cos, turned_little};
use crate::propagator::{LONGEST_SPAN_MIN, SGP4_EARTH_RADIUS_KM};

/// Up to this mean eccentricity two short Newton steps solve Kepler's equation to the last bit; drag lets it grow before
/// the epoch.
const ROUND_NOW_BOUND: f64 = 0.03;
/// Up to this the general solution is sure to be reached.
const ECCENTRICITY_NOW_BOUND: f64 = 0.98;
/// Semi-latus rectum below which the short-period terms are no longer small angles, Earth radii.
const SMALLEST_LATUS: f64 = 0.5;

/// Mean elements at one instant, with secular, resonant, lunar and solar terms; units as in [`Coefficients`].
pub(super) struct Mean<S: Simd> {
    /// Eccentricity as the secular terms give it, before its lower bound.
    pub(super) e_secular: S::f64s,
    pub(super) e: S::f64s,
    pub(super) a: S::f64s,
    pub(super) argp: S::f64s,
    pub(super) anomaly: S::f64s,
    pub(super) sin_cos_node: (S::f64s, S::f64s),
    pub(super) sini: S::f64s,
    pub(super) cosi: S::f64s,
    pub(super) aycof: S::f64s,
    pub(super) xlcof: S::f64s,
    pub(super) con41: S::f64s,
    pub(super) x1mth2: S::f64s,
    pub(super) x7thm1: S::f64s,
}

/// Position (km) and velocity (km/s) in TEME of near-earth orbits after `t` minutes: x, y, z, vx, vy, vz; all NaN where
/// the theory has no answer or the formulas would not hold.
#[inline(always)]
pub(super) fn propagate<S: Simd, const ROUND: bool>(
    simd: S,
    c: &Coefficients<S::f64s>,
    t: S::f64s,
) -> [S::f64s; 6] {
    let all = |value: f64| S::f64s::splat(simd, value);
    let one = all(1.0);

    // Secular terms of gravity and drag.
    let xmdf = c.mdot.mul_add(t, c.mo);
    let (_, cos_xmdf) = sin_cos(simd, xmdf);
    let swing = c.eta.mul_add(cos_xmdf, one);
    let drift = c.xmcof.mul_add(swing * swing * swing - c.delmo, c.omgcof * t);
    let mp = xmdf + drift;
    let (sin_mp, _) = sin_cos(simd, mp);
    let t2 = t * t;
    let node = c.nodecf.mul_add(t2, c.nodedot.mul_add(t, c.nodeo));
    let templ = t2 * t.mul_add(t.mul_add(t.mul_add(c.t5cof, c.t4cof), c.t3cof), c.t2cof);
    let tempa = one - t * t.mul_add(t.mul_add(t.mul_add(c.d4, c.d3), c.d2), c.cc1);
    let em = c.ecco - c.cc4.mul_add(t, c.cc5 * (sin_mp - c.sinmao));
    let mean = Mean {
        e_secular: em,
        e: em.max(all(1.0e-6)),
        a: c.ao * tempa * tempa,
        argp: c.argpdot.mul_add(t, c.argpo) - drift,
        anomaly: c.no.mul_add(templ, mp),
        sin_cos_node: sin_cos(simd, node),
        sini: c.sinio,
        cosi: c.cosio,
        aycof: c.aycof,
        xlcof: c.xlcof,
        con41: c.con41,
        x1mth2: c.x1mth2,
        x7thm1: c.x7thm1,
    };
    osculating::<S, ROUND>(simd, &mean, t)
}

/// Long-period and short-period terms: from mean elements to position and velocity.
///
/// Follows `sgp4()` of AIAA 2006-6753 with two liberties that change nothing beyond rounding. Kepler's equation is
/// solved for the difference of eccentric and mean argument. And the short-period corrections turn known sines and
/// cosines by small angles instead of going through an arc tangent.
#[inline(always)]
pub(super) fn osculating<S: Simd, const ROUND: bool>(simd: S, m: &Mean<S>, t: S::f64s) -> [S::f64s; 6] {
    let all = |value: f64| S::f64s::splat(simd, value);
    let one = all(1.0);
    let (e, a) = (m.e, m.a);

    // Long-period terms.
    let (sin_argp, cos_argp) = sin_cos(simd, m.argp);
    let temp = one / (a * (one - e * e));
    let axn = e * cos_argp;
    let ayn = e.mul_add(sin_argp, temp * m.aycof);
    let u = (temp * m.xlcof).mul_add(axn, m.anomaly + m.argp);
    let (sin_u, cos_u) = sin_cos(simd, u);

    // Kepler's equation for d = (E + w) - u: d = p cos d + q sin d.
    let p = axn * sin_u - ayn * cos_u;
    let q = axn * cos_u + ayn * sin_u;
    let (sin_d, cos_d) = if ROUND { kepler::round(simd, p, q) } else { kepler::eccentric(simd, p, q) };
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
    let mrt = r.mul_add(one - temp2 * betal * m.con41 * 1.5, temp1 * m.x1mth2 * cos2u * 0.5);
    let (sin_su, cos_su) = turned_little(simd, (su, cu), temp2 * m.x7thm1 * sin2u * -0.25);
    let temp2_cosi = temp2 * m.cosi * 1.5;
    let (sin_node, cos_node) = turned_little(simd, m.sin_cos_node, temp2_cosi * sin2u);
    let (sin_i, cos_i) = turned_little(simd, (m.sini, m.cosi), temp2_cosi * m.sini * cos2u);
    let n_by_ke = one / (a * sqrt_a);
    let mvt = rdot - n_by_ke * temp1 * m.x1mth2 * sin2u;
    let rvdot = (n_by_ke * temp1).mul_add(m.x1mth2.mul_add(cos2u, m.con41 * 1.5), rvdot);

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

    let bound = if ROUND { ROUND_NOW_BOUND } else { ECCENTRICITY_NOW_BOUND };
    let mut holds = m.e_secular.simd_ge(all(-0.001))
        & e.simd_lt(all(bound))
        & mrt.simd_ge(one)
        & t.simd_le(all(LONGEST_SPAN_MIN))
        & t.simd_ge(all(-LONGEST_SPAN_MIN));
    if !ROUND {
        holds = holds & e.simd_ge(all(0.0)) & el2.simd_lt(one) & pl.simd_ge(all(SMALLEST_LATUS));
    }
    let km = holds.select(mrt * SGP4_EARTH_RADIUS_KM, all(f64::NAN));
    let km_s = holds.select(all(SGP4_EARTH_RADIUS_KM * KE / 60.0), all(f64::NAN));
    let velocity = |axis: usize| mvt.mul_add(u_xyz[axis], rvdot * v_xyz[axis]) * km_s;
    [km * u_xyz[0], km * u_xyz[1], km * u_xyz[2], velocity(0), velocity(1), velocity(2)]
}
