//! `gs-server elements add|list|fetch|check|prelaunch`.

mod add;
mod check;
mod fetch;
mod list;
mod prelaunch;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use super::serve::{failure, is_refusal};
use super::{Exit, Failure};
use crate::config::Config;
use crate::elements::{Offline, Remote, RemoteError};
use crate::run::RunError;
use crate::storage::StoreError;

/// Bytes that a file of elements may have.
const FILE_MAX: u64 = 64 << 20;

/// `gs-server elements`.
#[derive(Debug, Subcommand)]
pub enum Elements {
    /// Give the station elements from a file, in any form
    Add(add::Add),
    /// Show the elements that the station holds, their age, and how it stands with the sources
    List(list::List),
    /// Ask the sources of the configuration now, as far as they allow
    Fetch(fetch::Fetch),
    /// Say what is in a file of elements and what is wrong with it; needs no configuration
    Check(check::Check),
    /// Make elements before there are any: from a state vector, or for another lift-off time
    Prelaunch(prelaunch::Prelaunch),
}

impl Elements {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::Add(verb) => verb.run(),
            Self::List(verb) => verb.run(),
            Self::Fetch(verb) => verb.run(),
            Self::Check(verb) => verb.run(),
            Self::Prelaunch(verb) => verb.run(),
        }
    }
}

/// The configuration of the station that is meant.
#[derive(Debug, Args)]
pub(super) struct Of {
    /// The configuration of the station
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
}

impl Of {
    pub(super) fn load(&self) -> Result<Config, Failure> {
        load(&self.config)
    }
}

fn load(path: &Path) -> Result<Config, Failure> {
    let config = Config::load(path).map_err(Failure::usage)?;
    config.check().map_err(Failure::usage)?;
    Ok(config)
}

/// The station: its server where one runs, else its archive.
enum Station {
    Running(Remote),
    Stopped(Box<Offline>),
}

impl Station {
    async fn of(config: &Config) -> Result<Self, Failure> {
        match Offline::open(config).await {
            Ok(offline) => Ok(Self::Stopped(Box::new(offline))),
            Err(RunError::Store(StoreError::Locked { .. })) => running(config).map(Self::Running),
            Err(error) => Err(failure(error)),
        }
    }
}

fn running(config: &Config) -> Result<Remote, Failure> {
    Remote::new(config).map_err(remote_failure)
}

fn remote_failure(error: RemoteError) -> Failure {
    match error {
        RemoteError::Refused(_) | RemoteError::Busy(_) | RemoteError::Token(_) => Failure::refused(error),
        RemoteError::NoPort => Failure::usage(error),
        _ => Failure::failed(error),
    }
}

fn store_failure(error: StoreError) -> Failure {
    if is_refusal(&error) { Failure::refused(error) } else { Failure::failed(error) }
}

/// A file, or standard input for `-`.
fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    let name = file.display();
    let input: Box<dyn Read> = if file == Path::new("-") {
        Box::new(io::stdin().lock())
    } else {
        Box::new(File::open(file).map_err(|error| Failure::doing(format!("{name} cannot be opened"), error))?)
    };
    let mut bytes = Vec::new();
    input
        .take(FILE_MAX + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Failure::doing(format!("{name} cannot be read"), error))?;
    if bytes.len() as u64 > FILE_MAX {
        return Err(Failure::failed(format!("{name} is longer than 64 MiB: give a part of it")));
    }
    Ok(bytes)
}

/// What the archive says of a file: its last name.
fn source_of(file: &Path) -> String {
    match file.file_name() {
        Some(name) if file != Path::new("-") => format!("file {}", name.to_string_lossy()),
        _ => "standard input".to_owned(),
    }
}
