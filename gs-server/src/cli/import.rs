//! `gs-server import`.

mod bulk;

use std::fs::File;
use std::io::{BufRead as _, BufReader, IsTerminal as _};
use std::path::{Path, PathBuf};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use mission::reception::Receiver;
use mission::{Clock as _, SatelliteId, UtcUs};
use serde::Serialize;
use tokio_util::sync::CancellationToken;

use super::serve::failure;
use super::shell::{print_json, print_line, runtime, signals};
use super::{Exit, Failure};
use crate::config::Config;
use crate::elements::{Offline, Remote};
use crate::ingest::formats::{Context, Format};
use crate::ingest::{Aliases, Ears};
use crate::run::RunError;
use crate::storage::StoreError;

use bulk::{Sum, Taker};

/// Bytes by which a format is told.
const HEAD: usize = 64 << 10;

/// `gs-server import`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server import --config station.toml packets.ndjson
  gs-server import --config station.toml --receiver roof --at 2027-03-02T11:30:00Z pass.kiss
  mosquitto_sub -v -t 'tinygs/+/+/tele/rx' > board.log; gs-server import --config station.toml board.log

Reads JSON and NDJSON of TinyGS (boards and API), JSON and exports of SatNOGS DB, our own export, KISS,
lines of hex with or without a time, and raw bytes; told by its looks. Whose a packet is, is decided by
its content. With a server running it goes through its API, else straight into its archive. The same
file again changes nothing, so an import that was broken off is simply begun again.

Exit code 0 if something was read, 1 if nothing in the files is ours, 3 if the server refuses.")]
pub struct Import {
    /// The configuration of the station
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Files to import
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// The satellite; may be left out where there is one
    #[arg(long, value_name = "NAME")]
    satellite: Option<String>,
    /// How the files are written, when it is not to be told by their looks
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Who heard it, where the file does not say
    #[arg(long, value_name = "NAME")]
    receiver: Option<String>,
    /// When it was heard (RFC 3339), where the file does not say
    #[arg(long, value_name = "TIME")]
    at: Option<jiff::Timestamp>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Set by Ctrl-C: ends after what is being stored.
    #[arg(skip)]
    stop: CancellationToken,
}

#[derive(Serialize)]
struct Done {
    /// It was broken off in order; the same command again goes on.
    stopped: bool,
    files: Vec<OfFile>,
    #[serde(flatten)]
    sum: Sum,
}

#[derive(Serialize)]
struct OfFile {
    file: String,
    format: &'static str,
    #[serde(flatten)]
    sum: Sum,
}

impl Import {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let config = Config::load(&self.config).map_err(Failure::usage)?;
        config.check().map_err(Failure::usage)?;
        runtime()?.block_on(async {
            signals(&self.stop, || {})?;
            self.import(&config).await
        })
    }

    async fn import(&self, config: &Config) -> Result<Exit, Failure> {
        let satellite = self.satellite(config)?;
        let mut done = Done { stopped: false, files: Vec::new(), sum: Sum::default() };
        match Offline::open(config).await {
            Ok(offline) => {
                let store = offline.door.store.clone();
                store.make_room().await.map_err(|error| failure(error.into()))?;
                let ears = Ears::new(store, offline.inbox.clone(), offline.timer.clone());
                let context = self.context(config, &satellite, offline.timer.now().utc);
                let taker = Taker::Here(ears, satellite.clone());
                let taken = self.files(&taker, &context, &mut done).await;
                drop(taker);
                offline.close().await.map_err(|error: RunError| failure(error))?;
                taken?;
            }
            Err(RunError::Store(StoreError::Locked { .. })) => {
                let remote = Remote::new(config).map_err(bulk::refused)?;
                let now = crate::clock::SystemClock::new().now().utc;
                let context = self.context(config, &satellite, now);
                self.files(&Taker::There(Box::new(remote), self.request()), &context, &mut done).await?;
            }
            Err(error) => return Err(failure(error)),
        }
        self.tell(&done)
    }

    fn satellite(&self, config: &Config) -> Result<SatelliteId, Failure> {
        let names: Vec<&str> = config.satellites.iter().map(|satellite| satellite.name.as_str()).collect();
        let name = match (&self.satellite, names.as_slice()) {
            (Some(name), names) if names.contains(&name.as_str()) => name,
            (None, [only]) => *only,
            _ => return Err(Failure::usage(format!("--satellite must be one of: {}", names.join(", ")))),
        };
        SatelliteId::new(name).map_err(Failure::usage)
    }

    fn context(&self, config: &Config, satellite: &SatelliteId, now: UtcUs) -> Context {
        let mut context = Context::file(Aliases::of(config).admission(satellite, now));
        let name = self.receiver.clone();
        context.receiver = Receiver { id: name.clone(), name, ..Receiver::default() };
        context.at = self.at.map(|at| UtcUs(at.as_microsecond()));
        context
    }

    fn request(&self) -> api::ImportRequest {
        api::ImportRequest {
            satellite: self.satellite.clone(),
            receiver: self.receiver.clone(),
            at: self.at.map(|at| api::Time::from_unix_us(at.as_microsecond())),
            items: Vec::new(),
        }
    }

    async fn files(&self, taker: &Taker, context: &Context, done: &mut Done) -> Result<(), Failure> {
        for path in &self.files {
            let (format, sum) = self.file(path, taker, context).await?;
            done.sum.add(&sum);
            done.files.push(OfFile { file: path.display().to_string(), format: format.name(), sum });
            if self.stop.is_cancelled() {
                done.stopped = true;
                break;
            }
        }
        Ok(())
    }

    async fn file(&self, path: &Path, taker: &Taker, context: &Context) -> Result<(Format, Sum), Failure> {
        let show = path.display();
        let file =
            File::open(path).map_err(|error| Failure::doing(format!("{show} cannot be opened"), error))?;
        let length = file.metadata().map(|found| found.len()).unwrap_or(0);
        let mut reader = BufReader::with_capacity(HEAD, file);
        let head =
            reader.fill_buf().map_err(|error| Failure::doing(format!("{show} cannot be read"), error))?;
        let Some(format) = self.format.or_else(|| Format::of(head)) else {
            return Err(Failure::failed(format!("{show} is empty")));
        };
        let bar =
            if std::io::stderr().is_terminal() { ProgressBar::new(length) } else { ProgressBar::hidden() };
        let style = ProgressStyle::with_template("{bar:30} {bytes} of {total_bytes}, {eta} left, {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let sum = bulk::import(format, bar.wrap_read(reader), context, taker, (&bar, &self.stop)).await;
        bar.finish_and_clear();
        sum.map(|sum| (format, sum)).map_err(|error| error.of_file(path))
    }

    fn tell(&self, done: &Done) -> Result<Exit, Failure> {
        if self.json {
            print_json(done)?;
        } else {
            for of in &done.files {
                let Sum { frames, merged, without_frame, repeated, refused, .. } = &of.sum;
                print_line(format_args!(
                    "{} ({}): {frames} new frames, {merged} receptions of known ones, {without_frame} without a frame, \
                     {repeated} known already, {refused} refused",
                    of.file, of.format
                ))?;
            }
        }
        for (reason, count) in &done.sum.reasons {
            eprintln!("gs-server: {count} refused: {reason}");
        }
        if done.stopped {
            eprintln!("gs-server: stopped; what was read so far is stored, the same command again goes on");
            return Ok(Exit::Failed);
        }
        let read = done.sum.frames + done.sum.merged + done.sum.without_frame + done.sum.repeated;
        Ok(if read == 0 { Exit::Failed } else { Exit::Done })
    }
}
