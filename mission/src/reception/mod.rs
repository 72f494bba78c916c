//! One reception record for every way in: what an ear other than our radio says it heard, checked and dated.
//!
//! An importer fills a [`Said`] with what a message claims, in the words of the message; [`admit`] believes as much of it
//! as it may: values out of range are dropped and counted ([`Doubts`]), the time is chosen by rule ([`TimeBasis`]), and
//! whose the bytes are is decided by their content alone ([`attribute`]). What remains is a [`Reception`], or a
//! [`Refusal`] that is counted by its reason.
//!
//! Nothing here proves anything: downlink is in the clear, whoever reports it may have made it up.
//!
//! What it does **not** do: read JSON or files (`gs-server`'s `ingest::formats` does), know a network, store.

mod admit;
mod attribute;
mod reason;
mod repair;
mod time;

pub use admit::{Admission, admit};
pub use attribute::{Attribution, Trim, attribute};
pub use reason::{Doubt, Doubts, Refusal};
pub use repair::{Repair, repair};
pub use time::{TimeBasis, Times, choose_time};

use std::sync::Arc;

use crate::clock::UtcUs;
use crate::id::{FrameId, SatelliteId};

/// Stands for the station in the rows of frames that no station of ours heard first; no station may be called so.
pub const ELSEWHERE: &str = "elsewhere";
/// Stands for the link in the rows of such frames whose time is not known.
pub const UNDATED: &str = "undated";

/// Bytes of one packet that are looked at; LoRa carries no more.
pub const DELIVERED_MAX: usize = 256;
/// Characters of a name that are kept.
pub const NAME_MAX: usize = 64;

/// Through which ear a reception came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Ear {
    /// A team's own TinyGS board, by MQTT.
    OwnMqtt,
    /// The HTTP API of TinyGS.
    TinygsApi,
    /// The database of SatNOGS.
    Satnogs,
    /// The web console or the serial port of a board.
    Console,
    /// A file.
    File,
}

impl Ear {
    /// All.
    pub const ALL: [Self; 5] = [Self::OwnMqtt, Self::TinygsApi, Self::Satnogs, Self::Console, Self::File];

    /// The word in the database and on the wire; also the name of station and link in the rows of frames that nobody of
    /// ours heard before.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OwnMqtt => "own-mqtt",
            Self::TinygsApi => "tinygs-api",
            Self::Satnogs => "satnogs",
            Self::Console => "console",
            Self::File => "file",
        }
    }

    /// The ear of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|ear| ear.name() == name)
    }
}

/// Who heard it, as far as that was told.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Receiver {
    /// What does not change when its owner renames it: the MAC of a board, `name@userId`. `None` when nobody said.
    pub id: Option<String>,
    /// What its owner calls it. Free text of a stranger.
    pub name: Option<String>,
    /// Degrees north.
    pub latitude_deg: Option<f64>,
    /// Degrees east.
    pub longitude_deg: Option<f64>,
    /// Metres above the ellipsoid.
    pub altitude_m: Option<f64>,
}

/// What the receiving radio said of the signal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Signal {
    /// Nominal frequency, Hz, without offset and Doppler.
    pub frequency_hz: Option<f64>,
    /// Calibration offset of the receiver, Hz.
    pub frequency_offset_hz: Option<f64>,
    /// Doppler correction that was applied, Hz; `None` when none was.
    pub doppler_hz: Option<f64>,
    /// Frequency error that the radio measured, Hz. Which sign means 'too high' differs between receivers.
    pub frequency_error_hz: Option<f64>,
    /// LoRa spreading factor, 5 to 12.
    pub spreading_factor: Option<u8>,
    /// LoRa bandwidth, Hz.
    pub bandwidth_hz: Option<f64>,
    /// Denominator of the coding rate, 5 (4/5) to 8 (4/8).
    pub coding_rate: Option<u8>,
    /// Received power, dBm.
    pub rssi_dbm: Option<f64>,
    /// Signal to noise ratio, dB.
    pub snr_db: Option<f64>,
}

/// What the radio said of its own checksum over the packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RadioCrc {
    /// Nothing.
    #[default]
    Unknown,
    /// It was right.
    Right,
    /// It was wrong: bytes, if there are any, are suspect.
    Wrong,
}

impl RadioCrc {
    /// The word in the database and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Right => "right",
            Self::Wrong => "wrong",
        }
    }
}

/// What a message claims, before anything of it is believed.
#[derive(Debug, Clone, PartialEq)]
pub struct Said {
    /// Through which ear.
    pub ear: Ear,
    /// What tells this message from every other of that ear: the id of a packet, or a digest of the message.
    pub source_id: String,
    /// Who heard it.
    pub receiver: Receiver,
    /// All times that were told.
    pub times: Times,
    /// What the radio said.
    pub signal: Signal,
    /// What the radio said of its checksum.
    pub radio_crc: RadioCrc,
    /// A second interrupt came while the packet was read: its bytes are suspect.
    pub noisy: bool,
    /// What the receiver was told to listen to, or the network took it for. Never believed.
    pub label: Option<String>,
    /// The catalogue number that goes with the label; 0 is no number.
    pub norad: Option<u32>,
    /// The bytes as delivered; `None`: a packet was noticed and none of it kept.
    pub bytes: Option<Vec<u8>>,
    /// The message as it came, verbatim. `None` when another reception of the same message carries it.
    pub original: Option<Box<[u8]>>,
    /// What was found wrong with it while it was read.
    pub doubts: Doubts,
}

