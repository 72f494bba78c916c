//! What `passes` and `look` have in common: elements, stations, times.

use std::fs::File;
use std::io::{self, Read};
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use mission::Clock as _;
use tle::formats::Checksums;
use tle::{EarthOrientation, UtcInstant};

use super::Failure;
use crate::clock::SystemClock;
use crate::sky::{Catalogue, Place};

/// Bytes of a file of elements: 30,000 objects as XML are 50 MB.
const FILE_BYTES_MAX: u64 = 256 << 20;
/// Refused sets, warnings and gaps that are told one by one.
const TOLD_MAX: usize = 20;

/// Whose sky, and where.
#[derive(Debug, Args)]
pub(super) struct SkyArgs {
    /// A file of elements, or - for standard input: OMM as JSON, CSV, XML or KVN, or TLE; may be given several times
    #[arg(long, value_name = "FILE")]
    elements: Vec<PathBuf>,
    /// LATITUDE,LONGITUDE,HEIGHT_M (WGS84, decimal degrees, north and east positive), or NAME=...; may be given several
    /// times
    #[arg(long, value_name = "STATION", allow_hyphen_values = true)]
    station: Vec<Place>,
    /// Without --elements: the configuration with the station and the archive of its elements
    #[arg(long, value_name = "FILE", env = "GS_CONFIG", hide_env_values = true)]
    config: Option<PathBuf>,
    /// Only this one: name, catalogue number or designator; may be given several times
    #[arg(long, value_name = "SATELLITE")]
    satellite: Vec<String>,
    /// Use TLE whose checksum is wrong, with a warning
    #[arg(long)]
    lenient: bool,
    /// Frequency for the Doppler shifts, Hz
    #[arg(long, value_name = "HZ", value_parser = frequency)]
    pub(super) frequency: Option<f64>,
    /// UT1-UTC, s
    #[arg(long, value_name = "S", default_value = "0", value_parser = dut1, allow_hyphen_values = true)]
    pub(super) dut1: EarthOrientation,
    /// One JSON object
    #[arg(long)]
    pub(super) json: bool,
}

/// Satellites and stations.
pub(super) struct Sky {
    pub(super) catalogue: Catalogue,
    pub(super) places: Vec<Place>,
}

impl SkyArgs {
    /// Reads what was named. What cannot be used of it is told on standard error.
    pub(super) fn read(&self) -> Result<Sky, Failure> {
        let Sky { mut catalogue, places } =
            if self.elements.is_empty() { self.configured()? } else { self.files()? };
        for (index, place) in places.iter().enumerate() {
            if places[..index].iter().any(|other| other.name == place.name) {
                return Err(Failure::usage(format!(
                    "two stations are called '{}': name one of them NAME=LAT,LON,HEIGHT",
                    place.name
                )));
            }
        }
        let refused = &catalogue.refused;
        tell(
            refused.iter().map(|set| {
                let object = set.object.as_ref().map(|object| format!(" ({object})")).unwrap_or_default();
                format!("{}, line {}{object}: {}", set.source, set.line, set.error)
            }),
            "sets refused",
        );
        if catalogue.objects.is_empty() {
            let names: Vec<_> = self.elements.iter().map(|file| file.display().to_string()).collect();
            return Err(Failure::failed(format!(
                "{} has no set of elements that can be used: {} refused, for the reasons above",
                names.join(", "),
                refused.len()
            )));
        }
        tell(catalogue.warnings.iter().cloned(), "warnings");
        if !refused.is_empty() {
            let sets: usize = catalogue.objects.iter().map(|object| object.sets().len()).sum();
            eprintln!("gs-server: {} of {} sets refused", refused.len(), refused.len() + sets);
        }
        if !self.satellite.is_empty() {
            catalogue.keep(&self.satellite).map_err(Failure::failed)?;
        }
        Ok(Sky { catalogue, places })
    }

    fn files(&self) -> Result<Sky, Failure> {
        if self.station.is_empty() {
            return Err(Failure::usage(
                "no station: give --station LATITUDE,LONGITUDE,HEIGHT_M, such as --station 46.5191,6.5668,410",
            ));
        }
        let checksums = if self.lenient { Checksums::Lenient } else { Checksums::Strict };
        let mut catalogue = Catalogue::default();
        for file in &self.elements {
            let is_stdin = file.as_os_str() == "-";
            let name = if is_stdin { "standard input".to_owned() } else { file.display().to_string() };
            let input: Box<dyn Read> = if is_stdin {
                Box::new(io::stdin().lock())
            } else {
                let opened = File::open(file);
                Box::new(opened.map_err(|error| Failure::doing(format!("{name} cannot be opened"), error))?)
            };
            let mut bytes = Vec::new();
            input
                .take(FILE_BYTES_MAX + 1)
                .read_to_end(&mut bytes)
                .map_err(|error| Failure::doing(format!("{name} cannot be read"), error))?;
            if bytes.len() as u64 > FILE_BYTES_MAX {
                return Err(Failure::failed(format!(
                    "{name} is larger than {} MiB: cut it into parts",
                    FILE_BYTES_MAX >> 20
                )));
            }
            catalogue.read(&name, &bytes, checksums).map_err(|error| Failure::doing(name, error))?;
        }
        Ok(Sky { catalogue, places: self.station.clone() })
    }

