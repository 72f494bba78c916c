//! `gs-server rotator probe|point|park|stop`: the rotator by hand, through rotctld.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::{Args, Subcommand};
use mission::MonoUs;
use mission::pointing::{Mount, Pointer, Position};
use serde::Serialize;

use super::shell::{print_json, print_line, runtime, stop_on_signals};
use super::{Exit, Failure};
use crate::clock::{SystemClock, Timer};
use crate::config::{Config, RotatorSection};
use crate::hamlib::{HamlibError, Patience, RotatorClient};

/// `gs-server rotator`.
#[derive(Debug, Subcommand)]
pub enum Rotator {
    /// Who the rotator is, its limits, and where it stands; moves nothing
    #[command(after_help = "\
Examples:
  rotctld -m 603 -r /dev/ttyUSB1 &               a Yaesu GS-232B; -m 1 is a dummy
  gs-server rotator probe
  gs-server rotator probe --address antenna.local:4533 --json

Exit code 0 if it answered, 1 if not. docs/antenna.md has the models and the remedies.")]
    Probe(Target),
    /// Turn it, and wait until it is there
    #[command(after_help = "\
Examples:
  gs-server rotator point 180,45
  gs-server rotator point -- -90,10              a negative azimuth
  gs-server rotator point 400,10 --wait 0        do not wait

Ctrl-C stops the rotator. Exit code 0 if it arrived, 3 if the position is outside the limits of the
configuration or of the rotator, 1 if it does not answer, refuses or does not move.")]
    Point(Point),
    /// Send it to where it rests: the configured place, or its own
    Park(Target),
    /// Stop it where it is
    Stop(Target),
}

/// Which rotator.
#[derive(Debug, Args)]
pub struct Target {
    /// Host and port of rotctld [default: that of the configuration, or 127.0.0.1:4533]
    #[arg(long, value_name = "HOST:PORT")]
    address: Option<String>,
    /// A configuration with a section [rotator], for its address, limits and place to rest
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// `gs-server rotator point`.
#[derive(Debug, Args)]
pub struct Point {
    /// Azimuth and elevation, degrees
    #[arg(value_name = "AZ,EL", value_parser = position, allow_hyphen_values = true)]
    position: Position,
    /// How long to wait until it is there, s; 0 does not wait
    #[arg(long, value_name = "S", default_value_t = 180)]
    wait: u64,
    #[command(flatten)]
    target: Target,
}

/// What is printed.
#[derive(Serialize)]
struct Told<'a> {
    address: &'a str,
    info: Option<&'a str>,
    limits: Option<Limits>,
    azimuth_deg: Option<f64>,
    elevation_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    outcome: Option<&'a str>,
}

#[derive(Serialize)]
struct Limits {
    azimuth_deg: (f64, f64),
    elevation_deg: (f64, f64),
}

fn position(text: &str) -> Result<Position, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|angle| angle.is_finite());
    text.split_once(',')
        .and_then(|(azimuth, elevation)| {
            Some(Position { azimuth_deg: number(azimuth)?, elevation_deg: number(elevation)? })
        })
        .ok_or_else(|| {
            "give azimuth and elevation in degrees with a comma between, as in 180,45.5".to_owned()
        })
}

struct Open {
    section: RotatorSection,
    /// Present when a configuration told what the mount can do.
    mount: Option<Mount>,
    client: RotatorClient,
    timer: Arc<dyn Timer>,
    json: bool,
}

impl Target {
    async fn open(self) -> Result<Open, Failure> {
        let mut section = RotatorSection::default();
        let mut mount = None;
        if let Some(path) = &self.config {
            let config = Config::load(path).map_err(Failure::usage)?;
            config.check().map_err(Failure::usage)?;
            let Some(found) = config.rotator else {
                let what = format!("configuration {} has no section [rotator]", path.display());
                return Err(Failure::usage(format!("{what}: add one, or give --address")));
            };
            mount = Some(found.mount().map_err(Failure::usage)?);
            section = found;
        }
        if let Some(address) = self.address {
            section.address = address;
        }
        let patience =
            Patience { reply: Duration::from_millis(section.reply_timeout_ms.into()), ..Patience::default() };
        let timer: Arc<dyn Timer> = Arc::new(SystemClock::new());
        let client = RotatorClient::connect(&section.address, patience, &timer).await.map_err(failed)?;
        Ok(Open { section, mount, client, timer, json: self.json })
    }
}

/// What the rotator refuses because of its limits must not be done; the rest did not work.
fn failed(error: HamlibError) -> Failure {
    match &error {
        HamlibError::Refused { code: -1, command, .. } if command.starts_with("set_pos") => {
            Failure::refused(error)
        }
        _ => Failure::failed(error),
    }
}

