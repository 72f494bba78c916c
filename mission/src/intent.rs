//! What operators want, and what the engine says to it.

use std::sync::Arc;

use protocol::{Counter, KeyId, Telecommand};

use crate::clock::UtcUs;
use crate::id::{CommandId, DownloadId, IntentId, LinkId, PlanName, Principal, SatelliteId};
use crate::plan::{Condition, Plan};
use crate::record::Gate;

/// An intent with who, and the key under which it counts only once.
#[derive(Debug, Clone, PartialEq)]
pub struct IntentEnvelope {
    /// Chosen by the shell; comes back with the answer.
    pub id: IntentId,
    /// Who wants it.
    pub principal: Principal,
    /// With the principal, unique for ever. The shell looks it up before it asks the engine.
    pub idempotency_key: String,
    /// SHA-256 of the request, so that the same key with another request is noticed.
    pub digest: [u8; 32],
    /// What is wanted.
    pub intent: Intent,
}

/// What an operator may want.
#[expect(clippy::large_enum_variant, reason = "people are slow: a few at a time exist")]
#[derive(Debug, Clone, PartialEq)]
pub enum Intent {
    /// Send a telecommand.
    Command(CommandIntent),
    /// Withdraw a telecommand that has not been radiated.
    Cancel(CommandId),
    /// Bring the satellite's image home.
    Download {
        /// From whom.
        satellite: SatelliteId,
        /// Over what; the satellite's only link when `None`.
        link: Option<LinkId>,
    },
    /// Withdraw a download.
    CancelDownload(DownloadId),
    /// I have looked: the clock of this machine is right. Holds until the process ends.
    VouchClock,
    /// I know why counter and witness disagree: go on above the higher of them.
    ConfirmCounter {
        /// Of which key.
        key: KeyId,
        /// And above this one. Needed where counters were forgotten that no clock leads above.
        above: Option<Counter>,
    },
    /// Use these elements from now on, where they are the best for an instant. Sets that are held already are skipped.
    AddElements {
        /// Whose.
        satellite: SatelliteId,
        /// At most [`crate::sky::SETS_AT_ONCE`].
        elements: Vec<tle::Elements>,
        /// Where they came from, for people; no secrets.
        source: String,
    },
    /// Use this plan. One of the same name is withdrawn, and its arming and passes with it.
    AddPlan {
        /// The plan.
        plan: Arc<Plan>,
        /// Its text, kept as it is.
        text: Arc<str>,
    },
    /// Withdraw a plan.
    WithdrawPlan(PlanName),
    /// Let a plan run, or not. A run that lasts is stopped.
    ArmPlan {
        /// Which.
        plan: PlanName,
        /// Whether it may run.
        armed: bool,
    },
    /// Choose a pass for a plan, or take the choice back.
    AttachPlan {
        /// Which plan.
        plan: PlanName,
        /// An instant within the pass.
        at: UtcUs,
        /// Choose, or take back.
        attach: bool,
    },
    /// Take a satellite out of the hands of the plan that runs, or give it back.
    TakeOver {
        /// Which.
        satellite: SatelliteId,
        /// Take over, or give back.
        held: bool,
    },
    /// Let a link transmit, or not.
    ArmLink {
        /// Which.
        link: LinkId,
        /// Whether it may transmit.
        armed: bool,
    },
}

/// A telecommand that somebody wants sent.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandIntent {
    /// To whom.
    pub satellite: SatelliteId,
    /// Over what; the satellite's only link when `None`.
    pub link: Option<LinkId>,
    /// What.
    pub telecommand: Telecommand,
    /// Higher goes first; 0 is usual.
    pub priority: i16,
    /// When it may be radiated.
    pub gate: Gate,
    /// Not radiated after this.
    pub expires_at: Option<UtcUs>,
    /// What else must hold before it is radiated.
    pub when: Option<Box<Condition>>,
    /// How often an idempotent command may be radiated; `None` for the engine's default. Others: once.
    pub attempts_allowed: Option<u16>,
    /// The name of the command, typed again: required where the command is critical.
    pub confirmation: Option<String>,
}

/// What became of an intent; durable before it is told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Accepted {
    /// The command that was queued.
    Command(CommandId),
    /// The command that was withdrawn.
    Cancelled(CommandId),
    /// The download that was ordered (or was active already).
    Download(DownloadId),
    /// The download that was withdrawn.
    DownloadCancelled(DownloadId),
    /// Done; there is nothing to point at.
    Done,
}

