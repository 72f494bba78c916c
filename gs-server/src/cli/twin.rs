//! `gs-server twin serve`.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use clap::{Args, Subcommand, ValueEnum};
use mission::{Clock as _, UtcUs};
use protocol::Key;
use radio::model::ModelConfig;
use satellite::{
    ChannelConfig, Device, DeviceConfig, Fault, ImageSource, PassProfile, ReplayPolicy, TwinConfig,
};
use serde::Serialize;
use tle::UtcInstant;
use tokio::net::TcpListener;
use tokio::sync::mpsc;

use super::shell::{fill_random, print_json, print_line, runtime, stop_on_signals};
use super::{Exit, Failure};
use crate::clock::{ScaledClock, Timer};
use crate::keys;
use crate::sky::Place;
use crate::twin::{End, JournalFile, OrbitError, Player, Pty, Replayed, TcpEnd, TwinError, orbit_from};

/// `gs-server twin`.
#[derive(Debug, Subcommand)]
pub enum Twin {
    /// Play the satellite, its channel and the ground's radio module behind a port
    #[command(after_help = "\
Examples:
  gs-server twin serve --pty /tmp/radio --journal twin.journal
  gs-server twin serve --tcp 127.0.0.1:5010 --journal twin.journal --loss 0.2 --seed 7
  gs-server twin serve --pty /tmp/radio --journal twin.journal --speed 20 --mode passes
  gs-server twin serve --pty /tmp/radio --journal twin.journal --elements cubesats.json --satellite 25544 \
      --station 46.5191,6.5668,410

Ground opens the port as if the radio module hung on it: 9600 baud, mode_pins = \"software\" or
\"strapped\", aux = \"absent\". The journal is the satellite's memory, its counters included, and the
record of every frame that went up or came down; start again with the same journal, and the same
satellite flies on. When ready, one line goes to standard output.")]
    Serve(Box<Serve>),
}

/// `gs-server twin serve`.
#[derive(Debug, Args)]
#[group(id = "end", required = true, multiple = false, args = ["pty", "tcp"])]
pub struct Serve {
    /// Make a pseudo-terminal, and this symbolic link to it
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// Listen for a TCP connection, one at a time; port 0 takes any
    #[arg(long, value_name = "ADDR")]
    tcp: Option<std::net::SocketAddr>,
    /// The satellite's memory and record, made if need be
    #[arg(long, value_name = "FILE")]
    journal: PathBuf,
    /// The uplink key, simulated [default: JOURNAL.key, made if need be]
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Simulated seconds per second
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Whether the satellite stands in the sky always, or passes every 95 minutes
    #[arg(long, value_enum, default_value_t = Mode::Always)]
    mode: Mode,
    /// Fly these elements (OMM or TLE), and be in view when they say so
    #[arg(long, value_name = "FILE", requires = "station", conflicts_with = "mode")]
    elements: Option<PathBuf>,
    /// The place that sees the satellite: degrees north, degrees east, metres above the ellipsoid
    #[arg(long, value_name = "LAT,LON,HEIGHT_M", requires = "elements", allow_hyphen_values = true)]
    station: Option<Place>,
    /// Which satellite of FILE, by name, catalogue number or designator
    #[arg(long = "satellite", value_name = "NAME", requires = "elements")]
    object: Option<String>,
    /// One JSON object when ready, one at the end
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    sky: Sky,
    #[command(flatten)]
    satellite: Satellite,
}

/// What the channel does; the same for `demo`.
#[derive(Debug, Clone, Args)]
pub(super) struct Sky {
    /// Orbit, picture, noise and losses follow from this
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// Chance that a frame is lost, either way
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = chance)]
    pub loss: f64,
    /// Chance per byte that one of its bits is flipped
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = chance)]
    pub flips: f64,
}

/// What the satellite is.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "The satellite")]
pub(super) struct Satellite {
    /// What it does about counters it has seen
    #[arg(long, value_enum, default_value_t = Replay::Icd)]
    replay: Replay,
    /// The image it holds at first: camera, none, or a file
    #[arg(long, value_name = "IMAGE", default_value = "camera")]
    image: PathBuf,
    /// It does not know GetImageRanges
    #[arg(long)]
    no_ranges: bool,
    /// Seconds between heartbeats
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    heartbeat_s: u64,
    /// The module appends no RSSI byte
    #[arg(long)]
    no_rssi: bool,
    /// Something goes wrong after this many simulated seconds, e.g. 30:reset, 30:mute, 90:unmute, 60:nan, 60:no-clock,
    /// 60:duplicates, 60:low-battery
    #[arg(long = "fault", value_name = "S:FAULT", hide = true)]
    faults: Vec<TimedFault>,
}

