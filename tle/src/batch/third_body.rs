//! What Sun and Moon do to a far orbit: slow drifts of its elements, and sways that follow the place of each.
//!
//! Spacetrack Report No. 3 (Hujsak's deep-space equations) and AIAA 2006-6753, `dscom`, `dsinit` and `dpper`.

use fearless_simd::{Simd, prelude::*};

use super::coefficients::Coefficients;
use super::trig::sin_cos;

/// Days from the theory's origin (1900, January 0.5) to J2000, as the theory has them.
const ORIGIN_TO_J2000_DAYS: f64 = 36_525.0;
/// The node does not drift where it is hardly there: this near to the equator, rad.
const FLAT_RAD: f64 = 5.235_987_7e-2;

/// Of a body on its way about the Earth: how fast (rad/min), how round, how strong (rad/min), and where, as sines and
/// cosines of its perigee's argument, its inclination, and of the object's node less its own.
struct Body {
    rate: f64,
    eccentricity: f64,
    strength: f64,
    anomaly: f64,
    sin_cos_argp: (f64, f64),
    sin_cos_incl: (f64, f64),
    sin_cos_node: (f64, f64),
}

/// Drifts of the elements, rad/min.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Drift {
    pub(super) e: f64,
    pub(super) inclination: f64,
    pub(super) anomaly: f64,
    pub(super) argp: f64,
    pub(super) node: f64,
}

/// The sway by one body: for each of eccentricity, inclination, mean anomaly, argument of perigee and node (the last two
/// before they are divided by the sine of the inclination), what goes by sin^2 f / 2 - 1/4, by -sin f cos f / 2, and by sin f.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sway {
    rate: f64,
    eccentricity: f64,
    anomaly: f64,
    terms: [[f64; 3]; 5],
}

impl Sway {
    /// The sway after `t` minutes.
    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, simd: S, t: S::f64s) -> [S::f64s; 5] {
        let all = |value: f64| S::f64s::splat(simd, value);
        let anomaly = t.mul_add(all(self.rate), all(self.anomaly));
        let (sin_anomaly, _) = sin_cos(simd, anomaly);
        let (sin_f, cos_f) = sin_cos(simd, sin_anomaly.mul_add(all(2.0 * self.eccentricity), anomaly));
        let f2 = (sin_f * sin_f).mul_add(all(0.5), all(-0.25));
        let f3 = sin_f * cos_f * -0.5;
        let [e, inclination, anomaly, argp, node] = &self.terms;
        [
            f2.mul_add(all(e[0]), f3 * e[1]),
            f2.mul_add(all(inclination[0]), f3 * inclination[1]),
            f2.mul_add(all(anomaly[0]), f3.mul_add(all(anomaly[1]), sin_f * anomaly[2])),
            f2.mul_add(all(argp[0]), f3.mul_add(all(argp[1]), sin_f * argp[2])),
            f2.mul_add(all(node[0]), f3 * node[1]),
        ]
    }
}

/// Sways by Sun and Moon, and the drift by both together. The epoch is in days since J2000 as the theory counts them.
pub(super) fn sun_and_moon(orbit: &Coefficients<f64>, epoch_days: f64) -> ([Sway; 2], Drift) {
    let days = epoch_days + ORIGIN_TO_J2000_DAYS;
    let (sin_node, cos_node) = orbit.nodeo.sin_cos();
    let sun = Body {
        rate: 1.194_59e-5,
        eccentricity: 0.016_75,
        strength: 2.986_479_7e-6,
        anomaly: (6.256_583_7 + 0.017_201_977 * days) % std::f64::consts::TAU,
        sin_cos_argp: (-0.980_884_58, 0.194_590_5),
        sin_cos_incl: (0.397_854_16, 0.917_448_67),
        sin_cos_node: (sin_node, cos_node),
    };

    // The Moon's orbit from the ecliptic to the equator.
    let ecliptic_node = (4.523_602_0 - 9.242_202_9e-4 * days) % std::f64::consts::TAU;
    let (sin_ecliptic, cos_ecliptic) = ecliptic_node.sin_cos();
    let cos_incl = 0.913_751_64 - 0.035_680_96 * cos_ecliptic;
    let sin_incl = (1.0 - cos_incl * cos_incl).sqrt();
    let sin_moon_node = 0.089_683_511 * sin_ecliptic / sin_incl;
    let cos_moon_node = (1.0 - sin_moon_node * sin_moon_node).sqrt();
    let lag = (0.397_854_16 * sin_ecliptic / sin_incl)
        .atan2(cos_moon_node * cos_ecliptic + 0.917_448_67 * sin_moon_node * sin_ecliptic);
    let argp = 5.835_151_4 + 0.001_944_368_0 * days + lag - ecliptic_node;
    let moon = Body {
        rate: 1.583_521_8e-4,
        eccentricity: 0.054_90,
        strength: 4.796_806_5e-7,
        anomaly: (-1.115_184_2 + 0.228_027_132 * days) % std::f64::consts::TAU,
        sin_cos_argp: argp.sin_cos(),
        sin_cos_incl: (sin_incl, cos_incl),
        sin_cos_node: (
            sin_node * cos_moon_node - cos_node * sin_moon_node,
            cos_moon_node * cos_node + sin_moon_node * sin_node,
        ),
    };

    let (by_sun, drift_s) = effects(orbit, &sun);
    let (by_moon, drift_m) = effects(orbit, &moon);
    let drift = Drift {
        e: drift_s.e + drift_m.e,
        inclination: drift_s.inclination + drift_m.inclination,
        anomaly: drift_s.anomaly + drift_m.anomaly,
        argp: drift_s.argp + drift_m.argp,
        node: drift_s.node + drift_m.node,
    };
    ([by_sun, by_moon], drift)
}

