//! The server's own token: whoever can read its 0600 file owns the machine, and may do everything.

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use sha2::{Digest as _, Sha256};
use zeroize::Zeroizing;

/// Shorter tokens could be guessed.
const LEN_MIN: usize = 32;
/// Longer files are no token files.
const FILE_MAX: u64 = 256;

/// The secret; it never shows itself except by [`Token::reveal`].
#[derive(Clone)]
pub struct Token {
    secret: Zeroizing<String>,
    digest: [u8; 32],
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(redacted)")
    }
}

/// Why a token file was refused. `Display` names the remedy, never the content.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// It cannot be read or made.
    #[error("token file {} cannot be read or made", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Others may read it, or it belongs to somebody else.
    #[error("token file {} has mode {mode:04o} and owner {owner}: run `chmod 600` and `chown` on it, or remove it and a new one is made", path.display())]
    Exposed {
        /// Which file.
        path: PathBuf,
        /// Its permission bits.
        mode: u32,
        /// Its owner's number.
        owner: u32,
    },
    /// No token in it.
    #[error("token file {} holds no token of at least {LEN_MIN} visible characters: remove it and a new one is made", path.display())]
    Malformed {
        /// Which file.
        path: PathBuf,
    },
}

impl Token {
    /// A token from text; `None` when it is too short or holds anything but visible ASCII.
    #[must_use]
    pub fn new(secret: &str) -> Option<Self> {
        let legal = secret.len() >= LEN_MIN && secret.bytes().all(|b| b.is_ascii_graphic());
        legal.then(|| Self {
            secret: Zeroizing::new(secret.to_owned()),
            digest: Sha256::digest(secret).into(),
        })
    }

    /// Reads the token file; makes it, with mode 0600, when there is none.
    ///
    /// # Errors
    /// [`TokenError`] when it cannot be read or made, others may read it, it belongs to somebody else, or it holds no
    /// token.
    pub fn load_or_create(path: &Path) -> Result<Self, TokenError> {
        match Self::load(path) {
            Err(TokenError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
                Self::create(path)
            }
            other => other,
        }
    }

    /// Reads a token file.
    ///
    /// # Errors
    /// As [`Self::load_or_create`]; [`TokenError::Io`] when there is none.
    pub fn load(path: &Path) -> Result<Self, TokenError> {
        let failed = |source| TokenError::Io { path: path.to_owned(), source };
        let no_follow = OFlags::NOFOLLOW | OFlags::NONBLOCK;
        let file = OpenOptions::new()
            .read(true)
            .custom_flags(no_follow.bits().cast_signed())
            .open(path)
            .map_err(failed)?;
        let about = file.metadata().map_err(failed)?;
        let (mode, owner) = (about.mode() & 0o7777, about.uid());
        if !about.is_file() || mode & 0o077 != 0 || owner != rustix::process::geteuid().as_raw() {
            return Err(TokenError::Exposed { path: path.to_owned(), mode, owner });
        }
        let mut text = Zeroizing::new(String::with_capacity(FILE_MAX as usize + 1));
        file.take(FILE_MAX).read_to_string(&mut text).map_err(failed)?;
        Self::new(text.trim()).ok_or_else(|| TokenError::Malformed { path: path.to_owned() })
    }

    fn create(path: &Path) -> Result<Self, TokenError> {
        let failed = |source| TokenError::Io { path: path.to_owned(), source };
        let mut bytes = Zeroizing::new([0; 32]);
        getrandom::fill(bytes.as_mut()).map_err(|error| failed(io::Error::other(error.to_string())))?;
        let secret = Zeroizing::new(hex::encode(bytes.as_ref()));
        let mut file: File =
            OpenOptions::new().write(true).create_new(true).mode(0o600).open(path).map_err(failed)?;
        file.write_all(secret.as_bytes())
            .and_then(|()| file.write_all(b"\n"))
            .and_then(|()| file.sync_all())
            .map_err(failed)?;
        Self::new(&secret).ok_or_else(|| TokenError::Malformed { path: path.to_owned() })
    }

    /// The secret itself: for the address that is printed for its owner.
    #[must_use]
    pub fn reveal(&self) -> &str {
        &self.secret
    }

    /// Whether this is the token; takes as long for a near miss as for a wild guess.
    #[must_use]
    pub fn matches(&self, given: &str) -> bool {
        let given: [u8; 32] = Sha256::digest(given).into();
        // No early end: every byte is compared.
        self.digest.iter().zip(given).fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt as _;

    #[test]
    fn a_missing_file_is_made_once_and_for_its_owner_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        let first = Token::load_or_create(&path).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().mode() & 0o777, 0o600);
        let second = Token::load_or_create(&path).unwrap();
        assert!(second.matches(first.reveal()));
        assert!(!second.matches("") && !second.matches(&first.reveal()[1..]));
        assert!(!format!("{first:?}").contains(first.reveal()));
    }

    #[test]
    fn a_file_that_others_may_read_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        Token::load_or_create(&path).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).unwrap();
        let error = Token::load_or_create(&path).unwrap_err();
        assert!(error.to_string().contains("0644"), "{error}");
    }

    #[test]
    fn a_short_token_a_symbolic_link_and_a_folder_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        std::fs::write(&path, "hello\n").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
        assert!(matches!(Token::load_or_create(&path), Err(TokenError::Malformed { .. })));
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        assert!(matches!(Token::load_or_create(&link), Err(TokenError::Io { .. })));
        assert!(Token::load_or_create(folder.path()).is_err());
    }
}