/// The durable trace of an accepted intent, in the same batch as what it caused.
#[derive(Debug, Clone, PartialEq)]
pub struct IntentReceipt {
    /// Who.
    pub principal: Principal,
    /// Under which key.
    pub idempotency_key: String,
    /// SHA-256 of the request.
    pub digest: [u8; 32],
    /// What became of it.
    pub accepted: Accepted,
    /// When.
    pub at: UtcUs,
}

/// Why an intent was refused. Nothing was stored and nothing will be sent.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// No such satellite in the configuration.
    #[error("satellite: '{0}' is not in the configuration")]
    UnknownSatellite(String),
    /// No such link, or it does not serve the satellite.
    #[error("link: '{0}' is not a link of this satellite")]
    UnknownLink(String),
    /// No such command.
    #[error("command {0} does not exist, or ended long ago")]
    UnknownCommand(CommandId),
    /// No such download.
    #[error("download {0} does not exist, or has ended")]
    UnknownDownload(DownloadId),
    /// No such key.
    #[error("key {0} is not in the configuration")]
    UnknownKey(KeyId),
    /// The satellite has no key: it can be heard, not commanded.
    #[error("satellite '{0}' has no key in the configuration: it can be heard, not commanded")]
    NoKey(SatelliteId),
    /// An argument is out of its range.
    #[error("arguments: {0}")]
    Argument(String),
    /// The profile of the satellite does not have this packet.
    #[error("{0} is not in this satellite's profile")]
    NotInProfile(&'static str),
    /// Critical, and its name was not typed again.
    #[error("{0} is critical: give its name in 'confirm' to fire it")]
    NeedsConfirmation(&'static str),
    /// It was or may have been radiated.
    #[error("command {command} is {stage}: only what was not radiated can be withdrawn")]
    TooLate {
        /// Which.
        command: CommandId,
        /// Where it stands.
        stage: &'static str,
    },
    /// Its time is over already.
    #[error("expires_at lies in the past")]
    AlreadyExpired,
    /// The queue of this satellite is full.
    #[error("{0} commands wait already: cancel some, or wait")]
    QueueFull(usize),
    /// The database does not take anything at present.
    #[error("storage is failing: nothing is accepted until it recovers ({0})")]
    Storage(String),
    /// Nothing is locked for this key.
    #[error("sealing with key {0} is not locked")]
    NotLocked(KeyId),
    /// What was restored goes on above the clock, and nobody says that it is right.
    #[error(
        "key {0} goes on above the clock, because counters were forgotten, and nobody says that the clock is right: \
         synchronise it, or look at it and vouch for it, then confirm again"
    )]
    ClockNotVouched(KeyId),
    /// Counters were forgotten, this key counts them one by one, and nobody says above which to go on.
    #[error(
        "key {key} counts its frames one by one, and counters may have been used that this station has forgotten (it knows of {known}): \
         say above which to go on (`gs-server key confirm --above N`; `above` in the API). Ask the satellite for the last \
         counter it took, or look in the records of whoever commanded it; if nobody knows, be generous: {known} + 1000000 costs nothing, a \
         counter that is used twice gives the key away"
    )]
    FloorNeeded {
        /// Which key.
        key: KeyId,
        /// The highest that is known; 0 for none.
        known: Counter,
    },
    /// The number is none to go on above.
    #[error("above: {above} is {}", if above < known { format!("below counter {known}, which is known to be used") } else { "so high that no counter is left".to_owned() })]
    FloorOutOfRange {
        /// What was given.
        above: Counter,
        /// The highest that is known; 0 for none.
        known: Counter,
    },
    /// No such plan.
    #[error("plan: there is no plan '{0}'")]
    UnknownPlan(String),
    /// The plan is wrong.
    #[error("plan: {0}")]
    Plan(String),
    /// There are too many plans.
    #[error("{0} plans are in use already: withdraw some")]
    PlansFull(usize),
    /// No pass there, or not one that the plan takes.
    #[error("at: {0}")]
    Pass(String),
    /// Nothing runs.
    #[error("no plan runs for {0} at present")]
    NothingRuns(SatelliteId),
    /// The station is shutting down.
    #[error("the station is stopping")]
    Stopping,
}
