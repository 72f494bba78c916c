//! `gs-server rehearse`.

mod tell;

use std::io::IsTerminal as _;
use std::ops::{ControlFlow, RangeInclusive};
use std::path::PathBuf;
use std::sync::Arc;

use api::PlanFinding;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use mission::config::Times;
use mission::plan::{CheckContext, Finding, Plan, Severity};
use mission::{Profile, SatelliteId, Site};
use radio::airtime::LinkTiming;
use rehearsal::rehearse::{
    Outcome, Rehearsal, RehearsalError, Summary, Uncertainty, coming_pass, refusals, rehearse, warnings,
};
use tle::Elements;

use super::plan::{ConfiguredLinks, line, read, unknown_satellite};
use super::shell::{print_json, print_line, print_text, runtime, stop_on_signals};
use super::sky::{Moment, Sky, SkyArgs, now};
use super::{Exit, Failure};
use crate::config::Config;
use crate::plan::{Form, check_text, place_findings};
use crate::rehearsed::answer;
use crate::sky::Place;

/// Runs of one call.
const RUNS_MAX: i64 = 100_000;

/// `gs-server rehearse`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server rehearse download.toml --config station.toml
  gs-server rehearse picture.toml --elements gp.json --station 46.5191,6.5668,410 --runs 1000
  gs-server rehearse night.toml --config station.toml --pass 2026-11-23T01:00:00Z --json

The station's own engine and the simulated satellite go through the first pass after --pass that the
plan takes, once for each seed: SEED, SEED + 1, ... Nothing is radiated and nothing is stored. A seed
decides what nobody knows beforehand: which frames are lost, how good the link is, the size of the
image, the beat of the heartbeat, and how far the elements are off. The same seeds give the same
answer. Eight of ten further runs lie between the columns 10 % and 90 %.

