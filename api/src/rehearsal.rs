//! Rehearsals: a plan flown through its coming pass in simulation, many times.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::{FineTime, PlanFinding, PlanText, Time};

/// What is to be rehearsed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct RehearsalRequest {
    /// The plan; `null`: the plan in use that `name` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanText>,
    /// A plan in use; `null`: `plan` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The first pass after this that the plan takes, or the one that lasts then; `null`: now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<Time>,
    /// How many runs, 1 to 1000.
    #[serde(default = "a_hundred")]
    pub runs: u32,
    /// The first seed.
    #[serde(default = "the_first")]
    pub seed: u64,
    /// Size of the satellite's images in bytes, from the least to the greatest; `null`: 15,000 to 45,000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image_bytes: Option<[u32; 2]>,
}

const fn a_hundred() -> u32 {
    100
}

const fn the_first() -> u64 {
    1
}

/// A chunk is named by 16 bits, and has 222 bytes.
const IMAGE_BYTES_MAX: u32 = 14_000_000;

impl RehearsalRequest {
    /// The range of image sizes; `Err`: the two numbers are none.
    ///
    /// # Errors
    /// What would be right.
    pub fn image_sizes(&self) -> Result<Option<RangeInclusive<u32>>, String> {
        match self.image_bytes {
            None => Ok(None),
            Some([from, to]) if 0 < from && from <= to && to <= IMAGE_BYTES_MAX => Ok(Some(from..=to)),
            Some([from, to]) => Err(format!(
                "[{from}, {to}] is no range of sizes: give [15000, 45000]; at most {IMAGE_BYTES_MAX}"
            )),
        }
    }
}

/// A rehearsal that was asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RehearsalView {
    /// Its number, until the server stops.
    pub id: u64,
    /// The plan's name.
    pub plan: String,
    /// Whom it commands.
    pub satellite: String,
    /// Who asked.
    pub who: String,
    /// When.
    pub asked_at: Time,
    /// AOS of the pass.
    pub aos: Time,
    /// `waiting`, `running`, `done`, `cancelled` or `failed`.
    pub state: String,
    /// Why it was cancelled or failed, as a sentence.
    pub why: Option<String>,
    /// Runs in all.
    pub runs: u32,
    /// Runs that are done.
    pub runs_done: u32,
    /// What came of it, once it is done; lists leave it out.
    pub answer: Option<RehearsalAnswer>,
}

/// What may be expected of a plan in its pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RehearsalAnswer {
    /// It was rehearsed.
    pub ok: bool,
    /// The plan's name.
    pub plan: String,
    /// Whom it commands.
    pub satellite: String,
    /// The pass.
    pub pass: RehearsedPass,
    /// The first seed.
    pub seed: u64,
    /// Runs.
    pub runs: usize,
    /// Runs in which the plan began.
    pub begun: usize,
    /// What was achieved.
    pub figures: RehearsedFigures,
    /// Runs in which something was on the air outside of the pass.
    pub runs_outside: usize,
    /// Runs in which an image came home whole.
    pub images_whole: usize,
    /// Each step of the plan.
    pub steps: Vec<RehearsedStep>,
    /// How the runs ended.
    pub ends: Vec<RehearsedEnd>,
    /// What no operator wants.
    pub findings: Vec<PlanFinding>,
    /// Each run.
    pub outcomes: Vec<RehearsedRun>,
}

/// The pass of a rehearsal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RehearsedPass {
    /// Its AOS.
    pub aos: FineTime,
    /// When it culminates.
    pub tca: FineTime,
    /// Its LOS.
    pub los: Option<FineTime>,
    /// How long it lasts, s.
    pub duration_s: Option<f64>,
    /// How high it comes, degrees.
    pub max_elevation_deg: f64,
    /// Epoch of the elements.
    pub epoch: FineTime,
    /// Their age at AOS, days.
    pub age_days: f64,
}

/// What was achieved, over all runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RehearsedFigures {
    /// Telecommands asked for.
    pub commands_asked: Percentiles,
    /// Telecommands answered.
    pub commands_answered: Percentiles,
    /// Telecommands of which nobody knows what became.
    pub commands_unknown: Percentiles,
    /// Telecommands that failed.
    pub commands_failed: Percentiles,
    /// Chunks that came home.
    pub chunks_home: Percentiles,
    /// Chunks of the images; `null` when ground learned of no image in any run.
    pub chunks_of: Option<Percentiles>,
    /// Steps that were not done at LOS.
    pub steps_undone: Percentiles,
    /// Time on the air upwards, s.
    pub airtime_up_s: Percentiles,
    /// Time on the air downwards, s.
    pub airtime_down_s: Percentiles,
}

/// A figure over many runs: between `p10` and `p90` lies the next run with a chance of 80 %, drawn as these were.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Percentiles {
    /// One run in ten is at or below this.
    pub p10: f64,
    /// Half of them are.
    pub p50: f64,
    /// Nine in ten are.
    pub p90: f64,
}

/// What became of one step in all runs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RehearsedStep {
    /// Where it stands in the plan.
    pub place: String,
    /// What it does.
    #[serde(rename = "do")]
    pub action: String,
    /// Runs in which it was done.
    pub done: usize,
    /// Runs in which its time was over, and what was done counts.
    pub partly: usize,
    /// Runs in which it failed or was left out.
    pub failed: usize,
    /// Runs in which LOS or another end came in the middle of it.
    pub unfinished: usize,
    /// Runs in which it was not come to.
    pub not_reached: usize,
    /// The first reason of a failure.
    pub why: Option<String>,
}

/// How runs ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RehearsedEnd {
    /// As in a run's `outcome`, or `missed`, `dropped`, `waiting`.
    pub end: String,
    /// How many.
    pub runs: usize,
    /// The first reason that was given.
    pub why: Option<String>,
}

/// What came of one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct RehearsedRun {
    /// Its seed; with it the run is played again.
    pub seed: u64,
    /// The plan began.
    pub begun: bool,
    /// How it ended.
    pub end: String,
    /// What is to be said to it.
    pub why: Option<String>,
    /// Telecommands asked for.
    pub commands_asked: u64,
    /// Telecommands answered.
    pub commands_answered: u64,
    /// Telecommands of which nobody knows what became.
    pub commands_unknown: u64,
    /// Telecommands that failed.
    pub commands_failed: u64,
    /// Telecommands on the air outside of the pass.
    pub commands_outside: u64,
    /// Chunks that came home.
    pub chunks_home: u64,
    /// Chunks of the image; `null` when ground never learned of one.
    pub chunks_of: Option<u64>,
    /// What became of each step: `done`, `partly`, `skipped`, `failed`, `unfinished`, `not-reached`.
    pub steps: Vec<String>,
    /// Time on the air upwards, s.
    pub airtime_up_s: f64,
    /// Time on the air downwards, s.
    pub airtime_down_s: f64,
}
