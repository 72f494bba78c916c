//! Noise around a limit, links that come and go: one alert and a handful of words, not fifty.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::limits::{LimitRule, LimitState};

#[test]
fn noise_around_a_limit_gives_one_alert_whatever_the_seed() {
    for seed in 0..50 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let rule = LimitRule {
            parameter: "heartbeat.temp".into(),
            below: Vec::new(),
            above: vec![(Level::Warning, 40.0)],
            deadband: 2.0,
            persistence: 3,
        };
        let (mut limit, mut alerts, mut raised, mut messages) =
            (LimitState::new(rule, Level::Normal), machine(policy()), 0, 0);
        for s in 0..5_000 {
            // It climbs to the limit, dances there, and the worst of the noise stays within the deadband.
            let mean = 36.0 + (s as f64 / 200.0).min(4.0);
            limit.sample(mean + random.random_range(-1.5..1.5));
            let level = limit.level();
            let found = (level > Level::Normal).then(|| condition(level));
            let changes = alerts.observe(at(s), found.as_slice());
            raised += changes.alerts.iter().filter(|alert| alert.raised_at == at(s).utc).count();
            messages += changes.notices.len();
        }
        assert_eq!((raised, messages), (1, 1), "seed {seed}");
    }
}

#[test]
fn a_condition_that_flaps_beyond_all_deadbands_is_one_alert_and_few_words() {
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut alerts = machine(policy());
        let mut words = 0;
        for s in 0..3_600 {
            let found = random.random_bool(0.5).then(|| condition(Level::Warning));
            words += alerts.observe(at(s), found.as_slice()).notices.len();
        }
        assert_eq!(alerts.open().count(), 1, "seed {seed}");
        // The first, and one each settling time at most.
        assert!((2..=7).contains(&words), "seed {seed}: {words}");
    }
}

#[test]
fn a_link_that_is_away_for_a_moment_is_no_alert_and_one_that_flaps_is_one() {
    let mut alerts = machine(policy());
    let gone = Condition::new(AlertKind::Link, "e22", Level::Warning, "link e22 is unavailable");
    for s in 0..29 {
        assert!(alerts.observe(at(s), std::slice::from_ref(&gone)).is_empty(), "{s}");
    }
    assert!(alerts.observe(at(29), &[]).is_empty());
    for s in 100..130 {
        assert!(alerts.observe(at(s), std::slice::from_ref(&gone)).is_empty(), "{s}");
    }
    assert_eq!(told(&alerts.observe(at(130), std::slice::from_ref(&gone))), [(NoticeKind::Raised, "chat")]);
    // Back for less than a minute: not back.
    for s in 131..1000 {
        let found = (s % 60 == 0).then(|| gone.clone());
        assert!(alerts.observe(at(s), found.as_slice()).is_empty(), "{s}");
    }
}
