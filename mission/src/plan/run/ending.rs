//! Where steps, rounds and runs end.

use std::sync::Arc;

use super::place::{place, step_at};
use super::{Move, PlanRun, note};
use crate::level::Level;
use crate::plan::condition::{Holds, seconds};
use crate::plan::progress::{Frame, RunEnd, StepEnd, StepResult};
use crate::plan::step::{Action, AtLos, OnFailure};
use crate::plan::view::{RunView, Wish};

/// So many results are kept; a plan that passed the checker has no more.
const RESULTS_MAX: usize = 4096;

impl PlanRun {
    /// The step at this depth ended; what follows it is next.
    pub(super) fn done(&mut self, view: &RunView<'_>, depth: usize, end: StepEnd) -> Move {
        self.record(view, depth, end);
        self.progress.cursor.truncate(depth + 1);
        let frame = &mut self.progress.cursor[depth];
        *frame = Frame { index: frame.index.saturating_add(1), ..Frame::default() };
        Move::On
    }

    pub(super) fn fail(
        &mut self,
        view: &RunView<'_>,
        depth: usize,
        why: String,
        wishes: &mut Vec<Wish>,
    ) -> Move {
        let plan = Arc::clone(&self.plan);
        let cursor = &self.progress.cursor[..=depth];
        let step = place(cursor);
        let on_failure = step_at(&plan.steps, cursor).map(|step| step.on_failure).unwrap_or_default();
        wishes.push(note(Level::Warning, format!("plan {}: {step} failed: {why}", self.plan.name)));
        match (on_failure, depth.checked_sub(1)) {
            (OnFailure::Abort, _) => {
                self.record(view, depth, StepEnd::Failed(why.clone()));
                self.progress.cursor.truncate(depth + 1);
                self.over_with(view, RunEnd::Aborted { step, why }, wishes)
            }
            (OnFailure::Skip, Some(outer)) => {
                self.record(view, depth, StepEnd::Failed(why));
                self.done(view, outer, StepEnd::Skipped)
            }
            (OnFailure::Skip, None) | (OnFailure::Continue, _) => {
                self.done(view, depth, StepEnd::Failed(why))
            }
        }
    }

    /// Behind the last step of a list.
    pub(super) fn end_of_list(&mut self, view: &RunView<'_>, depth: usize, wishes: &mut Vec<Wish>) -> Move {
        let Some(outer) = depth.checked_sub(1) else {
            let failures = self.failures();
            return self.over_with(view, RunEnd::Completed { failures }, wishes);
        };
        let plan = Arc::clone(&self.plan);
        let repeat = step_at(&plan.steps, &self.progress.cursor[..=outer]);
        let Some(Action::Repeat { until, at_most, .. }) = repeat.map(|step| &step.action) else {
            let why = "the stored progress does not fit the plan".to_owned();
            return self.over_with(view, RunEnd::Aborted { step: self.current_step(), why }, wishes);
        };
        let holds = until.as_ref().map(|until| until.holds(view));
        let rounds = self.progress.cursor[outer].round.saturating_add(1);
        match holds {
            Some(Holds::Yes) => self.done(view, outer, StepEnd::Done),
            None if rounds >= *at_most => self.done(view, outer, StepEnd::Done),
            Some(Holds::Never(why)) => self.fail(view, outer, why, wishes),
            Some(Holds::NotYet { why, .. }) if rounds >= *at_most => {
                self.fail(view, outer, format!("{rounds} rounds, and still {why}"), wishes)
            }
            _ => {
                self.progress.cursor.truncate(depth);
                self.progress.cursor[outer].round = rounds;
                self.progress.cursor.push(Frame::default());
                Move::On
            }
        }
    }

    pub(super) fn out_of_time(
        &mut self,
        view: &RunView<'_>,
        level: usize,
        limit_us: u64,
        wishes: &mut Vec<Wish>,
    ) -> Move {
        let why = format!("its time limit of {} s is over", seconds(limit_us));
        let open = self.open_ask(view).is_some();
        self.withdraw(view, &why, wishes);
        let plan = Arc::clone(&self.plan);
        let step = step_at(&plan.steps, &self.progress.cursor[..=level]);
        if open && step.is_some_and(|step| step.action == Action::DownloadImage) {
            return self.done(view, level, StepEnd::Partly(why));
        }
        for depth in (level + 1..self.progress.cursor.len()).rev() {
            self.record(view, depth, StepEnd::Unfinished(why.clone()));
        }
        self.fail(view, level, why, wishes)
    }

    pub(super) fn lose_signal(&mut self, view: &RunView<'_>, wishes: &mut Vec<Wish>) {
        // What is behind the last step, or was answered in the last moment, is done.
        if self.progress.started_at.is_some() {
            self.settle(view);
        }
        let left = step_at(&self.plan.steps, &self.progress.cursor).is_some()
            || self.progress.started_at.is_none()
            || self.progress.cursor.len() > 1;
        let end = match (left, self.plan.at_los) {
            (false, _) => RunEnd::Completed { failures: self.failures() },
            (true, AtLos::Stop) => RunEnd::Unfinished,
            (true, AtLos::FinishLater) => RunEnd::Later,
        };
        let later = end == RunEnd::Later;
        let spent = later && self.is_spent(view);
        self.finish(view, end, "loss of signal", wishes);
        if spent {
            self.pass_by();
        }
    }

    pub(super) fn over_with(&mut self, view: &RunView<'_>, end: RunEnd, wishes: &mut Vec<Wish>) -> Move {
        self.finish(view, end, "the run has ended", wishes);
        Move::Over
    }

    pub(super) fn finish(&mut self, view: &RunView<'_>, end: RunEnd, why: &str, wishes: &mut Vec<Wish>) {
        if !matches!(end, RunEnd::Completed { .. } | RunEnd::Aborted { .. }) {
            self.withdraw(view, why, wishes);
            for depth in (0..self.progress.cursor.len()).rev() {
                if step_at(&self.plan.steps, &self.progress.cursor[..=depth]).is_some() {
                    self.record(view, depth, StepEnd::Unfinished(why.to_owned()));
                }
            }
        }
        wishes.push(Wish::Done(end.clone()));
        self.progress.end = Some(end);
        self.touch();
        self.wakeup = None;
    }

    pub(super) fn record(&mut self, view: &RunView<'_>, depth: usize, end: StepEnd) {
        if self.progress.results.len() >= RESULTS_MAX {
            self.progress.results_dropped = self.progress.results_dropped.saturating_add(1);
            return;
        }
        let cursor = &self.progress.cursor[..=depth];
        let entered_us = cursor[depth].entered_us.unwrap_or(self.progress.ran_us);
        let took_us = self.progress.ran_us.saturating_sub(entered_us);
        self.progress.results.push(StepResult {
            step: place(cursor),
            rounds: cursor[..depth].iter().map(|frame| frame.round).collect(),
            entered_at: view.now.utc.plus(-i64::try_from(took_us).unwrap_or(i64::MAX)),
            ended_at: view.now.utc,
            end,
        });
    }

    pub(super) fn failures(&self) -> u32 {
        let failed =
            self.progress.results.iter().filter(|result| matches!(result.end, StepEnd::Failed(_))).count();
        u32::try_from(failed).unwrap_or(u32::MAX)
    }
}
