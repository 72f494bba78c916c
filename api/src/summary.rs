//! What the next shift must know, and what a month came to.

use serde::{Deserialize, Serialize};

use crate::{
    AlarmReported, AlertView, AuditView, CommandReported, LimitView, PacketCount, RunView, StationView, Time,
};

/// What the next shift must know: the station now, and what happened since the last one began.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HandoverReport {
    /// Since when.
    pub since: Time,
    /// As of when.
    pub at: Time,
    /// The station now; its passes to come are in it.
    pub now: StationView,
    /// Alerts that are open now, the oldest first.
    pub alerts: Vec<AlertView>,
    /// Values that are outside their limits now.
    pub limits: Vec<LimitView>,
    /// Passes since then, in order, those that last included.
    pub passes: Vec<PassBrief>,
    /// Commands that are on their way now.
    pub in_flight: Vec<CommandReported>,
    /// Commands that became `unknown` since then, and still are.
    pub unknown: Vec<CommandReported>,
    /// Runs of plans that are to come, or last.
    pub ahead: Vec<RunView>,
    /// Runs of plans that ended, were missed or dropped since then.
    pub runs: Vec<RunView>,
    /// What happened since then of level `warning` or graver, in order; the newest ones.
    pub alarms: Vec<AlarmReported>,
    /// Alarms before those.
    pub alarms_left_out: u64,
    /// Who did what since then, in order; the newest ones.
    pub actions: Vec<AuditView>,
    /// There are more actions before those.
    pub actions_cut: bool,
}

/// A pass in short; its report tells more.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassBrief {
    /// Pass.
    pub pass: u64,
    /// Whose.
    pub satellite: String,
    /// Over which station.
    pub station: String,
    /// Acquisition of signal.
    pub aos: Time,
    /// Loss of signal; `null` for an object that does not set.
    pub los: Option<Time>,
    /// Elevation at TCA, degrees.
    pub max_elevation_deg: f64,
    /// Frames, from a minute before AOS to a minute after LOS.
    pub frames: u64,
    /// Chunks of images that came with them and were not held before.
    pub chunks: u64,
}

/// What a month came to, by UTC.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MonthReport {
    /// `2026-11`.
    pub month: String,
    /// Station.
    pub station: String,
    /// Time, satellite or radio are made up.
    pub simulated: bool,
    /// What was stored with a later time is not in this report: the end of the month, or now while it lasts.
    pub as_of: Time,
    /// The month is over.
    pub is_final: bool,
    /// Each satellite of the configuration.
    pub satellites: Vec<MonthOfSatellite>,
    /// What happened of level `warning` or graver, by kind and level, the gravest first.
    pub incidents: Vec<IncidentCount>,
}

/// What a month came to with one satellite.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MonthOfSatellite {
    /// Satellite.
    pub satellite: String,
    /// Passes that began.
    pub passes: u64,
    /// Passes with at least one frame.
    pub passes_heard: u64,
    /// From AOS to LOS, all together, s.
    pub in_view_s: f64,
    /// Frames, in and outside of passes.
    pub frames: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Frames by their packet.
    pub packets: Vec<PacketCount>,
    /// How long they occupied the air by the link's settings, s.
    pub airtime_down_s: f64,
    /// Frames that were radiated.
    pub radiated: u64,
    /// How long they occupied the air by the link's settings, s.
    pub airtime_up_s: f64,
    /// Commands that were given, by their last stage at `as_of`.
    pub commands: Vec<WordCount>,
    /// Runs of plans, by outcome, or by state where there is none.
    pub runs: Vec<WordCount>,
    /// Images that were declared.
    pub images_declared: u64,
    /// Images that became whole.
    pub images_completed: u64,
    /// Chunks that came and were not held before.
    pub chunks: u64,
    /// Sets of elements that were added.
    pub elements: u64,
    /// Every day that is over or has begun.
    pub days: Vec<DayCount>,
}

/// How often a word applies.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WordCount {
    /// The word.
    pub word: String,
    /// How often.
    pub count: u64,
}

/// A day of a month, by UTC.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DayCount {
    /// `2026-11-22`.
    pub day: String,
    /// Passes that began.
    pub passes: u64,
    /// Frames.
    pub frames: u64,
}

/// What happened, counted.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct IncidentCount {
    /// What it is about.
    pub kind: String,
    /// `warning`, `distress`, `critical` or `severe`.
    pub level: String,
    /// How often.
    pub count: u64,
    /// The first time.
    pub first: Time,
    /// The last time.
    pub last: Time,
    /// What the last one said.
    pub message: String,
}
