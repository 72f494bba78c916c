//! Limits on values, in XTCE's five levels, with a deadband and persistence.
//!
//! A value that dances around a limit gives one alarm, not fifty: it must stand beyond the limit for `persistence`
//! samples in a row before the level rises, and come back by more than `deadband` for as many before it falls.

use crate::level::Level;

/// The limits of one value.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitRule {
    /// The parameter, e.g. `heartbeat.temp`.
    pub parameter: String,
    /// Below these it is at that level, each at most once; the gravest that holds counts.
    pub below: Vec<(Level, f64)>,
    /// Above these it is at that level.
    pub above: Vec<(Level, f64)>,
    /// How far it must come back behind a limit before that limit is left, in the value's unit, not negative.
    pub deadband: f64,
    /// How many samples in a row decide, at least 1.
    pub persistence: u16,
}

impl LimitRule {
    /// The level of a single value, `held` being the level that is in force: limits at or below it are only left
    /// behind by more than the deadband. NaN and infinities are no level: `None`.
    fn level_of(&self, value: f64, held: Level) -> Option<Level> {
        if !value.is_finite() {
            return None;
        }
        let slack = |level: Level| if level <= held { self.deadband } else { 0.0 };
        let low =
            self.below.iter().filter(|(level, limit)| value < limit + slack(*level)).map(|(l, _)| *l).max();
        let high =
            self.above.iter().filter(|(level, limit)| value > limit - slack(*level)).map(|(l, _)| *l).max();
        Some(low.max(high).unwrap_or_default())
    }
}

/// The state of one limit over time.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitState {
    rule: LimitRule,
    level: Level,
    candidate: Level,
    seen: u16,
}

impl LimitState {
    /// A limit whose level was this when it was last seen ([`Level::Normal`] for a new one).
    pub fn new(rule: LimitRule, level: Level) -> Self {
        Self { rule, level, candidate: level, seen: 0 }
    }

    /// The parameter.
    pub fn parameter(&self) -> &str {
        &self.rule.parameter
    }

    /// The level in force.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Whether this value is worse than the level in force.
    pub fn is_worse(&self, value: f64) -> bool {
        self.rule.level_of(value, self.level).is_some_and(|level| level > self.level)
    }

    /// Takes the next sample; the new level when it changes. An invalid value changes nothing.
    pub fn sample(&mut self, value: f64) -> Option<Level> {
        let level = self.rule.level_of(value, self.level)?;
        if level == self.level {
            self.seen = 0;
            self.candidate = level;
            return None;
        }
        // Samples on the same side of the level in force count together; the mildest of them is what has persisted.
        let same_side = self.seen > 0 && (self.candidate > self.level) == (level > self.level);
        self.candidate = match same_side {
            true if level > self.level => self.candidate.min(level),
            true => self.candidate.max(level),
            false => level,
        };
        self.seen = if same_side { self.seen + 1 } else { 1 };
        if self.seen < self.rule.persistence.max(1) {
            return None;
        }
        self.seen = 0;
        self.level = self.candidate;
        Some(self.level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rule(persistence: u16) -> LimitRule {
        LimitRule {
            parameter: "heartbeat.temp".into(),
            below: vec![(Level::Warning, -10.0), (Level::Critical, -20.0)],
            above: vec![(Level::Watch, 40.0), (Level::Severe, 60.0)],
            deadband: 2.0,
            persistence,
        }
    }

    #[test]
    fn noise_around_a_limit_gives_one_alarm() {
        let mut state = LimitState::new(rule(2), Level::Normal);
        let changes: Vec<_> =
            (0..100).filter_map(|i| state.sample(if i % 3 == 0 { 39.5 } else { 40.5 })).collect();
        assert_eq!(changes, [Level::Watch]);
    }

    #[test]
    fn one_wild_sample_gives_none() {
        let mut state = LimitState::new(rule(3), Level::Normal);
        for i in 0..30 {
            assert_eq!(state.sample(if i % 5 == 0 { 99.0 } else { 20.0 }), None);
        }
    }

    #[test]
    fn it_rises_and_falls_through_the_levels() {
        let mut state = LimitState::new(rule(1), Level::Normal);
        assert_eq!(state.sample(-15.0), Some(Level::Warning));
        assert_eq!(state.sample(-25.0), Some(Level::Critical));
        assert_eq!(state.sample(-19.0), None, "inside the deadband");
        assert_eq!(state.sample(-17.0), Some(Level::Warning));
        assert_eq!(state.sample(61.0), Some(Level::Severe));
        assert_eq!(state.sample(20.0), Some(Level::Normal));
    }

    #[test]
    fn an_invalid_value_is_no_level() {
        let mut state = LimitState::new(rule(1), Level::Normal);
        assert_eq!(state.sample(f64::NAN), None);
        assert_eq!(state.sample(f64::INFINITY), None);
        assert_eq!(state.level(), Level::Normal);
    }

    proptest! {
        #[test]
        fn a_level_that_changes_was_crossed_by_persistence_samples(values in proptest::collection::vec(-40.0..90.0f64, 1..200), persistence in 1u16..6) {
            let mut state = LimitState::new(rule(persistence), Level::Normal);
            let mut since = 0u16;
            for value in values {
                since += 1;
                if state.sample(value).is_some() {
                    prop_assert!(since >= persistence);
                    since = 0;
                }
            }
        }
    }
}
