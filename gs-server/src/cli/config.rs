//! `gs-server config check|example`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::serve::failure;
use super::shell::{print_json, print_line};
use super::{Exit, Failure};
use crate::run::load_keys;

/// `gs-server config`.
#[derive(Debug, Subcommand)]
pub enum Config {
    /// Read a configuration, print what the server would do with it, name the first mistake
    #[command(after_help = "\
Examples:
  gs-server config check station.toml
  gs-server config check --config /etc/pixelsat-ground/station.toml --json

No secret is printed. Key files are looked at as `serve` would. Exit code 2 for a mistake in the
file, 3 for a key file that would be refused.")]
    Check(Check),
    /// Print an example configuration with every section explained
    #[command(after_help = "\
Examples:
  gs-server config example > station.toml
  gs-server config example --practice > station.toml

Without an option: a station with a radio module on a USB adapter, to be edited. With --practice one
that runs as it is, beside `gs-server twin serve --pty radio`.")]
    Example(Example),
}

/// `gs-server config check`.
#[derive(Debug, Args)]
pub struct Check {
    #[command(flatten)]
    file: ConfigFile,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// `gs-server config example`.
#[derive(Debug, Args)]
pub struct Example {
    /// A station beside the simulated satellite, ten times as fast as life
    #[arg(long)]
    practice: bool,
}

/// A configuration, with or without the name of the option.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub(super) struct ConfigFile {
    /// The configuration
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// The same, for habit's sake
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

impl ConfigFile {
    pub(super) fn path(&self) -> PathBuf {
        self.file.clone().or_else(|| self.config.clone()).unwrap_or_default()
    }
}

#[derive(Serialize)]
struct Verdict {
    ok: bool,
    simulated: bool,
    summary: Vec<String>,
}

/// What `config example` prints.
pub(super) const EXAMPLE: &str = include_str!("../../../examples/e22-usb.toml");

/// The same for a station to practise with.
const PRACTICE: &str = include_str!("../../../examples/practice.toml");

impl Config {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::Check(check) => check.run(),
            Self::Example(example) => {
                print_line(if example.practice { PRACTICE } else { EXAMPLE }.trim_end())?;
                Ok(Exit::Done)
            }
        }
    }
}

impl Check {
    fn run(self) -> Result<Exit, Failure> {
        let config = crate::config::Config::load(&self.file.path()).map_err(Failure::usage)?;
        config.check().map_err(Failure::usage)?;
        drop(load_keys(&config).map_err(failure)?);
        let summary = config.to_string();
        if self.json {
            let summary = summary.lines().map(str::to_owned).collect();
            print_json(&Verdict { ok: true, simulated: config.is_simulated(), summary })?;
        } else {
            print_line(summary)?;
        }
        Ok(Exit::Done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_is_a_configuration() {
        let config = crate::config::Config::from_toml(EXAMPLE, std::path::Path::new("/srv/ground")).unwrap();
        config.check().unwrap();
        assert!(!config.is_simulated());
        let practice =
            crate::config::Config::from_toml(PRACTICE, std::path::Path::new("/srv/ground")).unwrap();
        practice.check().unwrap();
        assert!(practice.is_simulated());
    }
}
