//! Plans in use, the schedule of the coming passes, and what became of plans in passes.

use serde::{Deserialize, Serialize};

use crate::{CommandView, DownloadView, PlanText, Time};

/// A plan in use.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanView {
    /// Its number in the archive; another text under the same name is another plan.
    pub id: u64,
    /// Its name, unique among the plans in use.
    pub name: String,
    /// Whom it commands.
    pub satellite: String,
    /// The station that runs it.
    pub station: String,
    /// It may run.
    pub armed: bool,
    /// When it was handed over.
    pub added_at: Time,
    /// By whom.
    pub added_by: String,
    /// Passes that an operator chose: an instant within each.
    pub picks: Vec<Time>,
    /// The plan as it was handed over.
    pub plan: PlanText,
}

/// A pass is chosen for a plan, or the choice taken back.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttachRequest {
    /// An instant within the pass, e.g. its TCA.
    pub at: Time,
}

/// What the antenna does in the coming two days, and why.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScheduleView {
    /// Whose.
    pub station: String,
    /// The station's time when this was asked.
    pub at: Time,
    /// Passes that were chosen, in order of begin.
    pub contacts: Vec<ContactView>,
    /// Passes that a plan wants and does not get, in order of AOS.
    pub refused: Vec<RefusedView>,
    /// What the contacts are worth together, points.
    pub worth: f64,
    /// No schedule is worth more than this, points.
    pub bound: f64,
    /// How much more the best schedule could be worth, as a part of the bound, 0 to 1; 0 when none is.
    pub gap: f64,
    /// It is proved that no schedule is worth more.
    pub proved: bool,
    /// When the station is closed, in order of time.
    pub closed: Vec<ClosedView>,
    /// The only times at which the station may transmit, in order of time; `null`: always.
    pub licence: Option<Vec<OpenView>>,
}

/// A time in which nothing is planned.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ClosedView {
    /// Its begin.
    pub start: Time,
    /// Its end.
    pub stop: Time,
    /// Why, as the configuration says it.
    pub why: String,
}

/// A time in which the station may transmit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct OpenView {
    /// Its begin.
    pub start: Time,
    /// Its end.
    pub stop: Time,
}

/// A pass that was chosen.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactView {
    /// Whose pass.
    pub satellite: String,
    /// Over which station.
    pub station: String,
    /// By which antenna.
    pub antenna: String,
    /// The begin.
    pub start: Time,
    /// The end.
    pub stop: Time,
    /// The plan that gets it.
    pub plan: Option<String>,
    /// That plan may run; `false`: the pass is held free for it, and nothing happens.
    pub armed: bool,
    /// Why it is as it is, as a sentence.
    pub why: String,
    /// Why it begins after AOS, as a sentence; `null` when it does not.
    pub cut_start: Option<String>,
    /// Why it ends before LOS, as a sentence; `null` when it does not.
    pub cut_stop: Option<String>,
    /// It was promised by the schedule before.
    pub kept: bool,
    /// It listens along, counts nothing and never transmits.
    pub listens_along: bool,
    /// What it is worth, points.
    pub worth: f64,
    /// From when it may transmit, if it may.
    pub transmit_from: Option<Time>,
    /// Until when.
    pub transmit_until: Option<Time>,
    /// So many passes were refused for it.
    pub refused_for_it: u64,
}

/// A pass that a plan wants and does not get.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RefusedView {
    /// Whose pass.
    pub satellite: String,
    /// Over which station.
    pub station: String,
    /// Its AOS.
    pub aos: Time,
    /// Its LOS.
    pub los: Time,
    /// The plan that wants it, and waits on.
    pub plan: Option<String>,
    /// Why, as a sentence.
    pub why: String,
    /// What the whole pass would be worth, points.
    pub worth: f64,
    /// The contacts that stand in the way, in order of time.
    pub rivals: Vec<RivalView>,
}

/// A contact that stands in the way of another pass.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RivalView {
    /// Whose pass.
    pub satellite: String,
    /// By which antenna.
    pub antenna: String,
    /// Its begin.
    pub start: Time,
    /// Its end.
    pub stop: Time,
    /// What it is worth, points.
    pub worth: f64,
    /// It was promised before, and gives way only to a clearly better choice.
    pub kept: bool,
}

/// An armed plan in one pass.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunView {
    /// Its number.
    pub id: u64,
    /// The plan's number in the archive.
    pub plan: u64,
    /// The plan's name.
    pub name: String,
    /// Whom it commands.
    pub satellite: String,
    /// From which station.
    pub station: String,
    /// Over which link, once that is decided.
    pub link: Option<String>,
    /// The pass in `/passes/history`, once it began.
    pub pass: Option<u64>,
    /// The begin of the contact, as it was last known.
    pub aos: Time,
    /// Its end, as it was last known.
    pub los: Time,
    /// `planned`, `waiting`, `running`, `held`, `ended`, `missed` or `dropped`.
    pub state: String,
    /// Why it waits, was missed or dropped, as a sentence.
    pub why: Option<String>,
    /// How it ended: `completed`, `aborted`, `out-of-time`, `unfinished` (LOS came first), `later` (LOS came first, the
    /// next pass goes on) or `stopped`; `null` while it lasts and when it never began.
    pub outcome: Option<String>,
    /// What belongs to the outcome, as a sentence: the step that failed and why, who stopped it.
    pub outcome_why: Option<String>,
    /// When its first step began.
    pub started_at: Option<Time>,
    /// Steps that ended, those of each round counted.
    pub steps_ended: u64,
    /// When it was last changed.
    pub at: Time,
}

/// What was planned for a pass and what happened.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunReport {
    /// The run.
    pub run: RunView,
    /// The plan as it was handed over.
    pub plan: PlanText,
    /// The steps that ended, in this order.
    pub steps: Vec<StepReport>,
    /// Steps that ended and found no place in the list.
    pub steps_dropped: u64,
    /// What it asked for, with all stages, in the order of the plan.
    pub commands: Vec<CommandView>,
    /// Downloads that it ordered.
    pub downloads: Vec<DownloadView>,
    /// Frames of the satellite that this station heard first between the begin and the end of the contact.
    pub frames_heard: u64,
    /// Chunks of images that came with those frames and were not held before.
    pub chunks_gained: u64,
}

/// A step that ended.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StepReport {
    /// Which, e.g. `steps[3].steps[0]`.
    pub step: String,
    /// What it does, as `do` of the plan says.
    #[serde(rename = "do")]
    pub what: Option<String>,
    /// The rounds of the repeats around it, from 0, outermost first.
    pub rounds: Vec<u32>,
    /// When it was come to.
    pub entered_at: Time,
    /// When it ended.
    pub ended_at: Time,
    /// `done`, `partly`, `skipped`, `failed` or `unfinished`.
    pub end: String,
    /// Why, as a sentence.
    pub why: Option<String>,
}
