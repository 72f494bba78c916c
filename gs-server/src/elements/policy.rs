//! When a source may be asked: pure functions of what is remembered of it.
//!
//! CelesTrak blocks who asks more often than its data change (every two hours) or goes on after an error; Space-Track
//! wants fewer than 30 requests a minute, and none at the full or half hour, when everybody comes. One request is made
//! for each address and interval, and a source that answers anything but 200 is left alone until an operator says so.

use mission::UtcUs;
use sha2::{Digest as _, Sha256};

use super::memory::State;
use crate::config::ElementsSection;

const MINUTE_US: i64 = 60_000_000;
/// An operator may ask a source that refused again, but no script may hammer it.
const AFTER_REFUSAL_US: i64 = 2 * MINUTE_US;
/// A source that could not be reached (no network) was not asked: it is tried again after this, then twice as long.
const UNREACHED_US: i64 = 15 * MINUTE_US;
/// Spread over this, so that not every station of the world comes in the same second.
const JITTER_US: i64 = 10 * MINUTE_US;

/// How often.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rules {
    min_age_us: i64,
    every_us: i64,
}

impl Rules {
    #[expect(clippy::cast_possible_truncation, reason = "checked: at most 720 hours")]
    pub(crate) fn of(section: &ElementsSection) -> Self {
        let us = |hours: f64| (hours * 3600e6) as i64;
        Self { min_age_us: us(section.min_age_h), every_us: us(section.every_h) }
    }

    /// When the server asks this source by itself; `None` when it waits for an operator. In the past: at once.
    pub(crate) fn next(&self, state: &State, logs_in: bool) -> Option<UtcUs> {
        if state.stopped {
            return None;
        }
        let jitter = |range_us: i64| spread(&state.url, state.asked_at_us.or(state.failed_at_us), range_us);
        let mut at = match state.asked_at_us {
            Some(asked) => asked.saturating_add(self.every_us).saturating_add(jitter(JITTER_US)),
            None => 0,
        };
        if let Some(failed) = state.failed_at_us
            && Some(failed) > state.asked_at_us
        {
            let doublings = state.failures.clamp(1, 16) - 1;
            let pause = (UNREACHED_US << doublings).min(self.every_us);
            let earliest = state.asked_at_us.map_or(0, |asked| asked.saturating_add(self.min_age_us));
            at = failed.saturating_add(pause).max(earliest);
        }
        Some(UtcUs(if logs_in { off_the_half_hour(at, jitter) } else { at }))
    }

    /// Whether an operator may have it asked now; until when not, otherwise.
    pub(crate) fn operator_may(&self, state: &State, now: UtcUs) -> Result<(), UtcUs> {
        let pause = if state.stopped { AFTER_REFUSAL_US } else { self.min_age_us };
        match state.asked_at_us.map(|asked| UtcUs(asked.saturating_add(pause))) {
            Some(until) if now < until => Err(until),
            _ => Ok(()),
        }
    }
}

/// The same instant, or the next one that lies 5 to 25 minutes after a full or half hour.
pub(super) fn off_the_half_hour(at: i64, jitter: impl Fn(i64) -> i64) -> i64 {
    let half_hour = 30 * MINUTE_US;
    let into = at.rem_euclid(half_hour);
    if (5 * MINUTE_US..=25 * MINUTE_US).contains(&into) {
        return at;
    }
    let start = if into < 5 * MINUTE_US { at - into } else { at - into + half_hour };
    start + 5 * MINUTE_US + jitter(20 * MINUTE_US)
}

/// A number below `range_us` that depends on the address and the last time only: no randomness, and no common beat.
fn spread(url: &str, last: Option<i64>, range_us: i64) -> i64 {
    let mut hash = Sha256::new();
    hash.update(url);
    hash.update(last.unwrap_or(0).to_le_bytes());
    let digest: [u8; 32] = hash.finalize().into();
    let number = digest.iter().take(7).fold(0_i64, |sum, byte| sum << 8 | i64::from(*byte));
    number % range_us.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HOUR_US: i64 = 60 * MINUTE_US;
    const NOW: i64 = 1_795_324_800_000_000;

    fn rules() -> Rules {
        Rules::of(&ElementsSection::default())
    }

    fn asked(ago_us: i64) -> State {
        State { url: "https://x.org/".into(), asked_at_us: Some(NOW - ago_us), ..State::default() }
    }

    #[test]
    fn a_new_source_is_asked_at_once_and_then_after_the_interval() {
        assert_eq!(rules().next(&State::default(), false), Some(UtcUs(0)));
        let next = rules().next(&asked(0), false).unwrap().0 - NOW;
        assert!((6 * HOUR_US..=6 * HOUR_US + JITTER_US).contains(&next), "{next}");
    }

    #[test]
    fn a_source_that_was_not_reached_is_tried_sooner_but_never_within_the_minimum_age() {
        let mut state = State { failed_at_us: Some(NOW), failures: 1, ..State::default() };
        assert_eq!(rules().next(&state, false), Some(UtcUs(NOW + 15 * MINUTE_US)));
        state.failures = 3;
        assert_eq!(rules().next(&state, false), Some(UtcUs(NOW + HOUR_US)));
        state.failures = 99;
        assert_eq!(rules().next(&state, false), Some(UtcUs(NOW + 6 * HOUR_US)));
        state.failures = 1;
        state.asked_at_us = Some(NOW - MINUTE_US);
        assert_eq!(rules().next(&state, false), Some(UtcUs(NOW - MINUTE_US + 2 * HOUR_US)));
        assert!(rules().operator_may(&state, UtcUs(NOW)).is_err());
    }

    #[test]
    fn an_operator_waits_for_the_minimum_age_and_alone_wakes_a_source_that_refused() {
        assert_eq!(rules().operator_may(&asked(HOUR_US), UtcUs(NOW)), Err(UtcUs(NOW + HOUR_US)));
        assert_eq!(rules().operator_may(&asked(2 * HOUR_US), UtcUs(NOW)), Ok(()));
        let refused = State { stopped: true, ..asked(3 * MINUTE_US) };
        assert_eq!(rules().next(&refused, false), None);
        assert_eq!(rules().operator_may(&refused, UtcUs(NOW)), Ok(()));
        let refused = State { stopped: true, ..asked(MINUTE_US) };
        assert!(rules().operator_may(&refused, UtcUs(NOW)).is_err());
    }

    proptest! {
        #[test]
        fn with_a_login_nobody_comes_near_the_half_hour(last in 0..NOW) {
            let state = State { asked_at_us: Some(last), ..State::default() };
            let at = rules().next(&state, true).unwrap().0;
            prop_assert!((5 * MINUTE_US..=25 * MINUTE_US).contains(&at.rem_euclid(30 * MINUTE_US)));
            prop_assert!(at >= last + 6 * HOUR_US && at <= last + 7 * HOUR_US);
        }
    }
}
