//! `gs-server report pass|handover|month`.

use std::fs;
use std::path::PathBuf;

use api::{HandoverReport, MonthReport, Page, PassKept, PassReport, StationView};
use clap::{Args, Subcommand, ValueEnum};
use mission::UtcUs;
use serde::Serialize;
use tle::UtcInstant;

use super::elements::Of;
use super::plans::{failure, server};
use super::shell::{print_json, print_text, runtime};
use super::sky::Moment;
use super::{Exit, Failure};
use crate::config::{Config, station_config};
use crate::elements::Remote;
use crate::http::Identity;
use crate::report::{
    Document, Month, Style, handover_document, html, markdown, month_document, month_report, pass_document,
    pass_report,
};
use crate::run::{RunError, clock_for, load_keys, newest_event, open_store};
use crate::storage::{Scope, Store, StoreError};

/// `gs-server report`.
#[derive(Debug, Subcommand)]
pub enum Report {
    /// What a pass brought: planned and had, gaps, commands, signal, images, alarms, next steps
    #[command(after_help = "\
Examples:
  gs-server report pass --config station.toml
  gs-server report pass 17 --config station.toml --form html --output pass-17.html
  gs-server report pass 17 --config station.toml --json | jq '.had.frames'

Without a number the newest pass. The server is asked where one runs, else its archive is opened. A pass
that is over is told the same for ever. Exit code 1 when there is no such pass.")]
    Pass(Pass),
    /// What the next shift must know: the station now, and what happened since the last one began
    #[command(after_help = "\
Examples:
  gs-server report handover --config station.toml
  gs-server report handover --config station.toml --since -12h --form html --output handover.html
  gs-server report handover --config station.toml --json | jq '.unknown'

Asked of the server that runs. A distance counts from the station's time.")]
    Handover(Handover),
    /// What a month came to: passes, frames, airtime, commands by outcome, images, elements, incidents
    #[command(after_help = "\
Examples:
  gs-server report month --config station.toml
  gs-server report month 2026-10 --config station.toml --form html --output october.html
  gs-server report month 2026-10 --config station.toml --json | jq '.satellites[].airtime_up_s'

Without a month the one that lasts. Days and months are those of UTC.")]
    Month(MonthOf),
}

/// In which form, and where to.
#[derive(Debug, Args)]
struct Out {
    /// The form of the report
    #[arg(long, value_enum, default_value_t = Form::Markdown, conflicts_with = "json")]
    form: Form,
    /// Write it into this file
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long, conflicts_with = "output")]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Text with tables
    Markdown,
    /// A page of its own, with plots
    Html,
}

/// `gs-server report pass`.
#[derive(Debug, Args)]
pub struct Pass {
    #[command(flatten)]
    of: Of,
    /// The pass, as `/passes/history` numbers it
    #[arg(value_name = "ID")]
    id: Option<u64>,
    #[command(flatten)]
    out: Out,
}

/// `gs-server report handover`.
#[derive(Debug, Args)]
pub struct Handover {
    #[command(flatten)]
    of: Of,
    /// Since when, UTC: 2026-11-22T06:00:00Z, or a distance such as -8h
    #[arg(long, value_name = "T", default_value = "-8h", allow_hyphen_values = true)]
    since: Moment,
    #[command(flatten)]
    out: Out,
}

/// `gs-server report month`.
#[derive(Debug, Args)]
pub struct MonthOf {
    #[command(flatten)]
    of: Of,
    /// The month, such as 2026-11
    #[arg(value_name = "YYYY-MM")]
    month: Option<Month>,
    #[command(flatten)]
    out: Out,
}

impl Report {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::Pass(pass) => runtime()?.block_on(pass.run()),
            Self::Handover(handover) => runtime()?.block_on(handover.run()),
            Self::Month(month) => runtime()?.block_on(month.run()),
        }
    }
}

