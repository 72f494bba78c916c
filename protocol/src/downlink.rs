//! Packets from the satellite (ICD sections 4, 6, 7): small owned values that are always meaningful.
//!
//! Downlink is public and unauthenticated: a value here says what was heard, never who said it. Floats may be NaN or
//! infinite (a failed sensor) and stay so.

mod adcs;
mod error_code;
mod events;
mod heartbeat;
mod image;
mod status;

pub use adcs::{AdcsInfo, AdcsMode};
pub use error_code::ErrorCode;
pub use events::{EventRecord, EventReport};
pub use heartbeat::Heartbeat;
pub use image::{ImageChunk, ImageInfo};
pub use status::{ModeReport, ScheduleInfo};

use crate::{
    Field, FieldValue, PayloadError,
    wire::{Reader, Walk, Wire, Writer},
};

/// Packet types from the satellite.
pub mod down_type {
    /// Answer to a Ping.
    pub const PONG: u8 = 0;
    /// A refusal or a fault.
    pub const ERROR: u8 = 1;
    /// What image the satellite stores.
    pub const IMAGE_INFO: u8 = 2;
    /// 222 bytes of the image.
    pub const IMAGE_CHUNK: u8 = 3;
    /// State of attitude control.
    pub const ADCS_INFO: u8 = 4;
    /// State of the list of scheduled transmissions.
    pub const SCHEDULE_INFO: u8 = 5;
    /// The periodic sign of life.
    pub const HEARTBEAT: u8 = 6;
    /// State of a mode machine (autonomy extension).
    pub const MODE_REPORT: u8 = 0x40;
    /// Recorded events (autonomy extension).
    pub const EVENT_REPORT: u8 = 0x41;
}

/// One packet from the satellite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Downlink {
    /// Answer to a Ping.
    Pong,
    /// A refusal (with its request's tag) or a fault (tag 0).
    Error(ErrorCode),
    /// What image the satellite stores.
    ImageInfo(ImageInfo),
    /// A piece of the image.
    ImageChunk(ImageChunk),
    /// State of attitude control.
    AdcsInfo(AdcsInfo),
    /// State of the list of scheduled transmissions.
    ScheduleInfo(ScheduleInfo),
    /// The periodic sign of life.
    Heartbeat(Heartbeat),
    /// State of a mode machine.
    ModeReport(ModeReport),
    /// Recorded events.
    EventReport(EventReport),
    /// A type this ICD does not know; its bytes stay with the frame.
    Unknown {
        /// Type in the header.
        packet_type: u8,
    },
}

impl Downlink {
    /// Type in the header.
    #[must_use]
    pub const fn packet_type(&self) -> u8 {
        match self {
            Self::Pong => down_type::PONG,
            Self::Error(_) => down_type::ERROR,
            Self::ImageInfo(_) => down_type::IMAGE_INFO,
            Self::ImageChunk(_) => down_type::IMAGE_CHUNK,
            Self::AdcsInfo(_) => down_type::ADCS_INFO,
            Self::ScheduleInfo(_) => down_type::SCHEDULE_INFO,
            Self::Heartbeat(_) => down_type::HEARTBEAT,
            Self::ModeReport(_) => down_type::MODE_REPORT,
            Self::EventReport(_) => down_type::EVENT_REPORT,
            Self::Unknown { packet_type } => *packet_type,
        }
    }

