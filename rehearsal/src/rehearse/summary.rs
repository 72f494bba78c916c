//! What may be expected, from many runs.

use std::collections::BTreeMap;

use mission::plan::{Finding, Plan};

use super::outcome::{Outcome, StepFate};

/// How the runs ended: the word, how many, and the first reason that was given.
pub type Ends = BTreeMap<&'static str, (usize, Option<String>)>;

/// A figure over many runs. Between `p10` and `p90` lies the next run with a chance of 80 %, if it is drawn as these were.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// One run in ten is at or below this.
    pub p10: f64,
    /// Half of them are.
    pub p50: f64,
    /// Nine in ten are.
    pub p90: f64,
}

impl Spread {
    /// Of these values; `None` of none, or where one is no number.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        if values.is_empty() || values.iter().any(|value| value.is_nan()) {
            return None;
        }
        values.sort_by(f64::total_cmp);
        Some(Self { p10: quantile(&values, 0.1), p50: quantile(&values, 0.5), p90: quantile(&values, 0.9) })
    }

    /// It lies in the interval that 80 % of further runs fall into.
    #[must_use]
    pub fn holds(&self, value: f64) -> bool {
        (self.p10..=self.p90).contains(&value)
    }
}

/// At the place p (n + 1) among n sorted values, between two of them in proportion: of further values the share p falls
/// below it. The first and the last stand in for what lies beyond.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    let place = (p * (sorted.len() as f64 + 1.0)).clamp(1.0, sorted.len() as f64);
    let below = (place.floor() as usize).min(sorted.len());
    let (low, high) = (sorted[below - 1], sorted[below.min(sorted.len() - 1)]);
    low + (high - low) * (place - place.floor())
}

/// What may be expected of a plan in its pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Runs.
    pub runs: usize,
    /// Runs in which the plan began.
    pub begun: usize,
    /// Telecommands asked for.
    pub commands_asked: Spread,
    /// Telecommands answered.
    pub commands_answered: Spread,
    /// Telecommands of which nobody knows what became.
    pub commands_unknown: Spread,
    /// Telecommands that failed.
    pub commands_failed: Spread,
    /// Runs in which something was on the air outside of the pass.
    pub runs_outside: usize,
    /// Chunks that came home.
    pub chunks_home: Spread,
    /// Chunks of the images; `None` when ground learned of no image in any run.
    pub chunks_of: Option<Spread>,
    /// Runs in which an image came home whole.
    pub images_whole: usize,
    /// Steps that were not done at LOS.
    pub steps_undone: Spread,
    /// Time on the air upwards, s.
    pub airtime_up_s: Spread,
    /// Time on the air downwards, s.
    pub airtime_down_s: Spread,
    /// How the runs ended.
    pub ends: Ends,
    /// Each step of the plan.
    pub steps: Vec<StepSummary>,
}

/// What became of one step in all runs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StepSummary {
    /// What it does, as plans say it.
    pub action: &'static str,
    /// Runs in which it was done.
    pub done: usize,
    /// Runs in which its time was over, and what was done counts.
    pub partly: usize,
    /// Runs in which it failed or was left out.
    pub failed: usize,
    /// Runs in which LOS or another end came in the middle of it.
    pub unfinished: usize,
    /// Runs in which it was not come to.
    pub not_reached: usize,
    /// The first reason of a failure.
    pub why: Option<String>,
}

