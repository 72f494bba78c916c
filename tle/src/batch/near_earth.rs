//! One object at many instants.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::coefficients::Coefficients;
use super::columns::StateColumns;
use super::kernel;
use crate::elements::Elements;

/// SGP4 of one near-earth object of small eccentricity, made ready from its elements.
#[derive(Debug, Clone)]
pub struct NearEarth {
    coefficients: Coefficients<f64>,
    level: Level,
}

impl NearEarth {
    /// Makes it ready. `None` for an object the kernel does not take (a period of 225 minutes or more, an eccentricity of
    /// [`ECCENTRICITY_BOUND`](super::ECCENTRICITY_BOUND) or more, elements that describe no orbit): use
    /// [`Propagator`](crate::Propagator) for those.
    #[must_use]
    pub fn new(elements: &Elements) -> Option<Self> {
        Coefficients::new(elements).map(|coefficients| Self { coefficients, level: Level::new() })
    }

    /// The states so many minutes after the epoch (before it, when negative), written into `states`, which takes the
    /// length of `minutes`.
    pub fn propagate(&self, minutes: &[f64], states: &mut StateColumns) {
        states.resize(minutes.len());
        dispatch!(self.level, simd => propagate(simd, &self.coefficients, minutes, states));
    }
}

#[inline(always)]
fn propagate<S: Simd>(simd: S, coefficients: &Coefficients<f64>, minutes: &[f64], states: &mut StateColumns) {
    let spread = coefficients.map(|&value| S::f64s::splat(simd, value));
    let lanes = S::f64s::LEN;
    let mut from = 0;
    while from < minutes.len() {
        let to = (from + lanes).min(minutes.len());
        let t = if to - from == lanes {
            S::f64s::from_slice(simd, &minutes[from..to])
        } else {
            // The last few: the idle lanes repeat the epoch.
            let mut t = S::f64s::splat(simd, 0.0);
            t.as_mut_slice()[..to - from].copy_from_slice(&minutes[from..to]);
            t
        };
        let state = kernel::propagate(simd, &spread, t);
        for (column, value) in states.window(from, to).into_iter().zip(state) {
            column.copy_from_slice(&value.as_slice()[..to - from]);
        }
        from = to;
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

    #[test]
    fn lanes_and_scalar_agree_to_a_tenth_of_a_millimetre_over_a_week() {
        let minutes: Vec<f64> = (-1009..=1010).map(|k| f64::from(k) * 9.987).collect();
        let (mut worst_km, mut worst_km_s, mut compared, mut refused) = (0.0f64, 0.0f64, 0u32, 0u32);
        let mut states = StateColumns::default();
        for k in 0..600 {
            let elements = elements(k);
            let scalar = Propagator::new(&elements).unwrap();
            NearEarth::new(&elements).unwrap().propagate(&minutes, &mut states);
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
                    (Err(error), Some(_)) => panic!("{k}: the kernel has a state where SGP4 says {error}"),
                }
            }
        }
        println!(
            "worst {worst_km:e} km, {worst_km_s:e} km/s, compared {compared}, left to the scalar path {refused}"
        );
        assert!(worst_km < 1e-7, "{worst_km:e} km");
        assert!(worst_km_s < 1e-10, "{worst_km_s:e} km/s");
        assert!(compared > 1_000_000 && refused * 100 < compared, "{compared} {refused}");
    }
}
