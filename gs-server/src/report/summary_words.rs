//! Handovers and months in words.

use api::{
    AlertView, CommandReported, HandoverReport, MonthOfSatellite, MonthReport, PassBrief, RunView,
    SatelliteView, WordCount,
};

use super::document::Block::{Facts, Heading, List, Paragraph, Plots};
use super::document::Side::{Left, Right};
use super::document::{Block, Cell, Document, Table};
use super::plots::days;
use super::words::{age, airtime, alarms, clock, lasting, moment, unknown};

/// A handover as headings and tables.
#[must_use]
pub fn handover_document(report: &HandoverReport) -> Document {
    let mut blocks = vec![Heading("Now")];
    for satellite in &report.now.satellites {
        blocks.push(Facts(satellite_now(satellite)));
    }
    blocks.push(List(station_now(report)));
    blocks.push(Heading("Open"));
    blocks.extend(open(report));
    blocks.push(Heading("Ahead"));
    blocks.extend(ahead(report));
    blocks.extend([Heading("Passes since then"), briefs(&report.passes)]);
    if !report.runs.is_empty() {
        blocks.extend([Heading("Plans since then"), runs(&report.runs)]);
    }
    blocks.push(Heading("Alarms since then"));
    blocks.extend(alarms(&report.alarms, report.alarms_left_out, "since then"));
    blocks.push(Heading("Who did what"));
    blocks.extend(actions(report));
    Document {
        title: format!("Handover at {}", report.now.station),
        subtitle: format!("What happened since {}, as of {}.", moment(report.since), moment(report.at)),
        simulated: report.now.simulated,
        blocks,
    }
}

fn satellite_now(satellite: &SatelliteView) -> Vec<(&'static str, String)> {
    let at = |time: Option<api::Time>| time.map_or_else(|| "never".to_owned(), moment);
    vec![
        ("Satellite", satellite.satellite.clone()),
        ("Last heard", at(satellite.heard_at)),
        ("Last heartbeat", at(satellite.heartbeat_at)),
        ("Expected", satellite.expectation.clone()),
        ("Uplink", satellite.uplink.clone()),
        ("Commands that wait", satellite.queued.to_string()),
        (
            "Elements",
            satellite.elements.as_ref().map_or_else(unknown, |elements| {
                format!("{}, AOS within {:.1} s", age(elements.age_days), elements.timing_error_s)
            }),
        ),
        (
            "Image",
            satellite.image.as_ref().map_or_else(
                || "none".to_owned(),
                |image| format!("{}: {} of {} chunks", image.image, image.held, image.chunks),
            ),
        ),
    ]
}

fn station_now(report: &HandoverReport) -> Vec<String> {
    let mut lines: Vec<String> = report
        .now
        .links
        .iter()
        .map(|link| {
            let why = link.reason.as_ref().map(|why| format!(" ({why})")).unwrap_or_default();
            let armed = if link.armed { "armed" } else { "not armed" };
            format!("Link {} is {}{why}, {armed}.", link.link, link.state)
        })
        .collect();
    for sealing in &report.now.sealing {
        if let Some(why) = &sealing.locked {
            lines
                .push(format!("Sealing with key {} for {} is locked: {why}", sealing.key, sealing.satellite));
        }
    }
    let storage = &report.now.storage;
    lines.push(match &storage.failing {
        Some(why) => format!("The archive takes nothing: {why}"),
        None => "The archive works.".to_owned(),
    });
    lines
}

fn open(report: &HandoverReport) -> Vec<Block> {
    let mut blocks = Vec::new();
    if !report.alerts.is_empty() {
        blocks.push(alerts(&report.alerts));
    }
    if !report.limits.is_empty() {
        let mut table = Table::new(&[
            ("Limit", Left),
            ("Level", Left),
            ("Satellite", Left),
            ("Value", Right),
            ("Since", Left),
        ]);
        for limit in &report.limits {
            table.rows.push(vec![
                Cell::Text(limit.parameter.clone()),
                Cell::Level(limit.level.clone()),
                Cell::Text(limit.satellite.clone()),
                Cell::Text(limit.value.map_or_else(|| "invalid".to_owned(), |value| value.to_string())),
                Cell::Text(moment(limit.since)),
            ]);
        }
        blocks.push(Block::Table(table));
    }
    for (commands, what) in [
        (&report.unknown, "Unknown: settle these by telemetry before anything is given again."),
        (&report.in_flight, "On their way:"),
    ] {
        if !commands.is_empty() {
            blocks.extend([Paragraph(what.to_owned()), commands_table(commands)]);
        }
    }
    if blocks.is_empty() {
        blocks.push(Paragraph(
            "No alert or limit is open, and no command is on its way or unknown.".to_owned(),
        ));
    }
    blocks
}

