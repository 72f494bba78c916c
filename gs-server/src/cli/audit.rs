//! `gs-server audit list|verify`.

use clap::{Args, Subcommand};
use serde::Serialize;

use super::archive::OfArchive;
use super::plans::minute;
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::storage::{AuditHead, AuditRow, read_audit, verify_audit};

/// `gs-server audit`.
#[derive(Debug, Subcommand)]
pub enum Audit {
    /// Show the newest rows of the audit
    List(List),
    /// Look whether the audit is what was written: nothing changed, dropped, moved or cut off
    Verify(Verify),
}

/// The archive that is meant.
#[derive(Debug, Args)]
struct Of {
    #[command(flatten)]
    archive: OfArchive,
    /// JSON on standard output
    #[arg(long)]
    json: bool,
}

/// `gs-server audit list`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server audit list --data /var/lib/pixelsat-ground --limit 50
  gs-server audit list --config /etc/pixelsat-ground/station.toml

Oldest first. The server may be running. An archive in PostgreSQL is named by --config; it has one
audit for all its stations.")]
pub struct List {
    #[command(flatten)]
    of: Of,
    /// At most so many, 1 to 100000
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    limit: u32,
}

/// `gs-server audit verify`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server audit verify --data /var/lib/pixelsat-ground
  gs-server audit verify --config /etc/pixelsat-ground/station.toml
  gs-server audit verify --data /var/lib/pixelsat-ground --head 1290:5f2c…

Each row is tied to the one before it by a hash. What is printed at the end is the head: write it down
elsewhere now and then. Given later with --head, it proves that nothing up to that row was made anew.
The server may be running. An archive in PostgreSQL is named by --config. Exit code 1 when anything
is wrong.")]
pub struct Verify {
    #[command(flatten)]
    of: Of,
    /// A head that was written down; may be given several times
    #[arg(long, value_name = "ROW:HASH")]
    head: Vec<AuditHead>,
}

#[derive(Serialize)]
struct Listed {
    audit: Vec<Line>,
}

#[derive(Serialize)]
struct Line {
    id: i64,
    at: String,
    station: String,
    who: String,
    action: String,
    detail: String,
}

#[derive(Serialize)]
struct Verdict {
    rows: u64,
    head: Option<String>,
    wrong: u64,
    findings: Vec<String>,
}

impl Audit {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::List(verb) => verb.run(),
            Self::Verify(verb) => verb.run(),
        }
    }
}

impl List {
    fn run(self) -> Result<Exit, Failure> {
        let rows = runtime()?
            .block_on(read_audit(&self.of.archive.archive()?, self.limit))
            .map_err(Failure::failed)?;
        if self.of.json {
            print_json(&Listed { audit: rows.into_iter().map(line).collect() })?;
            return Ok(Exit::Done);
        }
        for row in rows {
            let at = minute(api::Time::from_unix_us(row.at_us));
            print_line(format_args!(
                "{:>6}  {at}  {:<16} {:<20} {}",
                row.id, row.who, row.action, row.detail
            ))?;
        }
        Ok(Exit::Done)
    }
}

fn line(row: AuditRow) -> Line {
    let AuditRow { id, station, at_us, who, action, detail } = row;
    Line { id, at: api::Time::from_unix_us(at_us).to_string(), station, who, action, detail }
}

impl Verify {
    fn run(self) -> Result<Exit, Failure> {
        let verdict = runtime()?
            .block_on(verify_audit(&self.of.archive.archive()?, &self.head))
            .map_err(Failure::failed)?;
        let exit = if verdict.wrong == 0 { Exit::Done } else { Exit::Failed };
        let head = verdict.head.map(|head| head.to_string());
        if self.of.json {
            let (rows, wrong, findings) = (verdict.rows, verdict.wrong, verdict.findings);
            print_json(&Verdict { rows, head, wrong, findings })?;
            return Ok(exit);
        }
        for finding in &verdict.findings {
            eprintln!("gs-server: {finding}");
        }
        let told = verdict.findings.len() as u64;
        if verdict.wrong > told {
            eprintln!("gs-server: and {} more", verdict.wrong - told);
        }
        match verdict.wrong {
            0 => print_line(format_args!("{} rows, all as they were written", verdict.rows))?,
            wrong => print_line(format_args!("{} rows, {wrong} things wrong", verdict.rows))?,
        }
        if let Some(head) = head {
            print_line(format_args!("head {head}"))?;
        }
        Ok(exit)
    }
}
