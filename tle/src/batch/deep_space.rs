//! One far object at many instants: Sun, Moon and resonance on top of the near-earth theory's drag and gravity.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::coefficients::{Coefficients, J2, J3};
use super::columns::StateColumns;
use super::kernel::{self, Mean};
use super::near_earth::lanes_from;
use super::resonance::{Anchors, Resonance};
use super::third_body::{Drift, Sway, sun_and_moon};
use super::trig::sin_cos;
use crate::elements::Elements;
use crate::propagator::{LONGEST_SPAN_MIN, afspc_days_since_j2000};

/// Below this inclination (rad) node and perigee sway together, by Lyddane's formulas.
const LYDDANE_RAD: f64 = 0.2;
/// The semi-major axis follows the mean motion by a series; where that has moved on by a greater part since the last anchor,
/// the scalar path is asked.
const MOTION_PART: f64 = 1e-3;

/// SGP4 of one object with a period of 225 minutes or more, made ready from its elements.
#[derive(Debug, Clone)]
pub struct DeepSpace {
    /// Rates with what Sun and Moon add.
    orbit: Coefficients<f64>,
    inclination: f64,
    drift: Drift,
    sways: [Sway; 2],
    resonance: Option<Resonance>,
    level: Level,
}

impl DeepSpace {
    /// Makes it ready. `None` for a shorter period (see [`NearEarth`](super::NearEarth)), and for elements that describe no
    /// orbit.
    #[must_use]
    pub fn new(elements: &Elements) -> Option<Self> {
        let mut orbit = Coefficients::new(elements).filter(Coefficients::is_deep_space)?;
        let epoch_days = afspc_days_since_j2000(elements.epoch);
        let (sways, drift) = sun_and_moon(&orbit, epoch_days);
        let sidereal_rad = sgp4::afspc_epoch_to_sidereal_time(epoch_days / 365.25);
        let resonance = Resonance::new(&orbit, &drift, sidereal_rad);
        orbit.mdot += drift.anomaly;
        orbit.argpdot += drift.argp;
        orbit.nodedot += drift.node;
        let inclination = elements.inclination_deg.to_radians();
        Some(Self { orbit, inclination, drift, sways, resonance, level: Level::new() })
    }

    /// The states so many minutes after the epoch (before it, when negative), written into `states`, which takes the
    /// length of `minutes`. `anchors` keeps what the resonance has summed from the epoch on: hand in the same again for the
    /// same object, and a new one for another.
    pub fn propagate(&self, minutes: &[f64], anchors: &mut Anchors, states: &mut StateColumns) {
        states.resize(minutes.len());
        dispatch!(self.level, simd => self.propagate_in(simd, minutes, anchors, states));
    }

    #[inline(always)]
    fn propagate_in<S: Simd>(
        &self,
        simd: S,
        minutes: &[f64],
        anchors: &mut Anchors,
        states: &mut StateColumns,
    ) {
        let mut from = 0;
        while from < minutes.len() {
            let t = lanes_from(simd, minutes, from);
            let mean = self.mean(simd, t, anchors);
            from = states.put::<S>(from, kernel::osculating::<S, false>(simd, &mean, t));
        }
    }

