//! The door of the alerts: what operators do, what others report, and the test button.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

use mission::alert::{ActionError, Alert, Condition};
use mission::{AlertId, Level, Principal, UtcUs};
use tokio::sync::{Semaphore, mpsc, oneshot};

use super::message;
use super::target::{SendError, Target};
use crate::clock::{BusyToken, Timer};
use crate::config::TargetKind;
use crate::hub::Hub;
use crate::storage::{AlertBatch, Delivery, DeliveryState};

/// Requests that may wait; more are refused.
pub(super) const REQUESTS: usize = 32;
/// Tests that may be under way at once.
const TESTS: usize = 2;

/// What somebody does with an alert.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Takes note.
    Acknowledge,
    /// Puts it aside.
    Shelve {
        /// Until when.
        until: UtcUs,
    },
    /// Takes it off the shelf.
    Unshelve,
    /// Gives it to somebody.
    Assign {
        /// Whose it is; `None`: nobody's.
        to: Option<String>,
    },
}

impl Action {
    /// The verb in the audit.
    pub(super) const fn verb(&self) -> &'static str {
        match self {
            Self::Acknowledge => "alert.acknowledge",
            Self::Shelve { .. } => "alert.shelve",
            Self::Unshelve => "alert.unshelve",
            Self::Assign { .. } => "alert.assign",
        }
    }
}

/// What became of it; durable.
#[derive(Debug, Clone, PartialEq)]
pub struct Acted {
    /// The alert as it is now.
    pub alert: Alert,
    /// It had been done before, under the same idempotency key: nothing happened now.
    pub replayed: bool,
}

/// Why nothing was done.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ActionFailure {
    /// It cannot be.
    #[error(transparent)]
    Refused(#[from] ActionError),
    /// The same idempotency key was used for another request.
    #[error("this idempotency key was used for another request: choose a new one")]
    KeyReused,
    /// Too many want something.
    #[error("{REQUESTS} requests are under way already; try again in a moment")]
    Overloaded,
    /// It could not be kept.
    #[error("the archive takes nothing at present; try again with the same idempotency key")]
    Storage,
    /// The server stops.
    #[error("the server is stopping; ask again with the same idempotency key when it is back")]
    Stopping,
}

/// Why a test failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TestFailure {
    /// No such target.
    #[error("there is no target '{0}': the configuration's [[alerts.targets]] name them")]
    Unknown(String),
    /// Too many at once.
    #[error("{TESTS} tests are under way already; try again in a moment")]
    Busy,
    /// It was tried.
    #[error("the message to {target} did not go through: {why}")]
    Failed {
        /// To whom.
        target: String,
        /// Why; no secrets.
        why: String,
    },
}

/// A target and how it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TargetNow {
    /// Its name.
    pub name: String,
    /// How it is reached.
    pub kind: TargetKind,
    /// Where it leads, without secrets.
    pub shown: String,
    /// Why the last attempt failed; `None` when it went through, or there was none.
    pub failing: Option<String>,
}

/// What an operator wants.
pub(super) struct Request {
    pub(super) id: AlertId,
    pub(super) action: Action,
    pub(super) note: Option<String>,
    pub(super) who: Principal,
    pub(super) key: String,
    pub(super) digest: [u8; 32],
    pub(super) answer: oneshot::Sender<(Result<Acted, ActionFailure>, BusyToken)>,
    pub(super) busy: BusyToken,
}

/// Cheap to clone.
#[derive(Clone)]
pub struct AlertsHandle {
    pub(super) requests: mpsc::Sender<Request>,
    pub(super) targets: Arc<[Arc<Target>]>,
    pub(super) reported: Reported,
    pub(super) failing: Failing,
    pub(super) urgent: Urgent,
    pub(super) tests: Arc<Semaphore>,
    pub(super) timer: Arc<dyn Timer>,
    pub(super) station: String,
    pub(super) simulated: bool,
    pub(super) hub: Hub,
}

