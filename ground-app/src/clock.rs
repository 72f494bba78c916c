//! The app's clock: the one file that reads this machine's time and waits. What it waits for is the network, which knows
//! no simulated time; what the satellite's time is, the server says ([`crate::model::ServerClock`]).

use std::time::Instant;

/// This machine's UTC in microseconds since 1970.
#[must_use]
#[expect(clippy::disallowed_methods, reason = "the one file of the app that reads the clock")]
pub fn unix_us() -> i64 {
    jiff::Timestamp::now().as_microsecond()
}

/// An instant to measure durations from; never goes back.
#[must_use]
#[expect(clippy::disallowed_methods, reason = "the one file of the app that reads the clock")]
pub fn instant() -> Instant {
    Instant::now()
}

/// Waits until this instant.
#[expect(clippy::disallowed_methods, reason = "the one file of the app that waits")]
pub(crate) async fn sleep_until(instant: Instant) {
    tokio::time::sleep_until(instant.into()).await;
}
