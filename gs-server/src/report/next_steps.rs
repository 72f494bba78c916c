//! What somebody should do after a pass.

use api::{CommandReported, ImageReported, PassReport, RunReported};
use mission::sky::ElementsAge;
use mission::{Level, Stage, UtcUs};
use tle::Elements;

/// Commands of one kind that are named; the others are counted.
const NAMED_MAX: usize = 5;

/// Sentences, the most pressing first.
pub(super) fn next_steps(report: &PassReport, elements: Option<&Elements>) -> Vec<String> {
    let mut steps = Vec::new();
    let is_grave = |level: &str| level.parse::<Level>().is_ok_and(|level| level >= Level::Distress);
    let grave = report.alarms.iter().filter(|alarm| is_grave(&alarm.level));
    if let Some(last) = grave.clone().next_back() {
        steps.push(format!(
            "Look into {} of level distress or graver, the last one: {}.",
            counted(grave.count(), "alarm"),
            last.message.trim_end_matches('.')
        ));
    }
    let at = |stage: Stage| -> Vec<&CommandReported> {
        report.commands.iter().filter(|command| command.stage == stage.name()).collect()
    };
    let unknown = at(Stage::Unknown);
    if !unknown.is_empty() {
        steps.push(format!(
            "Settle {}: it is not known whether the satellite did it. Compare telemetry before giving it again.",
            named(&unknown)
        ));
    }
    for (stage, word) in
        [(Stage::Rejected, "rejected"), (Stage::Failed, "failed"), (Stage::Expired, "expired")]
    {
        let ended = at(stage);
        if let Some(last) = ended.last() {
            let why = last.why.trim_end_matches('.');
            steps.push(format!("See why {} {word}: {why}.", named(&ended)));
        }
    }
    if report.had.frames == 0 {
        let while_it_lasts = if report.is_final { "" } else { " yet" };
        steps.push(format!(
            "Nothing was heard{while_it_lasts}: check link, antenna and elements, and whether other stations heard the satellite."
        ));
    }
    steps.extend(report.runs.iter().filter_map(of_run));
    let waiting: Vec<&CommandReported> =
        [Stage::Queued, Stage::Sealed, Stage::Radiating, Stage::Radiated].into_iter().flat_map(at).collect();
    if !waiting.is_empty() {
        steps.push(format!("{} on the way: {}.", counted(waiting.len(), "command"), named(&waiting)));
    }
    steps.extend(report.images.iter().filter_map(of_image));
    if let Some(set) = elements {
        let age = ElementsAge::at(set, UtcUs(report.as_of.unix_us()));
        if age.level > Level::Normal {
            steps.push(format!(
                "Fetch newer elements: these are {:.1} days old, and AOS and LOS may be off by {:.0} s.",
                age.age_days, age.timing_error_s
            ));
        }
    }
    if steps.is_empty() {
        steps.push("Nothing is left to do.".to_owned());
    }
    steps
}

fn of_run(reported: &RunReported) -> Option<String> {
    let run = &reported.run;
    let why = run.why.as_ref().or(run.outcome_why.as_ref());
    let why = why.map(|why| format!(": {}", why.trim_end_matches('.'))).unwrap_or_default();
    match (run.state.as_str(), run.outcome.as_deref()) {
        (state @ ("missed" | "dropped"), _) => {
            Some(format!("Plan {} was {state} in this pass{why}.", run.name))
        }
        (_, Some("aborted")) => Some(format!("Plan {} was aborted{why}.", run.name)),
        (_, Some("stopped")) => Some(format!("Plan {} was stopped{why}.", run.name)),
        (_, Some("unfinished" | "out-of-time")) => {
            Some(format!("Plan {} came to no end: give it another pass.", run.name))
        }
        (_, Some("later")) => Some(format!("Plan {} goes on in the next pass that it gets.", run.name)),
        _ => None,
    }
}

fn of_image(image: &ImageReported) -> Option<String> {
    let lacking = image.chunks.checked_sub(image.held).filter(|lacking| *lacking > 0)?;
    Some(format!(
        "Image {} lacks {} of {} chunks: order the rest, or let a plan do so.",
        image.image, lacking, image.chunks
    ))
}

fn named(commands: &[&CommandReported]) -> String {
    let mut names: Vec<String> = commands
        .iter()
        .take(NAMED_MAX)
        .map(|command| format!("command {} ({})", command.id, command.command))
        .collect();
    if commands.len() > NAMED_MAX {
        names.push(format!("{} more", commands.len() - NAMED_MAX));
    }
    names.join(", ")
}

/// `1 alarm`, `2 alarms`.
pub(super) fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}
