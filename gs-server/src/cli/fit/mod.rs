//! `gs-server fit`: how late a satellite is against its elements.

mod receptions;

use std::path::PathBuf;

use api::FineTime;
use clap::{Args, ValueEnum};
use mission::sky::{ElementsAge, utc};
use serde::Serialize;
use tle::doppler_fit::{DopplerFit, FitSettings, LimitedBy, Sign, fit, late_elements};
use tle::formats::{Form, write};
use tle::{Elements, Propagator};

use super::shell::{print_json, print_text};
use super::sky::{SkyArgs, tell};
use super::{Exit, Failure};
use crate::sky::{Place, fine_time};

/// `gs-server fit`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server fit --elements gp.json --receptions heard.ndjson
  gs-server fit --elements gp.json --receptions heard.json --sign above --json
  gs-server fit --elements gp.json --receptions heard.json --write corrected.json

--receptions is JSON, an array or one object a line: what TinyGS boards publish (rx), packets of the
TinyGS API with their stations, or this program's own export of receptions. What counts of each is the
time, the place of the receiver, the frequency, and the measured frequency error.

Anybody can publish a reception. The corrected elements of --write are for a person to look at; nothing
is put in force.

Exit code 1 if the receptions do not determine it, with the reason; 2 if the arguments make no sense.")]
pub struct Fit {
    /// A file of elements, or - for standard input
    #[arg(long, value_name = "FILE", required = true)]
    elements: Vec<PathBuf>,
    /// The satellite of the elements, where the file has several: name, number or designator
    #[arg(long, value_name = "SATELLITE")]
    satellite: Option<String>,
    /// Receptions; may be given several times
    #[arg(long, value_name = "FILE", required = true)]
    receptions: Vec<PathBuf>,
    /// What a positive frequency error means: the signal is above or below what was tuned. Without it, found for each
    /// receiver
    #[arg(long, value_name = "SIDE")]
    sign: Option<Side>,
    /// The satellite is at most so late or early, s
    #[arg(long, value_name = "S", default_value_t = FitSettings::default().search_s)]
    search: f64,
    /// Write the elements, corrected, as OMM (JSON)
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Side {
    Above,
    Below,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    satellite: String,
    elements_epoch: FineTime,
    elements_age_days: f64,
    expected_error_s: f64,
    late_s: f64,
    sigma_s: f64,
    limited_by: &'static str,
    satellite_hz: f64,
    noise_hz: f64,
    used: usize,
    rejected: usize,
    left_out: usize,
    from: FineTime,
    until: FineTime,
    receivers: Vec<ReceiverView>,
}

#[derive(Serialize)]
struct ReceiverView {
    name: String,
    used: usize,
    rejected: usize,
    sign: Option<&'static str>,
    offset_hz: Option<f64>,
    clock_fast_s: Option<f64>,
}

impl Fit {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let heard = receptions::read(&self.receptions)?;
        tell(heard.refused.iter().cloned(), "receptions left out");
        let (Some(first), Some(last)) = (
            heard.observations.iter().map(|one| one.at).min(),
            heard.observations.iter().map(|one| one.at).max(),
        ) else {
            return Err(Failure::failed("no reception has a time, a place and a measured frequency error"));
        };
        let elements = self.elements_of((first, last))?;
        let sign = self.sign.map(|side| match side {
            Side::Above => Sign::Above,
            Side::Below => Sign::Below,
        });
        let receivers: Vec<_> = heard
            .receivers
            .iter()
            .map(|(_, place)| tle::doppler_fit::Receiver {
                sign,
                ..tle::doppler_fit::Receiver::unknown(place.clone())
            })
            .collect();
        let settings = FitSettings { search_s: self.search, ..FitSettings::default() };
        let orbit = Propagator::new(&elements).map_err(Failure::failed)?;
        let found = fit(&orbit, &receivers, &heard.observations, &settings).map_err(Failure::failed)?;
        if let Some(path) = &self.write {
            let corrected = late_elements(&elements, found.late_s);
            let text = write(Form::OmmJson, &[corrected]).map_err(Failure::failed)?;
            std::fs::write(path, text)
                .map_err(|error| Failure::doing(format!("{} cannot be written", path.display()), error))?;
        }
        let names: Vec<&str> = heard.receivers.iter().map(|(name, _)| name.as_str()).collect();
        let answer = answer(&elements, &found, &names, heard.refused.len());
        if self.json {
            print_json(&answer)?
        } else {
            print_text(&table(&answer))?
        }
        Ok(Exit::Done)
    }

