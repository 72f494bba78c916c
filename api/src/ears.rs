//! Ways in over the network, and who hears us by them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::time::Time;

/// How a way in works.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WayState {
    /// It has not answered yet.
    Starting,
    /// It works.
    Working,
    /// It answers, and what it says is old.
    Stale,
    /// It does not answer, and is tried again.
    Failing,
    /// It refused us: it is not asked again until the server starts again, with another token or after a look.
    Refused,
}

/// A way in over the network, from `[[ears]]`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WayView {
    /// Its name.
    pub name: String,
    /// `mqtt`, `broker`, `tinygs-api` or `satnogs-db`.
    pub kind: String,
    /// Whose frames are looked for.
    pub satellite: String,
    /// Whom it asks, or where it listens.
    pub address: String,
    /// How it works.
    pub state: WayState,
    /// Since when.
    pub since: Time,
    /// When it answered, or a message came, last.
    pub last_ok_at: Option<Time>,
    /// Seconds since then.
    pub age_s: Option<f64>,
    /// When something new came last.
    pub last_new_at: Option<Time>,
    /// When it is asked next; `None` where messages come by themselves.
    pub next_at: Option<Time>,
    /// What went wrong last, with the remedy.
    pub error: Option<String>,
    /// When that was.
    pub error_at: Option<Time>,
    /// Worth knowing though nothing is wrong: the feed is old, packets may have been missed.
    pub note: Option<String>,
    /// Boards that are connected; of a broker.
    pub connected: Option<u64>,
    /// What was counted since the start: `requests`, `connections`, `messages`, `receptions`, and refusals by reason.
    pub counts: BTreeMap<String, u64>,
}

/// What a board of one's own says of itself.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct BoardView {
    /// By which way it speaks.
    pub way: String,
    /// It is there: it spoke within three minutes, and nobody has said that it left.
    pub online: bool,
    /// When it spoke last.
    pub last_seen_at: Option<Time>,
    /// When it began, or came back.
    pub welcome_at: Option<Time>,
    /// Its address, 12 hex digits: stays when its owner renames it.
    pub mac: Option<String>,
    /// Version of its firmware, YYMMDDn.
    pub version: Option<i64>,
    /// What it is told to listen to.
    pub listening_to: Option<String>,
    /// Its battery as its converter reads it; not volts.
    pub battery_raw: Option<f64>,
    /// Wi-Fi, dBm.
    pub wifi_dbm: Option<f64>,
    /// Noise on the channel, dBm.
    pub noise_dbm: Option<f64>,
    /// 0: its radio is well; below: the error of its driver.
    pub radio: Option<i64>,
    /// Bytes of memory that are free.
    pub memory_bytes: Option<i64>,
    /// Seconds since it was switched on, when it said hello.
    pub uptime_s: Option<i64>,
    /// Packets that it reported since the server started.
    pub packets: u64,
    /// Of these without bytes, their checksum was wrong.
    pub crc_errors: u64,
}

/// Somebody who hears our satellite.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReceiverView {
    /// Its id: `user/station` of a board of one's own, `name@userId` at TinyGS, the observer at SatNOGS.
    pub id: String,
    /// What its owner calls it. Free text of a stranger.
    pub name: Option<String>,
    /// By which sources it came.
    pub sources: Vec<String>,
    /// Degrees north, as it said last.
    pub latitude_deg: Option<f64>,
    /// Degrees east, as it said last.
    pub longitude_deg: Option<f64>,
    /// Frames that it heard.
    pub frames: u64,
    /// Packets of which it kept nothing, or damaged ones.
    pub without_frame: u64,
    /// When it first heard something.
    pub first_heard_at: Option<Time>,
    /// When it last heard something.
    pub last_heard_at: Option<Time>,
    /// Median of its SNR, dB, over its newest receptions.
    pub median_snr_db: Option<f64>,
    /// Best RSSI, dBm.
    pub best_rssi_dbm: Option<f64>,
    /// What it says of itself, where it is a board of one's own.
    pub board: Option<BoardView>,
}
