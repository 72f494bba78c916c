//! A secret, from a file that only its owner can read, or from the environment. Read anew each time, never kept.

use std::fs::OpenOptions;
use std::io::{self, Read as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use zeroize::Zeroizing;

use crate::config::environment_secret;

/// Longer files are none.
const FILE_MAX: u64 = 4096;

/// Where a secret stands.
#[derive(Debug, Clone)]
pub(crate) enum SecretSource {
    File(PathBuf),
    Environment(String),
}

/// Why there is none. Names the remedy, never the content.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SecretError {
    #[error("secret file {} cannot be read ({source})", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("secret file {} may be read by others or belongs to somebody else: run `chmod 600` and `chown` on it", .0.display())]
    Exposed(PathBuf),
    #[error("secret file {} has not exactly one line with the secret (lines with # are remarks)", .0.display())]
    Shape(PathBuf),
    #[error("the environment has no {0}: set it for the server, or name a secret_file")]
    Unset(String),
}

impl SecretSource {
    pub(crate) fn of(file: Option<&PathBuf>, variable: Option<&String>) -> Option<Self> {
        let file = file.cloned().map(Self::File);
        file.or_else(|| variable.cloned().map(Self::Environment))
    }

    pub(crate) async fn load(&self) -> Result<Zeroizing<String>, SecretError> {
        match self {
            Self::Environment(name) => environment_secret(name)
                .map(|secret| Zeroizing::new(secret.trim().to_owned()))
                .ok_or_else(|| SecretError::Unset(name.clone())),
            Self::File(path) => {
                let path = path.clone();
                let failed = path.clone();
                tokio::task::spawn_blocking(move || from_file(&path))
                    .await
                    .map_err(|error| SecretError::Read { path: failed, source: io::Error::other(error) })?
            }
        }
    }
}

/// The one line of a private file; the error is words with the remedy, never the content.
pub(crate) fn secret_of_file(path: &Path) -> Result<Zeroizing<String>, String> {
    from_file(path).map_err(|error| error.to_string())
}

fn from_file(path: &Path) -> Result<Zeroizing<String>, SecretError> {
    let failed = |source| SecretError::Read { path: path.to_owned(), source };
    // A pipe in its place cannot hold us up.
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
    let file =
        OpenOptions::new().read(true).custom_flags(flags.bits().cast_signed()).open(path).map_err(failed)?;
    let about = file.metadata().map_err(failed)?;
    let is_ours = about.uid() == rustix::process::geteuid().as_raw();
    if !about.is_file() || about.mode() & 0o077 != 0 || !is_ours {
        return Err(SecretError::Exposed(path.to_owned()));
    }
    // Room for all of it: a string that grows leaves copies behind.
    let mut text = Zeroizing::new(String::with_capacity(FILE_MAX as usize + 1));
    file.take(FILE_MAX).read_to_string(&mut text).map_err(failed)?;
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    match (lines.next(), lines.next()) {
        (Some(secret), None) => Ok(Zeroizing::new(secret.to_owned())),
        _ => Err(SecretError::Shape(path.to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt as _;

    #[test]
    fn one_line_of_a_private_file_is_taken_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("secret");
        let put = |text: &str, mode: u32| {
            std::fs::write(&path, text).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            from_file(&path)
        };
        assert_eq!(put("# of the mail server\n hunter2 \n", 0o600).unwrap().as_str(), "hunter2");
        assert!(matches!(put("hunter2\n", 0o640), Err(SecretError::Exposed(_))));
        assert!(matches!(put("", 0o600), Err(SecretError::Shape(_))));
        let error = put("hunter2\nhunter3\n", 0o600).unwrap_err();
        assert!(matches!(error, SecretError::Shape(_)) && !error.to_string().contains("hunter"));
        assert!(matches!(from_file(&folder.path().join("no")), Err(SecretError::Read { .. })));
    }
}
