//! What the machine of a run sees, and what it wishes.

use std::collections::BTreeMap;

use protocol::Telecommand;

use super::condition::Reading;
use super::progress::{RunEnd, Ticket};
use super::step::Ordinal;
use crate::clock::{Now, UtcUs};
use crate::level::Level;
use crate::record::Gate;
use crate::stage::Stage;

/// The pass as it is known now: from AOS to LOS at the station's mask. New elements may move both in mid-pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContactWindow {
    /// Begin.
    pub aos: UtcUs,
    /// End, not included.
    pub los: UtcUs,
}

/// The world as a run sees it at one moment.
#[derive(Debug, Clone, Copy)]
pub struct RunView<'a> {
    /// When.
    pub now: Now,
    /// The pass.
    pub window: ContactWindow,
    /// How high the satellite stands, degrees; `None` when nobody knows.
    pub elevation_deg: Option<f64>,
    /// How long ago a frame of the satellite was received, microseconds; `None`: never.
    pub heard_ago_us: Option<u64>,
    /// The newest values, by name; those of [`PlanRun::parameters`](super::PlanRun::parameters) suffice.
    pub telemetry: &'a BTreeMap<String, Reading>,
    /// What became of what the run asked for. What is not in here was not accepted (yet).
    pub asked: &'a BTreeMap<Ordinal, AskState>,
    /// An operator has taken over: nothing is asked for, time runs on.
    pub held: bool,
}

/// What became of something that a run asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AskState {
    /// It was refused, and nothing was stored.
    Refused(String),
    /// It is a command, and stands here.
    Command(crate::CommandId, Stage),
    /// It is a download.
    Download(crate::DownloadId, DownloadView),
}

/// How a download stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DownloadView {
    /// Under way.
    Active,
    /// The image is whole.
    Complete,
    /// It ended without a whole image: withdrawn, or there is none.
    Ended,
}

impl AskState {
    /// The row that it became, if it did.
    pub fn ticket(&self) -> Option<Ticket> {
        match self {
            Self::Refused(_) => None,
            Self::Command(id, _) => Some(Ticket::Command(*id)),
            Self::Download(id, _) => Some(Ticket::Download(*id)),
        }
    }
}

/// What a run wants of the engine. All of it is asked for once in a life; asks count once under their ordinal.
#[expect(clippy::large_enum_variant, reason = "a wish lives for one call")]
#[derive(Debug, Clone, PartialEq)]
pub enum Wish {
    /// Queue this telecommand.
    Command {
        /// Under this number.
        ordinal: Ordinal,
        /// Its step, e.g. `steps[3]`.
        step: String,
        /// What.
        telecommand: Telecommand,
        /// Higher goes first.
        priority: i16,
        /// How often it may be radiated; `None` for the station's default.
        attempts: Option<u16>,
        /// When it may be radiated.
        gate: Gate,
        /// Not radiated after this: the end of the step, of the plan, or LOS.
        expires_at: UtcUs,
        /// Whoever approved it; always there where the telecommand is critical.
        approved_by: Option<crate::Principal>,
    },
    /// Bring the satellite's image home.
    Download {
        /// Under this number.
        ordinal: Ordinal,
        /// Its step.
        step: String,
    },
    /// Withdraw what was asked for under this number, if it has not been radiated; what was not accepted yet must
    /// not be accepted any more.
    Cancel {
        /// Which.
        ordinal: Ordinal,
        /// Why, as a sentence.
        why: String,
    },
    /// Tell.
    Note {
        /// How grave.
        level: Level,
        /// What, as a sentence.
        text: String,
    },
    /// The run is over; always the last wish.
    Done(RunEnd),
}
