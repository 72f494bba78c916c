//! Runs of plans and their steps in the words of the API.

use api::{PlanText, RunView, StepReport};
use mission::plan::{RunEnd, StepEnd, StepResult};
use mission::run::RunRecord;

use super::pass::time;

/// A run on the wire.
pub(crate) fn run_view(record: &RunRecord, name: String) -> RunView {
    let progress = &record.progress;
    RunView {
        id: record.id.0,
        plan: record.plan.0,
        name,
        satellite: record.satellite.to_string(),
        station: record.station.to_string(),
        link: record.link.as_ref().map(ToString::to_string),
        pass: record.pass.map(|pass| pass.0),
        aos: time(record.aos_at.0),
        los: time(record.los_at.0),
        state: record.state.name().to_owned(),
        why: record.state.why().map(str::to_owned),
        outcome: progress.end.as_ref().map(|end| end.name().to_owned()),
        outcome_why: progress.end.as_ref().and_then(outcome_why),
        started_at: progress.started_at.map(|at| time(at.0)),
        steps_ended: (progress.results.len() as u64).saturating_add(progress.results_dropped),
        at: time(record.at.0),
    }
}

fn outcome_why(end: &RunEnd) -> Option<String> {
    match end {
        RunEnd::Completed { failures: 0 } | RunEnd::OutOfTime | RunEnd::Unfinished | RunEnd::Later => None,
        RunEnd::Completed { failures: 1 } => Some("1 step failed and was passed over".to_owned()),
        RunEnd::Completed { failures } => Some(format!("{failures} steps failed and were passed over")),
        RunEnd::Aborted { step, why } => Some(format!("{step}: {why}")),
        RunEnd::Stopped(why) => Some(why.clone()),
    }
}

/// A step that ended, with what the plan says of it.
pub(crate) fn step_report(result: &StepResult, plan: &PlanText) -> StepReport {
    let (end, why) = match &result.end {
        StepEnd::Done => ("done", None),
        StepEnd::Partly(why) => ("partly", Some(why)),
        StepEnd::Skipped => ("skipped", None),
        StepEnd::Failed(why) => ("failed", Some(why)),
        StepEnd::Unfinished(why) => ("unfinished", Some(why)),
    };
    StepReport {
        what: what(plan, &result.step),
        step: result.step.clone(),
        rounds: result.rounds.clone(),
        entered_at: time(result.entered_at.0),
        ended_at: time(result.ended_at.0),
        end: end.to_owned(),
        why: why.cloned(),
    }
}

/// What the step at `steps[3].steps[0]` does: `command Ping`, `listen`.
fn what(plan: &PlanText, place: &str) -> Option<String> {
    let mut steps = Some(&plan.steps);
    let mut found = None;
    for part in place.split('.') {
        let index: usize = part.strip_prefix("steps[")?.strip_suffix(']')?.parse().ok()?;
        let step = steps?.get(index)?;
        steps = step.steps.as_ref();
        found = Some(step);
    }
    let step = found?;
    Some(match &step.command {
        Some(command) => format!("{} {command}", step.what),
        None => step.what.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_found_by_its_place() {
        let plan: PlanText = serde_json::from_value(serde_json::json!({
            "name": "a", "satellite": "s",
            "steps": [
                {"do": "listen", "for_s": 1},
                {"do": "repeat-until", "at_most": 2, "steps": [{"do": "command", "command": "Ping"}]},
            ],
        }))
        .unwrap();
        let told = |place: &str| what(&plan, place);
        assert_eq!(told("steps[0]").as_deref(), Some("listen"));
        assert_eq!(told("steps[1].steps[0]").as_deref(), Some("command Ping"));
        for nowhere in ["", "steps[2]", "steps[0].steps[0]", "steps[1].until", "steps[x]"] {
            assert_eq!(told(nowhere), None, "{nowhere}");
        }
    }
}
