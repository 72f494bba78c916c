//! Reports: what a pass brought, what the next shift must know, what a month came to. Each is derived from the archive
//! and from nothing else but the configuration's place, link and heartbeat period, so it can be made again at any time.

use serde::{Deserialize, Serialize};

use crate::{NextPass, RunView, StepReport, Time};

/// What a pass brought: the archive as it stood at `as_of`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassReport {
    /// The pass, as `/passes/history` numbers it.
    pub pass: u64,
    /// Whose pass.
    pub satellite: String,
    /// Over which station.
    pub station: String,
    /// Time, satellite or radio are made up.
    pub simulated: bool,
    /// What was stored with a later time is not in this report: a minute after LOS, or now while the pass lasts.
    pub as_of: Time,
    /// The pass is over, so this report does not change any more.
    pub is_final: bool,
    /// What was predicted.
    pub planned: PlannedPass,
    /// What was heard.
    pub had: HadPass,
    /// Plans that had this pass, and those that missed it.
    pub runs: Vec<RunReported>,
    /// Stretches of the pass without any frame, each longer than one and a half heartbeat periods.
    pub gaps: Vec<SilentStretch>,
    /// Commands that reached any stage in this pass, by number.
    pub commands: Vec<CommandReported>,
    /// Commands that are not listed, there being too many.
    pub commands_left_out: u64,
    /// What was radiated.
    pub uplink: UplinkReported,
    /// Pictures that were declared or grew.
    pub images: Vec<ImageReported>,
    /// What happened of level `warning` or graver, in order.
    pub alarms: Vec<AlarmReported>,
    /// Alarms that are not listed, there being too many.
    pub alarms_left_out: u64,
    /// Each frame with its strength, in order of time.
    pub signal: Vec<SignalPoint>,
    /// Frames that are not listed, there being too many.
    pub signal_left_out: u64,
    /// The satellite's way over the station; empty when the station does not know where it stands.
    pub path: Vec<PathPoint>,
    /// The next pass by the elements that were known then; `null` without elements, without a place, or when there is
    /// none within two days.
    pub next_pass: Option<NextPass>,
    /// What somebody should do now, as sentences, the most pressing first.
    pub next_steps: Vec<String>,
}

/// What was predicted.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedPass {
    /// Acquisition of signal.
    pub aos: Time,
    /// Greatest elevation.
    pub tca: Time,
    /// Loss of signal; `null` for an object that does not set.
    pub los: Option<Time>,
    /// From AOS to LOS, s.
    pub duration_s: Option<f64>,
    /// Elevation at TCA, degrees.
    pub max_elevation_deg: f64,
    /// The elements in force at the end, by their number; `null` when the archive names none.
    pub elements: Option<u64>,
    /// How old these were at TCA, days; negative before their epoch.
    pub elements_age_days: Option<f64>,
}

/// What was heard.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HadPass {
    /// When the station closed the pass; `null` while it lasts.
    pub ended_at: Option<Time>,
    /// Frames, from a minute before AOS to a minute after LOS.
    pub frames: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Frames by their packet.
    pub packets: Vec<PacketCount>,
    /// How long they occupied the air by the link's settings, s; `null` when the satellite has no link any more.
    pub airtime_s: Option<f64>,
    /// When the first one was heard.
    pub first_frame: Option<Time>,
    /// When the last one was heard.
    pub last_frame: Option<Time>,
    /// Heartbeats from AOS to LOS.
    pub heartbeats: u64,
    /// So many heartbeats fall into the pass by the configured period; `null` when the satellite is not configured any
    /// more, or does not set.
    pub heartbeats_expected: Option<u64>,
    /// Strength of the signal; `null` when no receiver told it.
    pub rssi_dbm: Option<Spread>,
    /// Signal against noise; `null` when no receiver told it. The E22 module does not.
    pub snr_db: Option<Spread>,
}

/// How many frames carried a packet.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PacketCount {
    /// Packet type; `null` when the frame has none.
    pub packet_type: Option<u8>,
    /// The ICD's name of it, if it has one.
    pub packet_name: Option<String>,
    /// Frames.
    pub frames: u64,
}

/// How values lie.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The smallest.
    pub min: f64,
    /// The one in the middle; of two, their mean.
    pub median: f64,
    /// The largest.
    pub max: f64,
}

/// A plan in this pass.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunReported {
    /// The run.
    pub run: RunView,
    /// Steps of the plan, before repetitions.
    pub steps_planned: u64,
    /// Every step that ended, in order.
    pub steps: Vec<StepReport>,
    /// So many steps ended before those.
    pub steps_dropped: u64,
}

/// Silence where a heartbeat was due.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SilentStretch {
    /// From here.
    pub start: Time,
    /// To here.
    pub stop: Time,
    /// How long, s.
    pub duration_s: f64,
    /// It begins at AOS.
    pub from_aos: bool,
    /// It lasts to LOS.
    pub to_los: bool,
}

/// A command in this pass.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommandReported {
    /// Command.
    pub id: u64,
    /// The ICD's name of it.
    pub command: String,
    /// Who wanted it.
    pub principal: String,
    /// When it was given.
    pub created_at: Time,
    /// Its last stage until `as_of`.
    pub stage: String,
    /// Since when.
    pub stage_at: Time,
    /// Why.
    pub why: String,
    /// How often it was radiated in this pass.
    pub radiated: u64,
    /// From the last radiation to the answer, s; `null` without one.
    pub answered_after_s: Option<f64>,
    /// The frame that proves its last stage.
    pub frame: Option<u64>,
}

/// What was radiated.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UplinkReported {
    /// Frames.
    pub frames: u64,
    /// How long they occupied the air by the link's settings, s; `null` when the satellite has no link any more.
    pub airtime_s: Option<f64>,
}

/// A picture that was declared or grew.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageReported {
    /// Image.
    pub image: u64,
    /// It was declared in this pass.
    pub is_new: bool,
    /// Chunks in all.
    pub chunks: u32,
    /// Chunks held before.
    pub held_before: u32,
    /// Chunks held after.
    pub held: u32,
    /// Versions that came and differ from what is held.
    pub conflicts: u32,
    /// The first stretches of chunks that are still missing: index and count.
    pub missing: Vec<ChunkRun>,
    /// Stretches that are still missing, in all.
    pub missing_runs: u32,
}

/// Neighbouring chunks.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChunkRun {
    /// The first one, from 0.
    pub first: u32,
    /// How many.
    pub count: u32,
}

/// Something that somebody should have seen.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmReported {
    /// Its place in the one sequence of events.
    pub sequence: i64,
    /// When.
    pub at: Time,
    /// What it is about.
    pub kind: String,
    /// `warning`, `distress`, `critical` or `severe`.
    pub level: String,
    /// Whom it is about.
    pub satellite: Option<String>,
    /// What happened.
    pub message: String,
}

/// A frame and how strong it was.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SignalPoint {
    /// When it was heard.
    pub at: Time,
    /// The frame.
    pub frame: u64,
    /// How high the satellite stood, degrees; `null` when the station does not know where it stands.
    pub elevation_deg: Option<f64>,
    /// Strength, dBm: the strongest reception.
    pub rssi_dbm: Option<i32>,
    /// Signal against noise, dB: the best reception.
    pub snr_db: Option<f64>,
}

/// Where the satellite stood.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PathPoint {
    /// When.
    pub at: Time,
    /// Height above the horizon, degrees.
    pub elevation_deg: f64,
    /// From north over east, degrees.
    pub azimuth_deg: f64,
    /// Distance.
    pub range_km: f64,
}
