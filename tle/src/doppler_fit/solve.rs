//! Robust least squares from a starting point: linearise, weigh, solve, again.
//!
//! The unknowns of all receivers would make a large matrix. Each receiver's two (oscillator, clock) meet only the two that
//! all share (late, satellite's oscillator), so they are eliminated one receiver at a time.

use crate::propagator::PropagationError;

use super::model::{Model, Slope, UNHEARD_DEG};
use super::profile::{Start, capped_huber, median};
use super::{FitSettings, Observation, Receiver, Sign};

type Two = [f64; 2];
type TwoByTwo = [[f64; 2]; 2];

const ROUNDS_MAX: usize = 40;
/// From here on what is far off does not count at all.
const REJECT_FROM_ROUND: usize = 6;
/// From here on what counts stays as it is, so that the rounds end.
const FREEZE_FROM_ROUND: usize = 20;
/// An instrument measures no better than this, Hz.
const NOISE_LEAST_HZ: f64 = 10.0;
/// What the expected noise counts for against the measured one, in measurements.
const NOISE_PRIOR: f64 = 2.0;
/// The farthest that one round goes, s.
const STRIDE_S: f64 = 10.0;

/// A minimum that was found.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub(super) late_s: f64,
    pub(super) satellite_hz: f64,
    pub(super) offsets_hz: Vec<f64>,
    pub(super) fast_s: Vec<f64>,
    pub(super) signs: Vec<Sign>,
    pub(super) is_mute: Vec<bool>,
    /// By measurement; infinite where the satellite was below the horizon, or its receiver is mute.
    pub(super) residuals_hz: Vec<f64>,
    pub(super) used: Vec<bool>,
    pub(super) noise_hz: f64,
    /// Measurements that are left over beyond what the unknowns took.
    pub(super) freedom: f64,
    /// One sigma, s: all in all; were the clocks right; were the oscillators right.
    pub(super) sigmas_s: [f64; 3],
}

impl Solution {
    /// How badly it fits, in units of half a squared sigma, with this noise.
    pub(super) fn cost(&self, settings: &FitSettings, receivers: &[Receiver], noise_hz: f64) -> f64 {
        let off: f64 = self.residuals_hz.iter().map(|hz| capped_huber(hz / noise_hz)).sum();
        let drawn = |value: f64, sigma: f64| if sigma > 0.0 { 0.5 * (value / sigma).powi(2) } else { 0.0 };
        let instruments: f64 = receivers
            .iter()
            .enumerate()
            .map(|(i, one)| {
                drawn(self.offsets_hz[i], one.oscillator_error_hz) + drawn(self.fast_s[i], one.clock_error_s)
            })
            .sum();
        off + instruments + drawn(self.satellite_hz, settings.satellite_error_hz)
    }
}

/// Which expected errors are taken as they are, and which as nothing.
#[derive(Clone, Copy)]
struct Known {
    clocks: bool,
    oscillators: bool,
}

const NOTHING_KNOWN: Known = Known { clocks: false, oscillators: false };

pub(super) fn refine(
    model: &Model<'_>,
    observations: &[Observation],
    settings: &FitSettings,
    start: &Start,
) -> Result<Solution, PropagationError> {
    let count = model.receivers.len();
    let mut at = Solution {
        late_s: start.late_s,
        satellite_hz: 0.0,
        offsets_hz: start.offsets_hz.clone(),
        fast_s: vec![0.0; count],
        signs: start.signs.clone(),
        is_mute: start.is_mute.clone(),
        residuals_hz: Vec::new(),
        used: vec![true; observations.len()],
        noise_hz: settings.expected_noise_hz,
        freedom: 0.0,
        sigmas_s: [f64::INFINITY; 3],
    };
    let mut slopes = Vec::new();
    let mut weights = Vec::new();
    for round in 0..ROUNDS_MAX {
        slopes = measure(model, observations, &mut at)?;
        at.estimate_noise(model, settings, observations, &slopes);
        weights = at.weigh(round);
        let Some(step) = Normal::of(model, settings, observations, &slopes, &at, &weights, NOTHING_KNOWN)
            .and_then(|normal| normal.solve())
        else {
            break;
        };
        let part = (STRIDE_S / step.shared[0].abs()).min(1.0);
        at.late_s += part * step.shared[0];
        at.satellite_hz += part * step.shared[1];
        for (i, own) in step.own.iter().enumerate() {
            at.offsets_hz[i] += part * own[0];
            at.fast_s[i] += part * own[1];
        }
        if round > REJECT_FROM_ROUND && step.shared[0].abs() < 1e-5 {
            break;
        }
        if at.late_s.abs() > 2.0 * settings.search_s {
            break;
        }
    }
    let knowing = [
        NOTHING_KNOWN,
        Known { clocks: true, oscillators: false },
        Known { clocks: false, oscillators: true },
    ];
    let few = 1.0 + 3.5 / at.freedom.max(0.5);
    at.sigmas_s = knowing.map(|known| {
        let normal = Normal::of(model, settings, observations, &slopes, &at, &weights, known);
        let variance_s2 = normal.and_then(|normal| normal.variance_of_late());
        variance_s2.map_or(f64::INFINITY, |variance| variance.sqrt() * few)
    });
    Ok(at)
}

