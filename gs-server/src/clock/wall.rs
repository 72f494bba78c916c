//! Waits in wall time, for what happens in the real world whatever the simulated time is: a hung driver, a shutdown
//! deadline, the next look for an unplugged adapter.

use std::future::Future;
use std::time::Duration;

/// Sleeps in wall time.
#[expect(clippy::disallowed_methods, reason = "the real world does not run on simulated time")]
pub(crate) async fn wall_sleep(duration: Duration) {
    tokio::time::sleep(duration).await;
}

/// The result of `future`, or `None` when it took longer than `limit` in wall time.
#[expect(clippy::disallowed_methods, reason = "the real world does not run on simulated time")]
pub(crate) async fn within<F: Future>(limit: Duration, future: F) -> Option<F::Output> {
    tokio::time::timeout(limit, future).await.ok()
}