impl Pass {
    async fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        let none = || Failure::failed("the station has seen no pass yet");
        let report = match Station::of(&config).await? {
            Station::Running(remote) => {
                let id = match self.id {
                    Some(id) => id,
                    None => {
                        let query = [("limit", "1".to_owned())];
                        let page: Page<PassKept> =
                            remote.get("passes/history", &query).await.map_err(failure)?;
                        page.items.first().ok_or_else(none)?.id
                    }
                };
                remote.get(&format!("reports/passes/{id}"), &[]).await.map_err(failure)?
            }
            Station::Stopped(stopped) => {
                let id = match self.id {
                    Some(id) => i64::try_from(id).unwrap_or(i64::MAX),
                    None => stopped.newest_pass().await?.ok_or_else(none)?,
                };
                let found = pass_report(&stopped.store, &stopped.identity, id, stopped.now).await;
                let report: Option<PassReport> = found.map_err(Failure::failed)?;
                stopped.store.close().await.map_err(Failure::failed)?;
                report.ok_or_else(|| Failure::failed(format!("there is no pass {id}")))?
            }
        };
        tell(&self.out, &report, pass_document)
    }
}

impl Handover {
    async fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let station: StationView = remote.get("station", &[]).await.map_err(failure)?;
        let now = UtcInstant::from_unix_us(station.at.unix_us());
        let since = api::Time::from_unix_us(self.since.resolve(now, now).unix_us());
        let query = [("since", since.to_string())];
        let report: HandoverReport = remote.get("reports/handover", &query).await.map_err(failure)?;
        tell(&self.out, &report, handover_document)
    }
}

impl MonthOf {
    async fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        let report = match Station::of(&config).await? {
            Station::Running(remote) => {
                let month = match self.month {
                    Some(month) => month,
                    None => {
                        let station: StationView = remote.get("station", &[]).await.map_err(failure)?;
                        Month::of(UtcUs(station.at.unix_us()))
                    }
                };
                remote.get(&format!("reports/months/{month}"), &[]).await.map_err(failure)?
            }
            Station::Stopped(stopped) => {
                let month = self.month.unwrap_or_else(|| Month::of(stopped.now));
                let found = month_report(&stopped.store, &stopped.identity, month, stopped.now).await;
                let report: MonthReport = found.map_err(Failure::failed)?;
                stopped.store.close().await.map_err(Failure::failed)?;
                report
            }
        };
        tell(&self.out, &report, month_document)
    }
}

/// The station: its server where one runs, else its archive.
enum Station {
    Running(Remote),
    Stopped(Box<Stopped>),
}

struct Stopped {
    store: Store,
    identity: Identity,
    now: UtcUs,
}

impl Station {
    async fn of(config: &Config) -> Result<Self, Failure> {
        let station = load_keys(config).and_then(|keys| Ok(station_config(config, &keys)?));
        let station = station.map_err(Failure::usage)?;
        let store = match open_store(config, &station.station, None).await {
            Ok(store) => store,
            Err(RunError::Store(StoreError::Locked { .. })) => return Ok(Self::Running(server(config)?)),
            Err(error) => return Err(Failure::failed(error)),
        };
        let newest = newest_event(&store).await.map_err(Failure::failed)?;
        let now = clock_for(config, newest).now().utc;
        let identity = Identity::of(&station, config.is_simulated());
        Ok(Self::Stopped(Box::new(Stopped { store, identity, now })))
    }
}

impl Stopped {
    async fn newest_pass(&self) -> Result<Option<i64>, Failure> {
        let page = crate::storage::Page { limit: 1, ..Default::default() };
        let passes = self.store.passes(&Scope::default(), &page).await.map_err(Failure::failed)?;
        Ok(passes.first().map(|pass| pass.id))
    }
}

fn tell<T: Serialize>(out: &Out, report: &T, document: fn(&T) -> Document) -> Result<Exit, Failure> {
    if out.json {
        print_json(report)?;
        return Ok(Exit::Done);
    }
    let document = document(report);
    let text = match out.form {
        Form::Markdown => markdown(&document),
        Form::Html => html(&document, Style::Embedded),
    };
    match &out.output {
        None => print_text(&text)?,
        Some(file) => fs::write(file, text)
            .map_err(|error| Failure::doing(format!("{} cannot be written", file.display()), error))?,
    }
    Ok(Exit::Done)
}
