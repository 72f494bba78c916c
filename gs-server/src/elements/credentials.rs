//! The name and password of a source, from a file that only its owner can read.

use std::fmt;
use std::fs::OpenOptions;
use std::io::{self, Read as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use zeroize::Zeroizing;

/// Longer files are none.
const FILE_MAX: u64 = 1024;

/// Never shows itself; wiped when dropped.
pub(super) struct Credentials {
    pub(super) identity: Zeroizing<String>,
    pub(super) password: Zeroizing<String>,
}

impl fmt::Debug for Credentials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Credentials(redacted)")
    }
}

/// Why a file was refused. Names the remedy, never the content.
#[derive(Debug, thiserror::Error)]
pub(super) enum CredentialsError {
    #[error("credentials file {} cannot be read ({source})", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("credentials file {} may be read by others or belongs to somebody else: run `chmod 600` and `chown` on it", .0.display())]
    Exposed(PathBuf),
    #[error(
        "credentials file {} has not two lines, identity and password (lines with # are remarks)",
        .0.display()
    )]
    Shape(PathBuf),
}

impl Credentials {
    pub(super) fn load(path: &Path) -> Result<Self, CredentialsError> {
        let failed = |source| CredentialsError::Read { path: path.to_owned(), source };
        // A pipe in its place cannot hold us up.
        let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
        let file = OpenOptions::new()
            .read(true)
            .custom_flags(flags.bits().cast_signed())
            .open(path)
            .map_err(failed)?;
        let about = file.metadata().map_err(failed)?;
        if !about.is_file() || about.mode() & 0o077 != 0 || about.uid() != rustix::process::geteuid().as_raw()
        {
            return Err(CredentialsError::Exposed(path.to_owned()));
        }
        // Room for all of it: a string that grows leaves copies behind.
        let mut text = Zeroizing::new(String::with_capacity(FILE_MAX as usize + 1));
        file.take(FILE_MAX).read_to_string(&mut text).map_err(failed)?;
        let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        match (lines.next(), lines.next(), lines.next()) {
            (Some(identity), Some(password), None) => Ok(Self {
                identity: Zeroizing::new(identity.to_owned()),
                password: Zeroizing::new(password.to_owned()),
            }),
            _ => Err(CredentialsError::Shape(path.to_owned())),
        }
    }

    /// The body of the login: `identity=…&password=…`.
    pub(super) fn form(&self) -> Zeroizing<String> {
        let mut form = Zeroizing::new(String::with_capacity(6 * FILE_MAX as usize));
        form.push_str("identity=");
        encode(&self.identity, &mut form);
        form.push_str("&password=");
        encode(&self.password, &mut form);
        form
    }
}

fn encode(text: &str, into: &mut String) {
    const HEX: &[u8; 16] = b"0123456789ABCDEF";
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'.' | b'_' | b'~') {
            into.push(char::from(byte));
        } else {
            into.push('%');
            into.push(char::from(HEX[usize::from(byte >> 4)]));
            into.push(char::from(HEX[usize::from(byte & 15)]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt as _;

    #[test]
    fn two_lines_of_a_private_file_are_taken_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("login");
        let put = |text: &str, mode: u32| {
            std::fs::write(&path, text).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            Credentials::load(&path)
        };
        let good = put("# Space-Track\nme@uni.ch\nhunter 2&=ö\n", 0o600).unwrap();
        assert_eq!(good.form().as_str(), "identity=me%40uni.ch&password=hunter%202%26%3D%C3%B6");
        assert!(!format!("{good:?}").contains("hunter"));
        assert!(matches!(put("a\nb\n", 0o640), Err(CredentialsError::Exposed(_))));
        assert!(matches!(put("a\n", 0o600), Err(CredentialsError::Shape(_))));
        assert!(matches!(put("a\nb\nc\n", 0o600), Err(CredentialsError::Shape(_))));
        assert!(matches!(Credentials::load(&folder.path().join("no")), Err(CredentialsError::Read { .. })));
    }
}
