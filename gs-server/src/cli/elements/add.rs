//! `gs-server elements add`.

use std::path::PathBuf;

use api::ElementsAdded;
use clap::Args;
use serde::Serialize;
use tle::formats::Checksums;

use super::super::shell::{print_json, print_line, runtime};
use super::super::{Exit, Failure};
use super::{Of, Station, read, remote_failure, source_of};
use crate::config::Config;
use crate::elements::door::{Adder, report, warnings};
use crate::elements::{AddError, SetsOfText, Wanted, sets_of};
use crate::run::RunError;

/// `gs-server elements add`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server elements add --config station.toml gp.json
  curl … | gs-server elements add --config station.toml -
  gs-server elements add --config station.toml --satellite pixelsat-1 object-a.tle

OMM as JSON, CSV, XML or KVN, and TLE with two or three lines are recognised by themselves. Sets
belong to the satellite whose norad_cat_id they have, else whose object_name (or name); what fits
no satellite or several is told, never guessed. With --satellite, the only object of a file is taken
whatever it is called. A server that runs uses them at once; without one they go into its archive.

Exit code 0 if every set is held now, 1 if none belongs to a satellite or the file is none.")]
pub struct Add {
    #[command(flatten)]
    of: Of,
    /// A file of elements, or - for standard input
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Only for this satellite
    #[arg(long, value_name = "NAME")]
    satellite: Option<String>,
    /// Use a TLE whose checksum does not fit, with a warning
    #[arg(long)]
    lenient: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// What was added, and the satellites that got nothing.
#[derive(Debug, Serialize)]
pub(super) struct Added {
    satellites: Vec<ElementsAdded>,
    unmatched: Vec<String>,
}

impl Add {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        let checksums = if self.lenient { Checksums::Lenient } else { Checksums::Strict };
        let text = SetsOfText::read(&read(&self.file)?, checksums)
            .map_err(|error| Failure::doing(format!("{} is no elements", self.file.display()), error))?;
        let source = source_of(&self.file);
        let added = runtime()?.block_on(add(&config, &text, &source, self.satellite.as_deref()))?;
        tell(&added, self.json)
    }
}

/// Gives each satellite its sets.
pub(super) async fn add(
    config: &Config,
    text: &SetsOfText,
    source: &str,
    named: Option<&str>,
) -> Result<Added, Failure> {
    let mut wanted = Wanted::of(config);
    if let Some(name) = named {
        wanted.retain(|wanted| wanted.satellite.as_str() == name);
        if wanted.is_empty() {
            let known: Vec<&str> = config.satellites.iter().map(|known| known.name.as_str()).collect();
            return Err(Failure::usage(format!(
                "satellite '{name}' is not in the configuration; there is {}",
                known.join(", ")
            )));
        }
    }
    for refused in &text.refused {
        eprintln!("gs-server: {source}, {refused}; left out");
    }
    for warning in warnings(text) {
        eprintln!("gs-server: {source}, {warning}");
    }
    let mut unmatched = Vec::new();
    let matched: Vec<_> = wanted
        .iter()
        .filter_map(|wanted| match sets_of(wanted, &text.sets, named.is_some()) {
            Ok(sets) => Some((wanted, sets)),
            Err(why) => {
                unmatched.push(format!("{}: {why}", wanted.satellite));
                None
            }
        })
        .collect();
    if matched.is_empty() {
        let reason = match text.refused.first() {
            Some(refused) if text.sets.is_empty() => format!("no set can be used; {refused}"),
            _ => unmatched.join("; "),
        };
        return Err(Failure::failed(format!("nothing was added from {source}: {reason}")));
    }
    let mut satellites = Vec::new();
    match Station::of(config).await? {
        Station::Running(remote) => {
            for (wanted, sets) in matched {
                let added =
                    remote.add(wanted.satellite.as_str(), &sets, source).await.map_err(remote_failure)?;
                satellites.push(report(added, text, sets.len(), source));
            }
        }
        Station::Stopped(offline) => {
            for (wanted, sets) in matched {
                let adder = Adder::of("operator", &wanted.satellite, &sets);
                let added = offline.door.add(&wanted.satellite, &sets, source, &adder).await;
                let (added, _) = added.map_err(|error| match error {
                    AddError::Intent(error) => Failure::refused(error),
                    AddError::Store(error) => super::store_failure(error),
                })?;
                satellites.push(report(added, text, sets.len(), source));
            }
            offline.close().await.map_err(|error: RunError| super::failure(error))?;
        }
    }
    Ok(Added { satellites, unmatched })
}

pub(super) fn tell(added: &Added, json: bool) -> Result<Exit, Failure> {
    if json {
        print_json(added)?;
        return Ok(Exit::Done);
    }
    for satellite in &added.satellites {
        print_line(line(satellite))?;
    }
    for why in &added.unmatched {
        eprintln!("gs-server: {why}");
    }
    Ok(Exit::Done)
}

/// One satellite in a line.
pub(super) fn line(added: &ElementsAdded) -> String {
    let ElementsAdded { satellite, added, held, newest_epoch, .. } = added;
    let epoch = newest_epoch.map(|epoch| format!(", newest epoch {epoch}")).unwrap_or_default();
    format!("{satellite}: {added} added, {held} held already{epoch}")
}
