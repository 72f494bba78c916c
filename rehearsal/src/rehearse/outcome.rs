//! What came of one world.

use mission::Stage;
use mission::plan::StepEnd;
use mission::run::{RunRecord, RunState};

use super::Rehearsal;
use crate::World;

/// What came of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The seed; with it the run is played again bit for bit.
    pub seed: u64,
    /// The plan began.
    pub begun: bool,
    /// How it ended, as a word: an end of a run ([`mission::plan::RunEnd::name`]), or `missed`, `dropped`, `waiting`.
    pub end: &'static str,
    /// What is to be said to it; `None`: nothing.
    pub why: Option<String>,
    /// Its telecommands.
    pub commands: Commands,
    /// Chunks of the newest image that came home.
    pub chunks_home: u64,
    /// Chunks of that image; `None` when ground never learned of one.
    pub chunks_of: Option<u64>,
    /// What became of each step of the plan; a repeat is one.
    pub steps: Vec<StepFate>,
    /// Time on the air upwards, s.
    pub airtime_up_s: f64,
    /// Time on the air downwards, s, heartbeats included.
    pub airtime_down_s: f64,
    /// The log's hash, as hex: equal for equal seeds.
    pub log_hash: String,
}

/// Telecommands of a plan; what a download asks for is not counted here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Commands {
    /// Asked for.
    pub asked: u64,
    /// Answered.
    pub answered: u64,
    /// Radiated, and nobody knows what became of them.
    pub unknown: u64,
    /// Rejected, expired or withdrawn.
    pub failed: u64,
    /// On the air outside of the pass as ground knew it.
    pub outside: u64,
}

/// What became of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StepFate {
    /// Done.
    Done,
    /// Its time was over, and what was done counts.
    Partly,
    /// Left out because a step before it failed.
    Skipped,
    /// Failed; why.
    Failed(String),
    /// The run ended in the middle of it.
    Unfinished,
    /// Not come to.
    NotReached,
}

impl StepFate {
    /// It counts as done.
    #[must_use]
    pub const fn is_done(&self) -> bool {
        matches!(self, Self::Done | Self::Partly)
    }
}

impl Outcome {
    pub(super) fn of(what: &Rehearsal, seed: u64, world: &World) -> Self {
        let (store, report) = (world.store(), world.report());
        let (aos, los) = (what.pass.aos_at, what.pass.los_at.unwrap_or(what.pass.tca_at));
        // Other passes of the coming days may be planned, too; only this one was flown.
        let run = store.runs.values().find(|run| run.aos_at < los && aos < run.los_at);
        let mut commands = Commands::default();
        for command in store.commands.values() {
            if let Some(at) = command.on_air_at {
                commands.outside += u64::from(at < aos || at >= los);
            }
            if command.record.download.is_some() {
                continue;
            }
            commands.asked += 1;
            match command.stage {
                Stage::Answered => commands.answered += 1,
                Stage::Unknown | Stage::Radiating | Stage::Radiated => commands.unknown += 1,
                _ => commands.failed += 1,
            }
        }
        let (end, why) = run.map_or(("missed", Some("no run was planned".to_owned())), ended);
        Self {
            seed,
            begun: run.is_some_and(|run| run.progress.started_at.is_some()),
            end,
            why,
            commands,
            chunks_home: store.chunks_held(),
            chunks_of: store.image().map(|(image, _)| u64::from(image.chunks)),
            steps: (0..what.plan.steps.len()).map(|at| fate(run, at)).collect(),
            airtime_up_s: report.airtime_up_s,
            airtime_down_s: report.airtime_down_s,
            log_hash: report.log_hash,
        }
    }

    /// Steps that count as done.
    #[must_use]
    pub fn steps_done(&self) -> usize {
        self.steps.iter().filter(|step| step.is_done()).count()
    }

    /// Steps that were not done at LOS.
    #[must_use]
    pub fn steps_undone(&self) -> usize {
        self.steps.len() - self.steps_done()
    }
}

/// How a run ended, and what is to be said to it.
fn ended(run: &RunRecord) -> (&'static str, Option<String>) {
    use mission::plan::RunEnd;
    match (&run.state, &run.progress.end) {
        (RunState::Ended, Some(end)) => {
            let why = match end {
                RunEnd::Aborted { step, why } => Some(format!("{step}: {why}")),
                RunEnd::Stopped(why) => Some(why.clone()),
                _ => None,
            };
            (end.name(), why)
        }
        (state, _) => (state.name(), state.why().map(str::to_owned)),
    }
}

/// What became of the step at this place of the plan's own list.
fn fate(run: Option<&RunRecord>, at: usize) -> StepFate {
    let place = format!("steps[{at}]");
    let result = run.and_then(|run| run.progress.results.iter().rev().find(|result| result.step == place));
    match result.map(|result| &result.end) {
        None => StepFate::NotReached,
        Some(StepEnd::Done) => StepFate::Done,
        Some(StepEnd::Partly(_)) => StepFate::Partly,
        Some(StepEnd::Skipped) => StepFate::Skipped,
        Some(StepEnd::Failed(why)) => StepFate::Failed(why.clone()),
        Some(StepEnd::Unfinished(_)) => StepFate::Unfinished,
    }
}
