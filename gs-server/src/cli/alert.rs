//! `gs-server alert list|acknowledge|shelve|unshelve|assign|targets|test`: asked of the running server.

use api::{
    AlertNote, AlertView, AssignRequest, Nothing, Page, ShelveRequest, StationView, TargetTested, TargetView,
    Time,
};
use clap::{Args, Subcommand};
use mission::Level;

use super::elements::Of;
use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};

/// `gs-server alert`.
#[derive(Debug, Subcommand)]
pub enum Alert {
    /// What is open, or the history
    List(List),
    /// Take note of an alert
    #[command(visible_alias = "ack")]
    Acknowledge(Acknowledge),
    /// Put an alert aside for a while: nobody is told of it
    Shelve(Shelve),
    /// Take an alert off its shelf
    Unshelve(Unshelve),
    /// Give an alert to somebody
    Assign(Assign),
    /// Where messages go, and whether they get there
    Targets(Targets),
    /// Send a test message to a target
    Test(Test),
}

impl Alert {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::List(list) => list.run(),
            Self::Acknowledge(acknowledge) => acknowledge.run(),
            Self::Shelve(shelve) => shelve.run(),
            Self::Unshelve(unshelve) => unshelve.run(),
            Self::Assign(assign) => assign.run(),
            Self::Targets(targets) => targets.run(),
            Self::Test(test) => test.run(),
        }
    }
}

/// `gs-server alert list`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server alert list --config station.toml
  gs-server alert list --config station.toml --all --limit 20
  gs-server alert list --config station.toml --level critical --json | jq .alerts[].message

Newest first. Shape and word tell the level: ○ watch, △ warning, ◇ distress, ⬠ critical, ■ severe.
Exit code 0 whether there are any or not.")]
pub struct List {
    #[command(flatten)]
    of: Of,
    /// History as well
    #[arg(long)]
    all: bool,
    /// Only what was at least this grave
    #[arg(long, value_name = "LEVEL")]
    level: Option<Level>,
    /// At most so many, 1 to 1000
    #[arg(long, value_name = "COUNT", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1000))]
    limit: u32,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Listed {
    alerts: Vec<AlertView>,
}

impl List {
    fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let mut query = vec![("limit", self.limit.to_string())];
        if self.all {
            query.push(("state", "all".to_owned()));
        }
        if let Some(level) = self.level {
            query.push(("level", level.name().to_owned()));
        }
        let page: Page<AlertView> = runtime()?.block_on(remote.get("alerts", &query)).map_err(failure)?;
        if self.json {
            print_json(&Listed { alerts: page.items })?;
            return Ok(Exit::Done);
        }
        if page.items.is_empty() {
            eprintln!("gs-server: no alert is open");
            return Ok(Exit::Done);
        }
        for alert in &page.items {
            print_line(line(alert))?;
        }
        Ok(Exit::Done)
    }
}

/// `   17 △ warning   unacknowledged  2026-12-01T18:22Z  link e22 is unavailable: …`.
fn line(alert: &AlertView) -> String {
    let level = alert.level.parse::<Level>().unwrap_or_default();
    let mut more = Vec::new();
    if alert.times > 1 {
        more.push(format!("{} times", alert.times));
    }
    if let Some(until) = alert.shelved_until {
        more.push(format!("until {}", minute(until)));
    }
    if let Some(assignee) = &alert.assignee {
        more.push(format!("{assignee}'s"));
    }
    if let Some(note) = &alert.note {
        more.push(format!("note: {note}"));
    }
    let more = if more.is_empty() { String::new() } else { format!(" ({})", more.join("; ")) };
    format!(
        "{:>6} {} {:<9} {:<14} {}  {}{more}",
        alert.id,
        shape(level),
        alert.level,
        alert.state,
        minute(alert.raised_at),
        alert.message
    )
}

const fn shape(level: Level) -> &'static str {
    crate::alerts::shape(level)
}

/// An alert, and what there is to say to it.
#[derive(Debug, Args)]
struct Named {
    #[command(flatten)]
    of: Of,
    /// Its number
    #[arg(value_name = "NUMBER")]
    id: u64,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Named {
    fn post(&self, verb: &str, body: &impl serde::Serialize) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let path = format!("alerts/{}/{verb}", self.id);
        let alert: AlertView = runtime()?.block_on(remote.ask_to(&path, body)).map_err(failure)?;
        match self.json {
            true => print_json(&alert)?,
            false => print_line(line(&alert))?,
        }
        Ok(Exit::Done)
    }
}

/// `gs-server alert acknowledge`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server alert acknowledge --config station.toml 17
  gs-server alert ack --config station.toml 17 --note \"antenna is in repair\"

