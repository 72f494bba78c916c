//! `gs-server ears`: who hears the satellite and how the ways in work; asked of the running server.

use api::{EarView, Page, ReceiverView, WayState, WayView};
use clap::Args;

use super::elements::Of;
use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};

/// `gs-server ears`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server ears --config station.toml
  gs-server ears --config station.toml --json | jq '.ways[] | select(.state != \"working\")'

Ways in over the network ([[ears]] of the configuration), receivers of the last 30 days, and what was
refused of the reports by each source. Exit code 1 when a way fails, is old or was refused.")]
pub struct ListEars {
    #[command(flatten)]
    of: Of,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Told {
    ways: Vec<WayView>,
    receivers: Vec<ReceiverView>,
    sources: Vec<EarView>,
}

impl ListEars {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let told = runtime()?.block_on(async {
            let ways: Page<WayView> = remote.get("ears/ways", &[]).await?;
            let receivers: Page<ReceiverView> = remote.get("receivers", &[]).await?;
            let sources: Page<EarView> = remote.get("ears", &[]).await?;
            Ok(Told { ways: ways.items, receivers: receivers.items, sources: sources.items })
        });
        let told = told.map_err(failure)?;
        let all_work =
            told.ways.iter().all(|way| matches!(way.state, WayState::Working | WayState::Starting));
        if self.json {
            print_json(&told)?;
        } else {
            told.print()?;
        }
        Ok(if all_work { Exit::Done } else { Exit::Failed })
    }
}

impl Told {
    fn print(&self) -> Result<(), Failure> {
        if self.ways.is_empty() {
            eprintln!("gs-server: no way in over the network is configured ([[ears]], docs/ears.md)");
        }
        for way in &self.ways {
            let age = way.age_s.map_or_else(|| "never".into(), |age_s| format!("{age_s:.0} s ago"));
            let words = way.note.iter().chain(way.error.iter().filter(|_| way.state != WayState::Working));
            let words: String = words.map(|words| format!("  {words}")).collect();
            print_line(format!(
                "{:<16} {:<10} {:<8} last answer {age}{words}",
                way.name,
                way.kind,
                state(way.state)
            ))?;
        }
        for receiver in &self.receivers {
            let heard = receiver.last_heard_at.map_or_else(|| "nothing yet".into(), minute);
            let snr = receiver.median_snr_db.map_or_else(|| "—".into(), |db| format!("{db:.1} dB"));
            let board = match &receiver.board {
                Some(board) if board.online => "  online",
                Some(_) => "  offline",
                None => "",
            };
            print_line(format!(
                "{:<32} {:<18} {:>7} frames  SNR {snr:>9}{board}",
                receiver.id, heard, receiver.frames
            ))?;
        }
        for source in &self.sources {
            let refused: Vec<String> =
                source.refused.iter().map(|(reason, count)| format!("{reason} {count}")).collect();
            if !refused.is_empty() {
                print_line(format!("refused of {}: {}", source.source, refused.join(", ")))?;
            }
        }
        Ok(())
    }
}

const fn state(state: WayState) -> &'static str {
    match state {
        WayState::Starting => "starting",
        WayState::Working => "working",
        WayState::Stale => "stale",
        WayState::Failing => "failing",
        WayState::Refused => "refused",
    }
}
