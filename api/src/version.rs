//! The handshake.

use serde::{Deserialize, Serialize};

use crate::Time;

/// Who is there and what it can.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Version {
    /// Name of the server, `gs-server`.
    pub server: String,
    /// Version of the server, as in its package.
    pub version: String,
    /// Version of the API: [`crate::API_VERSION`].
    pub api: u32,
    /// What it can, see [`crate::CAPABILITIES`].
    pub capabilities: Vec<String>,
    /// Version of the rules by which values are derived from raw frames.
    pub decoder: u32,
    /// Station.
    pub station: String,
    /// Time, satellite or radio are made up.
    pub simulated: bool,
}

/// Whether the server lives, and whether it can do its work.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// The process answers; always true in an answer.
    pub live: bool,
    /// Frames are stored. False comes with status 503.
    pub ready: bool,
    /// Why it is not ready, as sentences.
    pub reasons: Vec<String>,
    /// The station's time.
    pub at: Time,
}
