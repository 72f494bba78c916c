//! What a rehearsal came to, as a table.

use std::fmt::Write as _;

use api::{FineTime, Percentiles, PlanFinding, RehearsalAnswer, RehearsedEnd};
use serde::Serialize;

use crate::cli::plan::line;

/// What `--json` prints when the plan is not taken.
#[derive(Serialize)]
pub(super) struct Refused<'a> {
    ok: bool,
    findings: &'a [PlanFinding],
}

pub(super) fn refused(findings: &[PlanFinding]) -> Refused<'_> {
    Refused { ok: false, findings }
}

/// For a person; `name` is the plan's file.
pub(super) fn table(answer: &RehearsalAnswer, name: &str) -> String {
    let (pass, figures, mut out) = (&answer.pass, &answer.figures, String::new());
    let seconds = |at: &FineTime| at.to_string().chars().take(19).collect::<String>() + "Z";
    // A string takes everything.
    let _ = writeln!(
        out,
        "plan {} for {}, pass from {} to {}, {:.0}\u{b0} high\n{} runs, seeds {} to {}; the plan began in {}\n",
        answer.plan,
        answer.satellite,
        seconds(&pass.aos),
        pass.los.as_ref().map_or_else(|| "the end of the elements".to_owned(), seconds),
        pass.max_elevation_deg,
        answer.runs,
        answer.seed,
        answer.seed + (answer.runs as u64).saturating_sub(1),
        answer.begun
    );
    let _ = writeln!(out, "{:20} {:>8} {:>8} {:>8}", "", "10 %", "50 %", "90 %");
    let mut row = |what: &str, spread: &Percentiles| {
        let Percentiles { p10, p50, p90 } = spread;
        let _ = writeln!(out, "{what:20} {p10:8.0} {p50:8.0} {p90:8.0}");
    };
    row("commands asked", &figures.commands_asked);
    row("commands answered", &figures.commands_answered);
    row("commands unknown", &figures.commands_unknown);
    row("commands failed", &figures.commands_failed);
    if let Some(of) = &figures.chunks_of {
        row("chunks home", &figures.chunks_home);
        row("chunks of the image", of);
    }
    row("steps undone at LOS", &figures.steps_undone);
    row("airtime up, s", &figures.airtime_up_s);
    row("airtime down, s", &figures.airtime_down_s);
    if figures.chunks_of.is_some() {
        let _ = writeln!(out, "\nan image came home whole in {} runs", answer.images_whole);
    }
    let _ = writeln!(
        out,
        "\n{:10} {:16} {:>6} {:>6} {:>6} {:>10} {:>11}",
        "step", "do", "done", "partly", "failed", "unfinished", "not reached"
    );
    for step in &answer.steps {
        let _ = writeln!(
            out,
            "{:10} {:16} {:6} {:6} {:6} {:10} {:11}",
            step.place, step.action, step.done, step.partly, step.failed, step.unfinished, step.not_reached
        );
    }
    out.push('\n');
    for RehearsedEnd { end, runs, why } in &answer.ends {
        let why = why.as_ref().map(|why| format!(" ({why})")).unwrap_or_default();
        let _ = writeln!(out, "{end} in {runs} runs{why}");
    }
    for finding in &answer.findings {
        let _ = writeln!(out, "{}", line(name, finding));
    }
    out
}
