//! The file with the database's password.

use std::fs::OpenOptions;
use std::io::Read as _;
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::Path;

use zeroize::Zeroizing;

use crate::storage::StoreError;

/// Longer passwords are none.
const MOST_BYTES: u64 = 1024;

/// The first line of a file that nobody else may read.
pub(super) fn read(path: &Path) -> Result<Zeroizing<String>, StoreError> {
    let wrong = |problem: &'static str| StoreError::PasswordFile { path: path.to_path_buf(), problem };
    let flags = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
    let file = OpenOptions::new()
        .read(true)
        .custom_flags(flags.bits().cast_signed())
        .open(path)
        .map_err(|error| StoreError::from_io(path, error))?;
    let about = file.metadata().map_err(|error| StoreError::from_io(path, error))?;
    if !about.is_file() {
        return Err(wrong("it is no regular file"));
    }
    if about.mode() & 0o077 != 0 || about.uid() != rustix::process::geteuid().as_raw() {
        return Err(wrong("others may read it, or it is not ours: chown it to this user and chmod 600"));
    }
    // As large as it can get, so that no reallocation leaves a copy behind.
    let mut text = Zeroizing::new(String::with_capacity(2048));
    file.take(MOST_BYTES + 1).read_to_string(&mut text).map_err(|error| StoreError::from_io(path, error))?;
    let line = text.lines().next().unwrap_or_default();
    if line.is_empty() || text.len() as u64 > MOST_BYTES {
        return Err(wrong("it does not begin with a line of at most 1024 bytes"));
    }
    Ok(Zeroizing::new(line.to_owned()))
}
