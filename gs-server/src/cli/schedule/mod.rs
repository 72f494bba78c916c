//! `gs-server schedule`: a station's own from its server, or one over several stations from files.

mod file;
mod network;

use std::path::PathBuf;

use api::{ContactView, RefusedView, ScheduleView};
use clap::Args;

use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::sky::Moment;
use super::{Exit, Failure};
use crate::config::Config;

/// `gs-server schedule`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server schedule --config station.toml
  gs-server schedule --config station.toml --json | jq '.refused[] | {satellite, aos, why}'
  gs-server schedule --stations stations.toml --elements gp.json --days 7

With --config: passes that plans want over the running station: those that the antenna serves, then those
that were refused and why, then how good the whole is against a bound that no schedule exceeds.
With --stations: the same for many satellites over several stations, from files and without a server; the
file names the stations with their antennas, and the satellites with priority and least pass.

Exit code 1: no server answers, or there is no pass. 2: a file or an argument makes no sense, with its place.")]
pub struct Schedule {
    /// The configuration of the station whose server is asked
    #[arg(long, value_name = "FILE", required_unless_present = "stations", conflicts_with = "stations")]
    config: Option<PathBuf>,
    /// Stations, antennas and satellites, as TOML (docs/plans.md)
    #[arg(long, value_name = "FILE", requires = "elements")]
    stations: Option<PathBuf>,
    /// With --stations: a file of elements, or - for standard input; may be given several times
    #[arg(long, value_name = "FILE", requires = "stations")]
    elements: Vec<PathBuf>,
    /// With --stations: the first instant
    #[arg(long, value_name = "T", default_value = "now", requires = "stations", allow_hyphen_values = true)]
    start: Moment,
    /// With --stations: how many days, 31 at most
    #[arg(long, value_name = "N", default_value_t = 7.0, requires = "stations")]
    days: f64,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Schedule {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let Self { config, stations, elements, start, days, json } = self;
        match (config, stations) {
            (_, Some(stations)) => network::Ask { stations, elements, start, days, json }.answer(),
            (Some(config), None) => of_server(&config, json),
            (None, None) => Err(Failure::usage("give --config FILE, or --stations FILE and --elements FILE")),
        }
    }
}

fn of_server(config: &std::path::Path, json: bool) -> Result<Exit, Failure> {
    let config = Config::load(config).map_err(Failure::usage)?;
    config.check().map_err(Failure::usage)?;
    let remote = server(&config)?;
    let schedule: ScheduleView = runtime()?.block_on(remote.get("schedule", &[])).map_err(failure)?;
    if json {
        print_json(&schedule)?;
        return Ok(Exit::Done);
    }
    if schedule.contacts.is_empty() && schedule.refused.is_empty() {
        eprintln!("gs-server: no plan wants a pass of the coming two days; see `gs-server plan list`");
        return Ok(Exit::Done);
    }
    for contact in &schedule.contacts {
        let word = if contact.armed { "armed" } else { "not armed" };
        print_line(contact_line(contact, contact.plan.as_deref().unwrap_or("-"), word))?;
    }
    for refused in &schedule.refused {
        print_line(refused_line(refused, refused.plan.as_deref().unwrap_or("-")))?;
    }
    let counts = (schedule.contacts.len(), schedule.refused.len());
    print_line(summary(counts, schedule.worth, schedule.bound, schedule.gap, schedule.proved))?;
    Ok(Exit::Done)
}

/// `by`: the plan or the antenna.
fn contact_line(contact: &ContactView, by: &str, word: &str) -> String {
    let mut line = format!(
        "{} to {}  {:<16} {:<20} {:<9} worth {:>6.0}  {}",
        minute(contact.start),
        minute(contact.stop),
        contact.satellite,
        by,
        word,
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

fn refused_line(refused: &RefusedView, by: &str) -> String {
    format!(
        "{} to {}  {:<16} {:<20} refused   worth {:>6.0}  {}",
        minute(refused.aos),
        minute(refused.los),
        refused.satellite,
        by,
        refused.worth,
        refused.why
    )
}

fn summary((contacts, refused): (usize, usize), worth: f64, bound: f64, gap: f64, proved: bool) -> String {
    let told = format!("{contacts} of {} passes, worth {worth:.0}", contacts + refused);
    match proved {
        true => format!("{told}: no schedule is worth more"),
        false => format!("{told}: at most {bound:.0} is possible, so {:.1} % may be missing", gap * 100.0),
    }
}
