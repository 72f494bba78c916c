//! Plans that are written and not handed over yet: kept with the desk, so that neither a lost line nor a killed window
//! takes them.

use std::collections::BTreeMap;

use api::{PlanText, PlanView};
use serde::{Deserialize, Serialize};

/// Plans being written, by name, and the one that is looked at.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct PlanDesk {
    /// The plan that editor, rehearsal and timeline look at.
    pub chosen: Option<String>,
    /// What was changed and not handed over.
    pub drafts: BTreeMap<String, PlanDraft>,
    /// Blind downlinks being laid out, in order of time.
    pub slots: Vec<SlotDraft>,
}

/// Chunks that the satellite is to send blind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlotDraft {
    /// From when, UTC in microseconds since 1970.
    pub at_us: i64,
    /// The first chunk.
    pub first: u16,
    /// How many, 1 to 64.
    pub count: u16,
}

/// A plan being written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanDraft {
    /// The plan at the server that it began from, by its number; `None`: a new one.
    pub base: Option<u64>,
    /// The plan as it was last understood.
    pub plan: PlanText,
    /// Text that is being written and is no plan yet; `None`: `plan` is all there is.
    #[serde(default)]
    pub unread: Option<String>,
}

impl PlanDraft {
    /// Begins from the server's.
    #[must_use]
    pub fn of(view: &PlanView) -> Self {
        Self { base: Some(view.id), plan: view.plan.clone(), unread: None }
    }

    /// Begins with this.
    #[must_use]
    pub fn new(plan: PlanText) -> Self {
        Self { base: None, plan, unread: None }
    }

    /// The server's copy, where it is another one than that which this began from: somebody else was there.
    #[must_use]
    pub fn overtaken<'a>(&self, theirs: Option<&'a PlanView>) -> Option<&'a PlanView> {
        theirs.filter(|view| Some(view.id) != self.base && view.plan != self.plan)
    }
}
