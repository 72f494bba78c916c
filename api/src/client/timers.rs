//! The client's timers: the one place where it waits. What it waits for is the network, which knows no simulated time.

use std::time::Duration;

use tokio::time::Instant;

/// Waits until this instant.
#[expect(clippy::disallowed_methods, reason = "the one file of the client that waits")]
pub(super) async fn until(instant: Instant) {
    tokio::time::sleep_until(instant).await;
}

/// The instant that comes in so long.
#[expect(clippy::disallowed_methods, reason = "the one file of the client that waits")]
pub(super) fn after(duration: Duration) -> Instant {
    Instant::now() + duration
}

/// The output, or `None` when it takes longer.
#[expect(clippy::disallowed_methods, reason = "the one file of the client that waits")]
pub(super) async fn within<F: Future>(duration: Duration, future: F) -> Option<F::Output> {
    tokio::time::timeout(duration, future).await.ok()
}
