//! A pass report in words.

use api::{CommandReported, ImageReported, PassReport, RunReported, Spread, Time};

use super::document::Block::{Facts, Heading, List, Paragraph, Plots};
use super::document::{Block, Cell, Document, Side, Table};
use super::next_steps::counted;
use super::plots::{bands, plots};

use Side::{Left, Right};

/// A pass report as headings, tables and plots.
#[must_use]
pub fn pass_document(report: &PassReport) -> Document {
    let mut blocks = vec![Heading("Next steps"), List(report.next_steps.clone())];
    if let Some(next) = &report.next_pass {
        blocks.push(Paragraph(format!(
            "Next pass: {} to {}, {:.0}° high.",
            moment(next.aos),
            next.los.map_or_else(|| "no end".to_owned(), clock),
            next.max_elevation_deg
        )));
    }
    blocks.extend([Heading("Planned and had"), Facts(facts(report))]);
    blocks.extend([Heading("Signal"), Plots(plots(report))]);
    blocks.extend(signal(report));
    blocks.extend(frames(report));
    blocks.extend(gaps(report));
    if !report.runs.is_empty() {
        blocks.push(Heading("Plans"));
        report.runs.iter().for_each(|run| blocks.extend(run_blocks(run)));
    }
    blocks.extend(commands(report));
    if !report.images.is_empty() {
        blocks.extend([Heading("Images"), Block::Table(images(&report.images))]);
        blocks.extend(report.images.iter().filter_map(missing).map(Paragraph));
    }
    blocks.push(Heading("Alarms"));
    blocks.extend(alarms(&report.alarms, report.alarms_left_out, "in this pass"));
    let aos = moment(report.planned.aos);
    Document {
        title: format!("Pass {} of {} over {}", report.pass, report.satellite, report.station),
        subtitle: format!(
            "{aos} to {}. {} {}.",
            report.planned.los.map_or_else(|| "no end".to_owned(), clock),
            if report.is_final { "The archive as it stood at" } else { "The pass lasts; as of" },
            moment(report.as_of)
        ),
        simulated: report.simulated,
        blocks,
    }
}

/// The age of elements: those of a launch to come, or of one's own making, may have their epoch ahead.
pub(super) fn age(days: f64) -> String {
    let side = if days < -0.05 { "before their epoch" } else { "old" };
    format!("{:.1} days {side}", days.abs())
}

fn facts(report: &PassReport) -> Vec<(&'static str, String)> {
    let (planned, had) = (&report.planned, &report.had);
    let mut facts = vec![
        ("AOS", moment(planned.aos)),
        ("TCA", clock(planned.tca)),
        ("LOS", planned.los.map_or_else(|| "does not set".to_owned(), clock)),
        ("Duration", planned.duration_s.map_or_else(unknown, lasting)),
        ("Highest", format!("{:.1}°", planned.max_elevation_deg)),
        (
            "Elements",
            match (planned.elements, planned.elements_age_days) {
                (Some(id), Some(days)) => format!("set {id}, {}", age(days)),
                _ => unknown(),
            },
        ),
        ("First frame", had.first_frame.map_or_else(none, clock)),
        ("Last frame", had.last_frame.map_or_else(none, clock)),
        ("Frames", format!("{} ({} bytes)", had.frames, had.bytes)),
        (
            "Heartbeats",
            match had.heartbeats_expected {
                Some(expected) => format!("{} of {expected} by the period", had.heartbeats),
                None => had.heartbeats.to_string(),
            },
        ),
        ("Airtime down", had.airtime_s.map_or_else(unknown, airtime)),
        ("Radiated", counted(usize::try_from(report.uplink.frames).unwrap_or(usize::MAX), "frame")),
        ("Airtime up", report.uplink.airtime_s.map_or_else(unknown, airtime)),
        ("Strength", had.rssi_dbm.map_or_else(unknown, |spread| spread_words(spread, "dBm"))),
        ("SNR", had.snr_db.map_or_else(unknown, |spread| spread_words(spread, "dB"))),
    ];
    if had.ended_at.is_none() {
        facts.push(("State", "the pass lasts".to_owned()));
    }
    facts
}

