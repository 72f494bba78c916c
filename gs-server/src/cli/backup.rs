//! `gs-server backup`, `backup verify`, `restore`.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use mission::Clock as _;
use serde::Serialize;

use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::clock::SystemClock;
use crate::config::Config;
use crate::ops::backup::{self, BackupError, Manifest, Source};

/// `gs-server backup`.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "\
Examples:
  gs-server backup --config /etc/pixelsat-ground/station.toml /backup/ground.tar
  gs-server backup --data /var/lib/pixelsat-ground /backup/ground.tar --json
  gs-server backup --config station.toml /backup/ground.tar --with-keys /media/safe/keys.tar
  gs-server backup verify /backup/ground.tar

The server may run and write meanwhile. In the file: the database as it is at one moment, the
witness, the configuration, a manifest with SHA-256 of each. Keys and the token are never in it.
The file appears whole or not at all; one that has its name stays whole until then. Exit code 3
if another backup to the same name is under way, or if the archive is a PostgreSQL: that is backed
up with pg_dump (docs/storage.md)."
)]
pub struct Backup {
    #[command(subcommand)]
    verb: Option<Verb>,
    /// The file to write, e.g. /backup/ground.tar
    #[arg(value_name = "TARGET", required = true)]
    target: Option<PathBuf>,
    #[command(flatten)]
    of: Of,
    /// Copy the key files to this new file, too, mode 0600; keep it elsewhere than the backup
    #[arg(long, value_name = "FILE", requires = "config")]
    with_keys: Option<PathBuf>,
    /// One JSON object at the end: the manifest
    #[arg(long)]
    json: bool,
}

/// Of which station.
#[derive(Debug, Args)]
#[group(required = true, multiple = true)]
struct Of {
    /// The configuration; it goes into the backup
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The data folder, before what the configuration says
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Read a backup to its end: every byte against its manifest, every page of its database
    #[command(after_help = "\
Example:
  gs-server backup verify /backup/ground.tar

The database is unpacked into TMPDIR meanwhile. Exit code 1 if anything is not as it was written, 3
if a newer program took it.")]
    Verify(Verify),
}

#[derive(Debug, Args)]
struct Verify {
    /// The backup
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// One JSON object at the end: the manifest
    #[arg(long)]
    json: bool,
}

/// `gs-server restore`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server restore /backup/ground.tar --to /var/lib/pixelsat-ground

The folder must not exist, or be empty. The backup is checked first. What was restored receives
and shows everything, and seals nothing until an operator has confirmed the counter of each key:
  gs-server key confirm --config station.toml
because counters may have been radiated that the backup does not know. See that the clock is right
before: sealing goes on above it. The configuration of the backup is put beside the archive as
restored-station.toml. Exit code 3 if the folder is not empty.")]
pub struct Restore {
    /// The backup
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The data folder to make
    #[arg(long, value_name = "DIR")]
    to: PathBuf,
    /// One JSON object at the end: the manifest
    #[arg(long)]
    json: bool,
}

impl Backup {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match (self.verb, self.target) {
            (Some(Verb::Verify(verify)), _) => {
                let manifest = runtime()?.block_on(backup::verify(&verify.file)).map_err(failure)?;
                tell(&manifest, verify.json, format_args!("{} is whole", verify.file.display()))
            }
            (None, Some(target)) => take(&target, &self.of, self.with_keys.as_deref(), self.json),
            (None, None) => Err(Failure::usage("name the file to write")),
        }
    }
}

fn take(target: &Path, of: &Of, with_keys: Option<&Path>, json: bool) -> Result<Exit, Failure> {
    let config = of.config.as_deref().map(Config::load).transpose().map_err(Failure::usage)?;
    if let Some(database) = config.as_ref().and_then(|config| config.storage.database.clone()) {
        return Err(failure(BackupError::Postgres(database)));
    }
    let folder = match (&of.data, &config) {
        (Some(data), _) => data.clone(),
        (None, Some(config)) => config.storage.folder.clone(),
        (None, None) => return Err(Failure::usage("give --config or --data")),
    };
    if target.is_dir() || target.file_name().is_none() {
        return Err(Failure::usage(format!("{} is a folder: name a file in it", target.display())));
    }
    let source = Source { folder, config: of.config.clone() };
    let now = SystemClock::new().now().utc;
    let manifest = runtime()?.block_on(backup::take(&source, target, now)).map_err(failure)?;
    if let (Some(to), Some(config)) = (with_keys, &config) {
        let count = backup::copy_keys(config, to).map_err(failure)?;
        eprintln!("gs-server: {count} key files are in {}: keep it away from the backup", to.display());
    }
    tell(&manifest, json, format_args!("{} is written", target.display()))
}

impl Restore {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let manifest = runtime()?.block_on(backup::restore(&self.file, &self.to)).map_err(failure)?;
        let told = format_args!(
            "{} is a data folder now; it seals nothing until the counter of each key is confirmed",
            self.to.display()
        );
        tell(&manifest, self.json, told)
    }
}

#[derive(Serialize)]
struct Told<'a> {
    ok: bool,
    #[serde(flatten)]
    manifest: &'a Manifest,
}

fn tell(manifest: &Manifest, json: bool, done: std::fmt::Arguments<'_>) -> Result<Exit, Failure> {
    if json {
        print_json(&Told { ok: true, manifest })?;
    } else {
        let bytes: u64 = manifest.files.iter().map(|file| file.bytes).sum();
        print_line(done)?;
        print_line(format_args!(
            "station {}{}, taken {}, {} frames, {} events, schema {}, {bytes} bytes in {} files",
            manifest.station,
            if manifest.simulated { " (simulated)" } else { "" },
            manifest.taken_at,
            manifest.last_frame,
            manifest.last_event,
            manifest.schema,
            manifest.files.len(),
        ))?;
    }
    Ok(Exit::Done)
}

fn failure(error: BackupError) -> Failure {
    match &error {
        BackupError::NoDataFolder(_) => Failure::usage(error),
        refusal if refusal.is_refusal() => Failure::refused(error),
        _ => Failure::failed(error),
    }
}
