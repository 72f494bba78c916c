//! What became of what the run asked for.

use std::sync::Arc;

use protocol::{Answer, Telecommand};

use super::PlanRun;
use super::place::step_at;
use crate::plan::progress::{Ask, StepEnd, Ticket};
use crate::plan::step::{Action, Ordinal};
use crate::plan::view::{AskState, DownloadView, RunView, Wish};
use crate::stage::Stage;

/// What a look at one ask says.
pub(super) enum Asked {
    Done,
    Failed(String),
    Pending,
}

impl PlanRun {
    /// What became of an ask; `None` when it is to be asked for.
    pub(super) fn asked(
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
            (None, Some(Ask { ticket: Ticket::Command(id), stage: Some(stage) })) => {
                let provable = telecommand.is_some_and(|command| command.answer() != Answer::None);
                command_stage(*id, *stage, provable)
            }
            (None, Some(_)) => Asked::Pending,
            (None, None) if self.wished.contains(&ordinal) => Asked::Pending,
            (None, None) => return None,
        })
    }

    /// The current ask, if there is one and it can still be withdrawn.
    pub(super) fn open_ask(&self, view: &RunView<'_>) -> Option<Ordinal> {
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

    pub(super) fn withdraw(&self, view: &RunView<'_>, why: &str, wishes: &mut Vec<Wish>) {
        if let Some(ordinal) = self.open_ask(view) {
            wishes.push(Wish::Cancel { ordinal, why: why.to_owned() });
        }
    }

    /// Ends the current step if what it asked for is done by now.
    pub(super) fn settle(&mut self, view: &RunView<'_>) -> bool {
        let plan = Arc::clone(&self.plan);
        let Some(step) = step_at(&plan.steps, &self.progress.cursor) else { return false };
        let depth = self.deepest();
        let part = self.progress.cursor[depth].part;
        let (telecommand, last) = match &step.action {
            Action::Send(send) => {
                (send.telecommands.get(part as usize), part as usize + 1 >= send.telecommands.len())
            }
            Action::DownloadImage => (None, true),
            _ => return false,
        };
        if !matches!(self.asked(view, self.ordinal(), telecommand), Some(Asked::Done)) {
            return false;
        }
        if last {
            self.done(view, depth, StepEnd::Done);
        } else {
            self.progress.cursor[depth].part = part.saturating_add(1);
        }
        true
    }

    /// The current telecommand must not be asked for again, and may have been obeyed already.
    pub(super) fn is_spent(&self, view: &RunView<'_>) -> bool {
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
    pub(super) fn pass_by(&mut self) {
        if let Some(frame) = self.progress.cursor.last_mut() {
            frame.part = frame.part.saturating_add(1);
        }
    }
}

fn command_stage(id: crate::CommandId, stage: Stage, provable: bool) -> Asked {
    match stage {
        Stage::Answered => Asked::Done,
        Stage::Unknown if !provable => Asked::Done,
        Stage::Queued | Stage::Sealed | Stage::Radiating | Stage::Radiated => Asked::Pending,
        Stage::Unknown => Asked::Failed(format!(
            "command {id} was radiated and not answered: nobody knows whether it was obeyed"
        )),
        stage => Asked::Failed(format!("command {id} is {stage}")),
    }
}
