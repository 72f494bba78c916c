//! Sealing and opening uplink frames with AES-128-GCM (ICD section 1).
//!
//! The satellite's order is tag, counter, CRC, header, payload; [`open`] checks the tag only, and [`OpenedContents`] has
//! the later steps as separate calls, so that the counter can be checked and stored between them.

use core::fmt;

use aes_gcm::{
    Aes128Gcm,
    aead::{AeadInOut, KeyInit},
};
use zeroize::{Zeroize, ZeroizeOnDrop};

use crate::{
    CrcMismatch, FRAME_LEN, FrameError, HEADER_LEN, Header, Key, MAGIC_LEN, Nonce, OpenError, PayloadError,
    RequestTag, Telecommand, UP_MAGIC, UP_PAYLOAD_MAX, UP_PLAINTEXT_LEN, crc32, header::CRC_AT,
};

const NONCE_AT: usize = CRC_AT + 4;
const CIPHERTEXT_AT: usize = NONCE_AT + 12;
const TAG_AT: usize = CIPHERTEXT_AT + UP_PLAINTEXT_LEN;
const _: () = assert!(TAG_AT + 16 == FRAME_LEN);

/// One uplink frame as it goes on the air: 240 bytes that begin with the magic. Only its key can tell more.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct SealedUplink([u8; FRAME_LEN]);

impl SealedUplink {
    /// The frame in these bytes.
    ///
    /// # Errors
    /// [`FrameError::Magic`] when they do not begin with the magic.
    pub fn from_bytes(bytes: [u8; FRAME_LEN]) -> Result<Self, FrameError> {
        if bytes.starts_with(&UP_MAGIC) { Ok(Self(bytes)) } else { Err(FrameError::Magic) }
    }

    /// The frame, magic first.
    #[must_use]
    pub const fn as_bytes(&self) -> &[u8; FRAME_LEN] {
        &self.0
    }

    /// The nonce, which is not secret.
    #[must_use]
    pub fn nonce(&self) -> Nonce {
        Nonce::from_bytes(self.part(NONCE_AT))
    }

    /// The checksum of the plaintext, which travels in the clear.
    #[must_use]
    pub fn crc(&self) -> u32 {
        u32::from_be_bytes(self.part(CRC_AT))
    }

    fn part<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut out = [0; N];
        out.copy_from_slice(&self.0[at..at + N]);
        out
    }
}

impl fmt::Debug for SealedUplink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SealedUplink(nonce {})", self.nonce())
    }
}

impl TryFrom<&[u8]> for SealedUplink {
    type Error = FrameError;

    /// # Errors
    /// When there are not 240 bytes or they do not begin with the magic.
    fn try_from(bytes: &[u8]) -> Result<Self, FrameError> {
        let found = bytes.len();
        Self::from_bytes(bytes.try_into().map_err(|_| FrameError::Length { found })?)
    }
}

/// Seals one request. Total: it does not judge the request, see [`Telecommand::validate`].
///
/// `nonce` must never have been used under this key and must be durable before the frame goes out; `padding` is fresh
/// random bytes, of which the tail behind the payload is used. With other padding equal requests would show by their
/// equal checksums.
#[must_use]
pub fn seal(
    key: &Key,
    nonce: Nonce,
    tag: RequestTag,
    command: &Telecommand,
    padding: &[u8; UP_PLAINTEXT_LEN],
) -> SealedUplink {
    let mut payload = [0; UP_PAYLOAD_MAX];
    let length = command.encode_payload(&mut payload);
    let mut plaintext = *padding;
    let header = Header { packet_type: command.packet_type(), tag: tag.get(), length: length as u16 };
    plaintext[..HEADER_LEN].copy_from_slice(&header.to_wire_bytes());
    plaintext[HEADER_LEN..HEADER_LEN + length].copy_from_slice(&payload[..length]);
    let frame = seal_plaintext(key, nonce, &plaintext);
    plaintext.zeroize();
    payload.zeroize();
    frame
}

/// Seals any 200 bytes under their own checksum: what tests and twins need to send what no ground would.
#[must_use]
pub fn seal_plaintext(key: &Key, nonce: Nonce, plaintext: &[u8; UP_PLAINTEXT_LEN]) -> SealedUplink {
    seal_raw(key, nonce, crc32(plaintext), plaintext)
}

