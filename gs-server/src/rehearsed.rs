//! What a rehearsal came to, in the words of the API: the same from the command line and from the server.

use api::{
    Percentiles, PlanFinding, RehearsalAnswer, RehearsedEnd, RehearsedFigures, RehearsedPass, RehearsedRun,
    RehearsedStep,
};
use rehearsal::rehearse::{Outcome, Rehearsal, Spread, StepFate, Summary};

use crate::sky::fine_time;

/// The answer.
pub(crate) fn answer(
    what: &Rehearsal,
    seed: u64,
    summary: &Summary,
    outcomes: &[Outcome],
    findings: Vec<PlanFinding>,
) -> RehearsalAnswer {
    let steps = summary.steps.iter().enumerate().map(|(at, step)| RehearsedStep {
        place: format!("steps[{at}]"),
        action: step.action.to_owned(),
        done: step.done,
        partly: step.partly,
        failed: step.failed,
        unfinished: step.unfinished,
        not_reached: step.not_reached,
        why: step.why.clone(),
    });
    let ends = summary.ends.iter().map(|(end, (runs, why))| RehearsedEnd {
        end: (*end).to_owned(),
        runs: *runs,
        why: why.clone(),
    });
    RehearsalAnswer {
        ok: true,
        plan: what.plan.name.to_string(),
        satellite: what.plan.satellite.to_string(),
        pass: pass(what),
        seed,
        runs: summary.runs,
        begun: summary.begun,
        figures: RehearsedFigures {
            commands_asked: percentiles(summary.commands_asked),
            commands_answered: percentiles(summary.commands_answered),
            commands_unknown: percentiles(summary.commands_unknown),
            commands_failed: percentiles(summary.commands_failed),
            chunks_home: percentiles(summary.chunks_home),
            chunks_of: summary.chunks_of.map(percentiles),
            steps_undone: percentiles(summary.steps_undone),
            airtime_up_s: percentiles(summary.airtime_up_s),
            airtime_down_s: percentiles(summary.airtime_down_s),
        },
        runs_outside: summary.runs_outside,
        images_whole: summary.images_whole,
        steps: steps.collect(),
        ends: ends.collect(),
        findings,
        outcomes: outcomes.iter().map(run).collect(),
    }
}

fn pass(what: &Rehearsal) -> RehearsedPass {
    let pass = &what.pass;
    let time = |at| fine_time(mission::sky::instant(at));
    let aos = mission::sky::instant(pass.aos_at);
    RehearsedPass {
        aos: time(pass.aos_at),
        tca: time(pass.tca_at),
        los: pass.los_at.map(time),
        duration_s: pass.los_at.map(|los| mission::sky::instant(los).seconds_since(aos)),
        max_elevation_deg: pass.max_elevation_deg,
        epoch: fine_time(what.elements.epoch),
        age_days: what.elements.age_days(aos),
    }
}

fn percentiles(Spread { p10, p50, p90 }: Spread) -> Percentiles {
    Percentiles { p10, p50, p90 }
}

fn run(outcome: &Outcome) -> RehearsedRun {
    RehearsedRun {
        seed: outcome.seed,
        begun: outcome.begun,
        end: outcome.end.to_owned(),
        why: outcome.why.clone(),
        commands_asked: outcome.commands.asked,
        commands_answered: outcome.commands.answered,
        commands_unknown: outcome.commands.unknown,
        commands_failed: outcome.commands.failed,
        commands_outside: outcome.commands.outside,
        chunks_home: outcome.chunks_home,
        chunks_of: outcome.chunks_of,
        steps: outcome.steps.iter().map(|fate| word(fate).to_owned()).collect(),
        airtime_up_s: outcome.airtime_up_s,
        airtime_down_s: outcome.airtime_down_s,
    }
}

fn word(fate: &StepFate) -> &'static str {
    match fate {
        StepFate::Done => "done",
        StepFate::Partly => "partly",
        StepFate::Skipped => "skipped",
        StepFate::Failed(_) => "failed",
        StepFate::Unfinished => "unfinished",
        StepFate::NotReached => "not-reached",
    }
}
