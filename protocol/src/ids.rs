//! Small numbers of the link that must not be swapped by mistake.

use core::{fmt, num::NonZeroU8};

/// Number of a request, chosen by ground: 1..=255, wrapping, never 0 (ICD section 1).
///
/// Every answer carries its request's tag. 0 on the wire means *unsolicited* and is `None` here.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct RequestTag(NonZeroU8);

impl RequestTag {
    /// The first tag, 1.
    pub const FIRST: Self = Self(NonZeroU8::MIN);

    /// The tag of this value; `None` for 0, which means *unsolicited*.
    #[must_use]
    pub const fn new(value: u8) -> Option<Self> {
        match NonZeroU8::new(value) {
            Some(value) => Some(Self(value)),
            None => None,
        }
    }

    /// The value on the wire, 1..=255.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0.get()
    }

    /// The tag after this one; 255 is followed by 1.
    #[must_use]
    pub const fn next(self) -> Self {
        match self.0.checked_add(1) {
            Some(value) => Self(value),
            None => Self::FIRST,
        }
    }
}

impl fmt::Display for RequestTag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

/// Index of a 222-byte piece of an image, from 0.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct ChunkIndex(pub u16);

impl fmt::Display for ChunkIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

/// Uplink counter, the first 8 bytes of a nonce: microseconds since 1970 UTC or a sequence number, by profile.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct Counter(pub u64);

impl fmt::Display for Counter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

/// AES-GCM nonce of an uplink frame: counter, big-endian, then 4 random bytes fresh for each frame.
///
/// A nonce that repeats under one key gives away the authentication key (RFC 5116, 5.1.1). Whoever seals must have
/// committed it durably before the first byte goes out.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Nonce([u8; 12]);

impl Nonce {
    /// Counter and fresh random bytes.
    #[must_use]
    pub const fn new(counter: Counter, random: [u8; 4]) -> Self {
        let c = counter.0.to_be_bytes();
        Self([c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], random[0], random[1], random[2], random[3]])
    }

    /// The nonce as it stands in a frame.
    #[must_use]
    pub const fn from_bytes(bytes: [u8; 12]) -> Self {
        Self(bytes)
    }

    /// The counter part.
    #[must_use]
    pub const fn counter(&self) -> Counter {
        let n = &self.0;
        Counter(u64::from_be_bytes([n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7]]))
    }

    /// The random part.
    #[must_use]
    pub const fn random(&self) -> [u8; 4] {
        [self.0[8], self.0[9], self.0[10], self.0[11]]
    }

    /// The 12 bytes on the wire.
    #[must_use]
    pub const fn as_bytes(&self) -> &[u8; 12] {
        &self.0
    }
}

impl fmt::Display for Nonce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn tag_zero_does_not_exist_and_255_wraps_to_1() {
        assert_eq!(RequestTag::new(0), None);
        let last = RequestTag::new(255).unwrap();
        assert_eq!(last.next(), RequestTag::FIRST);
        assert_eq!(RequestTag::FIRST.next().get(), 2);
        assert_eq!(last.to_string(), "255");
    }

    #[test]
    fn nonce_is_counter_then_random() {
        let nonce = Nonce::new(Counter(0x0102_0304_0506_0708), [9, 10, 11, 12]);
        assert_eq!(nonce.as_bytes(), &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
        assert_eq!(nonce.counter(), Counter(0x0102_0304_0506_0708));
        assert_eq!(nonce.random(), [9, 10, 11, 12]);
        assert_eq!(nonce.to_string(), "0102030405060708090a0b0c");
        assert_eq!(Nonce::from_bytes(*nonce.as_bytes()), nonce);
    }
}
