//! `gs-server schedule`.

use api::{ContactView, RefusedView, ScheduleView};
use clap::Args;

use super::elements::Of;
use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};

/// `gs-server schedule`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server schedule --config station.toml
  gs-server schedule --config station.toml --json | jq '.refused[] | {satellite, aos, why}'

Passes that plans want: those that the antenna serves, then those that were refused and why, then how
good the whole is against a bound that no schedule exceeds.")]
pub struct Schedule {
    #[command(flatten)]
    of: Of,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Schedule {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let schedule: ScheduleView = runtime()?.block_on(remote.get("schedule", &[])).map_err(failure)?;
        if self.json {
            print_json(&schedule)?;
            return Ok(Exit::Done);
        }
        if schedule.contacts.is_empty() && schedule.refused.is_empty() {
            eprintln!("gs-server: no plan wants a pass of the coming two days; see `gs-server plan list`");
            return Ok(Exit::Done);
        }
        for contact in &schedule.contacts {
            print_line(contact_line(contact))?;
        }
        for refused in &schedule.refused {
            print_line(refused_line(refused))?;
        }
        print_line(summary(&schedule))?;
        Ok(Exit::Done)
    }
}

fn contact_line(contact: &ContactView) -> String {
    let plan = contact.plan.as_deref().unwrap_or("-");
    let mut line = format!(
        "{} to {}  {:<16} {:<20} {:<9} worth {:>6.0}  {}",
        minute(contact.start),
        minute(contact.stop),
        contact.satellite,
        plan,
        if contact.armed { "armed" } else { "not armed" },
        contact.worth,
        contact.why
    );
    if let Some(why) = &contact.cut_start {
        line += &format!("; begins late: {why}");
    }
    if let Some(why) = &contact.cut_stop {
        line += &format!("; ends early: {why}");
    }
    line
}

fn refused_line(refused: &RefusedView) -> String {
    format!(
        "{} to {}  {:<16} {:<20} refused   worth {:>6.0}  {}",
        minute(refused.aos),
        minute(refused.los),
        refused.satellite,
        refused.plan.as_deref().unwrap_or("-"),
        refused.worth,
        refused.why
    )
}

fn summary(schedule: &ScheduleView) -> String {
    let contacts = schedule.contacts.len();
    let worth =
        format!("{contacts} of {} passes, worth {:.0}", contacts + schedule.refused.len(), schedule.worth);
    match schedule.proved {
        true => format!("{worth}: no schedule is worth more"),
        false => format!(
            "{worth}: at most {:.0} is possible, so {:.1} % may be missing",
            schedule.bound,
            schedule.gap * 100.0
        ),
    }
}
