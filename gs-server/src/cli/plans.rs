//! `gs-server plan add|list|arm|disarm|attach|detach|withdraw`: asked of the running server.

use std::path::PathBuf;

use api::{AttachRequest, NextPass, Nothing, Page, PlanView, StationView, Time};
use clap::Args;
use mission::plan::CheckContext;
use mission::{Clock as _, PlanName};
use radio::airtime::LinkTiming;

use super::elements::Of;
use super::plan::{ConfiguredLinks, check_for, line, read};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::clock::SystemClock;
use crate::config::Config;
use crate::elements::{Remote, RemoteError};
use crate::plan::{Form, read as words_of};

/// The server of a configuration, which has to run.
pub(super) fn server(config: &Config) -> Result<Remote, Failure> {
    Remote::new(config).map_err(failure)
}

/// Why the server did not do it, as a way to end.
pub(super) fn failure(error: RemoteError) -> Failure {
    match error {
        RemoteError::NoAnswer { url, why } => {
            Failure::failed(format!("no server answers at {url} ({why}): start it with `gs-server serve`"))
        }
        RemoteError::Refused(_) | RemoteError::Busy(_) | RemoteError::Token(_) => Failure::refused(error),
        RemoteError::NoPort => Failure::usage(error),
        RemoteError::Client(_) | RemoteError::Strange { .. } => Failure::failed(error),
    }
}

/// `gs-server plan add`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server plan add --config station.toml night.toml
  gs-server plan new --template status | gs-server plan add --config station.toml -

It is checked as by `plan check --config`, then the running server takes it, not armed. A plan of the
same name is withdrawn, and its arming and chosen passes with it; the same text again changes nothing.")]
pub struct Add {
    #[command(flatten)]
    of: Of,
    /// A plan in TOML or JSON, or - for standard input
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

impl Add {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        let name = self.file.display().to_string();
        let text = read(&self.file, &name)?;
        let form = Form::of(&text);
        let mut context = CheckContext {
            timing: LinkTiming::default(),
            profile: None,
            pass: None,
            now: Some(SystemClock::new().now().utc),
        };
        let links = ConfiguredLinks::of_config(&config)?;
        let checked = check_for(&text, form, &mut context, Some(&links));
        for finding in &checked.findings {
            eprintln!("gs-server: {}", line(&name, finding));
        }
        let Some(plan) = checked.plan.as_ref().filter(|_| checked.is_good()) else {
            return Err(Failure::usage(format!("{name}: the plan is not taken")));
        };
        let words = words_of(&text, form).map_err(|finding| Failure::usage(line(&name, &finding)))?;
        let remote = server(&config)?;
        runtime()?.block_on(remote.write("plans", &words)).map_err(failure)?;
        print_line(format_args!(
            "plan {} for {} is in use; `gs-server plan list` tells whether it is armed",
            plan.name, plan.satellite
        ))?;
        Ok(Exit::Done)
    }
}

/// `gs-server plan list`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server plan list --config station.toml
  gs-server plan list --config station.toml --json | jq '.plans[] | select(.armed) | .name'")]
pub struct List {
    #[command(flatten)]
    of: Of,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Listed {
    plans: Vec<PlanView>,
}

impl List {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let plans = runtime()?.block_on(plans(&remote))?;
        if self.json {
            print_json(&Listed { plans })?;
            return Ok(Exit::Done);
        }
        if plans.is_empty() {
            eprintln!("gs-server: no plan is in use; hand one over with `gs-server plan add`");
            return Ok(Exit::Done);
        }
        print_line(format_args!(
            "{:<32} {:<16} {:<9} {:>5} {:<20} passes",
            "plan", "satellite", "armed", "steps", "by"
        ))?;
        for plan in &plans {
            print_line(format_args!(
                "{:<32} {:<16} {:<9} {:>5} {:<20} {}",
                plan.name,
                plan.satellite,
                if plan.armed { "armed" } else { "not armed" },
                plan.plan.steps.len(),
                plan.added_by,
                passes_of(plan),
            ))?;
        }
        Ok(Exit::Done)
    }
}

/// `by its rule; 2 chosen: 2026-12-01T18:22Z, …`.
fn passes_of(plan: &PlanView) -> String {
    let mut parts = Vec::new();
    if plan.plan.attach.is_some() {
        parts.push("by its rule".to_owned());
    }
    if !plan.picks.is_empty() {
        let picks: Vec<String> = plan.picks.iter().copied().map(minute).collect();
        parts.push(format!("chosen: {}", picks.join(", ")));
    }
    if parts.is_empty() { "none: attach it".to_owned() } else { parts.join("; ") }
}

/// To the minute.
pub(super) fn minute(time: Time) -> String {
    format!("{}Z", time.to_string().get(..16).unwrap_or_default())
}

async fn plans(remote: &Remote) -> Result<Vec<PlanView>, Failure> {
    let page: Page<PlanView> = remote.get("plans", &[]).await.map_err(failure)?;
    Ok(page.items)
}

/// A plan in use.
#[derive(Debug, Args)]
struct Named {
    #[command(flatten)]
    of: Of,
    /// The plan
    #[arg(value_name = "NAME")]
    name: String,
}