/// When the satellite is in view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// It stands still in the sky.
    Always,
    /// It passes for 8 to 10 minutes every 95.
    Passes,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Replay {
    /// Everything authentic is obeyed, recordings too
    None,
    /// Only counters above the highest
    Greater,
    /// The ICD's rule
    Icd,
    /// Counters at most 10 above the highest; ground must count by one
    Window10,
}

#[derive(Debug, Clone, Copy)]
struct TimedFault(u64, Fault);

impl FromStr for TimedFault {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (seconds, name) = text.split_once(':').ok_or("write SECONDS:FAULT")?;
        let seconds: f64 = seconds.parse().map_err(|_| "the seconds are no number")?;
        let fault = match name {
            "reset" => Fault::Reset,
            "mute" => Fault::Mute(true),
            "unmute" => Fault::Mute(false),
            "nan" => Fault::SensorNan(true),
            "no-nan" => Fault::SensorNan(false),
            "no-clock" => Fault::ClockUnset,
            "duplicates" => Fault::DuplicateAnswers(true),
            "low-battery" => Fault::LowBattery(true),
            "full-battery" => Fault::LowBattery(false),
            _ => return Err(format!("'{name}' is no fault")),
        };
        Ok(Self((seconds.max(0.0) * 1e6) as u64, fault))
    }
}

/// A probability.
pub(super) fn chance(text: &str) -> Result<f64, String> {
    let chance: f64 = text.parse().map_err(|_| "not a number")?;
    if (0.0..=1.0).contains(&chance) { Ok(chance) } else { Err("a chance is 0 to 1".into()) }
}

/// A factor on time.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| "not a number")?;
    if (0.01..=1_000_000.0).contains(&speed) { Ok(speed) } else { Err("0.01 to 1000000".into()) }
}

impl Mode {
    pub(super) fn passes(self) -> PassProfile {
        match self {
            Self::Always => PassProfile::Always { elevation_deg: 60.0 },
            Self::Passes => PassProfile::default(),
        }
    }
}

impl Sky {
    /// The channel under this sky.
    pub(super) fn channel(&self, passes: PassProfile) -> ChannelConfig {
        ChannelConfig {
            seed: self.seed,
            loss: self.loss,
            flips: self.flips,
            elevation_loss: !matches!(passes, PassProfile::Always { .. }),
            passes,
            ..ChannelConfig::default()
        }
    }
}

impl Satellite {
    fn config(&self, seed: u64, key: Key) -> Result<TwinConfig, Failure> {
        let image = match self.image.to_str() {
            Some("camera") => ImageSource::Camera,
            Some("none") => ImageSource::None,
            _ => {
                let bytes = std::fs::read(&self.image).map_err(|e| {
                    Failure::doing(format!("image {} cannot be read", self.image.display()), e)
                })?;
                ImageSource::Bytes { bytes: bytes.into(), width_px: 408, height_px: 304 }
            }
        };
        Ok(TwinConfig {
            heartbeat_period_us: self.heartbeat_s * 1_000_000,
            ranges: !self.no_ranges,
            replay: match self.replay {
                Replay::None => ReplayPolicy::None,
                Replay::Greater => ReplayPolicy::StrictlyGreater,
                Replay::Icd => ReplayPolicy::Icd,
                Replay::Window10 => ReplayPolicy::ForwardWindow10,
            },
            image,
            ..TwinConfig::new(seed, key)
        })
    }
}

#[derive(Serialize)]
struct ReadyLine<'a> {
    ready: bool,
    link: Option<&'a Path>,
    device: Option<&'a Path>,
    address: Option<String>,
    key: String,
    key_file: &'a Path,
    journal: &'a Path,
    boots: u32,
    counter: Option<u64>,
}

#[derive(Serialize)]
struct EndLine {
    ready: bool,
    frames_sent: u64,
    requests_accepted: u64,
    requests_refused: u64,
    packets_heard_from_ground: u64,
    unheard_bytes: u64,
}

impl Twin {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let Self::Serve(serve) = self;
        runtime()?.block_on(serve.run())
    }
}

