//! How far a run has come, as JSON: one shape for the database, read back whole or not at all.

use std::collections::BTreeMap;

use mission::plan::{Ask, Frame, Ordinal, Progress, RunEnd, StepEnd, StepResult, Ticket};
use mission::{CommandId, DownloadId, UtcUs};
use serde::{Deserialize, Serialize};

use super::StoreError;
use super::convert::parse;

#[derive(Serialize, Deserialize)]
struct Stored {
    started_at_us: Option<i64>,
    at_us: Option<i64>,
    ran_us: u64,
    cursor: Vec<Place>,
    asked: BTreeMap<u64, Asked>,
    results: Vec<Ended>,
    results_dropped: u64,
    end: Option<(String, String, String)>,
}

#[derive(Serialize, Deserialize)]
struct Place {
    index: u32,
    round: u32,
    entered_us: Option<u64>,
    begun_us: Option<u64>,
    part: u32,
}

#[derive(Serialize, Deserialize)]
struct Asked {
    command: Option<u64>,
    download: Option<u64>,
    stage: Option<String>,
}

#[derive(Serialize, Deserialize)]
struct Ended {
    step: String,
    rounds: Vec<u32>,
    entered_at_us: i64,
    ended_at_us: i64,
    end: String,
    why: String,
}

fn wrong(what: impl std::fmt::Display) -> StoreError {
    StoreError::damaged(format!("plan_runs.progress: {what}"))
}

pub(super) fn write(progress: &Progress) -> Result<String, StoreError> {
    let stored = Stored {
        started_at_us: progress.started_at.map(|at| at.0),
        at_us: progress.at.map(|at| at.0),
        ran_us: progress.ran_us,
        cursor: progress.cursor.iter().map(place).collect(),
        asked: progress.asked.iter().map(|(ordinal, ask)| (ordinal.0, asked(ask))).collect(),
        results: progress.results.iter().map(ended).collect(),
        results_dropped: progress.results_dropped,
        end: progress.end.as_ref().map(end),
    };
    serde_json::to_string(&stored).map_err(|error| StoreError::Conflict(error.to_string()))
}

pub(super) fn read(text: &str) -> Result<Progress, StoreError> {
    let stored: Stored = serde_json::from_str(text).map_err(wrong)?;
    Ok(Progress {
        started_at: stored.started_at_us.map(UtcUs),
        at: stored.at_us.map(UtcUs),
        ran_us: stored.ran_us,
        cursor: stored.cursor.iter().map(frame).collect(),
        asked: stored
            .asked
            .iter()
            .map(|(ordinal, asked)| Ok((Ordinal(*ordinal), ask(asked)?)))
            .collect::<Result<_, StoreError>>()?,
        results: stored.results.into_iter().map(result).collect::<Result<_, _>>()?,
        results_dropped: stored.results_dropped,
        end: stored.end.map(run_end).transpose()?,
    })
}

const fn place(frame: &Frame) -> Place {
    Place {
        index: frame.index,
        round: frame.round,
        entered_us: frame.entered_us,
        begun_us: frame.begun_us,
        part: frame.part,
    }
}

const fn frame(place: &Place) -> Frame {
    Frame {
        index: place.index,
        round: place.round,
        entered_us: place.entered_us,
        begun_us: place.begun_us,
        part: place.part,
    }
}

fn asked(ask: &Ask) -> Asked {
    let (command, download) = match ask.ticket {
        Ticket::Command(id) => (Some(id.0), None),
        Ticket::Download(id) => (None, Some(id.0)),
    };
    Asked { command, download, stage: ask.stage.map(|stage| stage.name().to_owned()) }
}

fn ask(asked: &Asked) -> Result<Ask, StoreError> {
    let ticket = match (asked.command, asked.download) {
        (Some(id), None) => Ticket::Command(CommandId(id)),
        (None, Some(id)) => Ticket::Download(DownloadId(id)),
        _ => return Err(wrong("an ask is neither a command nor a download")),
    };
    let stage = asked.stage.as_deref().map(|stage| parse("plan_runs.progress", stage)).transpose()?;
    Ok(Ask { ticket, stage })
}

