//! A stretch of the motion between two grid points: a quintic through position, velocity and acceleration at both ends.
//!
//! The parameter is not the time but the eccentric anomaly: along it the motion is nearly a sum of sines, however
//! eccentric the orbit, and equal steps follow the local rate by themselves. On circular orbits the two are the same.

use crate::frames::EarthFixed;
use crate::gravity::acceleration_ecef_km_s2;
use crate::vector::Vec3;

/// A point of the grid: the true state there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    /// Seconds since the window began.
    pub(super) t_s: f64,
    /// Eccentric anomaly, counted on from revolution to revolution, rad.
    pub(super) anomaly: f64,
    pub(super) state: EarthFixed,
    pub(super) acceleration: Vec3,
    /// Direction in TEME: how far the object has swept since the last node, without the Earth's turning.
    pub(super) direction_teme: Vec3,
    pub(super) radius_km: f64,
}

impl Node {
    pub(super) fn new(t_s: f64, anomaly: f64, state: EarthFixed, r_teme_km: Vec3) -> Self {
        let radius_km = crate::vector::norm(r_teme_km);
        Self {
            t_s,
            anomaly,
            state,
            acceleration: acceleration_ecef_km_s2(&state),
            direction_teme: crate::vector::scale(r_teme_km, 1.0 / radius_km),
            radius_km,
        }
    }
}

/// How time runs along the eccentric anomaly: t = perigee + (E - e sin E) / rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    /// Eccentricity, 0 for orbits near enough to circular.
    pub(super) e: f64,
    /// Mean motion, rad/s.
    pub(super) rate: f64,
    /// When E = 0, seconds since the window began.
    pub(super) perigee_s: f64,
}

impl Clock {
    /// The time at an eccentric anomaly.
    pub(super) fn time_s(&self, anomaly: f64) -> f64 {
        let bend = if self.e == 0.0 { 0.0 } else { self.e * anomaly.sin() };
        self.perigee_s + (anomaly - bend) / self.rate
    }

    /// The eccentric anomaly at a time: Newton inside a bracket that always holds it.
    pub(super) fn anomaly(&self, t_s: f64) -> f64 {
        let mean = (t_s - self.perigee_s) * self.rate;
        if self.e == 0.0 {
            return mean;
        }
        let (mut low, mut high) = (mean - self.e, mean + self.e);
        let mut guess = mean + self.e * mean.sin();
        for _ in 0..60 {
            let (sin, cos) = guess.sin_cos();
            let error = guess - self.e * sin - mean;
            if error > 0.0 {
                high = guess;
            } else {
                low = guess;
            }
            let next = guess - error / (1.0 - self.e * cos);
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - guess).abs() < 1e-14 * (1.0 + mean.abs()) {
                return next;
            }
            guess = next;
        }
        guess
    }

    /// First and second derivative of the time by the piece's parameter, which runs through `span` of anomaly.
    fn rates(&self, anomaly: f64, span: f64) -> (f64, f64) {
        let (sin, cos) = if self.e == 0.0 { (0.0, 0.0) } else { anomaly.sin_cos() };
        (span * (1.0 - self.e * cos) / self.rate, span * span * self.e * sin / self.rate)
    }
}

/// Parts of a piece that all stations look at: of a round orbit's, and of another's.
const PARTS_ROUND: usize = 1;
const PARTS: usize = 2;

/// The motion between two nodes; the parameter p runs from 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// The motion at the ends of its parts, of which the last few may be missing.
    marks: [Motion2; PARTS + 1],
    parts: usize,
    coefficients: [Vec3; 6],
    clock: Clock,
    start_s: f64,
    start_anomaly: f64,
    start_sin: f64,
    span: f64,
}

/// Position and its first two derivatives by p.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion2 {
    pub(super) r: Vec3,
    pub(super) r1: Vec3,
    pub(super) r2: Vec3,
}

