//! What a module holds, beside what it shall hold.

use radio::driver::{DriverConfig, Generation, ModePins, ModuleFacts};
use radio::registers::{PowerStep, Registers};
use serde::Serialize;

use super::{Aux, Failure, Pins, Rssi, Settings, Wiring};
use crate::config::{LinkSection, driver_config};

/// One setting that is not as wanted.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Difference {
    /// Which.
    pub(super) setting: &'static str,
    /// As it is.
    pub(super) held: String,
    /// As it shall be.
    pub(super) wanted: String,
}

/// What is known of a module.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Module {
    pub(super) port: String,
    pub(super) answered: bool,
    pub(super) generation: &'static str,
    pub(super) firmware: Option<String>,
    pub(super) device_type: Option<String>,
    /// Registers 00 to 06, in hex.
    pub(super) registers: Option<String>,
    pub(super) address: Option<String>,
    pub(super) net_id: Option<u8>,
    pub(super) baud: Option<u32>,
    pub(super) air_rate: Option<u8>,
    pub(super) sub_packet_bytes: Option<usize>,
    pub(super) power_dbm: Option<u8>,
    pub(super) channel: Option<u8>,
    pub(super) rssi_byte: Option<bool>,
    pub(super) fixed_point: Option<bool>,
    pub(super) software_switch: Option<bool>,
    pub(super) frequency_hz: Option<u32>,
    pub(super) frequency_verified: bool,
    pub(super) configuration_verified: bool,
    pub(super) aux_seen_moving: bool,
    pub(super) echo: bool,
    pub(super) differences: Vec<Difference>,
    pub(super) findings: Vec<String>,
}

impl Module {
    pub(super) fn new(port: &str, facts: &ModuleFacts, wanted: &DriverConfig, findings: Vec<String>) -> Self {
        let held = facts.registers;
        Self {
            port: port.to_owned(),
            answered: held.is_some(),
            generation: match facts.generation {
                Generation::Unknown => "unknown",
                Generation::V1 => "v1",
                Generation::V2_1 => "v2.1",
                Generation::V2_2 => "v2.2",
                Generation::OtherV2 => "v2, another code",
            },
            firmware: facts.firmware.clone(),
            device_type: facts.device_type.clone(),
            registers: held.map(|held| hex::encode(held.0)),
            address: held.map(|held| format!("{:#06x}", held.address())),
            net_id: held.map(Registers::net_id),
            baud: held.map(Registers::baud),
            air_rate: held.map(Registers::air_rate),
            sub_packet_bytes: held.map(Registers::sub_packet_bytes),
            power_dbm: held.map(|held| held.power().dbm()),
            channel: held.map(Registers::channel),
            rssi_byte: held.map(Registers::rssi_byte),
            fixed_point: held.map(Registers::fixed_point),
            software_switch: held.map(Registers::software_switch),
            frequency_hz: facts.frequency_hz,
            frequency_verified: facts.frequency_verified,
            configuration_verified: facts.configuration_verified,
            aux_seen_moving: facts.aux_trusted,
            echo: facts.echo,
            differences: differences(facts, wanted),
            findings,
        }
    }

    /// As a person reads it.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!("port          {}", self.port)];
        if !self.answered {
            lines.push("module        does not answer".to_owned());
            return lines;
        }
        let text = |text: &Option<String>| text.clone().unwrap_or_else(|| "not told".to_owned());
        lines.push(format!(
            "module        {} (firmware {}, {})",
            text(&self.device_type),
            text(&self.firmware),
            self.generation
        ));
        lines.push(format!("registers     {}", text(&self.registers)));
        lines.push(format!(
            "addresses     own {}, network {}",
            text(&self.address),
            self.net_id.unwrap_or_default()
        ));
        lines.push(format!(
            "air           channel {}, {}, rate code {}, {} dBm, sub-packet {} bytes",
            self.channel.unwrap_or_default(),
            match self.frequency_hz {
                Some(hz) => format!("{:.3} MHz", f64::from(hz) / 1e6),
                None => "frequency not told".to_owned(),
            },
            self.air_rate.unwrap_or_default(),
            self.power_dbm.unwrap_or_default(),
            self.sub_packet_bytes.unwrap_or_default(),
        ));
        lines.push(format!(
            "host          {} baud, fixed point {}, RSSI byte {}, software switch {}",
            self.baud.unwrap_or_default(),
            on(self.fixed_point),
            on(self.rssi_byte),
            on(self.software_switch),
        ));
        lines.push(format!(
            "AUX           {}",
            if self.aux_seen_moving { "seen moving" } else { "not seen moving: waits are computed" }
        ));
        for difference in &self.differences {
            lines.push(format!(
                "differs       {}: is {}, shall be {}",
                difference.setting, difference.held, difference.wanted
            ));
        }
        if self.differences.is_empty() {
            lines.push("verdict       as wanted".to_owned());
        }
        lines
    }
}

