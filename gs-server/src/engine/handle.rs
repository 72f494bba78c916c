//! The engine as HTTP, the command line and the desktop app see it.

use std::sync::Arc;

use mission::{Accepted, Intent, Principal, Refusal, Status};
use tokio::sync::{mpsc, oneshot, watch};

use crate::clock::{BusyToken, Timer};
use crate::ops::metrics::Metrics;

/// Intents that may be under way at once; more are refused as [`IntentError::Overloaded`].
pub(crate) const INTENTS: usize = 64;

/// What became of an intent; durable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Done {
    /// What became of it.
    pub accepted: Accepted,
    /// It had been accepted before, under the same idempotency key: nothing happened now.
    pub replayed: bool,
}

/// Why an intent was not accepted. Nothing was stored and nothing will be sent, except as [`IntentError::Stopping`] says.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum IntentError {
    /// The engine says no.
    #[error("{0}")]
    Refused(Refusal),
    /// The same idempotency key was used for another request.
    #[error("this idempotency key was used for another request: choose a new one")]
    KeyReused,
    /// The server is stopping. Ask again with the same idempotency key after it is back: it tells whether the intent
    /// was still accepted.
    #[error("the server is stopping; ask again with the same idempotency key when it is back")]
    Stopping,
    /// Too many intents are under way.
    #[error("{INTENTS} requests are under way already; try again in a moment")]
    Overloaded,
    /// It could not be looked up whether the key was used.
    #[error("storage cannot be read at present; try again with the same idempotency key")]
    Storage,
}

/// An intent on its way in.
#[derive(Debug)]
pub(crate) struct Request {
    pub(crate) principal: Principal,
    pub(crate) idempotency_key: String,
    pub(crate) digest: [u8; 32],
    pub(crate) intent: Intent,
    pub(crate) answer: oneshot::Sender<(Result<Done, IntentError>, BusyToken)>,
    pub(crate) busy: BusyToken,
}

/// Questions whether the engine lives that may wait; whoever finds no place knows that it does not answer.
pub(crate) const PROBES: usize = 8;

/// A question whether the engine lives.
#[derive(Debug)]
pub(crate) struct Probe {
    pub(crate) answer: oneshot::Sender<BusyToken>,
    pub(crate) busy: BusyToken,
}

/// Cheap to clone.
#[derive(Clone)]
pub struct EngineHandle {
    pub(crate) requests: mpsc::Sender<Request>,
    pub(crate) probes: mpsc::Sender<Probe>,
    pub(crate) metrics: Metrics,
    pub(crate) status: watch::Receiver<Arc<Status>>,
    pub(crate) timer: Arc<dyn Timer>,
}

impl EngineHandle {
    /// Asks for something. Comes back when the answer is durable.
    ///
    /// The same principal, key and digest give the same answer again, whether the first is still under way, long done,
    /// or was given before a restart. `digest` is the SHA-256 of the request.
    ///
    /// # Errors
    /// [`IntentError`]; only after [`IntentError::Stopping`] may it have been accepted all the same.
    pub async fn intent(
        &self,
        principal: Principal,
        idempotency_key: String,
        digest: [u8; 32],
        intent: Intent,
    ) -> Result<Done, IntentError> {
        let (answer, answered) = oneshot::channel();
        let busy = self.timer.busy("intent");
        let request = Request { principal, idempotency_key, digest, intent, answer, busy };
        self.requests.try_send(request).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => IntentError::Overloaded,
            mpsc::error::TrySendError::Closed(_) => IntentError::Stopping,
        })?;
        match answered.await {
            Ok((result, _busy)) => result,
            Err(_) => Err(IntentError::Stopping),
        }
    }

    /// Whether the engine takes something in and answers. Waits as long as it takes.
    pub async fn answers(&self) -> bool {
        let (answer, answered) = oneshot::channel();
        let probe = Probe { answer, busy: self.timer.busy("probe") };
        self.probes.try_send(probe).is_ok() && answered.await.is_ok()
    }

    /// What is counted while it works.
    pub fn metrics(&self) -> &Metrics {
        &self.metrics
    }

    /// How the station is: the newest status of which everything is durable.
    pub fn status(&self) -> Arc<Status> {
        Arc::clone(&self.status.borrow())
    }

    /// The status, and each change of it (about ten a second at most).
    pub fn status_changes(&self) -> watch::Receiver<Arc<Status>> {
        self.status.clone()
    }
}
