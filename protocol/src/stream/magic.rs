//! Finding a magic quickly.

use crate::MAGIC_LEN;

/// Bytes looked at together; the compiler turns each group into a few vector instructions.
const GROUP: usize = 32;

/// Offset of the first whole `magic` in `bytes`.
///
/// The first byte of a magic must not occur again in it (true for both), so groups without that byte are passed over.
pub(super) fn find(bytes: &[u8], magic: &[u8; MAGIC_LEN]) -> Option<usize> {
    let first = magic[0];
    let mut at = 0;
    let (groups, _) = bytes.as_chunks::<GROUP>();
    for group in groups {
        if group.iter().fold(false, |any, byte| any | (*byte == first))
            && let Some(found) = find_start(bytes, magic, at, at + GROUP)
        {
            return Some(found);
        }
        at += GROUP;
    }
    find_start(bytes, magic, at, bytes.len())
}

/// First offset in `from..to` where the whole magic stands; it may reach beyond `to`.
fn find_start(bytes: &[u8], magic: &[u8; MAGIC_LEN], from: usize, to: usize) -> Option<usize> {
    (from..to.min(bytes.len())).find(|at| bytes[*at] == magic[0] && bytes[*at..].starts_with(magic))
}

/// How many bytes at the end of `bytes` could be the beginning of a magic that goes on.
pub(super) fn partial(bytes: &[u8], magic: &[u8; MAGIC_LEN]) -> usize {
    (1..MAGIC_LEN).rev().find(|len| bytes.ends_with(&magic[..*len])).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DOWN_MAGIC, UP_MAGIC};
    use std::vec::Vec;

    #[test]
    fn the_first_byte_of_a_magic_occurs_once_in_it() {
        for magic in [DOWN_MAGIC, UP_MAGIC] {
            assert!(!magic[1..].contains(&magic[0]));
        }
    }

    #[test]
    fn finds_the_first_wherever_it_stands() {
        for len in 0..120usize {
            let mut bytes: Vec<u8> = (0..len).map(|i| if i % 5 == 0 { b'P' } else { b'I' }).collect();
            assert_eq!(find(&bytes, &DOWN_MAGIC), None);
            for at in (0..len.saturating_sub(7)).rev() {
                bytes[at..at + 8].copy_from_slice(&DOWN_MAGIC);
                assert_eq!(find(&bytes, &DOWN_MAGIC), Some(at), "{len} {at}");
            }
        }
    }

    #[test]
    fn partial_is_the_longest_beginning_at_the_end() {
        for (text, len) in [("", 0), ("P", 1), ("PP", 1), ("xPIXEL", 5), ("PIXELSAT", 0), ("PIXELSATPI", 2)] {
            assert_eq!(partial(text.as_bytes(), &DOWN_MAGIC), len, "{text}");
        }
    }
}