    /// The station of the configuration and the elements of its archive.
    fn configured(&self) -> Result<Sky, Failure> {
        Err(Failure::usage("no elements: give --elements FILE (OMM as JSON, CSV, XML or KVN, or TLE), or - for standard input"))
    }
}

/// Tells lines on standard error, and how many more there are.
pub(super) fn tell(lines: impl ExactSizeIterator<Item = String>, what: &str) {
    let more = lines.len().saturating_sub(TOLD_MAX);
    for line in lines.take(TOLD_MAX) {
        eprintln!("gs-server: {line}");
    }
    if more > 0 {
        eprintln!("gs-server: and {more} more {what}");
    }
}

/// The machine's time.
pub(super) fn now() -> UtcInstant {
    UtcInstant::from_unix_us(SystemClock::new().now().utc.0)
}

fn frequency(text: &str) -> Result<f64, String> {
    let hz: f64 = text.parse().map_err(|_| format!("'{text}' is no number: give hertz, such as 435.4e6"))?;
    if (1e5..=1e12).contains(&hz) {
        Ok(hz)
    } else {
        Err(format!("{hz} Hz is outside 100 kHz to 1 THz: give hertz, such as 435.4e6"))
    }
}

fn dut1(text: &str) -> Result<EarthOrientation, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("'{text}' is no number: give seconds, such as -0.043"))?;
    EarthOrientation::new(seconds).map_err(|error| error.to_string())
}

/// An instant as it is written in an argument: `now`, UTC, or a distance such as `+24h`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moment {
    /// When the program runs.
    Now,
    /// An instant.
    At(UtcInstant),
    /// Microseconds after another moment.
    After(i64),
}

impl Moment {
    /// The instant; distances count from `from`.
    pub(super) fn resolve(self, now: UtcInstant, from: UtcInstant) -> UtcInstant {
        match self {
            Self::Now => now,
            Self::At(at) => at,
            Self::After(us) => from.plus_us(us),
        }
    }
}

impl FromStr for Moment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        if text.eq_ignore_ascii_case("now") {
            return Ok(Self::Now);
        }
        if let Some(us) = text.strip_prefix('+').and_then(distance_us) {
            return Ok(Self::After(us));
        }
        if let Some(us) = text.strip_prefix('-').and_then(distance_us) {
            return Ok(Self::After(-us));
        }
        // A day alone is its beginning.
        let is_day = text.len() == 10 && !text.contains('T');
        let at = if is_day { format!("{text}T00:00:00Z").parse() } else { text.parse::<UtcInstant>() };
        at.map(Self::At).map_err(|error| format!("{error}, or a distance such as +7d, +36h or +90m, or now"))
    }
}

/// `7d`, `1d12h`, `90m`, `2.5h`: whole microseconds, up to ten years.
fn distance_us(text: &str) -> Option<i64> {
    let mut seconds = 0.0;
    let mut rest = text;
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.')?;
        let number: f64 = rest[..digits].parse().ok()?;
        let unit = rest[digits..].find(|c: char| c.is_ascii_digit()).map_or(rest.len(), |next| digits + next);
        seconds += number
            * match &rest[digits..unit] {
                "s" => 1.0,
                "m" | "min" => 60.0,
                "h" => 3600.0,
                "d" => 86_400.0,
                "w" => 604_800.0,
                _ => return None,
            };
        rest = &rest[unit..];
    }
    (!text.is_empty() && seconds <= 3700.0 * 86_400.0).then_some((seconds * 1e6).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_instants_days_and_distances() {
        let now = UtcInstant::from_unix_us(1_000_000_000_000_000);
        let at = |text: &str| text.parse::<Moment>().map(|moment| moment.resolve(now, now.plus_us(7)));
        assert_eq!(at("now"), Ok(now));
        assert_eq!(at("2020-07-13T05:19:25.5Z").unwrap().to_string(), "2020-07-13T05:19:25.500000Z");
        assert_eq!(at("2020-07-13").unwrap().to_string(), "2020-07-13T00:00:00.000000Z");
        for (text, seconds) in [("+7d", 604_800), ("+1w", 604_800), ("+1d12h", 129_600), ("+90m", 5400), ("-2.5h", -9000)] {
            assert_eq!(at(text), Ok(now.plus_us(7 + seconds * 1_000_000)), "{text}");
        }
        for wrong in ["", "+", "+7", "+7y", "7d", "yesterday", "2020-13-01", "2020-07-13T05:19:25+02:00", "+99999d", "+1..5h"] {
            let error = at(wrong).unwrap_err();
            assert!(error.contains("2026-11-22T05:19:25") && error.contains("+7d"), "{wrong}: {error}");
        }
    }
}
