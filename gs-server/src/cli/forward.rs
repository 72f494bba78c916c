//! `gs-server forward targets|list|show|pause|resume|retry`: asked of the running server.

use api::{ForwardTargetView, ForwardView, ForwardWhole, Nothing, Page};
use clap::{Args, Subcommand};

use super::elements::Of;
use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};

/// `gs-server forward`.
#[derive(Debug, Subcommand)]
pub enum Forward {
    /// To whom frames go, and whether they get there
    Targets(Targets),
    /// Each reception and how it stands
    List(List),
    /// One reception with the exact request; of a dry run, too
    Show(Show),
    /// Send nothing to a target for now; what is heard waits
    Pause(Named),
    /// Send on
    Resume(Named),
    /// Send again what a target refused, or what may not have arrived
    Retry(Retry),
}

impl Forward {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::Targets(targets) => targets.run(),
            Self::List(list) => list.run(),
            Self::Show(show) => show.run(),
            Self::Pause(named) => named.post("pause"),
            Self::Resume(named) => named.post("resume"),
            Self::Retry(retry) => retry.run(),
        }
    }
}

/// `gs-server forward targets`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server forward targets --config station.toml

No secret is shown. Exit code 1 when the last attempt of one of them failed.")]
pub struct Targets {
    #[command(flatten)]
    of: Of,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct TargetsListed {
    targets: Vec<ForwardTargetView>,
}

impl Targets {
    fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let page: Page<ForwardTargetView> =
            runtime()?.block_on(remote.get("forwards/targets", &[])).map_err(failure)?;
        let failing = page.items.iter().any(|target| target.failing.is_some());
        if self.json {
            print_json(&TargetsListed { targets: page.items })?;
        } else if page.items.is_empty() {
            eprintln!("gs-server: frames go to nobody else; docs/forwarding.md tells how to name targets");
        } else {
            for target in &page.items {
                print_line(target_line(target))?;
            }
        }
        Ok(if failing { Exit::Failed } else { Exit::Done })
    }
}

/// `satnogs      dry run  https://…: 0 sent, 0 waiting`.
fn target_line(target: &ForwardTargetView) -> String {
    let how = match (&target.paused_by, target.live) {
        (Some(_), _) => "paused",
        (None, true) => "live",
        (None, false) => "dry run",
    };
    let mut line = format!("{:<16} {how:<8} {}: {} sent", target.name, target.leads_to, target.sent);
    for (count, word) in [
        (target.waiting, "waiting"),
        (target.unknown, "unknown"),
        (target.refused, "refused"),
        (target.dry, "would have been sent"),
    ] {
        if count > 0 {
            line.push_str(&format!(", {count} {word}"));
        }
    }
    if let Some(at) = target.oldest_waiting_at {
        line.push_str(&format!(", the oldest of {}", minute(at)));
    }
    if let Some((who, at)) = target.paused_by.as_ref().zip(target.paused_at) {
        line.push_str(&format!("; paused by {who} at {}", minute(at)));
    }
    if let Some(why) = &target.failing {
        line.push_str(&format!("; {why}"));
    }
    line
}

/// `gs-server forward list`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server forward list --config station.toml --target satnogs
  gs-server forward list --config station.toml --state unknown --json | jq .forwards[].id

Newest first. unknown: it may have arrived, and asking again could make it two; look there, then
`forward retry` it or leave it. Exit code 0 whether there are any or not.")]
pub struct List {
    #[command(flatten)]
    of: Of,
    /// Only to this target
    #[arg(long, value_name = "NAME")]
    target: Option<String>,
    /// Only in this state
    #[arg(long, value_name = "STATE", value_parser = ["waiting", "sending", "sent", "unknown", "refused", "dry"])]
    state: Option<String>,
    /// At most so many, 1 to 1000
    #[arg(long, value_name = "COUNT", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1000))]
    limit: u32,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Listed {
    forwards: Vec<ForwardView>,
}

impl List {
    fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let mut query = vec![("limit", self.limit.to_string())];
        query.extend(self.target.map(|target| ("target", target)));
        query.extend(self.state.map(|state| ("state", state)));
        let page: Page<ForwardView> = runtime()?.block_on(remote.get("forwards", &query)).map_err(failure)?;
        if self.json {
            print_json(&Listed { forwards: page.items })?;
            return Ok(Exit::Done);
        }
        if page.items.is_empty() {
            eprintln!("gs-server: there is none");
        }
        for one in &page.items {
            print_line(line(one))?;
        }
        Ok(Exit::Done)
    }
}

fn line(one: &ForwardView) -> String {
    let error = one.error.as_deref().map(|error| format!("; {error}")).unwrap_or_default();
    format!(
        "{:>8} {:<8} {:<16} frame {} heard by {} at {}{error}",
        one.id, one.state, one.target, one.frame, one.receiver, one.received_at
    )
}

/// `gs-server forward show`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server forward show --config station.toml 17

Prints what is sent by POST, byte for byte; secrets are left out.")]
pub struct Show {
    #[command(flatten)]
    of: Of,
    /// Its number
    #[arg(value_name = "NUMBER")]
    id: u64,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Show {
    fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let path = format!("forwards/{}", self.id);
        let whole: ForwardWhole = runtime()?.block_on(remote.get(&path, &[])).map_err(failure)?;
        if self.json {
            print_json(&whole)?;
            return Ok(Exit::Done);
        }
        print_line(line(&whole.forward))?;
        match whole.request {
            Some(request) => {
                print_line(format_args!("Content-Type: {}\n\n{}", request.content_type, request.body))?
            }
            None => eprintln!("gs-server: nothing can be sent of it"),
        }
        Ok(Exit::Done)
    }
}

/// A target.
#[derive(Debug, Args)]
pub struct Named {
    #[command(flatten)]
    of: Of,
    /// The target
    #[arg(value_name = "TARGET")]
    target: String,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Named {
    fn post(&self, verb: &str) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        if !config.forward.iter().any(|target| target.name == self.target) {
            let names: Vec<&str> = config.forward.iter().map(|target| target.name.as_str()).collect();
            let there_are = if names.is_empty() { "there are none".to_owned() } else { names.join(", ") };
            let message = format!("no target '{}' in the configuration: {there_are}", self.target);
            return Err(Failure::usage(message));
        }
        let remote = server(&config)?;
        let path = format!("forwards/targets/{}/{verb}", self.target);
        let target: ForwardTargetView =
            runtime()?.block_on(remote.ask_to(&path, &Nothing {})).map_err(failure)?;
        match self.json {
            true => print_json(&target)?,
            false => print_line(target_line(&target))?,
        }
        Ok(Exit::Done)
    }
}

/// `gs-server forward retry`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server forward retry --config station.toml 17

Of what is unknown a second frame may come of it at a SiDS target: look there first. Exit code 3 when
it is in a state in which there is nothing to repeat.")]
pub struct Retry {
    #[command(flatten)]
    of: Of,
    /// Its number
    #[arg(value_name = "NUMBER")]
    id: u64,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Retry {
    fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let path = format!("forwards/{}/retry", self.id);
        let one: ForwardView = runtime()?.block_on(remote.ask_to(&path, &Nothing {})).map_err(failure)?;
        match self.json {
            true => print_json(&one)?,
            false => print_line(line(&one))?,
        }
        Ok(Exit::Done)
    }
}
