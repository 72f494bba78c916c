//! When a source may be asked: pure functions of what is remembered of it.

use mission::UtcUs;
use sha2::{Digest as _, Sha256};

use super::memory::State;
use super::near::Over;
use crate::config::EarSection;

pub(super) const MINUTE_US: i64 = 60_000_000;
const HOUR_US: i64 = 60 * MINUTE_US;
/// The longest pause that is ours; the source may ask for longer ones.
const LONGEST_US: i64 = HOUR_US;
/// The longest that is granted to a source.
const GRANTED_S: u64 = 86_400;
/// Where nothing is known of passes, microseconds.
const UNKNOWN_US: i64 = 10 * MINUTE_US;

/// How often.
#[derive(Debug, Clone)]
pub(super) struct Rhythm {
    pub(super) far_us: i64,
    pub(super) near_us: i64,
    pub(super) per_hour: u32,
    name: String,
}

impl Rhythm {
    pub(super) fn of(section: &EarSection) -> Self {
        let (far, near) = section.rhythm_min();
        Self {
            far_us: i64::from(far) * MINUTE_US,
            near_us: i64::from(near) * MINUTE_US,
            per_hour: section.per_hour(),
            name: format!("{} {}", section.name, section.url()),
        }
    }

    /// When the next look is due; in the past: now.
    pub(super) fn next(&self, state: &State, over: Over, now: UtcUs) -> UtcUs {
        let period_us = match over {
            Over::Somebody => self.near_us,
            Over::Nobody => self.far_us,
            Over::Unknown => UNKNOWN_US.clamp(self.near_us, self.far_us),
        };
        // Not every station of the world in the same second.
        let due = match state.looked_at_us {
            None if state.asked_at_us.is_empty() => now.0,
            None => 0,
            Some(looked) => looked + period_us + self.jitter(looked, period_us / 10),
        };
        UtcUs(due.max(state.wait_until_us.unwrap_or(0)))
    }

    /// When to try again after a failure: as long as the source says, at least twice as long as the last time.
    pub(super) fn after_failure(&self, state: &State, after_s: Option<u64>, now: UtcUs) -> UtcUs {
        let doublings = state.failures.clamp(1, 8) - 1;
        let ours_us = ((2 * MINUTE_US) << doublings).min(LONGEST_US);
        let theirs_us = after_s.unwrap_or(0).min(GRANTED_S) as i64 * 1_000_000;
        now.plus(ours_us.max(theirs_us) + self.jitter(now.0, MINUTE_US / 2))
    }

    /// Whether there is room in the budget of the last hour, with `spare` requests left after.
    pub(super) fn may_ask(&self, state: &mut State, spare: u32, now: UtcUs) -> bool {
        state.asked_at_us.retain(|at| now.0 - at < HOUR_US);
        (state.asked_at_us.len() as u32).saturating_add(spare) < self.per_hour
    }

    /// A number below `range_us` that depends on the source and the last time only: no randomness, and no common beat.
    fn jitter(&self, last_us: i64, range_us: i64) -> i64 {
        let mut hash = Sha256::new();
        hash.update(&self.name);
        hash.update(last_us.to_le_bytes());
        let digest: [u8; 32] = hash.finalize().into();
        let number = digest.iter().take(7).fold(0_i64, |sum, byte| sum << 8 | i64::from(*byte));
        number % range_us.max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: UtcUs = UtcUs(1_790_000_000_000_000);

    fn rhythm() -> Rhythm {
        Rhythm { far_us: 30 * MINUTE_US, near_us: 5 * MINUTE_US, per_hour: 60, name: "x".into() }
    }

    #[test]
    fn a_look_is_due_sooner_near_a_pass() {
        let state = State { looked_at_us: Some(NOW.0), ..State::default() };
        assert_eq!(rhythm().next(&State::default(), Over::Nobody, NOW), NOW);
        for (over, from, until) in [(Over::Somebody, 5, 6), (Over::Unknown, 10, 11), (Over::Nobody, 30, 33)] {
            let wait = rhythm().next(&state, over, NOW).0 - NOW.0;
            assert!((from * MINUTE_US..=until * MINUTE_US).contains(&wait), "{wait}");
        }
    }

    #[test]
    fn pauses_double_until_an_hour_and_a_source_may_ask_for_longer() {
        let after = |failures, after_s| {
            let state = State { failures, ..State::default() };
            (rhythm().after_failure(&state, after_s, NOW).0 - NOW.0) / MINUTE_US
        };
        assert_eq!([1, 2, 3, 4, 5, 6, 99].map(|failures| after(failures, None)), [2, 4, 8, 16, 32, 60, 60]);
        assert_eq!(after(1, Some(7_200)), 120);
        assert_eq!(after(9, Some(1)), 60);
        assert_eq!(after(1, Some(u64::MAX)), 1_440);
    }

    #[test]
    fn no_more_than_the_budget_in_any_hour() {
        let mut state = State::default();
        let mut at = NOW;
        let mut asked = Vec::new();
        for _ in 0..1_000 {
            if rhythm().may_ask(&mut state, 0, at) {
                state.asked_at_us.push(at.0);
                asked.push(at.0);
            }
            at = at.plus(17_000_000);
        }
        for window in asked.windows(61) {
            assert!(window[60] - window[0] >= HOUR_US);
        }
        assert!(asked.len() > 200);
    }
}
