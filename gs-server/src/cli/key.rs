//! `gs-server key new|list|confirm`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use api::{CounterConfirmation, SealingView, StationView};
use clap::{Args, Subcommand};
use protocol::KeyId;
use serde::Serialize;
use zeroize::Zeroizing;

use super::elements::Of;
use super::plans::{failure, server};
use super::shell::{fill_random, print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::clock::wall_sleep;
use crate::elements::{Remote, RemoteError};
use crate::keys;

/// A confirmed key is looked at so often, and so far apart, until it is unlocked.
const LOOKS: u32 = 100;
const BETWEEN_LOOKS: Duration = Duration::from_millis(100);

/// `gs-server key`.
#[derive(Debug, Subcommand)]
pub enum Key {
    /// Make a new key file, readable by you alone
    #[command(after_help = "\
Examples:
  gs-server key new                              a file in this folder, named by the key's id
  gs-server key new /etc/pixelsat-ground/uplink.key
  gs-server key new twin.key --simulated --json

The key itself is never printed: copy the file to whoever loads it into the satellite. What is
printed is its id, by which everything else names it. An existing file is never overwritten.")]
    New(New),
    /// List key files: id, mark, and whether the server would take them
    #[command(after_help = "\
Examples:
  gs-server key list /etc/pixelsat-ground
  gs-server key list a.key b.key --json

Exit code 3 if a file named on the command line would be refused.")]
    List(List),
    /// Confirm the counter of a key whose sealing is locked, as after a restore
    #[command(after_help = "\
Examples:
  gs-server key confirm --config station.toml
  gs-server key confirm --config station.toml 374708ff
  gs-server key confirm --config station.toml 374708ff --above 1048576

Asked of the running server. Find out first why it is locked (`gs-server doctor` and the page say so), and
see that the clock is right: sealing goes on above the clock and above every counter that is known.
A key whose counter is a sequence has no clock to go on above: after a restore, or when the witness was
lost, it needs --above with the highest counter that may have been used. The satellite knows the last
one it took; if nobody does, add a generous margin to what is known.
Exit code 3 when the server refuses.")]
    Confirm(Confirm),
}

/// `gs-server key new`.
#[derive(Debug, Args)]
pub struct New {
    /// The file to make, or a folder: then the file is named by the key's id [default: this folder]
    #[arg(value_name = "FILE", default_value = ".", hide_default_value = true)]
    path: PathBuf,
    /// Name the file by the key's id; FILE is a folder, made if need be
    #[arg(long)]
    id: bool,
    /// For a simulated satellite: no real link will use this key
    #[arg(long)]
    simulated: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// `gs-server key list`.
#[derive(Debug, Args)]
pub struct List {
    /// Key files, or folders of them (files that end in .key)
    #[arg(value_name = "FOLDER|FILE", default_value = ".")]
    paths: Vec<PathBuf>,
    /// One JSON object per key on standard output
    #[arg(long)]
    json: bool,
}

/// `gs-server key confirm`.
#[derive(Debug, Args)]
pub struct Confirm {
    #[command(flatten)]
    of: Of,
    /// The id of the key; not needed where the station has one key
    #[arg(value_name = "KEY")]
    key: Option<KeyId>,
    /// Go on above this counter, too
    #[arg(long, value_name = "N")]
    above: Option<u64>,
    /// One JSON object on standard output: how it stands with sealing
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Row<'a> {
    key: Option<String>,
    simulated: Option<bool>,
    file: &'a Path,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
}

impl Key {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::New(new) => new.run(),
            Self::List(list) => list.run(),
            Self::Confirm(confirm) => confirm.run(),
        }
    }
}

impl Confirm {
    fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let (key, sealing) = runtime()?
            .block_on(confirm(&remote, self.key, self.above))
            .map_err(failure)?
            .map_err(Failure::usage)?;
        if let Some(why) = sealing.as_ref().and_then(|sealing| sealing.locked.as_ref()) {
            return Err(Failure::refused(format!("key {key} is confirmed, and still locked: {why}")));
        }
        match self.json {
            true => print_json(&sealing)?,
            false => print_line(format_args!("key {key} is confirmed: it may seal"))?,
        }
        Ok(Exit::Done)
    }
}