    /// The ICD's name of this packet, `Unknown` for a type it does not know.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Unknown { .. } => "Unknown",
            known => match Self::name_of(known.packet_type()) {
                Some(name) => name,
                None => "Unknown",
            },
        }
    }

    /// The ICD's name of a packet type.
    #[must_use]
    pub const fn name_of(packet_type: u8) -> Option<&'static str> {
        Some(match packet_type {
            down_type::PONG => "Pong",
            down_type::ERROR => "Error",
            down_type::IMAGE_INFO => "ImageInfo",
            down_type::IMAGE_CHUNK => "ImageChunk",
            down_type::ADCS_INFO => "AdcsInfo",
            down_type::SCHEDULE_INFO => "ScheduleInfo",
            down_type::HEARTBEAT => "Heartbeat",
            down_type::MODE_REPORT => "ModeReport",
            down_type::EVENT_REPORT => "EventReport",
            _ => return None,
        })
    }

    /// Length of the payload, in bytes. 0 for [`Downlink::Unknown`], whose payload is not kept here.
    #[must_use]
    pub const fn payload_len(&self) -> usize {
        match self {
            Self::Pong | Self::Unknown { .. } => 0,
            Self::Error(_) => ErrorCode::LEN,
            Self::ImageInfo(_) => ImageInfo::LEN,
            Self::ImageChunk(_) => ImageChunk::LEN,
            Self::AdcsInfo(_) => AdcsInfo::LEN,
            Self::ScheduleInfo(_) => ScheduleInfo::LEN,
            Self::Heartbeat(_) => Heartbeat::LEN,
            Self::ModeReport(_) => ModeReport::LEN,
            Self::EventReport(report) => report.payload_len(),
        }
    }

    /// Writes the payload to the beginning of `out` and returns its length. Total for `out` of 224 bytes; in a shorter
    /// buffer, fields that do not fit are left out.
    pub fn encode_payload(&self, out: &mut [u8]) -> usize {
        let mut writer = Writer::new(out);
        match self {
            Self::Pong | Self::Unknown { .. } => {}
            Self::Error(packet) => packet.write(&mut writer),
            Self::ImageInfo(packet) => packet.write(&mut writer),
            Self::ImageChunk(packet) => packet.write(&mut writer),
            Self::AdcsInfo(packet) => packet.write(&mut writer),
            Self::ScheduleInfo(packet) => packet.write(&mut writer),
            Self::Heartbeat(packet) => packet.write(&mut writer),
            Self::ModeReport(packet) => packet.write(&mut writer),
            Self::EventReport(packet) => packet.write(&mut writer),
        }
        writer.offset()
    }

    /// The packet of this type in exactly these bytes.
    ///
    /// # Errors
    /// When the length does not fit the type, a boolean is neither 0 nor 1, or an event count is too large. An unknown
    /// type is a value, [`Downlink::Unknown`].
    pub fn decode(packet_type: u8, payload: &[u8]) -> Result<Self, PayloadError> {
        fn fixed<T: Wire>(packet_type: u8, payload: &[u8]) -> Result<T, PayloadError> {
            let (found, expected) = (payload.len(), T::LEN);
            if found != expected {
                return Err(PayloadError::Length { packet_type, found, expected });
            }
            Reader::new(payload).read()
        }
        let t = packet_type;
        Ok(match packet_type {
            down_type::PONG if payload.is_empty() => Self::Pong,
            down_type::PONG => {
                return Err(PayloadError::Length { packet_type, found: payload.len(), expected: 0 });
            }
            down_type::ERROR => Self::Error(fixed(t, payload)?),
            down_type::IMAGE_INFO => Self::ImageInfo(fixed(t, payload)?),
            down_type::IMAGE_CHUNK => Self::ImageChunk(fixed(t, payload)?),
            down_type::ADCS_INFO => Self::AdcsInfo(fixed(t, payload)?),
            down_type::SCHEDULE_INFO => Self::ScheduleInfo(fixed(t, payload)?),
            down_type::HEARTBEAT if payload.len() != Heartbeat::LEN => {
                return Err(PayloadError::HeartbeatLayout { found: payload.len() });
            }
            down_type::HEARTBEAT => Self::Heartbeat(fixed(t, payload)?),
            down_type::MODE_REPORT => Self::ModeReport(fixed(t, payload)?),
            down_type::EVENT_REPORT => Self::EventReport(EventReport::decode(payload)?),
            _ => Self::Unknown { packet_type },
        })
    }

    /// Calls `visit` for every field, in wire order.
    pub fn visit_fields(&self, visit: &mut dyn FnMut(Field<'_>)) {
        let mut walk = Walk::new(visit);
        match self {
            Self::Pong | Self::Unknown { .. } => {}
            Self::Error(packet) => walk.value(packet, &["code"], ""),
            Self::ImageInfo(packet) => walk.value(packet, &[], ""),
            Self::ImageChunk(packet) => {
                walk.value(&packet.index.0, &["index"], "");
                walk.field("data", "", FieldValue::Bytes(&packet.data), packet.data.len());
            }
            Self::AdcsInfo(packet) => walk.value(packet, &[], ""),
            Self::ScheduleInfo(packet) => walk.value(packet, &[], ""),
            Self::Heartbeat(packet) => walk.value(packet, &[], ""),
            Self::ModeReport(packet) => walk.value(packet, &[], ""),
            Self::EventReport(packet) => packet.walk(&mut walk),
        }
    }
}
