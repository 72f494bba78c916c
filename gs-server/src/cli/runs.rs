//! `gs-server runs`.

use api::{Page, RunReport, RunView};
use clap::Args;

use super::elements::Of;
use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};

/// `gs-server runs`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server runs --config station.toml
  gs-server runs --config station.toml 17
  gs-server runs --config station.toml --satellite pixelsat-1 --json | jq '.runs[] | select(.state == \"missed\")'

Without a number the newest runs, one a line. With one, its report: every step that ended and how,
what it asked for and what became of that, and what was heard.")]
pub struct Runs {
    #[command(flatten)]
    of: Of,
    /// The report of this run
    #[arg(value_name = "ID", conflicts_with_all = ["satellite", "limit"])]
    id: Option<u64>,
    /// Only of this satellite
    #[arg(long, value_name = "NAME")]
    satellite: Option<String>,
    /// At most so many, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000))]
    limit: u32,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Listed {
    runs: Vec<RunView>,
}

impl Runs {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        if let Some(id) = self.id {
            let report: RunReport =
                runtime()?.block_on(remote.get(&format!("runs/{id}"), &[])).map_err(failure)?;
            return tell(&report, self.json);
        }
        let mut query = vec![("limit", self.limit.to_string())];
        query.extend(self.satellite.map(|satellite| ("satellite", satellite)));
        let page: Page<RunView> = runtime()?.block_on(remote.get("runs", &query)).map_err(failure)?;
        if self.json {
            print_json(&Listed { runs: page.items })?;
            return Ok(Exit::Done);
        }
        if page.items.is_empty() {
            eprintln!("gs-server: no plan has run yet; see `gs-server schedule`");
        }
        for run in &page.items {
            print_line(line(run))?;
        }
        Ok(Exit::Done)
    }
}

fn line(run: &RunView) -> String {
    let mut line = format!(
        "{:>6}  {} to {}  {:<16} {:<20} {}",
        run.id,
        minute(run.aos),
        minute(run.los),
        run.satellite,
        run.name,
        run.outcome.as_deref().unwrap_or(&run.state)
    );
    if let Some(why) = run.why.as_ref().or(run.outcome_why.as_ref()) {
        line += &format!(": {why}");
    }
    line
}

fn tell(report: &RunReport, json: bool) -> Result<Exit, Failure> {
    if json {
        print_json(report)?;
        return Ok(Exit::Done);
    }
    print_line(line(&report.run))?;
    for step in &report.steps {
        let rounds: String = step.rounds.iter().map(|round| format!(" round {}", round + 1)).collect();
        let why = step.why.as_ref().map(|why| format!(": {why}")).unwrap_or_default();
        print_line(format_args!(
            "  {} {}{rounds}, {}: {}{why}",
            step.step,
            step.what.as_deref().unwrap_or("?"),
            step.ended_at,
            step.end
        ))?;
    }
    for command in &report.commands {
        let stages: Vec<String> = command
            .stages
            .iter()
            .flatten()
            .map(|stage| {
                let at = stage.at.to_string();
                format!("{} {}", stage.stage, at.get(11..19).unwrap_or_default())
            })
            .collect();
        print_line(format_args!("  command {} {}: {}", command.id, command.command, stages.join(", ")))?;
    }
    for download in &report.downloads {
        print_line(format_args!("  download {}: {}", download.id, download.state))?;
    }
    print_line(format_args!("  heard: {} frames, {} new chunks", report.frames_heard, report.chunks_gained))?;
    Ok(Exit::Done)
}
