//! What the driver is told once, at its making.

use crate::airtime::LinkTiming;
use crate::registers::PowerStep;

/// How the module's mode pins M0 and M1 are driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ModePins {
    /// Two output lines of the adapter, M0 from DTR and M1 from RTS unless the shell maps them otherwise.
    Lines {
        /// The lines pass through an inverter (a transistor): [`DriverOutput::SetPins`] carries the complement.
        ///
        /// [`DriverOutput::SetPins`]: crate::driver::DriverOutput::SetPins
        inverted: bool,
    },
    /// Pins tied to normal mode; modes change by a command on the data UART. Needs second-generation firmware with
    /// REG1 bit 2 set.
    Software,
    /// Pins tied to normal mode and no command may be sent: the module is used as it is.
    Strapped,
}

/// Whether the module's AUX pin reaches an input of the adapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AuxWiring {
    /// The shell reports the level by [`DriverInput::Aux`](crate::driver::DriverInput::Aux).
    Present,
    /// Not wired: the driver waits by computed times.
    Absent,
}

/// Settings of one module. [`DriverConfig::default`] is the mission's block at the lowest power.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriverConfig {
    /// The ground module's own address.
    pub address: u16,
    /// Network number, shared with the satellite.
    pub net_id: u8,
    /// Channel 0..=83, shared with the satellite; also the third byte of each fixed-point header.
    pub channel: u8,
    /// Carrier frequency in hertz that must be proved before anything is sent.
    pub frequency_hz: u32,
    /// Transmit power; the lowest step unless told otherwise.
    pub power: PowerStep,
    /// Air rate code of REG0 (2 is "2.4k").
    pub air_rate: u8,
    /// RSSI byte after each received packet: on, off, or (None) as the module has it.
    pub rssi_byte: Option<bool>,
    /// Modes may be changed by a command on the data UART (REG1 bit 2): on, off, or (None) as `mode_pins` needs it.
    /// Turned on once with the lines wired, it lets a module be used with [`ModePins::Software`] later.
    pub software_switch: Option<bool>,
    /// How the mode pins are driven.
    pub mode_pins: ModePins,
    /// Whether AUX is wired.
    pub aux: AuxWiring,
    /// Send even though the frequency or the configuration could not be verified.
    pub transmit_unverified: bool,
    /// Write registers to flash (`C0`) rather than to RAM (`C2`), which a power cycle clears.
    pub save_to_flash: bool,
    /// Write the block even if it reads as wanted: the only way to be sure of the key, which cannot be read.
    pub always_write: bool,
    /// UART and air timing. The baud must be 9600 unless the pins are [`ModePins::Strapped`].
    pub timing: LinkTiming,
}

impl Default for DriverConfig {
    fn default() -> Self {
        Self {
            address: 0xDE70,
            net_id: 0,
            channel: 0x19,
            frequency_hz: 435_000_000,
            power: PowerStep::Dbm21,
            air_rate: 2,
            rssi_byte: None,
            software_switch: None,
            mode_pins: ModePins::Lines { inverted: false },
            aux: AuxWiring::Present,
            transmit_unverified: false,
            save_to_flash: false,
            always_write: false,
            timing: LinkTiming::default(),
        }
    }
}

/// Why a configuration cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// The module has channels 0..=83.
    #[error("channel {found} does not exist: the module has 0 to 83")]
    Channel {
        /// What was asked for.
        found: u8,
    },
    /// Outside the module's tuning range.
    #[error("frequency {found_hz} Hz is outside the module's range of 410.125 to 493.125 MHz")]
    Frequency {
        /// What was asked for.
        found_hz: u32,
    },
    /// The register holds three bits.
    #[error("air rate code {found} does not exist: the module has 0 to 7")]
    AirRate {
        /// What was asked for.
        found: u8,
    },
    /// Configuration mode is fixed at 9600 baud, and the port is not reopened for it.
    #[error("baud {found} needs mode_pins = \"strapped\": a module that is configured here runs at 9600")]
    Baud {
        /// What was asked for.
        found: u32,
    },
}

impl DriverConfig {
    /// Checks ranges.
    ///
    /// # Errors
    /// The first setting that the module cannot have.
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.channel > 83 {
            return Err(ConfigError::Channel { found: self.channel });
        }
        if !(410_125_000..=493_125_000).contains(&self.frequency_hz) {
            return Err(ConfigError::Frequency { found_hz: self.frequency_hz });
        }
        if self.air_rate > 7 {
            return Err(ConfigError::AirRate { found: self.air_rate });
        }
        if self.timing.baud != 9600 && self.mode_pins != ModePins::Strapped {
            return Err(ConfigError::Baud { found: self.timing.baud });
        }
        Ok(())
    }
}
