//! The machine's clock, and the machine's clock times a factor.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use mission::{Clock, MonoUs, Now, UtcUs};

use super::{BusyToken, Timer};

/// The machine's clock: monotonic time since the clock was made, UTC as the kernel has it.
#[derive(Debug, Clone, Copy)]
pub struct SystemClock {
    origin: Instant,
}

impl SystemClock {
    /// A clock whose monotonic scale begins now.
    #[expect(clippy::disallowed_methods, reason = "this is the one place that reads the machine's clock")]
    pub fn new() -> Self {
        Self { origin: Instant::now() }
    }
}

impl Default for SystemClock {
    fn default() -> Self {
        Self::new()
    }
}

#[expect(clippy::disallowed_methods, reason = "this is the one place that reads the machine's clock")]
fn elapsed_us(origin: Instant) -> u64 {
    u64::try_from(Instant::now().saturating_duration_since(origin).as_micros()).unwrap_or(u64::MAX)
}

#[expect(clippy::disallowed_methods, reason = "this is the one place that reads the machine's clock")]
fn utc_us() -> i64 {
    match SystemTime::now().duration_since(UNIX_EPOCH) {
        Ok(after) => i64::try_from(after.as_micros()).unwrap_or(i64::MAX),
        Err(before) => i64::try_from(before.duration().as_micros()).map_or(i64::MIN, |us| -us),
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "this is the one place that sets a timer on the machine's clock"
)]
async fn until(origin: Instant, us: u64) {
    // A wait beyond what the timer wheel can express is a wait for ever.
    match origin.checked_add(Duration::from_micros(us)) {
        Some(at) => tokio::time::sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}

impl Clock for SystemClock {
    fn now(&self) -> Now {
        Now { mono: MonoUs(elapsed_us(self.origin)), utc: UtcUs(utc_us()) }
    }

    fn is_simulated(&self) -> bool {
        false
    }
}

impl Timer for SystemClock {
    fn sleep_until(&self, at: MonoUs) -> BoxFuture<'static, BusyToken> {
        until(self.origin, at.0).map(|()| BusyToken::idle()).boxed()
    }

    fn busy(&self, _who: &'static str) -> BusyToken {
        BusyToken::idle()
    }
}

/// The machine's clock times a factor, simulated: for a server and a twin in two processes.
///
/// Both run at the same pace when both are given the same factor; their origins may differ, since only differences of
/// time pass between them.
#[derive(Debug, Clone, Copy)]
pub struct ScaledClock {
    origin: Instant,
    utc_at_origin: UtcUs,
    speed: f64,
}

impl ScaledClock {
    /// Begins now, at the machine's UTC, and runs `speed` times as fast. Factors that are not finite and positive
    /// count as 1.
    #[expect(clippy::disallowed_methods, reason = "this is the one place that reads the machine's clock")]
    pub fn new(speed: f64) -> Self {
        let speed = if speed.is_finite() && speed > 0.0 { speed } else { 1.0 };
        Self { origin: Instant::now(), utc_at_origin: UtcUs(utc_us()), speed }
    }

    /// The same, but the clock shows `utc` now.
    #[must_use]
    pub fn starting_at(speed: f64, utc: UtcUs) -> Self {
        Self { utc_at_origin: utc, ..Self::new(speed) }
    }
}

impl Clock for ScaledClock {
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "microseconds stay far below 2^53 for 285 years; the product is not negative and saturates"
    )]
    fn now(&self) -> Now {
        let us = (elapsed_us(self.origin) as f64 * self.speed) as u64;
        Now { mono: MonoUs(us), utc: self.utc_at_origin.plus(i64::try_from(us).unwrap_or(i64::MAX)) }
    }

    fn is_simulated(&self) -> bool {
        true
    }
}

impl Timer for ScaledClock {
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "microseconds stay far below 2^53 for 285 years; the quotient is not negative and saturates"
    )]
    fn sleep_until(&self, at: MonoUs) -> BoxFuture<'static, BusyToken> {
        // Rounded up, so that the clock shows `at` or later when the sleeper wakes.
        let wall_us = (at.0 as f64 / self.speed).ceil() as u64 + 1;
        until(self.origin, wall_us).map(|()| BusyToken::idle()).boxed()
    }

    fn pace(&self) -> f64 {
        self.speed
    }

    fn busy(&self, _who: &'static str) -> BusyToken {
        BusyToken::idle()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_scaled_sleeper_wakes_at_its_time_and_not_before() {
        let clock = ScaledClock::new(1000.0);
        let at = clock.now().mono.plus(5_000_000);
        let _awake = clock.sleep_until(at).await;
        assert!(clock.now().mono >= at);
        assert!(clock.is_simulated());
    }

    #[tokio::test]
    async fn utc_and_monotonic_of_a_scaled_clock_run_together() {
        let clock = ScaledClock::starting_at(50.0, UtcUs(1_000));
        let now = clock.now();
        assert_eq!(now.utc.0 - 1_000, i64::try_from(now.mono.0).unwrap());
    }

    #[tokio::test]
    async fn the_machines_clock_is_real() {
        let clock = SystemClock::new();
        let at = clock.now().mono.plus(2_000);
        let _awake = clock.sleep_until(at).await;
        assert!(clock.now().mono >= at && !clock.is_simulated());
    }
}
