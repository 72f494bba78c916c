//! The uplink key, and the id that everything else mentions instead of it.

use core::{fmt, str::FromStr};

use sha2::{Digest, Sha256};
use zeroize::{Zeroize, ZeroizeOnDrop};

use crate::TextError;

/// AES-128 key shared with one satellite. Wiped when dropped; it never shows itself.
#[derive(Clone, Zeroize, ZeroizeOnDrop)]
pub struct Key([u8; 16]);

impl Key {
    /// Takes the 16 bytes; the caller wipes its own copy.
    #[must_use]
    pub const fn from_bytes(bytes: [u8; 16]) -> Self {
        Self(bytes)
    }

    /// The public name of this key.
    #[must_use]
    pub fn id(&self) -> KeyId {
        let hash = Sha256::digest(self.0);
        KeyId([hash[0], hash[1], hash[2], hash[3]])
    }

    pub(crate) const fn as_bytes(&self) -> &[u8; 16] {
        &self.0
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Key({}, redacted)", self.id())
    }
}

/// First 4 bytes of the SHA-256 of a key, written as 8 lower-case hex digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct KeyId([u8; 4]);

impl KeyId {
    /// The id of these bytes, as read back from a database row.
    #[must_use]
    pub const fn from_bytes(bytes: [u8; 4]) -> Self {
        Self(bytes)
    }

    /// The 4 bytes.
    #[must_use]
    pub const fn as_bytes(&self) -> &[u8; 4] {
        &self.0
    }
}

impl fmt::Display for KeyId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for KeyId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "KeyId({self})")
    }
}

impl FromStr for KeyId {
    type Err = TextError;

    /// # Errors
    /// [`TextError::KeyId`] unless the text is exactly 8 hex digits (upper case is accepted).
    fn from_str(text: &str) -> Result<Self, TextError> {
        let digits: &[u8; 8] = text.as_bytes().try_into().map_err(|_| TextError::KeyId)?;
        let mut id = [0; 4];
        for (byte, pair) in id.iter_mut().zip(digits.as_chunks::<2>().0) {
            let [high, low] = pair.map(|digit| char::from(digit).to_digit(16));
            let (Some(high), Some(low)) = (high, low) else { return Err(TextError::KeyId) };
            *byte = (high << 4 | low) as u8;
        }
        Ok(Self(id))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{format, string::ToString};

    #[test]
    fn id_is_the_head_of_sha256_in_hex() {
        // sha256 of 16 zero bytes begins 374708ff
        let key = Key::from_bytes([0; 16]);
        assert_eq!(key.id().to_string(), "374708ff");
        assert_eq!("374708FF".parse::<KeyId>(), Ok(key.id()));
        for bad in ["", "374708f", "374708ff0", "374708fg", "+74708ff", "é4708ff"] {
            assert_eq!(bad.parse::<KeyId>(), Err(TextError::KeyId), "{bad}");
        }
    }

    #[test]
    fn debug_shows_no_key_byte() {
        let text = format!("{:?}", Key::from_bytes([0xAB; 16]));
        assert!(text.contains("redacted"));
        assert!(!text.to_lowercase().contains("abab") && !text.contains("171"));
    }
}