fn signal(report: &PassReport) -> Vec<Block> {
    if report.had.frames == 0 {
        return vec![Paragraph("No frame was heard.".to_owned())];
    }
    let bands = bands(&report.signal, &report.path);
    if bands.is_empty() {
        return vec![Paragraph(
            "The station does not know where it stands or had no elements, so nothing is known of elevations."
                .to_owned(),
        )];
    }
    let columns = [
        ("Elevation", Left),
        ("Frames", Right),
        ("Weakest dBm", Right),
        ("Median dBm", Right),
        ("Strongest dBm", Right),
    ];
    let mut table = Table::new(&columns);
    for (low, high, rssi, frames) in bands {
        let told = |value: Option<&i32>| value.map_or_else(|| "-".to_owned(), ToString::to_string);
        table.row([
            format!("{low}° to {high}°"),
            frames.to_string(),
            told(rssi.first()),
            median(&rssi).map_or_else(|| "-".to_owned(), |value| format!("{value:.0}")),
            told(rssi.last()),
        ]);
    }
    vec![Block::Table(table)]
}

/// Of values in order; of two in the middle their mean.
fn median(values: &[i32]) -> Option<f64> {
    let low = values.get(values.len().saturating_sub(1) / 2)?;
    let high = values.get(values.len() / 2)?;
    Some(f64::midpoint(f64::from(*low), f64::from(*high)))
}

fn frames(report: &PassReport) -> Vec<Block> {
    let mut table = Table::new(&[("Packet", Left), ("Type", Right), ("Frames", Right)]);
    for count in &report.had.packets {
        table.row([
            count.packet_name.clone().unwrap_or_else(unknown),
            count.packet_type.map_or_else(|| "-".to_owned(), |code| code.to_string()),
            count.frames.to_string(),
        ]);
    }
    if table.rows.is_empty() { Vec::new() } else { vec![Heading("Frames"), Block::Table(table)] }
}

fn gaps(report: &PassReport) -> Vec<Block> {
    if report.gaps.is_empty() {
        let words =
            "No stretch of this pass was longer without a frame than one and a half heartbeat periods.";
        return vec![Heading("Gaps"), Paragraph(words.to_owned())];
    }
    let mut table = Table::new(&[("From", Left), ("To", Left), ("Lasted", Right), ("", Left)]);
    for gap in &report.gaps {
        let place = match (gap.from_aos, gap.to_los) {
            (true, true) => "the whole pass",
            (true, false) => "from AOS",
            (false, true) => "to LOS",
            (false, false) => "",
        };
        table.row([clock(gap.start), clock(gap.stop), lasting(gap.duration_s), place.to_owned()]);
    }
    vec![Heading("Gaps"), Block::Table(table)]
}

fn run_blocks(reported: &RunReported) -> Vec<Block> {
    let run = &reported.run;
    let mut words =
        format!("{} (run {}): {}", run.name, run.id, run.outcome.as_deref().unwrap_or(run.state.as_str()));
    if let Some(why) = run.why.as_ref().or(run.outcome_why.as_ref()) {
        words += &format!(", {why}");
    }
    let ended = run.steps_ended;
    words += &format!("; {} planned, {ended} ended.", counted(count(reported.steps_planned), "step"));
    if reported.steps_dropped > 0 {
        words += &format!(" The first {} are not listed.", reported.steps_dropped);
    }
    let mut blocks = vec![Paragraph(words)];
    if !reported.steps.is_empty() {
        let columns = [("Step", Left), ("", Left), ("Began", Left), ("Ended", Left), ("Outcome", Left)];
        let mut table = Table::new(&columns);
        for step in &reported.steps {
            let why = step.why.as_ref().map(|why| format!(": {why}")).unwrap_or_default();
            table.row([
                step.step.clone(),
                step.what.clone().unwrap_or_default(),
                clock(step.entered_at),
                clock(step.ended_at),
                format!("{}{why}", step.end),
            ]);
        }
        blocks.push(Block::Table(table));
    }
    blocks
}

fn commands(report: &PassReport) -> Vec<Block> {
    let mut blocks = vec![Heading("Commands")];
    if report.commands.is_empty() {
        blocks.push(Paragraph("None was given, sent or answered in this pass.".to_owned()));
        return blocks;
    }
    blocks.push(Paragraph(format!("{}.", outcomes(&report.commands))));
    let mut table = Table::new(&[
        ("Command", Right),
        ("Name", Left),
        ("By", Left),
        ("Outcome", Left),
        ("At", Left),
        ("Sent", Right),
        ("Answer after", Right),
        ("Why", Left),
    ]);
    for command in &report.commands {
        table.row([
            command.id.to_string(),
            command.command.clone(),
            command.principal.clone(),
            command.stage.clone(),
            clock(command.stage_at),
            command.radiated.to_string(),
            command.answered_after_s.map_or_else(|| "-".to_owned(), |s| format!("{s:.1} s")),
            command.why.clone(),
        ]);
    }
    blocks.push(Block::Table(table));
    if report.commands_left_out > 0 {
        blocks.push(Paragraph(format!("{} more are not listed.", report.commands_left_out)));
    }
    blocks
}