impl Piece {
    pub(super) fn new(clock: Clock, from: &Node, to: &Node, is_round: bool) -> Self {
        let span = to.anomaly - from.anomaly;
        let (rate0, bend0) = clock.rates(from.anomaly, span);
        let (rate1, bend1) = clock.rates(to.anomaly, span);
        let mut coefficients = [[0.0; 3]; 6];
        for axis in 0..3 {
            let (x0, x1) = (from.state.r_ecef_km[axis], to.state.r_ecef_km[axis]);
            let (v0, v1) = (from.state.v_ecef_km_s[axis], to.state.v_ecef_km_s[axis]);
            let (c1, end1) = (v0 * rate0, v1 * rate1);
            let c2 = 0.5 * (from.acceleration[axis] * rate0 * rate0 + v0 * bend0);
            let end2 = to.acceleration[axis] * rate1 * rate1 + v1 * bend1;
            let (d, d1, d2) = (x1 - x0 - c1 - c2, end1 - c1 - 2.0 * c2, end2 - 2.0 * c2);
            let column = [
                x0,
                c1,
                c2,
                10.0 * d - 4.0 * d1 + 0.5 * d2,
                -15.0 * d + 7.0 * d1 - d2,
                6.0 * d - 3.0 * d1 + 0.5 * d2,
            ];
            for (coefficient, value) in coefficients.iter_mut().zip(column) {
                coefficient[axis] = value;
            }
        }
        let start_sin = if clock.e == 0.0 { 0.0 } else { from.anomaly.sin() };
        let parts = if is_round { PARTS_ROUND } else { PARTS };
        let nowhere = Motion2 { r: [0.0; 3], r1: [0.0; 3], r2: [0.0; 3] };
        let mut piece = Self {
            marks: [nowhere; PARTS + 1],
            parts,
            coefficients,
            clock,
            start_s: from.t_s,
            start_anomaly: from.anomaly,
            start_sin,
            span,
        };
        for index in 0..=parts {
            piece.marks[index] = piece.motion(index as f64 / parts as f64);
        }
        piece
    }

    /// In how many parts to look at it.
    pub(super) const fn parts(&self) -> usize {
        self.parts
    }

    /// The motion at both ends of every part.
    pub(super) fn marks(&self) -> &[Motion2] {
        &self.marks[..=self.parts]
    }

    /// The time at p, seconds since the window began.
    pub(super) fn time_s(&self, p: f64) -> f64 {
        let swept = self.span * p;
        let bend = if self.clock.e == 0.0 {
            0.0
        } else {
            self.clock.e * ((self.start_anomaly + swept).sin() - self.start_sin)
        };
        self.start_s + (swept - bend) / self.clock.rate
    }

    /// Position at p.
    #[inline]
    pub(super) fn position(&self, p: f64) -> Vec3 {
        let [c0, c1, c2, c3, c4, c5] = &self.coefficients;
        std::array::from_fn(|k| c0[k] + p * (c1[k] + p * (c2[k] + p * (c3[k] + p * (c4[k] + p * c5[k])))))
    }

    /// Position and its first derivative at p.
    #[inline]
    pub(super) fn path(&self, p: f64) -> (Vec3, Vec3) {
        let [_, c1, c2, c3, c4, c5] = &self.coefficients;
        let r1 = std::array::from_fn(|k| {
            c1[k] + p * (2.0 * c2[k] + p * (3.0 * c3[k] + p * (4.0 * c4[k] + p * 5.0 * c5[k])))
        });
        (self.position(p), r1)
    }

    /// About how long the way is, km.
    pub(super) fn length_km(&self) -> f64 {
        crate::vector::norm(self.coefficients[1])
    }

    /// Position and derivatives at p.
    #[inline]
    pub(super) fn motion(&self, p: f64) -> Motion2 {
        let [c0, c1, c2, c3, c4, c5] = &self.coefficients;
        Motion2 {
            r: std::array::from_fn(|k| {
                c0[k] + p * (c1[k] + p * (c2[k] + p * (c3[k] + p * (c4[k] + p * c5[k]))))
            }),
            r1: std::array::from_fn(|k| {
                c1[k] + p * (2.0 * c2[k] + p * (3.0 * c3[k] + p * (4.0 * c4[k] + p * 5.0 * c5[k])))
            }),
            r2: std::array::from_fn(|k| {
                2.0 * c2[k] + p * (6.0 * c3[k] + p * (12.0 * c4[k] + p * 20.0 * c5[k]))
            }),
        }
    }
}
