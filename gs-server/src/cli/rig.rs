//! `gs-server rig probe|tune`: a rig by hand, through rigctld.

use std::sync::Arc;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::clock::{SystemClock, Timer};
use crate::hamlib::{Patience, RigClient, RigReading};

/// `gs-server rig`.
#[derive(Debug, Subcommand)]
pub enum Rig {
    /// Who the rig is and what it is set to; changes nothing
    #[command(after_help = "\
Examples:
  rigctld -m 1 &                                  a dummy
  gs-server rig probe
  gs-server rig probe --address shack.local:4532 --json

Exit code 0 if it answered, 1 if not.")]
    Probe(Target),
    /// Tune its receiver, and read back what it took
    #[command(after_help = "\
Examples:
  gs-server rig tune 437800000
  gs-server rig tune 437_800_000 --transmit 145_990_000

The transmitter is never keyed. Exit code 1 if the rig shows another frequency than it accepted.")]
    Tune(Tune),
}

/// Which rig.
#[derive(Debug, Args)]
pub struct Target {
    /// Host and port of rigctld
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:4532")]
    address: String,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// `gs-server rig tune`.
#[derive(Debug, Args)]
pub struct Tune {
    /// The receiver's frequency, Hz
    #[arg(value_name = "HZ", value_parser = frequency)]
    hz: u64,
    /// The transmitter's frequency in split operation, Hz
    #[arg(long, value_name = "HZ", value_parser = frequency)]
    transmit: Option<u64>,
    /// What the rig resolves, Hz
    #[arg(long, value_name = "HZ", default_value_t = 10)]
    resolution: u32,
    #[command(flatten)]
    target: Target,
}

#[derive(Serialize)]
struct Told<'a> {
    address: &'a str,
    info: Option<&'a str>,
    receive_hz: f64,
    transmit_hz: Option<f64>,
}

fn frequency(text: &str) -> Result<u64, String> {
    let hz = text.replace('_', "").parse::<u64>().ok().filter(|hz| (10_000..=300_000_000_000).contains(hz));
    hz.ok_or_else(|| "give whole Hz, 10000 to 300000000000, as in 437800000 or 437_800_000".to_owned())
}

async fn open(target: &Target) -> Result<RigClient, Failure> {
    let timer: Arc<dyn Timer> = Arc::new(SystemClock::new());
    RigClient::connect(&target.address, Patience::default(), &timer).await.map_err(Failure::failed)
}

fn tell(target: &Target, client: &RigClient, reading: RigReading) -> Result<Exit, Failure> {
    let RigReading { receive_hz, transmit_hz } = reading;
    if target.json {
        print_json(&Told { address: &target.address, info: client.info(), receive_hz, transmit_hz })?;
    } else {
        print_line(format_args!("{} at {}", client.info().unwrap_or("a rig"), target.address))?;
        print_line(format_args!("receives at   {receive_hz} Hz"))?;
        if let Some(hz) = transmit_hz {
            print_line(format_args!("transmits at  {hz} Hz (split)"))?;
        }
    }
    Ok(Exit::Done)
}

impl Rig {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        runtime()?.block_on(async {
            match self {
                Self::Probe(target) => {
                    let mut client = open(&target).await?;
                    let reading = client.reading().await.map_err(Failure::failed)?;
                    tell(&target, &client, reading)
                }
                Self::Tune(tune) => {
                    let mut client = open(&tune.target).await?;
                    let receive_hz = client.tune(tune.hz, tune.resolution).await.map_err(Failure::failed)?;
                    let transmit_hz = match tune.transmit {
                        Some(hz) => Some(
                            client.tune_transmitter(hz, tune.resolution).await.map_err(Failure::failed)?,
                        ),
                        None => None,
                    };
                    tell(&tune.target, &client, RigReading { receive_hz, transmit_hz })
                }
            }
        })
    }
}