/// `dscom` for one body; letters as there.
fn effects(orbit: &Coefficients<f64>, body: &Body) -> (Sway, Drift) {
    let (e, e2) = (orbit.ecco, orbit.ecco * orbit.ecco);
    let (sin_i, cos_i) = (orbit.sinio, orbit.cosio);
    let (sin_w, cos_w) = orbit.argpo.sin_cos();
    let ((sin_g, cos_g), (sin_b, cos_b), (sin_h, cos_h)) =
        (body.sin_cos_argp, body.sin_cos_incl, body.sin_cos_node);

    let a1 = cos_g * cos_h + sin_g * cos_b * sin_h;
    let a3 = -sin_g * cos_h + cos_g * cos_b * sin_h;
    let a7 = -cos_g * sin_h + sin_g * cos_b * cos_h;
    let a8 = sin_g * sin_b;
    let a9 = sin_g * sin_h + cos_g * cos_b * cos_h;
    let a10 = cos_g * sin_b;
    let a2 = cos_i * a7 + sin_i * a8;
    let a4 = cos_i * a9 + sin_i * a10;
    let a5 = -sin_i * a7 + cos_i * a8;
    let a6 = -sin_i * a9 + cos_i * a10;

    let x1 = a1 * cos_w + a2 * sin_w;
    let x2 = a3 * cos_w + a4 * sin_w;
    let x3 = -a1 * sin_w + a2 * cos_w;
    let x4 = -a3 * sin_w + a4 * cos_w;
    let (x5, x6, x7, x8) = (a5 * sin_w, a6 * sin_w, a5 * cos_w, a6 * cos_w);

    let z31 = 12.0 * x1 * x1 - 3.0 * x3 * x3;
    let z32 = 24.0 * x1 * x2 - 6.0 * x3 * x4;
    let z33 = 12.0 * x2 * x2 - 3.0 * x4 * x4;
    let z11 = -6.0 * a1 * a5 + e2 * (-24.0 * x1 * x7 - 6.0 * x3 * x5);
    let z12 = -6.0 * (a1 * a6 + a3 * a5) + e2 * (-24.0 * (x2 * x7 + x1 * x8) - 6.0 * (x3 * x6 + x4 * x5));
    let z13 = -6.0 * a3 * a6 + e2 * (-24.0 * x2 * x8 - 6.0 * x4 * x6);
    let z21 = 6.0 * a2 * a5 + e2 * (24.0 * x1 * x5 - 6.0 * x3 * x7);
    let z22 = 6.0 * (a4 * a5 + a2 * a6) + e2 * (24.0 * (x2 * x5 + x1 * x6) - 6.0 * (x4 * x7 + x3 * x8));
    let z23 = 6.0 * a4 * a6 + e2 * (24.0 * x2 * x6 - 6.0 * x4 * x8);
    let z1 = 2.0 * (3.0 * (a1 * a1 + a2 * a2) + z31 * e2) + (1.0 - e2) * z31;
    let z2 = 2.0 * (6.0 * (a1 * a3 + a2 * a4) + z32 * e2) + (1.0 - e2) * z32;
    let z3 = 2.0 * (3.0 * (a3 * a3 + a4 * a4) + z33 * e2) + (1.0 - e2) * z33;

    let root = (1.0 - e2).sqrt();
    let s3 = body.strength / orbit.no;
    let s2 = -0.5 * s3 / root;
    let s4 = s3 * root;
    let s1 = -15.0 * e * s4;
    let terms = [
        [2.0 * s1 * (x2 * x3 + x1 * x4), 2.0 * s1 * (x2 * x4 - x1 * x3), 0.0],
        [2.0 * s2 * z12, 2.0 * s2 * (z13 - z11), 0.0],
        [-2.0 * s3 * z2, -2.0 * s3 * (z3 - z1), 2.0 * s3 * (21.0 + 9.0 * e2) * body.eccentricity],
        [2.0 * s4 * z32, 2.0 * s4 * (z33 - z31), -18.0 * s4 * body.eccentricity],
        [-2.0 * s2 * z22, -2.0 * s2 * (z23 - z21), 0.0],
    ];

    let inclination = sin_i.atan2(cos_i);
    let is_flat = !(FLAT_RAD..=std::f64::consts::PI - FLAT_RAD).contains(&inclination);
    let node = if is_flat { 0.0 } else { -body.rate * s2 * (z21 + z23) / sin_i };
    let drift = Drift {
        e: s1 * body.rate * (x1 * x3 + x2 * x4),
        inclination: s2 * body.rate * (z11 + z13),
        anomaly: -body.rate * s3 * (z1 + z3 - 14.0 - 6.0 * e2),
        argp: s4 * body.rate * (z31 + z33 - 6.0) - cos_i * node,
        node,
    };
    let sway = Sway { rate: body.rate, eccentricity: body.eccentricity, anomaly: body.anomaly, terms };
    (sway, drift)
}
