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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::step::{AtLos, MinPass};
    use crate::{PlanName, UtcUs};

    fn plan(attach: Option<AttachRule>) -> Plan {
        Plan {
            name: PlanName::new("test").unwrap(),
            satellite: SatelliteId::new("pixelsat-1").unwrap(),
            priority: 0,
            worth: 1.0,
            min_pass: MinPass { max_elevation_deg: 10.0, duration_us: 100_000_000 },
            limit_us: None,
            at_los: AtLos::Stop,
            transmit: false,
            attach,
            steps: Vec::new(),
        }
    }

    /// Culminates at 23:30 UTC.
    fn pass() -> PassFacts {
        PassFacts {
            satellite: SatelliteId::new("pixelsat-1").unwrap(),
            tca: UtcUs((20_000 * 1440 + 23 * 60 + 30) * MINUTE_US),
            max_elevation_deg: 30.0,
            duration_us: 400_000_000,
            sunlit: Some(false),
            matched_before: 4,
        }
    }

    #[test]
    fn each_part_of_a_rule_can_refuse() {
        let rule = AttachRule {
            min_max_elevation_deg: Some(30.0),
            hours_utc: vec![Hours { from_min: 18 * 60, to_min: 6 * 60 }],
            sunlit: Some(false),
            every: 2,
        };
        let with = |change: fn(&mut AttachRule, &mut PassFacts)| {
            let (mut rule, mut pass) = (rule.clone(), pass());
            change(&mut rule, &mut pass);
            plan(Some(rule)).attaches_to(&pass)
        };
        assert_eq!(with(|_, _| ()), Ok(()));
        assert_eq!(plan(None).attaches_to(&pass()), Err(NoMatch::NoRule));
        let other =
            |_: &mut AttachRule, pass: &mut PassFacts| pass.satellite = SatelliteId::new("x").unwrap();
        assert_eq!(with(other), Err(NoMatch::Satellite));
        let low = NoMatch::TooLow { found_deg: 29.9, wanted_deg: 30.0 };
        assert_eq!(with(|_, pass| pass.max_elevation_deg = 29.9), Err(low));
        let short = NoMatch::TooShort { found_s: 99, wanted_s: 100 };
        assert_eq!(with(|_, pass| pass.duration_us = 99_999_999), Err(short));
        assert_eq!(with(|_, pass| pass.tca = pass.tca.plus(13 * 3_600_000_000)), Err(NoMatch::Hours));
        let light = NoMatch::Light { wanted_sunlit: false };
        assert_eq!(with(|_, pass| pass.sunlit = Some(true)), Err(light.clone()));
        assert_eq!(with(|_, pass| pass.sunlit = None), Err(light));
        assert_eq!(with(|_, pass| pass.matched_before = 5), Err(NoMatch::NotItsTurn { every: 2 }));
        assert_eq!(with(|rule, pass| (rule.every, pass.matched_before) = (1, 5)), Ok(()));
    }

    #[test]
    fn hours_go_over_midnight() {
        let night = Hours { from_min: 18 * 60, to_min: 6 * 60 };
        let day = Hours { from_min: 6 * 60, to_min: 18 * 60 };
        for minute in 0..1440 {
            assert_ne!(night.contains(minute), day.contains(minute), "{minute}");
            assert!(Hours { from_min: 77, to_min: 77 }.contains(minute));
        }
        assert!(night.contains(18 * 60) && !night.contains(6 * 60));
    }
}
