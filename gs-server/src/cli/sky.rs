//! What `passes` and `look` have in common: elements, stations, times.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use mission::Clock as _;
use tle::formats::Checksums;
use tle::{EarthOrientation, UtcInstant};

use super::Failure;
use super::shell::runtime;
use crate::clock::SystemClock;
use crate::config::Config;
use crate::elements::Remote;
use crate::elements::offline::archive;
use crate::run::RunError;
use crate::sky::{Catalogue, Object, Place, elements_of};
use crate::storage::{ElementsRow, StoreError};

/// Bytes of a file of elements: 30,000 objects as XML are 50 MB.
const FILE_BYTES_MAX: u64 = 256 << 20;
/// Sets of one satellite that are read from an archive.
const SETS_MAX: u32 = 1000;
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
    /// Without --elements: the configuration of a station, for its place and the elements that it holds
    #[arg(long, value_name = "FILE")]
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
    /// UT1-UTC, s; 0, or what the configuration says
    #[arg(long, value_name = "S", value_parser = dut1, allow_hyphen_values = true)]
    dut1: Option<EarthOrientation>,
    /// One JSON object
    #[arg(long)]
    pub(super) json: bool,
}

/// Satellites and stations.
pub(super) struct Sky {
    pub(super) catalogue: Catalogue,
    pub(super) places: Vec<Place>,
    pub(super) orientation: EarthOrientation,
    /// Below this the station hears nothing.
    pub(super) min_elevation_deg: f64,
}

impl SkyArgs {
    /// For a verb that has its own words for these.
    pub(super) fn of(elements: Vec<PathBuf>, station: Vec<Place>, config: Option<PathBuf>) -> Self {
        Self {
            elements,
            station,
            config,
            satellite: Vec::new(),
            lenient: false,
            frequency: None,
            dut1: None,
            json: false,
        }
    }

    /// Reads what was named. What cannot be used of it is told on standard error.
    pub(super) fn read(&self, window: (UtcInstant, UtcInstant)) -> Result<Sky, Failure> {
        let Sky { mut catalogue, places, orientation, min_elevation_deg } = match (
            &self.config,
            self.elements.is_empty(),
        ) {
            (Some(config), true) => self.configured(config, window)?,
            (None, true) => {
                return Err(Failure::usage(
                    "no elements: give --elements FILE (OMM as JSON, CSV, XML or KVN, or TLE), - for standard input, or the \
                         configuration of a station with --config",
                ));
            }
            (_, false) => self.files()?,
        };
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
        Ok(Sky { catalogue, places, orientation, min_elevation_deg })
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
        Ok(Sky {
            catalogue,
            places: self.station.clone(),
            orientation: self.dut1.unwrap_or_default(),
            min_elevation_deg: 0.0,
        })
    }

    /// The station of the configuration and the elements that it holds: from its server where one runs, else from its
    /// archive. Satellites have the names of the configuration.
    fn configured(&self, path: &Path, window: (UtcInstant, UtcInstant)) -> Result<Sky, Failure> {
        let config = Config::load(path).map_err(Failure::usage)?;
        config.check().map_err(Failure::usage)?;
        let site = config.station.site().map_err(Failure::usage)?;
        let places = match (&site, self.station.is_empty()) {
            (Some(site), true) => {
                vec![Place { name: config.station.name.clone(), station: site.place.clone() }]
            }
            (None, true) => {
                return Err(Failure::usage(format!(
                    "{} does not say where the station stands: set station.latitude_deg and station.longitude_deg, or give \
                     --station LATITUDE,LONGITUDE,HEIGHT_M",
                    path.display()
                )));
            }
            (_, false) => self.station.clone(),
        };
        let objects = runtime()?.block_on(held(&config, window))?;
        if objects.is_empty() {
            return Err(Failure::failed(
                "the station holds no elements: give some with `gs-server elements add`, or name a file with --elements",
            ));
        }
        Ok(Sky {
            catalogue: Catalogue { objects, ..Catalogue::default() },
            places,
            orientation: self.dut1.or(site.as_ref().map(|site| site.orientation)).unwrap_or_default(),
            min_elevation_deg: site.map_or(0.0, |site| site.min_elevation_deg),
        })
    }
}

/// The sets that a station holds for a window of time.
async fn held(config: &Config, (start, stop): (UtcInstant, UtcInstant)) -> Result<Vec<Object>, Failure> {
    let station = mission::StationId::new(&config.station.name).map_err(Failure::usage)?;
    let mut objects = Vec::new();
    match archive(config, &station).await {
        Ok(store) => {
            for satellite in &config.satellites {
                let window = (start.unix_us(), stop.unix_us());
                let rows = store.elements_between(&satellite.name, window, SETS_MAX).await;
                let sets = rows
                    .and_then(|rows| rows.iter().map(ElementsRow::elements).collect::<Result<Vec<_>, _>>());
                objects.extend(Object::named(&satellite.name, sets.map_err(Failure::failed)?));
            }
            store.close().await.map_err(Failure::failed)?;
        }
        Err(RunError::Store(StoreError::Locked { .. })) => {
            let remote = Remote::new(config).map_err(Failure::failed)?;
            for satellite in &config.satellites {
                let held = remote.held(Some(&satellite.name), SETS_MAX).await.map_err(Failure::failed)?;
                let sets = held.iter().map(|held| elements_of(&held.elements)).collect();
                objects.extend(Object::named(&satellite.name, sets));
            }
        }
        Err(error) => return Err(Failure::failed(error)),
    }
    Ok(objects)
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
    let seconds: f64 =
        text.parse().map_err(|_| format!("'{text}' is no number: give seconds, such as -0.043"))?;
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
        for (text, seconds) in
            [("+7d", 604_800), ("+1w", 604_800), ("+1d12h", 129_600), ("+90m", 5400), ("-2.5h", -9000)]
        {
            assert_eq!(at(text), Ok(now.plus_us(7 + seconds * 1_000_000)), "{text}");
        }
        for wrong in [
            "",
            "+",
            "+7",
            "+7y",
            "7d",
            "yesterday",
            "2020-13-01",
            "2020-07-13T05:19:25+02:00",
            "+99999d",
            "+1..5h",
        ] {
            let error = at(wrong).unwrap_err();
            assert!(error.contains("2026-11-22T05:19:25") && error.contains("+7d"), "{wrong}: {error}");
        }
    }
}
