//! `gs-server export`.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use clap::{ArgGroup, Args, ValueEnum};
use mission::StationId;
use mission::reception::{Content, Ear, Reception};

use super::serve::failure;
use super::shell::{quiet_pipe, runtime};
use super::{Exit, Failure};
use crate::config::Config;
use crate::elements::offline::archive;
use crate::ingest::formats::{CSV_HEAD, csv, export};
use crate::run::{RunError, postgres};
use crate::storage::{Archive, During, Export as Reading, OutsideQuery, StoreError};

/// `gs-server export`.
#[derive(Debug, Args)]
#[command(
    group = ArgGroup::new("what").required(true).multiple(true),
    after_help = "\
Examples:
  gs-server export --config station.toml --receptions > heard-elsewhere.ndjson
  gs-server export --config station.toml --receptions --own --format csv --output all.csv
  gs-server export --config station.toml --own --start 2027-03-01T00:00:00Z | gs-server import --config other.toml /dev/stdin

A line a reception, oldest first, with all that is known of it and its bytes in hex; `gs-server import` takes the NDJSON
back. It reads beside a server that runs, and holds a page in memory at a time, however large the archive is.

Exit code 0 if anything was written, 1 if there is nothing."
)]
pub struct Export {
    /// The configuration of the station
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// What others reported
    #[arg(long, group = "what")]
    receptions: bool,
    /// What our own stations heard
    #[arg(long, group = "what")]
    own: bool,
    /// How it is written
    #[arg(long, value_enum, default_value = "ndjson")]
    format: Form,
    /// Only this satellite
    #[arg(long, value_name = "NAME")]
    satellite: Option<String>,
    /// Only reports through this ear (own-mqtt, tinygs-api, satnogs, console, file)
    #[arg(long, value_name = "EAR", conflicts_with = "own", value_parser = ear)]
    source: Option<String>,
    /// Received at or after this time (RFC 3339)
    #[arg(long, value_name = "TIME")]
    start: Option<jiff::Timestamp>,
    /// Received before this time (RFC 3339)
    #[arg(long, value_name = "TIME")]
    stop: Option<jiff::Timestamp>,
    /// Where to; a file that exists is not replaced [default: standard output]
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// How a reception is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// An object of JSON a line
    Ndjson,
    /// A table with the names of its columns
    Csv,
}

fn ear(name: &str) -> Result<String, String> {
    let names = Ear::ALL.map(Ear::name).join(", ");
    Ear::from_name(name).map(|ear| ear.name().to_owned()).ok_or_else(|| format!("must be one of {names}"))
}

/// Where the lines go, and how many.
struct Lines {
    out: Box<dyn Write>,
    form: Form,
    written: u64,
    without_bytes: u64,
}

impl Lines {
    fn put(&mut self, reception: &Reception) -> io::Result<()> {
        if matches!(&reception.content, Content::Damaged { delivered, .. } if delivered.is_empty()) {
            self.without_bytes += 1;
        }
        let line = match self.form {
            Form::Ndjson => export(reception),
            Form::Csv => csv(reception),
        };
        self.written += 1;
        writeln!(self.out, "{line}")
    }
}

impl Export {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let config = Config::load(&self.config).map_err(Failure::usage)?;
        config.check().map_err(Failure::usage)?;
        let out: Box<dyn Write> = match &self.output {
            None => Box::new(BufWriter::new(io::stdout())),
            Some(path) => {
                let file = File::create_new(path)
                    .map_err(|error| Failure::doing(format!("{} cannot be made", path.display()), error))?;
                Box::new(BufWriter::new(file))
            }
        };
        let mut lines = Lines { out, form: self.format, written: 0, without_bytes: 0 };
        runtime()?.block_on(self.export(&config, &mut lines))?;
        if lines.without_bytes > 0 {
            eprintln!("gs-server: {} damaged packets have no bytes of their own", lines.without_bytes);
        }
        Ok(if lines.written == 0 { Exit::Failed } else { Exit::Done })
    }

    async fn export(&self, config: &Config, lines: &mut Lines) -> Result<(), Failure> {
        let station = StationId::new(&config.station.name).map_err(Failure::usage)?;
        match archive(config, &station).await {
            Ok(store) => {
                let written = self.read(&Reading::of(&store), lines).await;
                store.close().await.map_err(|error| failure(error.into()))?;
                written
            }
            Err(RunError::Store(StoreError::Locked { .. })) => {
                let archive = Archive {
                    folder: config.storage.folder.clone(),
                    postgres: postgres(config).map_err(failure)?,
                };
                let reading = Reading::beside(&archive).await;
                self.read(&reading.map_err(|error| failure(error.into()))?, lines).await
            }
            Err(error) => Err(failure(error)),
        }
    }

    async fn read(&self, reading: &Reading, lines: &mut Lines) -> Result<(), Failure> {
        let during = During {
            start_us: self.start.map(jiff::Timestamp::as_microsecond),
            stop_us: self.stop.map(jiff::Timestamp::as_microsecond),
        };
        let query = OutsideQuery {
            satellite: self.satellite.clone(),
            source: self.source.clone(),
            during,
            ..OutsideQuery::default()
        };
        let wrong = |error: StoreError| failure(error.into());
        let full = |error| Failure::doing("the export cannot be written", error);
        let ended = |result: io::Result<()>| match result {
            // Whoever reads us has seen enough.
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(true),
            result => result.map(|()| false).map_err(full),
        };
        if self.format == Form::Csv && ended(writeln!(lines.out, "{CSV_HEAD}"))? {
            return Ok(());
        }
        for own in [false, true].into_iter().filter(|own| if *own { self.own } else { self.receptions }) {
            let mut last = 0;
            loop {
                let page = if own {
                    reading.own(self.satellite.as_deref(), &during, last).await.map_err(wrong)?
                } else {
                    reading.reports(&query, last).await.map_err(wrong)?
                };
                let Some((id, _)) = page.last() else { break };
                last = *id;
                for (_, reception) in &page {
                    if ended(lines.put(reception))? {
                        return Ok(());
                    }
                }
            }
        }
        lines.out.flush().or_else(quiet_pipe).map_err(full)
    }
}
