//! From the file's words to what the engine and the radio driver take.

use std::collections::BTreeMap;

use mission::{
    CounterRule, LimitRule, LinkConfig, LinkId, Profile, SatelliteConfig, SatelliteId, StationConfig,
    StationId,
};
use protocol::Key;
use radio::airtime::{LinkTiming, LoraPhy};
use radio::driver::{AuxWiring, DriverConfig, ModePins};
use radio::registers::PowerStep;

use super::links::{AuxInput, LinkKind, LinkSection, ModePinWiring, Phy};
use super::satellites::{CounterSetting, LimitSection, SatelliteSection};
use super::{Config, ConfigError};

/// What the engine must know. `keys` holds the key of each satellite that has one, by its name.
///
/// # Errors
/// [`ConfigError`] for names that are none; not after [`Config::check`].
pub fn station_config(config: &Config, keys: &BTreeMap<String, Key>) -> Result<StationConfig, ConfigError> {
    let bad = |key: &str, error: mission::id::NameError| {
        ConfigError::value(key, error.to_string(), "Choose another name.")
    };
    let satellites = config
        .satellites
        .iter()
        .map(|satellite| {
            Ok(SatelliteConfig {
                id: SatelliteId::new(&satellite.name).map_err(|e| bad("satellites.name", e))?,
                profile: profile(config, satellite),
                key: keys.get(&satellite.name).cloned(),
                limits: satellite.limits.iter().map(limit_rule).collect(),
            })
        })
        .collect::<Result<_, ConfigError>>()?;
    let links = config
        .links
        .iter()
        .map(|link| {
            Ok(LinkConfig {
                id: LinkId::new(&link.name).map_err(|e| bad("links.name", e))?,
                satellite: SatelliteId::new(&link.satellite).map_err(|e| bad("links.satellite", e))?,
                timing: timing(link),
                armed: link.armed,
                receive_only: link.kind == LinkKind::Replay,
            })
        })
        .collect::<Result<_, ConfigError>>()?;
    Ok(StationConfig {
        station: StationId::new(&config.station.name).map_err(|e| bad("station.name", e))?,
        satellites,
        links,
        site: config.station.site()?,
        times: config.station.times()?,
    })
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked: 1 to 86,400 seconds")]
fn profile(config: &Config, satellite: &SatelliteSection) -> Profile {
    let rssi =
        config.links.iter().find(|l| l.satellite == satellite.name).and_then(|l| l.rssi).unwrap_or(true);
    Profile {
        address: satellite.address,
        tags: satellite.tags,
        ranges: satellite.ranges,
        counter: match satellite.counter {
            CounterSetting::Time => CounterRule::Time,
            CounterSetting::Sequence => CounterRule::Sequence,
        },
        heartbeat_period_us: (satellite.heartbeat_period_s * 1e6) as u64,
        rssi,
    }
}

fn limit_rule(limit: &LimitSection) -> LimitRule {
    // Words that are no level were refused by the check.
    let levels = |thresholds: &BTreeMap<String, f64>| {
        thresholds.iter().filter_map(|(level, value)| Some((level.parse().ok()?, *value))).collect()
    };
    LimitRule {
        parameter: limit.parameter.clone(),
        below: levels(&limit.below),
        above: levels(&limit.above),
        deadband: limit.deadband,
        persistence: limit.persistence,
    }
}

fn timing(link: &LinkSection) -> LinkTiming {
    LinkTiming {
        phy: match link.phy {
            Phy::Sf11Bw500 => LoraPhy::LIKELY_2K4,
            Phy::Sf9Bw125 => LoraPhy::OTHER_2K4,
        },
        baud: link.baud,
        turn_round_us: u64::from(link.turn_round_ms) * 1000,
    }
}

/// What the radio driver of a serial or TCP link must know.
pub fn driver_config(link: &LinkSection) -> DriverConfig {
    DriverConfig {
        address: link.address,
        net_id: link.net_id,
        channel: link.channel,
        frequency_hz: link.frequency_hz,
        power: PowerStep::from_dbm(link.power_dbm).unwrap_or(PowerStep::Dbm21),
        // The frame decoder is told once whether the byte comes, so the module must do as it was told.
        rssi_byte: Some(link.rssi.unwrap_or(true)),
        mode_pins: match link.mode_pins() {
            ModePinWiring::Lines => ModePins::Lines { inverted: false },
            ModePinWiring::LinesInverted => ModePins::Lines { inverted: true },
            ModePinWiring::Software => ModePins::Software,
            ModePinWiring::Strapped => ModePins::Strapped,
        },
        aux: match link.aux() {
            AuxInput::Absent => AuxWiring::Absent,
            AuxInput::Cts | AuxInput::Dsr | AuxInput::Dcd | AuxInput::Ri => AuxWiring::Present,
        },
        transmit_unverified: link.transmit_unverified,
        save_to_flash: link.save_to_flash,
        timing: timing(link),
        ..DriverConfig::default()
    }
}
