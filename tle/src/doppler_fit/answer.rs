//! What a fit says, or why it says nothing.

use crate::propagator::PropagationError;
use crate::time::UtcInstant;

use super::model::Model;
use super::solve::Solution;
use super::{FitSettings, Observation, Sign};

/// Costs that differ by less than this tell nothing apart: three sigma.
const TELLING: f64 = 4.5;

/// How late the satellite is.
#[derive(Debug, Clone, PartialEq)]
pub struct DopplerFit {
    /// Seconds that it comes after what the elements say; negative when it comes before.
    pub late_s: f64,
    /// One sigma of that, s: noise, clocks and oscillators together.
    pub sigma_s: f64,
    /// What the uncertainty comes from, for the most part.
    pub limited_by: LimitedBy,
    /// How far the satellite sends from its nominal frequency, Hz. Told from a common error of all receivers only by what is
    /// expected of both.
    pub satellite_hz: f64,
    /// What a single measurement errs by, Hz, one sigma.
    pub noise_hz: f64,
    /// Measurements that counted.
    pub used: usize,
    /// Measurements left out: outliers, below the horizon, or of receivers whose sign cannot be told.
    pub rejected: usize,
    /// The first and the last measurement that counted.
    pub from: UtcInstant,
    /// See `from`.
    pub until: UtcInstant,
    /// Receivers, as they were given.
    pub receivers: Vec<ReceiverFit>,
}

impl DopplerFit {
    /// Receivers that contributed.
    #[must_use]
    pub fn receivers_used(&self) -> usize {
        self.receivers.iter().filter(|one| one.used > 0).count()
    }
}

/// What was learned of a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceiverFit {
    /// Its measurements that counted.
    pub used: usize,
    /// Its measurements that did not.
    pub rejected: usize,
    /// What its sign means; `None` if it has no measurements, or both would fit.
    pub sign: Option<Sign>,
    /// Its oscillator's error, Hz, positive when it hears too high.
    pub offset_hz: f64,
    /// How fast its clock is, s.
    pub fast_s: f64,
}

/// What an uncertainty comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LimitedBy {
    /// Few or noisy measurements: more of them help.
    Noise,
    /// Receivers' clocks: more receivers, or better clocks, help.
    Clocks,
    /// Oscillators: a longer stretch of a pass, or several stations at once, helps.
    Oscillators,
}

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FitError {
    /// More than a fit takes.
    #[error("{found} {what} are more than the {most} that a fit takes: choose those of one day")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// Given.
        found: usize,
        /// Taken.
        most: usize,
    },
    /// A field of a reception is no usable number.
    #[error("{field} of reception {index} is {found}: leave the reception out")]
    NoNumber {
        /// Which, from 0.
        index: usize,
        /// The field.
        field: &'static str,
        /// What stands there.
        found: f64,
    },
    /// A reception names a receiver that was not given.
    #[error("reception {index} is of receiver {receiver}, and there are {receivers}")]
    NoReceiver {
        /// Which reception, from 0.
        index: usize,
        /// The receiver that it names.
        receiver: usize,
        /// Receivers given.
        receivers: usize,
    },
    /// A setting or an expected error is outside what makes sense.
    #[error(
        "{found} is no usable setting: errors are 0 or more, the search 1 to 3000 s, the noise 1 Hz or more"
    )]
    Setting {
        /// The value.
        found: f64,
    },
    /// Not enough that counts.
    #[error(
        "{found} of {of} receptions count, and they leave nothing to judge by: more of them, or of a longer stretch of the pass, are needed"
    )]
    TooFew {
        /// That count.
        found: usize,
        /// Given.
        of: usize,
    },
    /// Two answers fit alike.
    #[error(
        "the receptions fit a satellite that is {first_s:.1} s late and one that is {second_s:.1} s late alike: a station elsewhere, or the sign of a receiver, would decide"
    )]
    Ambiguous {
        /// The one, s.
        first_s: f64,
        /// The other, s.
        second_s: f64,
    },
    /// The best answer is where the search ends.
    #[error(
        "the best fit is {late_s:.0} s late, at the edge of the search of {search_s:.0} s: widen it, or take newer elements"
    )]
    AtEdge {
        /// The best within, s.
        late_s: f64,
        /// The search, s.
        search_s: f64,
    },
    /// An answer that says nothing.
    #[error(
        "the receptions determine it only to {sigma_s:.1} s (more than {worst_s:.1} s): a longer stretch of a pass or a second station is needed"
    )]
    Undetermined {
        /// One sigma, s.
        sigma_s: f64,
        /// What is taken at most, s.
        worst_s: f64,
    },
    /// SGP4 has no state at one of the times.
    #[error("{0}")]
    NoState(#[from] PropagationError),
}

/// Holds the best minimum against the others and against what can be known.
pub(super) fn judge(
    model: &Model<'_>,
    settings: &FitSettings,
    observations: &[Observation],
    best: &Solution,
    others: &[Solution],
) -> Result<DopplerFit, FitError> {
    let is_used = |i: usize| best.used[i] && best.residuals_hz[i].is_finite();
    let used: Vec<usize> = (0..observations.len()).filter(|&i| is_used(i)).collect();
    let too_few = FitError::TooFew { found: used.len(), of: observations.len() };
    if used.len() < super::OBSERVATIONS_MIN || used.len() * 2 < observations.len() && used.len() < 8 {
        return Err(too_few);
    }
    if best.late_s.abs() >= settings.search_s {
        return Err(FitError::AtEdge { late_s: best.late_s, search_s: settings.search_s });
    }
    let sigma_s = best.sigmas_s[0];
    if sigma_s.is_nan() || sigma_s > settings.worst_sigma_s {
        return Err(FitError::Undetermined { sigma_s, worst_s: settings.worst_sigma_s });
    }
    if best.freedom < 0.5 {
        return Err(too_few);
    }
    let cost = |one: &Solution| one.cost(settings, model.receivers, best.noise_hz);
    let rival = others.iter().find(|other| {
        let apart_s = (other.late_s - best.late_s).abs();
        other.late_s.abs() < settings.search_s
            && apart_s > 3.0 * sigma_s
            && cost(other) - cost(best) < TELLING
    });
    if let Some(rival) = rival {
        return Err(FitError::Ambiguous { first_s: best.late_s, second_s: rival.late_s });
    }
    let [all, clocks_right, oscillators_right] = best.sigmas_s.map(|sigma| sigma * sigma);
    let limited_by = if all - clocks_right > 0.5 * all {
        LimitedBy::Clocks
    } else if all - oscillators_right > 0.5 * all {
        LimitedBy::Oscillators
    } else {
        LimitedBy::Noise
    };
    let receivers = (0..model.receivers.len())
        .map(|r| {
            let own = || (0..observations.len()).filter(|&i| observations[i].receiver == r);
            let used = own().filter(|&i| is_used(i)).count();
            ReceiverFit {
                used,
                rejected: own().count() - used,
                sign: (used > 0 && !best.is_mute[r]).then_some(best.signs[r]),
                offset_hz: best.offsets_hz[r],
                fast_s: best.fast_s[r],
            }
        })
        .collect();
    let times = || used.iter().map(|&i| observations[i].at);
    Ok(DopplerFit {
        late_s: best.late_s,
        sigma_s,
        limited_by,
        satellite_hz: best.satellite_hz,
        noise_hz: best.noise_hz,
        used: used.len(),
        rejected: observations.len() - used.len(),
        from: times().min().ok_or(too_few)?,
        until: times().max().ok_or(too_few)?,
        receivers,
    })
}
