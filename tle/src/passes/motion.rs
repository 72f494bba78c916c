//! One object's motion over the turning Earth, by seconds since the window began.

use crate::batch::{Anchors, DeepSpace, NearEarth, StateColumns};
use crate::elements::Elements;
use crate::frames::{EarthFixed, ecef_from_teme, gmst_rad};
use crate::gravity::gravity_km_s2;
use crate::propagator::{PropagationError, Propagator, SGP4_EARTH_RADIUS_KM, SGP4_MU_KM3_S2, State};
use crate::time::{EarthOrientation, UtcInstant};
use crate::vector::dot;

/// Seconds in a day, days in a Julian century.
const DAY_S: f64 = 86_400.0;
const CENTURY_DAYS: f64 = 36_525.0;

/// How far the Earth has turned, by seconds since an origin: the same polynomial as [`gmst_rad`], developed about the
/// origin, so that a search may count in seconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct EarthTurn {
    origin_rad: f64,
    century: f64,
}

impl EarthTurn {
    pub(super) fn new(origin: UtcInstant, orientation: EarthOrientation) -> Self {
        let (days, fraction) = origin.days_since_j2000();
        Self { origin_rad: gmst_rad(origin, orientation), century: (days + fraction) / CENTURY_DAYS }
    }

    /// Greenwich mean sidereal time, rad, any number of turns left out or in.
    pub(super) fn gmst_rad(&self, t_s: f64) -> f64 {
        let (t0, dt) = (self.century, t_s / (DAY_S * CENTURY_DAYS));
        // Whole days are left out by an exact product: the remainder operator costs more than all the rest.
        let seconds = t_s - (t_s / DAY_S).floor() * DAY_S
            + dt * (8_640_184.812_866 + 0.093_104 * (2.0 * t0 + dt)
                - 6.2e-6 * (3.0 * t0 * (t0 + dt) + dt * dt));
        self.origin_rad + seconds * (std::f64::consts::TAU / DAY_S)
    }
}

/// How far SGP4's velocity may be from the derivative of its position, km/s: on round orbits; and on others for each unit of
/// eccentricity and of the square of Earth radii over the semi-latus rectum. Measured: 0.1 m/s and 14 m/s.
const VELOCITY_FLAW_ROUND_KM_S: f64 = 1.5e-4;
const VELOCITY_FLAW_KM_S: f64 = 20e-3;

/// The theory in vector lanes.
#[derive(Debug, Clone)]
pub(super) enum Lanes {
    NearEarth(Box<NearEarth>),
    DeepSpace(Box<DeepSpace>),
}

impl Lanes {
    /// `None` for elements that describe no orbit.
    pub(super) fn new(elements: &Elements) -> Option<Self> {
        NearEarth::new(elements)
            .map(|near| Self::NearEarth(Box::new(near)))
            .or_else(|| DeepSpace::new(elements).map(|deep| Self::DeepSpace(Box::new(deep))))
    }

    fn is_round(&self) -> bool {
        matches!(self, Self::NearEarth(orbit) if orbit.is_round())
    }
}

/// True states of one object; counts how many it was asked for.
#[derive(Debug)]
pub(super) struct Motion<'a> {
    propagator: &'a Propagator,
    lanes: Option<&'a Lanes>,
    anchors: Anchors,
    origin_min: f64,
    velocity_flaw_km_s: f64,
    turn: EarthTurn,
    minutes: Vec<f64>,
    columns: StateColumns,
    /// States of SGP4 asked for so far.
    pub(super) calls: u64,
}

impl<'a> Motion<'a> {
    pub(super) fn new(
        propagator: &'a Propagator,
        lanes: Option<&'a Lanes>,
        origin: UtcInstant,
        orientation: EarthOrientation,
    ) -> Self {
        Self {
            propagator,
            lanes,
            anchors: Anchors::default(),
            origin_min: origin.minutes_since(propagator.epoch()),
            velocity_flaw_km_s: velocity_flaw_km_s(propagator, lanes),
            turn: EarthTurn::new(origin, orientation),
            minutes: Vec::new(),
            columns: StateColumns::default(),
            calls: 0,
        }
    }

    /// Whether the orbit is near the Earth and nearly circular, so that its velocities are good.
    pub(super) fn is_round(&self) -> bool {
        self.lanes.is_some_and(Lanes::is_round)
    }

    /// How far SGP4's velocity may be from that of its path, km/s, where drag is no matter.
    pub(super) const fn velocity_flaw_km_s(&self) -> f64 {
        self.velocity_flaw_km_s
    }

    /// Seconds from the epoch of the elements to the origin.
    pub(super) fn origin_since_epoch_s(&self) -> f64 {
        self.origin_min * 60.0
    }

    /// The state in TEME.
    pub(super) fn teme(&mut self, t_s: f64) -> Result<State, PropagationError> {
        let mut found = None;
        self.many_teme(&[t_s], |_, _, state| found = Some(state));
        found.unwrap_or_else(|| self.scalar(t_s))
    }

