//! `gs-server elements prelaunch`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use tle::formats::{Checksums, Form, Found, write};
use tle::frames::teme_from_ecef;
use tle::prelaunch::{after_delayed_launch, elements_from_state};
use tle::{EarthFixed, EarthOrientation, Elements, State, UtcInstant, gmst_rad};

use super::super::shell::{print_line, runtime};
use super::super::{Exit, Failure};
use super::{add, load, read};
use crate::elements::SetsOfText;

/// Drag of a CubeSat at 500 km, 1/Earth radii.
const BSTAR: f64 = 2e-4;
/// A slip longer than this is another campaign: the Sun and the orbit's plane have moved on.
const DELAY_MAX_S: f64 = 30.0 * 86_400.0;

/// `gs-server elements prelaunch`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server elements prelaunch --satellite pixelsat-1 --epoch 2026-12-01T10:31:07Z \\
      --state 2715.4,-6019.1,1808.6,1.9,2.4,6.9 > separation.json
  gs-server elements prelaunch --satellite pixelsat-1 --elements nominal.tle --delay 1800
  gs-server elements prelaunch --config station.toml --satellite pixelsat-1 --epoch … --state …

A state is position in km and velocity in km/s at the epoch, in TEME (the frame of SGP4) or ITRF
(turning with the Earth). The elements meet it to a millimetre; they cannot be better than the state.
With --delay the lift-off is so many seconds later: the epoch moves with it, the plane with the Earth.
Without --config the elements go to standard output; with it the station gets them.")]
pub struct Prelaunch {
    /// What to call the object; with --config, the satellite that gets the elements
    #[arg(long, value_name = "NAME")]
    satellite: String,
    /// The instant of the state, UTC
    #[arg(long, value_name = "TIME", requires = "state")]
    epoch: Option<UtcInstant>,
    /// X,Y,Z in km and VX,VY,VZ in km/s
    #[arg(
        long,
        value_name = "X,Y,Z,VX,VY,VZ",
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "epoch",
        required_unless_present = "elements",
        conflicts_with = "elements"
    )]
    state: Vec<f64>,
    /// The frame of the state
    #[arg(long, value_enum, default_value_t)]
    frame: Frame,
    /// Drag of the object, 1/Earth radii
    #[arg(long, value_name = "B*", default_value_t = BSTAR)]
    bstar: f64,
    /// Elements for the nominal lift-off, or - for standard input
    #[arg(long, value_name = "FILE", requires = "delay")]
    elements: Option<PathBuf>,
    /// The lift-off is so many seconds later than nominal (earlier when negative)
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    delay: Option<f64>,
    /// A number for the object, if it is known already
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=999_999_999))]
    norad_cat_id: Option<u32>,
    /// How to write the elements
    #[arg(long, value_enum, default_value_t)]
    form: FormWord,
    /// The station that gets them
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// With --config: one JSON object on standard output
    #[arg(long, requires = "config")]
    json: bool,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum Frame {
    /// True equator, mean equinox of the epoch: the frame of SGP4
    #[default]
    Teme,
    /// Earth-fixed, turning with the Earth
    Itrf,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum FormWord {
    #[default]
    Json,
    Csv,
    Xml,
    Kvn,
    Tle,
}

impl From<FormWord> for Form {
    fn from(word: FormWord) -> Self {
        match word {
            FormWord::Json => Self::OmmJson,
            FormWord::Csv => Self::OmmCsv,
            FormWord::Xml => Self::OmmXml,
            FormWord::Kvn => Self::OmmKvn,
            FormWord::Tle => Self::ThreeLine,
        }
    }
}

impl Prelaunch {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let mut elements = match &self.elements {
            Some(file) => nominal(file)?,
            None => self.of_state()?,
        };
        if let Some(delay_s) = self.delay {
            if !(-DELAY_MAX_S..=DELAY_MAX_S).contains(&delay_s) {
                return Err(Failure::usage(format!(
                    "--delay: {delay_s} s is outside 30 days: get new elements for another campaign"
                )));
            }
            elements = after_delayed_launch(&elements, delay_s);
        }
        elements.name = Some(self.satellite.clone());
        if self.norad_cat_id.is_some() {
            elements.norad_cat_id = self.norad_cat_id;
        }
        let Some(config) = &self.config else {
            let text = write(self.form.into(), &[elements]).map_err(Failure::failed)?;
            print_line(text.trim_end())?;
            return Ok(Exit::Done);
        };
        let config = load(config)?;
        let text = SetsOfText {
            form: Form::OmmJson,
            sets: vec![Found { elements, line: 1, warnings: Vec::new() }],
            refused: Vec::new(),
        };
        let added = runtime()?.block_on(add::add(&config, &text, "prelaunch", Some(&self.satellite)))?;
        add::tell(&added, self.json)
    }

    fn of_state(&self) -> Result<Elements, Failure> {
        let [x, y, z, vx, vy, vz] = self.state[..] else {
            return Err(Failure::usage(format!(
                "--state: {} numbers, wanted are six: X,Y,Z in km and VX,VY,VZ in km/s",
                self.state.len()
            )));
        };
        let epoch = self.epoch.ok_or_else(|| Failure::usage("--epoch is missing"))?;
        if !(-1.0..=1.0).contains(&self.bstar) {
            return Err(Failure::usage(format!("--bstar: {} is outside -1 to 1", self.bstar)));
        }
        let state = match self.frame {
            Frame::Teme => State { r_teme_km: [x, y, z], v_teme_km_s: [vx, vy, vz] },
            Frame::Itrf => teme_from_ecef(
                &EarthFixed { r_ecef_km: [x, y, z], v_ecef_km_s: [vx, vy, vz] },
                gmst_rad(epoch, EarthOrientation::UT1_IS_UTC),
            ),
        };
        elements_from_state(epoch, &state, self.bstar)
            .map_err(|error| Failure::doing("--state gives no elements", error))
    }
}

/// The only set of a file.
fn nominal(file: &std::path::Path) -> Result<Elements, Failure> {
    let name = file.display();
    let text = SetsOfText::read(&read(file)?, Checksums::Strict)
        .map_err(|error| Failure::doing(format!("{name} is no elements"), error))?;
    let mut sets = text.sets.into_iter();
    match (sets.next(), sets.next()) {
        (Some(only), None) => Ok(only.elements),
        (Some(_), Some(_)) => {
            Err(Failure::failed(format!("{name} holds several sets: give the one of the nominal lift-off")))
        }
        (None, _) => {
            let why = text.refused.first().map(ToString::to_string).unwrap_or_default();
            Err(Failure::failed(format!("{name}: no set can be used; {why}")))
        }
    }
}
