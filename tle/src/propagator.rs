//! SGP4 and SDP4: from mean elements to position and velocity.
//!
//! The 2006 revision (Vallado, Crawford, Hujsak, Kelso, AIAA 2006-6753) in improved mode, by the crate `sgp4`, with the
//! constants that published elements are fitted with: WGS72, and the sidereal time and epoch of the AFSPC. WGS84
//! constants would be wrong here by up to 30 ms of pass time.

use crate::elements::Elements;
use crate::time::UtcInstant;
use crate::vector::{Vec3, norm};

/// Earth's equatorial radius in SGP4 (WGS72), km.
pub const SGP4_EARTH_RADIUS_KM: f64 = 6378.135;
/// Earth's gravitational parameter in SGP4 (WGS72), km^3/s^2.
pub const SGP4_MU_KM3_S2: f64 = 398_600.8;
/// From this period on the deep-space part of the theory is used, minutes.
pub const DEEP_SPACE_PERIOD_MIN: f64 = 225.0;
/// How far from the epoch a propagation is tried, minutes: a hundred years. The resonance integrator of deep space walks
/// from the epoch in steps of half a day, so the limit also bounds its work.
pub const LONGEST_SPAN_MIN: f64 = 100.0 * 365.25 * 1440.0;

/// Position and velocity in TEME (true equator, mean equinox of date), UTC time scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Position, km.
    pub r_teme_km: Vec3,
    /// Velocity, km/s. SGP4's own, which is not exactly the derivative of its position (0.1 Hz of Doppler at 435 MHz).
    pub v_teme_km_s: Vec3,
}

/// One object's theory, made ready from its elements. A pure function of time; threads may share it.
#[derive(Debug, Clone)]
pub struct Propagator {
    constants: sgp4::Constants,
    epoch: UtcInstant,
    period_min: f64,
    eccentricity: f64,
}

impl Propagator {
    /// Makes the theory ready.
    ///
    /// # Errors
    /// Elements that describe no closed orbit: see [`ElementsError`].
    pub fn new(elements: &Elements) -> Result<Self, ElementsError> {
        let numbers = [
            ("INCLINATION", elements.inclination_deg),
            ("RA_OF_ASC_NODE", elements.raan_deg),
            ("ECCENTRICITY", elements.eccentricity),
            ("ARG_OF_PERICENTER", elements.arg_of_perigee_deg),
            ("MEAN_ANOMALY", elements.mean_anomaly_deg),
            ("MEAN_MOTION", elements.mean_motion_rev_day),
            ("BSTAR", elements.bstar),
        ];
        if let Some(&(field, found)) = numbers.iter().find(|(_, value)| !value.is_finite()) {
            return Err(ElementsError::NoNumber { field, found });
        }
        let orbit = sgp4::Orbit::from_kozai_elements(
            &sgp4::WGS72,
            elements.inclination_deg.to_radians(),
            elements.raan_deg.to_radians(),
            elements.eccentricity,
            elements.arg_of_perigee_deg.to_radians(),
            elements.mean_anomaly_deg.to_radians(),
            elements.mean_motion_rev_day * (std::f64::consts::PI / 720.0),
        )
        .map_err(|_| ElementsError::MeanMotion { found_rev_day: elements.mean_motion_rev_day })?;
        let period_min = std::f64::consts::TAU / orbit.mean_motion;
        let constants = sgp4::Constants::new(
            sgp4::WGS72,
            sgp4::afspc_epoch_to_sidereal_time,
            afspc_days_since_j2000(elements.epoch) / 365.25,
            elements.bstar,
            orbit,
        )
        .map_err(|_| ElementsError::Eccentricity { found: elements.eccentricity })?;
        Ok(Self { constants, epoch: elements.epoch, period_min, eccentricity: elements.eccentricity })
    }

    /// The epoch of the elements.
    #[must_use]
    pub const fn epoch(&self) -> UtcInstant {
        self.epoch
    }

    /// One revolution by SGP4's own (un-Kozai'd) mean motion at the epoch, minutes.
    #[must_use]
    pub const fn period_min(&self) -> f64 {
        self.period_min
    }

    /// Eccentricity at the epoch.
    #[must_use]
    pub const fn eccentricity(&self) -> f64 {
        self.eccentricity
    }

    /// Whether the deep-space part of the theory is at work.
    #[must_use]
    pub fn is_deep_space(&self) -> bool {
        self.period_min >= DEEP_SPACE_PERIOD_MIN
    }

    /// Where the object is at an instant.
    ///
    /// # Errors
    /// When the theory has no answer there: see [`PropagationError`].
    pub fn at(&self, at: UtcInstant) -> Result<State, PropagationError> {
        self.at_minutes(at.minutes_since(self.epoch))
    }

