//! The command line.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};

use crate::link::Server;

/// The operator's desk of PixelSat Ground
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "\
Examples:
  ground-app                                              a server and a simulated satellite inside, to learn and to try
  ground-app --url http://127.0.0.1:8700 --token-file /var/lib/pixelsat-ground/token
  ground-app --url https://ground.example.org             only look: without a token nothing can be sent

The token may also stand in the environment as GROUND_TOKEN; on the command line others could read it."
)]
pub struct Args {
    /// Address of the server; without it the app carries one inside
    #[arg(long, value_name = "URL", env = "GROUND_URL")]
    pub url: Option<String>,
    /// File with the token that lets one send
    #[arg(long, value_name = "FILE", requires = "url")]
    pub token_file: Option<PathBuf>,
    /// Folder of the server inside [default: a new one, removed at the end]
    #[arg(long, value_name = "DIR", conflicts_with = "url")]
    pub data: Option<PathBuf>,
    /// Simulated seconds per second of the satellite inside
    #[arg(long, value_name = "N", default_value_t = 1.0, conflicts_with = "url")]
    pub speed: f64,
    /// File in which the arrangement of the desk is kept [default: desk.json in the user's configuration folder]
    #[arg(long, value_name = "FILE")]
    pub desk: Option<PathBuf>,
    /// Dark for the night, light for daylight [default: as last time]
    #[arg(long, value_enum)]
    pub theme: Option<ThemeWord>,
}

/// A theme on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ThemeWord {
    /// Light on dark
    Dark,
    /// Dark on light
    Light,
}

impl Args {
    /// The server that was named, with its token.
    ///
    /// # Errors
    /// A token file that cannot be read.
    pub fn server(&self) -> anyhow::Result<Option<Server>> {
        let Some(address) = self.url.clone() else { return Ok(None) };
        let token = match &self.token_file {
            Some(path) => {
                let text = std::fs::read_to_string(path)
                    .map_err(|error| anyhow::anyhow!("--token-file {}: {error}", path.display()))?;
                Some(text.trim().to_owned())
            }
            None => std::env::var("GROUND_TOKEN").ok().filter(|token| !token.is_empty()),
        };
        Ok(Some(Server { address, token }))
    }

    /// Where the desk is kept.
    #[must_use]
    pub fn desk_file(&self) -> PathBuf {
        let folder = || {
            let named =
                std::env::var_os("XDG_CONFIG_HOME").filter(|name| !name.is_empty()).map(PathBuf::from);
            named
                .or_else(|| std::env::home_dir().map(|home| home.join(".config")))
                .unwrap_or_else(std::env::temp_dir)
        };
        self.desk.clone().unwrap_or_else(|| folder().join("pixelsat-ground").join("desk.json"))
    }
}
