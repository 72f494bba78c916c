//! `gs-server plan new|check`; the verbs that speak to a server are in `plans`.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use api::{PlanFinding, Time};
use clap::{Args, Subcommand};
use mission::plan::need::least_us;
use mission::plan::{CheckContext, PassShape};
use mission::{Clock as _, Profile, SatelliteId, UtcUs};
use radio::airtime::LinkTiming;
use serde::Serialize;

use super::shell::{print_json, print_line};
use super::{Exit, Failure, plans};
use crate::clock::SystemClock;
use crate::config::{Config, station_config};
use crate::plan::template::Template;
use crate::plan::{CheckedText, Form, check_text};

/// `gs-server plan`.
#[derive(Debug, Subcommand)]
pub enum Plan {
    /// Print a plan to begin with, every line of it explained
    #[command(after_help = "\
Examples:
  gs-server plan new > listen.toml
  gs-server plan new --template picture --satellite pixelsat-1 > picture.toml
  gs-server plan new --template set-clock --approved-by 'A. Verma' > set-clock.toml")]
    New(New),
    /// Check a plan: words, ranges, approvals, and whether it fits a pass
    #[command(after_help = "\
Examples:
  gs-server plan check picture.toml
  gs-server plan check picture.toml --pass 480 --max-elevation 30 --config station.toml
  gs-server plan new --template status | gs-server plan check - --json

Nothing is sent, no server is asked. Each finding is one line, FILE:LINE:COLUMN, with the field and
the remedy. Exit code 0 when there is no error (warnings may be there), 2 when there is one.")]
    Check(Check),
    /// Hand a plan to the running server; one of the same name is withdrawn
    Add(plans::Add),
    /// Show the plans in use: armed or not, and the passes they are attached to
    List(plans::List),
    /// Let a plan run in its passes
    Arm(plans::Arm),
    /// Do not let a plan run any more; a run that lasts is stopped
    Disarm(plans::Disarm),
    /// Choose a pass for a plan
    Attach(plans::Attach),
    /// Take the choice of a pass back
    Detach(plans::Detach),
    /// Take a plan out of use; a run that lasts is stopped
    Withdraw(plans::Withdraw),
}

/// `gs-server plan new`.
#[derive(Debug, Args)]
pub struct New {
    /// Which
    #[arg(long, value_enum, default_value_t)]
    template: Template,
    /// Whom it commands, as the configuration calls it
    #[arg(long, value_name = "NAME", default_value = "pixelsat-1")]
    satellite: String,
    /// Who has looked at what is critical in it, and allows it
    #[arg(long, value_name = "PERSON")]
    approved_by: Option<String>,
}

/// `gs-server plan check`.
#[derive(Debug, Args)]
pub struct Check {
    /// A plan in TOML or JSON, or - for standard input
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Length of the pass in seconds; without it, the plan's own min_pass
    #[arg(long, value_name = "SECONDS")]
    pass: Option<f64>,
    /// Greatest elevation of the pass in degrees
    #[arg(long, value_name = "DEG", requires = "pass")]
    max_elevation: Option<f64>,
    /// Satellites and airtime as this configuration has them; else those of the usual module
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Times before this lie in the past; now, when left out
    #[arg(long, value_name = "TIME")]
    at: Option<Time>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Verdict<'a> {
    ok: bool,
    name: Option<&'a str>,
    satellite: Option<&'a str>,
    steps: Option<usize>,
    least_s: Option<f64>,
    findings: &'a [PlanFinding],
}

impl Plan {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::New(new) => new.run(),
            Self::Check(check) => check.run(),
            Self::Add(verb) => verb.run(),
            Self::List(verb) => verb.run(),
            Self::Arm(verb) => verb.run(),
            Self::Disarm(verb) => verb.run(),
            Self::Attach(verb) => verb.run(),
            Self::Detach(verb) => verb.run(),
            Self::Withdraw(verb) => verb.run(),
        }
    }
}

impl New {
    fn run(self) -> Result<Exit, Failure> {
        SatelliteId::new(&self.satellite).map_err(|error| Failure::usage(format!("--satellite: {error}")))?;
        print_line(self.template.write(&self.satellite, self.approved_by.as_deref()).trim_end())?;
        if self.template.needs_approval() && self.approved_by.is_none() {
            eprintln!(
                "gs-server: something in it is critical: give --approved-by PERSON, or fill in approved_by, before it \
                 can be armed"
            );
        }
        Ok(Exit::Done)
    }
}

/// Bytes of a plan that are read; the reader refuses less.
const READ_MAX: u64 = 1 << 20;

impl Check {
    fn run(self) -> Result<Exit, Failure> {
        let name = self.file.display().to_string();
        let text = read(&self.file, &name)?;
        let form = Form::of(&text);
        let links = self.config.as_deref().map(ConfiguredLinks::load).transpose()?;
        let mut context = CheckContext {
            timing: LinkTiming::default(),
            profile: None,
            pass: self.pass_shape()?,
            now: Some(self.at.map_or_else(|| SystemClock::new().now().utc, |time| UtcUs(time.unix_us()))),
        };
        let checked = check_for(&text, form, &mut context, links.as_ref());
        self.tell(&name, &checked, &context.timing)
    }

