//! The machine that goes through a plan: views in, wishes out.
//!
//! It has no clock and no hands. The engine calls [`PlanRun::advance`] after whatever changed the view, and at
//! [`PlanRun::next_wakeup`]; it stores [`PlanRun::progress`] when [`PlanRun::revision`] has moved, not later than what
//! the wishes caused; and it carries each ask out once under its [`Ordinal`], for ever. Then a life that ended at any
//! point is gone on with by [`PlanRun::resume`], and nothing is asked for that was accepted.

use std::collections::BTreeSet;
use std::sync::Arc;

use protocol::{Answer, Telecommand};

use super::condition::{Condition, Holds, seconds, us_between};
use super::progress::{Ask, Frame, Progress, RunEnd, StepEnd, StepResult};
use super::step::{Action, AtLos, OnFailure, Ordinal, Plan, Send, Step, ordinals};
use super::view::{AskState, ContactWindow, DownloadView, RunView, Wish};
use crate::clock::{MonoUs, Now, UtcUs};
use crate::level::Level;
use crate::stage::Stage;

/// So many results are kept; a plan that passed the checker has no more.
const RESULTS_MAX: usize = 4096;
/// So many steps end in one call at most; what is more follows in the next one.
const STEPS_A_CALL: usize = 1024;
/// A clock setting that waits longer than this would set an old time.
const STAMP_FRESH_US: i64 = 15_000_000;

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

/// What a look at one ask says.
enum Asked {
    Done,
    Failed(String),
    Pending,
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

    /// The conditions of the current step: `Some` is what must be done instead of beginning it.
    fn not_before(&mut self, view: &RunView<'_>, when: &Condition, wishes: &mut Vec<Wish>) -> Option<Move> {
        match when.holds(view) {
            Holds::Yes => None,
            Holds::NotYet { look_after_us, .. } => Some(Move::Wait(look_after_us)),
            Holds::Never(why) => Some(self.fail(view, self.deepest(), why, wishes)),
        }
    }

    /// Marks the current step as begun once its conditions hold.
    fn begin(&mut self, view: &RunView<'_>, step: &Step, wishes: &mut Vec<Wish>) -> Result<u64, Move> {
        let depth = self.deepest();
        if let Some(begun_us) = self.progress.cursor[depth].begun_us {
            return Ok(begun_us);
        }
        if let Some(instead) = self.not_before(view, &step.when, wishes) {
            return Err(instead);
        }
        self.progress.cursor[depth].begun_us = Some(self.progress.ran_us);
        self.revision += 1;
        Ok(self.progress.ran_us)
    }

    fn enter(
        &mut self,
        view: &RunView<'_>,
        step: &Step,
        steps: &[Step],
        at_most: u32,
        wishes: &mut Vec<Wish>,
    ) -> Move {
        if let Err(instead) = self.begin(view, step, wishes) {
            return instead;
        }
        if steps.is_empty() || at_most == 0 {
            return self.done(view, self.deepest(), StepEnd::Done);
        }
        self.progress.cursor.push(Frame::default());
        Move::On
    }

    /// Listening, and waiting for something.
    fn time_passes(
        &mut self,
        view: &RunView<'_>,
        step: &Step,
        length_us: u64,
        until: Option<&Condition>,
        wishes: &mut Vec<Wish>,
    ) -> Move {
        let begun_us = match self.begin(view, step, wishes) {
            Ok(begun_us) => begun_us,
            Err(instead) => return instead,
        };
        let left_us = begun_us.saturating_add(length_us).saturating_sub(self.progress.ran_us);
        match until.map(|until| until.holds(view)) {
            Some(Holds::Yes) => self.done(view, self.deepest(), StepEnd::Done),
            Some(Holds::Never(why)) => self.fail(view, self.deepest(), why, wishes),
            Some(Holds::NotYet { why, .. }) if left_us == 0 => {
                let why = format!("{} s were not enough: {why}", seconds(length_us));
                self.fail(view, self.deepest(), why, wishes)
            }
            Some(Holds::NotYet { look_after_us, .. }) => {
                Move::Wait(Some(look_after_us.map_or(left_us, |look| look.min(left_us))))
            }
            None if left_us == 0 => self.done(view, self.deepest(), StepEnd::Done),
            None => Move::Wait(Some(left_us)),
        }
    }

