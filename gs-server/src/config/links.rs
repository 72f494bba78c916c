//! `[[links]]`: the ways to our radios.

use std::path::PathBuf;

use serde::Deserialize;

/// One link. Which of `port`, `usb`, `address_tcp` and `file` it needs follows from its kind.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkSection {
    /// Name of the link: 1 to 32 of a-z, 0-9, `-`, `_`.
    pub name: String,
    /// Whom it hears and reaches.
    pub satellite: String,
    /// What it is.
    pub kind: LinkKind,
    /// `serial`: the port, e.g. `/dev/ttyUSB0`, or the link that a twin made.
    #[serde(default)]
    pub port: Option<String>,
    /// `serial`: the adapter itself, wherever it is plugged in. Goes before `port`.
    #[serde(default)]
    pub usb: Option<UsbId>,
    /// `tcp`: host and port of a twin or a serial server.
    #[serde(default)]
    pub connect: Option<String>,
    /// `replay`: a file of raw bytes, or of hex digits in lines.
    #[serde(default)]
    pub file: Option<PathBuf>,
    /// The far end is simulated: only simulated keys, folders and clocks go with it. Default false.
    #[serde(default)]
    pub simulated: bool,
    /// May transmit from the start; otherwise an operator arms it. Default false.
    #[serde(default)]
    pub armed: bool,
    /// Baud rate. Default 9600, which a module that is configured here must have.
    #[serde(default = "default_baud")]
    pub baud: u32,
    /// How M0 and M1 are driven. Default `lines` for serial, `strapped` for tcp.
    #[serde(default)]
    pub mode_pins: Option<ModePinWiring>,
    /// Where AUX arrives. Default `cts` for serial, `absent` for tcp.
    #[serde(default)]
    pub aux: Option<AuxInput>,
    /// AUX passes an inverter. Default false.
    #[serde(default)]
    pub aux_inverted: bool,
    /// Transmit although the module's frequency or configuration could not be verified. Default false.
    #[serde(default)]
    pub transmit_unverified: bool,
    /// Write the module's configuration to its flash rather than its RAM. Default false.
    #[serde(default)]
    pub save_to_flash: bool,
    /// Address of the ground's own module. Default 0xDE70.
    #[serde(default = "default_address")]
    pub address: u16,
    /// Network number of the modules. Default 0.
    #[serde(default)]
    pub net_id: u8,
    /// Channel, 0 to 83. Default 25.
    #[serde(default = "default_channel")]
    pub channel: u8,
    /// Carrier frequency in hertz that must be proved before anything is sent. Default 435,000,000.
    #[serde(default = "default_frequency")]
    pub frequency_hz: u32,
    /// Transmit power in dBm: 21, 24, 27 or 30. Default 21.
    #[serde(default = "default_power")]
    pub power_dbm: u8,
    /// The module appends an RSSI byte to each packet: yes, no; default as the module is set. A strapped module cannot
    /// be asked: then it means true unless said otherwise.
    #[serde(default)]
    pub rssi: Option<bool>,
    /// What is on the air, for computing times. Default `sf11-bw500`.
    #[serde(default)]
    pub phy: Phy,
    /// Milliseconds that the far end may take from hearing a request to starting its answer. Default 500.
    #[serde(default = "default_turn_round")]
    pub turn_round_ms: u32,
}

const fn default_baud() -> u32 {
    9600
}
const fn default_address() -> u16 {
    0xDE70
}
const fn default_channel() -> u8 {
    25
}
const fn default_frequency() -> u32 {
    435_000_000
}
const fn default_power() -> u8 {
    21
}
const fn default_turn_round() -> u32 {
    500
}

/// What a link is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkKind {
    /// A radio module on a serial port (or a pseudo-terminal).
    Serial,
    /// The same behind a TCP connection: a twin, or a serial server in raw mode.
    Tcp,
    /// A file that is heard once, from beginning to end. Never transmits.
    Replay,
}

/// A USB adapter.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UsbId {
    /// Vendor, e.g. 0x0403.
    pub vid: u16,
    /// Product, e.g. 0x6001.
    pub pid: u16,
    /// Serial number; any when left out.
    #[serde(default)]
    pub serial_number: Option<String>,
}

/// How the module's mode pins are driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModePinWiring {
    /// M0 on DTR, M1 on RTS.
    Lines,
    /// The same through inverters.
    LinesInverted,
    /// Tied to normal mode; modes change by a command on the data line.
    Software,
    /// Tied to normal mode; the module is used as it is, and nothing is configured or verified.
    Strapped,
}

/// Where the module's AUX arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AuxInput {
    /// Clear to send.
    Cts,
    /// Data set ready.
    Dsr,
    /// Data carrier detect.
    Dcd,
    /// Ring indicator.
    Ri,
    /// Not wired.
    Absent,
}

/// What is on the air.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
pub enum Phy {
    /// Spreading factor 11 at 500 kHz: the likelier reading of the module's "2.4k".
    #[default]
    #[serde(rename = "sf11-bw500")]
    Sf11Bw500,
    /// Spreading factor 9 at 125 kHz: the other reading.
    #[serde(rename = "sf9-bw125")]
    Sf9Bw125,
}

impl LinkSection {
    /// How the mode pins are driven, default applied.
    pub fn mode_pins(&self) -> ModePinWiring {
        self.mode_pins.unwrap_or(match self.kind {
            LinkKind::Serial => ModePinWiring::Lines,
            LinkKind::Tcp | LinkKind::Replay => ModePinWiring::Strapped,
        })
    }

    /// Where AUX arrives, default applied.
    pub fn aux(&self) -> AuxInput {
        self.aux.unwrap_or(match self.kind {
            LinkKind::Serial => AuxInput::Cts,
            LinkKind::Tcp | LinkKind::Replay => AuxInput::Absent,
        })
    }

    /// The far end in words, for the log.
    pub fn far_end(&self) -> String {
        match self.kind {
            LinkKind::Serial => match (&self.usb, &self.port) {
                (Some(usb), _) => format!(
                    "USB adapter {:04x}:{:04x}{}",
                    usb.vid,
                    usb.pid,
                    usb.serial_number.as_ref().map(|s| format!(" serial {s}")).unwrap_or_default()
                ),
                (None, port) => port.clone().unwrap_or_default(),
            },
            LinkKind::Tcp => self.connect.clone().unwrap_or_default(),
            LinkKind::Replay => self.file.as_ref().map(|f| f.display().to_string()).unwrap_or_default(),
        }
    }
}