/// What others found, by who found it.
pub(super) type Reported = Arc<Mutex<BTreeMap<String, Condition>>>;
/// Why the last attempt of each target failed.
pub(super) type Failing = Arc<Mutex<BTreeMap<String, String>>>;

/// Grave messages that the archive does not take: they cannot wait for it.
pub(super) type Urgent = Arc<Mutex<Vec<Delivery>>>;

impl AlertsHandle {
    /// What is grave among what could not be kept; whether there is more of it than before. Not more than a few dozen:
    /// while much waits nothing new is looked at.
    pub(super) fn set_urgent(&self, unkept: &VecDeque<AlertBatch>) -> bool {
        let grave = |delivery: &&Delivery| {
            delivery.level >= Level::Critical && delivery.state == DeliveryState::Waiting
        };
        let found: Vec<Delivery> =
            unkept.iter().flat_map(|batch| &batch.deliveries).filter(grave).cloned().collect();
        let mut urgent = self.urgent.lock().unwrap_or_else(PoisonError::into_inner);
        let more = found.len() > urgent.len();
        *urgent = found;
        more
    }

    /// The semaphore for its tests.
    pub(super) fn test_places() -> Arc<Semaphore> {
        Arc::new(Semaphore::new(TESTS))
    }

    /// What `reporter` finds now, until it says otherwise: `None` when all is well. For what the alerts cannot see
    /// themselves, as a backup that failed.
    pub fn report(&self, reporter: &str, found: Option<Condition>) {
        let mut reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
        let before = match found.clone() {
            Some(condition) => reported.insert(reporter.to_owned(), condition),
            None => reported.remove(reporter),
        };
        drop(reported);
        if before != found {
            self.hub.ring();
        }
    }

    /// Does something with an alert. Comes back when it is durable.
    ///
    /// # Errors
    /// [`ActionFailure`].
    pub async fn act(
        &self,
        id: AlertId,
        action: Action,
        note: Option<String>,
        (who, key, digest): (Principal, String, [u8; 32]),
    ) -> Result<Acted, ActionFailure> {
        let (answer, answered) = oneshot::channel();
        let busy = self.timer.busy("alert");
        let request = Request { id, action, note, who, key, digest, answer, busy };
        self.requests.try_send(request).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => ActionFailure::Overloaded,
            mpsc::error::TrySendError::Closed(_) => ActionFailure::Stopping,
        })?;
        answered.await.map_err(|_| ActionFailure::Stopping)?.0
    }

    /// Each target.
    pub fn targets(&self) -> Vec<TargetNow> {
        let failing = self.failing.lock().unwrap_or_else(PoisonError::into_inner);
        let now = |target: &Arc<Target>| TargetNow {
            name: target.name.clone(),
            kind: target.kind,
            shown: target.shown.clone(),
            failing: failing.get(&target.name).cloned(),
        };
        self.targets.iter().map(now).collect()
    }

    /// Sends a test message, once, at once.
    ///
    /// # Errors
    /// [`TestFailure`].
    pub async fn test(&self, name: &str, who: &Principal) -> Result<(), TestFailure> {
        let unknown = || TestFailure::Unknown(name.chars().take(40).collect());
        let target = self.targets.iter().find(|target| target.name == name).ok_or_else(unknown)?;
        let _place = self.tests.try_acquire().map_err(|_| TestFailure::Busy)?;
        let _busy = self.timer.busy("test of a target");
        let letter = message::test(&self.station, self.simulated, who, self.timer.now().utc);
        let result = target.send(&letter).await;
        self.note(name, result.as_ref().err());
        result.map_err(|error| TestFailure::Failed { target: name.to_owned(), why: error.to_string() })
    }

    /// How the last attempt of a target ended.
    pub(super) fn note(&self, target: &str, error: Option<&SendError>) {
        let mut failing = self.failing.lock().unwrap_or_else(PoisonError::into_inner);
        match error {
            Some(error) => failing.insert(target.to_owned(), error.to_string()),
            None => failing.remove(target),
        };
    }
}