    /// Mean elements after `t` minutes.
    #[inline(always)]
    fn mean<S: Simd>(&self, simd: S, t: S::f64s, anchors: &mut Anchors) -> Mean<S> {
        let all = |value: f64| S::f64s::splat(simd, value);
        let (one, o, t2) = (all(1.0), &self.orbit, t * t);
        let node = t2.mul_add(all(o.nodecf), t.mul_add(all(o.nodedot), all(o.nodeo)));
        let argp = t.mul_add(all(o.argpdot), all(o.argpo));
        let (axis, anomaly) = self.axis_and_anomaly(simd, t, [node, argp], anchors);
        let shrink = one - t * o.cc1;

        let sun = self.sways[0].at(simd, t);
        let moon = self.sways[1].at(simd, t);
        let sway: [S::f64s; 5] = std::array::from_fn(|k| sun[k] + moon[k]);
        let e_secular = t.mul_add(all(self.drift.e - o.cc4), all(o.ecco));
        let inclination = t.mul_add(all(self.drift.inclination), all(self.inclination) + sway[1]);
        let (sini, cosi) = sin_cos(simd, inclination);
        let tilted = inclination.simd_ge(all(LYDDANE_RAD));
        let mut node_sway = sway[4] / sini;
        let mut argp_sway = sway[3] - cosi * node_sway;
        if !tilted.all_true() {
            let turn = angle_of::<S>(sway[4], sway[1].mul_add(cosi, sini));
            let whole_node = node - (node * (1.0 / std::f64::consts::TAU)).trunc() * std::f64::consts::TAU;
            let together = sway[3] - cosi * turn - sway[1] * whole_node * sini;
            node_sway = tilted.select(node_sway, turn);
            argp_sway = tilted.select(argp_sway, together);
        }

        let cos2 = cosi * cosi;
        let over = one + cosi;
        let over = over.abs().simd_gt(all(1.5e-12)).select(over, all(1.5e-12));
        Mean {
            e_secular,
            e: e_secular.max(all(1.0e-6)) + sway[0],
            a: axis * shrink * shrink,
            argp: argp + argp_sway,
            anomaly: t2.mul_add(all(o.no * o.t2cof), anomaly + sway[2]),
            sin_cos_node: sin_cos(simd, node + node_sway),
            sini,
            cosi,
            aycof: sini * (-0.5 * J3 / J2),
            xlcof: sini * cosi.mul_add(all(5.0), all(3.0)) / over * (-0.25 * J3 / J2),
            con41: cos2.mul_add(all(3.0), all(-1.0)),
            x1mth2: one - cos2,
            x7thm1: cos2.mul_add(all(7.0), all(-1.0)),
        }
    }

    /// Semi-major axis and mean anomaly with the secular and resonant terms.
    #[inline(always)]
    fn axis_and_anomaly<S: Simd>(
        &self,
        simd: S,
        t: S::f64s,
        [node, argp]: [S::f64s; 2],
        anchors: &mut Anchors,
    ) -> (S::f64s, S::f64s) {
        let all = |value: f64| S::f64s::splat(simd, value);
        let Some(resonance) = &self.resonance else {
            return (all(self.orbit.ao), t.mul_add(all(self.orbit.mdot), all(self.orbit.mo)));
        };
        let mut gathered = [all(0.0); 7];
        for lane in 0..S::f64s::LEN {
            let at = resonance.anchor(anchors, t[lane], LONGEST_SPAN_MIN);
            for (column, value) in
                gathered.iter_mut().zip([at.minutes, at.n, at.n1, at.n2, at.a, at.lambda, at.lambda1])
            {
                column.as_mut_slice()[lane] = value;
            }
        }
        let [minutes, n, n1, n2, a, lambda, lambda1] = gathered;
        let dt = t - minutes;
        // (1 + x)^(-2/3) for the small part by which the mean motion has moved on.
        let x = dt * dt.mul_add(n2 * 0.5, n1) / n;
        let series = x.mul_add(all(-308.0 / 729.0), all(110.0 / 243.0));
        let series =
            x.mul_add(x.mul_add(x.mul_add(series, all(-40.0 / 81.0)), all(5.0 / 9.0)), all(-2.0 / 3.0));
        let small = x.abs().simd_lt(all(MOTION_PART));
        let axis = small.select(a * x.mul_add(series, all(1.0)), all(f64::NAN));

        let (sidereal_rad, rate) = resonance.sidereal();
        let theta = t.mul_add(all(rate), all(sidereal_rad));
        let lambda = dt.mul_add(dt.mul_add(n1 * 0.5, lambda1), lambda);
        (axis, lambda + (theta - node) * resonance.nodes - argp * resonance.perigees)
    }
}

