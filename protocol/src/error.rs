//! What can be wrong with bytes, named after what it means for whoever receives them.

use thiserror::Error;

/// One run of bytes is not one intact downlink frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
pub enum FrameError {
    /// The run is neither a full frame nor as long as its header says.
    #[error("{found} bytes are not one frame")]
    Length {
        /// Bytes given.
        found: usize,
    },
    /// The run does not begin with the magic.
    #[error("the frame does not begin with its magic")]
    Magic,
    /// The checksum fails in both forms.
    #[error("the frame's checksum is wrong")]
    Crc,
}

/// A payload does not follow the ICD.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
pub enum PayloadError {
    /// The header claims more payload than a frame can hold.
    #[error("the header claims {found} bytes of payload, at most {max} fit")]
    HeaderLength {
        /// Bytes claimed.
        found: u16,
        /// The most that fits.
        max: u16,
    },
    /// The payload has not the length of its type.
    #[error("packet type {packet_type:#04x} has {expected} bytes of payload, found {found}")]
    Length {
        /// Type in the header.
        packet_type: u8,
        /// Bytes of payload found.
        found: usize,
        /// Bytes its type (and its count, if it has one) asks for.
        expected: usize,
    },
    /// A heartbeat of a length we do not know: keep it raw, never guess at it.
    #[error("unknown heartbeat layout ({found} bytes)")]
    HeartbeatLayout {
        /// Bytes of payload found.
        found: usize,
    },
    /// A boolean is neither 0 nor 1.
    #[error("the boolean at payload offset {offset} is {found}")]
    Bool {
        /// Offset in the payload.
        offset: u16,
        /// The byte found.
        found: u8,
    },
    /// A list is longer than the ICD allows.
    #[error("a list of {found} entries, at most {max} are allowed")]
    Count {
        /// Entries claimed.
        found: u8,
        /// The most allowed.
        max: u8,
    },
    /// An uplink number is NaN or infinite.
    #[error("{field} is not a finite number")]
    NotFinite {
        /// Name of the field.
        field: &'static str,
    },
    /// A number is outside its range.
    #[error("{field} is out of range")]
    Range {
        /// Name of the field.
        field: &'static str,
    },
    /// Times that must ascend do not.
    #[error("entry {entry} is not later than the one before it")]
    Order {
        /// Index of the entry, from 0.
        entry: u8,
    },
    /// Torque profile longer than allowed.
    #[error("the profile runs {total_ms} ms, at most {max_ms} ms are allowed")]
    Duration {
        /// Sum of the steps.
        total_ms: u64,
        /// The most allowed.
        max_ms: u64,
    },
    /// Text holds a byte outside printable ASCII.
    #[error("the byte at payload offset {offset} is not printable ASCII")]
    Text {
        /// Offset in the payload.
        offset: u16,
    },
    /// No telecommand has this type.
    #[error("no telecommand has type {packet_type:#04x}")]
    UnknownTelecommand {
        /// Type in the header.
        packet_type: u8,
    },
}

/// A sealed uplink does not open.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
pub enum OpenError {
    /// The GCM tag is wrong: another key, a forgery or damage. Never answered.
    #[error("the frame is not authentic under this key")]
    Authentication,
}

/// An authentic uplink whose plaintext does not match the checksum beside it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[error("the plaintext's checksum is {computed:08x}, the frame says {found:08x}")]
pub struct CrcMismatch {
    /// The frame's CRC field.
    pub found: u32,
    /// CRC of the plaintext.
    pub computed: u32,
}

/// Text that names nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
pub enum TextError {
    /// A key id is 8 hex digits.
    #[error("a key id is 8 hex digits")]
    KeyId,
    /// A TLE line has 69 printable ASCII characters.
    #[error("line {line} is not 69 printable ASCII characters")]
    TleLine {
        /// 1 or 2.
        line: u8,
    },
}
