//! Backups: one tar file with the database as it is at one moment, the witness, the configuration, and a manifest.
//!
//! | step | what |
//! |---|---|
//! | [`take`] | beside a server that writes; the file appears whole or not at all |
//! | [`verify`] | every byte against the manifest, every page of the database |
//! | [`restore`] | into an empty folder, which seals nothing until an operator has confirmed the counter |
//!
//! Members, in this order: `ground.sqlite3`, `witness/<key id>`, `station.toml` (when the configuration is known),
//! `manifest.json`. The witness is there so that its counters are known, never to be put back as a witness: see
//! [`crate::witness`].
//!
//! What it does **not** do: hold keys or the token. Keys are copied only by [`copy_keys`], to a file of their own.

mod archive;
mod restore;
mod take;
mod verify;

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::storage::StoreError;

pub use restore::restore;
pub use take::{Source, copy_keys, take};
pub use verify::verify;

/// First word of a manifest: what it is, and the version of its form.
const FORMAT: &str = "pixelsat-backup-1";
/// The member that says what the others must be.
const MANIFEST: &str = "manifest.json";
/// The member with the configuration.
const CONFIGURATION: &str = "station.toml";
/// More than any configuration or manifest has.
const TEXT_MAX: u64 = 1 << 20;

/// What a backup says of itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// What this is: `pixelsat-backup-1`.
    pub format: String,
    /// Version of the program that took it.
    pub program: String,
    /// Whose archive it is.
    pub station: String,
    /// What it holds is made up.
    pub simulated: bool,
    /// When it was taken, RFC 3339 in UTC.
    pub taken_at: String,
    /// The newest step of the schema.
    pub schema: i64,
    /// The place of the newest event.
    pub last_event: i64,
    /// The number of the newest raw frame.
    pub last_frame: i64,
    /// The members, in their order.
    pub files: Vec<Member>,
}

/// One file of a backup.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// Its size.
    pub bytes: u64,
    /// SHA-256 of its content, hex digits.
    pub sha256: String,
}

/// Why there is no backup, or nothing was restored.
#[derive(Debug, thiserror::Error)]
pub enum BackupError {
    /// The database.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A file.
    #[error("{} {what}", path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// What could not be done with it.
        what: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// There is nothing to take a backup of.
    #[error("{} is no data folder: there is no ground.sqlite3. Name the folder with --data, or the configuration with --config; an archive in PostgreSQL is backed up with pg_dump", .0.display())]
    NoDataFolder(PathBuf),
    /// The archive is no file.
    #[error(
        "the archive is a PostgreSQL: take its backup with `pg_dump --format=custom --file=ground.dump {0}`, and leave witness/ where it is (docs/storage.md, Backup)"
    )]
    Postgres(String),
    /// Two at once.
    #[error("another backup to {} is under way: wait for it, or choose another name", .0.display())]
    UnderWay(PathBuf),
    /// The file is not what was written.
    #[error("{} is damaged or no backup: {found}. Take an older one", path.display())]
    Damaged {
        /// Which.
        path: PathBuf,
        /// What was noticed.
        found: String,
    },
    /// Made by a program that knows more.
    #[error(
        "the backup has schema {found}, this program knows up to {known}: restore with the newer program that took it"
    )]
    NewerSchema {
        /// Of the backup.
        found: i64,
        /// The newest step that this program has.
        known: i64,
    },
    /// Something lies there already.
    #[error("{} is not empty: nothing is ever restored over anything. Name a folder that does not exist yet", .0.display())]
    NotEmpty(PathBuf),
    /// The file with keys would be written over.
    #[error("{} exists already: keys are never written over anything. Name another file", .0.display())]
    Exists(PathBuf),
}

impl BackupError {
    /// It could be done and must not, as opposed to: it was tried and did not work.
    #[must_use]
    pub fn is_refusal(&self) -> bool {
        matches!(
            self,
            Self::Postgres(_)
                | Self::UnderWay(_)
                | Self::NewerSchema { .. }
                | Self::NotEmpty(_)
                | Self::Exists(_)
        )
    }
}

/// Puts the path and what was tried to an error of the system.
fn failed(path: &Path, what: &'static str) -> impl FnOnce(io::Error) -> BackupError {
    let path = path.to_path_buf();
    move |source| match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => StoreError::Full.into(),
        _ => BackupError::Io { path, what, source },
    }
}

/// Makes the folder that backups go to, with mode 0700, when there is none.
///
/// # Errors
/// [`BackupError::Io`].
pub fn make_folder(folder: &Path) -> Result<(), BackupError> {
    std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        .map_err(failed(folder, "cannot be made"))
}

/// A new or emptied file that nobody else may read.
fn own_file(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(true).mode(0o600).open(path)
}

fn sync_folder(path: &Path) -> io::Result<()> {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    File::open(parent.unwrap_or_else(|| Path::new(".")))?.sync_all()
}
