//! What the host writes to configure the module.
//!
//! Registers are binary and understood by every firmware; AT commands came with the second generation. Commands are
//! sent without a line end first: older second-generation firmware refuses CR LF.

/// Write to flash and RAM.
pub const WRITE_SAVED: u8 = 0xC0;
/// Read; also the first byte of every binary answer.
pub const READ: u8 = 0xC1;
/// Write to RAM only: a power cycle or reset clears it.
pub const WRITE_VOLATILE: u8 = 0xC2;
/// First bytes of the software mode switch; the answer repeats them without the first.
pub const SWITCH_PREFIX: [u8; 5] = [0xC0, 0xC1, 0xC2, 0xC3, 0x02];

/// Operating modes, with their number in the software switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mode {
    /// M1 0, M0 0: UART and air are joined.
    Normal,
    /// M1 0, M0 1: wake on radio.
    Wor,
    /// M1 1, M0 0: configuration, the UART at 9600 8N1 whatever is stored.
    Configuration,
    /// M1 1, M0 1: deep sleep. Unconnected pins float here.
    Sleep,
}

impl Mode {
    /// Number in the software switch.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Normal => 0,
            Self::Wor => 1,
            Self::Configuration => 2,
            Self::Sleep => 3,
        }
    }

    /// Mode of a software switch number.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Normal),
            1 => Some(Self::Wor),
            2 => Some(Self::Configuration),
            3 => Some(Self::Sleep),
            _ => None,
        }
    }

    /// Mode of the pin levels.
    #[must_use]
    pub const fn from_pins(m0: bool, m1: bool) -> Self {
        match (m1, m0) {
            (false, false) => Self::Normal,
            (false, true) => Self::Wor,
            (true, false) => Self::Configuration,
            (true, true) => Self::Sleep,
        }
    }

    /// Pin levels (M0, M1) of the mode.
    #[must_use]
    pub const fn pins(self) -> (bool, bool) {
        match self {
            Self::Normal => (false, false),
            Self::Wor => (true, false),
            Self::Configuration => (false, true),
            Self::Sleep => (true, true),
        }
    }
}

/// Reads `len` registers from `address`.
#[must_use]
pub const fn read(address: u8, len: u8) -> [u8; 3] {
    [READ, address, len]
}

/// Writes registers from `address`, to flash if `save`. At most 255 bytes are taken.
#[must_use]
pub fn write(save: bool, address: u8, data: &[u8]) -> Vec<u8> {
    let len = u8::try_from(data.len()).unwrap_or(u8::MAX);
    let mut request = vec![if save { WRITE_SAVED } else { WRITE_VOLATILE }, address, len];
    request.extend_from_slice(&data[..usize::from(len)]);
    request
}

/// The software mode switch.
#[must_use]
pub const fn switch(mode: Mode) -> [u8; 6] {
    let [a, b, c, d, e] = SWITCH_PREFIX;
    [a, b, c, d, e, mode.code()]
}

/// `AT+<body>`, with or without CR LF.
#[must_use]
pub fn at(body: &str, crlf: bool) -> Vec<u8> {
    let mut request = Vec::with_capacity(body.len() + 5);
    request.extend_from_slice(b"AT+");
    request.extend_from_slice(body.as_bytes());
    if crlf {
        request.extend_from_slice(b"\r\n");
    }
    request
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_of_the_manual() {
        assert_eq!(read(0, 9), [0xC1, 0x00, 0x09]);
        assert_eq!(write(true, 5, &[0x19]), [0xC0, 0x05, 0x01, 0x19]);
        assert_eq!(write(false, 5, &[0x19]), [0xC2, 0x05, 0x01, 0x19]);
        assert_eq!(switch(Mode::Configuration), [0xC0, 0xC1, 0xC2, 0xC3, 0x02, 0x02]);
        assert_eq!(at("FWCODE=?", false), b"AT+FWCODE=?");
        assert_eq!(at("UAUX=1", true), b"AT+UAUX=1\r\n");
    }

    #[test]
    fn modes_and_pins_agree() {
        for mode in [Mode::Normal, Mode::Wor, Mode::Configuration, Mode::Sleep] {
            let (m0, m1) = mode.pins();
            assert_eq!(Mode::from_pins(m0, m1), mode);
            assert_eq!(Mode::from_code(mode.code()), Some(mode));
        }
        assert_eq!(Mode::Configuration.pins(), (false, true));
        assert_eq!(Mode::from_code(4), None);
    }
}
