//! `gs-server elements fetch`.

use api::{FetchReport, FetchWord};
use clap::Args;

use super::super::shell::{print_json, print_line, runtime};
use super::super::{Exit, Failure};
use super::add::line;
use super::{Of, Station, failure, remote_failure};
use crate::config::Config;
use crate::elements::{Asker, Fetcher};

/// `gs-server elements fetch`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server elements fetch --config station.toml

Asks each source of elements.fetch once, unless it was asked within elements.min_age_h: sources
block who asks more often. A source that refused is asked again only by this verb: read what it said
first. Nothing is asked without a source in the configuration.

Exit code 0 if every source gave elements or has nothing newer, 1 if one failed or refused.")]
pub struct Fetch {
    #[command(flatten)]
    of: Of,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Fetch {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        if config.elements.fetch.is_empty() {
            return Err(Failure::usage(
                "the configuration names no source: write fetch = [\"https://…\"] into its section [elements]",
            ));
        }
        let report = runtime()?.block_on(fetch(&config))?;
        if self.json {
            print_json(&report)?;
        } else {
            for source in &report.sources {
                print_line(format_args!("{}: {}", source.url, source.detail))?;
                for added in &source.added {
                    print_line(format_args!("  {}", line(added)))?;
                }
                for why in &source.unmatched {
                    print_line(format_args!("  {why}"))?;
                }
            }
        }
        let bad = |word: FetchWord| matches!(word, FetchWord::Failed | FetchWord::Stopped);
        Ok(if report.sources.iter().any(|source| bad(source.outcome)) { Exit::Failed } else { Exit::Done })
    }
}

async fn fetch(config: &Config) -> Result<FetchReport, Failure> {
    match Station::of(config).await? {
        Station::Running(remote) => {
            let report = remote.fetch().await.map_err(remote_failure)?;
            if report.sources.is_empty() {
                return Err(Failure::failed(
                    "the server that runs knows no source yet: start it again with this configuration",
                ));
            }
            Ok(report)
        }
        Station::Stopped(offline) => {
            let timer = std::sync::Arc::clone(&offline.timer);
            let fetcher = Fetcher::new(config, offline.door.store.folder(), offline.door.clone(), timer)
                .map_err(|error| {
                    Failure::doing("the folder 'elements' in the data folder cannot be made", error)
                })?;
            let mut awake = offline.timer.busy("fetch of elements");
            fetcher.take_up().await;
            let report = fetcher.round(Asker::Operator, &mut awake).await;
            drop(fetcher);
            offline.close().await.map_err(failure)?;
            Ok(report)
        }
    }
}