/// Seals any 200 bytes beside any checksum.
#[must_use]
pub fn seal_raw(key: &Key, nonce: Nonce, crc: u32, plaintext: &[u8; UP_PLAINTEXT_LEN]) -> SealedUplink {
    let mut frame = [0; FRAME_LEN];
    frame[..MAGIC_LEN].copy_from_slice(&UP_MAGIC);
    frame[CRC_AT..NONCE_AT].copy_from_slice(&crc.to_be_bytes());
    frame[NONCE_AT..CIPHERTEXT_AT].copy_from_slice(nonce.as_bytes());
    frame[CIPHERTEXT_AT..TAG_AT].copy_from_slice(plaintext);
    let (head, tag_place) = frame.split_at_mut(TAG_AT);
    let sealed = cipher(key).encrypt_inout_detached(
        &(*nonce.as_bytes()).into(),
        &[],
        (&mut head[CIPHERTEXT_AT..]).into(),
    );
    match sealed {
        Ok(tag) => tag_place.copy_from_slice(&tag),
        // GCM refuses texts over 64 GiB only; should it ever refuse ours, no plaintext leaves.
        Err(_) => head[CIPHERTEXT_AT..].fill(0),
    }
    SealedUplink(frame)
}

/// Opens a frame: the GCM tag alone decides.
///
/// # Errors
/// [`OpenError::Authentication`] for another key, a forgery or damage.
pub fn open(key: &Key, frame: &SealedUplink) -> Result<OpenedContents, OpenError> {
    let mut plaintext: [u8; UP_PLAINTEXT_LEN] = frame.part(CIPHERTEXT_AT);
    let tag: [u8; 16] = frame.part(TAG_AT);
    let nonce = frame.nonce();
    let opened = cipher(key).decrypt_inout_detached(
        &(*nonce.as_bytes()).into(),
        &[],
        (&mut plaintext[..]).into(),
        &tag.into(),
    );
    match opened {
        Ok(()) => Ok(OpenedContents { nonce: *nonce.as_bytes(), plaintext, crc_field: frame.crc() }),
        Err(_) => {
            plaintext.zeroize();
            Err(OpenError::Authentication)
        }
    }
}

fn cipher(key: &Key) -> Aes128Gcm {
    Aes128Gcm::new(&(*key.as_bytes()).into())
}

/// Contents of an authentic uplink. Wiped when dropped.
#[derive(Clone, Zeroize, ZeroizeOnDrop)]
pub struct OpenedContents {
    nonce: [u8; 12],
    plaintext: [u8; UP_PLAINTEXT_LEN],
    crc_field: u32,
}

impl OpenedContents {
    /// The nonce, whose counter is checked next.
    #[must_use]
    pub const fn nonce(&self) -> Nonce {
        Nonce::from_bytes(self.nonce)
    }

    /// Whether the plaintext matches the checksum beside it.
    ///
    /// # Errors
    /// [`CrcMismatch`] with both values.
    pub fn check_crc(&self) -> Result<(), CrcMismatch> {
        let (found, computed) = (self.crc_field, crc32(&self.plaintext));
        if found == computed { Ok(()) } else { Err(CrcMismatch { found, computed }) }
    }

    /// The header as it stands.
    #[must_use]
    pub const fn header(&self) -> Header {
        let p = &self.plaintext;
        Header::from_wire_bytes([p[0], p[1], p[2], p[3]])
    }

    /// Tag of the request; `None` for 0, which no ground may send.
    #[must_use]
    pub const fn tag(&self) -> Option<RequestTag> {
        self.header().request_tag()
    }

    /// The payload, without padding.
    ///
    /// # Errors
    /// [`PayloadError::HeaderLength`] when the header claims more than 196 bytes.
    pub fn payload(&self) -> Result<&[u8], PayloadError> {
        let found = self.header().length;
        self.plaintext
            .get(HEADER_LEN..HEADER_LEN + usize::from(found))
            .ok_or(PayloadError::HeaderLength { found, max: UP_PAYLOAD_MAX as u16 })
    }

    /// The request inside.
    ///
    /// # Errors
    /// When the header or the payload does not follow the ICD.
    pub fn telecommand(&self) -> Result<Telecommand, PayloadError> {
        Telecommand::decode(self.header().packet_type, self.payload()?)
    }

    /// All 200 bytes, padding included.
    #[must_use]
    pub const fn plaintext(&self) -> &[u8; UP_PLAINTEXT_LEN] {
        &self.plaintext
    }
}

impl fmt::Debug for OpenedContents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "OpenedContents(nonce {}, redacted)", self.nonce())
    }
}
