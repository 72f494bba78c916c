//! The file of `schedule --stations`: stations with their antennas, and satellites with what they are worth.

use std::path::Path;

use mission::schedule::{Antenna, Blackout, Health, Scope};
use mission::{AntennaId, SatelliteId, Site, StationId};
use serde::Deserialize;

use crate::cli::Failure;
use crate::config::{ClockSetting, ConfigError, StationSection, WindowSection};

/// Bytes of such a file.
const BYTES_MAX: u64 = 4 << 20;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Words {
    #[serde(default)]
    stations: Vec<StationWords>,
    #[serde(default)]
    satellites: Vec<SatelliteWords>,
}

/// The words of `[station]` in a configuration, and what a plan over several needs besides.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StationWords {
    name: String,
    latitude_deg: f64,
    longitude_deg: f64,
    #[serde(default)]
    height_m: f64,
    #[serde(default)]
    min_elevation_deg: f64,
    #[serde(default)]
    horizon_deg: Vec<[f64; 2]>,
    #[serde(default)]
    dut1_s: f64,
    #[serde(default)]
    licence: Option<Vec<WindowSection>>,
    #[serde(default)]
    blackouts: Vec<WindowSection>,
    #[serde(default = "half_a_minute")]
    switch_over_s: u32,
    #[serde(default)]
    antennas: Vec<String>,
    #[serde(default)]
    unfit: Option<String>,
}

const fn half_a_minute() -> u32 {
    30
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SatelliteWords {
    name: String,
    #[serde(default)]
    elements: Option<String>,
    #[serde(default = "one")]
    priority: u8,
    #[serde(default = "whole")]
    worth: f64,
    #[serde(default = "a_minute")]
    min_duration_s: u32,
    #[serde(default)]
    min_max_elevation_deg: f64,
    #[serde(default = "yes")]
    transmit: bool,
    #[serde(default)]
    stations: Vec<String>,
}

const fn one() -> u8 {
    1
}

const fn whole() -> f64 {
    1.0
}

const fn a_minute() -> u32 {
    60
}

const fn yes() -> bool {
    true
}

/// What a file says, checked.
#[derive(Debug)]
pub(super) struct Network {
    pub(super) stations: Vec<Ground>,
    pub(super) satellites: Vec<Wanted>,
}

/// A station.
#[derive(Debug)]
pub(super) struct Ground {
    pub(super) id: StationId,
    pub(super) place: Site,
    pub(super) antennas: Vec<Antenna>,
    pub(super) site: mission::schedule::Site,
    pub(super) blackouts: Vec<Blackout>,
}

/// A satellite.
#[derive(Debug)]
pub(super) struct Wanted {
    pub(super) id: SatelliteId,
    /// How the elements call it.
    pub(super) elements: String,
    /// 1 to 10; one step doubles what a pass is worth.
    pub(super) priority: u8,
    /// A factor on what its passes are worth.
    pub(super) worth: f64,
    pub(super) min_duration_s: u32,
    pub(super) min_max_elevation_deg: f64,
    pub(super) transmit: bool,
    /// By which stations; none named: by all.
    pub(super) stations: Vec<StationId>,
}

impl Network {
    /// Reads and checks a file.
    pub(super) fn load(path: &Path) -> Result<Self, Failure> {
        let name = path.display();
        let size = std::fs::metadata(path).map(|meta| meta.len());
        let size = size.map_err(|error| Failure::doing(format!("{name} cannot be read"), error))?;
        if size > BYTES_MAX {
            return Err(Failure::usage(format!(
                "{name} is larger than {} MiB: this is no file of stations",
                BYTES_MAX >> 20
            )));
        }
        let text = std::fs::read_to_string(path)
            .map_err(|error| Failure::doing(format!("{name} cannot be read"), error))?;
        Self::of(&text).map_err(|why| Failure::usage(format!("{name}: {why}")))
    }

    fn of(text: &str) -> Result<Self, String> {
        let words: Words = toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())?;
        if words.stations.is_empty() || words.satellites.is_empty() {
            let what = if words.stations.is_empty() { "stations" } else { "satellites" };
            return Err(format!(
                "there are no {what}: write [[{what}]] with a name and more, as docs/plans.md shows"
            ));
        }
        let mut network = Self { stations: Vec::new(), satellites: Vec::new() };
        for (at, words) in words.stations.into_iter().enumerate() {
            let ground = ground(words, &format!("stations[{at}]"))?;
            if network.stations.iter().any(|other| other.id == ground.id) {
                return Err(format!(
                    "stations[{at}].name: two stations are called '{}'; choose another name",
                    ground.id
                ));
            }
            let taken = |id: &AntennaId| {
                network.stations.iter().flat_map(|other| &other.antennas).any(|other| other.id == *id)
            };
            if let Some(twice) = ground.antennas.iter().find(|antenna| taken(&antenna.id)) {
                return Err(format!(
                    "stations[{at}].antennas: two antennas are called '{}'; choose another name",
                    twice.id
                ));
            }
            network.stations.push(ground);
        }
        for (at, words) in words.satellites.into_iter().enumerate() {
            let wanted = wanted(words, &format!("satellites[{at}]"), &network.stations)?;
            if network.satellites.iter().any(|other| other.id == wanted.id) {
                return Err(format!(
                    "satellites[{at}].name: two satellites are called '{}'; choose another name, and say with `elements` how the elements call it",
                    wanted.id
                ));
            }
            network.satellites.push(wanted);
        }
        Ok(network)
    }
}

