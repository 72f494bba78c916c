//! What people do with alerts.

use super::machine::{Alerts, Changes};
use super::model::{Alert, Shelf, Signed};
use crate::clock::{Now, UtcUs};
use crate::id::{AlertId, Principal};
use crate::level::Level;

/// The longest shelf: seven days, microseconds.
const SHELF_LONGEST_US: i64 = 7 * 86_400_000_000;
/// Characters of a note or of an assignee's name.
const NOTE_MAX: usize = 1000;

/// Why nothing was done.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ActionError {
    /// No such alert, or it is history.
    #[error(
        "alert {0} is not open: it is over and acknowledged, or there never was one; `gs-server alert list` tells those that are"
    )]
    NotOpen(AlertId),
    /// A shelf that ends before it begins, or is too long.
    #[error("a shelf ends later than now and within 7 days: choose another time")]
    Shelf,
    /// Too much text.
    #[error("a note or a name has {NOTE_MAX} characters at most: shorten it")]
    TooLong,
}

impl Alerts {
    /// Somebody knows. What is over closes with it. A second time changes nothing but the note.
    ///
    /// # Errors
    /// [`ActionError`].
    pub fn acknowledge(
        &mut self,
        now: Now,
        id: AlertId,
        who: &Principal,
        note: Option<&str>,
    ) -> Result<Changes, ActionError> {
        self.act(now, id, note, |alert| {
            if alert.acknowledged.is_some() {
                return None;
            }
            alert.acknowledged = Some(Signed { who: who.clone(), at: now.utc });
            Some(format!("acknowledged by {who}"))
        })
    }

    /// Nobody is told of it until then.
    ///
    /// # Errors
    /// [`ActionError`].
    pub fn shelve(
        &mut self,
        now: Now,
        id: AlertId,
        who: &Principal,
        until: UtcUs,
        note: Option<&str>,
    ) -> Result<Changes, ActionError> {
        if until <= now.utc || until > now.utc.plus(SHELF_LONGEST_US) {
            return Err(ActionError::Shelf);
        }
        self.act(now, id, note, |alert| {
            alert.shelved = Some(Shelf { until, who: who.clone() });
            Some(format!("put on the shelf by {who}"))
        })
    }

    /// Takes it off the shelf.
    ///
    /// # Errors
    /// [`ActionError`].
    pub fn unshelve(&mut self, now: Now, id: AlertId, who: &Principal) -> Result<Changes, ActionError> {
        self.act(now, id, None, |alert| {
            alert.shelved.take()?;
            (alert.waiting_since, alert.escalated) = (now.utc, 0);
            Some(format!("taken off the shelf by {who}"))
        })
    }

    /// Whose it is; `None`: nobody's.
    ///
    /// # Errors
    /// [`ActionError`].
    pub fn assign(
        &mut self,
        now: Now,
        id: AlertId,
        who: &Principal,
        to: Option<&str>,
        note: Option<&str>,
    ) -> Result<Changes, ActionError> {
        if to.is_some_and(is_too_long) {
            return Err(ActionError::TooLong);
        }
        self.act(now, id, note, |alert| {
            let to = to.map(str::trim).filter(|to| !to.is_empty()).map(str::to_owned);
            if alert.assignee == to {
                return None;
            }
            alert.assignee = to;
            Some(match &alert.assignee {
                Some(to) => format!("given to {to} by {who}"),
                None => format!("given to nobody by {who}"),
            })
        })
    }

    fn act(
        &mut self,
        now: Now,
        id: AlertId,
        note: Option<&str>,
        what: impl FnOnce(&mut Alert) -> Option<String>,
    ) -> Result<Changes, ActionError> {
        if note.is_some_and(is_too_long) {
            return Err(ActionError::TooLong);
        }
        let found = self.tracks.values_mut().find_map(|track| track.alert.as_mut().filter(|a| a.id == id));
        let alert = found.ok_or(ActionError::NotOpen(id))?;
        let mut changes = Changes::default();
        if let Some(note) = note.map(str::trim).filter(|note| !note.is_empty()) {
            alert.note = Some(note.to_owned());
            changes.keep(alert);
        }
        if let Some(told) = what(alert) {
            changes.note(alert, Level::Normal, &told);
        }
        self.settle(now, &mut changes);
        Ok(changes)
    }
}

fn is_too_long(text: &str) -> bool {
    text.chars().count() > NOTE_MAX
}
