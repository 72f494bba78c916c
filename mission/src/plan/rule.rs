//! Which passes a plan attaches itself to.

use super::step::Plan;
use crate::id::SatelliteId;

/// Every pass of the plan's satellite that matches; what is not given does not matter.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AttachRule {
    /// The greatest elevation of the pass is at least this, degrees.
    pub min_max_elevation_deg: Option<f64>,
    /// The pass culminates within one of these spans of the UTC day; empty: at any time.
    pub hours_utc: Vec<Hours>,
    /// The satellite is sunlit when it culminates, or in shadow.
    pub sunlit: Option<bool>,
    /// Only every so many-th of the passes that match otherwise; 1: all.
    pub every: u32,
}

/// A span of the UTC day, from one minute of the day to another, the second not included. `from > to` goes over
/// midnight, `from == to` is the whole day.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hours {
    /// First minute, 0..1440.
    pub from_min: u16,
    /// First minute after it, 0..1440.
    pub to_min: u16,
}

impl Hours {
    /// Whether a minute of the day lies in it.
    pub const fn contains(self, minute: u16) -> bool {
        if self.from_min < self.to_min {
            self.from_min <= minute && minute < self.to_min
        } else {
            self.from_min == self.to_min || minute >= self.from_min || minute < self.to_min
        }
    }
}

/// What a rule looks at.
#[derive(Debug, Clone, PartialEq)]
pub struct PassFacts {
    /// Whose pass.
    pub satellite: SatelliteId,
    /// Culmination, greatest elevation.
    pub tca: crate::UtcUs,
    /// The greatest elevation, degrees.
    pub max_elevation_deg: f64,
    /// From AOS to LOS, microseconds.
    pub duration_us: u64,
    /// The satellite is sunlit at culmination; `None` when nobody knows.
    pub sunlit: Option<bool>,
    /// How many earlier passes matched this plan's rule, `every` left aside. The caller counts from a fixed day on, so
    /// that the choice does not move with the list.
    pub matched_before: u64,
}

/// Why a pass is not one of the plan's.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoMatch {
    /// Another satellite's.
    #[error("the plan is for another satellite")]
    Satellite,
    /// The plan attaches itself to nothing.
    #[error("the plan has no attach rule")]
    NoRule,
    /// Too low.
    #[error("it culminates at {found_deg:.1}°, {wanted_deg}° is wanted")]
    TooLow {
        /// Greatest elevation of the pass, degrees.
        found_deg: f64,
        /// What the plan wants, degrees.
        wanted_deg: f64,
    },
    /// Too short.
    #[error("it lasts {found_s} s, {wanted_s} s are wanted")]
    TooShort {
        /// Length of the pass, whole seconds.
        found_s: u64,
        /// What the plan wants, whole seconds.
        wanted_s: u64,
    },
    /// At another time of day.
    #[error("it culminates outside the hours of the rule")]
    Hours,
    /// In the wrong light, or nobody knows.
    #[error("the satellite is not {} then", if *.wanted_sunlit { "known to be sunlit" } else { "known to be in shadow" })]
    Light {
        /// What the plan wants.
        wanted_sunlit: bool,
    },
    /// Not its turn.
    #[error("only one of {every} passes is taken")]
    NotItsTurn {
        /// One of so many.
        every: u32,
    },
}

const MINUTE_US: i64 = 60_000_000;
const DAY_MINUTES: i64 = 1440;

impl Plan {
    /// Whether the pass is good enough, rule or not: the least pass that the plan takes.
    ///
    /// # Errors
    /// Why not.
    pub fn takes(&self, pass: &PassFacts) -> Result<(), NoMatch> {
        if pass.satellite != self.satellite {
            return Err(NoMatch::Satellite);
        }
        high_enough(pass, self.min_pass.max_elevation_deg)?;
        if pass.duration_us < self.min_pass.duration_us {
            return Err(NoMatch::TooShort {
                found_s: pass.duration_us / 1_000_000,
                wanted_s: self.min_pass.duration_us.div_ceil(1_000_000),
            });
        }
        Ok(())
    }

    /// Whether the plan attaches itself to this pass. With [`NoMatch::NotItsTurn`] the pass matches otherwise, and
    /// counts for `matched_before` of the next.
    ///
    /// # Errors
    /// Why not.
    pub fn attaches_to(&self, pass: &PassFacts) -> Result<(), NoMatch> {
        let rule = self.attach.as_ref().ok_or(NoMatch::NoRule)?;
        self.takes(pass)?;
        if let Some(wanted_deg) = rule.min_max_elevation_deg {
            high_enough(pass, wanted_deg)?;
        }
        let minute = pass.tca.0.div_euclid(MINUTE_US).rem_euclid(DAY_MINUTES);
        let within = |hours: &Hours| u16::try_from(minute).is_ok_and(|minute| hours.contains(minute));
        if !rule.hours_utc.is_empty() && !rule.hours_utc.iter().any(within) {
            return Err(NoMatch::Hours);
        }
        match rule.sunlit {
            Some(wanted_sunlit) if pass.sunlit != Some(wanted_sunlit) => {
                return Err(NoMatch::Light { wanted_sunlit });
            }
            _ => {}
        }
        if pass.matched_before.is_multiple_of(u64::from(rule.every.max(1))) {
            Ok(())
        } else {
            Err(NoMatch::NotItsTurn { every: rule.every })
        }
    }
}

fn high_enough(pass: &PassFacts, wanted_deg: f64) -> Result<(), NoMatch> {
    if pass.max_elevation_deg >= wanted_deg {
        Ok(())
    } else {
        Err(NoMatch::TooLow { found_deg: pass.max_elevation_deg, wanted_deg })
    }
}
