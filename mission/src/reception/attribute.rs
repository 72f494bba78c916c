//! Whose bytes are these: by their content, never by what somebody called them.

use std::borrow::Cow;

use protocol::{DOWN_MAGIC, DownFrame, FRAME_LEN, SHORT_OVERHEAD};

use super::repair::{Repair, repair};

/// Bytes of a radio's own header that may stand before the magic.
const HEADER_MAX: usize = 3;
/// First bytes of the network's test packets.
const TEST_PACKET: &[u8] = b"TinyGS-test";

/// What stood around a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Trim {
    /// Whole bytes before the magic.
    pub bytes: u8,
    /// Bits before that, 0 to 7: the receiver took noise for the first bits.
    pub bits: u8,
    /// Bytes behind the frame.
    pub behind: u8,
}

/// What bytes turned out to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Attribution {
    /// A frame: magic and checksum are right.
    Frame {
        /// The frame alone.
        bytes: Box<[u8]>,
        /// What stood around it.
        trim: Trim,
    },
    /// The magic is there, no checksum is right.
    Damaged {
        /// What one flipped bit would make of it.
        offered: Option<Repair>,
    },
    /// A test packet of TinyGS.
    Test,
    /// No magic where one may stand.
    Foreign,
}

/// Looks for the magic at byte offsets 0 to 3, there at the seven bit shifts, and takes what the checksum confirms.
///
/// With a right magic and no right checksum it is damaged, and one flipped bit is looked for.
pub fn attribute(delivered: &[u8]) -> Attribution {
    if delivered.starts_with(TEST_PACKET) {
        return Attribution::Test;
    }
    let mut damaged: Option<Cow<'_, [u8]>> = None;
    for bits in 0..8_u8 {
        for bytes in 0..=HEADER_MAX {
            let Some(rest) = delivered.get(bytes..) else { break };
            if !begins_with_magic(rest, bits) {
                continue;
            }
            let aligned = shifted(rest, bits);
            if let Some(frame) = frame_at_start(&aligned) {
                let trim = Trim {
                    bytes: bytes as u8,
                    bits,
                    behind: u8::try_from(aligned.len() - frame.len()).unwrap_or(u8::MAX),
                };
                return Attribution::Frame { bytes: frame.into(), trim };
            }
            damaged.get_or_insert(aligned);
        }
    }
    match damaged {
        Some(aligned) => Attribution::Damaged { offered: repair(&aligned) },
        None => Attribution::Foreign,
    }
}

fn begins_with_magic(bytes: &[u8], bits: u8) -> bool {
    if bits == 0 {
        return bytes.starts_with(&DOWN_MAGIC);
    }
    let Some(window) = bytes.get(..=DOWN_MAGIC.len()) else { return false };
    window.windows(2).zip(DOWN_MAGIC).all(|(pair, want)| pair[0] << bits | pair[1] >> (8 - bits) == want)
}

/// The bytes without their first bits; the last byte is filled up with zeros.
fn shifted(bytes: &[u8], bits: u8) -> Cow<'_, [u8]> {
    if bits == 0 {
        return Cow::Borrowed(bytes);
    }
    let next = bytes.iter().skip(1).copied().chain(std::iter::once(0));
    bytes.iter().zip(next).map(|(byte, next)| byte << bits | next >> (8 - bits)).collect()
}

