//! One alert and how it stands.

use super::condition::AlertKind;
use crate::clock::UtcUs;
use crate::id::{AlertId, Principal, SatelliteId};
use crate::level::Level;

/// An alert: one for each rule and subject while it lasts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alert {
    /// Its number, from 1, rising.
    pub id: AlertId,
    /// The rule that raised it.
    pub rule: String,
    /// What is watched.
    pub kind: AlertKind,
    /// What it is about.
    pub subject: String,
    /// The satellite it concerns, if one.
    pub satellite: Option<SatelliteId>,
    /// Its level now; once it has returned, the last one.
    pub level: Level,
    /// The gravest level it had.
    pub worst: Level,
    /// It holds now. What merely happened never holds.
    pub active: bool,
    /// One sentence that stands alone, of when it was raised or its level last changed.
    pub message: String,
    /// How often it came.
    pub times: u32,
    /// When it came first.
    pub raised_at: UtcUs,
    /// When it last came, changed its level or went.
    pub changed_at: UtcUs,
    /// Since when nobody has taken note, as far as escalation counts: when it was raised, or came back, or left its shelf.
    pub waiting_since: UtcUs,
    /// When it returned to normal; `None` while it holds.
    pub returned_at: Option<UtcUs>,
    /// Who took note of it and when.
    pub acknowledged: Option<Signed>,
    /// Put aside for a while.
    pub shelved: Option<Shelf>,
    /// Whose it is.
    pub assignee: Option<String>,
    /// What somebody wrote to it.
    pub note: Option<String>,
    /// When it was over: history from here on.
    pub closed_at: Option<UtcUs>,
    /// What its targets were told last.
    pub told: Option<Told>,
    /// Steps of escalation that were taken.
    pub escalated: u32,
}

/// Who, and when.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signed {
    /// Who.
    pub who: Principal,
    /// When.
    pub at: UtcUs,
}

/// A shelf: nobody is told until then.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shelf {
    /// Until when.
    pub until: UtcUs,
    /// Who put it there.
    pub who: Principal,
}

/// What was told, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Told {
    /// It held.
    pub active: bool,
    /// At this level.
    pub level: Level,
    /// It had come so often.
    pub times: u32,
    /// When it was told.
    pub at: UtcUs,
}

/// Where an alert is in its life (ISA-18.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AlertState {
    /// It holds, and nobody has taken note.
    Unacknowledged,
    /// It holds, and somebody knows.
    Acknowledged,
    /// It is over, and nobody has taken note.
    Returned,
    /// Put aside until a time.
    Shelved,
    /// Over and known: history.
    Closed,
}

impl AlertState {
    /// All states.
    pub const ALL: [Self; 5] =
        [Self::Unacknowledged, Self::Acknowledged, Self::Returned, Self::Shelved, Self::Closed];

    /// The word on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unacknowledged => "unacknowledged",
            Self::Acknowledged => "acknowledged",
            Self::Returned => "returned",
            Self::Shelved => "shelved",
            Self::Closed => "closed",
        }
    }
}

impl Alert {
    /// Where it is in its life.
    pub fn state(&self) -> AlertState {
        if self.closed_at.is_some() {
            AlertState::Closed
        } else if self.shelved.is_some() {
            AlertState::Shelved
        } else if !self.active {
            AlertState::Returned
        } else if self.acknowledged.is_some() {
            AlertState::Acknowledged
        } else {
            AlertState::Unacknowledged
        }
    }

    /// Somebody should look: open, not on a shelf, and nobody has taken note.
    pub fn wants_eyes(&self) -> bool {
        matches!(self.state(), AlertState::Unacknowledged | AlertState::Returned)
            && self.acknowledged.is_none()
    }
}