fn on(state: Option<bool>) -> &'static str {
    match state {
        Some(true) => "on",
        Some(false) => "off",
        None => "not told",
    }
}

fn differences(facts: &ModuleFacts, wanted: &DriverConfig) -> Vec<Difference> {
    let Some(held) = facts.registers else { return Vec::new() };
    let mut found = Vec::new();
    let mut compare = |setting, held: String, wanted: String| {
        if held != wanted {
            found.push(Difference { setting, held, wanted });
        }
    };
    compare("address", format!("{:#06x}", held.address()), format!("{:#06x}", wanted.address));
    compare("network number", held.net_id().to_string(), wanted.net_id.to_string());
    compare("baud", held.baud().to_string(), "9600".to_owned());
    compare("air rate code", held.air_rate().to_string(), wanted.air_rate.to_string());
    compare("sub-packet", format!("{} bytes", held.sub_packet_bytes()), "240 bytes".to_owned());
    compare("power", format!("{} dBm", held.power().dbm()), format!("{} dBm", wanted.power.dbm()));
    compare("channel", held.channel().to_string(), wanted.channel.to_string());
    compare("fixed point", on(Some(held.fixed_point())).to_owned(), "on".to_owned());
    let rssi = wanted.rssi_byte.unwrap_or(held.rssi_byte());
    compare("RSSI byte", on(Some(held.rssi_byte())).to_owned(), on(Some(rssi)).to_owned());
    let switch = wanted.software_switch.unwrap_or(wanted.mode_pins == ModePins::Software);
    compare("software switch", on(Some(held.software_switch())).to_owned(), on(Some(switch)).to_owned());
    let frequency = facts.frequency_hz.map_or_else(|| "not told".to_owned(), |hz| format!("{hz} Hz"));
    compare("frequency", frequency, format!("{} Hz", wanted.frequency_hz));
    found
}

/// A number in decimal or after `0x` in hex.
pub(super) fn number(text: &str) -> Result<u16, String> {
    let parsed = match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(hex) => u16::from_str_radix(hex, 16),
        None => text.parse(),
    };
    parsed.map_err(|_| "0 to 65535, or 0x0000 to 0xFFFF".to_owned())
}

impl Wiring {
    /// As a link's section of a configuration, so that port and driver are set up as the server does it.
    pub(super) fn section(&self) -> Result<LinkSection, Failure> {
        let mut table = toml::Table::new();
        let mut put = |key: &str, value: toml::Value| {
            table.insert(key.to_owned(), value);
        };
        put("name", "radio".into());
        put("satellite", "any".into());
        put("kind", "serial".into());
        put("port", self.port.clone().into());
        put("baud", i64::from(self.baud).into());
        put(
            "mode_pins",
            match self.mode_pins {
                Pins::Lines => "lines",
                Pins::LinesInverted => "lines-inverted",
                Pins::Software => "software",
                Pins::Strapped => "strapped",
            }
            .into(),
        );
        put(
            "aux",
            match self.aux {
                Aux::Cts => "cts",
                Aux::Dsr => "dsr",
                Aux::Dcd => "dcd",
                Aux::Ri => "ri",
                Aux::Absent => "absent",
            }
            .into(),
        );
        put("aux_inverted", self.aux_inverted.into());
        table.try_into().map_err(Failure::usage)
    }
}

impl Settings {
    /// What the driver shall bring about.
    pub(super) fn driver_config(&self, section: &LinkSection) -> Result<DriverConfig, Failure> {
        let power = PowerStep::from_dbm(self.power_dbm)
            .ok_or_else(|| Failure::usage("--power-dbm: the module has 21, 24, 27 and 30"))?;
        let config = DriverConfig {
            address: self.address,
            net_id: self.net_id,
            channel: self.channel,
            frequency_hz: self.frequency_hz,
            power,
            rssi_byte: match self.rssi {
                Rssi::On => Some(true),
                Rssi::Off => Some(false),
                Rssi::Keep => None,
            },
            ..driver_config(section)
        };
        config.check().map_err(Failure::usage)?;
        Ok(config)
    }
}
