//! The PixelSat I radio link as code: frames, packets, the stream decoder, sealing.
//!
//! The page a person reads beside this crate is `docs/icd.md`. Everything about the wire lives here and nowhere else,
//! so that a decision of the flight team changes one place.
//!
//! | module | what |
//! | --- | --- |
//! | [`frame`](DownFrame) | one downlink frame: a borrowed view of checked bytes, and its encoder |
//! | [`downlink`](Downlink) | packets from the satellite, as owned values |
//! | [`telecommand`](Telecommand) | packets to the satellite, their rules and what answers them |
//! | [`seal`](seal()) | AES-128-GCM: sealed and opened uplinks are different types |
//! | [`stream`](DownDecoder) | bytes in any pieces in, frames out; no I/O |
//! | [`Field`] | every scalar of a packet by name and unit, for JSON, plots and inspectors |
//!
//! What this crate does **not** do: it has no clock, no randomness (nonces and padding come in as parameters), no
//! I/O, no heap, and it keeps no replay window or nonce counter: those need durable storage and live with their owners.
//!
//! Contracts: **decoding never panics**, whatever the bytes; encoding is total and writes every byte of what it says it
//! wrote. All numbers on the wire are big-endian.
//!
//! ```
//! use protocol::{DownDecoder, DownItem, Downlink, FrameForm, encode_down};
//!
//! let mut frame = [0; 240];
//! let len = encode_down(&Downlink::Pong, None, FrameForm::Short, &mut frame);
//!
//! let mut decoder = DownDecoder::new(false);
//! let mut heard = 0;
//! for piece in frame[..len].chunks(5) {
//!     decoder.push(piece, &mut |item| {
//!         if let DownItem::Frame { frame, .. } = item {
//!             assert_eq!(frame.packet(), Ok(Downlink::Pong));
//!             heard += 1;
//!         }
//!     });
//! }
//! assert_eq!(heard, 1);
//! ```
#![no_std]

#[cfg(test)]
extern crate std;

mod crc;
mod downlink;
mod error;
mod field;
mod frame;
mod header;
mod ids;
mod key;
mod seal;
mod stream;
mod telecommand;
mod wire;

/// The bounded lists inside telecommands and event reports are `heapless` vectors.
pub use heapless;

pub use crc::crc32;
pub use downlink::{
    AdcsInfo, AdcsMode, Downlink, ErrorCode, EventRecord, EventReport, Heartbeat, ImageChunk, ImageInfo,
    ModeReport, ScheduleInfo, down_type,
};
pub use error::{CrcMismatch, FrameError, OpenError, PayloadError, TextError};
pub use field::{Field, FieldValue};
pub use frame::{DownFrame, FrameForm, encode_down};
pub use header::{
    CHUNK_LEN, DOWN_CONTENTS_MAX, DOWN_MAGIC, DOWN_PAYLOAD_MAX, FRAME_LEN, HEADER_LEN, Header, MAGIC_LEN,
    RANGE_MAX, SHORT_OVERHEAD, UP_MAGIC, UP_PAYLOAD_MAX, UP_PLAINTEXT_LEN,
};
pub use ids::{ChunkIndex, Counter, Nonce, RequestTag};
pub use key::{Key, KeyId};
pub use seal::{OpenedContents, SealedUplink, open, seal, seal_plaintext, seal_raw};
pub use stream::{DecoderCounters, DownDecoder, DownItem, UpCounters, UpDecoder};
pub use telecommand::{
    Answer, ChunkRange, ChunkRanges, DownlinkSchedule, DownlinkSlot, Guidance, Resolution, ScheduleEntry,
    ScheduleUpload, ScriptStep, ScriptUpload, Telecommand, TorqueProfile, TorqueStep, TwoLines, up_type,
};
