//! What an operator should read: the failing step and its remedy, typed.

use super::event::DriverState;

/// A finding about the module or its wiring. `Display` is a sentence with the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Diagnostic {
    /// Neither registers nor AT commands were answered in configuration mode.
    #[error(
        "identify: the module answers nothing in configuration mode. Check that TXD and RXD are crossed, that M0 and \
         M1 reach the adapter with the right polarity, that the supply gives 5 V, and that nothing pulled AUX low at \
         power-up; then cycle the power"
    )]
    NoAnswer,
    /// Only our own bytes came back.
    #[error(
        "identify: only our own bytes come back. TXD and RXD are joined, or the adapter echoes; check the wiring of \
         the module's TXD"
    )]
    EchoOnly,
    /// Bytes came that were no answer.
    #[error(
        "identify: {bytes} bytes came back but no answer among them. The port is not at 9600 baud, the level is not \
         3.3 V, or the module is not in configuration mode (M1 high, M0 low)"
    )]
    Garbled {
        /// How many bytes.
        bytes: usize,
    },
    /// AT commands are answered, registers are not.
    #[error(
        "identify: AT commands are answered but registers are not; hold configuration mode and cycle the power"
    )]
    RegistersSilent,
    /// The module belongs to a family with another register map.
    #[error("identify: {device_type} is not an E22; it has other registers and was left untouched")]
    OtherFamily {
        /// Text of `DEVTYPE`.
        device_type: String,
    },
    /// Software switching was asked for and not answered.
    #[error(
        "configuration mode: the software switch is not answered; the module is used as it is. Set REG1 bit 2 once \
         with M0 and M1 wired (radio configure), or say mode_pins = \"strapped\""
    )]
    SoftwareSwitchSilent,
    /// The module did not go back to normal mode.
    #[error("normal mode: the switch back is not answered; cycle the module's power")]
    StuckInConfiguration,
    /// A register reads back otherwise than written.
    #[error(
        "configure: module refused register {register:#04x}: wanted {wanted:#04x}, it holds {found:#04x}{}",
        if *.register == 3 { " (second-generation firmware turns air rates 0 and 1 into 2)" } else { "" }
    )]
    Refused {
        /// Address of the register.
        register: u8,
        /// What was written.
        wanted: u8,
        /// What it reads.
        found: u8,
    },
    /// A register write was not acknowledged.
    #[error("configure: the register write was not acknowledged; the read-back decides")]
    WriteUnanswered,
    /// The read-back failed.
    #[error("verify: registers could not be read back; nothing is sent until they can")]
    ReadBackFailed,
    /// The carrier is not where it shall be, or this cannot be known.
    #[error(
        "frequency: {wanted_hz} Hz is not verified{}. Nothing is sent unless transmit_unverified is set; see docs/radio.md",
        .found_hz.map(|hz| format!(", the module says {hz} Hz")).unwrap_or_default()
    )]
    FrequencyUnverified {
        /// What the configuration asks for.
        wanted_hz: u32,
        /// What the module tells, if anything.
        found_hz: Option<u32>,
    },
    /// AUX does not become idle.
    #[error(
        "AUX stays low during {during:?}: it is stuck or miswired (is CTS used, is there a pull-down?). Going on with \
         computed waits"
    )]
    AuxStuckLow {
        /// When.
        during: DriverState,
    },
    /// AUX did not move though it had.
    #[error(
        "AUX did not go low for a transmission: the wire is loose or the module hangs. It is being reset"
    )]
    AuxSilent,
    /// AUX changes too often to mean anything.
    #[error("AUX chatters: an unconnected input picks up noise. Going on with computed waits")]
    AuxChatter,
    /// The module does not show transmissions on AUX.
    #[error("AUX does not follow the radio (UAUX refused): the end of a transmission is computed")]
    UauxRefused,
    /// What is written comes back.
    #[error("the adapter echoes what is written; echoes are removed")]
    Echo,
    /// The configuration itself cannot be used.
    #[error("configuration: {0}")]
    Configuration(super::config::ConfigError),
}
