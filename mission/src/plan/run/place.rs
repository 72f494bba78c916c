//! Where in the plan a run stands: its step, the limits around it, the number of its ask.

use super::PlanRun;
use crate::plan::progress::Frame;
use crate::plan::step::{Action, Ordinal, Plan, Step, ordinals};

impl PlanRun {
    pub(super) fn deepest(&self) -> usize {
        self.progress.cursor.len().saturating_sub(1)
    }

    /// The outermost limit that is over: its depth, and how long it was.
    pub(super) fn limit_that_is_over(&self, plan: &Plan) -> Option<(usize, u64)> {
        self.limits(plan).find(|&(_, _, left_us)| left_us == 0).map(|(depth, limit_us, _)| (depth, limit_us))
    }

    pub(super) fn until_a_limit(&self, plan: &Plan) -> Option<u64> {
        self.limits(plan).map(|(_, _, left_us)| left_us).min()
    }

    /// Depth, limit and what is left of it, of the current step and those around it.
    pub(super) fn limits<'a>(&'a self, plan: &'a Plan) -> impl Iterator<Item = (usize, u64, u64)> + 'a {
        (0..self.progress.cursor.len()).filter_map(move |depth| {
            let cursor = &self.progress.cursor[..=depth];
            let limit_us = step_at(&plan.steps, cursor)?.limit_us?;
            let entered_us = cursor[depth].entered_us?;
            let left_us = entered_us.saturating_add(limit_us).saturating_sub(self.progress.ran_us);
            Some((depth, limit_us, left_us))
        })
    }

    /// The number of the current ask.
    pub(super) fn ordinal(&self) -> Ordinal {
        let mut steps = self.plan.steps.as_slice();
        let mut number = 0_u64;
        for frame in &self.progress.cursor {
            let index = frame.index as usize;
            number = number.saturating_add(ordinals(steps.get(..index).unwrap_or(steps)));
            number = number.saturating_add(u64::from(frame.part));
            match steps.get(index).map(|step| &step.action) {
                Some(Action::Repeat { steps: inner, .. }) => {
                    number = number.saturating_add(ordinals(inner).saturating_mul(u64::from(frame.round)));
                    steps = inner;
                }
                _ => break,
            }
        }
        Ordinal(number)
    }
}

/// The step at this place; `None` behind the end of its list.
pub(super) fn step_at<'a>(steps: &'a [Step], cursor: &[Frame]) -> Option<&'a Step> {
    let (first, rest) = cursor.split_first()?;
    let step = steps.get(first.index as usize)?;
    match (&step.action, rest.is_empty()) {
        (_, true) => Some(step),
        (Action::Repeat { steps, .. }, false) => step_at(steps, rest),
        (_, false) => None,
    }
}

pub(super) fn place(cursor: &[Frame]) -> String {
    let steps: Vec<String> = cursor.iter().map(|frame| format!("steps[{}]", frame.index)).collect();
    steps.join(".")
}
