//! How late a satellite is, from the frequencies at which stations heard it.
//!
//! Old elements are wrong along the track first of all: the satellite comes late or early, on the same path. Every
//! reception with a measured frequency carries a Doppler shift, and the shift tells where in its pass the satellite was.
//! [`fit`] finds the one number, seconds late, that fits all receptions, with what is unknown about the instruments beside
//! it: each receiver's oscillator, clock and sign convention, and the satellite's oscillator.
//!
//! | file | what it holds |
//! |---|---|
//! | `answer` | what comes out, and why nothing does |
//! | `model` | the shift that a receiver hears if the satellite is so late |
//! | `profile` | the search for starting points, signs included |
//! | `solve` | robust least squares from a starting point |
//!
//! Receivers' oscillators and clocks have a stated expected error and no more: the data correct them as far as they can, and
//! what remains widens the answer's uncertainty. A clock that is wrong by a second at the only receiver cannot be told from
//! a satellite that is late by a second, and the uncertainty says so.
//!
//! What it does **not** do: correct the plane, height or drag of the orbit, or fit a drift over days. Give it the receptions
//! of a day or two; [`late_elements`] applies the answer.

mod answer;
mod model;
mod profile;
mod solve;

pub use answer::{DopplerFit, FitError, LimitedBy, ReceiverFit};

use crate::elements::Elements;
use crate::propagator::Propagator;
use crate::station::Station;
use crate::time::{EarthOrientation, UtcInstant};

use model::Model;
use solve::Solution;

/// Receptions that one fit takes.
pub const OBSERVATIONS_MAX: usize = 20_000;
/// Receivers that one fit takes.
pub const RECEIVERS_MAX: usize = 2_000;
/// Fewer receptions than this say nothing.
pub const OBSERVATIONS_MIN: usize = 4;

/// A measured frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// When, by the receiver's clock.
    pub at: UtcInstant,
    /// Which of the receivers: an index.
    pub receiver: usize,
    /// The frequency that the satellite means to send on, Hz.
    pub nominal_hz: f64,
    /// The Doppler correction that the receiver had applied to its tuning, Hz; usually 0.
    pub applied_hz: f64,
    /// What the receiver measured against its tuning, Hz, in its own sign convention.
    pub error_hz: f64,
}

/// What a receiver's sign means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sign {
    /// A positive error is a signal above the tuned frequency.
    Above,
    /// A positive error is a signal below the tuned frequency.
    Below,
}

impl Sign {
    const fn factor(self) -> f64 {
        match self {
            Self::Above => 1.0,
            Self::Below => -1.0,
        }
    }
}

/// A station that measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Receiver {
    /// Where it stands.
    pub station: Station,
    /// What its sign means; `None`: to be found out.
    pub sign: Option<Sign>,
    /// Expected error of its oscillator, Hz, one sigma: 2 ppm of a TCXO at 435 MHz are 870 Hz.
    pub oscillator_error_hz: f64,
    /// Expected error of its clock, s, one sigma.
    pub clock_error_s: f64,
}

impl Receiver {
    /// A receiver of which nothing is known but the place: sign unknown, 1 kHz, half a second.
    #[must_use]
    pub const fn unknown(station: Station) -> Self {
        Self { station, sign: None, oscillator_error_hz: 1000.0, clock_error_s: 0.5 }
    }
}

/// How to look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    /// The satellite is at most so late or early, s.
    pub search_s: f64,
    /// Expected error of the satellite's oscillator, Hz, one sigma.
    pub satellite_error_hz: f64,
    /// What a single measurement errs by, Hz, before the data say better.
    pub expected_noise_hz: f64,
    /// An answer that is less certain than this is refused, s, one sigma.
    pub worst_sigma_s: f64,
    /// How far the Earth has turned.
    pub orientation: EarthOrientation,
}

impl Default for FitSettings {
    /// Two minutes either way, 2 kHz, 200 Hz, 20 s.
    fn default() -> Self {
        Self {
            search_s: 120.0,
            satellite_error_hz: 2000.0,
            expected_noise_hz: 200.0,
            worst_sigma_s: 20.0,
            orientation: EarthOrientation::UT1_IS_UTC,
        }
    }
}

