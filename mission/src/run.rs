//! Plans that were handed over, and their runs: what is kept of both.

use std::sync::Arc;

use crate::clock::UtcUs;
use crate::id::{LinkId, PassId, PlanId, Principal, RunId, SatelliteId, StationId};
use crate::plan::{Plan, Progress};

/// Plans that are in use at once.
pub const PLANS_MAX: usize = 64;
/// Passes that an operator may choose for one plan.
pub const PICKS_MAX: usize = 64;

/// A plan as it was handed over, with how it stands: inserted or brought up to date.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRecord {
    /// Id, kept over updates. Another text under the same name is another plan, and withdraws the one before.
    pub id: PlanId,
    /// The station that runs it.
    pub station: StationId,
    /// The plan.
    pub plan: Arc<Plan>,
    /// Its text as it was handed over; opaque to the engine, which never reads it.
    pub text: Arc<str>,
    /// When it was handed over.
    pub added_at: UtcUs,
    /// By whom.
    pub who: Principal,
    /// It may run.
    pub armed: bool,
    /// Passes that an operator chose: an instant within each, as a rule its TCA.
    pub picks: Vec<UtcUs>,
    /// When it was withdrawn, or another took its name; `None` while it is in use.
    pub withdrawn_at: Option<UtcUs>,
}

/// An armed plan in one pass: inserted or brought up to date.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRecord {
    /// Id, kept over updates.
    pub id: RunId,
    /// Which plan.
    pub plan: PlanId,
    /// Whom it commands.
    pub satellite: SatelliteId,
    /// From which station.
    pub station: StationId,
    /// Over which link, once that is decided.
    pub link: Option<LinkId>,
    /// The pass, once it began.
    pub pass: Option<PassId>,
    /// The begin of the contact, as it was last known.
    pub aos_at: UtcUs,
    /// Its end, as it was last known.
    pub los_at: UtcUs,
    /// How it stands.
    pub state: RunState,
    /// How far it has come.
    pub progress: Progress,
    /// When it was last changed.
    pub at: UtcUs,
}

/// How a run stands.
#[derive(Debug, Clone, PartialEq)]
pub enum RunState {
    /// Its pass is to come, and scheduled.
    Planned,
    /// Its pass lasts, and something stands in the way; what, as a sentence.
    Waiting(String),
    /// It runs.
    Running,
    /// An operator has taken over.
    Held,
    /// It is over; how stands in its progress.
    Ended,
    /// It did not run; why, as a sentence.
    Missed(String),
    /// Its pass was given to something else, or is gone; why, as a sentence.
    Dropped(String),
}

impl RunState {
    /// The word in the database and on the wire.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Planned => "planned",
            Self::Waiting(_) => "waiting",
            Self::Running => "running",
            Self::Held => "held",
            Self::Ended => "ended",
            Self::Missed(_) => "missed",
            Self::Dropped(_) => "dropped",
        }
    }

    /// Nothing follows it.
    pub const fn is_final(&self) -> bool {
        matches!(self, Self::Ended | Self::Missed(_) | Self::Dropped(_))
    }

    /// Why, where there is a why.
    pub fn why(&self) -> Option<&str> {
        match self {
            Self::Waiting(why) | Self::Missed(why) | Self::Dropped(why) => Some(why),
            Self::Planned | Self::Running | Self::Held | Self::Ended => None,
        }
    }
}