/// The arc tangent of each lane's quotient; the vector unit has none.
#[inline(always)]
fn angle_of<S: Simd>(mut y: S::f64s, x: S::f64s) -> S::f64s {
    for lane in 0..S::f64s::LEN {
        let angle = y[lane].atan2(x[lane]);
        y.as_mut_slice()[lane] = angle;
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Propagator, UtcInstant};

    /// Every branch of the theory: with and without resonance, flat and steep, round and eccentric.
    fn elements(k: u32) -> Elements {
        let part = |step: f64| (f64::from(k) * step).fract();
        let (mean_motion_rev_day, eccentricity) = match k % 8 {
            0 => (2.0057 + 0.05 * (part(0.4) - 0.5), 0.5 + 0.26 * part(0.3)),
            1 => (1.0027 + 0.01 * (part(0.4) - 0.5), 0.02 * part(0.3)),
            2 => (2.0057, 0.01 * part(0.7)),
            3 => (2.2, 0.6 + 0.14 * part(0.3)),
            4 => (0.8 + 0.4 * part(0.4), 0.6 * part(0.3)),
            5 => (0.25 + 1.5 * part(0.4), 0.8 * part(0.3)),
            _ => (0.4 + 5.9 * part(0.77), 0.3 * part(0.123)),
        };
        Elements {
            name: None,
            object_id: None,
            norad_cat_id: None,
            epoch: UtcInstant::from_unix_us(1_790_000_000_123_456 - 31_557_600_000_000 * i64::from(k % 40)),
            mean_motion_rev_day,
            eccentricity,
            inclination_deg: match k % 3 {
                0 => 14.0 * part(0.754_878),
                _ => 180.0 * part(0.754_878),
            },
            raan_deg: 360.0 * part(0.569_84),
            arg_of_perigee_deg: 360.0 * part(0.819_173),
            mean_anomaly_deg: 360.0 * part(0.671_044),
            bstar: 2e-4 * (part(0.549_7) - 0.3),
            mean_motion_dot: 0.0,
            mean_motion_ddot: 0.0,
            ephemeris_type: Some(0),
            classification: None,
            element_set_no: None,
            rev_at_epoch: None,
            further: Vec::new(),
        }
    }

    /// Worst differences from the scalar path, km and km/s.
    fn compare(objects: impl Iterator<Item = Elements>, minutes: &[f64]) -> (f64, f64) {
        let (mut worst_km, mut worst_km_s, mut compared, mut refused) = (0.0f64, 0.0f64, 0u32, 0u32);
        let mut states = StateColumns::default();
        for (index, elements) in objects.enumerate() {
            let scalar = Propagator::new(&elements).unwrap();
            if !scalar.is_deep_space() {
                continue;
            }
            let mut lanes = DeepSpace::new(&elements).unwrap();
            if index.is_multiple_of(5) {
                lanes.level = Level::baseline();
            }
            lanes.propagate(minutes, &mut Anchors::default(), &mut states);
            for (index, &t) in minutes.iter().enumerate() {
                match (scalar.at_minutes(t), states.get(index)) {
                    (Ok(state), Some((r, v))) => {
                        compared += 1;
                        let mut off = 0.0f64;
                        for axis in 0..3 {
                            off = off.max((state.r_teme_km[axis] - r[axis]).abs());
                            worst_km_s = worst_km_s.max((state.v_teme_km_s[axis] - v[axis]).abs());
                        }
                        assert!(off < 1e-3, "{off:e} km after {t} min: {elements:?}");
                        worst_km = worst_km.max(off);
                    }
                    (Ok(_), None) => refused += 1,
                    (Err(_), None) => {}
                    (Err(error), Some(_)) => panic!("a state where SGP4 says {error}: {elements:?}"),
                }
            }
        }
        println!("worst {worst_km:e} km, {worst_km_s:e} km/s, compared {compared}, left alone {refused}");
        assert!(compared > 10_000 && refused * 1000 < compared, "{compared} {refused}");
        (worst_km, worst_km_s)
    }

    #[test]
    fn lanes_and_scalar_agree_to_a_tenth_of_a_millimetre_over_a_week() {
        let minutes: Vec<f64> = (-1009..=1010).map(|k| f64::from(k) * 9.987).collect();
        let (worst_km, worst_km_s) = compare((0..600).map(elements), &minutes);
        assert!(worst_km < 1e-7, "{worst_km:e} km");
        assert!(worst_km_s < 1e-10, "{worst_km_s:e} km/s");
    }

    #[test]
    fn they_still_agree_years_from_the_epoch() {
        let minutes: Vec<f64> = (-60..=60).map(|k| f64::from(k) * 52_793.3).collect();
        // Resonance enlarges the differences of rounding.
        let (worst_km, _) = compare((0..120).map(elements), &minutes);
        assert!(worst_km < 5e-5, "{worst_km:e} km");
    }
}
