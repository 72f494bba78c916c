//! Everything that is wrong with a plan, each with its place and its remedy.

mod fits;
mod steps;
#[cfg(test)]
mod tests;

use std::fmt;

use radio::airtime::LinkTiming;

use super::condition::seconds;
use super::step::{Action, AtLos, Plan, Step};
use crate::clock::UtcUs;
use crate::config::Profile;

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
    if depth(&plan.steps) > DEPTH_MAX {
        let problem = "too many repeats inside each other";
        checker.error("steps", problem, format!("{DEPTH_MAX} are allowed."));
    } else if checker.list("steps", &plan.steps) {
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
}

/// How many repeats lie inside each other.
fn depth(steps: &[Step]) -> usize {
    let of = |step: &Step| match &step.action {
        Action::Repeat { steps, .. } => 1 + depth(steps),
        _ => 0,
    };
    steps.iter().map(of).max().unwrap_or(0)
}

fn only_listens(step: &Step) -> bool {
    matches!(step.action, Action::Listen { .. } | Action::WaitFor { .. })
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
