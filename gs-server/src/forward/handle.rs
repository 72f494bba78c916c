//! The door of the API to what is passed on.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use mission::Principal;
use tokio::sync::mpsc;

use super::form::{Form, Sender};
use crate::clock::{BusyToken, Timer};
use crate::config::{ForwardKind, ForwardSection};
use crate::storage::{ForwardRow, Store, StoreError};

/// A target as it is now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ForwardTargetNow {
    /// Its name.
    pub name: String,
    /// How it is told.
    pub kind: ForwardKind,
    /// Where it leads, without secrets.
    pub shown: String,
    /// Frames are really sent.
    pub live: bool,
    /// Why the last attempt failed; `None` when it went through, or there was none since the start.
    pub failing: Option<String>,
}

/// What is passed on, and to whom. Cheap to clone; all clones are one.
#[derive(Clone)]
pub struct ForwardsHandle(Arc<Inner>);

struct Inner {
    store: Store,
    timer: Arc<dyn Timer>,
    targets: Vec<Known>,
    failing: Mutex<HashMap<String, String>>,
}

struct Known {
    section: ForwardSection,
    sender: Sender,
    news: mpsc::Sender<BusyToken>,
}

impl ForwardsHandle {
    pub(super) fn new(
        store: Store,
        timer: Arc<dyn Timer>,
        targets: Vec<(ForwardSection, Sender)>,
    ) -> (Self, Vec<mpsc::Receiver<BusyToken>>) {
        let (targets, news) = targets
            .into_iter()
            .map(|(section, sender)| {
                let (news, hear) = mpsc::channel(1);
                (Known { section, sender, news }, hear)
            })
            .unzip();
        (Self(Arc::new(Inner { store, timer, targets, failing: Mutex::default() })), news)
    }

    /// Each target.
    pub fn targets(&self) -> Vec<ForwardTargetNow> {
        let failing = self.0.failing.lock().unwrap_or_else(PoisonError::into_inner);
        let now = |known: &Known| ForwardTargetNow {
            name: known.section.name.clone(),
            kind: known.section.kind,
            shown: known.section.shown(),
            live: known.section.live,
            failing: failing.get(&known.section.name).cloned(),
        };
        self.0.targets.iter().map(now).collect()
    }

    /// Pauses a target, or lets it go on; `None`: there is no such target. Durable when it returns.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub async fn pause(&self, name: &str, pause: bool, who: &Principal) -> Result<Option<bool>, StoreError> {
        let Some(known) = self.known(name) else { return Ok(None) };
        let place = self.0.store.forward_target(name, known.section.since().is_some()).await?;
        let changed = self.0.store.pause_forwards(&place, pause, who, self.0.timer.now().utc).await?;
        self.nudge(known);
        Ok(Some(changed))
    }

    /// Has one sent again; `None`: it is in a state in which there is nothing to repeat.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub async fn retry(&self, id: i64, who: &Principal) -> Result<Option<ForwardRow>, StoreError> {
        let row = self.0.store.retry_forward(id, who, self.0.timer.now().utc).await?;
        if let Some(known) = row.as_ref().and_then(|row| self.known(&row.target)) {
            self.nudge(known);
        }
        Ok(row)
    }

    /// What is or was sent for a reception; `None`: its target is not configured any more, or it cannot be sent.
    ///
    /// # Errors
    /// [`StoreError`] when the archive cannot be read.
    pub(crate) async fn form(&self, row: &ForwardRow) -> Result<Option<Form>, StoreError> {
        let Some(known) = self.known(&row.target) else { return Ok(None) };
        let subject = self.0.store.forward_subject(row).await?;
        Ok(known.sender.form(row, &subject).ok())
    }

    fn known(&self, name: &str) -> Option<&Known> {
        self.0.targets.iter().find(|known| known.section.name == name)
    }

    /// The target looks now; when it is about to, it need not be told twice.
    fn nudge(&self, known: &Known) {
        let _ = known.news.try_send(self.0.timer.busy("forward"));
    }

    /// How the last attempt of a target ended.
    pub(super) fn note(&self, target: &str, error: Option<&str>) {
        let mut failing = self.0.failing.lock().unwrap_or_else(PoisonError::into_inner);
        match error {
            Some(error) => failing.insert(target.to_owned(), error.to_owned()),
            None => failing.remove(target),
        };
    }
}