/// `12 answered, 1 unknown`.
fn outcomes(commands: &[CommandReported]) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for command in commands {
        match counts.iter_mut().find(|(stage, _)| *stage == command.stage) {
            Some((_, count)) => *count += 1,
            None => counts.push((&command.stage, 1)),
        }
    }
    counts.sort_by_key(|(stage, count)| (std::cmp::Reverse(*count), *stage));
    counts.iter().map(|(stage, count)| format!("{count} {stage}")).collect::<Vec<_>>().join(", ")
}

fn images(images: &[ImageReported]) -> Table {
    let mut table = Table::new(&[
        ("Image", Right),
        ("Before", Right),
        ("After", Right),
        ("Of", Right),
        ("Whole", Right),
        ("Conflicts", Right),
        ("", Left),
    ]);
    for image in images {
        let part = 100.0 * f64::from(image.held) / f64::from(image.chunks.max(1));
        let state = match (image.is_new, image.held == image.chunks) {
            (_, true) => "complete",
            (true, false) => "declared in this pass",
            (false, false) => "",
        };
        table.row([
            image.image.to_string(),
            image.held_before.to_string(),
            image.held.to_string(),
            image.chunks.to_string(),
            // Only what is whole is 100 %.
            format!("{:.0} %", if image.held < image.chunks { part.min(99.0) } else { part }),
            image.conflicts.to_string(),
            state.to_owned(),
        ]);
    }
    table
}

fn missing(image: &ImageReported) -> Option<String> {
    if image.missing.is_empty() || image.held == 0 {
        return None;
    }
    let runs: Vec<String> = image
        .missing
        .iter()
        .map(|run| match run.count {
            1 => run.first.to_string(),
            count => format!("{} to {}", run.first, run.first + count - 1),
        })
        .collect();
    let more = usize::try_from(image.missing_runs).unwrap_or(usize::MAX).saturating_sub(runs.len());
    let more = if more > 0 { format!(" and {more} stretches more") } else { String::new() };
    Some(format!("Image {} lacks chunks {}{more}.", image.image, runs.join(", ")))
}

pub(super) fn alarms(alarms: &[api::AlarmReported], left_out: u64, when: &str) -> Vec<Block> {
    if alarms.is_empty() {
        return vec![Paragraph(format!("Nothing of level warning or graver happened {when}."))];
    }
    let mut table = Table::new(&[("At", Left), ("Level", Left), ("About", Left), ("", Left)]);
    for alarm in alarms {
        table.rows.push(vec![
            Cell::Text(moment(alarm.at)),
            Cell::Level(alarm.level.clone()),
            Cell::Text(alarm.kind.clone()),
            Cell::Text(alarm.message.clone()),
        ]);
    }
    let mut blocks = vec![Block::Table(table)];
    if left_out > 0 {
        blocks.push(Paragraph(format!("{left_out} more are not listed.")));
    }
    blocks
}

fn count(value: u64) -> usize {
    usize::try_from(value).unwrap_or(usize::MAX)
}

fn spread_words(spread: Spread, unit: &str) -> String {
    format!("{:.0} to {:.0} {unit}, median {:.0}", spread.min, spread.max, spread.median)
}

/// `11 min 04 s`.
pub(super) fn lasting(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    match whole / 60 {
        0 => format!("{whole} s"),
        minutes => format!("{minutes} min {:02} s", whole % 60),
    }
}

pub(super) fn airtime(seconds: f64) -> String {
    format!("{seconds:.1} s")
}

pub(super) fn unknown() -> String {
    "unknown".to_owned()
}

fn none() -> String {
    "none".to_owned()
}

/// `2026-11-22 05:19:25Z`.
pub(super) fn moment(at: Time) -> String {
    let text = at.to_string();
    format!("{} {}Z", text.get(..10).unwrap_or_default(), text.get(11..19).unwrap_or_default())
}

/// `05:19:25Z`.
pub(super) fn clock(at: Time) -> String {
    let text = at.to_string();
    format!("{}Z", text.get(11..19).unwrap_or_default())
}
