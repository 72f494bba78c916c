//! What strangers deliver as bytes of a packet.

use mission::reception::{Attribution, attribute};
use protocol::DownFrame;

/// Any bytes as a packet that somebody received: what is taken for a frame is one and stands where it is said to stand,
/// and what is offered as a repair is one bit away from what was there.
pub fn reception(data: &[u8]) {
    match attribute(data) {
        Attribution::Frame { bytes, trim } => {
            assert!(DownFrame::parse(&bytes).is_ok(), "no frame");
            assert!(trim.bytes <= 3 && trim.bits < 8);
            if trim.bits == 0 {
                let at = usize::from(trim.bytes);
                assert_eq!(data.get(at..at + bytes.len()), Some(&*bytes), "it stands elsewhere");
            }
        }
        Attribution::Damaged { offered: Some(offer) } => {
            assert!(DownFrame::parse(&offer.bytes).is_ok(), "the offer is no frame");
            let at = usize::from(offer.bit) / 8;
            let mut before = offer.bytes.to_vec();
            before[at] ^= 0x80 >> (offer.bit % 8);
            assert!(DownFrame::parse(&before).is_err(), "it was one before");
            if before.starts_with(b"PIXELSAT") && data.starts_with(b"PIXELSAT") {
                assert!(data.starts_with(&before), "more than one bit was changed");
            }
        }
        Attribution::Damaged { offered: None } | Attribution::Test | Attribution::Foreign => {}
    }
}