    /// The set for the middle of the receptions.
    fn elements_of(&self, (first, last): (tle::UtcInstant, tle::UtcInstant)) -> Result<Elements, Failure> {
        // The reader of files wants a station; any will do here.
        let anywhere: Place = "0,0,0".parse().map_err(Failure::failed)?;
        let sky = SkyArgs::of(self.elements.clone(), vec![anywhere], None).read((first, last))?;
        let mut catalogue = sky.catalogue;
        if let Some(wanted) = &self.satellite {
            catalogue.keep(std::slice::from_ref(wanted)).map_err(Failure::usage)?;
        }
        match &catalogue.objects[..] {
            [only] => Ok(only.set_for(first.plus_us(last.us_since(first) / 2)).clone()),
            objects => Err(Failure::usage(format!(
                "the elements are of {} satellites: choose one with --satellite",
                objects.len()
            ))),
        }
    }
}

fn answer(elements: &Elements, found: &DopplerFit, names: &[&str], left_out: usize) -> Answer {
    let age = ElementsAge::at(elements, utc(found.until));
    Answer {
        satellite: elements.label(),
        elements_epoch: fine_time(elements.epoch),
        elements_age_days: age.age_days,
        expected_error_s: age.timing_error_s,
        late_s: found.late_s,
        sigma_s: found.sigma_s,
        limited_by: match found.limited_by {
            LimitedBy::Noise => "noise",
            LimitedBy::Clocks => "clocks",
            LimitedBy::Oscillators => "oscillators",
        },
        satellite_hz: found.satellite_hz,
        noise_hz: found.noise_hz,
        used: found.used,
        rejected: found.rejected,
        left_out,
        from: fine_time(found.from),
        until: fine_time(found.until),
        receivers: found
            .receivers
            .iter()
            .zip(names)
            .map(|(one, name)| ReceiverView {
                name: (*name).to_owned(),
                used: one.used,
                rejected: one.rejected,
                sign: one.sign.map(|sign| if sign == Sign::Above { "above" } else { "below" }),
                offset_hz: (one.used > 0).then_some(one.offset_hz),
                clock_fast_s: (one.used > 0).then_some(one.fast_s),
            })
            .collect(),
    }
}

fn table(answer: &Answer) -> String {
    use std::fmt::Write as _;
    let way = if answer.late_s >= 0.0 { "late" } else { "early" };
    let mut text = format!(
        "{} is {:.1} s {way}, +- {:.1} s (1 sigma, for the most part from {})\n\
         {} receptions of {} receivers counted, {} did not; noise {:.0} Hz, the satellite sends {:+.0} Hz off\n\
         elements {:.1} days old, for which {:.1} s were to be expected\n\n{:<32} {:>5} {:>5}  {:<6} {:>9} {:>8}\n",
        answer.satellite,
        answer.late_s.abs(),
        answer.sigma_s,
        answer.limited_by,
        answer.used,
        answer.receivers.iter().filter(|one| one.used > 0).count(),
        answer.rejected,
        answer.noise_hz,
        answer.satellite_hz,
        answer.elements_age_days,
        answer.expected_error_s,
        "receiver",
        "used",
        "not",
        "sign",
        "offset Hz",
        "clock s"
    );
    for one in &answer.receivers {
        let number = |value: Option<f64>, digits: usize| {
            value.map_or("-".to_owned(), |value| format!("{value:+.digits$}"))
        };
        let _ = writeln!(
            text,
            "{:<32} {:>5} {:>5}  {:<6} {:>9} {:>8}",
            one.name,
            one.used,
            one.rejected,
            one.sign.unwrap_or("?"),
            number(one.offset_hz, 0),
            number(one.clock_fast_s, 2)
        );
    }
    text
}
