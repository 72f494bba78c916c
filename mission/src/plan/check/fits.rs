//! Whether there is time for all of it in a pass.

use super::{ASKS_MAX, Checker};
use crate::plan::condition::seconds;
use crate::plan::need::{begin_us, list_us, step_us};
use crate::plan::step::{Action, AtLos, Step, ordinals};

impl Checker<'_> {
    pub(super) fn asks(&mut self) {
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
    pub(super) fn fits(&mut self) {
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
    pub(super) fn too_late(&mut self, place: &str, steps: &[Step], from_us: u64, duration_us: u64) {
        let mut at_us = from_us;
        for (at, step) in steps.iter().enumerate() {
            let place = format!("{place}[{at}]");
            // What is left for the next pass is come to at its beginning.
            let begin_us = match self.plan.at_los {
                AtLos::Stop => begin_us(&step.when, at_us),
                AtLos::FinishLater => begin_us(&step.when, 0),
            };
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

/// Seconds, rounded up: what is needed at least.
pub(super) fn up(us: u64) -> String {
    seconds(us.div_ceil(100_000).saturating_mul(100_000))
}