fn ground(words: StationWords, at: &str) -> Result<Ground, String> {
    let id = StationId::new(&words.name).map_err(|error| format!("{at}.name: {error}"))?;
    let names = if words.antennas.is_empty() { vec![words.name.clone()] } else { words.antennas };
    let mut antennas: Vec<Antenna> = Vec::new();
    for (n, name) in names.iter().enumerate() {
        let antenna = AntennaId::new(name).map_err(|error| format!("{at}.antennas[{n}]: {error}"))?;
        if antennas.iter().any(|other| other.id == antenna) {
            return Err(format!(
                "{at}.antennas[{n}]: two antennas are called '{antenna}'; choose another name"
            ));
        }
        antennas.push(Antenna { id: antenna, station: id.clone(), switch_over_s: words.switch_over_s });
    }
    let section = StationSection {
        name: words.name,
        clock: ClockSetting::default(),
        latitude_deg: Some(words.latitude_deg),
        longitude_deg: Some(words.longitude_deg),
        height_m: words.height_m,
        min_elevation_deg: words.min_elevation_deg,
        horizon_deg: words.horizon_deg,
        dut1_s: words.dut1_s,
        licence: words.licence,
        blackouts: words.blackouts,
        switch_over_s: words.switch_over_s,
        call_sign: String::new(),
        licence_text: String::new(),
    };
    let told = |error: ConfigError| placed(error, at);
    let place = section.site().map_err(told)?.ok_or_else(|| format!("{at}: it has no place"))?;
    let times = section.times().map_err(told)?;
    let blackout = |(window, reason)| Blackout { scope: Scope::Station(id.clone()), window, reason };
    Ok(Ground {
        blackouts: times.blackouts.into_iter().map(blackout).collect(),
        site: mission::schedule::Site {
            station: id.clone(),
            health: words.unfit.map_or(Health::Fit, Health::Unfit),
            licence: times.licence,
        },
        antennas,
        place,
        id,
    })
}

/// What is wrong with a station's section, said of this station.
fn placed(error: ConfigError, at: &str) -> String {
    match error {
        ConfigError::Value { key, problem, remedy } => {
            let key = key.strip_prefix("station").unwrap_or(&key);
            format!("{at}{key}: {problem}. {remedy}")
        }
        other => other.to_string(),
    }
}

