//! What happened.

use serde::{Deserialize, Serialize};

use crate::Time;

/// An event of the one durable sequence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EventView {
    /// Its place: rising, never used twice. Lists and the stream resume from it.
    pub sequence: i64,
    /// When it happened.
    pub at: Time,
    /// What happened, one of the fixed words (`frame-heard`, `command-stage`, `chunk-received`, ...).
    pub kind: String,
    /// `normal`, `watch`, `warning`, `distress`, `critical` or `severe`.
    pub level: String,
    /// Satellite, when it concerns one.
    pub satellite: Option<String>,
    /// Station.
    pub station: String,
    /// Link, when it concerns one.
    pub link: Option<String>,
    /// Key, when it concerns one.
    pub key: Option<String>,
    /// Frame that it is about.
    pub frame: Option<u64>,
    /// Command that it is about.
    pub command: Option<u64>,
    /// Image that it is about.
    pub image: Option<u64>,
    /// Download that it is about.
    pub download: Option<u64>,
    /// One sentence that stands alone.
    pub message: String,
}

/// A limit that has been judged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LimitView {
    /// Satellite.
    pub satellite: String,
    /// Parameter.
    pub parameter: String,
    /// The level now.
    pub level: String,
    /// Since when.
    pub since: Time,
    /// The value that decided it; `null` when invalid.
    pub value: Option<f64>,
}
