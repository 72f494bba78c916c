//! `gs-server demo`.

use std::io::IsTerminal as _;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};

use super::serve;
use super::shell::{print_json, print_line, runtime, stop_on_signals};
use super::twin::{Mode, Sky, speed};
use super::{Exit, Failure};
use crate::demo::{self, DemoError, DemoOptions, Progress, Stage};
use crate::twin::TwinError;

/// Simulated seconds per second for somebody who watches: a pass of ten minutes takes half a minute.
const WATCHING_SPEED: f64 = 20.0;

/// `gs-server demo`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server demo                                       watch it: open the address it prints
  gs-server demo --loss 0.5 --flips 0.001 --seed 7     harder skies
  gs-server demo --until image --json                  for scripts

Everything is real but the satellite: a pseudo-terminal with a model of the radio module, the serial
link, the store, the page on loopback. Time between passes is skipped. Stop it with Ctrl-C; with the
same --data the same satellite flies on.

With --until image it ends when the image on the ground equals the satellite's, byte for byte, with
exit code 0 only then; 1 if it differs or did not come home in --limit-h simulated hours.")]
pub struct Demo {
    /// Simulated seconds per second at most [default: 20, with --until as fast as possible]
    #[arg(long, value_name = "N", value_parser = speed)]
    speed: Option<f64>,
    #[command(flatten)]
    sky: Sky,
    /// Whether the satellite passes over a northern station in each revolution, or stands in the sky always
    #[arg(long, value_enum, default_value_t = Mode::Passes)]
    mode: Mode,
    /// Port of the page on loopback; 0 takes any
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// Keep database, key and journal here [default: a new folder, removed at the end]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// End by itself
    #[arg(long, value_enum, value_name = "WHAT")]
    until: Option<Until>,
    /// Simulated hours after which --until gives up
    #[arg(long, value_name = "H", default_value_t = 72, value_parser = clap::value_parser!(u64).range(1..=8760))]
    limit_h: u64,
    /// Exactly one JSON object on standard output, at the end
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Until {
    /// The image is home
    Image,
}

impl Demo {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let data = Data::new(self.data.clone())?;
        let until_image = self.until == Some(Until::Image);
        let passes = match self.mode {
            Mode::Always => self.mode.passes(),
            Mode::Passes => demo::passes().map_err(Failure::failed)?,
        };
        let options = DemoOptions {
            data: data.path.clone(),
            speed: self.speed.or((!until_image).then_some(WATCHING_SPEED)),
            seed: self.sky.seed,
            channel: self.sky.channel(passes),
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, self.port)),
            until_image,
            limit_us: self.limit_h * 3_600_000_000,
            operates: true,
        };
        runtime()?.block_on(self.show(options))
    }

    async fn show(&self, options: DemoOptions) -> Result<Exit, Failure> {
        let stop = stop_on_signals()?;
        let until_image = options.until_image;
        let bar = Bar::new();
        let outcome =
            demo::run(options, stop, |stage| self.tell_stage(stage), |progress| bar.show(progress)).await;
        bar.bar.finish_and_clear();
        let summary = outcome.map_err(failure)?;
        if self.json {
            print_json(&summary)?;
        } else if let (true, Some(sha256)) = (summary.equal, &summary.sha256.ground) {
            print_line(format_args!(
                "the image is home: {} chunks in {} requests, {:.0} simulated seconds, {:.1} s of airtime (bound {:.1} s), \
                 sha256 {sha256}",
                summary.chunks.total,
                summary.requests,
                summary.simulated_s,
                summary.airtime.used_s,
                summary.airtime.bound_s,
            ))?;
        }
        match summary.reason {
            Some(reason) if until_image => Err(Failure::failed(reason)),
            _ => Ok(Exit::Done),
        }
    }

    fn tell_stage(&self, stage: &Stage) {
        // With --json standard output is for the one object.
        let text = format!(
            "Page:  {}\nRadio: {} (a pseudo-terminal; the twin is behind it)\nData:  {}",
            stage.url,
            stage.port.display(),
            stage.data.display()
        );
        if self.json || self.until.is_some() {
            eprintln!("{text}");
        } else if let Err(error) = print_line(format_args!("{text}\nCtrl-C ends it.")) {
            tracing::warn!("{error}");
        }
    }
}

fn failure(error: DemoError) -> Failure {
    match error {
        DemoError::Run(error) => serve::failure(error),
        DemoError::Key(_)
        | DemoError::RealKey(_)
        | DemoError::Twin(TwinError::InUse(_) | TwinError::Occupied(_)) => Failure::refused(error),
        _ => Failure::failed(error),
    }
}

/// The folder of a demo; one that nobody named goes with it.
struct Data {
    path: PathBuf,
    is_ours: bool,
}

impl Data {
    fn new(named: Option<PathBuf>) -> Result<Self, Failure> {
        if let Some(path) = named {
            return Ok(Self { path, is_ours: false });
        }
        let mut salt = [0; 4];
        super::shell::fill_random(&mut salt)?;
        let name = format!("gs-demo-{}-{}", std::process::id(), hex::encode(salt));
        Ok(Self { path: std::env::temp_dir().join(name), is_ours: true })
    }
}

impl Drop for Data {
    fn drop(&mut self) {
        if self.is_ours
            && let Err(error) = std::fs::remove_dir_all(&self.path)
        {
            tracing::warn!(%error, "{} could not be removed: {error}", self.path.display());
        }
    }
}

/// On a terminal: one line that moves.
struct Bar {
    bar: ProgressBar,
}

impl Bar {
    fn new() -> Self {
        let bar = if std::io::stderr().is_terminal() { ProgressBar::new(0) } else { ProgressBar::hidden() };
        bar.set_style(style("{prefix} {msg}"));
        Self { bar }
    }

    fn show(&self, progress: &Progress) {
        if self.bar.is_hidden() {
            return;
        }
        let Some(satellite) = progress.status.satellites.first() else { return };
        let seconds = progress.simulated_s as u64;
        let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
        let sky = if progress.in_view { "in view" } else { "below" };
        self.bar.set_prefix(format!("T+{hours:02}:{minutes:02}:{seconds:02} {sky:7}"));
        if let Some(image) = &satellite.image {
            if self.bar.length() == Some(0) {
                self.bar.set_style(style("{prefix} [{bar:30}] {pos}/{len} chunks  {msg}"));
            }
            self.bar.set_length(image.chunks.into());
            self.bar.set_position(image.held.into());
        }
        let frames = progress.status.links.first().map_or(0, |link| link.frames);
        self.bar.set_message(format!("{frames} frames  {}", satellite.uplink));
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ")
}
