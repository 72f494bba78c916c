//! `[[satellites]]`: whom we hear and command.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;

/// One satellite. The defaults are those of PixelSat I.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SatelliteSection {
    /// Name of the satellite: 1 to 32 of a-z, 0-9, `-`, `_`.
    pub name: String,
    /// File with the key that seals telecommands (`gs-server key new`); without it the satellite can be heard, not
    /// commanded.
    #[serde(default)]
    pub key_file: Option<PathBuf>,
    /// Address of the satellite's radio module. Default 0xDE69.
    #[serde(default = "default_address")]
    pub address: u16,
    /// Answers carry the tag of their request. Default true.
    #[serde(default = "yes")]
    pub tags: bool,
    /// It knows GetImageRanges. Default false.
    #[serde(default)]
    pub ranges: bool,
    /// How its uplink counter runs. Default `time`.
    #[serde(default)]
    pub counter: CounterSetting,
    /// Seconds between two heartbeats, 1 to 86,400. Default 60.
    #[serde(default = "default_heartbeat")]
    pub heartbeat_period_s: f64,
    /// Its catalogue number, 1 to 999999999: finds its sets among others.
    #[serde(default)]
    pub norad_cat_id: Option<u32>,
    /// Its name as element sets have it (OBJECT_NAME), for sets without a number or before there is one.
    #[serde(default)]
    pub object_name: Option<String>,
    /// What it is called elsewhere, e.g. `PixelSat-I` at TinyGS: a packet of which a receiver kept no bytes is taken for
    /// its own under one of these, its name or its numbers.
    #[serde(default)]
    pub aliases: Vec<String>,
    /// When it was launched, e.g. `2027-03-01T04:00:00Z`: nobody heard it before.
    #[serde(default)]
    pub launched_at: Option<String>,
    /// Limits on its values.
    #[serde(default)]
    pub limits: Vec<LimitSection>,
}

impl SatelliteSection {
    /// When it was launched; `None` when nobody said, or said it so that it is no time.
    pub fn launched_at(&self) -> Option<mission::UtcUs> {
        let at: jiff::Timestamp = self.launched_at.as_deref()?.parse().ok()?;
        Some(mission::UtcUs(at.as_microsecond()))
    }
}

const fn default_address() -> u16 {
    0xDE69
}

const fn default_heartbeat() -> f64 {
    60.0
}

const fn yes() -> bool {
    true
}

/// How the uplink counter runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CounterSetting {
    /// The greater of last + 1 and microseconds since 1970.
    #[default]
    Time,
    /// Last + 1.
    Sequence,
}

/// `[[satellites.limits]]`: limits on one value, in the five levels `watch`, `warning`, `distress`, `critical`, `severe`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitSection {
    /// The parameter, e.g. `heartbeat.temp`.
    pub parameter: String,
    /// Below these values it is at that level, in the parameter's unit.
    #[serde(default)]
    pub below: Thresholds,
    /// Above these values it is at that level, in the parameter's unit.
    #[serde(default)]
    pub above: Thresholds,
    /// How far the value must come back before a level is left, in the parameter's unit. Default 0.
    #[serde(default)]
    pub deadband: f64,
    /// How many samples in a row decide, at least 1. Default 1.
    #[serde(default = "one")]
    pub persistence: u16,
}

const fn one() -> u16 {
    1
}

/// Level name to value.
pub type Thresholds = BTreeMap<String, f64>;
