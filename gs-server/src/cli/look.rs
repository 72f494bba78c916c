//! `gs-server look`.

use api::{LookView, RefusedElements};
use clap::Args;
use serde::Serialize;
use tle::UtcInstant;

use super::shell::{print_json, print_text};
use super::sky::{Moment, SkyArgs, now};
use super::{Exit, Failure};
use crate::sky::{Looks, look_at, look_table};

/// Looks that one call computes.
const LOOKS_MAX: usize = 1_000_000;

/// `gs-server look`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server look --elements gp.json --station 46.5191,6.5668,410 --satellite 25544
  gs-server look --elements gp.json --station 46.5191,6.5668,410 --frequency 437e6 --json \\
      --at 2026-11-22T05:19:25Z,2026-11-22T05:20:25Z

Angles are geometric, without refraction. \"Doppler\" is how far above the frequency the downlink is
heard, \"send\" what to transmit so that it arrives at the frequency, \"below\" the place straight under
the satellite. A file may hold several sets of one object: the newest at or before the instant is used.

Exit code 1 if a set of elements was refused (the others are used), or has no state at an instant; 2 if
the arguments make no sense.")]
pub struct Look {
    #[command(flatten)]
    sky: SkyArgs,
    /// Instants, UTC, divided by commas; a distance such as +10m counts from now
    #[arg(
        long,
        value_name = "T,T,...",
        default_value = "now",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    at: Vec<Moment>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    frequency_hz: Option<f64>,
    ut1_minus_utc_s: f64,
    looks: Vec<LookView>,
    refused: Vec<RefusedElements>,
}

impl Look {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let now = now();
        let at: Vec<UtcInstant> = self.at.iter().map(|moment| moment.resolve(now, now)).collect();
        let first = at.iter().min().copied().unwrap_or(now);
        let last = at.iter().max().copied().unwrap_or(now);
        let sky = self.sky.read((first, last))?;
        let objects = &sky.catalogue.objects;
        let count = objects.len().saturating_mul(sky.places.len()).saturating_mul(at.len());
        if count > LOOKS_MAX {
            return Err(Failure::usage(format!(
                "{count} looks are more than {LOOKS_MAX}: give fewer satellites (--satellite), stations or instants"
            )));
        }
        let looks = look_at(&Looks {
            objects,
            places: &sky.places,
            at: &at,
            orientation: sky.orientation,
            frequency_hz: self.sky.frequency,
        })
        .map_err(Failure::failed)?;
        let is_whole = sky.catalogue.refused.is_empty() && looks.iter().all(|look| look.error.is_none());
        if self.sky.json {
            print_json(&Answer {
                frequency_hz: self.sky.frequency,
                ut1_minus_utc_s: sky.orientation.ut1_minus_utc_s(),
                looks,
                refused: sky.catalogue.refused,
            })?;
        } else {
            print_text(&look_table(&looks))?;
        }
        Ok(if is_whole { Exit::Done } else { Exit::Failed })
    }
}