    fn pass_shape(&self) -> Result<Option<PassShape>, Failure> {
        let Some(seconds) = self.pass else { return Ok(None) };
        if !(seconds.is_finite() && (1.0..=86_400.0).contains(&seconds)) {
            return Err(Failure::usage(format!("--pass: {seconds} s; give 1 to 86400 seconds")));
        }
        if let Some(deg) = self.max_elevation.filter(|deg| !(0.0..=90.0).contains(deg)) {
            return Err(Failure::usage(format!("--max-elevation: {deg}; give 0 to 90 degrees")));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 86,400 s")]
        let duration_us = (seconds * 1e6) as u64;
        Ok(Some(PassShape { duration_us, max_elevation_deg: self.max_elevation }))
    }

    fn tell(&self, name: &str, checked: &CheckedText, timing: &LinkTiming) -> Result<Exit, Failure> {
        let plan = checked.plan.as_ref();
        let least_us = plan.map(|plan| least_us(&plan.steps, timing));
        let good = checked.is_good();
        if self.json {
            #[expect(clippy::cast_precision_loss, reason = "milliseconds of a pass")]
            let least_s = least_us.map(|us| us.div_ceil(1000) as f64 / 1000.0);
            print_json(&Verdict {
                ok: good,
                name: plan.map(|plan| plan.name.as_str()),
                satellite: plan.map(|plan| plan.satellite.as_str()),
                steps: plan.map(|plan| plan.steps.len()),
                least_s,
                findings: &checked.findings,
            })?;
        } else {
            for finding in &checked.findings {
                print_line(line(name, finding))?;
            }
        }
        if !good {
            let errors = match checked.errors() {
                1 => "1 error".to_owned(),
                n => format!("{n} errors"),
            };
            return Err(Failure::usage(format!("{name}: {errors}, the plan is not taken")));
        }
        if let (false, Some(plan), Some(least_us)) = (self.json, plan, least_us) {
            let seconds = least_us.div_ceil(1_000_000);
            let steps = plan.steps.len();
            print_line(format!(
                "{name}: plan {} for {} is good: {steps} steps, at least {seconds} s of a pass",
                plan.name, plan.satellite
            ))?;
        }
        Ok(Exit::Done)
    }
}

/// The check with airtime and profile of the satellite that the plan names.
pub(super) fn check_for(
    text: &str,
    form: Form,
    context: &mut CheckContext,
    links: Option<&ConfiguredLinks>,
) -> CheckedText {
    let mut checked = check_text(text, form, context);
    if let (Some(links), Some(plan)) = (links, &checked.plan) {
        match links.of(&plan.satellite) {
            Some((profile, timing)) => {
                (context.profile, context.timing) = (Some(profile), timing);
                checked = check_text(text, form, context);
            }
            None => checked.findings.push(unknown_satellite(&plan.satellite)),
        }
    }
    checked
}

/// The text of a plan, from a file or standard input.
pub(super) fn read(file: &Path, name: &str) -> Result<String, Failure> {
    let mut text = String::new();
    let result = if name == "-" {
        io::stdin().lock().take(READ_MAX).read_to_string(&mut text)
    } else {
        File::open(file).and_then(|file| file.take(READ_MAX).read_to_string(&mut text))
    };
    result.map_err(|error| Failure::doing(format!("plan {name} cannot be read"), error))?;
    Ok(text)
}

/// `FILE:LINE:COLUMN: error at FIELD: PROBLEM. REMEDY`.
pub(super) fn line(name: &str, finding: &PlanFinding) -> String {
    let place = match (finding.line, finding.column) {
        (Some(line), Some(column)) => format!("{name}:{line}:{column}"),
        _ => name.to_owned(),
    };
    let at = if finding.place.is_empty() { String::new() } else { format!(" at {}", finding.place) };
    format!("{place}: {}{at}: {}. {}", finding.severity, finding.problem, finding.remedy)
}

/// What a configuration says of its satellites and their links.
pub(super) struct ConfiguredLinks {
    links: Vec<(SatelliteId, Profile, LinkTiming)>,
}

impl ConfiguredLinks {
    pub(super) fn load(path: &Path) -> Result<Self, Failure> {
        let config = Config::load(path).map_err(Failure::usage)?;
        config.check().map_err(Failure::usage)?;
        Self::of_config(&config)
    }

    pub(super) fn of_config(config: &Config) -> Result<Self, Failure> {
        let station = station_config(config, &Default::default()).map_err(Failure::usage)?;
        let links = station.satellites.iter().filter_map(|satellite| {
            let link = station.links.iter().find(|link| link.satellite == satellite.id && !link.receive_only);
            let link = link.or_else(|| station.links.iter().find(|link| link.satellite == satellite.id));
            Some((satellite.id.clone(), satellite.profile, link?.timing))
        });
        Ok(Self { links: links.collect() })
    }

    pub(super) fn of(&self, satellite: &SatelliteId) -> Option<(Profile, LinkTiming)> {
        self.links.iter().find(|(id, ..)| id == satellite).map(|(_, profile, timing)| (*profile, *timing))
    }
}

pub(super) fn unknown_satellite(satellite: &SatelliteId) -> PlanFinding {
    PlanFinding {
        severity: "error".to_owned(),
        place: "satellite".to_owned(),
        line: None,
        column: None,
        problem: format!("the configuration has no link to '{satellite}'"),
        remedy: "Give the name of a satellite with a [[links]] section.".to_owned(),
    }
}
