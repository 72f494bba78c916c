//! Waiting for the real world: these tests watch real processes, so their clock is the machine's.

use std::time::{Duration, Instant};

/// Long enough for anything on a loaded machine.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The machine's monotonic clock.
#[must_use]
#[expect(clippy::disallowed_methods, reason = "real processes are watched from outside, in real time")]
pub fn now() -> Instant {
    Instant::now()
}

/// The machine's clock in UTC, microseconds since 1970.
///
/// # Panics
/// When the machine believes that it is before 1970.
#[must_use]
#[expect(clippy::disallowed_methods, reason = "real processes are watched from outside, in real time")]
pub fn utc_us() -> i64 {
    let since =
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("a clock that is set");
    i64::try_from(since.as_micros()).expect("a time of these ages")
}

/// Stands still for this long.
#[expect(clippy::disallowed_methods, reason = "real processes are watched from outside, in real time")]
pub fn pause(duration: Duration) {
    std::thread::sleep(duration);
}

/// Asks until there is an answer, and gives it with the time that it took.
///
/// # Panics
/// When there is none within `limit`; `what` says what was waited for.
pub fn until<T>(what: &str, limit: Duration, mut ask: impl FnMut() -> Option<T>) -> (T, Duration) {
    let began = now();
    loop {
        if let Some(answer) = ask() {
            return (answer, began.elapsed());
        }
        assert!(began.elapsed() < limit, "after {limit:?} still not: {what}");
        pause(Duration::from_millis(10));
    }
}
