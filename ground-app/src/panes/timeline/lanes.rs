//! The rows of the timeline, from what is known.

use api::{AlertView, CommandView, ContactView, PassView, RefusedView, RunView};
use ui::Level;
use ui::format;
use ui::lane::{Item, Kind, Lane};

use crate::model::Model;
use crate::orbit::{span_us, timestamp};

/// Of what the rows were made: they are made anew when one of these rises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Revisions([u64; 6]);

impl Revisions {
    pub(super) fn of(model: &Model) -> Self {
        let live: u64 =
            model.live_commands.values().map(|command| command.stage_at.unix_us() as u64).max().unwrap_or(0);
        Self([
            model.passes.revision(),
            model.schedule.revision(),
            model.runs.revision(),
            model.alerts.revision(),
            model.commands.revision(),
            live,
        ])
    }
}

/// All rows, those to come first.
pub(super) fn all(model: &Model) -> Vec<Lane> {
    let mut lanes = Vec::new();
    let passes = model.passes.value().map_or(&[][..], |list| &list.passes);
    lanes.push(Lane::new("Passes", passes.iter().map(pass).collect()).taking_drops());
    if let Some(schedule) = model.schedule.value() {
        let contacts = schedule.contacts.iter().map(contact);
        let refused = schedule.refused.iter().map(refused);
        lanes.push(Lane::new("Schedule", contacts.chain(refused).collect()));
    }
    let runs = model.runs.value().map_or(&[][..], |page| &page.items);
    lanes.push(Lane::new("Runs", runs.iter().filter(|run| run.state != "planned").map(run).collect()));
    lanes.push(Lane::new("Commands", model.all_commands().map(command).collect()));
    let alerts = model.alerts.value().map_or(&[][..], |page| &page.items);
    lanes.push(Lane::new("Alarms", alerts.iter().map(alert).collect()));
    lanes
}

/// The instant of a pass's greatest elevation, by which its item is named.
pub(super) fn pass_at(id: &str) -> Option<i64> {
    id.rsplit(' ').next()?.parse().ok()
}

fn pass(pass: &PassView) -> Item {
    let (aos_us, los_us) = span_us(pass);
    let up = format::degrees(Some(pass.max_elevation_deg));
    Item {
        id: format!("{} {}", pass.satellite, pass.tca.unix_us()),
        start: timestamp(aos_us),
        end: timestamp(los_us),
        kind: Kind::Pass { quality: (pass.max_elevation_deg / 90.0).clamp(0.0, 1.0) as f32 },
        label: up.to_string(),
        hover: format!(
            "{}: AOS {}, up to {up} at {}, LOS {}",
            pass.satellite,
            format::utc(timestamp(aos_us)),
            format::time(timestamp(pass.tca.unix_us())),
            format::time(timestamp(los_us))
        ),
        conflict: None,
        can_be_dragged: false,
    }
}

fn contact(contact: &ContactView) -> Item {
    let plan = contact.plan.as_deref().unwrap_or("free");
    let armed = if contact.armed { "armed" } else { "not armed" };
    let mut hover = format!("{plan} ({armed}): {}", contact.why);
    for cut in [&contact.cut_start, &contact.cut_stop].into_iter().flatten() {
        hover.push_str(&format!("\n{cut}"));
    }
    Item {
        id: format!("contact {plan} {}", contact.start.unix_us()),
        start: timestamp(contact.start.unix_us()),
        end: timestamp(contact.stop.unix_us()),
        kind: Kind::Plan,
        label: plan.to_owned(),
        hover,
        conflict: None,
        can_be_dragged: false,
    }
}

fn refused(refused: &RefusedView) -> Item {
    let plan = refused.plan.as_deref().unwrap_or("a plan");
    Item {
        id: format!("refused {plan} {}", refused.aos.unix_us()),
        start: timestamp(refused.aos.unix_us()),
        end: timestamp(refused.los.unix_us()),
        kind: Kind::Plan,
        label: plan.to_owned(),
        hover: format!("{plan} does not get this pass"),
        conflict: Some(refused.why.clone()),
        can_be_dragged: false,
    }
}

fn run(run: &RunView) -> Item {
    let outcome = run.outcome.as_deref().unwrap_or(&run.state);
    let why = run.outcome_why.as_deref().or(run.why.as_deref()).unwrap_or("");
    Item {
        id: format!("run {}", run.id),
        start: timestamp(run.aos.unix_us()),
        end: timestamp(run.los.unix_us()),
        kind: Kind::Run,
        label: format!("{} {outcome}", run.name),
        hover: format!("Run {} of {}: {outcome}, {} steps ended. {why}", run.id, run.name, run.steps_ended),
        conflict: None,
        can_be_dragged: false,
    }
}

fn command(command: &CommandView) -> Item {
    Item {
        id: format!("command {}", command.id),
        start: timestamp(command.created_at.unix_us()),
        end: timestamp(command.stage_at.unix_us()),
        kind: Kind::Command,
        label: command.command.clone(),
        hover: format!(
            "{} {}: {}, asked for by {}",
            command.id, command.command, command.stage, command.principal
        ),
        conflict: None,
        can_be_dragged: false,
    }
}

fn alert(alert: &AlertView) -> Item {
    let level = Level::ALL.into_iter().find(|level| level.word() == alert.level).unwrap_or(Level::Watch);
    let start = timestamp(alert.raised_at.unix_us());
    Item {
        id: format!("alarm {}", alert.id),
        start,
        end: timestamp(alert.returned_at.unwrap_or(alert.changed_at).unix_us()),
        kind: Kind::Alarm(level),
        label: alert.message.clone(),
        hover: format!("{}: {}", alert.level, alert.message),
        conflict: None,
        can_be_dragged: false,
    }
}