Exit code 0: rehearsed. 1: rehearsed, and the plan does not fit this pass or never began; or there is
no pass. 2: the arguments make no sense, or the station would not take the plan.")]
pub struct Rehearse {
    /// A plan in TOML or JSON, or - for standard input
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// A file of elements, or - for standard input; may be given several times
    #[arg(long, value_name = "FILE")]
    elements: Vec<PathBuf>,
    /// LATITUDE,LONGITUDE,HEIGHT_M (WGS84, decimal degrees, north and east positive), or NAME=...
    #[arg(long, value_name = "STATION", allow_hyphen_values = true)]
    station: Option<Place>,
    /// The station's configuration: satellite, link, times, and without --elements its place and the elements it holds
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The satellite of the elements, where it is not called there as in the plan: name, number or designator
    #[arg(long, value_name = "SATELLITE")]
    satellite: Option<String>,
    /// The first pass after this, or the one that lasts then
    #[arg(long, value_name = "T", default_value = "now", allow_hyphen_values = true)]
    pass: Moment,
    /// The first seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many runs
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=RUNS_MAX))]
    runs: u32,
    /// Size of the satellite's images in bytes, from the least to the greatest
    #[arg(long, value_name = "FROM-TO", default_value = "15000-45000", value_parser = sizes)]
    image_bytes: RangeInclusive<u32>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Rehearse {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        if self.seed.checked_add(u64::from(self.runs)).is_none() {
            return Err(Failure::usage(format!(
                "--seed: {} and {} runs are beyond the greatest seed",
                self.seed, self.runs
            )));
        }
        let name = self.plan.display().to_string();
        if name == "-" && self.elements.iter().any(|file| file.as_os_str() == "-") {
            return Err(Failure::usage("plan and elements cannot both come from standard input"));
        }
        let text = read(&self.plan, &name)?;
        let form = Form::of(&text);
        let plan = self.checked(&name, &text, form)?;
        let what = self.rehearsal(plan, &text)?;
        let refused = place_findings(&text, form, refusals(&what));
        if !refused.is_empty() {
            return Err(self.refuse(&name, &refused));
        }
        let outcomes = self.fly(&what)?;
        let summary = Summary::of(&what.plan, &outcomes)
            .ok_or_else(|| Failure::failed("no run came to its end: give --runs 1 or more"))?;
        let found: Vec<Finding> = warnings(&what).into_iter().chain(summary.warnings()).collect();
        let findings = place_findings(&text, form, found);
        let is_wrong = findings.iter().any(|finding| finding.severity == Severity::Error.name());
        let answer = answer(&what, self.seed, &summary, &outcomes, findings);
        if self.json {
            print_json(&answer)?;
        } else {
            print_text(&tell::table(&answer, &name))?;
        }
        Ok(if is_wrong || summary.begun == 0 { Exit::Failed } else { Exit::Done })
    }

    /// The plan, if it is one at all. What is wrong with it in its pass is told later.
    fn checked(&self, name: &str, text: &str, form: Form) -> Result<Plan, Failure> {
        let context = CheckContext { timing: LinkTiming::default(), profile: None, pass: None, now: None };
        let checked = check_text(text, form, &context);
        let is_good = checked.is_good();
        match checked.plan {
            Some(plan) if is_good => Ok(plan),
            _ => Err(self.refuse(name, &checked.findings)),
        }
    }

    /// Tells what is wrong, on standard output as `plan check` does.
    fn refuse(&self, name: &str, findings: &[PlanFinding]) -> Failure {
        let told = if self.json {
            print_json(&tell::refused(findings))
        } else {
            findings.iter().try_for_each(|finding| print_line(line(name, finding)))
        };
        told.err().unwrap_or_else(|| {
            Failure::usage(format!("{name}: the plan is not taken, and was not rehearsed"))
        })
    }

    fn rehearsal(&self, plan: Plan, text: &str) -> Result<Rehearsal, Failure> {
        let (profile, timing, times) = self.known(&plan.satellite)?;
        let now = now();
        let from = self.pass.resolve(now, now);
        let args = SkyArgs::of(
            self.elements.clone(),
            self.station.clone().into_iter().collect(),
            self.config.clone(),
        );
        let sky = args.read((from, from.plus_us(rehearsal::rehearse::AHEAD_US)))?;
        let site = Site {
            min_elevation_deg: sky.min_elevation_deg,
            orientation: sky.orientation,
            place: match &sky.places[..] {
                [place] => place.station.clone(),
                _ => return Err(Failure::usage("one station is rehearsed at a time")),
            },
        };
        let elements = self.elements_of(sky, &plan.satellite, from)?;
        let pass = coming_pass(&plan, &elements, &site, mission::sky::utc(from)).map_err(Failure::failed)?;
        Ok(Rehearsal {
            plan: Arc::new(plan),
            text: text.into(),
            elements,
            site,
            pass,
            profile,
            timing,
            times,
            uncertainty: Uncertainty { image_bytes: self.image_bytes.clone(), ..Uncertainty::default() },
        })
    }

    /// What the configuration says of the satellite and its link, and of the station's times.
    fn known(&self, satellite: &SatelliteId) -> Result<(Profile, LinkTiming, Times), Failure> {
        let Some(path) = &self.config else {
            return Ok((Profile::default(), LinkTiming::default(), Times::default()));
        };
        let links = ConfiguredLinks::load(path)?;
        let Some((profile, timing)) = links.of(satellite) else {
            let finding = unknown_satellite(satellite);
            return Err(Failure::usage(format!("{}. {}", finding.problem, finding.remedy)));
        };
        let config = Config::load(path).map_err(Failure::usage)?;
        Ok((profile, timing, config.station.times().map_err(Failure::usage)?))
    }

    /// The set for this moment: of the only object, or of the one that is called so.
    fn elements_of(
        &self,
        sky: Sky,
        satellite: &SatelliteId,
        from: tle::UtcInstant,
    ) -> Result<Elements, Failure> {
        let mut catalogue = sky.catalogue;
        let is_only = catalogue.objects.len() == 1 && !self.elements.is_empty();
        if let Some(wanted) = &self.satellite {
            catalogue.keep(std::slice::from_ref(wanted)).map_err(Failure::failed)?;
        } else if !is_only {
            catalogue.keep(&[satellite.to_string()]).map_err(|error| {
                Failure::failed(format!("{error}; say with --satellite how the elements call it"))
            })?;
        }
        match &catalogue.objects[..] {
            [object] => Ok(object.set_for(from).clone()),
            objects => Err(Failure::usage(format!(
                "{} objects of the elements are called so: choose one with --satellite NUMBER",
                objects.len()
            ))),
        }
    }

    /// On all cores, with a bar for those who watch, until a signal.
    fn fly(&self, what: &Rehearsal) -> Result<Vec<Outcome>, Failure> {
        let is_watched = std::io::stderr().is_terminal() && self.runs > 1;
        let bar = if is_watched { ProgressBar::new(u64::from(self.runs)) } else { ProgressBar::hidden() };
        bar.set_style(
            ProgressStyle::with_template("{bar:40} run {pos} of {len}, {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        let seeds: Vec<u64> = (self.seed..self.seed + u64::from(self.runs)).collect();
        let runtime = runtime()?;
        let _context = runtime.enter();
        let stop = stop_on_signals()?;
        let flown = rehearse(what, &seeds, |done| {
            bar.set_position(done as u64);
            if stop.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        bar.finish_and_clear();
        flown.map_err(|error| match error {
            RehearsalError::Refused(_) => Failure::usage(error),
            _ => Failure::failed(error),
        })
    }
}

/// `FROM-TO`, or one size.
fn sizes(text: &str) -> Result<RangeInclusive<u32>, String> {
    let wrong =
        || format!("'{text}' is no range of sizes: give bytes, such as 15000-45000; at most 14000000");
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    let size = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    let (from, to) = (size(from)?, size(to)?);
    // A chunk is named by 16 bits, and has 222 bytes.
    if from == 0 || from > to || to > 14_000_000 { Err(wrong()) } else { Ok(from..=to) }
}
