//! Everything that is wrong with a plan, each with its place and its remedy.

use std::fmt;

use protocol::Telecommand;
use radio::airtime::LinkTiming;

use super::condition::{Condition, seconds};
use super::need::{begin_us, list_us, step_us};
use super::run::first_past_entry;
use super::step::{Action, AtLos, Plan, Send, Step, ordinals};
use crate::clock::UtcUs;
use crate::config::Profile;
use crate::telemetry::known_parameters;

/// Asks that a plan may come to, every repeat written out.
pub const ASKS_MAX: u64 = 1000;
/// Rounds of one repeat.
pub const ROUNDS_MAX: u32 = 1000;
/// Steps of one list.
pub const STEPS_MAX: usize = 100;
/// Repeats inside repeats.
pub const DEPTH_MAX: usize = 4;
/// No time in a plan is longer, microseconds: a day.
pub const TIME_MAX_US: u64 = 86_400_000_000;

/// What a plan is held against.
#[derive(Debug, Clone)]
pub struct CheckContext {
    /// Airtime of the link that would be used.
    pub timing: LinkTiming,
    /// What the satellite knows; `None` when nobody says which it is.
    pub profile: Option<Profile>,
    /// The pass; `None`: only the least pass of the plan itself is looked at.
    pub pass: Option<PassShape>,
    /// The time now, for what may lie in the past; `None`: not looked at.
    pub now: Option<UtcUs>,
}

/// What must be known of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassShape {
    /// From AOS to LOS, microseconds.
    pub duration_us: u64,
    /// The greatest elevation, degrees; `None` when nobody says.
    pub max_elevation_deg: Option<f64>,
}

/// How grave a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth a second look.
    Warning,
    /// The plan is not taken.
    Error,
}

impl Severity {
    /// The word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Something that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// How grave.
    pub severity: Severity,
    /// Where, e.g. `steps[3].when.elevation_deg`; empty for the whole plan.
    pub place: String,
    /// What is wrong, with what was found.
    pub problem: String,
    /// What to do.
    pub remedy: String,
}

impl Finding {
    /// An error.
    pub fn error(place: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            severity: Severity::Error,
            place: place.into(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    /// A warning.
    pub fn warning(place: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(place, problem, remedy) }
    }
}

/// `error at steps[3].for_s: 0 s. Give 1 to 86400.`
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.severity.name())?;
        if !self.place.is_empty() {
            write!(f, " at {}", self.place)?;
        }
        write!(f, ": {}. {}", self.problem, self.remedy)
    }
}

/// Everything that is wrong with the plan, in the order of its text. Without an error it may be armed.
pub fn check(plan: &Plan, context: &CheckContext) -> Vec<Finding> {
    let mut checker = Checker { plan, context, findings: Vec::new() };
    checker.head();
    checker.attach();
    let bounded = checker.list("steps", &plan.steps, 0);
    if bounded {
        checker.asks();
        checker.fits();
    }
    checker.findings
}

struct Checker<'a> {
    plan: &'a Plan,
    context: &'a CheckContext,
    findings: Vec<Finding>,
}