    /// The state by the scalar path, which costs more but knows why there is none.
    fn scalar(&self, t_s: f64) -> Result<State, PropagationError> {
        self.propagator.at_minutes(self.origin_min + t_s / 60.0)
    }

    /// The state with the velocity at which its position really moves. SGP4's own leaves out terms that grow with
    /// eccentricity and drag: 8 cm/s on round orbits, 2 m/s at a low perigee, anything when drag has taken over.
    pub(super) fn along_its_path(&mut self, state: &State, t_s: f64) -> State {
        let (r, v) = (state.r_teme_km, state.v_teme_km_s);
        let a = gravity_km_s2(r);
        let r2 = dot(r, r);
        let pull = SGP4_MU_KM3_S2 / (r2 * r2.sqrt());
        let turn = 3.0 * dot(r, v) / r2;
        // Beside a time without states the step goes the other way.
        for step_s in [1.0, -1.0] {
            if let Ok(next) = self.teme(t_s + step_s) {
                let path = std::array::from_fn(|k| {
                    let jerk = pull * (turn * r[k] - v[k]);
                    (next.r_teme_km[k] - r[k]) / step_s - step_s * (0.5 * a[k] + step_s / 6.0 * jerk)
                });
                return State { r_teme_km: r, v_teme_km_s: path };
            }
        }
        *state
    }

    /// The state over the turning Earth.
    pub(super) fn at(&mut self, t_s: f64) -> Result<EarthFixed, PropagationError> {
        let state = self.teme(t_s)?;
        Ok(self.turned(&state, t_s))
    }

    /// A state of TEME as seen from the turning Earth.
    pub(super) fn turned(&self, state: &State, t_s: f64) -> EarthFixed {
        ecef_from_teme(state, self.turn.gmst_rad(t_s))
    }

    /// Many states in TEME, handed to `take` with their number. In vector lanes; a state that the lanes refuse is asked of the scalar path, which knows the reason.
    pub(super) fn many_teme(
        &mut self,
        times_s: &[f64],
        mut take: impl FnMut(&Self, usize, Result<State, PropagationError>),
    ) {
        self.calls += times_s.len() as u64;
        let mut minutes = std::mem::take(&mut self.minutes);
        let mut columns = std::mem::take(&mut self.columns);
        minutes.clear();
        minutes.extend(times_s.iter().map(|t_s| self.origin_min + t_s / 60.0));
        match self.lanes {
            Some(Lanes::NearEarth(orbit)) => orbit.propagate(&minutes, &mut columns),
            Some(Lanes::DeepSpace(orbit)) => orbit.propagate(&minutes, &mut self.anchors, &mut columns),
            None => {}
        }
        for (index, &t_s) in times_s.iter().enumerate() {
            let state = match columns.get(index) {
                Some((r_teme_km, v_teme_km_s)) if self.lanes.is_some() => {
                    Ok(State { r_teme_km, v_teme_km_s })
                }
                _ => self.scalar(t_s),
            };
            take(self, index, state);
        }
        self.minutes = minutes;
        self.columns = columns;
    }

    /// Many states over the turning Earth; `None` where the theory has no answer.
    pub(super) fn many(&mut self, times_s: &[f64], states: &mut Vec<Option<EarthFixed>>) {
        states.clear();
        self.many_teme(times_s, |motion, index, state| {
            states.push(state.ok().map(|state| motion.turned(&state, times_s[index])));
        });
    }
}

fn velocity_flaw_km_s(propagator: &Propagator, lanes: Option<&Lanes>) -> f64 {
    if lanes.is_some_and(Lanes::is_round) {
        return VELOCITY_FLAW_ROUND_KM_S;
    }
    let e = propagator.eccentricity();
    let rate = std::f64::consts::TAU / (propagator.period_min() * 60.0);
    let latus = (SGP4_MU_KM3_S2 / (rate * rate)).cbrt() * (1.0 - e * e) / SGP4_EARTH_RADIUS_KM;
    VELOCITY_FLAW_ROUND_KM_S + VELOCITY_FLAW_KM_S * e / (latus * latus)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn earth_turns_here_as_in_frames() {
        for origin_us in [0, 946_728_000_000_000, 1_790_000_000_123_456] {
            let origin = UtcInstant::from_unix_us(origin_us);
            let orientation = EarthOrientation::new(0.3).unwrap();
            let turn = EarthTurn::new(origin, orientation);
            for t_s in [0.0, 1.5, -80_000.0, 86_400.0, 6e5, 3.1e7, 3e8] {
                let expected = gmst_rad(origin.plus_seconds(t_s), orientation);
                let off = (turn.gmst_rad(t_s) - expected).sin();
                assert!(off.abs() < 2e-11, "{origin} {t_s} {off:e}");
            }
        }
    }
}
