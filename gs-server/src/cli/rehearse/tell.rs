//! What a rehearsal came to, as a table and as JSON.

use std::fmt::Write as _;

use api::{FineTime, PlanFinding};
use rehearsal::rehearse::{Outcome, Spread, StepFate};
use serde::Serialize;

use super::Answer;
use crate::cli::plan::line;
use crate::sky::fine_time;

/// What `--json` prints when the plan is not taken.
#[derive(Serialize)]
pub(super) struct Refused<'a> {
    ok: bool,
    findings: &'a [PlanFinding],
}

pub(super) fn refused(findings: &[PlanFinding]) -> Refused<'_> {
    Refused { ok: false, findings }
}

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Json<'a> {
    ok: bool,
    plan: &'a str,
    satellite: &'a str,
    pass: Pass,
    seed: u64,
    runs: usize,
    begun: usize,
    figures: Figures,
    runs_outside: usize,
    images_whole: usize,
    steps: Vec<Step<'a>>,
    ends: Vec<End<'a>>,
    findings: &'a [PlanFinding],
    outcomes: Vec<Run<'a>>,
}

#[derive(Serialize)]
struct Pass {
    aos: FineTime,
    tca: FineTime,
    los: Option<FineTime>,
    duration_s: Option<f64>,
    max_elevation_deg: f64,
    epoch: FineTime,
    age_days: f64,
}

#[derive(Serialize)]
struct Figures {
    commands_asked: Percentiles,
    commands_answered: Percentiles,
    commands_unknown: Percentiles,
    commands_failed: Percentiles,
    chunks_home: Percentiles,
    chunks_of: Option<Percentiles>,
    steps_undone: Percentiles,
    airtime_up_s: Percentiles,
    airtime_down_s: Percentiles,
}

#[derive(Serialize)]
struct Percentiles {
    p10: f64,
    p50: f64,
    p90: f64,
}

impl From<Spread> for Percentiles {
    fn from(spread: Spread) -> Self {
        let Spread { p10, p50, p90 } = spread;
        Self { p10, p50, p90 }
    }
}

#[derive(Serialize)]
struct Step<'a> {
    place: String,
    #[serde(rename = "do")]
    action: &'a str,
    done: usize,
    partly: usize,
    failed: usize,
    unfinished: usize,
    not_reached: usize,
    why: Option<&'a str>,
}

#[derive(Serialize)]
struct End<'a> {
    end: &'a str,
    runs: usize,
    why: Option<&'a str>,
}

#[derive(Serialize)]
struct Run<'a> {
    seed: u64,
    begun: bool,
    end: &'a str,
    why: Option<&'a str>,
    commands_asked: u64,
    commands_answered: u64,
    commands_unknown: u64,
    commands_failed: u64,
    commands_outside: u64,
    chunks_home: u64,
    chunks_of: Option<u64>,
    steps: Vec<&'static str>,
    airtime_up_s: f64,
    airtime_down_s: f64,
}