impl Said {
    /// An empty claim.
    pub fn new(ear: Ear, source_id: String) -> Self {
        Self {
            ear,
            source_id,
            receiver: Receiver::default(),
            times: Times::default(),
            signal: Signal::default(),
            radio_crc: RadioCrc::Unknown,
            noisy: false,
            label: None,
            norad: None,
            bytes: None,
            original: None,
            doubts: Doubts::default(),
        }
    }
}

/// What the bytes turned out to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Content {
    /// A frame of ours: magic and checksum are right.
    Frame {
        /// The frame alone, 16 to 240 bytes.
        bytes: Box<[u8]>,
        /// What stood around it.
        trim: Trim,
    },
    /// The magic is there, the checksum is wrong. Kept for people, used for nothing.
    Damaged {
        /// As delivered.
        delivered: Box<[u8]>,
        /// The frame that one flipped bit would make of it. An offer, never proof.
        offered: Option<Repair>,
    },
    /// No bytes: something was on the air, at that level and with that frequency error.
    Detection,
}

impl Content {
    /// The word in the database and on the wire.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Frame { .. } => "frame",
            Self::Damaged { offered: Some(_), .. } => "repairable",
            Self::Damaged { offered: None, .. } => "damaged",
            Self::Detection => "detection",
        }
    }
}

/// One ear heard one packet: checked, dated, attributed.
#[derive(Debug, Clone, PartialEq)]
pub struct Reception {
    /// Through which ear.
    pub ear: Ear,
    /// With `ear` and the receiver's id, unique for ever.
    pub source_id: String,
    /// Who heard it.
    pub receiver: Receiver,
    /// When it was received, as well as that is known.
    pub received_at: UtcUs,
    /// How that is known.
    pub time_basis: TimeBasis,
    /// How far off it may be, microseconds; `None`: nobody knows.
    pub time_error_us: Option<u64>,
    /// What the radio said.
    pub signal: Signal,
    /// What the radio said of its checksum.
    pub radio_crc: RadioCrc,
    /// Its bytes are suspect.
    pub noisy: bool,
    /// What it was labelled as.
    pub label: Option<String>,
    /// The catalogue number of the label.
    pub norad: Option<u32>,
    /// What it is.
    pub content: Content,
    /// What was dropped of it.
    pub doubts: Doubts,
    /// The message as it came, verbatim; `None` when another reception of the same message carries it.
    pub original: Option<Box<[u8]>>,
}

impl Reception {
    /// The frame, when it is one.
    pub fn frame(&self) -> Option<&[u8]> {
        match &self.content {
            Content::Frame { bytes, .. } => Some(bytes),
            _ => None,
        }
    }

    /// The receiver's id as it stands in the key of the reception: empty when nobody said who it was.
    pub fn receiver_id(&self) -> &str {
        self.receiver.id.as_deref().unwrap_or("")
    }
}

/// A reception on its way to the engine.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivered {
    /// Whose frame it is.
    pub satellite: SatelliteId,
    /// What was heard.
    pub reception: Arc<Reception>,
    /// The frames of the archive that may be this one: these bytes, in this window of time. All of them, since the engine
    /// may know better of one by then: what was given to it before may have told when that one was heard.
    pub known: Box<[Known]>,
}

/// A frame that the archive has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Known {
    /// Which.
    pub frame: FrameId,
    /// When it was heard, as well as that is known.
    pub at: UtcUs,
    /// Somebody heard it at a time that is known.
    pub dated: bool,
}

/// What a delivery came to. Durable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Taken {
    /// Frames that nobody had heard before.
    pub frames: u32,
    /// Receptions of frames that were there already.
    pub merged: u32,
    /// Packets without a frame: detections and damaged ones.
    pub without_frame: u32,
}

/// Why a delivery was not taken: nothing of it was stored, it may come again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotTaken {
    /// Storage fails, or is behind: what the radio hears goes first.
    #[error("storage does not keep up: what the radio hears goes first. Try again later")]
    Busy,
    /// The station has no such satellite.
    #[error("the station has no such satellite")]
    UnknownSatellite,
    /// The station is stopping.
    #[error("the station is stopping")]
    Stopping,
}

/// The same bytes within this time are one frame, microseconds.
pub const SAME_FRAME_US: i64 = 30_000_000;

impl Reception {
    /// Somebody's clock stands behind its time.
    pub const fn is_dated(&self) -> bool {
        !matches!(self.time_basis, TimeBasis::Import | TimeBasis::BoardAlone)
    }
}

/// Whether no two frames of the satellite have the same bytes, because its uptime stands in each: then bytes alone say
/// that two reports are of one frame, also when one of them has no time.
pub fn is_unique(frame: &[u8]) -> bool {
    use protocol::down_type::{ADCS_INFO, HEARTBEAT};
    let parsed = protocol::DownFrame::parse(frame).ok();
    let packet = parsed.and_then(|frame| frame.packet().ok());
    packet.is_some_and(|packet| matches!(packet.packet_type(), HEARTBEAT | ADCS_INFO))
}

/// Whether a report of a frame at one time and a report of the same bytes at another are of one frame.
pub fn is_same_frame(bytes: &[u8], one: (UtcUs, bool), other: (UtcUs, bool)) -> bool {
    let near = one.0.0.abs_diff(other.0.0) <= SAME_FRAME_US.unsigned_abs();
    near || !(one.1 && other.1) && is_unique(bytes)
}