fn alerts(open: &[AlertView]) -> Block {
    let columns = [("Alert", Left), ("Level", Left), ("Since", Left), ("What", Left), ("Who knows", Left)];
    let mut table = Table::new(&columns);
    for alert in open {
        let shelved = alert.shelved_until.map(|until| format!("on the shelf until {}", moment(until)));
        let known = alert.acknowledged_by.as_ref().map(|who| format!("known to {who}"));
        let mine = alert.assignee.as_ref().map(|who| format!("{who}'s"));
        let said: Vec<String> = [shelved, known, mine, alert.note.clone()].into_iter().flatten().collect();
        let over = if alert.active { "" } else { " (over)" };
        table.rows.push(vec![
            Cell::Text(alert.id.to_string()),
            Cell::Level(alert.level.clone()),
            Cell::Text(moment(alert.raised_at)),
            Cell::Text(format!("{}{over}", alert.message)),
            Cell::Text(if said.is_empty() { "nobody yet".to_owned() } else { said.join("; ") }),
        ]);
    }
    Block::Table(table)
}

fn commands_table(commands: &[CommandReported]) -> Block {
    let columns =
        [("Command", Right), ("Name", Left), ("By", Left), ("Stage", Left), ("Since", Left), ("Why", Left)];
    let mut table = Table::new(&columns);
    for command in commands {
        table.row([
            command.id.to_string(),
            command.command.clone(),
            command.principal.clone(),
            command.stage.clone(),
            moment(command.stage_at),
            command.why.clone(),
        ]);
    }
    Block::Table(table)
}

fn ahead(report: &HandoverReport) -> Vec<Block> {
    let mut table = Table::new(&[("Pass", Left), ("AOS", Left), ("LOS", Left), ("Highest", Right)]);
    for satellite in &report.now.satellites {
        for pass in &satellite.next_passes {
            table.row([
                satellite.satellite.clone(),
                moment(pass.aos),
                pass.los.map_or_else(|| "does not set".to_owned(), clock),
                format!("{:.0}°", pass.max_elevation_deg),
            ]);
        }
    }
    let mut blocks = Vec::new();
    if table.rows.is_empty() {
        blocks.push(Paragraph("No pass is known: the station has no place, or no elements.".to_owned()));
    } else {
        blocks.push(Block::Table(table));
    }
    if report.ahead.is_empty() {
        blocks.push(Paragraph("No plan has a pass.".to_owned()));
    } else {
        blocks.push(runs(&report.ahead));
    }
    blocks
}

fn runs(runs: &[RunView]) -> Block {
    let mut table =
        Table::new(&[("Plan", Left), ("Satellite", Left), ("From", Left), ("To", Left), ("", Left)]);
    for run in runs {
        let why = run.why.as_ref().or(run.outcome_why.as_ref());
        let why = why.map(|why| format!(": {why}")).unwrap_or_default();
        table.row([
            run.name.clone(),
            run.satellite.clone(),
            moment(run.aos),
            clock(run.los),
            format!("{}{why}", run.outcome.as_deref().unwrap_or(run.state.as_str())),
        ]);
    }
    Block::Table(table)
}