impl Named {
    /// The server, and the name if it can be one.
    fn server(&self) -> Result<(Remote, PlanName), Failure> {
        let config = self.of.load()?;
        let name = PlanName::new(&self.name).map_err(|error| Failure::usage(format!("plan: {error}")))?;
        Ok((server(&config)?, name))
    }

    fn post(&self, verb: &str, done: &str) -> Result<Exit, Failure> {
        let (remote, name) = self.server()?;
        let path = format!("plans/{name}/{verb}");
        runtime()?.block_on(remote.write(&path, &Nothing {})).map_err(failure)?;
        print_line(format_args!("plan {name} is {done}"))?;
        Ok(Exit::Done)
    }
}

/// `gs-server plan arm`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server plan arm --config station.toml status

From now on the server runs it in the passes that the schedule gives it, without anybody.")]
pub struct Arm {
    #[command(flatten)]
    plan: Named,
}

impl Arm {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        self.plan.post("arm", "armed")
    }
}

/// `gs-server plan disarm`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server plan disarm --config station.toml status")]
pub struct Disarm {
    #[command(flatten)]
    plan: Named,
}

impl Disarm {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        self.plan.post("disarm", "disarmed")
    }
}

/// `gs-server plan withdraw`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server plan withdraw --config station.toml status

Its text and its runs stay in the archive.")]
pub struct Withdraw {
    #[command(flatten)]
    plan: Named,
}

impl Withdraw {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let (remote, name) = self.plan.server()?;
        runtime()?.block_on(remote.remove(&format!("plans/{name}"))).map_err(failure)?;
        print_line(format_args!("plan {name} is withdrawn"))?;
        Ok(Exit::Done)
    }
}

/// Which pass.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct Which {
    /// An instant within the pass, UTC
    #[arg(long, value_name = "TIME")]
    at: Option<Time>,
    /// The next pass that has not begun
    #[arg(long)]
    next: bool,
}

/// `gs-server plan attach`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server plan attach --config station.toml status --next
  gs-server plan attach --config station.toml picture --at 2026-12-01T18:22:00Z

--next takes the next pass of its satellite that has not begun and that the plan takes (min_pass).
A chosen pass stays chosen when newer elements move it. The plan runs there when it is armed.")]
pub struct Attach {
    #[command(flatten)]
    plan: Named,
    #[command(flatten)]
    which: Which,
}

impl Attach {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let (remote, name) = self.plan.server()?;
        let at = runtime()?.block_on(async {
            match self.which.at {
                Some(at) => choose(&remote, &name, at, "attach").await.map_err(failure).map(|()| at),
                None => attach_next(&remote, &name).await,
            }
        })?;
        print_line(format_args!("plan {name} is attached to the pass at {}", minute(at)))?;
        Ok(Exit::Done)
    }
}

/// `gs-server plan detach`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server plan detach --config station.toml status --next
  gs-server plan detach --config station.toml status --at 2026-12-01T18:22:00Z

--next: the first of its chosen passes that is not over yet.")]
pub struct Detach {
    #[command(flatten)]
    plan: Named,
    #[command(flatten)]
    which: Which,
}

impl Detach {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let (remote, name) = self.plan.server()?;
        let at = runtime()?.block_on(async {
            let at = match self.which.at {
                Some(at) => at,
                None => {
                    let plan = plan(&remote, &name).await?;
                    let first = plan.picks.iter().copied().min();
                    first.ok_or_else(|| Failure::failed(format!("plan {name}: no pass is chosen for it")))?
                }
            };
            choose(&remote, &name, at, "detach").await.map_err(failure).map(|()| at)
        })?;
        print_line(format_args!("plan {name} is detached from the pass at {}", minute(at)))?;
        Ok(Exit::Done)
    }
}

async fn choose(remote: &Remote, name: &PlanName, at: Time, verb: &str) -> Result<(), RemoteError> {
    remote.write(&format!("plans/{name}/{verb}"), &AttachRequest { at }).await.map(|_| ())
}

async fn plan(remote: &Remote, name: &PlanName) -> Result<PlanView, Failure> {
    let found = plans(remote).await?.into_iter().find(|plan| plan.name == name.as_str());
    found.ok_or_else(|| Failure::refused(format!("the server refuses: plan: there is no plan '{name}'")))
}

/// The first pass that has not begun and that the plan takes.
async fn attach_next(remote: &Remote, name: &PlanName) -> Result<Time, Failure> {
    let satellite = plan(remote, name).await?.satellite;
    let station: StationView = remote.get("station", &[]).await.map_err(failure)?;
    let to_come = |pass: &NextPass| pass.aos > station.at;
    let known = station.satellites.iter().find(|known| known.satellite == satellite);
    let passes: Vec<Time> = known
        .iter()
        .flat_map(|known| &known.next_passes)
        .filter(|pass| to_come(pass))
        .map(|pass| pass.tca)
        .collect();
    let mut refused = None;
    for at in passes {
        match choose(remote, name, at, "attach").await {
            Ok(()) => return Ok(at),
            Err(error @ RemoteError::Refused(_)) => refused = refused.or(Some(error)),
            Err(error) => return Err(failure(error)),
        }
    }
    Err(match refused {
        Some(error) => {
            Failure::refused(format!("{name} takes none of the passes that are known; of the first, {error}"))
        }
        None => Failure::failed(format!(
            "no pass of {satellite} is known: give the station its place and elements (`gs-server elements list`)"
        )),
    })
}
