//! The machine that goes through a plan: views in, wishes out.
//!
//! It has no clock and no hands. The engine calls [`PlanRun::advance`] after whatever changed the view, and at
//! [`PlanRun::next_wakeup`]; it stores [`PlanRun::progress`] when [`PlanRun::revision`] has moved, not later than what
//! the wishes caused; and it carries each ask out once under its [`Ordinal`], for ever. Then a life that ended at any
//! point is gone on with by [`PlanRun::resume`], and nothing is asked for that was accepted.

mod action;
mod asks;
mod ending;
mod place;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::sync::Arc;

pub(super) use self::action::first_past_entry;
use self::place::{place, step_at};
use super::condition::{Condition, seconds, us_between};
use super::progress::{Ask, Frame, Progress, RunEnd};
use super::step::{Action, Ordinal, Plan, Step};
use super::view::{AskState, ContactWindow, RunView, Wish};
use crate::clock::{MonoUs, Now};
use crate::level::Level;

/// So many steps end in one call at most; what is more follows in the next one.
const STEPS_A_CALL: usize = 1024;

/// A plan on its way through one pass.
#[derive(Debug, Clone)]
pub struct PlanRun {
    plan: Arc<Plan>,
    window: ContactWindow,
    progress: Progress,
    revision: u64,
    /// What was asked for in this life, accepted or not.
    wished: BTreeSet<Ordinal>,
    /// When the last view was; `None` before the first of this life.
    seen: Option<Now>,
    wakeup: Option<MonoUs>,
}

/// What follows a look at one step.
enum Move {
    /// Another step is the current one.
    On,
    /// Wait; look again after this long, `None`: when the view changes.
    Wait(Option<u64>),
    /// The run has ended.
    Over,
}

impl PlanRun {
    /// A run from the beginning.
    pub fn new(plan: Arc<Plan>, window: ContactWindow) -> Self {
        Self::resume(plan, window, Progress::default())
    }

