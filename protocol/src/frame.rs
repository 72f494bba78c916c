//! One downlink frame (ICD section 1): a view of bytes whose magic and checksum are right, and its encoder.

use crate::{
    DOWN_MAGIC, DOWN_PAYLOAD_MAX, Downlink, FRAME_LEN, FrameError, Header, MAGIC_LEN, PayloadError,
    RequestTag, SHORT_OVERHEAD, crc32,
    header::{CONTENTS_AT, CRC_AT, PAYLOAD_AT},
};

/// The two legal forms of a downlink frame.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum FrameForm {
    /// 16 + length bytes, CRC over header and payload.
    Short,
    /// 240 bytes, zero padded, CRC over all 228 bytes of contents. A frame with 224 bytes of payload is both forms and
    /// counts as this one.
    Full,
}

/// Borrowed view of one accepted downlink frame: magic and CRC are right.
///
/// The header is believed only as far as it makes sense: the CRC is the wire's, the header our reading of a gap in the
/// paper, so a frame with a senseless header is kept, too.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DownFrame<'a> {
    bytes: &'a [u8],
    header: Header,
}

impl<'a> DownFrame<'a> {
    /// The view of exactly one frame: 16 + length is tried first, then 240.
    ///
    /// # Errors
    /// When the bytes do not begin with the magic, their number fits neither form, or the checksum is wrong.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, FrameError> {
        let found = bytes.len();
        if !(SHORT_OVERHEAD..=FRAME_LEN).contains(&found) {
            return Err(FrameError::Length { found });
        }
        if !bytes.starts_with(&DOWN_MAGIC) {
            return Err(FrameError::Magic);
        }
        let frame = Self::accepted(bytes);
        let is_short = found == SHORT_OVERHEAD + usize::from(frame.header.length);
        if !is_short && found != FRAME_LEN {
            return Err(FrameError::Length { found });
        }
        // At 240 bytes both forms cover the same contents.
        if crc32(frame.contents()) == frame.crc() { Ok(frame) } else { Err(FrameError::Crc) }
    }

    /// The view of bytes whose magic, length (16..=240) and checksum were just checked.
    pub(crate) fn accepted(bytes: &'a [u8]) -> Self {
        let mut header = [0; 4];
        for (to, from) in header.iter_mut().zip(bytes.iter().skip(CONTENTS_AT)) {
            *to = *from;
        }
        Self { bytes, header: Header::from_wire_bytes(header) }
    }

    /// The whole frame, magic first.
    #[must_use]
    pub const fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Which form it has.
    #[must_use]
    pub const fn form(&self) -> FrameForm {
        if self.bytes.len() == FRAME_LEN { FrameForm::Full } else { FrameForm::Short }
    }

    /// The checksum on the wire, which is also that of the contents.
    #[must_use]
    pub fn crc(&self) -> u32 {
        self.bytes.get(CRC_AT..CONTENTS_AT).and_then(|crc| crc.try_into().ok()).map_or(0, u32::from_be_bytes)
    }

    /// Header, payload and padding: what the checksum covers.
    #[must_use]
    pub fn contents(&self) -> &'a [u8] {
        self.bytes.get(CONTENTS_AT..).unwrap_or(&[])
    }

    /// The header as it stands, believable or not.
    #[must_use]
    pub const fn raw_header(&self) -> Header {
        self.header
    }

    /// The header, `None` if it makes no sense (a payload longer than a frame can hold).
    #[must_use]
    pub const fn header(&self) -> Option<Header> {
        if self.header.length as usize <= DOWN_PAYLOAD_MAX { Some(self.header) } else { None }
    }

    /// Packet type, as it stands.
    #[must_use]
    pub const fn packet_type(&self) -> u8 {
        self.header.packet_type
    }

    /// Tag of the request this answers; `None` when unsolicited (0).
    #[must_use]
    pub const fn tag(&self) -> Option<RequestTag> {
        self.header.request_tag()
    }

    /// The payload; everything after the header when the header claims more than there is.
    #[must_use]
    pub fn payload(&self) -> &'a [u8] {
        let rest = self.bytes.get(PAYLOAD_AT..).unwrap_or(&[]);
        rest.get(..self.header.length.into()).unwrap_or(rest)
    }

    /// The packet inside.
    ///
    /// # Errors
    /// When the header makes no sense or the payload does not follow the ICD; the frame is still worth keeping.
    pub fn packet(&self) -> Result<Downlink, PayloadError> {
        match self.header() {
            Some(header) => Downlink::decode(header.packet_type, self.payload()),
            None => {
                let (found, max) = (self.header.length, DOWN_PAYLOAD_MAX as u16);
                Err(PayloadError::HeaderLength { found, max })
            }
        }
    }
}

/// Writes one frame to the beginning of `out` and returns its length; bytes after it are not touched.
///
/// [`Downlink::Unknown`] goes out with an empty payload.
pub fn encode_down(
    packet: &Downlink,
    tag: Option<RequestTag>,
    form: FrameForm,
    out: &mut [u8; FRAME_LEN],
) -> usize {
    let (head, payload) = out.split_at_mut(PAYLOAD_AT);
    let length = packet.encode_payload(payload);
    let header = Header {
        packet_type: packet.packet_type(),
        tag: tag.map_or(0, RequestTag::get),
        length: length as u16,
    };
    head[CONTENTS_AT..].copy_from_slice(&header.to_wire_bytes());
    head[..MAGIC_LEN].copy_from_slice(&DOWN_MAGIC);
    let total = match form {
        FrameForm::Short => PAYLOAD_AT + length,
        FrameForm::Full => {
            payload[length..].fill(0);
            FRAME_LEN
        }
    };
    let crc = crc32(&out[CONTENTS_AT..total]);
    out[CRC_AT..CONTENTS_AT].copy_from_slice(&crc.to_be_bytes());
    total
}