    fn send(&mut self, view: &RunView<'_>, step: &Step, send: &Send, wishes: &mut Vec<Wish>) -> Move {
        let depth = self.deepest();
        let part = self.progress.cursor[depth].part;
        let Some(telecommand) = send.telecommands.get(part as usize) else {
            return self.done(view, depth, StepEnd::Done);
        };
        let ordinal = self.ordinal();
        match self.asked(view, ordinal, Some(telecommand)) {
            Some(Asked::Done) => {
                self.progress.cursor[depth].part = part.saturating_add(1);
                Move::On
            }
            Some(Asked::Failed(why)) => self.fail(view, depth, why, wishes),
            Some(Asked::Pending) => Move::Wait(None),
            None if view.held => Move::Wait(None),
            None => {
                if let Err(instead) = self.begin(view, step, wishes) {
                    return instead;
                }
                if let Some(instead) = self.not_before(view, &step.when, wishes) {
                    return instead;
                }
                if let Err(why) = self.may_send(view, send, telecommand) {
                    return self.fail(view, depth, why, wishes);
                }
                let wish = self.command(view, ordinal, send, telecommand);
                self.wish(ordinal, wish, wishes);
                Move::Wait(None)
            }
        }
    }

    fn download(&mut self, view: &RunView<'_>, step: &Step, wishes: &mut Vec<Wish>) -> Move {
        let depth = self.deepest();
        let ordinal = self.ordinal();
        match self.asked(view, ordinal, None) {
            Some(Asked::Done) => self.done(view, depth, StepEnd::Done),
            Some(Asked::Failed(why)) => self.fail(view, depth, why, wishes),
            Some(Asked::Pending) => Move::Wait(None),
            None if view.held => Move::Wait(None),
            None => {
                if let Err(instead) = self.begin(view, step, wishes) {
                    return instead;
                }
                if let Some(instead) = self.not_before(view, &step.when, wishes) {
                    return instead;
                }
                if !self.plan.transmit {
                    return self.fail(view, depth, NO_TRANSMIT.to_owned(), wishes);
                }
                let wish = Wish::Download { ordinal, step: self.current_step() };
                self.wish(ordinal, wish, wishes);
                Move::Wait(None)
            }
        }
    }

    fn wish(&mut self, ordinal: Ordinal, wish: Wish, wishes: &mut Vec<Wish>) {
        self.wished.insert(ordinal);
        self.revision += 1;
        wishes.push(wish);
    }

    fn command(&self, view: &RunView<'_>, ordinal: Ordinal, send: &Send, telecommand: &Telecommand) -> Wish {
        let utc = view.now.utc;
        let mut expires_at = view.window.los;
        if let Some(left_us) = self.until_a_limit(&self.plan) {
            expires_at = expires_at.min(utc.plus(i64::try_from(left_us).unwrap_or(i64::MAX)));
        }
        if let Some(limit_us) = self.plan.limit_us {
            let left_us = limit_us.saturating_sub(self.progress.ran_us);
            expires_at = expires_at.min(utc.plus(i64::try_from(left_us).unwrap_or(i64::MAX)));
        }
        let mut attempts = send.attempts;
        let mut telecommand = telecommand.clone();
        if let Telecommand::SetTimestamp { utc_ms } = &mut telecommand
            && *utc_ms == 0
        {
            *utc_ms = u64::try_from(utc.0 / 1000).unwrap_or(0);
            // Repeated later it would set the clock back.
            attempts = Some(1);
            expires_at = expires_at.min(utc.plus(STAMP_FRESH_US));
        }
        let critical = telecommand.is_critical();
        Wish::Command {
            ordinal,
            step: self.current_step(),
            telecommand,
            priority: send.priority.unwrap_or(self.plan.priority),
            attempts,
            gate: send.gate,
            expires_at,
            approved_by: send.approval.as_ref().filter(|_| critical).map(|approval| approval.by.clone()),
        }
    }

    /// What the checker said already, once more before it matters.
    fn may_send(&self, view: &RunView<'_>, send: &Send, telecommand: &Telecommand) -> Result<(), String> {
        if !self.plan.transmit {
            return Err(NO_TRANSMIT.to_owned());
        }
        if telecommand.is_critical() {
            let Some(approval) = &send.approval else {
                return Err(format!("{} is critical, and nobody approved it", telecommand.name()));
            };
            approval.allows(&send.telecommands, Some(view.now.utc))?;
        }
        match first_past_entry(telecommand, view.now.utc) {
            Some(entry) => Err(format!("entry {entry} of the schedule lies in the past")),
            None => Ok(()),
        }
    }

    /// What became of an ask; `None` when it is to be asked for.
    fn asked(
        &self,
        view: &RunView<'_>,
        ordinal: Ordinal,
        telecommand: Option<&Telecommand>,
    ) -> Option<Asked> {
        Some(match (view.asked.get(&ordinal), self.progress.asked.get(&ordinal)) {
            (Some(AskState::Refused(why)), _) => Asked::Failed(format!("it was refused: {why}")),
            (Some(AskState::Download(_, state)), _) => match state {
                DownloadView::Active => Asked::Pending,
                DownloadView::Complete => Asked::Done,
                DownloadView::Ended => Asked::Failed("the download ended without a whole image".to_owned()),
            },
            (Some(AskState::Command(id, stage)), _) => {
                let provable = telecommand.is_some_and(|command| command.answer() != Answer::None);
                command_stage(*id, *stage, provable)
            }
            (None, Some(Ask { ticket: super::Ticket::Command(id), stage: Some(stage) })) => {
                let provable = telecommand.is_some_and(|command| command.answer() != Answer::None);
                command_stage(*id, *stage, provable)
            }
            (None, Some(_)) => Asked::Pending,
            (None, None) if self.wished.contains(&ordinal) => Asked::Pending,
            (None, None) => return None,
        })
    }

