//! Which counters the satellite has accepted, and which it may still accept.

use std::collections::VecDeque;

use protocol::{Counter, Nonce};

use crate::{Refusal, ReplayPolicy};

/// Nonces remembered by the ICD's rule.
const REMEMBERED: usize = 64;
/// How much lower than the highest a counter may be by the ICD's rule: 10 s of microseconds.
const LATE_MAX: u64 = 10_000_000;
/// Width of the forward window.
const FORWARD_MAX: u64 = 10;

/// The durable memory against replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AcceptedNonces {
    highest: Option<Counter>,
    recent: VecDeque<Nonce>,
    /// Highest counter that is no longer among `recent`.
    forgotten: Option<Counter>,
}

impl AcceptedNonces {
    /// The highest counter accepted; `None` before the first.
    #[must_use]
    pub fn highest(&self) -> Option<Counter> {
        self.highest
    }

    /// The last 64 nonces accepted, oldest first.
    pub fn recent(&self) -> impl ExactSizeIterator<Item = &Nonce> {
        self.recent.iter()
    }

    /// Whether a frame with this nonce, already authentic, may be obeyed.
    ///
    /// # Errors
    /// [`Refusal::Replayed`] for a nonce that is remembered, [`Refusal::Counter`] for a counter the policy refuses.
    pub fn check(&self, policy: ReplayPolicy, nonce: Nonce) -> Result<(), Refusal> {
        let counter = nonce.counter();
        let is_higher = self.highest.is_none_or(|highest| counter > highest);
        let accepted = match policy {
            ReplayPolicy::None => true,
            ReplayPolicy::StrictlyGreater => is_higher,
            ReplayPolicy::Icd => is_higher || self.may_be_late(nonce),
            ReplayPolicy::ForwardWindow10 => {
                let highest = self.highest.map_or(0, |highest| highest.0);
                counter.0 > highest && counter.0 - highest <= FORWARD_MAX
            }
        };
        match accepted {
            true => Ok(()),
            false if self.recent.contains(&nonce) => Err(Refusal::Replayed),
            false => Err(Refusal::Counter),
        }
    }

    /// Remembers an accepted nonce.
    pub fn accept(&mut self, nonce: Nonce) {
        self.highest = self.highest.max(Some(nonce.counter()));
        self.recent.push_back(nonce);
        if self.recent.len() > REMEMBERED
            && let Some(oldest) = self.recent.pop_front()
        {
            self.forgotten = self.forgotten.max(Some(oldest.counter()));
        }
    }

    fn may_be_late(&self, nonce: Nonce) -> bool {
        let counter = nonce.counter();
        self.highest.is_some_and(|highest| counter < highest && highest.0 - counter.0 <= LATE_MAX)
            && self.forgotten.is_none_or(|forgotten| counter > forgotten)
            && !self.recent.contains(&nonce)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nonce(counter: u64) -> Nonce {
        Nonce::new(Counter(counter), [1, 2, 3, 4])
    }

    fn after(counters: impl IntoIterator<Item = u64>) -> AcceptedNonces {
        let mut accepted = AcceptedNonces::default();
        counters.into_iter().for_each(|counter| accepted.accept(nonce(counter)));
        accepted
    }

    #[test]
    fn the_icd_rule_has_no_forward_limit_and_a_narrow_way_back() {
        let accepted = after([1_000_000_000]);
        let check = |counter| accepted.check(ReplayPolicy::Icd, nonce(counter));
        assert_eq!(check(1_000_000_001), Ok(()));
        assert_eq!(check(u64::MAX), Ok(()));
        assert_eq!(check(1_000_000_000), Err(Refusal::Replayed));
        assert_eq!(check(999_999_999), Ok(()));
        assert_eq!(check(990_000_000), Ok(()), "exactly 10 s lower");
        assert_eq!(check(989_999_999), Err(Refusal::Counter));
    }

    #[test]
    fn an_equal_counter_with_other_random_bytes_is_not_lower() {
        let other = Nonce::new(Counter(5), [9; 4]);
        assert_eq!(after([5]).check(ReplayPolicy::Icd, other), Err(Refusal::Counter));
    }

    #[test]
    fn what_fell_out_of_memory_is_refused_though_its_counter_is_near() {
        let accepted = after(1..=100);
        for counter in 1..=36 {
            assert_eq!(accepted.check(ReplayPolicy::Icd, nonce(counter)), Err(Refusal::Counter));
        }
        for counter in 37..=100 {
            assert_eq!(accepted.check(ReplayPolicy::Icd, nonce(counter)), Err(Refusal::Replayed));
        }
    }

    #[test]
    fn a_late_frame_is_accepted_once() {
        let mut accepted = after([100, 300]);
        assert_eq!(accepted.check(ReplayPolicy::Icd, nonce(200)), Ok(()));
        accepted.accept(nonce(200));
        assert_eq!(accepted.highest(), Some(Counter(300)));
        assert_eq!(accepted.check(ReplayPolicy::Icd, nonce(200)), Err(Refusal::Replayed));
    }

    #[test]
    fn the_other_policies_do_what_they_say() {
        let accepted = after([50]);
        let check = |policy, counter| accepted.check(policy, nonce(counter)).is_ok();
        assert!(check(ReplayPolicy::None, 50) && check(ReplayPolicy::None, 1));
        assert!(check(ReplayPolicy::StrictlyGreater, 51) && !check(ReplayPolicy::StrictlyGreater, 49));
        assert!(check(ReplayPolicy::ForwardWindow10, 60) && !check(ReplayPolicy::ForwardWindow10, 61));
        assert!(!check(ReplayPolicy::ForwardWindow10, 50));
        let first = AcceptedNonces::default();
        assert!(first.check(ReplayPolicy::StrictlyGreater, nonce(0)).is_ok());
        assert!(first.check(ReplayPolicy::ForwardWindow10, nonce(10)).is_ok());
        assert!(first.check(ReplayPolicy::ForwardWindow10, nonce(11)).is_err());
    }
}
