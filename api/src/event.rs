//! What happened.

use serde::{Deserialize, Serialize};

use crate::Time;

/// An event of the one durable sequence.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
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

/// Who did what: one line of the audit, which is never changed or shortened.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AuditView {
    /// Its place, rising.
    pub id: u64,
    /// Station.
    pub station: String,
    /// When.
    pub at: Time,
    /// Who.
    pub who: String,
    /// A verb, e.g. `command.create`.
    pub action: String,
    /// What it was about, without secrets.
    pub detail: String,
}

/// A limit that has been judged.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LimitView {
    /// Satellite.
    pub satellite: String,
    /// The station that judged it.
    pub station: String,
    /// Parameter.
    pub parameter: String,
    /// The level now.
    pub level: String,
    /// Since when.
    pub since: Time,
    /// The value that decided it; `null` when invalid.
    pub value: Option<f64>,
}