Escalation ends. What is over closes; what still holds closes when it is over. Exit code 3 when the
alert is not open.")]
pub struct Acknowledge {
    #[command(flatten)]
    alert: Named,
    /// What there is to say to it
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
}

impl Acknowledge {
    fn run(self) -> Result<Exit, Failure> {
        self.alert.post("acknowledge", &AlertNote { note: self.note })
    }
}

/// `gs-server alert shelve`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server alert shelve --config station.toml 17 --hours 12
  gs-server alert shelve --config station.toml 17 --until 2026-12-02T06:00:00Z --note \"known\"

At most seven days.")]
pub struct Shelve {
    #[command(flatten)]
    alert: Named,
    #[command(flatten)]
    until: Until,
    /// Why
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
}

/// Until when.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct Until {
    /// An instant, UTC
    #[arg(long, value_name = "TIME")]
    until: Option<Time>,
    /// So many hours from now, by the server's clock
    #[arg(long, value_name = "HOURS", value_parser = clap::value_parser!(u32).range(1..=168))]
    hours: Option<u32>,
}

impl Shelve {
    fn run(self) -> Result<Exit, Failure> {
        let until = match (self.until.until, self.until.hours) {
            (Some(until), _) => until,
            (None, hours) => {
                let remote = server(&self.alert.of.load()?)?;
                let station: StationView =
                    runtime()?.block_on(remote.get("station", &[])).map_err(failure)?;
                Time::from_unix_us(station.at.unix_us() + i64::from(hours.unwrap_or(1)) * 3_600_000_000)
            }
        };
        self.alert.post("shelve", &ShelveRequest { until, note: self.note })
    }
}

/// `gs-server alert unshelve`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server alert unshelve --config station.toml 17")]
pub struct Unshelve {
    #[command(flatten)]
    alert: Named,
}

impl Unshelve {
    fn run(self) -> Result<Exit, Failure> {
        self.alert.post("unshelve", &AlertNote::default())
    }
}

/// `gs-server alert assign`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server alert assign --config station.toml 17 --to ben --note \"look at the connector\"
  gs-server alert assign --config station.toml 17 --nobody")]
pub struct Assign {
    #[command(flatten)]
    alert: Named,
    #[command(flatten)]
    whom: Whom,
    /// What there is to say to it
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
}

/// Whose it is to be.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct Whom {
    /// Whose it is from now on
    #[arg(long, value_name = "NAME")]
    to: Option<String>,
    /// It is nobody's any more
    #[arg(long)]
    nobody: bool,
}

impl Assign {
    fn run(self) -> Result<Exit, Failure> {
        self.alert.post("assign", &AssignRequest { to: self.whom.to, note: self.note })
    }
}

/// `gs-server alert targets`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server alert targets --config station.toml

No secret is shown. Exit code 1 when the last message to one of them did not go through.")]
pub struct Targets {
    #[command(flatten)]
    of: Of,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct TargetsListed {
    targets: Vec<TargetView>,
}

impl Targets {
    fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let page: Page<TargetView> =
            runtime()?.block_on(remote.get("alerts/targets", &[])).map_err(failure)?;
        let exit =
            if page.items.iter().any(|target| target.failing.is_some()) { Exit::Failed } else { Exit::Done };
        if self.json {
            print_json(&TargetsListed { targets: page.items })?;
            return Ok(exit);
        }
        if page.items.is_empty() {
            eprintln!("gs-server: alerts go nowhere; docs/alerts.md tells how to name targets");
        }
        for target in &page.items {
            let state = target.failing.as_deref().unwrap_or("ok");
            print_line(format_args!("{:<20} {}: {state}", target.name, target.leads_to))?;
        }
        Ok(exit)
    }
}

/// `gs-server alert test`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server alert test --config station.toml mail

The server sends one message at once, whatever the hour, and tells what came of it. Exit code 3 when
it did not go through; the reason is printed.")]
pub struct Test {
    #[command(flatten)]
    of: Of,
    /// The target
    #[arg(value_name = "TARGET")]
    target: String,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Test {
    fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        let known = config.alerts.targets.iter().any(|target| target.name == self.target);
        if !known {
            let names: Vec<&str> = config.alerts.targets.iter().map(|target| target.name.as_str()).collect();
            let there_are = if names.is_empty() { "there are none".to_owned() } else { names.join(", ") };
            return Err(Failure::usage(format!(
                "no target '{}' in the configuration: {there_are}",
                self.target
            )));
        }
        let remote = server(&config)?;
        let path = format!("alerts/targets/{}/test", self.target);
        let tested: TargetTested = runtime()?.block_on(remote.ask_to(&path, &Nothing {})).map_err(failure)?;
        match self.json {
            true => print_json(&tested)?,
            false => print_line(format_args!("a test message went to {}", tested.target))?,
        }
        Ok(Exit::Done)
    }
}