impl Open {
    fn tell(&self, stands: Option<Position>, outcome: Option<&str>) -> Result<(), Failure> {
        let limits = self.client.limits();
        if self.json {
            return print_json(&Told {
                address: &self.section.address,
                info: self.client.info(),
                limits: limits.map(|l| Limits { azimuth_deg: l.azimuth_deg, elevation_deg: l.elevation_deg }),
                azimuth_deg: stands.map(|p| p.azimuth_deg),
                elevation_deg: stands.map(|p| p.elevation_deg),
                outcome,
            });
        }
        if let Some(outcome) = outcome {
            let place =
                stands.map(|p| format!(" at azimuth {:.2}, elevation {:.2}", p.azimuth_deg, p.elevation_deg));
            return print_line(format_args!("{outcome}{}", place.unwrap_or_default()));
        }
        print_line(format_args!(
            "{} at {}",
            self.client.info().unwrap_or("a rotator"),
            self.section.address
        ))?;
        match limits {
            Some(l) => print_line(format_args!(
                "limits     azimuth {} to {}, elevation {} to {}",
                l.azimuth_deg.0, l.azimuth_deg.1, l.elevation_deg.0, l.elevation_deg.1
            ))?,
            None => print_line("limits     not told; the configuration's hold")?,
        }
        match stands {
            Some(p) => print_line(format_args!(
                "stands at  azimuth {:.2}, elevation {:.2}",
                p.azimuth_deg, p.elevation_deg
            )),
            None => print_line("stands at  not told"),
        }
    }

    async fn point(&mut self, target: Position, wait_s: u64) -> Result<Exit, Failure> {
        if let Some(mount) = &self.mount
            && !mount.allows(target)
        {
            let s = mount.settings();
            return Err(Failure::refused(format!(
                "azimuth {}, elevation {} is outside the configured range: azimuth {} to {}, elevation {} to {}",
                target.azimuth_deg,
                target.elevation_deg,
                s.azimuth_deg.0,
                s.azimuth_deg.1,
                s.elevation_deg.0,
                s.elevation_deg.1
            )));
        }
        let stop = stop_on_signals()?;
        self.client.set_position(target).await.map_err(failed)?;
        if wait_s == 0 {
            self.tell(None, Some("accepted"))?;
            return Ok(Exit::Done);
        }
        // Its rates are the configuration's, or those of a slow rotator.
        let mount = match self.mount {
            Some(mount) => mount,
            None => RotatorSection {
                azimuth_range: (-360.0, 720.0),
                elevation_range: (-90.0, 180.0),
                ..self.section.clone()
            }
            .mount()
            .map_err(Failure::usage)?,
        };
        let mut pointer = Pointer::new(mount);
        let began = self.timer.now().mono;
        let _first = pointer.next(began, target);
        loop {
            let stands = self.client.position().await.map_err(failed)?;
            let now = self.timer.now().mono;
            let seen = pointer.observe(now, stands);
            let near = stands.way_deg(target) <= 0.5
                || (seen.is_on_target && !seen.is_moving && now.since(began) > 3_000_000);
            if near {
                self.tell(Some(stands), Some("stands"))?;
                return Ok(Exit::Done);
            }
            if seen.is_stuck || now.since(began) > wait_s.saturating_mul(1_000_000) {
                self.tell(Some(stands), Some("stands"))?;
                let why = if seen.is_stuck {
                    "the rotator accepted that and does not move: check its power, its brake and its end stops"
                } else {
                    "the rotator is not there yet: wait longer with --wait"
                };
                return Err(Failure::failed(why));
            }
            let next = MonoUs(now.0 + 500_000);
            tokio::select! {
                _ = self.timer.sleep_until(next) => {}
                () = stop.cancelled() => {
                    self.client.stop().await.map_err(failed)?;
                    self.tell(Some(stands), Some("stopped"))?;
                    return Ok(Exit::Failed);
                }
            }
        }
    }
}

impl Rotator {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        runtime()?.block_on(async {
            match self {
                Self::Probe(target) => {
                    let mut open = target.open().await?;
                    let stands = open.client.position().await.map_err(failed)?;
                    open.tell(Some(stands), None)?;
                    Ok(Exit::Done)
                }
                Self::Point(point) => point.target.open().await?.point(point.position, point.wait).await,
                Self::Park(target) => {
                    let mut open = target.open().await?;
                    match open.mount.and_then(|mount| mount.settings().park) {
                        Some(park) => open.client.set_position(park).await,
                        None => open.client.park().await,
                    }
                    .map_err(failed)?;
                    open.tell(None, Some("parks"))?;
                    Ok(Exit::Done)
                }
                Self::Stop(target) => {
                    let mut open = target.open().await?;
                    open.client.stop().await.map_err(failed)?;
                    let stands = open.client.position().await.ok();
                    open.tell(stands, Some("stopped"))?;
                    Ok(Exit::Done)
                }
            }
        })
    }
}
