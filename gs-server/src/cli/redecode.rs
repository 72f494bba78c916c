//! `gs-server redecode`.

use std::io::IsTerminal as _;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::archive::OfArchive;
use super::serve::is_refusal;
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::storage::{DATABASE, Store, StoreError, StoreOptions};

/// `gs-server redecode`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server redecode --data /var/lib/pixelsat-ground
  gs-server redecode --config /etc/pixelsat-ground/station.toml

Reads every raw frame again and makes the values from it as this version of the program does.
Raw frames are never touched. No server may run on the folder meanwhile. Broken off, it goes on
where it was. With --config an archive in PostgreSQL is read, too, with the frames of all its
stations; the server of this one must be stopped, others may run and wait for it now and then.
Exit code 1 if rows were found damaged, 3 if the folder or the station is in use.")]
pub struct Redecode {
    #[command(flatten)]
    of: OfArchive,
    /// One JSON object at the end
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Done {
    frames: u64,
    without_packet: u64,
    unchanged: u64,
    added: u64,
    changed: u64,
    removed: u64,
    damaged: u64,
    findings: Vec<String>,
}

impl Redecode {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        runtime()?.block_on(self.redecode())
    }

    async fn redecode(self) -> Result<Exit, Failure> {
        let store = self.open().await?;
        let bar = if std::io::stderr().is_terminal() { ProgressBar::new(0) } else { ProgressBar::hidden() };
        bar.set_style(
            ProgressStyle::with_template("{bar:40} frame {pos} of {len}, {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        let outcome = store
            .redecode(|progress| {
                bar.set_length(progress.last_frame.unsigned_abs());
                bar.set_position(progress.frame.unsigned_abs());
            })
            .await;
        bar.finish_and_clear();
        let report = outcome.map_err(Failure::failed)?;
        store.close().await.map_err(Failure::failed)?;
        for finding in &report.findings {
            eprintln!("gs-server: {finding}");
        }
        let exit = if report.damaged == 0 { Exit::Done } else { Exit::Failed };
        if self.json {
            print_json(&Done {
                frames: report.frames,
                without_packet: report.without_packet,
                unchanged: report.unchanged,
                added: report.added,
                changed: report.changed,
                removed: report.removed,
                damaged: report.damaged,
                findings: report.findings,
            })?;
        } else {
            print_line(format_args!(
                "{} frames ({} without a packet): {} values as before, {} added, {} changed, {} removed, {} rows damaged",
                report.frames,
                report.without_packet,
                report.unchanged,
                report.added,
                report.changed,
                report.removed,
                report.damaged
            ))?;
        }
        Ok(exit)
    }

    async fn open(&self) -> Result<Store, Failure> {
        let archive = self.of.archive()?;
        if archive.postgres.is_none() && !archive.folder.join(DATABASE).is_file() {
            return Err(Failure::usage(format!(
                "{} is no data folder: there is no ground.sqlite3. An archive in PostgreSQL is named by --config",
                archive.folder.display()
            )));
        }
        let options = |simulated| StoreOptions {
            folder: archive.folder.clone(),
            station: None,
            simulated,
            max_page_count: None,
            postgres: archive.postgres.clone(),
            reserve_bytes: 0,
        };
        let opened = match Store::open(options(false)).await {
            // What is in the folder is what is read; nothing real and simulated meets here.
            Err(StoreError::SimulatedMark { simulated, .. }) => Store::open(options(simulated)).await,
            opened => opened,
        };
        opened.map_err(|error| {
            let refused = is_refusal(&error) || matches!(error, StoreError::StationTaken);
            if refused { Failure::refused(error) } else { Failure::failed(error) }
        })
    }
}
