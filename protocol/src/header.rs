//! Sizes, magics and the 4-byte header that begins the contents of every frame (ICD section 1).

use crate::RequestTag;

/// Length of a full frame, and of every uplink frame, in bytes.
pub const FRAME_LEN: usize = 240;
/// Length of a magic, in bytes.
pub const MAGIC_LEN: usize = 8;
/// First bytes of a downlink frame. It does not overlap itself.
pub const DOWN_MAGIC: [u8; MAGIC_LEN] = *b"PIXELSAT";
/// First bytes of an uplink frame. It does not overlap itself.
pub const UP_MAGIC: [u8; MAGIC_LEN] = *b"DESTINY_";
/// Length of the header that begins the contents, in bytes.
pub const HEADER_LEN: usize = 4;
/// Longest contents (header and payload) of a downlink frame, in bytes.
pub const DOWN_CONTENTS_MAX: usize = FRAME_LEN - CONTENTS_AT;
/// Longest payload of a downlink frame, in bytes.
pub const DOWN_PAYLOAD_MAX: usize = DOWN_CONTENTS_MAX - HEADER_LEN;
/// What a short downlink frame is longer than its payload, in bytes: magic, CRC, header.
pub const SHORT_OVERHEAD: usize = CONTENTS_AT + HEADER_LEN;
/// Length of an uplink's plaintext (header, payload, random padding), in bytes.
pub const UP_PLAINTEXT_LEN: usize = 200;
/// Longest payload of an uplink frame, in bytes.
pub const UP_PAYLOAD_MAX: usize = UP_PLAINTEXT_LEN - HEADER_LEN;
/// Bytes of the image in one chunk.
pub const CHUNK_LEN: usize = 222;
/// Ground's own rule: at most this many chunks are asked for at a time (ICD section 3).
pub const RANGE_MAX: u16 = 64;

/// Offset of the CRC in both frames.
pub(crate) const CRC_AT: usize = MAGIC_LEN;
/// Offset of a downlink's contents.
pub(crate) const CONTENTS_AT: usize = CRC_AT + 4;
/// Offset of the payload in a downlink frame.
pub(crate) const PAYLOAD_AT: usize = CONTENTS_AT + HEADER_LEN;

const _: () = assert!(DOWN_CONTENTS_MAX == 228 && DOWN_PAYLOAD_MAX == 224 && SHORT_OVERHEAD == 16);
const _: () = assert!(UP_PAYLOAD_MAX == 196);

/// The 4 bytes before every payload, as they stand on the wire: not yet believed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Header {
    /// Packet type (ICD sections 3, 4, 7).
    pub packet_type: u8,
    /// Request tag as on the wire; 0 = unsolicited.
    pub tag: u8,
    /// Length of the payload, in bytes, as claimed.
    pub length: u16,
}

impl Header {
    /// Reads the header at the beginning of some contents.
    #[must_use]
    pub const fn from_wire_bytes(bytes: [u8; HEADER_LEN]) -> Self {
        Self { packet_type: bytes[0], tag: bytes[1], length: u16::from_be_bytes([bytes[2], bytes[3]]) }
    }

    /// The header as it goes on the wire.
    #[must_use]
    pub const fn to_wire_bytes(self) -> [u8; HEADER_LEN] {
        let length = self.length.to_be_bytes();
        [self.packet_type, self.tag, length[0], length[1]]
    }

    /// The tag, `None` when 0.
    #[must_use]
    pub const fn request_tag(self) -> Option<RequestTag> {
        RequestTag::new(self.tag)
    }
}
