//! Orbits in step with the Earth's turning: once a day, or twice a day and eccentric. The Earth's unevenness then works on
//! the mean motion, and its effect is summed in steps of half a day from the epoch on.
//!
//! Spacetrack Report No. 3 and AIAA 2006-6753, `dsinit` and `dspace`.

use super::coefficients::{Coefficients, KE};
use super::third_body::Drift;

/// The Earth's turning, rad/min.
const EARTH_RATE: f64 = 4.375_269_088_011_3e-3;
/// A step of the sum, minutes.
const STEP_MIN: f64 = 720.0;

/// A term of the resonance: sin(argp times perigee + longitude times lambda - phase).
#[derive(Debug, Clone, Copy)]
struct Term {
    strength: f64,
    perigee: f64,
    longitude: f64,
    phase: f64,
}

/// What the sum needs to know of the orbit.
#[derive(Debug, Clone)]
pub(super) struct Resonance {
    terms: Vec<Term>,
    argp: f64,
    argp_rate: f64,
    lambda_rate: f64,
    start: (f64, f64),
    /// The mean anomaly is the longitude less so many nodes and arguments of perigee, plus so many sidereal times.
    pub(super) nodes: f64,
    pub(super) perigees: f64,
    /// Sidereal time at the epoch, rad.
    sidereal_rad: f64,
}

/// The sum at a whole number of steps from the epoch; between two of them it goes on as a parabola.
#[derive(Debug, Clone, Copy)]
pub(super) struct Anchor {
    /// Minutes since the epoch.
    pub(super) minutes: f64,
    /// Mean motion, its first two derivatives; rad/min.
    pub(super) n: f64,
    pub(super) n1: f64,
    pub(super) n2: f64,
    /// Semi-major axis by that mean motion, Earth radii.
    pub(super) a: f64,
    /// Longitude and its derivative, rad.
    pub(super) lambda: f64,
    pub(super) lambda1: f64,
}

/// The anchors reached so far, after the epoch and before it.
#[derive(Debug, Clone, Default)]
pub struct Anchors([Vec<Anchor>; 2]);

impl Resonance {
    /// `None` for an orbit without resonance. Sidereal time at the epoch in rad.
    pub(super) fn new(orbit: &Coefficients<f64>, drift: &Drift, sidereal_rad: f64) -> Option<Self> {
        let (n, a, e) = (orbit.no, orbit.ao, orbit.ecco);
        let once = n > 0.003_490_658_5 && n < 0.005_235_987_7;
        let twice = (8.26e-3..=9.24e-3).contains(&n) && e >= 0.5;
        if once {
            let from = orbit.mo + orbit.nodeo + orbit.argpo - sidereal_rad;
            return Some(Self {
                terms: once_a_day(orbit),
                argp: 0.0,
                argp_rate: 0.0,
                lambda_rate: orbit.mdot + orbit.argpdot + orbit.nodedot - EARTH_RATE
                    + drift.anomaly
                    + drift.argp
                    + drift.node
                    - n,
                start: (n, from % std::f64::consts::TAU),
                nodes: 1.0,
                perigees: 1.0,
                sidereal_rad,
            });
        }
        twice.then(|| {
            let from = orbit.mo + 2.0 * (orbit.nodeo - sidereal_rad);
            Self {
                terms: twice_a_day(orbit, 3.0 * n * n / (a * a)),
                argp: orbit.argpo,
                argp_rate: orbit.argpdot,
                lambda_rate: orbit.mdot + drift.anomaly + 2.0 * (orbit.nodedot + drift.node - EARTH_RATE) - n,
                start: (n, from % std::f64::consts::TAU),
                nodes: 2.0,
                perigees: 0.0,
                sidereal_rad,
            }
        })
    }

    /// Sidereal time at the epoch (rad) and its rate (rad/min).
    pub(super) const fn sidereal(&self) -> (f64, f64) {
        (self.sidereal_rad, EARTH_RATE)
    }

