//! `gs-server hold` and `gs-server release`: a satellite out of its plan's hands and back, in mid-run.

use api::{Nothing, Page, RunView};
use clap::Args;

use super::elements::Of;
use super::plans::{failure, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};

/// `gs-server hold`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server hold --config station.toml pixelsat-1
  gs-server hold --config station.toml pixelsat-1 --json | jq .state

The plan that runs asks for nothing more until it is released; what it has asked for already stays
asked. The operator's own commands go out as always. LOS ends the run, held or not.

Exit code 3: nothing runs with this satellite, or there is no such satellite.")]
pub struct Hold {
    #[command(flatten)]
    satellite: OfSatellite,
}

/// `gs-server release`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server release --config station.toml pixelsat-1

The plan goes on where it stood.

Exit code 3: nothing runs with this satellite, or there is no such satellite.")]
pub struct Release {
    #[command(flatten)]
    satellite: OfSatellite,
}

#[derive(Debug, Args)]
struct OfSatellite {
    #[command(flatten)]
    of: Of,
    /// The satellite
    #[arg(value_name = "SATELLITE")]
    name: String,
    /// The run as one JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Hold {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        self.satellite.ask("hold")
    }
}

impl Release {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        self.satellite.ask("release")
    }
}

impl OfSatellite {
    fn ask(self, verb: &str) -> Result<Exit, Failure> {
        // The name becomes a part of the path.
        let name = mission::SatelliteId::new(&self.name)
            .map_err(|error| Failure::usage(format!("satellite: {error}")))?;
        let remote = server(&self.of.load()?)?;
        let run = runtime()?.block_on(async {
            remote.write(&format!("satellites/{name}/{verb}"), &Nothing {}).await?;
            let query = [("satellite", name.to_string()), ("limit", "100".to_owned())];
            let page: Page<RunView> = remote.get("runs", &query).await?;
            Ok(page.items.into_iter().find(|run| run.started_at.is_some() && run.state != "ended"))
        });
        let run: Option<RunView> = run.map_err(failure)?;
        if self.json {
            print_json(&run)?;
            return Ok(Exit::Done);
        }
        let plan = run.map_or_else(|| "the plan".to_owned(), |run| format!("plan {}", run.name));
        match verb {
            "hold" => print_line(format_args!("{plan} is held; `gs-server release {name}` gives it back"))?,
            _ => print_line(format_args!("{plan} goes on"))?,
        }
        Ok(Exit::Done)
    }
}
