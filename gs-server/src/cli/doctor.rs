//! `gs-server doctor`.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::ops::doctor::{Finding, Verdict, examine};

/// `gs-server doctor`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server doctor --config /etc/pixelsat-ground/station.toml
  sudo -u pixelsat-ground gs-server doctor --config /etc/pixelsat-ground/station.toml --json

Looks at the configuration, key files, the data folder and its database, counters and their witness,
the clock, elements, backups, serial ports, rotctld and rigctld, and the server itself. Changes
nothing; the server may run. Run it as the user of the server. Exit code 0 if all is ok or worth no
more than an eye, 1 if anything is a warning.")]
pub struct Doctor {
    /// The configuration
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    verdict: Verdict,
    findings: Vec<Finding>,
}

impl Doctor {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let findings = runtime()?.block_on(examine(&self.config));
        let verdict = findings.iter().map(|finding| finding.verdict).max().unwrap_or(Verdict::Ok);
        let exit = if verdict == Verdict::Warning { Exit::Failed } else { Exit::Done };
        if self.json {
            print_json(&Report { verdict, findings })?;
            return Ok(exit);
        }
        for finding in &findings {
            print_line(format_args!("{:<8} {}: {}", finding.verdict.name(), finding.check, finding.found))?;
            if let Some(remedy) = &finding.remedy {
                print_line(format_args!("         {remedy}"))?;
            }
        }
        Ok(exit)
    }
}
