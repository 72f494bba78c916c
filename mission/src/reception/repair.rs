//! One flipped bit, found by what it does to the checksum.
//!
//! A CRC is linear: a flipped bit changes it by a pattern that depends on the bit's distance to the end alone. The table
//! of these patterns, made from the polynomial, names the bit. That the result has a right checksum is then no proof of
//! anything: of random bytes behind a magic, one in some 100,000 can be repaired as well.

use std::sync::LazyLock;

use protocol::{DOWN_CONTENTS_MAX, DownFrame, FRAME_LEN, MAGIC_LEN, SHORT_OVERHEAD, crc32};

/// CRC-32/ISO-HDLC, reflected.
const POLYNOMIAL: u32 = 0xEDB8_8320;
/// Offset of the checksum in a frame.
const CRC_AT: usize = MAGIC_LEN;
/// Offset of what the checksum covers.
const CONTENTS_AT: usize = CRC_AT + 4;

/// A frame that one flipped bit makes of a damaged one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repair {
    /// The frame with the bit turned back.
    pub bytes: Box<[u8]>,
    /// Which bit of it, from the first bit of the magic; within a byte the most significant is the first.
    pub bit: u16,
}

/// What each bit of the contents does to the checksum, by syndrome: (syndrome, bytes behind it, bit mask).
static SYNDROMES: LazyLock<Vec<(u32, u16, u8)>> = LazyLock::new(|| {
    let step = |mut register: u32| {
        for _ in 0..8 {
            register = register >> 1 ^ if register & 1 == 1 { POLYNOMIAL } else { 0 };
        }
        register
    };
    let mut table = Vec::with_capacity(DOWN_CONTENTS_MAX * 8);
    for bit in 0..8 {
        let mask = 1_u8 << bit;
        let mut register = step(u32::from(mask));
        for behind in 0..DOWN_CONTENTS_MAX as u16 {
            table.push((register, behind, mask));
            register = step(register);
        }
    }
    table.sort_unstable();
    table
});

/// The byte of `frame` (with its mask) that, flipped, makes its checksum right; `None` when no single one does.
fn culprit(frame: &[u8]) -> Option<(usize, u8)> {
    let contents = frame.get(CONTENTS_AT..)?;
    let told = u32::from_be_bytes(frame.get(CRC_AT..CONTENTS_AT)?.try_into().ok()?);
    let syndrome = told ^ crc32(contents);
    if syndrome.count_ones() == 1 {
        // In the checksum itself; big-endian on the wire.
        let bit = 31 - syndrome.trailing_zeros() as usize;
        return Some((CRC_AT + bit / 8, 0x80 >> (bit % 8)));
    }
    let at = SYNDROMES.binary_search_by_key(&syndrome, |&(syndrome, ..)| syndrome).ok()?;
    let (_, behind, mask) = SYNDROMES[at];
    let at = frame.len().checked_sub(1 + usize::from(behind))?;
    (at >= CONTENTS_AT).then_some((at, mask))
}

/// The one frame that a single flipped bit makes of bytes that begin with the magic; `None` when there is none or more
/// than one. Tried are the length that the header tells, that header with one bit of its length flipped, all bytes, and
/// 240.
pub fn repair(bytes: &[u8]) -> Option<Repair> {
    let header = bytes.get(..SHORT_OVERHEAD)?;
    let told = u16::from_be_bytes([header[SHORT_OVERHEAD - 2], header[SHORT_OVERHEAD - 1]]);
    let flipped = (0..16).map(|bit| told ^ 1 << bit);
    let mut lengths: Vec<usize> =
        std::iter::once(told).chain(flipped).map(|length| SHORT_OVERHEAD + usize::from(length)).collect();
    lengths.extend([bytes.len(), FRAME_LEN]);
    lengths.retain(|length| (SHORT_OVERHEAD..=FRAME_LEN.min(bytes.len())).contains(length));
    lengths.sort_unstable();
    lengths.dedup();
    let mut found: Option<Repair> = None;
    for length in lengths {
        let mut candidate = bytes[..length].to_vec();
        let Some((at, mask)) = culprit(&candidate) else { continue };
        candidate[at] ^= mask;
        if DownFrame::parse(&candidate).is_err() {
            continue;
        }
        let bit = (at * 8) as u16 + mask.leading_zeros() as u16;
        if found.as_ref().is_some_and(|other| *other.bytes != *candidate) {
            return None;
        }
        found = Some(Repair { bytes: candidate.into(), bit });
    }
    found
}

#[cfg(test)]
mod tests {
    use protocol::{Downlink, FrameForm, encode_down};

    use super::*;

    fn frames() -> Vec<Vec<u8>> {
        let mut out = [0; FRAME_LEN];
        let chunk = Downlink::ImageChunk(protocol::ImageChunk {
            index: protocol::ChunkIndex(7),
            data: std::array::from_fn(|i| (i * 37) as u8),
        });
        let mut made = Vec::new();
        for (packet, form) in
            [(Downlink::Pong, FrameForm::Short), (Downlink::Pong, FrameForm::Full), (chunk, FrameForm::Full)]
        {
            let length = encode_down(&packet, protocol::RequestTag::new(9), form, &mut out);
            made.push(out[..length].to_vec());
        }
        made
    }

    #[test]
    fn every_single_bit_behind_the_magic_is_found() {
        for frame in frames() {
            for bit in MAGIC_LEN * 8..frame.len() * 8 {
                let mut damaged = frame.clone();
                damaged[bit / 8] ^= 0x80 >> (bit % 8);
                let repair = repair(&damaged).unwrap_or_else(|| panic!("bit {bit} of {}", frame.len()));
                assert_eq!((&*repair.bytes, usize::from(repair.bit)), (&*frame, bit));
            }
        }
    }

    #[test]
    fn no_two_bits_have_the_same_syndrome() {
        let distinct: std::collections::BTreeSet<u32> = SYNDROMES.iter().map(|&(s, ..)| s).collect();
        assert_eq!(distinct.len(), DOWN_CONTENTS_MAX * 8);
        assert!(distinct.iter().all(|syndrome| syndrome.count_ones() > 1), "told from those of the checksum");
    }

    #[test]
    fn two_flipped_bits_are_not_taken_for_one() {
        for frame in frames() {
            let bits = frame.len() * 8;
            for first in (MAGIC_LEN * 8..bits).step_by(5) {
                for second in (first + 1..bits).step_by(7) {
                    let mut damaged = frame.clone();
                    damaged[first / 8] ^= 0x80 >> (first % 8);
                    damaged[second / 8] ^= 0x80 >> (second % 8);
                    assert_ne!(repair(&damaged).map(|r| r.bytes), Some(frame.clone().into()));
                }
            }
        }
    }
}
