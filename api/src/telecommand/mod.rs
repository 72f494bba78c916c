//! Every telecommand of the ICD to JSON and back.
//!
//! A telecommand is a name and arguments by name: `{"command": "GetImageChunk", "arguments": {"first": 0, "count": 8}}`.
//! Reading names **every** wrong field with its path (`arguments.slots[1].time`) and says what would be right. What is
//! read obeys the ICD; whether this satellite knows the packet is the engine's business.

mod definition;
mod read;
mod write;

use std::fmt;

use protocol::Telecommand;
use serde_json::{Map, Value};

pub use definition::{Argument, Critical, DEFINITIONS, Default, Definition, Kind};
pub use write::arguments;

/// The names of all telecommands, in the order of the ICD.
pub const NAMES: [&str; 23] = [
    "Ping",
    "GetImageInfo",
    "GetImageChunk",
    "Reset",
    "ExecuteTorqueProfile",
    "GetAdcsInfo",
    "CaptureImage",
    "SetDownlinkSchedule",
    "SetAdcsOmegaKill",
    "SetAdcsAttitude",
    "SetAdcsTarget",
    "SetAdcsAuto",
    "SetTimestamp",
    "SetTle",
    "GetImageRanges",
    "SetTransmitter",
    "SetMode",
    "UploadSchedule",
    "GetModeReport",
    "SetParameter",
    "UploadScript",
    "GetEvents",
    "UploadGuidance",
];

/// One argument that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArgumentError {
    /// Its path from the top of the request, e.g. `arguments.count`.
    pub field: String,
    /// What is wrong, and what would be right.
    pub message: String,
}

impl fmt::Display for ArgumentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.field, self.message)
    }
}

impl std::error::Error for ArgumentError {}

/// The telecommand of this name with these arguments.
///
/// # Errors
/// Every argument that is missing, unknown, of the wrong type or out of its range; never an empty list.
pub fn parse(name: &str, arguments: &Map<String, Value>) -> Result<Telecommand, Vec<ArgumentError>> {
    read::parse(name, arguments)
}

#[cfg(test)]
mod tests;