fn measure(
    model: &Model<'_>,
    observations: &[Observation],
    at: &mut Solution,
) -> Result<Vec<Slope>, PropagationError> {
    let mut slopes = Vec::with_capacity(observations.len());
    at.residuals_hz.clear();
    for seen in observations {
        let r = seen.receiver;
        let slope = model.slope(seen, at.late_s, at.fast_s[r])?;
        let heard_hz = seen.applied_hz + at.signs[r].factor() * seen.error_hz;
        let is_heard = slope.shift.elevation_deg > UNHEARD_DEG && !at.is_mute[r];
        let off_hz = heard_hz - slope.shift.hz - at.satellite_hz - at.offsets_hz[r];
        at.residuals_hz.push(if is_heard { off_hz } else { f64::INFINITY });
        slopes.push(slope);
    }
    Ok(slopes)
}

impl Solution {
    fn estimate_noise(
        &mut self,
        model: &Model<'_>,
        settings: &FitSettings,
        observations: &[Observation],
        slopes: &[Slope],
    ) {
        let count = model.receivers.len();
        let (mut heard, mut steep) = (vec![0.0; count], vec![0.0; count]);
        let variance = self.noise_hz * self.noise_hz;
        let mut sizes = Vec::new();
        for ((seen, slope), off_hz) in observations.iter().zip(slopes).zip(&self.residuals_hz) {
            if off_hz.is_finite() {
                sizes.push(off_hz.abs());
                heard[seen.receiver] += 1.0;
                steep[seen.receiver] += slope.by_clock * slope.by_clock;
            }
        }
        // What the unknowns take from the data, each as far as it is not held by what is expected of it.
        let taken: f64 = 1.0
            + model
                .receivers
                .iter()
                .enumerate()
                .map(|(i, one)| {
                    let (held, timed) = (one.oscillator_error_hz.powi(2), one.clock_error_s.powi(2));
                    heard[i] * held / (heard[i] * held + variance)
                        + steep[i] * timed / (steep[i] * timed + variance)
                })
                .sum::<f64>();
        self.freedom = sizes.len() as f64 - taken;
        let spread_hz = 1.4826 * median(sizes.clone());
        let freedom = self.freedom.max(0.0);
        let fair = spread_hz * spread_hz * sizes.len() as f64 / freedom.max(1.0);
        let expected = settings.expected_noise_hz * settings.expected_noise_hz;
        let mixed = (NOISE_PRIOR * expected + freedom * fair) / (NOISE_PRIOR + freedom);
        self.noise_hz = mixed.sqrt().max(NOISE_LEAST_HZ);
    }

    fn weigh(&mut self, round: usize) -> Vec<f64> {
        let mut weights = Vec::with_capacity(self.residuals_hz.len());
        for (off_hz, used) in self.residuals_hz.iter().zip(&mut self.used) {
            let units = off_hz.abs() / self.noise_hz;
            if round < FREEZE_FROM_ROUND {
                let far = if round < REJECT_FROM_ROUND { f64::MAX } else { 4.0 };
                *used = units <= far;
            }
            let is_counted = *used && units.is_finite();
            weights.push(if is_counted { (1.5 / units).min(1.0) } else { 0.0 });
        }
        weights
    }
}

/// The normal equations, receivers apart.
struct Normal {
    shared: TwoByTwo,
    shared_right: Two,
    /// By receiver: own with own, shared with own, own right-hand side.
    own: Vec<(TwoByTwo, TwoByTwo, Two)>,
}

struct Step {
    shared: Two,
    own: Vec<Two>,
}