    /// The last anchor between the epoch and this time, at most `longest_min` from the epoch.
    pub(super) fn anchor<'a>(&self, anchors: &'a mut Anchors, minutes: f64, longest_min: f64) -> &'a Anchor {
        let (side, step) = if minutes > 0.0 { (0, STEP_MIN) } else { (1, -STEP_MIN) };
        let index = (minutes.abs().min(longest_min) / STEP_MIN) as usize;
        let anchors = &mut anchors.0[side];
        if anchors.is_empty() {
            anchors.push(self.stand(0.0, self.start.0, self.start.1));
        }
        while anchors.len() <= index {
            let last = anchors[anchors.len() - 1];
            let n = last.n + last.n1 * step + last.n2 * (STEP_MIN * STEP_MIN / 2.0);
            let lambda = last.lambda + last.lambda1 * step + last.n1 * (STEP_MIN * STEP_MIN / 2.0);
            anchors.push(self.stand(last.minutes + step, n, lambda));
        }
        &anchors[index]
    }

    fn stand(&self, minutes: f64, n: f64, lambda: f64) -> Anchor {
        let argp = self.argp + self.argp_rate * minutes;
        let lambda1 = n + self.lambda_rate;
        let (mut n1, mut n2) = (0.0, 0.0);
        for term in &self.terms {
            let (sin, cos) = (term.perigee * argp + term.longitude * lambda - term.phase).sin_cos();
            n1 += term.strength * sin;
            n2 += term.strength * term.longitude * cos;
        }
        Anchor { minutes, n, n1, n2: n2 * lambda1, a: (KE / n).powf(2.0 / 3.0), lambda, lambda1 }
    }
}

fn once_a_day(orbit: &Coefficients<f64>) -> Vec<Term> {
    let (e2, cos_i, a) = (orbit.ecco * orbit.ecco, orbit.cosio, orbit.ao);
    let scale = 3.0 * (orbit.no / a).powi(2);
    let f311 = 0.9375 * orbit.sinio * orbit.sinio * (1.0 + 3.0 * cos_i) - 0.75 * (1.0 + cos_i);
    let f220 = 0.75 * (1.0 + cos_i).powi(2);
    let f330 = 1.875 * (1.0 + cos_i).powi(3);
    let g310 = 1.0 + 2.0 * e2;
    let g200 = 1.0 + e2 * (-2.5 + 0.8125 * e2);
    let g300 = 1.0 + e2 * (-6.0 + 6.609_37 * e2);
    let term = |strength: f64, longitude: f64, place: f64| Term {
        strength: scale * strength,
        perigee: 0.0,
        longitude,
        phase: longitude * place,
    };
    vec![
        term(f311 * g310 * 2.146_074_8e-6 / a, 1.0, 0.131_309_08),
        term(2.0 * f220 * g200 * 1.789_167_9e-6, 2.0, 2.884_319_8),
        term(3.0 * f330 * g300 * 2.212_301_5e-7 / a, 3.0, 0.374_480_87),
    ]
}

/// A cubic in the eccentricity, by ascending powers.
fn cubic(e: f64, c: [f64; 4]) -> f64 {
    c[0] + e * (c[1] + e * (c[2] + e * c[3]))
}

