//! The shift that a receiver hears if the satellite is so late.

use crate::doppler::downlink_shift_hz;
use crate::frames::{ecef_from_teme, gmst_rad};
use crate::propagator::{PropagationError, Propagator};
use crate::time::EarthOrientation;

use super::{Observation, Receiver};

/// Step of the numerical derivatives, s. The shift bends over tens of seconds.
const STEP_S: f64 = 0.25;
/// Nobody hears a satellite this far below the horizon, degrees, whatever stands in the elements.
pub(super) const UNHEARD_DEG: f64 = -5.0;

/// Orbit and receivers.
pub(super) struct Model<'a> {
    pub(super) propagator: &'a Propagator,
    pub(super) receivers: &'a [Receiver],
    pub(super) orientation: EarthOrientation,
}

/// A predicted shift.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shift {
    pub(super) hz: f64,
    pub(super) elevation_deg: f64,
}

/// A predicted shift, and how it changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slope {
    pub(super) shift: Shift,
    /// By the satellite's being late, Hz/s.
    pub(super) by_late: f64,
    /// By the receiver's clock being fast, Hz/s.
    pub(super) by_clock: f64,
}

impl Model<'_> {
    /// What is heard if the satellite is `late_s` late and the receiver's clock `fast_s` fast.
    pub(super) fn shift(
        &self,
        seen: &Observation,
        late_s: f64,
        fast_s: f64,
    ) -> Result<Shift, PropagationError> {
        let at = seen.at.plus_seconds(-fast_s);
        let state = self.propagator.at(at.plus_seconds(-late_s))?;
        let object = ecef_from_teme(&state, gmst_rad(at, self.orientation));
        let look = self.receivers[seen.receiver].station.look(&object);
        Ok(Shift {
            hz: downlink_shift_hz(seen.nominal_hz, look.range_rate_km_s),
            elevation_deg: look.elevation_deg,
        })
    }

    pub(super) fn slope(
        &self,
        seen: &Observation,
        late_s: f64,
        fast_s: f64,
    ) -> Result<Slope, PropagationError> {
        let shift = self.shift(seen, late_s, fast_s)?;
        let later = self.shift(seen, late_s + STEP_S, fast_s)?;
        let faster = self.shift(seen, late_s, fast_s + STEP_S)?;
        Ok(Slope {
            shift,
            by_late: (later.hz - shift.hz) / STEP_S,
            by_clock: (faster.hz - shift.hz) / STEP_S,
        })
    }
}
