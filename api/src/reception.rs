//! What others heard: TinyGS, SatNOGS, files.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::Time;

/// What an ear other than our radio reported. Anyone can make one up.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutsideView {
    /// Its number; `null` where it stands with its frame.
    pub id: Option<u64>,
    /// Satellite.
    pub satellite: String,
    /// Our station that took it in.
    pub station: String,
    /// The frame; `null` for a detection and for damaged bytes.
    pub frame: Option<u64>,
    /// `frame`, `repairable` (one flipped bit away from one), `damaged` or `detection` (a packet, and none of its bytes).
    pub kind: String,
    /// `own-mqtt`, `tinygs-api`, `satnogs`, `console` or `file`.
    pub source: String,
    /// What tells it from all others of that source and receiver.
    pub source_id: String,
    /// Id of the receiver; `null` when nobody said who it was.
    pub receiver: Option<String>,
    /// What its owner calls it. Free text of a stranger.
    pub receiver_name: Option<String>,
    /// Degrees north.
    pub latitude_deg: Option<f64>,
    /// Degrees east.
    pub longitude_deg: Option<f64>,
    /// Metres.
    pub altitude_m: Option<f64>,
    /// When it was received, as well as that is known.
    pub received_at: Time,
    /// How that is known: `board-at-reception`, `board`, `server`, `stated`, `board-alone`, `arrival`, or `import` (not at
    /// all: it is the time of the import).
    pub time_basis: String,
    /// How far off it may be, seconds; `null`: nobody knows.
    pub time_error_s: Option<f64>,
    /// Nominal frequency, Hz.
    pub frequency_hz: Option<f64>,
    /// Calibration offset of the receiver, Hz.
    pub frequency_offset_hz: Option<f64>,
    /// Doppler that was corrected, Hz.
    pub doppler_hz: Option<f64>,
    /// Frequency error that was measured, Hz; the sign differs between receivers.
    pub frequency_error_hz: Option<f64>,
    /// LoRa spreading factor.
    pub spreading_factor: Option<u8>,
    /// LoRa bandwidth, Hz.
    pub bandwidth_hz: Option<f64>,
    /// Denominator of the coding rate.
    pub coding_rate: Option<u8>,
    /// Received power, dBm.
    pub rssi_dbm: Option<f64>,
    /// Signal to noise ratio, dB.
    pub snr_db: Option<f64>,
    /// What the radio said of its own checksum: `right`, `wrong` or `unknown`.
    pub radio_crc: String,
    /// Its bytes are suspect.
    pub noisy: bool,
    /// What it was labelled as; not believed.
    pub label: Option<String>,
    /// The catalogue number of the label.
    pub norad: Option<u32>,
    /// Bytes that stood before the frame.
    pub trim_bytes: u8,
    /// Bits that stood before that.
    pub trim_bits: u8,
    /// The bit that, flipped, would make a frame of it: an offer, never proof.
    pub repaired_bit: Option<u16>,
    /// What was not believed of it.
    pub doubts: Vec<String>,
    /// The report as it came, when it is text; only when one is asked for with it.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub original: Option<String>,
}

/// What came in through one ear since the start of the server.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EarView {
    /// `own-mqtt`, `tinygs-api`, `satnogs`, `console` or `file`.
    pub source: String,
    /// What became of it.
    pub taken: ImportReport,
    /// Reports that were refused, by reason.
    pub refused: BTreeMap<String, u64>,
    /// Values that were dropped while their reception was kept, by reason.
    pub doubts: BTreeMap<String, u64>,
    /// When something came last.
    pub last_at: Option<Time>,
    /// When something new came last.
    pub last_new_at: Option<Time>,
}

/// Reports that somebody hands in.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImportRequest {
    /// The satellite; may be left out where there is one.
    #[serde(default)]
    pub satellite: Option<String>,
    /// Who heard it, where the reports do not say.
    #[serde(default)]
    pub receiver: Option<String>,
    /// When it was heard, where the reports do not say.
    #[serde(default)]
    pub at: Option<Time>,
    /// The reports.
    pub items: Vec<ImportItem>,
}

/// One report, as it stands in a file.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImportItem {
    /// `json`, `satnogs-csv`, `kiss`, `hex` or `raw`.
    pub format: String,
    /// The text of it: an object of JSON, a line.
    #[serde(default)]
    pub text: Option<String>,
    /// Or its bytes in hex.
    #[serde(default)]
    pub hex: Option<String>,
    /// The topic that it was published on.
    #[serde(default)]
    pub topic: Option<String>,
    /// Which one of this content it is in its file, from 1; for reports without a time.
    #[serde(default)]
    pub occurrence: Option<u32>,
}

/// What became of reports. Durable.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ImportReport {
    /// Frames that nobody had heard before.
    pub frames: u64,
    /// Receptions of frames that were there.
    pub merged: u64,
    /// Detections and damaged packets.
    pub without_frame: u64,
    /// Reports that were stored before: nothing happened.
    pub repeated: u64,
    /// Reports that were refused.
    pub refused: u64,
}