/// Finds how late the satellite is.
///
/// # Errors
/// Where the receptions do not determine it: too few, two answers that fit alike, an answer at the edge of the search, or
/// one that is too uncertain. Each says what would help.
pub fn fit(
    propagator: &Propagator,
    receivers: &[Receiver],
    observations: &[Observation],
    settings: &FitSettings,
) -> Result<DopplerFit, FitError> {
    check(receivers, observations, settings)?;
    let model = Model { propagator, receivers, orientation: settings.orientation };
    let starts = profile::starts(&model, observations, settings)?;
    let mut found: Vec<Solution> = Vec::new();
    for start in &starts {
        let solution = solve::refine(&model, observations, settings, start)?;
        // Starts beside each other run into the same minimum.
        if !found.iter().any(|other| (other.late_s - solution.late_s).abs() < 0.2) {
            found.push(solution);
        }
    }
    let noise_hz = found.iter().map(|one| one.noise_hz).fold(f64::INFINITY, f64::min);
    found.sort_by(|a, b| {
        a.cost(settings, receivers, noise_hz).total_cmp(&b.cost(settings, receivers, noise_hz))
    });
    let (best, others) = found.split_first().ok_or(FitError::TooFew { found: 0, of: observations.len() })?;
    answer::judge(&model, settings, observations, best, others)
}

/// The same orbit, flown this much later (earlier when negative): the mean anomaly stands back by as much. For the output
/// of [`fit`]; the age of the elements stays what it is.
#[must_use]
pub fn late_elements(elements: &Elements, late_s: f64) -> Elements {
    let turned_deg = elements.mean_motion_rev_day * late_s / 86_400.0 * 360.0;
    Elements {
        mean_anomaly_deg: (elements.mean_anomaly_deg - turned_deg).rem_euclid(360.0),
        ..elements.clone()
    }
}

fn check(
    receivers: &[Receiver],
    observations: &[Observation],
    settings: &FitSettings,
) -> Result<(), FitError> {
    if observations.len() > OBSERVATIONS_MAX {
        return Err(FitError::TooMany {
            what: "receptions",
            found: observations.len(),
            most: OBSERVATIONS_MAX,
        });
    }
    if receivers.len() > RECEIVERS_MAX {
        return Err(FitError::TooMany { what: "receivers", found: receivers.len(), most: RECEIVERS_MAX });
    }
    for (index, seen) in observations.iter().enumerate() {
        let numbers =
            [("nominal_hz", seen.nominal_hz), ("applied_hz", seen.applied_hz), ("error_hz", seen.error_hz)];
        if let Some(&(field, found)) = numbers.iter().find(|(_, value)| !value.is_finite()) {
            return Err(FitError::NoNumber { index, field, found });
        }
        if seen.nominal_hz <= 0.0 {
            return Err(FitError::NoNumber { index, field: "nominal_hz", found: seen.nominal_hz });
        }
        if seen.receiver >= receivers.len() {
            return Err(FitError::NoReceiver { index, receiver: seen.receiver, receivers: receivers.len() });
        }
    }
    let expected = receivers.iter().flat_map(|one| [one.oscillator_error_hz, one.clock_error_s]);
    let settled =
        [settings.search_s, settings.satellite_error_hz, settings.expected_noise_hz, settings.worst_sigma_s];
    if let Some(found) = expected.chain(settled).find(|value| !(0.0..=1e9).contains(value)) {
        return Err(FitError::Setting { found });
    }
    if !(1.0..=3000.0).contains(&settings.search_s) || settings.expected_noise_hz < 1.0 {
        return Err(FitError::Setting { found: settings.search_s.min(settings.expected_noise_hz) });
    }
    if observations.len() < OBSERVATIONS_MIN {
        return Err(FitError::TooFew { found: observations.len(), of: observations.len() });
    }
    Ok(())
}
