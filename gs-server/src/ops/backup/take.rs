//! Taking a backup: a copy of the database, packed under a name of its own, synced, and only then given its name.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::Read as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use mission::UtcUs;
use zeroize::Zeroizing;

use super::archive::Writer;
use super::{BackupError, CONFIGURATION, FORMAT, Manifest, failed, own_file, sync_folder};
use crate::config::Config;
use crate::storage::{DATABASE, copy_database, examine_database};
use crate::witness::WitnessFolder;

/// What a backup is taken of.
#[derive(Debug, Clone)]
pub struct Source {
    /// The data folder; a server may work in it.
    pub folder: PathBuf,
    /// The configuration, if it is to go along.
    pub config: Option<PathBuf>,
}

/// Files that go away with their owner, however it ends (but for a `kill -9`: the next backup takes their place).
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Takes a backup to `target`. A file that has this name stays whole until the new one is durable, and goes then.
///
/// # Errors
/// [`BackupError`]; nothing has changed at `target` then.
pub async fn take(source: &Source, target: &Path, now: UtcUs) -> Result<Manifest, BackupError> {
    if !source.folder.join(DATABASE).is_file() {
        return Err(BackupError::NoDataFolder(source.folder.clone()));
    }
    let beside = |end: &str| {
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        Temporary(target.with_file_name(format!(".{name}.{end}")))
    };
    let (packed, copy) = (beside("new"), beside("sqlite3"));
    let file = only_one(&packed.0, target)?;
    // `vacuum into` wants a new or empty file; an empty one of ours keeps others from reading it.
    drop(own_file(&copy.0).map_err(failed(&copy.0, "cannot be written"))?);
    copy_database(&source.folder, &copy.0).await?;
    let facts = examine_database(&copy.0).await?;

    let taken_at = rfc3339(now);
    let describe = move |files| Manifest {
        format: FORMAT.to_owned(),
        program: env!("CARGO_PKG_VERSION").to_owned(),
        station: facts.station,
        simulated: facts.simulated,
        taken_at,
        schema: facts.schema,
        last_event: facts.last_event,
        last_frame: facts.last_frame,
        files,
    };
    let (source, target) = (source.clone(), target.to_path_buf());
    let pack = move || {
        let mut writer = Writer::new(file, u64::try_from(now.0 / 1_000_000).unwrap_or(0));
        writer.add_file(DATABASE, &copy.0).map_err(failed(&packed.0, "cannot be written"))?;
        // After the database: where the witness has gone on, its counters are the higher ones.
        let witness = source.folder.join("witness");
        if witness.is_dir() {
            let folder = WitnessFolder::open(&witness).map_err(failed(&witness, "cannot be opened"))?;
            for (key, counter) in folder.all().map_err(failed(&witness, "cannot be read"))? {
                let name = format!("witness/{key}");
                writer
                    .add_bytes(&name, WitnessFolder::text(key, counter).as_bytes())
                    .map_err(failed(&packed.0, "cannot be written"))?;
            }
        }
        if let Some(config) = &source.config {
            let text = std::fs::read(config).map_err(failed(config, "cannot be read"))?;
            writer.add_bytes(CONFIGURATION, &text).map_err(failed(&packed.0, "cannot be written"))?;
        }
        let manifest = writer.finish(describe).map_err(failed(&packed.0, "cannot be written"))?;
        std::fs::rename(&packed.0, &target).map_err(failed(&target, "cannot be written"))?;
        sync_folder(&target).map_err(failed(&target, "cannot be made durable"))?;
        Ok(manifest)
    };
    tokio::task::spawn_blocking(pack).await.map_err(|error| {
        failed(&PathBuf::from("the backup"), "was not packed")(std::io::Error::other(error))
    })?
}

/// The file that becomes the backup, held so that a second backup to the same name does not write into it.
fn only_one(path: &Path, target: &Path) -> Result<File, BackupError> {
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(path)
        .map_err(failed(path, "cannot be written"))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(BackupError::UnderWay(target.to_path_buf())),
        Err(TryLockError::Error(error)) => return Err(failed(path, "cannot be locked")(error)),
    }
    file.set_len(0).map_err(failed(path, "cannot be written"))?;
    Ok(file)
}

/// Copies the key files of the configuration into one tar file of their own, mode 0600. Returns how many.
///
/// # Errors
/// [`BackupError::Exists`] when the file is there already; [`BackupError::Io`].
pub fn copy_keys(config: &Config, to: &Path) -> Result<usize, BackupError> {
    let file =
        OpenOptions::new().write(true).create_new(true).mode(0o600).open(to).map_err(|error| match error
            .kind()
        {
            std::io::ErrorKind::AlreadyExists => BackupError::Exists(to.to_path_buf()),
            _ => failed(to, "cannot be written")(error),
        })?;
    let unfinished = Temporary(to.to_path_buf());
    let mut tar = tar::Builder::new(file);
    let mut count = 0;
    for satellite in &config.satellites {
        let Some(path) = &satellite.key_file else { continue };
        // Room for all of it at once: growing would leave a copy behind.
        let mut content = Zeroizing::new(Vec::with_capacity(2048));
        File::open(path)
            .and_then(|file| file.take(1024).read_to_end(&mut content))
            .map_err(failed(path, "cannot be read"))?;
        let mut header = tar::Header::new_gnu();
        header.set_size(content.len() as u64);
        header.set_mode(0o600);
        header.set_entry_type(tar::EntryType::Regular);
        tar.append_data(&mut header, format!("{}.key", satellite.name), content.as_slice())
            .map_err(failed(to, "cannot be written"))?;
        count += 1;
    }
    tar.into_inner().and_then(|file| file.sync_all()).map_err(failed(to, "cannot be written"))?;
    sync_folder(to).map_err(failed(to, "cannot be made durable"))?;
    std::mem::forget(unfinished);
    Ok(count)
}

/// A time as it stands in manifests.
fn rfc3339(at: UtcUs) -> String {
    jiff::Timestamp::from_microsecond(at.0).map_or_else(|_| at.0.to_string(), |at| format!("{at:.3}"))
}