    /// Where the object is so many minutes after (before, when negative) its epoch.
    ///
    /// # Errors
    /// When the theory has no answer there: see [`PropagationError`].
    pub fn at_minutes(&self, minutes_since_epoch: f64) -> Result<State, PropagationError> {
        let fails = |fault| Err(PropagationError { minutes_since_epoch, fault });
        if !(-LONGEST_SPAN_MIN..=LONGEST_SPAN_MIN).contains(&minutes_since_epoch) {
            return fails(Fault::TooFarFromEpoch);
        }
        let prediction = match self.constants.propagate(sgp4::MinutesSinceEpoch(minutes_since_epoch)) {
            Ok(prediction) => prediction,
            Err(sgp4::Error::OutOfRangeEccentricity { .. }) => return fails(Fault::MeanEccentricity),
            Err(sgp4::Error::OutOfRangePerturbedEccentricity { .. }) => {
                return fails(Fault::PerturbedEccentricity);
            }
            Err(sgp4::Error::NegativeSemiLatusRectum { .. }) => return fails(Fault::SemiLatusRectum),
        };
        let radius_km = norm(prediction.position);
        if !radius_km.is_finite() || !norm(prediction.velocity).is_finite() {
            return fails(Fault::MeanMotion);
        }
        // The crate returns such states without a word; the reference calls them decayed.
        if radius_km < SGP4_EARTH_RADIUS_KM {
            return fails(Fault::Decayed);
        }
        Ok(State { r_teme_km: prediction.position, v_teme_km_s: prediction.velocity })
    }
}

/// Days from J2000 to an epoch, by way of one f64 of a Julian date, as the AFSPC's code has it: it rounds the epoch to 40 us
/// for the places of Sun and Moon (not for the time since epoch), and without it far orbits differ from the reference by
/// millimetres.
pub(crate) fn afspc_days_since_j2000(epoch: UtcInstant) -> f64 {
    let (days, fraction) = epoch.days_since_j2000();
    let j2000 = 2_451_545.0;
    (j2000 + days + fraction) - j2000
}

/// Elements from which no orbit can be made.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ElementsError {
    /// A field is infinite or not a number.
    #[error("{field} is {found}, which is not a number")]
    NoNumber {
        /// The field, by its name in an OMM.
        field: &'static str,
        /// What stands there.
        found: f64,
    },
    /// The mean motion, as published or freed from Kozai's terms, is not positive.
    #[error("the mean motion of {found_rev_day} rev/day describes no orbit")]
    MeanMotion {
        /// Mean motion as published.
        found_rev_day: f64,
    },
    /// The eccentricity describes no closed orbit.
    #[error("the eccentricity {found} is outside 0 to 1")]
    Eccentricity {
        /// Eccentricity as published.
        found: f64,
    },
}

/// No state at this time.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{fault}, {minutes_since_epoch} min after the epoch of the elements")]
pub struct PropagationError {
    /// Minutes after the epoch (negative: before it).
    pub minutes_since_epoch: f64,
    /// What went wrong.
    pub fault: Fault,
}

impl PropagationError {
    /// The code of the reference implementation: 1, 2, 3, 4 or 6. `None` where the reference has none.
    #[must_use]
    pub const fn code(&self) -> Option<u8> {
        match self.fault {
            Fault::MeanEccentricity => Some(1),
            Fault::MeanMotion => Some(2),
            Fault::PerturbedEccentricity => Some(3),
            Fault::SemiLatusRectum => Some(4),
            Fault::Decayed => Some(6),
            Fault::TooFarFromEpoch => None,
        }
    }
}

/// Why the theory has no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum Fault {
    /// Code 1: mean eccentricity or semi-major axis out of range.
    #[error("the mean eccentricity left its range (SGP4 error 1)")]
    MeanEccentricity,
    /// Code 2: mean motion not positive.
    #[error("the mean motion is not positive (SGP4 error 2)")]
    MeanMotion,
    /// Code 3: eccentricity with lunar and solar terms out of range.
    #[error("the perturbed eccentricity left its range (SGP4 error 3)")]
    PerturbedEccentricity,
    /// Code 4: semi-latus rectum negative.
    #[error("the semi-latus rectum is negative (SGP4 error 4)")]
    SemiLatusRectum,
    /// Code 6: less than one Earth radius from the centre.
    #[error("the object has decayed (SGP4 error 6)")]
    Decayed,
    /// More than [`LONGEST_SPAN_MIN`] from the epoch: not tried.
    #[error("the time is more than a hundred years from the epoch")]
    TooFarFromEpoch,
}
