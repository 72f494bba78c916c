//! CRC-32/ISO-HDLC (zlib, Ethernet), the checksum of both frames (ICD section 1).

use ::crc::{CRC_32_ISO_HDLC, Crc, Table};

static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// CRC-32/ISO-HDLC of `bytes`; `b"123456789"` gives 0xCBF43926.
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// The CRC of `head ‖ tail`, given that of `head`: a full frame goes on where its short reading stopped.
pub(crate) fn crc32_continue(head_crc: u32, tail: &[u8]) -> u32 {
    // The catalogue value is finalised (inverted); the register wants it un-inverted, bit-reversed as its initial.
    let mut digest = CRC.digest_with_initial((!head_crc).reverse_bits());
    digest.update(tail);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn check_value_of_the_catalogue() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
        assert_eq!(crc32(b""), 0);
    }

    #[test]
    fn continuing_equals_one_shot() {
        let bytes: std::vec::Vec<u8> = (0..228u32).map(|i| (i * 37 + 11) as u8).collect();
        for cut in 0..=bytes.len() {
            let (head, tail) = bytes.split_at(cut);
            assert_eq!(crc32_continue(crc32(head), tail), crc32(&bytes), "cut at {cut}");
        }
    }
}