fn briefs(passes: &[PassBrief]) -> Block {
    if passes.is_empty() {
        return Paragraph("There was none.".to_owned());
    }
    let mut table = Table::new(&[
        ("Pass", Right),
        ("Satellite", Left),
        ("AOS", Left),
        ("LOS", Left),
        ("Highest", Right),
        ("Frames", Right),
        ("Chunks", Right),
    ]);
    for pass in passes {
        table.row([
            pass.pass.to_string(),
            pass.satellite.clone(),
            moment(pass.aos),
            pass.los.map_or_else(|| "does not set".to_owned(), clock),
            format!("{:.0}°", pass.max_elevation_deg),
            pass.frames.to_string(),
            pass.chunks.to_string(),
        ]);
    }
    Block::Table(table)
}

fn actions(report: &HandoverReport) -> Vec<Block> {
    if report.actions.is_empty() {
        return vec![Paragraph("Nobody did anything.".to_owned())];
    }
    let mut table = Table::new(&[("At", Left), ("Who", Left), ("What", Left), ("", Left)]);
    for action in &report.actions {
        table.row([moment(action.at), action.who.clone(), action.action.clone(), action.detail.clone()]);
    }
    let mut blocks = vec![Block::Table(table)];
    if report.actions_cut {
        blocks.push(Paragraph("There was more before these.".to_owned()));
    }
    blocks
}

/// A month as headings, tables and plots.
#[must_use]
pub fn month_document(report: &MonthReport) -> Document {
    let mut blocks = Vec::new();
    for satellite in &report.satellites {
        blocks.push(Heading("Satellite"));
        blocks.push(Facts(month_facts(satellite)));
        blocks.push(Plots(days(&satellite.days)));
        blocks.extend(packets(satellite));
    }
    blocks.push(Heading("Incidents"));
    if report.incidents.is_empty() {
        blocks.push(Paragraph("Nothing of level warning or graver happened.".to_owned()));
    } else {
        let mut table = Table::new(&[
            ("Level", Left),
            ("About", Left),
            ("Times", Right),
            ("First", Left),
            ("Last", Left),
            ("The last one", Left),
        ]);
        for incident in &report.incidents {
            table.rows.push(vec![
                Cell::Level(incident.level.clone()),
                Cell::Text(incident.kind.clone()),
                Cell::Text(incident.count.to_string()),
                Cell::Text(moment(incident.first)),
                Cell::Text(moment(incident.last)),
                Cell::Text(incident.message.clone()),
            ]);
        }
        blocks.push(Block::Table(table));
    }
    Document {
        title: format!("{} at {}", report.month, report.station),
        subtitle: if report.is_final {
            "The whole month, by UTC.".to_owned()
        } else {
            format!("The month lasts; as of {}.", moment(report.as_of))
        },
        simulated: report.simulated,
        blocks,
    }
}

fn month_facts(of: &MonthOfSatellite) -> Vec<(&'static str, String)> {
    vec![
        ("Satellite", of.satellite.clone()),
        ("Passes", format!("{}, {} with a frame", of.passes, of.passes_heard)),
        ("In view", lasting(of.in_view_s)),
        ("Frames", format!("{} ({} bytes)", of.frames, of.bytes)),
        ("Airtime down", airtime(of.airtime_down_s)),
        ("Radiated", of.radiated.to_string()),
        ("Airtime up", airtime(of.airtime_up_s)),
        ("Commands", counts(&of.commands)),
        ("Plans", counts(&of.runs)),
        ("Images", format!("{} declared, {} completed", of.images_declared, of.images_completed)),
        ("Chunks", of.chunks.to_string()),
        ("Elements added", of.elements.to_string()),
    ]
}

fn counts(counts: &[WordCount]) -> String {
    if counts.is_empty() {
        return "none".to_owned();
    }
    counts.iter().map(|count| format!("{} {}", count.count, count.word)).collect::<Vec<_>>().join(", ")
}

fn packets(of: &MonthOfSatellite) -> Option<Block> {
    let mut table = Table::new(&[("Packet", Left), ("Type", Right), ("Frames", Right)]);
    for count in &of.packets {
        table.row([
            count.packet_name.clone().unwrap_or_else(unknown),
            count.packet_type.map_or_else(|| "-".to_owned(), |code| code.to_string()),
            count.frames.to_string(),
        ]);
    }
    (!table.rows.is_empty()).then_some(Block::Table(table))
}