/// The frame at the beginning, in the form that its checksum confirms: short first, as the ICD has it.
fn frame_at_start(bytes: &[u8]) -> Option<&[u8]> {
    let header = bytes.get(SHORT_OVERHEAD - 2..SHORT_OVERHEAD)?;
    let told = SHORT_OVERHEAD + usize::from(u16::from_be_bytes([header[0], header[1]]));
    let forms = [told, FRAME_LEN];
    forms.into_iter().filter_map(|length| bytes.get(..length)).find(|frame| DownFrame::parse(frame).is_ok())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use protocol::{Downlink, FrameForm, RequestTag, encode_down};

    use super::*;

    fn frame(form: FrameForm) -> Vec<u8> {
        let mut out = [0xA5; FRAME_LEN];
        let chunk = Downlink::ImageChunk(protocol::ImageChunk {
            index: protocol::ChunkIndex(3),
            data: std::array::from_fn(|i| (i * 31) as u8),
        });
        let packet = if form == FrameForm::Full { chunk } else { Downlink::Pong };
        let length = encode_down(&packet, RequestTag::new(7), form, &mut out);
        out[..length].to_vec()
    }

    #[test]
    fn the_example_of_the_documentation_is_ours_with_and_without_a_header() {
        let short = [0x50, 0x49, 0x58, 0x45, 0x4C, 0x53, 0x41, 0x54, 0x24, 0x0B, 0xC9, 0x99, 0, 7, 0, 0];
        let ours = |header: &[u8]| {
            let delivered = [header, &short].concat();
            let trim = Trim { bytes: header.len() as u8, ..Trim::default() };
            assert_eq!(attribute(&delivered), Attribution::Frame { bytes: short.into(), trim });
        };
        ours(&[]);
        ours(&[0xDE, 0x70, 0x19]);
        assert_eq!(
            attribute(&[&[0; 4][..], &short].concat()),
            Attribution::Foreign,
            "four bytes are too many"
        );
    }

    #[test]
    fn test_packets_and_strangers_are_not_ours() {
        assert_eq!(attribute(b"TinyGS-test PIXELSAT"), Attribution::Test);
        assert_eq!(attribute(b""), Attribution::Foreign);
        assert_eq!(attribute(b"PIXELSA"), Attribution::Foreign);
        assert_eq!(attribute(b"another satellite says PIXELSAT"), Attribution::Foreign);
        assert_eq!(attribute(b"PIXELSAT"), Attribution::Damaged { offered: None });
    }

    proptest! {
        #[test]
        fn a_frame_is_found_behind_any_header_and_any_shift(
            full in any::<bool>(),
            header in prop::collection::vec(any::<u8>(), 0..=HEADER_MAX),
            bits in 0_u8..8,
            noise in any::<u8>(),
            junk in prop::collection::vec(any::<u8>(), 1..9),
        ) {
            let frame = frame(if full { FrameForm::Full } else { FrameForm::Short });
            let whole = [&header[..], &frame, &junk].concat();
            // `bits` spurious bits first: everything moves back.
            let mut before = noise;
            let delivered: Vec<u8> = if bits == 0 { whole } else {
                whole.iter().chain(std::iter::once(&0)).map(|&byte| {
                    let out = before << (8 - bits) | byte >> bits;
                    before = byte;
                    out
                }).collect()
            };
            let Attribution::Frame { bytes, trim } = attribute(&delivered) else {
                return Err(TestCaseError::fail("not found"));
            };
            prop_assert_eq!(&*bytes, &frame[..]);
            prop_assert_eq!((usize::from(trim.bytes), trim.bits), (header.len(), bits));
        }

        #[test]
        fn what_is_found_is_a_frame_and_anything_may_come(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            if let Attribution::Frame { bytes, .. } = attribute(&bytes) {
                prop_assert!(DownFrame::parse(&bytes).is_ok());
            }
        }

        #[test]
        fn what_is_offered_is_one_bit_away(at in 64_usize..1920, cut in 0_usize..3) {
            let mut damaged = frame(FrameForm::Full);
            damaged[at / 8] ^= 0x80 >> (at % 8);
            damaged.extend(std::iter::repeat_n(0x55, cut));
            let Attribution::Damaged { offered: Some(offer) } = attribute(&damaged) else {
                return Err(TestCaseError::fail("no offer"));
            };
            prop_assert_eq!(usize::from(offer.bit), at);
            prop_assert_eq!(offer.bytes.to_vec(), frame(FrameForm::Full));
        }
    }
}
