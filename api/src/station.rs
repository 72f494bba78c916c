//! How the station is right now.

use serde::{Deserialize, Serialize};

use crate::{AntennaView, Time};

/// The station now. A view, not a record: it is not kept.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StationView {
    /// Station.
    pub station: String,
    /// The station's time, when this was asked.
    pub at: Time,
    /// Time, satellite or radio are made up.
    pub simulated: bool,
    /// The newest event in the archive; 0 when there is none.
    pub last_sequence: i64,
    /// Each satellite.
    pub satellites: Vec<SatelliteView>,
    /// Each link.
    pub links: Vec<LinkView>,
    /// Sealing with each key.
    pub sealing: Vec<SealingView>,
    /// Storage.
    pub storage: StorageView,
    /// Rotator and rig, as `/antenna` tells them; `null` when there is neither.
    #[serde(default)]
    pub antenna: Option<Box<AntennaView>>,
    /// What a demo tells of itself (speed, seed, loss); for people, of no fixed shape.
    pub demo: Option<serde_json::Value>,
}

/// One satellite now.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SatelliteView {
    /// Satellite.
    pub satellite: String,
    /// Id of the key that seals for it; `null` when it can only be heard.
    pub key: Option<String>,
    /// When it was last heard.
    pub heard_at: Option<Time>,
    /// When its last heartbeat was heard.
    pub heartbeat_at: Option<Time>,
    /// When its next heartbeat is due, if that can be told.
    pub next_heartbeat_at: Option<Time>,
    /// Heard within two and a half heartbeat periods.
    pub in_contact: bool,
    /// In view, when that is known.
    pub in_view: Option<bool>,
    /// Loss of signal, when known.
    pub los_at: Option<Time>,
    /// What may be expected of it now, as a short sentence: `no contact expected until 14:32Z`.
    #[serde(default)]
    pub expectation: String,
    /// The elements in use; `null` without elements or without the station's place.
    #[serde(default)]
    pub elements: Option<ElementsInUse>,
    /// The pass that lasts and those of the next two days, in order of time.
    #[serde(default)]
    pub next_passes: Vec<NextPass>,
    /// What the uplink is doing, as a short sentence.
    pub uplink: String,
    /// The command on its way.
    pub outstanding: Option<u64>,
    /// Commands that wait.
    pub queued: u64,
    /// The newest image.
    pub image: Option<ImageProgress>,
    /// The active download.
    pub download: Option<u64>,
}

/// The elements that say where a satellite is.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ElementsInUse {
    /// Their number in the archive.
    pub id: u64,
    /// Their epoch.
    pub epoch: Time,
    /// Days since the epoch; negative before it.
    pub age_days: f64,
    /// Expected error of AOS and LOS, s (a rule of thumb).
    pub timing_error_s: f64,
    /// `normal`, `watch`, `warning`, or `distress` when they say nothing any more.
    pub level: String,
    /// Why they tell no passes, as a sentence.
    pub fault: Option<String>,
}

/// A pass in short; `/passes` tells more.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NextPass {
    /// Acquisition of signal.
    pub aos: Time,
    /// Greatest elevation.
    pub tca: Time,
    /// Loss of signal; `null` for an object that does not set.
    pub los: Option<Time>,
    /// Elevation at TCA, degrees.
    pub max_elevation_deg: f64,
    /// Azimuths at AOS, TCA and LOS, degrees from north over east.
    pub azimuths_deg: [f64; 3],
    /// The elements it was computed from.
    pub elements: u64,
}

/// How far an image is.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageProgress {
    /// Image.
    pub image: u64,
    /// Chunks held.
    pub held: u32,
    /// Chunks in all.
    pub chunks: u32,
    /// Chunks with versions that differ.
    pub conflicts: u32,
}

/// One link now.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LinkView {
    /// Link.
    pub link: String,
    /// Satellite that it hears.
    pub satellite: String,
    /// `ok`, `unavailable`, `disabled` or `failed`.
    pub state: String,
    /// Why it is not ok.
    pub reason: Option<String>,
    /// It may transmit.
    pub armed: bool,
    /// It is transmitting.
    pub on_air: bool,
    /// Whole frames heard since the start.
    pub frames: u64,
    /// Bytes that belonged to no frame since the start.
    pub skipped_bytes: u64,
    /// Candidates for a frame that failed since the start.
    pub bad: u64,
    /// Uplink frames radiated since the start.
    pub radiated: u64,
    /// Their time on the air in milliseconds.
    pub airtime_ms: u64,
    /// Level of the newest frame in dBm.
    pub rssi_dbm: Option<i16>,
}

/// Sealing with one key.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SealingView {
    /// Key id.
    pub key: String,
    /// Satellite.
    pub satellite: String,
    /// Why nothing is sealed, with the remedy; `null` when all is well.
    pub locked: Option<String>,
}

/// An operator knows why counter and witness of a key disagree.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CounterConfirmation {
    /// Go on above this counter, besides all that are known. A key with `counter = "sequence"` needs it after a restore, or
    /// when its witness was lost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub above: Option<u64>,
}

/// Storage now.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct StorageView {
    /// Why nothing is stored; `null` when all is well.
    pub failing: Option<String>,
    /// Records that wait to be stored.
    pub waiting: u64,
    /// Raw frames in the reserve since storage failed.
    pub reserved: u64,
    /// Raw frames that the reserve had no place for since storage failed: they are in memory only.
    #[serde(default)]
    pub unreserved: u64,
    /// Derived records dropped since the start; `gs-server redecode` makes them again.
    pub derived_dropped: u64,
    /// Raw frames that found no place since the start.
    pub frames_lost: u64,
}