impl<'a> Run<'a> {
    fn of(outcome: &'a Outcome) -> Self {
        Self {
            seed: outcome.seed,
            begun: outcome.begun,
            end: outcome.end,
            why: outcome.why.as_deref(),
            commands_asked: outcome.commands.asked,
            commands_answered: outcome.commands.answered,
            commands_unknown: outcome.commands.unknown,
            commands_failed: outcome.commands.failed,
            commands_outside: outcome.commands.outside,
            chunks_home: outcome.chunks_home,
            chunks_of: outcome.chunks_of,
            steps: outcome.steps.iter().map(word).collect(),
            airtime_up_s: outcome.airtime_up_s,
            airtime_down_s: outcome.airtime_down_s,
        }
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

impl<'a> Answer<'a> {
    fn pass(&self) -> Pass {
        let pass = &self.what.pass;
        let time = |at| fine_time(mission::sky::instant(at));
        let aos = mission::sky::instant(pass.aos_at);
        Pass {
            aos: time(pass.aos_at),
            tca: time(pass.tca_at),
            los: pass.los_at.map(time),
            duration_s: pass.los_at.map(|los| mission::sky::instant(los).seconds_since(aos)),
            max_elevation_deg: pass.max_elevation_deg,
            epoch: fine_time(self.what.elements.epoch),
            age_days: self.what.elements.age_days(aos),
        }
    }

    pub(super) fn json(&self) -> Json<'a> {
        let (summary, plan) = (self.summary, &self.what.plan);
        let steps = summary.steps.iter().enumerate().map(|(at, step)| Step {
            place: format!("steps[{at}]"),
            action: step.action,
            done: step.done,
            partly: step.partly,
            failed: step.failed,
            unfinished: step.unfinished,
            not_reached: step.not_reached,
            why: step.why.as_deref(),
        });
        let ends =
            summary.ends.iter().map(|(end, (runs, why))| End { end, runs: *runs, why: why.as_deref() });
        Json {
            ok: true,
            plan: plan.name.as_str(),
            satellite: plan.satellite.as_str(),
            pass: self.pass(),
            seed: self.seed,
            runs: summary.runs,
            begun: summary.begun,
            figures: Figures {
                commands_asked: summary.commands_asked.into(),
                commands_answered: summary.commands_answered.into(),
                commands_unknown: summary.commands_unknown.into(),
                commands_failed: summary.commands_failed.into(),
                chunks_home: summary.chunks_home.into(),
                chunks_of: summary.chunks_of.map(Into::into),
                steps_undone: summary.steps_undone.into(),
                airtime_up_s: summary.airtime_up_s.into(),
                airtime_down_s: summary.airtime_down_s.into(),
            },
            runs_outside: summary.runs_outside,
            images_whole: summary.images_whole,
            steps: steps.collect(),
            ends: ends.collect(),
            findings: self.findings,
            outcomes: self.outcomes.iter().map(Run::of).collect(),
        }
    }

    pub(super) fn table(&self) -> String {
        let (summary, plan) = (self.summary, &self.what.plan);
        let (pass, mut out) = (self.pass(), String::new());
        let seconds = |at: &FineTime| at.to_string().chars().take(19).collect::<String>() + "Z";
        // A string takes everything.
        let _ = writeln!(
            out,
            "plan {} for {}, pass from {} to {}, {:.0}\u{b0} high\n{} runs, seeds {} to {}; the plan began in {}\n",
            plan.name,
            plan.satellite,
            seconds(&pass.aos),
            pass.los.as_ref().map_or_else(|| "the end of the elements".to_owned(), seconds),
            pass.max_elevation_deg,
            summary.runs,
            self.seed,
            self.seed + (summary.runs as u64).saturating_sub(1),
            summary.begun
        );
        let _ = writeln!(out, "{:20} {:>8} {:>8} {:>8}", "", "10 %", "50 %", "90 %");
        let mut row = |what: &str, spread: &Spread| {
            let Spread { p10, p50, p90 } = spread;
            let _ = writeln!(out, "{what:20} {p10:8.0} {p50:8.0} {p90:8.0}");
        };
        row("commands asked", &summary.commands_asked);
        row("commands answered", &summary.commands_answered);
        row("commands unknown", &summary.commands_unknown);
        row("commands failed", &summary.commands_failed);
        if let Some(of) = &summary.chunks_of {
            row("chunks home", &summary.chunks_home);
            row("chunks of the image", of);
        }
        row("steps undone at LOS", &summary.steps_undone);
        row("airtime up, s", &summary.airtime_up_s);
        row("airtime down, s", &summary.airtime_down_s);
        if summary.chunks_of.is_some() {
            let _ = writeln!(out, "\nan image came home whole in {} runs", summary.images_whole);
        }
        let _ = writeln!(
            out,
            "\n{:10} {:16} {:>6} {:>6} {:>6} {:>10} {:>11}",
            "step", "do", "done", "partly", "failed", "unfinished", "not reached"
        );
        for (at, step) in summary.steps.iter().enumerate() {
            let _ = writeln!(
                out,
                "{:10} {:16} {:6} {:6} {:6} {:10} {:11}",
                format!("steps[{at}]"),
                step.action,
                step.done,
                step.partly,
                step.failed,
                step.unfinished,
                step.not_reached
            );
        }
        out.push('\n');
        for (end, (runs, why)) in &summary.ends {
            let why = why.as_ref().map(|why| format!(" ({why})")).unwrap_or_default();
            let _ = writeln!(out, "{end} in {runs} runs{why}");
        }
        for finding in self.findings {
            let _ = writeln!(out, "{}", line(self.name, finding));
        }
        out
    }
}
