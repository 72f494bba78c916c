//! `gs-server elements list`.

use api::{ElementsSource, HeldElements, SourceWord};
use clap::Args;
use serde::Serialize;

use super::super::shell::{print_json, print_line, runtime};
use super::super::{Exit, Failure};
use super::{Of, failure, remote_failure, running, store_failure};
use crate::clock::SystemClock;
use crate::config::Config;
use crate::elements::fetcher::sources_of;
use crate::elements::offline::archive;
use crate::elements::{Wanted, held};
use crate::run::RunError;
use crate::storage::{Page, Scope, StoreError};

/// `gs-server elements list`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server elements list --config station.toml
  gs-server elements list --config station.toml --satellite pixelsat-1 --limit 100 --json | jq '.elements[0]'

The newest additions first; * marks the set that is used now: the newest at or before now, else the
nearest. The expected timing error of AOS and LOS is a rule of thumb, one sigma.")]
pub struct List {
    #[command(flatten)]
    of: Of,
    /// Only of this satellite
    #[arg(long, value_name = "NAME")]
    satellite: Option<String>,
    /// At most so many sets, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000))]
    limit: u32,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Listed {
    elements: Vec<HeldElements>,
    sources: Vec<ElementsSource>,
}

impl List {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        let listed = runtime()?.block_on(self.look(&config))?;
        if self.json {
            print_json(&listed)?;
            return Ok(Exit::Done);
        }
        if listed.elements.is_empty() {
            eprintln!("gs-server: no elements are held; give some with `gs-server elements add`");
        } else {
            print_line(format_args!(
                "{:1} {:<16} {:<24} {:>9} {:<20} {:>9} {:>9} {:<8} source",
                "", "satellite", "object", "number", "epoch", "age d", "error s", "level"
            ))?;
        }
        for held in &listed.elements {
            let epoch = held.elements.epoch.to_string();
            print_line(format_args!(
                "{:1} {:<16} {:<24} {:>9} {:<20} {:>9.2} {:>9.1} {:<8} {} ({})",
                if held.in_use { "*" } else { "" },
                held.satellite,
                held.elements.satellite,
                held.elements.norad_cat_id.map_or_else(|| "-".to_owned(), |number| number.to_string()),
                format!("{}Z", epoch.get(..19).unwrap_or_default()),
                held.age_days,
                held.timing_error_s,
                held.level,
                held.source,
                held.added_by,
            ))?;
        }
        for source in &listed.sources {
            print_line(source_line(source))?;
        }
        Ok(Exit::Done)
    }

    async fn look(&self, config: &Config) -> Result<Listed, Failure> {
        let known = |name: &str| config.satellites.iter().any(|satellite| satellite.name == name);
        if let Some(name) = self.satellite.as_deref().filter(|name| !known(name)) {
            return Err(Failure::usage(format!("satellite '{name}' is not in the configuration")));
        }
        let station = mission::StationId::new(&config.station.name).map_err(Failure::usage)?;
        let store = match archive(config, &station).await {
            Ok(store) => store,
            Err(RunError::Store(StoreError::Locked { .. })) => {
                let remote = running(config)?;
                return Ok(Listed {
                    elements: remote
                        .held(self.satellite.as_deref(), self.limit)
                        .await
                        .map_err(remote_failure)?,
                    sources: remote.sources().await.map_err(remote_failure)?,
                });
            }
            Err(error) => return Err(failure(error)),
        };
        let now = mission::Clock::now(&SystemClock::new()).utc;
        let scope = Scope { satellite: self.satellite.clone(), ..Scope::default() };
        let page = Page { before: Some(i64::MAX), limit: self.limit, ..Page::default() };
        let elements = held(&store, &Wanted::of(config), &scope, &page, now).await.map_err(store_failure)?;
        let sources = sources_of(config, store.folder(), now)
            .map_err(|error| Failure::doing("what is known of the sources cannot be read", error))?;
        store.close().await.map_err(store_failure)?;
        Ok(Listed { elements, sources })
    }
}

/// A source in a line.
fn source_line(source: &ElementsSource) -> String {
    let state = match source.state {
        SourceWord::New => "was never asked",
        SourceWord::Good => "good",
        SourceWord::Failed => "FAILED",
        SourceWord::Stopped => "STOPPED",
    };
    let mut line = format!("source {}: {state}", source.url);
    if let Some(at) = source.downloaded_at {
        line += &format!(", last download {at}");
    }
    if let Some(detail) = &source.detail {
        line += &format!(", {detail}");
    }
    match source.next_at {
        Some(at) => line + &format!("; asked next at {at}"),
        None => line + "; not asked again by itself",
    }
}
