//! How far a run has come: a plain value that outlives the process.

use std::collections::BTreeMap;

use super::step::Ordinal;
use crate::clock::UtcUs;
use crate::id::{CommandId, DownloadId};
use crate::stage::Stage;

/// How far a run has come. Stored with (or before) whatever the wishes of the same call caused.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Progress {
    /// When the first step began; `None`: not yet.
    pub started_at: Option<UtcUs>,
    /// When this was true.
    pub at: Option<UtcUs>,
    /// How long the run had run then, microseconds. Limits and waits are counted on this scale, which no step of the
    /// clock disturbs while the process lives.
    pub ran_us: u64,
    /// Where it stands: the place in the plan's steps, then in those of the repeat found there, and so on.
    pub cursor: Vec<Frame>,
    /// What was accepted of what it asked for.
    pub asked: BTreeMap<Ordinal, Ask>,
    /// What ended, in this order. Bounded: what is more is counted by `results_dropped`.
    pub results: Vec<StepResult>,
    /// Results that found no place.
    pub results_dropped: u64,
    /// How it ended; `None`: it goes on.
    pub end: Option<RunEnd>,
}

/// A place in a list of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Frame {
    /// Which step, from 0.
    pub index: u32,
    /// Which round of it, if it is a repeat, from 0.
    pub round: u32,
    /// When it was come to, on the run's own scale; `None`: not yet.
    pub entered_us: Option<u64>,
    /// When its conditions held and it began; `None`: not yet.
    pub begun_us: Option<u64>,
    /// How many of its telecommands are done.
    pub part: u32,
}

/// Something that was accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ask {
    /// The row that it became.
    pub ticket: Ticket,
    /// The last stage that was seen of a command.
    pub stage: Option<Stage>,
}

/// The row that an ask became.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ticket {
    /// A command.
    Command(CommandId),
    /// A download.
    Download(DownloadId),
}

/// A step that ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StepResult {
    /// Which, e.g. `steps[3].steps[0]`.
    pub step: String,
    /// The rounds of the repeats around it, from 0, outermost first.
    pub rounds: Vec<u32>,
    /// When it was come to, if the clock was right.
    pub entered_at: UtcUs,
    /// When it ended.
    pub ended_at: UtcUs,
    /// How.
    pub end: StepEnd,
}

/// How a step ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StepEnd {
    /// As it should.
    Done,
    /// Its time was over, and what was done counts (a download that is not whole).
    Partly(String),
    /// Left out because a step before it failed.
    Skipped,
    /// It failed; why.
    Failed(String),
    /// The run ended in the middle of it; why.
    Unfinished(String),
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunEnd {
    /// All steps were gone through.
    Completed {
        /// So many of them failed, and were passed over.
        failures: u32,
    },
    /// A step failed that may not.
    Aborted {
        /// Which.
        step: String,
        /// Why.
        why: String,
    },
    /// The time limit of the plan is over.
    OutOfTime,
    /// LOS came first. What is undone stays undone.
    Unfinished,
    /// LOS came first. What is undone is done in the next pass: [`Progress::for_next_pass`].
    Later,
    /// Somebody stopped it; why.
    Stopped(String),
}

impl RunEnd {
    /// The word in the database and on the wire.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Completed { .. } => "completed",
            Self::Aborted { .. } => "aborted",
            Self::OutOfTime => "out-of-time",
            Self::Unfinished => "unfinished",
            Self::Later => "later",
            Self::Stopped(_) => "stopped",
        }
    }
}

impl Progress {
    /// For a new run of the same plan in the next pass, under a new run id: the place is kept, times and asks are not.
    /// Only after [`RunEnd::Later`].
    #[must_use]
    pub fn for_next_pass(&self) -> Self {
        let begin = |frame: &Frame| Frame { entered_us: None, begun_us: None, ..*frame };
        Self { cursor: self.cursor.iter().map(begin).collect(), ..Self::default() }
    }
}
