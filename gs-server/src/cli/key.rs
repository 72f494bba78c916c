//! `gs-server key new|list`.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde::Serialize;
use zeroize::Zeroizing;

use super::shell::{fill_random, print_json, print_line};
use super::{Exit, Failure};
use crate::keys;

/// `gs-server key`.
#[derive(Debug, Subcommand)]
pub enum Key {
    /// Make a new key file, readable by you alone
    #[command(after_help = "\
Examples:
  gs-server key new                              a file in this folder, named by the key's id
  gs-server key new /etc/pixelsat/uplink.key
  gs-server key new twin.key --simulated --json

The key itself is never printed: copy the file to whoever loads it into the satellite. What is
printed is its id, by which everything else names it. An existing file is never overwritten.")]
    New(New),
    /// List key files: id, mark, and whether the server would take them
    #[command(after_help = "\
Examples:
  gs-server key list /etc/pixelsat
  gs-server key list a.key b.key --json

Exit code 3 if a file named on the command line would be refused.")]
    List(List),
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
        }
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
