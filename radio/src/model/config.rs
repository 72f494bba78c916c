//! What kind of module the model is, and what is wrong with it.

use crate::airtime::LoraPhy;
use crate::registers::{PowerStep, Registers};

/// Firmware generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Firmware {
    /// Registers only; air rates 0 and 1 exist; AUX covers the airtime.
    V1,
    /// `7364-0-10`: AT commands, 500 ms to boot.
    V2_1,
    /// `7453-0-21`: AT commands, 16 ms to boot, AUX covers the airtime only with `UAUX`.
    #[default]
    V2_2,
}

/// Faults and peculiarities; the default is a sound module.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Quirks {
    /// Bytes that come before each reply in configuration mode.
    pub junk_prefix: Vec<u8>,
    /// The RSSI byte is missing though REG3 asks for it.
    pub missing_rssi_byte: bool,
    /// AUX stands at this level (true = idle) whatever happens.
    pub aux_stuck: Option<bool>,
    /// AUX flips with this period on top of its meaning.
    pub aux_chatter_us: Option<u64>,
    /// Output of a received packet pauses 30 ms in its middle.
    pub split_frames: bool,
    /// A write pauses 20 ms after this many bytes on its way to the module: a USB adapter that was scheduled badly.
    pub split_writes_after: Option<usize>,
    /// AT commands that end in CR LF are answered with an error (firmware before 7453-0-21).
    pub rejects_crlf: bool,
    /// AT commands are answered only if they end in CR LF.
    pub wants_crlf: bool,
    /// AT replies end without CR LF.
    pub no_newline: bool,
    /// Air rates 0 and 1 become 2 also on first-generation firmware (the second always does it).
    pub rate_clamp: bool,
    /// The self test after power-up or reset takes this long instead of the firmware's time.
    pub slow_boot_us: Option<u64>,
    /// What the host writes comes back to it.
    pub echo: bool,
    /// Nothing is ever answered or radiated or heard.
    pub mute: bool,
    /// Configuration is never answered, data passes.
    pub no_configuration: bool,
    /// The three header bytes count towards the sub-packet: 3 + 240 bytes leave as two packets.
    pub header_counts_towards_subpacket: bool,
    /// AT commands are never answered, registers are: a module that is late.
    pub silent_at: bool,
    /// `AT+UFREQ` is unknown.
    pub no_ufreq: bool,
    /// `AT+UAUX` is unknown.
    pub no_uaux: bool,
    /// `DEVTYPE` answers this instead.
    pub device_type: Option<String>,
    /// The module stops working (as [`Quirks::mute`], AUX low) at the start of its n-th transmission, until reset.
    pub hangs_at_transmission: Option<u32>,
}

/// What the model is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelConfig {
    /// Firmware generation.
    pub firmware: Firmware,
    /// What is wrong with it.
    pub quirks: Quirks,
    /// Modem parameters behind the air rate.
    pub phy: LoraPhy,
    /// Registers in flash at power-up.
    pub registers: Registers,
    /// `AT+UFREQ` in flash: carrier = start + step * channel, if set.
    pub ufreq: Option<Ufreq>,
    /// Baud rate of the host's port. Bytes at another rate than the module's are garbage.
    pub host_baud: u32,
    /// Levels of (M0, M1) at power-up; (false, false) is normal mode.
    pub pins: (bool, bool),
}

impl Default for ModelConfig {
    /// A sound V2.2 module with factory registers, pins at normal mode.
    fn default() -> Self {
        Self {
            firmware: Firmware::V2_2,
            quirks: Quirks::default(),
            phy: LoraPhy::LIKELY_2K4,
            registers: Registers::FACTORY,
            ufreq: None,
            host_baud: 9600,
            pins: (false, false),
        }
    }
}

impl ModelConfig {
    /// A module prepared for a link without mode lines (`mode_pins = "software"` or `"strapped"`): address 0xDE70,
    /// channel 0x19, fixed point, RSSI byte as given, the software switch on, 435.000 MHz.
    #[must_use]
    pub fn prepared(rssi_byte: bool) -> Self {
        Self {
            registers: Registers::FACTORY
                .with_address(0xDE70)
                .with_channel(0x19)
                .with_fixed_point(true)
                .with_rssi_byte(rssi_byte)
                .with_software_switch(true)
                .with_power(PowerStep::Dbm21),
            ufreq: Some(Ufreq { start_hz: 410_000_000, step_hz: 1_000_000, last_channel: 83 }),
            ..Self::default()
        }
    }
}

/// A frequency grid set with `AT+UFREQ=1,start,step,last`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ufreq {
    /// Carrier of channel 0, hertz.
    pub start_hz: u32,
    /// Spacing of channels, hertz.
    pub step_hz: u32,
    /// Highest channel.
    pub last_channel: u8,
}