fn twice_a_day(orbit: &Coefficients<f64>, scale2: f64) -> Vec<Term> {
    let (e, sin_i, cos_i, a) = (orbit.ecco, orbit.sinio, orbit.cosio, orbit.ao);
    let (sin2, cos2) = (sin_i * sin_i, cos_i * cos_i);
    let (scale3, scale4, scale5) = (scale2 / a, scale2 / (a * a), scale2 / (a * a * a));

    let by = |bound: bool, low: [f64; 4], high: [f64; 4]| cubic(e, if bound { low } else { high });
    let low = e <= 0.65;
    let g201 = -0.306 - (e - 0.64) * 0.44;
    let g211 = by(low, [3.616, -13.247, 16.29, 0.0], [-72.099, 331.819, -508.738, 266.724]);
    let g310 = by(low, [-19.302, 117.39, -228.419, 156.591], [-346.844, 1582.851, -2415.925, 1246.113]);
    let g322 = by(low, [-18.9068, 109.7927, -214.6334, 146.5816], [-342.585, 1554.908, -2366.899, 1215.972]);
    let g410 = by(low, [-41.122, 242.694, -471.094, 313.953], [-1052.797, 4758.686, -7193.992, 3651.957]);
    let g422 = by(low, [-146.407, 841.88, -1629.014, 1083.435], [-3581.69, 16178.11, -24462.77, 12422.52]);
    let g520 = if e > 0.65 && e < 0.715 {
        cubic(e, [1464.74, -4664.75, 3763.64, 0.0])
    } else {
        by(low, [-532.114, 3017.977, -5740.032, 3708.276], [-5149.66, 29936.92, -54087.36, 31324.56])
    };
    let low = e < 0.7;
    let g532 =
        by(low, [-853.666, 4690.25, -8624.77, 5341.4], [-40023.88, 170_470.89, -242_699.48, 115_605.82]);
    let g521 = by(
        low,
        [-822.710_72, 4568.6173, -8491.4146, 5337.524],
        [-51752.104, 218_913.95, -309_468.16, 146_349.42],
    );
    let g533 =
        by(low, [-919.2277, 4988.61, -9064.77, 5542.21], [-37995.78, 161_616.52, -229_838.2, 109_377.94]);

    let f220 = 0.75 * (1.0 + 2.0 * cos_i + cos2);
    let f221 = 1.5 * sin2;
    let f321 = 1.875 * sin_i * (1.0 - 2.0 * cos_i - 3.0 * cos2);
    let f322 = -1.875 * sin_i * (1.0 + 2.0 * cos_i - 3.0 * cos2);
    let f441 = 35.0 * sin2 * f220;
    let f442 = 39.375 * sin2 * sin2;
    let f522 = 9.843_75
        * sin_i
        * (sin2 * (1.0 - 2.0 * cos_i - 5.0 * cos2) + 0.333_333_33 * (-2.0 + 4.0 * cos_i + 6.0 * cos2));
    let f523 = sin_i
        * (4.921_875_12 * sin2 * (-2.0 - 4.0 * cos_i + 10.0 * cos2)
            + 6.562_500_12 * (1.0 + 2.0 * cos_i - 3.0 * cos2));
    let f542 = 29.531_25 * sin_i * (2.0 - 8.0 * cos_i + cos2 * (-12.0 + 8.0 * cos_i + 10.0 * cos2));
    let f543 = 29.531_25 * sin_i * (-2.0 - 8.0 * cos_i + cos2 * (12.0 + 8.0 * cos_i - 10.0 * cos2));

    let root22 = scale2 * 1.789_167_9e-6;
    let root32 = scale3 * 3.739_379_2e-7;
    let root44 = 2.0 * scale4 * 7.363_695_3e-9;
    let root52 = scale5 * 1.142_863_9e-7;
    let root54 = 2.0 * scale5 * 2.176_580_3e-9;
    let (g22, g32, g44, g52, g54) = (5.768_639_6, 0.952_408_98, 1.801_499_8, 1.050_833_0, 4.410_889_8);
    let term = |strength, perigee, longitude, phase| Term { strength, perigee, longitude, phase };
    vec![
        term(root22 * f220 * g201, 2.0, 1.0, g22),
        term(root22 * f221 * g211, 0.0, 1.0, g22),
        term(root32 * f321 * g310, 1.0, 1.0, g32),
        term(root32 * f322 * g322, -1.0, 1.0, g32),
        term(root44 * f441 * g410, 2.0, 2.0, g44),
        term(root44 * f442 * g422, 0.0, 2.0, g44),
        term(root52 * f522 * g520, 1.0, 1.0, g52),
        term(root52 * f523 * g532, -1.0, 1.0, g52),
        term(root54 * f542 * g521, 1.0, 2.0, g54),
        term(root54 * f543 * g533, -1.0, 2.0, g54),
    ]
}
