//! Plans, as people write them: the same types for TOML, JSON and the API.
//!
//! A step names what it does in `do`; which other fields belong to it depends on that. The types here are flat, so that
//! a mistake is found where it stands (line, column, field); what the words mean together the server checks.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::{GateWord, Time};

/// What to do with one satellite in one pass.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanText {
    /// Its name: 1 to 32 of a-z, 0-9, `-`, `_`.
    pub name: String,
    /// Whom it commands.
    pub satellite: String,
    /// Higher goes first; 0 is usual.
    #[serde(default)]
    pub priority: i16,
    /// What a pass with it is worth to the scheduler; 1 is usual.
    #[serde(default = "one")]
    pub worth: f64,
    /// Whether it may make the station transmit.
    #[serde(default)]
    pub transmit: bool,
    /// What becomes of what is undone at LOS.
    #[serde(default)]
    pub at_los: AtLosWord,
    /// Ends after so many seconds in one pass; `null`: at LOS.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_s: Option<f64>,
    /// The least pass that it takes.
    #[serde(default)]
    pub min_pass: MinPassText,
    /// The passes that it attaches itself to; `null`: those that an operator chooses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attach: Option<AttachText>,
    /// What to do, in this order.
    pub steps: Vec<StepText>,
}

const fn one() -> f64 {
    1.0
}

/// The least pass that a plan takes.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MinPassText {
    /// Greatest elevation, degrees.
    #[serde(default)]
    pub max_elevation_deg: f64,
    /// Length, seconds.
    #[serde(default)]
    pub duration_s: f64,
}

/// What becomes of what is undone at LOS.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AtLosWord {
    /// It stays undone.
    #[default]
    Stop,
    /// It is done in the next pass.
    FinishLater,
}

/// Every pass of the satellite that matches.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttachText {
    /// The greatest elevation is at least this, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_max_elevation_deg: Option<f64>,
    /// It culminates within one of these hours of the UTC day, e.g. `18:00-06:00`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hours_utc: Vec<String>,
    /// The satellite is sunlit when it culminates, or not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sunlit: Option<bool>,
    /// Only every so many-th of them; 1: all.
    #[serde(default = "every_one")]
    pub every: u32,
}

const fn every_one() -> u32 {
    1
}

/// One step. Which fields belong to it depends on `do`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepText {
    /// `listen`, `command`, `wait-for`, `download-image`, `upload-schedule` or `repeat-until`.
    #[serde(rename = "do")]
    pub what: String,
    /// Any step: what must hold before it begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<ConditionText>,
    /// Any step: the longest that it may take, waiting for `when` included, seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_s: Option<f64>,
    /// Any step: what follows when it fails; `abort` is usual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_failure: Option<OnFailureWord>,
    /// `listen`: for so many seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub for_s: Option<f64>,
    /// `command`: name of the telecommand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// `command`: its arguments by name, as in [`CommandRequest`](crate::CommandRequest); for SetTimestamp also
    /// `utc = "now"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(value_type = Option<Object>))]
    pub arguments: Option<Map<String, Value>>,
    /// `command`, `upload-schedule`: higher goes first; the plan's when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub priority: Option<i16>,
    /// `command`, `upload-schedule`: how often it may be radiated, where repeating does no harm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attempts: Option<u16>,
    /// `command`, `upload-schedule`: what must hold before it is radiated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gate: Option<GateWord>,
    /// `command`, `upload-schedule`: who approved it beforehand; required where it is critical.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approved_by: Option<ApprovalText>,
    /// `wait-for`: what is waited for. `repeat-until`: what ends it, looked at after each round.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<ConditionText>,
    /// `wait-for`: for so many seconds at most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timeout_s: Option<f64>,
    /// `upload-schedule`: the slots of a SetDownlinkSchedule, at most 8; none clears the list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slots: Option<Vec<Value>>,
    /// `upload-schedule`: the entries of an UploadSchedule (autonomy extension), in as many parts as needed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub entries: Option<Vec<Value>>,
    /// `upload-schedule`: with `entries`, the number of the schedule.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub schedule: Option<u8>,
    /// `repeat-until`: the steps of each round.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(no_recursion))]
    pub steps: Option<Vec<StepText>>,
    /// `repeat-until`: so many rounds at most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_most: Option<u32>,
}

/// What follows when a step fails.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnFailureWord {
    /// The run ends.
    #[default]
    Abort,
    /// The rest of the enclosing repeat is left out; outside of one, the next step follows.
    Skip,
    /// The next step follows.
    Continue,
}

/// All of what is given must hold.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConditionText {
    /// The satellite stands at least so high, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elevation_deg: Option<f64>,
    /// It was heard within so many seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heard_within_s: Option<f64>,
    /// The pass has lasted so many seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after_aos_s: Option<f64>,
    /// At least so many seconds of the pass are left.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before_los_s: Option<f64>,
    /// Its values are so.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub telemetry: Vec<GuardText>,
}

/// A value of the satellite compared with a number.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GuardText {
    /// Which, e.g. `heartbeat.temp`.
    pub parameter: String,
    /// `<`, `<=`, `>`, `>=`, `==` or `!=`.
    pub op: String,
    /// With what.
    pub value: f64,
    /// Not older than so many seconds.
    pub max_age_s: f64,
}

/// Somebody allows a critical command beforehand.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ApprovalText {
    /// Who.
    pub name: String,
    /// Exactly what: 16 hex digits that the check of the plan tells. Another argument is another digest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Not after this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_at: Option<Time>,
}

/// What is wrong with a plan.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlanFinding {
    /// `error` or `warning`; with an error the plan is not taken.
    pub severity: String,
    /// Where, e.g. `steps[3].when.elevation_deg`; empty for the whole plan.
    pub place: String,
    /// Line of the text, from 1; `null` when it has no place in it.
    pub line: Option<usize>,
    /// Column in that line in characters, from 1.
    pub column: Option<usize>,
    /// What is wrong, with what was found.
    pub problem: String,
    /// What to do.
    pub remedy: String,
}