impl Serve {
    async fn run(&self) -> Result<Exit, Failure> {
        let stop = stop_on_signals()?;
        let key_file = self.key.clone().unwrap_or_else(|| beside(&self.journal, ".key"));
        let key = simulated_key(&key_file, self.key.is_none())?;
        let (journal, replayed) = JournalFile::open(&self.journal).map_err(refusal)?;
        let (timer, start_us, zero_us) = begin(&replayed, self.speed);

        let mut twin = self.satellite.config(self.sky.seed, key.key.clone())?;
        let passes = match (&self.elements, &self.station) {
            (Some(file), Some(place)) => {
                let at = UtcInstant::from_unix_us(UtcUs(zero_us).plus(start_us.cast_signed()).0);
                let orbit = orbit_from(file, self.object.as_deref(), at).map_err(orbit_failure)?;
                twin.orbit = Some(orbit);
                PassProfile::seen_from(place.station.clone())
            }
            _ => self.mode.passes(),
        };
        twin.start_us = start_us;
        twin.utc_at_zero_ms = (zero_us / 1000).cast_unsigned();
        twin.faults = self.satellite.faults.iter().map(|fault| (start_us + fault.0, fault.1)).collect();
        let model = ModelConfig::prepared(!self.satellite.no_rssi);
        let (boots, counter) = (replayed.state.boots, replayed.state.nonces.highest());
        let device = Device::new(DeviceConfig {
            state: replayed.state,
            ..DeviceConfig::new(twin, self.sky.channel(passes), model)
        });

        let end = self.end().await?;
        let mut line = ReadyLine {
            ready: true,
            link: None,
            device: None,
            address: None,
            key: key.id().to_string(),
            key_file: &key_file,
            journal: &self.journal,
            boots,
            counter: counter.map(|counter| counter.0),
        };
        let address = match &end {
            End::Pty(pty) => {
                (line.link, line.device) = (Some(pty.link()), Some(pty.device()));
                format!("{} -> {}", pty.link().display(), pty.device().display())
            }
            End::Tcp(tcp) => {
                let address = tcp.address().map_err(Failure::failed)?.to_string();
                line.address = Some(address.clone());
                address
            }
        };
        if self.json {
            print_json(&line)?;
        } else {
            let key = &line.key;
            print_line(format_args!("twin ready on {address}, key {key} in {}", key_file.display()))?;
        }

        let (_asks, inbox) = mpsc::channel(1);
        let awake = timer.busy("twin");
        let player = Player::new(device, Some(journal), timer, start_us, None);
        let view = player.run(end, inbox, stop, awake).await.map_err(Failure::failed)?;
        if self.json {
            print_json(&EndLine {
                ready: false,
                frames_sent: view.stats.twin.frames,
                requests_accepted: view.stats.twin.accepted,
                requests_refused: view.stats.twin.refused.total(),
                packets_heard_from_ground: view.stats.ground_packets,
                unheard_bytes: view.unheard_bytes,
            })?;
        }
        Ok(Exit::Done)
    }

    async fn end(&self) -> Result<End, Failure> {
        if let Some(link) = &self.pty {
            return Pty::open(link).map(End::Pty).map_err(refusal);
        }
        let address = self.tcp.unwrap_or_else(|| std::net::SocketAddr::from(([127, 0, 0, 1], 0)));
        let listener = TcpListener::bind(address)
            .await
            .map_err(|error| Failure::doing(format!("{address} cannot be listened on"), error))?;
        Ok(End::Tcp(TcpEnd::new(listener)))
    }
}

/// Clock, the device's time now, and true time (µs since 1970) when that was 0. A satellite that flies on never goes
/// back in time, whatever this machine's clock and the speeds were.
fn begin(replayed: &Replayed, speed: f64) -> (Arc<dyn Timer>, u64, i64) {
    let clock = ScaledClock::new(speed);
    let utc_us = clock.now().utc.0;
    match replayed.utc_at_zero_us {
        None => (Arc::new(clock), 0, utc_us),
        Some(zero_us) => {
            let elapsed_us = u64::try_from(utc_us - zero_us).unwrap_or(0);
            let start_us = elapsed_us.max(replayed.last_us + 1_000_000);
            let utc = UtcUs(zero_us).plus(start_us.cast_signed());
            (Arc::new(ScaledClock::starting_at(speed, utc)), start_us, zero_us)
        }
    }
}

fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    path.with_file_name(name)
}

/// The key of a twin: made when it is missing and may be made. A real key is none of a twin's business.
pub(super) fn simulated_key(path: &Path, may_make: bool) -> Result<keys::KeyFile, Failure> {
    if may_make && !path.exists() {
        let mut bytes = zeroize::Zeroizing::new([0; 16]);
        fill_random(bytes.as_mut_slice())?;
        keys::create(path, &mut bytes, true).map_err(Failure::failed)?;
    }
    let key = keys::load(path).map_err(Failure::refused)?;
    if !key.simulated {
        return Err(Failure::refused(format!(
            "key file {} is a real key: a twin takes only keys made with `gs-server key new --simulated`",
            path.display()
        )));
    }
    Ok(key)
}

fn orbit_failure(error: OrbitError) -> Failure {
    match error {
        OrbitError::Choose { .. } | OrbitError::Absent { .. } => Failure::usage(error),
        _ => Failure::failed(error),
    }
}

fn refusal(error: TwinError) -> Failure {
    match error {
        TwinError::InUse(_) | TwinError::Occupied(_) => Failure::refused(error),
        _ => Failure::failed(error),
    }
}
