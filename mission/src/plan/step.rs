//! A plan and its steps.

use std::fmt;

use protocol::Telecommand;

use super::approval::Approval;
use super::condition::Condition;
use super::rule::AttachRule;
use crate::id::{PlanName, SatelliteId};
use crate::record::Gate;

/// What to do with one satellite in one pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Its name, unique at a station.
    pub name: PlanName,
    /// Whom it commands.
    pub satellite: SatelliteId,
    /// Higher goes first, among plans that want the same antenna and for its commands in the queue; 0 is usual.
    pub priority: i16,
    /// What a pass with it is worth to the scheduler, against other plans of the same priority; 1 is usual.
    pub worth: f64,
    /// The least pass that it takes.
    pub min_pass: MinPass,
    /// Ends after this long in one pass, in microseconds; `None`: at LOS.
    pub limit_us: Option<u64>,
    /// What becomes of what is undone at LOS.
    pub at_los: AtLos,
    /// Whether it may make the station transmit.
    pub transmit: bool,
    /// The passes that it attaches itself to; `None`: only those that an operator chooses.
    pub attach: Option<AttachRule>,
    /// What to do, in this order.
    pub steps: Vec<Step>,
}

/// The least pass that a plan takes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MinPass {
    /// Greatest elevation of the pass, degrees.
    pub max_elevation_deg: f64,
    /// Length of the pass, microseconds.
    pub duration_us: u64,
}

/// What becomes of what is undone at LOS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AtLos {
    /// It stays undone.
    #[default]
    Stop,
    /// It is done in the next pass.
    FinishLater,
}

/// One step of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// What.
    pub action: Action,
    /// What must hold before it begins (before each of its telecommands).
    pub when: Condition,
    /// The longest that it may take, waiting for its conditions included, in microseconds; `None`: until LOS.
    pub limit_us: Option<u64>,
    /// What follows when it fails.
    pub on_failure: OnFailure,
}

/// What a step does.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Listens, and transmits nothing.
    Listen {
        /// For so long, microseconds.
        for_us: u64,
    },
    /// Sends telecommands, each after the one before it was answered.
    Send(Send),
    /// Waits until something holds; fails when it does not within the time.
    WaitFor {
        /// What.
        until: Condition,
        /// For so long at most, microseconds.
        timeout_us: u64,
    },
    /// Brings the satellite's image home; ends when it is whole or the step's limit is over.
    DownloadImage,
    /// Does steps again and again.
    Repeat {
        /// Which.
        steps: Vec<Step>,
        /// Until this holds after a round; `None`: always `at_most` rounds.
        until: Option<Condition>,
        /// So many rounds at most.
        at_most: u32,
    },
}

/// Telecommands of one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Send {
    /// The telecommands, in this order. A SetTimestamp with time 0 carries the time at which it is asked for.
    pub telecommands: Vec<Telecommand>,
    /// Higher goes first in the queue; `None`: the plan's.
    pub priority: Option<i16>,
    /// How often one may be radiated; `None` for the station's default.
    pub attempts: Option<u16>,
    /// When one may be radiated.
    pub gate: Gate,
    /// Who allowed it beforehand; required where one is critical.
    pub approval: Option<Approval>,
}

/// What follows when a step fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OnFailure {
    /// The run ends.
    #[default]
    Abort,
    /// The rest of the enclosing repeat is left out; outside of one, the next step follows.
    Skip,
    /// The next step follows.
    Continue,
}

/// The number of something that a run asks for, unique in the run: its position in the plan with every repeat written
/// out in full. The same step of the same round has the same number in every life, so it is also the key under which
/// an ask counts once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ordinal(pub u64);

impl fmt::Display for Ordinal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Action {
    /// All names, as plans and reports have them.
    pub const NAMES: [&str; 6] =
        ["listen", "command", "wait-for", "download-image", "upload-schedule", "repeat-until"];

    /// The name, as plans and reports have it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Listen { .. } => "listen",
            Self::Send(send) => match send.telecommands.first() {
                Some(Telecommand::SetDownlinkSchedule(_) | Telecommand::UploadSchedule(_)) => {
                    "upload-schedule"
                }
                _ => "command",
            },
            Self::WaitFor { .. } => "wait-for",
            Self::DownloadImage => "download-image",
            Self::Repeat { .. } => "repeat-until",
        }
    }

    /// How many ordinals it takes, repeats written out; at least 1.
    pub fn ordinals(&self) -> u64 {
        match self {
            Self::Send(send) => send.telecommands.len().max(1) as u64,
            Self::Repeat { steps, at_most, .. } => ordinals(steps).saturating_mul(u64::from(*at_most)).max(1),
            _ => 1,
        }
    }

    /// Whether it makes the station transmit; a repeat does not of itself.
    pub const fn transmits(&self) -> bool {
        matches!(self, Self::Send(_) | Self::DownloadImage)
    }
}

/// How many ordinals these steps take, repeats written out.
pub fn ordinals(steps: &[Step]) -> u64 {
    steps.iter().fold(0, |sum, step| step.action.ordinals().saturating_add(sum))
}