    /// A run that an earlier life began (or the pass before, with [`Progress::for_next_pass`]).
    pub fn resume(plan: Arc<Plan>, window: ContactWindow, progress: Progress) -> Self {
        Self {
            plan,
            window,
            progress,
            revision: 0,
            wished: BTreeSet::new(),
            seen: None,
            wakeup: Some(MonoUs(0)),
        }
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The pass, as the last view had it.
    pub fn window(&self) -> ContactWindow {
        self.window
    }

    /// How far it has come.
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Rises when there is something new in [`Self::progress`] that must be stored.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// How it ended; `None`: it goes on.
    pub fn end(&self) -> Option<&RunEnd> {
        self.progress.end.as_ref()
    }

    /// When to look again if nothing happens before; `None` when it has ended.
    pub fn next_wakeup(&self) -> Option<MonoUs> {
        self.wakeup
    }

    /// The current step, e.g. `steps[3].steps[0]`; empty before the first and after the last.
    pub fn current_step(&self) -> String {
        place(&self.progress.cursor)
    }

    /// The parameters that its conditions look at.
    pub fn parameters(&self) -> BTreeSet<String> {
        let mut names = BTreeSet::new();
        parameters(&self.plan.steps, &mut names);
        names
    }

    /// Looks at the world, and says what is to be done. Nothing is wished before AOS; at and after LOS the run ends.
    pub fn advance(&mut self, view: &RunView<'_>) -> Vec<Wish> {
        let mut wishes = Vec::new();
        if self.progress.end.is_some() {
            self.wakeup = None;
            return wishes;
        }
        self.window = view.window;
        if view.now.utc < view.window.aos && view.now.utc < view.window.los {
            let left = us_between(view.now.utc, view.window.aos);
            self.wakeup = Some(view.now.mono.plus(left));
            return wishes;
        }
        self.count_time(view.now);
        self.take_note_of_asks(view);
        if view.now.utc >= view.window.los {
            self.lose_signal(view, &mut wishes);
        } else {
            self.go_on(view, &mut wishes);
        }
        wishes
    }

    /// Ends it now: withdraws what was asked for and not radiated.
    pub fn stop(&mut self, view: &RunView<'_>, why: &str) -> Vec<Wish> {
        let mut wishes = Vec::new();
        if self.progress.end.is_none() {
            self.count_time(view.now);
            self.take_note_of_asks(view);
            self.finish(view, RunEnd::Stopped(why.to_owned()), why, &mut wishes);
        }
        wishes
    }

    fn go_on(&mut self, view: &RunView<'_>, wishes: &mut Vec<Wish>) {
        if self.progress.started_at.is_none() {
            self.progress.started_at = Some(view.now.utc);
            self.touch();
            if self.progress.cursor.is_empty() {
                self.progress.cursor.push(Frame::default());
            }
            wishes.push(note(Level::Normal, format!("plan {} begins", self.plan.name)));
        }
        let mut look_after_us = Some(0);
        for _ in 0..STEPS_A_CALL {
            if let Some(limit_us) = self.plan.limit_us
                && self.progress.ran_us >= limit_us
            {
                let why = format!("the time limit of the plan, {} s, is over", seconds(limit_us));
                return self.finish(view, RunEnd::OutOfTime, &why, wishes);
            }
            match self.look(view, wishes) {
                Move::On => self.touch(),
                Move::Wait(after_us) => {
                    look_after_us = after_us;
                    break;
                }
                Move::Over => return,
            }
        }
        let ends = [self.plan.limit_us.map(|limit_us| limit_us.saturating_sub(self.progress.ran_us))];
        let los = us_between(view.now.utc, view.window.los);
        let after = ends.into_iter().flatten().chain(look_after_us).fold(los, u64::min);
        self.wakeup = Some(view.now.mono.plus(after));
    }

    /// One look at the current step.
    fn look(&mut self, view: &RunView<'_>, wishes: &mut Vec<Wish>) -> Move {
        let plan = Arc::clone(&self.plan);
        let Some(depth) = self.progress.cursor.len().checked_sub(1) else {
            return self.over_with(view, RunEnd::Completed { failures: self.failures() }, wishes);
        };
        let Some(step) = step_at(&plan.steps, &self.progress.cursor) else {
            // Past the end of a list: of the plan's, or of a round.
            return self.end_of_list(view, depth, wishes);
        };
        let ran_us = self.progress.ran_us;
        let frame = &mut self.progress.cursor[depth];
        if frame.entered_us.is_none() {
            frame.entered_us = Some(ran_us);
            self.revision += 1;
        }
        if let Some((level, limit_us)) = self.limit_that_is_over(&plan) {
            // Answered in the last moment is answered.
            if self.settle(view) {
                return Move::On;
            }
            return self.out_of_time(view, level, limit_us, wishes);
        }
        let moved = match &step.action {
            Action::Repeat { steps, at_most, .. } => self.enter(view, step, steps, *at_most, wishes),
            Action::Listen { for_us } => self.time_passes(view, step, *for_us, None, wishes),
            Action::WaitFor { until, timeout_us } => {
                self.time_passes(view, step, *timeout_us, Some(until), wishes)
            }
            Action::Send(send) => self.send(view, step, send, wishes),
            Action::DownloadImage => self.download(view, step, wishes),
        };
        match moved {
            Move::Wait(after_us) => Move::Wait(self.until_a_limit(&plan).into_iter().chain(after_us).min()),
            other => other,
        }
    }

    fn touch(&mut self) {
        self.revision += 1;
    }

    fn count_time(&mut self, now: Now) {
        let passed = match (self.seen, self.progress.at) {
            (Some(seen), _) => now.mono.since(seen.mono),
            (None, Some(at)) => us_between(at, now.utc),
            (None, None) => 0,
        };
        if self.progress.started_at.is_some() {
            self.progress.ran_us = self.progress.ran_us.saturating_add(passed);
        }
        self.progress.at = Some(now.utc);
        self.seen = Some(now);
    }

    fn take_note_of_asks(&mut self, view: &RunView<'_>) {
        for (ordinal, state) in view.asked {
            let Some(ticket) = state.ticket() else { continue };
            let stage = match state {
                AskState::Command(_, stage) => Some(*stage),
                _ => None,
            };
            let ask = Ask { ticket, stage };
            if self.progress.asked.insert(*ordinal, ask) != Some(ask) {
                self.touch();
            }
        }
    }
}

fn parameters(steps: &[Step], names: &mut BTreeSet<String>) {
    let mut of = |condition: &Condition| {
        names.extend(condition.telemetry.iter().map(|guard| guard.parameter.clone()));
    };
    for step in steps {
        of(&step.when);
        match &step.action {
            Action::WaitFor { until, .. } | Action::Repeat { until: Some(until), .. } => of(until),
            _ => {}
        }
    }
    for step in steps {
        if let Action::Repeat { steps, .. } = &step.action {
            parameters(steps, names);
        }
    }
}

fn note(level: Level, text: String) -> Wish {
    Wish::Note { level, text }
}