/// Confirms a key, and waits a little until it is unlocked: first the archive, then the witness is written.
async fn confirm(
    remote: &Remote,
    key: Option<KeyId>,
    above: Option<u64>,
) -> Result<Result<(String, Option<SealingView>), String>, RemoteError> {
    let key = match key {
        Some(key) => key.to_string(),
        None => match only(remote.get("station", &[]).await?) {
            Ok(key) => key,
            Err(why) => return Ok(Err(why)),
        },
    };
    remote.write(&format!("keys/{key}/confirm-counter"), &CounterConfirmation { above }).await?;
    let mut looks = 0;
    loop {
        let station: StationView = remote.get("station", &[]).await?;
        let sealing = station.sealing.into_iter().find(|sealing| sealing.key == key);
        looks += 1;
        if looks == LOOKS || sealing.as_ref().is_none_or(|sealing| sealing.locked.is_none()) {
            return Ok(Ok((key, sealing)));
        }
        wall_sleep(BETWEEN_LOOKS).await;
    }
}

/// The station's key, where it has one.
fn only(station: StationView) -> Result<String, String> {
    let keys: Vec<String> = station.sealing.into_iter().map(|sealing| sealing.key).collect();
    match &keys[..] {
        [key] => Ok(key.clone()),
        [] => Err("the station has no key".to_owned()),
        several => Err(format!("name one of the station's keys: {}", several.join(", "))),
    }
}

impl New {
    fn run(self) -> Result<Exit, Failure> {
        let mut bytes = Zeroizing::new([0; 16]);
        fill_random(bytes.as_mut_slice())?;
        let path = if self.id || self.path.is_dir() {
            if self.id && !self.path.exists() {
                std::fs::create_dir_all(&self.path).map_err(|e| {
                    Failure::doing(format!("folder {} cannot be made", self.path.display()), e)
                })?;
            }
            self.path.join(format!("{}.key", keys::key_id(&bytes)))
        } else {
            self.path
        };
        let id = keys::create(&path, &mut bytes, self.simulated).map_err(Failure::refused)?;
        if self.json {
            let row = Row {
                key: Some(id.to_string()),
                simulated: Some(self.simulated),
                file: &path,
                refused: None,
            };
            print_json(&row)?;
        } else {
            print_line(format_args!("{id}  {}", path.display()))?;
        }
        Ok(Exit::Done)
    }
}

impl List {
    fn run(self) -> Result<Exit, Failure> {
        let mut exit = Exit::Done;
        for path in &self.paths {
            if path.is_dir() {
                for file in key_files(path)? {
                    self.row(&file)?;
                }
            } else if !self.row(path)? {
                exit = Exit::Refused;
            }
        }
        Ok(exit)
    }

    /// Tells of one file; false if it would be refused.
    fn row(&self, file: &Path) -> Result<bool, Failure> {
        let (read, refused) = match keys::load(file) {
            Ok(read) => (Some(read), None),
            Err(error) => {
                let reason = std::error::Error::source(&error).map(|source| format!(": {source}"));
                (None, Some(format!("{error}{}", reason.unwrap_or_default())))
            }
        };
        let id = read.as_ref().map(|read| read.id().to_string());
        let simulated = read.as_ref().map(|read| read.simulated);
        if self.json {
            print_json(&Row { key: id, simulated, file, refused: refused.clone() })?;
        } else {
            let mark = match simulated {
                Some(true) => "simulated",
                Some(false) => "real     ",
                None => "refused  ",
            };
            let id = id.unwrap_or_else(|| "--------".into());
            print_line(format_args!("{id}  {mark}  {}", file.display()))?;
            if let Some(reason) = &refused {
                eprintln!("gs-server: {reason}");
            }
        }
        Ok(refused.is_none())
    }
}

fn key_files(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let fail = |error| Failure::doing(format!("folder {} cannot be listed", folder.display()), error);
    let mut files = Vec::new();
    for entry in folder.read_dir().map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.extension().is_some_and(|ending| ending == "key") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
