//! One object at many instants.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::coefficients::Coefficients;
use super::columns::StateColumns;
use super::kernel;
use crate::elements::Elements;

/// SGP4 of one near-earth object, made ready from its elements.
#[derive(Debug, Clone)]
pub struct NearEarth {
    coefficients: Coefficients<f64>,
    level: Level,
}

impl NearEarth {
    /// Makes it ready. `None` for a period of 225 minutes or more (see [`DeepSpace`](super::DeepSpace)), and for elements
    /// that describe no orbit.
    #[must_use]
    pub fn new(elements: &Elements) -> Option<Self> {
        let coefficients = Coefficients::new(elements).filter(|set| !set.is_deep_space())?;
        Some(Self { coefficients, level: Level::new() })
    }

    /// Whether the eccentricity is below [`ECCENTRICITY_BOUND`](super::ECCENTRICITY_BOUND).
    #[must_use]
    pub fn is_round(&self) -> bool {
        self.coefficients.is_round()
    }

    /// The states so many minutes after the epoch (before it, when negative), written into `states`, which takes the
    /// length of `minutes`.
    pub fn propagate(&self, minutes: &[f64], states: &mut StateColumns) {
        states.resize(minutes.len());
        if self.is_round() {
            dispatch!(self.level, simd => propagate::<_, true>(simd, &self.coefficients, minutes, states));
        } else {
            dispatch!(self.level, simd => propagate::<_, false>(simd, &self.coefficients, minutes, states));
        }
    }
}

#[inline(always)]
fn propagate<S: Simd, const ROUND: bool>(
    simd: S,
    coefficients: &Coefficients<f64>,
    minutes: &[f64],
    states: &mut StateColumns,
) {
    let spread = coefficients.map(|&value| S::f64s::splat(simd, value));
    let mut from = 0;
    while from < minutes.len() {
        let t = lanes_from(simd, minutes, from);
        from = states.put::<S>(from, kernel::propagate::<S, ROUND>(simd, &spread, t));
    }
}

/// As many numbers as the machine has lanes. At the end of the slice the idle lanes repeat the first of the last few.
#[inline(always)]
pub(super) fn lanes_from<S: Simd>(simd: S, numbers: &[f64], from: usize) -> S::f64s {
    let to = from + S::f64s::LEN;
    if to <= numbers.len() {
        S::f64s::from_slice(simd, &numbers[from..to])
    } else {
        let mut few = S::f64s::splat(simd, numbers[from]);
        few.as_mut_slice()[..numbers.len() - from].copy_from_slice(&numbers[from..]);
        few
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Propagator, UtcInstant};

    fn elements(k: u32) -> Elements {
        // Low-discrepancy steps through the ranges of real sets.
        let part = |step: f64| (f64::from(k) * step).fract();
        Elements {
            name: None,
            object_id: None,
            norad_cat_id: None,
            epoch: UtcInstant::from_unix_us(1_790_000_000_123_456),
            mean_motion_rev_day: if k.is_multiple_of(5) {
                6.45 + 8.0 * part(0.445)
            } else {
                14.0 + 2.2 * part(0.445)
            },
            eccentricity: if k.is_multiple_of(7) { 1e-4 * part(0.33) } else { 0.0199 * part(0.618_034) },
            inclination_deg: 180.0 * part(0.754_878),
            raan_deg: 360.0 * part(0.569_84),
            arg_of_perigee_deg: 360.0 * part(0.819_173),
            mean_anomaly_deg: 360.0 * part(0.671_044),
            bstar: 4e-4 * (part(0.549_7) - 0.2),
            mean_motion_dot: 0.0,
            mean_motion_ddot: 0.0,
            ephemeris_type: Some(0),
            classification: None,
            element_set_no: None,
            rev_at_epoch: None,
            further: Vec::new(),
        }
    }

    /// Perigee from 150 to 3000 km; eccentricity up to where periods reach 225 minutes.
    fn eccentric(k: u32) -> Elements {
        let part = |step: f64| (f64::from(k) * step).fract();
        let e = 0.02 + 0.48 * part(0.618_034);
        let axis_km: f64 = (6378.0 + 150.0 + 2850.0 * part(0.31).powi(3)) / (1.0 - e);
        Elements {
            mean_motion_rev_day: 86_400.0 / (std::f64::consts::TAU * (axis_km.powi(3) / 398_600.8).sqrt()),
            eccentricity: e,
            bstar: if k.is_multiple_of(9) { 4e-3 * part(0.77) } else { 3e-4 * (part(0.549_7) - 0.2) },
            ..elements(k)
        }
    }

    /// Worst difference in km and km/s over a week on either side of the epoch.
    fn compare(objects: impl Iterator<Item = Elements>) -> (f64, f64) {
        let minutes: Vec<f64> = (-1009..=1010).map(|k| f64::from(k) * 9.987).collect();
        let (mut worst_km, mut worst_km_s, mut compared, mut refused) = (0.0f64, 0.0f64, 0u32, 0u32);
        let mut states = StateColumns::default();
        for (index, elements) in objects.enumerate() {
            let scalar = Propagator::new(&elements).unwrap();
            if scalar.is_deep_space() {
                continue;
            }
            let mut lanes = NearEarth::new(&elements).unwrap();
            if index.is_multiple_of(5) {
                lanes.level = Level::baseline();
            }
            lanes.propagate(&minutes, &mut states);
            for (index, &t) in minutes.iter().enumerate() {
                match (scalar.at_minutes(t), states.get(index)) {
                    (Ok(state), Some((r, v))) => {
                        compared += 1;
                        for axis in 0..3 {
                            worst_km = worst_km.max((state.r_teme_km[axis] - r[axis]).abs());
                            worst_km_s = worst_km_s.max((state.v_teme_km_s[axis] - v[axis]).abs());
                        }
                    }
                    (Ok(_), None) => refused += 1,
                    (Err(_), None) => {}
                    (Err(error), Some(_)) => {
                        panic!("the kernel has a state where SGP4 says {error}: {elements:?}")
                    }
                }
            }
        }
        println!(
            "worst {worst_km:e} km, {worst_km_s:e} km/s, compared {compared}, left to the scalar path {refused}"
        );
        assert!(compared > 900_000 && refused * 100 < compared, "{compared} {refused}");
        (worst_km, worst_km_s)
    }

    #[test]
    fn lanes_and_scalar_agree_to_a_tenth_of_a_millimetre_over_a_week() {
        let (worst_km, worst_km_s) = compare((0..600).map(elements));
        assert!(worst_km < 1e-7, "{worst_km:e} km");
        assert!(worst_km_s < 1e-10, "{worst_km_s:e} km/s");
    }

    #[test]
    fn so_they_do_on_eccentric_orbits() {
        let (worst_km, worst_km_s) = compare((0..700).map(eccentric));
        assert!(worst_km < 1e-7, "{worst_km:e} km");
        assert!(worst_km_s < 1e-10, "{worst_km_s:e} km/s");
    }
}
