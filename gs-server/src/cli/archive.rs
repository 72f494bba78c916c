//! Which archive a verb works on when no server answers: by its data folder, or by the configuration.

use std::path::PathBuf;

use clap::Args;

use super::Failure;
use crate::config::Config;
use crate::run;
use crate::storage::Archive;

/// An archive: a data folder, or what a configuration names.
#[derive(Debug, Args)]
#[group(required = true, multiple = true)]
pub(super) struct OfArchive {
    /// The configuration: its data folder, or its PostgreSQL
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The data folder of a station with its file, before what the configuration says
    #[arg(long, value_name = "DIR", env = "GS_DATA", hide_env_values = true)]
    data: Option<PathBuf>,
}

impl OfArchive {
    /// Where it is. Nothing is opened yet but the files that say so.
    pub(super) fn archive(&self) -> Result<Archive, Failure> {
        let config = self.config.as_deref().map(Config::load).transpose().map_err(Failure::usage)?;
        match (&self.data, config) {
            (data, Some(config)) => Ok(Archive {
                postgres: run::postgres(&config).map_err(Failure::usage)?,
                folder: data.clone().unwrap_or(config.storage.folder),
            }),
            (Some(data), None) => Ok(Archive::in_folder(data)),
            (None, None) => Err(Failure::usage("give --config or --data")),
        }
    }
}
