//! Looking at a backup without using it.

use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};

use super::archive::{self, Opened};
use super::{BackupError, Manifest, failed};
use crate::storage::{DATABASE, examine_database};

/// A folder in the system's place for such, gone with its owner.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Reads the whole backup: every byte against its manifest, every page of its database. The database is unpacked into the
/// system's folder for temporary files (`TMPDIR`) meanwhile.
///
/// # Errors
/// [`BackupError::Damaged`] with what was noticed, [`BackupError::NewerSchema`], or what the system says.
pub async fn verify(file: &Path) -> Result<Manifest, BackupError> {
    let scratch = Scratch(std::env::temp_dir().join(format!("gs-backup-{}", uuid::Uuid::new_v4())));
    DirBuilder::new()
        .mode(0o700)
        .create(&scratch.0)
        .map_err(failed(&scratch.0, "cannot be made; TMPDIR names another folder"))?;
    Ok(open(file, &scratch.0.join(DATABASE)).await?.manifest)
}

/// Unpacks the database to `database`, and holds everything against everything.
pub(super) async fn open(file: &Path, database: &Path) -> Result<Opened, BackupError> {
    let (path, to) = (file.to_path_buf(), database.to_path_buf());
    let opened = tokio::task::spawn_blocking(move || archive::read(&path, &to))
        .await
        .map_err(|error| failed(file, "was not read")(std::io::Error::other(error)))??;
    let manifest = &opened.manifest;
    let known = migrations::newest_sqlite();
    if manifest.schema > known {
        return Err(BackupError::NewerSchema { found: manifest.schema, known });
    }
    let facts = examine_database(database).await?;
    let told =
        (&manifest.station, manifest.simulated, manifest.schema, manifest.last_event, manifest.last_frame);
    if told != (&facts.station, facts.simulated, facts.schema, facts.last_event, facts.last_frame) {
        let found = "its manifest tells of another database".to_owned();
        return Err(BackupError::Damaged { path: file.to_path_buf(), found });
    }
    Ok(opened)
}