impl Checker<'_> {
    fn error(&mut self, place: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) {
        self.findings.push(Finding::error(place, problem, remedy));
    }

    fn warning(&mut self, place: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) {
        self.findings.push(Finding::warning(place, problem, remedy));
    }

    fn head(&mut self) {
        let plan = self.plan;
        if !(plan.worth.is_finite() && (0.0..=1e6).contains(&plan.worth)) {
            self.error("worth", format!("{}", plan.worth), "Give 0 to 1000000; 1 is usual.");
        }
        if let Some(limit_us) = plan.limit_us {
            self.time("limit_s", limit_us);
        }
        self.elevation("min_pass.max_elevation_deg", plan.min_pass.max_elevation_deg);
        if plan.min_pass.duration_us > TIME_MAX_US {
            self.error("min_pass.duration_s", "longer than a day", "Give 0 to 86400.");
        }
        if !plan.transmit && plan.at_los == AtLos::FinishLater && plan.steps.iter().all(only_listens) {
            self.warning(
                "at_los",
                "'finish-later' with nothing but listening",
                "Say \"stop\": each pass is listened to by itself.",
            );
        }
    }

    fn attach(&mut self) {
        let Some(rule) = &self.plan.attach else { return };
        if let Some(wanted) = rule.min_max_elevation_deg {
            self.elevation("attach.min_max_elevation_deg", wanted);
        }
        if rule.every == 0 {
            self.error("attach.every", "0", "Give 1 for every pass, 2 for every second one, and so on.");
        }
        for (at, hours) in rule.hours_utc.iter().enumerate() {
            if hours.from_min >= 1440 || hours.to_min >= 1440 {
                self.error(
                    format!("attach.hours_utc[{at}]"),
                    "beyond the end of the day",
                    "Give two times from 00:00 to 23:59, e.g. \"18:00-06:00\".",
                );
            }
        }
    }

    fn time(&mut self, place: impl Into<String>, us: u64) {
        if us == 0 || us > TIME_MAX_US {
            self.error(place, format!("{} s", seconds(us)), "Give more than 0 and at most 86400 seconds.");
        }
    }

    fn elevation(&mut self, place: impl Into<String>, deg: f64) {
        if !(0.0..=90.0).contains(&deg) {
            self.error(place, format!("{deg}°"), "Give 0 to 90 degrees.");
        }
    }

    /// Whether the list is of a size that can be looked at as a whole.
    fn list(&mut self, place: &str, steps: &[Step], depth: usize) -> bool {
        if steps.is_empty() {
            self.error(place, "there is no step", "Add one, e.g. do = \"listen\" with for_s = 60.");
        }
        if steps.len() > STEPS_MAX {
            self.error(
                place,
                format!("{} steps", steps.len()),
                format!("{STEPS_MAX} fit: make two plans of it."),
            );
            return false;
        }
        if depth > DEPTH_MAX {
            self.error(place, "too many repeats inside each other", format!("{DEPTH_MAX} are allowed."));
            return false;
        }
        let mut bounded = true;
        for (at, step) in steps.iter().enumerate() {
            bounded &= self.step(&format!("{place}[{at}]"), step, depth);
        }
        bounded
    }

    fn step(&mut self, place: &str, step: &Step, depth: usize) -> bool {
        self.condition(&format!("{place}.when"), &step.when);
        if let Some(limit_us) = step.limit_us {
            self.time(format!("{place}.limit_s"), limit_us);
            let least_us =
                step_us(&Step { when: Condition::default(), ..step.clone() }, &self.context.timing, 0);
            if limit_us < least_us && depth <= DEPTH_MAX {
                self.error(
                    format!("{place}.limit_s"),
                    format!(
                        "the step takes {} s at least, its limit is {} s",
                        up(least_us),
                        seconds(limit_us)
                    ),
                    "Give it more time, or less to do.",
                );
            }
        }
        if step.action.transmits() && !self.plan.transmit {
            self.error(
                format!("{place}.do"),
                format!(
                    "'{}' makes the station transmit, and the plan says transmit = false",
                    step.action.name()
                ),
                "Say transmit = true, or take the step out.",
            );
        }
        match &step.action {
            Action::Listen { for_us } => self.time(format!("{place}.for_s"), *for_us),
            Action::WaitFor { until, timeout_us } => {
                self.time(format!("{place}.timeout_s"), *timeout_us);
                self.condition(&format!("{place}.until"), until);
                if until.is_empty() {
                    self.error(
                        format!("{place}.until"),
                        "nothing is waited for",
                        "Give a condition, e.g. until = { heard_within_s = 70 }, or use 'listen'.",
                    );
                }
            }
            Action::DownloadImage => {}
            Action::Send(send) => self.send(place, send),
            Action::Repeat { steps, until, at_most } => {
                if let Some(until) = until {
                    self.condition(&format!("{place}.until"), until);
                    if until.is_empty() {
                        self.error(
                            format!("{place}.until"),
                            "an empty condition always holds",
                            "Give a condition, or leave 'until' out to do every round.",
                        );
                    }
                }
                if *at_most == 0 || *at_most > ROUNDS_MAX {
                    self.error(
                        format!("{place}.at_most"),
                        format!("{at_most} rounds"),
                        format!("Give 1 to {ROUNDS_MAX}: a repeat has a bound."),
                    );
                }
                return self.list(&format!("{place}.steps"), steps, depth + 1);
            }
        }
        true
    }

    fn send(&mut self, place: &str, send: &Send) {
        if send.telecommands.is_empty() {
            self.error(place, "there is nothing to send", "Name a telecommand.");
        }
        if send.attempts == Some(0) {
            self.error(format!("{place}.attempts"), "0", "Give 1 or more, or leave it out.");
        }
        for telecommand in &send.telecommands {
            self.telecommand(place, send, telecommand);
        }
        let critical = send.telecommands.iter().find(|telecommand| telecommand.is_critical());
        let now = self.context.now;
        match (critical, &send.approval) {
            (Some(critical), None) => self.error(
                format!("{place}.approved_by"),
                format!("{} is critical, and nobody has approved it", critical.name()),
                format!(
                    "Have somebody look at it and add approved_by = {{ name = \"their name\", digest = \"{}\" }}.",
                    super::approval::digest(&send.telecommands)
                ),
            ),
            (_, Some(approval)) => {
                if let Err(why) = approval.allows(&send.telecommands, now) {
                    self.error(format!("{place}.approved_by"), why, "Have it approved again, as it stands now.");
                } else if approval.digest.is_none() {
                    self.warning(
                        format!("{place}.approved_by"),
                        "the approval is not bound to what it approves",
                        format!(
                            "Add digest = \"{}\": then a changed argument voids it.",
                            super::approval::digest(&send.telecommands)
                        ),
                    );
                }
            }
            (None, None) => {}
        }
    }

    fn telecommand(&mut self, place: &str, send: &Send, telecommand: &Telecommand) {
        if let Err(error) = telecommand.validate() {
            self.error(
                format!("{place}.arguments"),
                error.to_string(),
                "See the telecommand in docs/icd.md.",
            );
        }
        if let (Some(n @ 2..), false) = (send.attempts, telecommand.is_idempotent()) {
            self.error(
                format!("{place}.attempts"),
                format!("{n}, and {} must not be repeated", telecommand.name()),
                "Say 1 or leave it out: it is radiated once, and telemetry tells what became of it.",
            );
        }
        if let (Telecommand::GetImageRanges(_), Some(Profile { ranges: false, .. })) =
            (telecommand, self.context.profile)
        {
            self.error(
                format!("{place}.command"),
                "GetImageRanges is not in this satellite's profile",
                "Use GetImageChunk or download-image.",
            );
        }
        if let Telecommand::SetTimestamp { utc_ms: 1.. } = telecommand {
            self.warning(
                format!("{place}.arguments.utc"),
                "a fixed time sets the satellite's clock wrong unless it is radiated at that very moment",
                "Say utc = \"now\".",
            );
        }
        let past = self.context.now.and_then(|now| first_past_entry(telecommand, now));
        if let Some(entry) = past {
            let (list, entry) = match telecommand {
                Telecommand::UploadSchedule(upload) => ("entries", entry + 8 * usize::from(upload.part)),
                _ => ("slots", entry),
            };
            self.error(
                format!("{place}.{list}[{entry}].time"),
                "it lies in the past",
                "Give a time that is still ahead when the pass is over.",
            );
        }
    }

    fn condition(&mut self, place: &str, condition: &Condition) {
        if let Some(deg) = condition.min_elevation_deg {
            self.elevation(format!("{place}.elevation_deg"), deg);
            let best = self.context.pass.and_then(|pass| pass.max_elevation_deg);
            if let Some(best) = best.filter(|best| *best < deg) {
                self.error(
                    format!("{place}.elevation_deg"),
                    format!("{deg}° is wanted, this pass comes to {best}° at most"),
                    "Ask for less, or take a higher pass.",
                );
            } else if self.plan.min_pass.max_elevation_deg < deg && self.context.pass.is_none() {
                self.warning(
                    format!("{place}.elevation_deg"),
                    format!(
                        "{deg}° is wanted, the plan takes passes of {}°",
                        self.plan.min_pass.max_elevation_deg
                    ),
                    "Set min_pass.max_elevation_deg to as much, or some passes are for nothing.",
                );
            }
        }
        for (field, us) in
            [("heard_within_s", condition.heard_within_us), ("before_los_s", condition.before_los_us)]
        {
            if let Some(us) = us {
                self.time(format!("{place}.{field}"), us);
            }
        }
        if condition.after_aos_us.is_some_and(|us| us > TIME_MAX_US) {
            self.error(format!("{place}.after_aos_s"), "longer than a day", "Give 0 to 86400.");
        }
        for (at, guard) in condition.telemetry.iter().enumerate() {
            let place = format!("{place}.telemetry[{at}]");
            if !guard.value.is_finite() {
                self.error(format!("{place}.value"), format!("{}", guard.value), "Give a number.");
            }
            self.time(format!("{place}.max_age_s"), guard.max_age_us);
            let known = known_parameters();
            if !known.contains(&guard.parameter) {
                let near = nearest(&guard.parameter, known.iter().map(String::as_str));
                let remedy = near.map_or_else(
                    || "Write packet.field, e.g. heartbeat.temp.".to_owned(),
                    |near| format!("Did you mean {near}?"),
                );
                self.error(
                    format!("{place}.parameter"),
                    format!("no packet has '{}'", guard.parameter.chars().take(60).collect::<String>()),
                    remedy,
                );
            }
        }
    }

    fn asks(&mut self) {
        let asks = ordinals(&self.plan.steps);
        if asks > ASKS_MAX {
            self.error(
                "steps",
                format!("with every repeat written out these are {asks} steps"),
                format!("{ASKS_MAX} fit in a pass: repeat less often."),
            );
        }
    }

    /// Whether there is time for all of it.
    fn fits(&mut self) {
        let (plan, timing) = (self.plan, &self.context.timing);
        let least_us = list_us(&plan.steps, timing, 0);
        if let Some(limit_us) = plan.limit_us.filter(|limit_us| *limit_us < least_us) {
            self.error(
                "limit_s",
                format!("the plan takes {} s at least, its limit is {} s", up(least_us), seconds(limit_us)),
                "Give it more time, or fewer steps.",
            );
        }
        let (duration_us, whose) = match self.context.pass {
            Some(pass) => (pass.duration_us, "this pass lasts"),
            None if plan.min_pass.duration_us > 0 => {
                (plan.min_pass.duration_us, "it takes passes (min_pass.duration_s) of")
            }
            None => return,
        };
        let shape = self.context.pass;
        if let Some(pass) = shape {
            if pass.duration_us < plan.min_pass.duration_us {
                self.error(
                    "min_pass.duration_s",
                    format!(
                        "the plan wants {} s, this pass lasts {} s",
                        seconds(plan.min_pass.duration_us),
                        seconds(pass.duration_us)
                    ),
                    "Take a longer pass, or ask for less.",
                );
            }
            if let Some(best) = pass.max_elevation_deg.filter(|best| *best < plan.min_pass.max_elevation_deg)
            {
                self.error(
                    "min_pass.max_elevation_deg",
                    format!(
                        "the plan wants {}°, this pass comes to {best}°",
                        plan.min_pass.max_elevation_deg
                    ),
                    "Take a higher pass, or ask for less.",
                );
            }
        }
        if least_us > duration_us {
            let problem =
                format!("the plan takes {} s at least, {whose} {} s", up(least_us), seconds(duration_us));
            match (shape, plan.at_los) {
                (Some(_), AtLos::FinishLater) => {
                    self.warning("steps", problem, "The rest stays for the next pass, as at_los says.");
                }
                (Some(_), AtLos::Stop) => self.error(
                    "steps",
                    problem,
                    "Take steps out, make two plans of it, or say at_los = \"finish-later\".",
                ),
                (None, AtLos::FinishLater) => {}
                (None, AtLos::Stop) => {
                    self.error("steps", problem, "Raise min_pass.duration_s, or take steps out.")
                }
            }
        }
        self.too_late("steps", &plan.steps, 0, duration_us);
    }

    /// Steps that want more of the pass than can be left when they are come to.
    fn too_late(&mut self, place: &str, steps: &[Step], from_us: u64, duration_us: u64) {
        let mut at_us = from_us;
        for (at, step) in steps.iter().enumerate() {
            let place = format!("{place}[{at}]");
            let begin_us = begin_us(&step.when, at_us);
            if let Some(before_us) = step.when.before_los_us
                && begin_us.saturating_add(before_us) > duration_us
                && begin_us <= duration_us
            {
                self.error(
                    format!("{place}.when.before_los_s"),
                    format!(
                        "it begins {} s after AOS at the earliest, and wants {} s before LOS, of {} s",
                        up(begin_us),
                        seconds(before_us),
                        seconds(duration_us)
                    ),
                    "Put it earlier, or ask for less.",
                );
            }
            if let Action::Repeat { steps, .. } = &step.action {
                self.too_late(&format!("{place}.steps"), steps, begin_us, duration_us);
            }
            at_us = step_us(step, &self.context.timing, at_us);
        }
    }
}

fn only_listens(step: &Step) -> bool {
    matches!(step.action, Action::Listen { .. } | Action::WaitFor { .. })
}

/// Seconds, rounded up: what is needed at least.
fn up(us: u64) -> String {
    seconds(us.div_ceil(100_000).saturating_mul(100_000))
}

/// The known word nearest to `found`, if one is near: for "did you mean".
pub fn nearest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let found: Vec<char> = found.chars().take(64).flat_map(char::to_lowercase).collect();
    let distance = |word: &str| {
        let word: Vec<char> = word.chars().flat_map(char::to_lowercase).collect();
        let mut row: Vec<usize> = (0..=word.len()).collect();
        for (i, a) in found.iter().enumerate() {
            let mut corner = row[0];
            row[0] = i + 1;
            for (j, b) in word.iter().enumerate() {
                let best = (corner + usize::from(a != b)).min(row[j] + 1).min(row[j + 1] + 1);
                corner = std::mem::replace(&mut row[j + 1], best);
            }
        }
        row[word.len()]
    };
    let near = known.into_iter().map(|word| (distance(word), word)).min()?;
    (near.0 <= (found.len() / 3).max(2)).then_some(near.1)
}