impl Summary {
    /// Of these runs of a plan; `None` of none.
    #[must_use]
    pub fn of(plan: &Plan, outcomes: &[Outcome]) -> Option<Self> {
        let spread = |of: &dyn Fn(&Outcome) -> f64| Spread::of(outcomes.iter().map(of));
        let count = |of: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|outcome| of(outcome)).count();
        let mut ends = Ends::new();
        for outcome in outcomes {
            let (runs, why) = ends.entry(outcome.end).or_default();
            *runs += 1;
            if why.is_none() {
                why.clone_from(&outcome.why);
            }
        }
        Some(Self {
            runs: outcomes.len(),
            begun: count(&|outcome| outcome.begun),
            commands_asked: spread(&|outcome| outcome.commands.asked as f64)?,
            commands_answered: spread(&|outcome| outcome.commands.answered as f64)?,
            commands_unknown: spread(&|outcome| outcome.commands.unknown as f64)?,
            commands_failed: spread(&|outcome| outcome.commands.failed as f64)?,
            runs_outside: count(&|outcome| outcome.commands.outside > 0),
            chunks_home: spread(&|outcome| outcome.chunks_home as f64)?,
            chunks_of: Spread::of(
                outcomes.iter().filter_map(|outcome| outcome.chunks_of).map(|of| of as f64),
            ),
            images_whole: count(&|outcome| outcome.chunks_of == Some(outcome.chunks_home)),
            steps_undone: spread(&|outcome| outcome.steps_undone() as f64)?,
            airtime_up_s: spread(&|outcome| outcome.airtime_up_s)?,
            airtime_down_s: spread(&|outcome| outcome.airtime_down_s)?,
            ends,
            steps: (0..plan.steps.len()).map(|at| StepSummary::of(plan, outcomes, at)).collect(),
        })
    }

    /// What the runs showed that no operator wants.
    #[must_use]
    pub fn warnings(&self) -> Vec<Finding> {
        let mut found = Vec::new();
        let runs = self.runs;
        if self.begun < runs {
            let why = self.ends.iter().filter(|(end, _)| matches!(**end, "missed" | "dropped" | "waiting"));
            let why =
                why.filter_map(|(_, (_, why))| why.as_deref()).next().unwrap_or("the pass was over before");
            let problem = format!("it did not begin in {} of {runs} runs: {why}", runs - self.begun);
            found.push(Finding::warning(
                "",
                problem,
                "See to the station's times and the conditions of the plan.",
            ));
        }
        if self.runs_outside > 0 {
            let problem = format!(
                "a command was on the air outside of the pass in {} of {runs} runs",
                self.runs_outside
            );
            found.push(Finding::warning("", problem, "Fresher elements tell AOS and LOS better."));
        }
        for (at, step) in self.steps.iter().enumerate() {
            if (step.done + step.partly) * 2 >= runs {
                continue;
            }
            let place = format!("steps[{at}]");
            let why = step.why.as_ref().map(|why| format!(", as a rule: {why}")).unwrap_or_default();
            let problem =
                format!("'{}' was done in {} of {runs} runs{why}", step.action, step.done + step.partly);
            found.push(Finding::warning(
                place,
                problem,
                "Ask for less before it, or choose a longer or higher pass.",
            ));
        }
        found
    }
}

impl StepSummary {
    fn of(plan: &Plan, outcomes: &[Outcome], at: usize) -> Self {
        let mut sum = Self { action: plan.steps[at].action.name(), ..Self::default() };
        for outcome in outcomes {
            match &outcome.steps[at] {
                StepFate::Done => sum.done += 1,
                StepFate::Partly => sum.partly += 1,
                StepFate::Skipped => sum.failed += 1,
                StepFate::Failed(why) => {
                    sum.failed += 1;
                    sum.why.get_or_insert_with(|| why.clone());
                }
                StepFate::Unfinished => sum.unfinished += 1,
                StepFate::NotReached => sum.not_reached += 1,
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_stand_where_further_values_fall_below_with_that_share() {
        let spread = Spread::of((1..=99).rev().map(f64::from)).unwrap();
        assert_eq!(spread, Spread { p10: 10.0, p50: 50.0, p90: 90.0 });
        assert!(spread.holds(10.0) && spread.holds(90.0) && !spread.holds(9.9) && !spread.holds(90.1));
        let spread = Spread::of([1.0, 2.0, 4.0]).unwrap();
        assert_eq!(spread, Spread { p10: 1.0, p50: 2.0, p90: 4.0 });
        assert_eq!(Spread::of([7.0]), Some(Spread { p10: 7.0, p50: 7.0, p90: 7.0 }));
        assert_eq!(Spread::of([]), None);
        assert_eq!(Spread::of([1.0, f64::NAN]), None);
    }
}