fn wanted(words: SatelliteWords, at: &str, stations: &[Ground]) -> Result<Wanted, String> {
    let id = SatelliteId::new(&words.name).map_err(|error| format!("{at}.name: {error}"))?;
    if !(1..=10).contains(&words.priority) {
        return Err(format!(
            "{at}.priority: must lie from 1 to 10, found {}; one step doubles the worth",
            words.priority
        ));
    }
    if !(words.worth > 0.0 && words.worth <= 1000.0) {
        return Err(format!("{at}.worth: must be above 0, 1000 at most, found {}; 1 is usual", words.worth));
    }
    if !(0.0..=90.0).contains(&words.min_max_elevation_deg) {
        let found = words.min_max_elevation_deg;
        return Err(format!("{at}.min_max_elevation_deg: must lie from 0 to 90 degrees, found {found}"));
    }
    let station = |(n, name): (usize, &String)| {
        let known = stations.iter().find(|ground| ground.id.as_str() == name);
        known.map(|ground| ground.id.clone()).ok_or_else(|| {
            let all: Vec<&str> = stations.iter().map(|ground| ground.id.as_str()).collect();
            format!("{at}.stations[{n}]: there is no station '{name}'; there is {}", all.join(", "))
        })
    };
    Ok(Wanted {
        elements: words.elements.unwrap_or_else(|| words.name.clone()),
        priority: words.priority,
        worth: words.worth,
        min_duration_s: words.min_duration_s.max(1),
        min_max_elevation_deg: words.min_max_elevation_deg,
        transmit: words.transmit,
        stations: words.stations.iter().enumerate().map(station).collect::<Result<_, _>>()?,
        id,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
        [[stations]]
        name = "roof"
        latitude_deg = 46.5
        longitude_deg = 6.6
        antennas = ["yagi", "dish"]
        [[satellites]]
        name = "one"
    "#;

    #[test]
    fn what_is_left_out_has_its_default() {
        let network = Network::of(GOOD).unwrap();
        assert_eq!(
            (network.stations[0].antennas.len(), network.stations[0].antennas[0].switch_over_s),
            (2, 30)
        );
        let one = &network.satellites[0];
        assert_eq!((one.elements.as_str(), one.priority, one.min_duration_s), ("one", 1, 60));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        for (found, instead, says) in [
            ("name = \"roof\"", "name = \"The Roof\"", "stations[0].name"),
            ("latitude_deg = 46.5", "latitude_deg = 96.5", "stations[0].latitude_deg"),
            ("latitude_deg = 46.5", "", "missing field `latitude_deg`"),
            ("latitude_deg", "lattitude_deg", "unknown field `lattitude_deg`"),
            ("\"dish\"", "\"yagi\"", "two antennas are called 'yagi'"),
            (
                "name = \"one\"",
                "name = \"one\"\npriority = 11",
                "satellites[0].priority: must lie from 1 to 10, found 11",
            ),
            ("name = \"one\"", "name = \"one\"\nworth = 0.0", "satellites[0].worth"),
            (
                "name = \"one\"",
                "name = \"one\"\nstations = [\"cellar\"]",
                "no station 'cellar'; there is roof",
            ),
            (
                "name = \"one\"",
                "name = \"one\"\n[[satellites]]\nname = \"one\"",
                "two satellites are called 'one'",
            ),
            ("[[satellites]]\n        name = \"one\"", "", "there are no satellites"),
            (
                "antennas",
                "blackouts = [{ start = \"2027-01-02T00:00:00Z\", stop = \"2027-01-01T00:00:00Z\" }]\nantennas",
                "stations[0].blackouts[0]: it ends before it begins",
            ),
        ] {
            assert!(GOOD.contains(found));
            let error = Network::of(&GOOD.replacen(found, instead, 1)).unwrap_err();
            assert!(error.contains(says), "{says}: {error}");
        }
    }
}