    /// The current ask, if there is one and it can still be withdrawn.
    fn open_ask(&self, view: &RunView<'_>) -> Option<Ordinal> {
        let step = step_at(&self.plan.steps, &self.progress.cursor)?;
        if !step.action.transmits() {
            return None;
        }
        let ordinal = self.ordinal();
        let telecommand = match &step.action {
            Action::Send(send) => send.telecommands.get(self.progress.cursor.last()?.part as usize),
            _ => None,
        };
        matches!(self.asked(view, ordinal, telecommand)?, Asked::Pending).then_some(ordinal)
    }

    fn withdraw(&self, view: &RunView<'_>, why: &str, wishes: &mut Vec<Wish>) {
        if let Some(ordinal) = self.open_ask(view) {
            wishes.push(Wish::Cancel { ordinal, why: why.to_owned() });
        }
    }

    // Where a step ends.

    /// The step at this depth ended; what follows it is next.
    fn done(&mut self, view: &RunView<'_>, depth: usize, end: StepEnd) -> Move {
        self.record(view, depth, end);
        self.progress.cursor.truncate(depth + 1);
        let frame = &mut self.progress.cursor[depth];
        *frame = Frame { index: frame.index.saturating_add(1), ..Frame::default() };
        Move::On
    }

    fn fail(&mut self, view: &RunView<'_>, depth: usize, why: String, wishes: &mut Vec<Wish>) -> Move {
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
    fn end_of_list(&mut self, view: &RunView<'_>, depth: usize, wishes: &mut Vec<Wish>) -> Move {
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
                self.fail(view, outer, format!("{rounds} rounds were not enough: {why}"), wishes)
            }
            _ => {
                self.progress.cursor.truncate(depth);
                self.progress.cursor[outer].round = rounds;
                self.progress.cursor.push(Frame::default());
                Move::On
            }
        }
    }

    fn out_of_time(
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

    // Where a run ends.

    fn lose_signal(&mut self, view: &RunView<'_>, wishes: &mut Vec<Wish>) {
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

    /// Ends the current step if what it asked for is done by now.
    fn settle(&mut self, view: &RunView<'_>) {
        let plan = Arc::clone(&self.plan);
        let Some(step) = step_at(&plan.steps, &self.progress.cursor) else { return };
        let depth = self.deepest();
        let part = self.progress.cursor[depth].part;
        let (telecommand, last) = match &step.action {
            Action::Send(send) => {
                (send.telecommands.get(part as usize), part as usize + 1 >= send.telecommands.len())
            }
            Action::DownloadImage => (None, true),
            _ => return,
        };
        if matches!(self.asked(view, self.ordinal(), telecommand), Some(Asked::Done)) {
            if last {
                self.done(view, depth, StepEnd::Done);
            } else {
                self.progress.cursor[depth].part = part.saturating_add(1);
            }
        }
    }

    /// The current telecommand must not be asked for again, and may have been obeyed already.
    fn is_spent(&self, view: &RunView<'_>) -> bool {
        let Some(Action::Send(send)) =
            step_at(&self.plan.steps, &self.progress.cursor).map(|step| &step.action)
        else {
            return false;
        };
        let part = self.progress.cursor.last().map_or(0, |frame| frame.part);
        let ordinal = self.ordinal();
        let stage = match (view.asked.get(&ordinal), self.progress.asked.get(&ordinal)) {
            (Some(AskState::Command(_, stage)), _) | (None, Some(Ask { stage: Some(stage), .. })) => *stage,
            (None, Some(_)) => Stage::Unknown,
            (None, None) if self.wished.contains(&ordinal) => Stage::Unknown,
            _ => return false,
        };
        let never_left = matches!(
            stage,
            Stage::Queued | Stage::Expired | Stage::Cancelled | Stage::Failed | Stage::Rejected
        );
        let repeatable = send.telecommands.get(part as usize).is_none_or(Telecommand::is_idempotent);
        !never_left && !repeatable
    }

    /// Behind the current telecommand.
    fn pass_by(&mut self) {
        if let Some(frame) = self.progress.cursor.last_mut() {
            frame.part = frame.part.saturating_add(1);
        }
    }

    fn over_with(&mut self, view: &RunView<'_>, end: RunEnd, wishes: &mut Vec<Wish>) -> Move {
        self.finish(view, end, "the run has ended", wishes);
        Move::Over
    }

    fn finish(&mut self, view: &RunView<'_>, end: RunEnd, why: &str, wishes: &mut Vec<Wish>) {
        if !matches!(end, RunEnd::Completed { .. } | RunEnd::Aborted { .. }) {
            self.withdraw(view, why, wishes);
            for depth in (0..self.progress.cursor.len()).rev() {
                if step_at(&self.plan.steps, &self.progress.cursor[..=depth]).is_some() {
                    self.record(view, depth, StepEnd::Unfinished(why.to_owned()));
                }
            }
        }
        let level = match &end {
            RunEnd::Completed { failures: 0 } | RunEnd::Later => Level::Normal,
            RunEnd::Completed { .. } | RunEnd::Unfinished | RunEnd::Stopped(_) => Level::Watch,
            RunEnd::Aborted { .. } | RunEnd::OutOfTime => Level::Warning,
        };
        wishes.push(note(level, format!("plan {} ends: {}", self.plan.name, end.name())));
        wishes.push(Wish::Done(end.clone()));
        self.progress.end = Some(end);
        self.touch();
        self.wakeup = None;
    }

    // Book-keeping.

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

    fn record(&mut self, view: &RunView<'_>, depth: usize, end: StepEnd) {
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

    fn failures(&self) -> u32 {
        let failed =
            self.progress.results.iter().filter(|result| matches!(result.end, StepEnd::Failed(_))).count();
        u32::try_from(failed).unwrap_or(u32::MAX)
    }

    fn touch(&mut self) {
        self.revision += 1;
    }

    fn deepest(&self) -> usize {
        self.progress.cursor.len().saturating_sub(1)
    }

    /// The outermost limit that is over: its depth, and how long it was.
    fn limit_that_is_over(&self, plan: &Plan) -> Option<(usize, u64)> {
        self.limits(plan).find(|&(_, _, left_us)| left_us == 0).map(|(depth, limit_us, _)| (depth, limit_us))
    }

    fn until_a_limit(&self, plan: &Plan) -> Option<u64> {
        self.limits(plan).map(|(_, _, left_us)| left_us).min()
    }

    /// Depth, limit and what is left of it, of the current step and those around it.
    fn limits<'a>(&'a self, plan: &'a Plan) -> impl Iterator<Item = (usize, u64, u64)> + 'a {
        (0..self.progress.cursor.len()).filter_map(move |depth| {
            let cursor = &self.progress.cursor[..=depth];
            let limit_us = step_at(&plan.steps, cursor)?.limit_us?;
            let entered_us = cursor[depth].entered_us?;
            let left_us = entered_us.saturating_add(limit_us).saturating_sub(self.progress.ran_us);
            Some((depth, limit_us, left_us))
        })
    }

    /// The number of the current ask.
    fn ordinal(&self) -> Ordinal {
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

const NO_TRANSMIT: &str = "the plan says transmit = false";

fn command_stage(id: crate::CommandId, stage: Stage, provable: bool) -> Asked {
    match stage {
        Stage::Answered => Asked::Done,
        Stage::Unknown if !provable => Asked::Done,
        Stage::Queued | Stage::Sealed | Stage::Radiating | Stage::Radiated => Asked::Pending,
        stage => Asked::Failed(format!("command {id} is {stage}")),
    }
}

/// The step at this place; `None` behind the end of its list.
fn step_at<'a>(steps: &'a [Step], cursor: &[Frame]) -> Option<&'a Step> {
    let (first, rest) = cursor.split_first()?;
    let step = steps.get(first.index as usize)?;
    match (&step.action, rest.is_empty()) {
        (_, true) => Some(step),
        (Action::Repeat { steps, .. }, false) => step_at(steps, rest),
        (_, false) => None,
    }
}

fn place(cursor: &[Frame]) -> String {
    let steps: Vec<String> = cursor.iter().map(|frame| format!("steps[{}]", frame.index)).collect();
    steps.join(".")
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

/// The first entry of a schedule that is not ahead of `now`, from 0.
pub(super) fn first_past_entry(telecommand: &Telecommand, now: UtcUs) -> Option<usize> {
    let is_past = |ms: u64| i64::try_from(ms).is_ok_and(|ms| ms.saturating_mul(1000) <= now.0);
    match telecommand {
        Telecommand::SetDownlinkSchedule(schedule) => {
            schedule.slots.iter().position(|slot| is_past(slot.time_ms))
        }
        Telecommand::UploadSchedule(upload) => upload.entries.iter().position(|entry| is_past(entry.time_ms)),
        _ => None,
    }
}

fn note(level: Level, text: String) -> Wish {
    Wish::Note { level, text }
}
