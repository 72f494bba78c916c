//! Putting a backup back: into an empty folder, marked so that nothing is sealed until somebody has looked.

use std::io::Write as _;
use std::path::Path;

use super::{BackupError, Manifest, failed, make_folder, own_file, sync_folder, verify};
use crate::storage::{DATABASE, doubt_forwards};
use crate::witness::WitnessFolder;

/// Puts `backup` into `folder`, which is made, or empty. The folder becomes a data folder with its last step; before, a
/// server that is started in it finds no archive.
///
/// The configuration of the backup is put there as `restored-station.toml`, to be read, not to be run.
///
/// # Errors
/// [`BackupError`]; what was unpacked is gone then, the folder stays.
pub async fn restore(backup: &Path, folder: &Path) -> Result<Manifest, BackupError> {
    make_folder(folder)?;
    let is_empty = folder.read_dir().map_err(failed(folder, "cannot be read"))?.next().is_none();
    if !is_empty {
        return Err(BackupError::NotEmpty(folder.to_path_buf()));
    }
    let result = fill(backup, folder).await;
    if result.is_err() {
        let _ = std::fs::remove_dir_all(folder.join("witness"));
        for name in [INCOMING, RESTORED_CONFIGURATION] {
            let _ = std::fs::remove_file(folder.join(name));
        }
    }
    result
}

const INCOMING: &str = "ground.sqlite3.incoming";
const RESTORED_CONFIGURATION: &str = "restored-station.toml";

async fn fill(backup: &Path, folder: &Path) -> Result<Manifest, BackupError> {
    let incoming = folder.join(INCOMING);
    let opened = verify::open(backup, &incoming).await?;
    let manifest = opened.manifest;
    doubt_forwards(&incoming).await?;
    // First the mark, then the archive.
    let path = folder.join("witness");
    let witness = WitnessFolder::open(&path).map_err(failed(&path, "cannot be made"))?;
    let mut known = Vec::new();
    for (id, content) in &opened.witness {
        known.extend(WitnessFolder::parse_text(id, content));
    }
    let remark = format!("restored from a backup that was taken at {}", manifest.taken_at);
    witness.mark_restored(&known, &remark).map_err(failed(&path, "cannot be written"))?;
    if let Some(text) = &opened.configuration {
        let path = folder.join(RESTORED_CONFIGURATION);
        own_file(&path)
            .and_then(|mut file| file.write_all(text).and_then(|()| file.sync_all()))
            .map_err(failed(&path, "cannot be written"))?;
    }
    let database = folder.join(DATABASE);
    std::fs::rename(&incoming, &database).map_err(failed(&database, "cannot be put in its place"))?;
    sync_folder(&database).map_err(failed(folder, "cannot be made durable"))?;
    sync_folder(folder).map_err(failed(folder, "cannot be made durable"))?;
    Ok(manifest)
}
