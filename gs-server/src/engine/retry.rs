//! When a batch that was not stored is tried again, and how often that is told: once, then about once a minute.

use std::time::Duration;

use mission::BatchId;

/// The first pause; each further one is twice as long, up to the second. In time of the real world, where the disk or the
/// database is, however fast the station's own clock goes.
const PAUSES: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(5)];
/// Of so many failures one is told, after the first: a minute at the longest pause.
const TOLD: u32 = 12;

/// Failures since a batch was last stored.
#[derive(Debug, Default)]
pub(super) struct Retry {
    failures: u32,
}

impl Retry {
    /// A batch was stored.
    pub(super) fn done(&mut self) {
        if self.failures > 0 {
            tracing::info!(tries = self.failures, "storage takes records again");
            self.failures = 0;
        }
    }

    /// A batch was not: after how many microseconds of a clock of this pace it is tried again.
    pub(super) fn failed(&mut self, batch: BatchId, reason: &str, pace: f64) -> u64 {
        self.failures = self.failures.saturating_add(1);
        let tries = self.failures;
        if tries == 1 {
            tracing::error!(batch = batch.0, "storage takes nothing: {reason}");
        } else if tries.is_multiple_of(TOLD) {
            tracing::warn!(batch = batch.0, tries, "storage still takes nothing: {reason}");
        } else {
            tracing::debug!(batch = batch.0, tries, "storage takes nothing: {reason}");
        }
        let [first, longest] = PAUSES;
        let pause = first.saturating_mul(1 << (tries - 1).min(8)).min(longest);
        pause.mul_f64(pace).as_micros().try_into().unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_in_real_time_and_begin_anew_after_a_success() {
        let mut retry = Retry::default();
        let mut pauses = |count: u32, pace: f64| -> Vec<u64> {
            (0..count).map(|_| retry.failed(BatchId(1), "away", pace) / 1_000_000).collect()
        };
        assert_eq!(pauses(6, 1.0), [1, 2, 4, 5, 5, 5]);
        assert_eq!(pauses(40, 20.0).last(), Some(&100), "five seconds of the real world");
        retry.done();
        assert_eq!(retry.failed(BatchId(2), "away", 1.0), 1_000_000);
    }
}
