//! How tasks live and die: one soft stop, one hard stop, one list of tasks, one deadline.
//!
//! A task that ends before it was told to, with an error, by a panic or just so, stops everything; what it said becomes
//! the error of the run.

use std::future::Future;
use std::panic::AssertUnwindSafe;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use futures_util::FutureExt as _;
use futures_util::future::BoxFuture;
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::clock::within;

/// What a task may say when it ends.
pub type TaskError = Box<dyn std::error::Error + Send + Sync>;

/// A task that died.
#[derive(Debug, thiserror::Error)]
#[error("task {task} died")]
pub struct TaskFailure {
    /// Its name.
    pub task: String,
    /// What it said.
    #[source]
    pub error: TaskError,
}

/// A group of tasks that live and die together.
#[derive(Debug, Clone)]
pub struct Lifecycle {
    /// Told to finish.
    pub soft: CancellationToken,
    tracker: TaskTracker,
    failure: Arc<Mutex<Option<TaskFailure>>>,
    hard: CancellationToken,
}

impl Lifecycle {
    /// A group that is told to finish when `stop` is cancelled.
    pub fn new(stop: &CancellationToken) -> Self {
        Self {
            soft: stop.child_token(),
            tracker: TaskTracker::new(),
            failure: Arc::default(),
            hard: CancellationToken::new(),
        }
    }

    /// Starts a task. It must not end before [`Lifecycle::soft`] is cancelled.
    pub fn spawn<F>(&self, name: impl Into<String>, task: F)
    where
        F: Future<Output = Result<(), TaskError>> + Send + 'static,
    {
        let name = name.into();
        let this = self.clone();
        self.tracker.spawn(async move {
            let task = AssertUnwindSafe(task).catch_unwind();
            let outcome = tokio::select! {
                outcome = task => outcome,
                () = this.hard.cancelled() => {
                    tracing::warn!(task = %name, "task {name} did not finish in time and is left behind");
                    return;
                }
            };
            let error: TaskError = match outcome {
                Ok(Ok(())) if this.soft.is_cancelled() => return,
                Ok(Ok(())) => "it ended before it was told to".into(),
                Ok(Err(error)) => error,
                Err(panic) => format!("it panicked: {}", panic_text(panic.as_ref())).into(),
            };
            tracing::error!(task = %name, "task {name} died: {error}");
            let mut failure = this.failure.lock().unwrap_or_else(PoisonError::into_inner);
            failure.get_or_insert(TaskFailure { task: name, error });
            drop(failure);
            this.soft.cancel();
        });
    }

    /// Waits for all tasks, `limit` of wall time at most; the rest is abandoned. The number of those.
    pub async fn finish(&self, limit: Duration) -> usize {
        self.tracker.close();
        if within(limit, self.all_ended()).await.is_some() {
            return 0;
        }
        let left = self.tracker.len();
        self.hard.cancel();
        // Abandoned tasks let go of what they hold at their next await.
        let _ = within(Duration::from_millis(200), self.all_ended()).await;
        left
    }

    /// Owns what it waits for: a future that borrows the tracker is not `Send` enough for whoever spawns a run.
    fn all_ended(&self) -> BoxFuture<'static, ()> {
        let tracker = self.tracker.clone();
        async move { tracker.wait().await }.boxed()
    }

    /// The first task that died.
    pub fn failure(&self) -> Option<TaskFailure> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> &str {
    match (panic.downcast_ref::<&str>(), panic.downcast_ref::<String>()) {
        (Some(text), _) => text,
        (_, Some(text)) => text,
        _ => "without a word",
    }
}

/// Watches the signals of a process, for `main`: SIGTERM and SIGINT cancel `stop`, SIGHUP calls `reload`.
///
/// Comes back at the **second** SIGTERM or SIGINT: whoever asks twice does not want to wait.
///
/// # Errors
/// When the operating system lets us watch no signals.
pub async fn watch_signals(stop: CancellationToken, mut reload: impl FnMut()) -> std::io::Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut hang_up = signal(SignalKind::hangup())?;
    loop {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
            _ = hang_up.recv() => {
                reload();
                continue;
            }
        }
        if stop.is_cancelled() {
            return Ok(());
        }
        tracing::info!("stopping; a second signal stops at once");
        stop.cancel();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_task_that_dies_stops_the_others_and_is_named() {
        for (task, says) in [(0, "said so"), (1, "it panicked: oh"), (2, "before it was told to")] {
            let stop = CancellationToken::new();
            let life = Lifecycle::new(&stop);
            let soft = life.soft.clone();
            life.spawn("well", async move {
                soft.cancelled().await;
                Ok(())
            });
            life.spawn("ill", async move {
                match task {
                    0 => Err("said so".into()),
                    1 => panic!("oh"),
                    _ => Ok(()),
                }
            });
            life.soft.cancelled().await;
            assert_eq!(life.finish(Duration::from_secs(5)).await, 0);
            let failure = life.failure().unwrap();
            assert_eq!(failure.task, "ill");
            assert!(failure.error.to_string().contains(says), "{failure:?}");
            assert!(!stop.is_cancelled(), "the caller's token is the caller's");
        }
    }

    #[tokio::test]
    async fn a_task_that_does_not_finish_is_left_behind() {
        let stop = CancellationToken::new();
        let life = Lifecycle::new(&stop);
        life.spawn("stubborn", std::future::pending());
        stop.cancel();
        assert_eq!(life.finish(Duration::from_millis(20)).await, 1);
        assert!(life.failure().is_none());
    }
}