fn ended(result: &StepResult) -> Ended {
    let (end, why) = match &result.end {
        StepEnd::Done => ("done", ""),
        StepEnd::Partly(why) => ("partly", why.as_str()),
        StepEnd::Skipped => ("skipped", ""),
        StepEnd::Failed(why) => ("failed", why.as_str()),
        StepEnd::Unfinished(why) => ("unfinished", why.as_str()),
    };
    Ended {
        step: result.step.clone(),
        rounds: result.rounds.clone(),
        entered_at_us: result.entered_at.0,
        ended_at_us: result.ended_at.0,
        end: end.to_owned(),
        why: why.to_owned(),
    }
}

fn result(ended: Ended) -> Result<StepResult, StoreError> {
    Ok(StepResult {
        end: match ended.end.as_str() {
            "done" => StepEnd::Done,
            "partly" => StepEnd::Partly(ended.why),
            "skipped" => StepEnd::Skipped,
            "failed" => StepEnd::Failed(ended.why),
            "unfinished" => StepEnd::Unfinished(ended.why),
            other => return Err(wrong(format!("a step ended '{other}'"))),
        },
        step: ended.step,
        rounds: ended.rounds,
        entered_at: UtcUs(ended.entered_at_us),
        ended_at: UtcUs(ended.ended_at_us),
    })
}

/// The word, and what belongs to it.
fn end(end: &RunEnd) -> (String, String, String) {
    let (first, second) = match end {
        RunEnd::Completed { failures } => (failures.to_string(), String::new()),
        RunEnd::Aborted { step, why } => (step.clone(), why.clone()),
        RunEnd::Stopped(why) => (why.clone(), String::new()),
        RunEnd::OutOfTime | RunEnd::Unfinished | RunEnd::Later => (String::new(), String::new()),
    };
    (end.name().to_owned(), first, second)
}

fn run_end((word, first, second): (String, String, String)) -> Result<RunEnd, StoreError> {
    Ok(match word.as_str() {
        "completed" => RunEnd::Completed { failures: first.parse().map_err(wrong)? },
        "aborted" => RunEnd::Aborted { step: first, why: second },
        "out-of-time" => RunEnd::OutOfTime,
        "unfinished" => RunEnd::Unfinished,
        "later" => RunEnd::Later,
        "stopped" => RunEnd::Stopped(first),
        other => return Err(wrong(format!("it ended '{other}'"))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mission::Stage;

    #[test]
    fn every_shape_of_progress_comes_back() {
        let ends = [
            RunEnd::Completed { failures: 3 },
            RunEnd::Aborted { step: "steps[1]".into(), why: "no answer".into() },
            RunEnd::OutOfTime,
            RunEnd::Unfinished,
            RunEnd::Later,
            RunEnd::Stopped("disarmed".into()),
        ];
        let steps = [
            StepEnd::Done,
            StepEnd::Partly("a".into()),
            StepEnd::Skipped,
            StepEnd::Failed("b".into()),
            StepEnd::Unfinished("c".into()),
        ];
        for end in ends.into_iter().map(Some).chain([None]) {
            let progress = Progress {
                started_at: Some(UtcUs(5)),
                at: Some(UtcUs(7)),
                ran_us: 9,
                cursor: vec![Frame { index: 1, round: 2, entered_us: Some(3), begun_us: None, part: 4 }],
                asked: [
                    (Ordinal(0), Ask { ticket: Ticket::Command(CommandId(8)), stage: Some(Stage::Unknown) }),
                    (Ordinal(4), Ask { ticket: Ticket::Download(DownloadId(2)), stage: None }),
                ]
                .into(),
                results: steps
                    .iter()
                    .map(|end| StepResult {
                        step: "steps[0]".into(),
                        rounds: vec![1, 2],
                        entered_at: UtcUs(1),
                        ended_at: UtcUs(2),
                        end: end.clone(),
                    })
                    .collect(),
                results_dropped: 6,
                end,
            };
            assert_eq!(read(&write(&progress).unwrap()).unwrap(), progress);
        }
        assert!(read("{}").is_err());
    }
}
