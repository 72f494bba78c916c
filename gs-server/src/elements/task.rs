//! The server's own rounds, and those that operators want: one task, so that no source is asked by two at once.

use std::sync::Arc;

use api::{ElementsSource, FetchReport};
use mission::MonoUs;
use tokio::sync::{mpsc, oneshot, watch};
use tokio_util::sync::CancellationToken;

use super::fetcher::{Asker, Fetcher};
use super::sets::Wanted;
use crate::clock::{BusyToken, Timer};

/// Requests that may wait; more are refused.
const INBOX: usize = 4;
/// The clock is looked at this often at least: it may have been set.
const LOOK_US: i64 = 1_800_000_000;

type Answer = oneshot::Sender<(FetchReport, BusyToken)>;

/// Why no round was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FetchError {
    /// Too many want one.
    #[error("a fetch is under way already; wait for it")]
    Busy,
    /// The server is stopping.
    #[error("the server is stopping")]
    Stopping,
}

/// The task as the API sees it. Cheap to clone.
#[derive(Clone)]
pub struct ElementsHandle {
    wanted: Arc<[Wanted]>,
    requests: Option<mpsc::Sender<(Answer, BusyToken)>>,
    sources: watch::Receiver<Arc<Vec<ElementsSource>>>,
    timer: Arc<dyn Timer>,
}

impl ElementsHandle {
    /// For a server without sources.
    pub fn without_sources(wanted: Vec<Wanted>, timer: Arc<dyn Timer>) -> Self {
        let (_, sources) = watch::channel(Arc::new(Vec::new()));
        Self { wanted: wanted.into(), requests: None, sources, timer }
    }

    /// How the satellites are found among others.
    pub fn wanted(&self) -> &[Wanted] {
        &self.wanted
    }

    /// How it stands with each source.
    pub fn sources(&self) -> Arc<Vec<ElementsSource>> {
        Arc::clone(&self.sources.borrow())
    }

    /// Has every source asked that may be asked.
    ///
    /// # Errors
    /// [`FetchError`].
    pub async fn fetch(&self) -> Result<FetchReport, FetchError> {
        let Some(requests) = &self.requests else { return Ok(FetchReport { sources: Vec::new() }) };
        let (answer, answered) = oneshot::channel();
        let busy = self.timer.busy("fetch of elements");
        requests.try_send((answer, busy)).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => FetchError::Busy,
            mpsc::error::TrySendError::Closed(_) => FetchError::Stopping,
        })?;
        answered.await.map(|(report, _busy)| report).map_err(|_| FetchError::Stopping)
    }
}

/// The task itself.
pub(crate) struct ElementsTask {
    fetcher: Fetcher,
    timer: Arc<dyn Timer>,
    inbox: mpsc::Receiver<(Answer, BusyToken)>,
    sources: watch::Sender<Arc<Vec<ElementsSource>>>,
}

impl ElementsTask {
    pub(crate) fn new(
        fetcher: Fetcher,
        wanted: Vec<Wanted>,
        timer: Arc<dyn Timer>,
    ) -> (Self, ElementsHandle) {
        let (requests, inbox) = mpsc::channel(INBOX);
        let (sources, shown) = watch::channel(Arc::new(fetcher.sources()));
        let handle = ElementsHandle {
            wanted: wanted.into(),
            requests: Some(requests),
            sources: shown,
            timer: Arc::clone(&timer),
        };
        (Self { fetcher, timer, inbox, sources }, handle)
    }

    /// Works until `stop`. A request under way is broken off then; it was written down before.
    pub(crate) async fn run(self, stop: CancellationToken) {
        let stopped = stop.clone();
        tokio::select! {
            () = self.work(stop) => {}
            () = stopped.cancelled() => {}
        }
    }

    async fn work(mut self, stop: CancellationToken) {
        let mut awake = self.timer.busy("elements");
        self.fetcher.take_up().await;
        loop {
            self.sources.send_replace(Arc::new(self.fetcher.sources()));
            let sleep = self.fetcher.next_due().map(|due| {
                let now = self.timer.now();
                let wait = due.0.saturating_sub(now.utc.0).clamp(0, LOOK_US);
                self.timer.sleep_until(MonoUs(now.mono.0.saturating_add(wait.unsigned_abs())))
            });
            drop(awake);
            let answer = tokio::select! {
                request = self.inbox.recv() => match request {
                    Some((answer, busy)) => {
                        awake = busy;
                        Some(answer)
                    }
                    // All handles are gone: the server ends.
                    None => return stop.cancelled().await,
                },
                busy = async { match sleep { Some(sleep) => sleep.await, None => std::future::pending().await } } => {
                    awake = busy;
                    None
                }
            };
            let asker = if answer.is_some() { Asker::Operator } else { Asker::Machine };
            let report = self.fetcher.round(asker, &mut awake).await;
            self.sources.send_replace(Arc::new(self.fetcher.sources()));
            if let Some(answer) = answer {
                // Whoever asked may have hung up; what was fetched is there all the same.
                let _ = answer.send((report, awake.clone()));
            }
        }
    }
}
