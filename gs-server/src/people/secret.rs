//! Random secrets: handed out once, kept as SHA-256.

use std::fmt;

use sha2::{Digest as _, Sha256};
use zeroize::Zeroizing;

use super::PeopleError;

/// 256 random bits as text. It shows itself by [`Secret::reveal`] only.
#[derive(Clone)]
pub struct Secret(Zeroizing<String>);

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(redacted)")
    }
}

impl Secret {
    /// A new one from the operating system, with a word before it by which scanners and people know what it is.
    pub(super) fn new(word: &str) -> Result<Self, PeopleError> {
        let mut bytes = Zeroizing::new([0; 32]);
        getrandom::fill(bytes.as_mut()).map_err(|_| PeopleError::NoRandomness)?;
        Ok(Self(Zeroizing::new(format!("{word}{}", hex::encode(bytes.as_ref())))))
    }

    /// The text itself, for its owner.
    #[must_use]
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

/// What is stored of a secret.
pub(super) fn hash(secret: &str) -> Vec<u8> {
    Sha256::digest(secret).to_vec()
}

/// The word that a page has to send with each write: it follows from the session's token, which pages of others cannot
/// read.
pub(super) fn csrf(token: &str) -> String {
    let mut digest = Sha256::new();
    digest.update(b"csrf\0");
    digest.update(token);
    hex::encode(digest.finalize())
}

/// Whether two texts are the same; takes as long for a near miss as for a wild guess.
pub(super) fn same(a: &str, b: &str) -> bool {
    let (a, b) = (Sha256::digest(a), Sha256::digest(b));
    a.iter().zip(b.iter()).fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
}