impl Normal {
    fn of(
        model: &Model<'_>,
        settings: &FitSettings,
        observations: &[Observation],
        slopes: &[Slope],
        at: &Solution,
        weights: &[f64],
        known: Known,
    ) -> Option<Self> {
        let variance = at.noise_hz * at.noise_hz;
        // What is expected of an unknown holds it like a measurement; an error of nothing holds it fast.
        let hold = |sigma: f64, is_known: bool| if is_known || sigma <= 0.0 { 1e18 } else { sigma.powi(-2) };
        let satellite = hold(settings.satellite_error_hz, known.oscillators);
        let mut normal = Self {
            shared: [[0.0, 0.0], [0.0, satellite]],
            shared_right: [0.0, -satellite * at.satellite_hz],
            own: Vec::with_capacity(model.receivers.len()),
        };
        for (i, receiver) in model.receivers.iter().enumerate() {
            let oscillator = hold(receiver.oscillator_error_hz, known.oscillators);
            let clock = hold(receiver.clock_error_s, known.clocks);
            let right = [-oscillator * at.offsets_hz[i], -clock * at.fast_s[i]];
            normal.own.push(([[oscillator, 0.0], [0.0, clock]], [[0.0; 2]; 2], right));
        }
        for (((seen, slope), off_hz), weight) in
            observations.iter().zip(slopes).zip(&at.residuals_hz).zip(weights)
        {
            if *weight <= 0.0 {
                continue;
            }
            let w = weight / variance;
            let (shared, own) = ([slope.by_late, 1.0], [1.0, slope.by_clock]);
            let (own_own, shared_own, own_right) = &mut normal.own[seen.receiver];
            for a in 0..2 {
                normal.shared_right[a] += w * shared[a] * off_hz;
                own_right[a] += w * own[a] * off_hz;
                for b in 0..2 {
                    normal.shared[a][b] += w * shared[a] * shared[b];
                    own_own[a][b] += w * own[a] * own[b];
                    shared_own[a][b] += w * shared[a] * own[b];
                }
            }
        }
        normal.shared.iter().flatten().all(|value| value.is_finite()).then_some(normal)
    }

    /// What is left of the shared ones when the receivers' own are eliminated.
    fn reduced(&self) -> Option<(TwoByTwo, Two)> {
        let (mut matrix, mut right) = (self.shared, self.shared_right);
        for (own_own, shared_own, own_right) in &self.own {
            let inverse = inverted(own_own)?;
            let part = times(shared_own, &inverse);
            for a in 0..2 {
                right[a] -= part[a][0] * own_right[0] + part[a][1] * own_right[1];
                for b in 0..2 {
                    matrix[a][b] -= part[a][0] * shared_own[b][0] + part[a][1] * shared_own[b][1];
                }
            }
        }
        Some((matrix, right))
    }

    fn solve(&self) -> Option<Step> {
        let (matrix, right) = self.reduced()?;
        let shared = applied(&inverted(&matrix)?, right);
        let own = self
            .own
            .iter()
            .map(|(own_own, shared_own, own_right)| {
                let rest = [0, 1]
                    .map(|a| own_right[a] - shared_own[0][a] * shared[0] - shared_own[1][a] * shared[1]);
                Some(applied(&inverted(own_own)?, rest))
            })
            .collect::<Option<Vec<Two>>>()?;
        shared.iter().all(|value| value.is_finite()).then_some(Step { shared, own })
    }

    fn variance_of_late(&self) -> Option<f64> {
        let variance = inverted(&self.reduced()?.0)?[0][0];
        (variance.is_finite() && variance > 0.0).then_some(variance)
    }
}

fn inverted(m: &TwoByTwo) -> Option<TwoByTwo> {
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    (determinant > 1e-14 * m[0][0] * m[1][1] && determinant.is_finite()).then(|| {
        [[m[1][1] / determinant, -m[0][1] / determinant], [-m[1][0] / determinant, m[0][0] / determinant]]
    })
}

fn times(a: &TwoByTwo, b: &TwoByTwo) -> TwoByTwo {
    let cell = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[cell(0, 0), cell(0, 1)], [cell(1, 0), cell(1, 1)]]
}

fn applied(m: &TwoByTwo, v: Two) -> Two {
    [m[0][0] * v[0] + m[0][1] * v[1], m[1][0] * v[0] + m[1][1] * v[1]]
}
