//! What waits for a second person: exactly what it is, and yes or no by whoever may.

use api::client::IdempotencyKey;
use api::{ApprovalView, ApproveRequest, Outcome, RefuseRequest};
use egui::{RichText, ScrollArea, TextEdit, Ui};
use ui::Theme;
use ui::hold::{Hold, hold_button};

use super::super::{Scene, may};
use super::draft::why;
use crate::link::Pending;

/// What this part keeps between frames.
#[derive(Default)]
pub(super) struct State {
    hold: (u64, Hold),
    reason: String,
    approving: Option<(u64, Pending<Outcome>)>,
    refusing: Option<(u64, Pending<ApprovalView>)>,
    told: String,
}

/// How many wait.
pub(super) fn open(scene: &Scene<'_>) -> usize {
    waiting(scene).count()
}

fn waiting<'a>(scene: &'a Scene<'_>) -> impl Iterator<Item = &'a ApprovalView> {
    let all = scene.model.approvals.value().map_or(&[][..], |page| &page.items);
    all.iter().filter(|approval| approval.state == "awaiting")
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State) {
    answers(state);
    let theme = Theme::current(ui);
    let two = if scene.needs_two() {
        "A second person approves what is critical."
    } else {
        "One person is enough here."
    };
    ui.label(RichText::new(two).color(theme.dim));
    if !state.told.is_empty() {
        ui.add(egui::Label::new(&state.told).wrap());
    }
    let approvals: Vec<ApprovalView> = waiting(scene).take(50).cloned().collect();
    if approvals.is_empty() {
        ui.label(RichText::new("Nothing waits.").color(theme.dim));
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for approval in &approvals {
            ui.push_id(approval.id, |ui| one(ui, scene, state, approval));
        }
    });
}

fn one(ui: &mut Ui, scene: &Scene<'_>, state: &mut State, approval: &ApprovalView) {
    let theme = Theme::current(ui);
    let me = scene.model.session.value().and_then(|session| session.name.clone());
    let is_mine = me.is_some_and(|me| me == approval.person || me == approval.principal);
    egui::Frame::new().fill(theme.raised).inner_margin(8).corner_radius(4).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.strong(format!("{}: {}", approval.id, approval.summary));
        ui.label(
            RichText::new(format!(
                "asked by {} at {}, until {}",
                approval.principal, approval.asked_at, approval.expires_at
            ))
            .color(theme.dim),
        );
        ui.collapsing("Exactly this", |ui| {
            let text = serde_json::to_string_pretty(&approval.request).unwrap_or_default();
            ui.add(egui::Label::new(RichText::new(text).monospace().small()).wrap());
        });
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("digest").color(theme.dim));
            ui.label(RichText::new(&approval.digest).monospace().small());
        });
        let mut can = scene.may("approve");
        if is_mine {
            can = can.and(Err("who asks cannot approve: somebody else has to".to_owned()));
        }
        if state.hold.0 != approval.id && ui.rect_contains_pointer(ui.max_rect()) {
            state.hold = (approval.id, Hold::default());
        }
        ui.horizontal_wrapped(|ui| {
            let mut other = Hold::default();
            let hold = if state.hold.0 == approval.id { &mut state.hold.1 } else { &mut other };
            let name = format!("Approve {}", approval.id);
            let fired =
                ui.add_enabled_ui(can.is_ok(), |ui| hold_button(ui, hold, &name, theme.critical)).inner;
            if other != Hold::default() {
                state.hold = (approval.id, other);
            }
            if fired && can.is_ok() {
                let (id, digest) = (approval.id, approval.digest.clone());
                let asked = scene.courier.ask(move |client| async move {
                    client.approve(id, &ApproveRequest { digest }, &IdempotencyKey::fresh()).await
                });
                state.approving = Some((id, asked));
            }
            let edit = TextEdit::singleline(&mut state.reason).hint_text("why not").desired_width(140.0);
            ui.add(edit).accessible_name(format!("Why not {}", approval.id));
            let no = if is_mine {
                format!("Take back {}", approval.id)
            } else {
                format!("Refuse {}", approval.id)
            };
            if may::button(ui, &no, &scene.may("command")) {
                let reason = std::mem::take(&mut state.reason).trim().to_owned();
                let (id, why) = (approval.id, Some(reason).filter(|reason| !reason.is_empty()));
                let asked = scene.courier.ask(move |client| async move {
                    client.refuse(id, &RefuseRequest { why }, &IdempotencyKey::fresh()).await
                });
                state.refusing = Some((id, asked));
            }
        });
        why(ui, &can);
    });
}

fn answers(state: &mut State) {
    if let Some((id, answer)) = state.approving.as_ref().and_then(|(id, asked)| Some((*id, asked.take()?))) {
        state.approving = None;
        state.told = match answer {
            Ok(Outcome { command: Some(command), .. }) => {
                format!("Approved {id}: command {command} is queued")
            }
            Ok(_) => format!("Approved {id}"),
            Err(error) => format!("{id} is not approved: {error}"),
        };
    }
    if let Some((id, answer)) = state.refusing.as_ref().and_then(|(id, asked)| Some((*id, asked.take()?))) {
        state.refusing = None;
        state.told = match answer {
            Ok(_) => format!("Refused {id}: nothing is sent"),
            Err(error) => format!("{id} is not refused: {error}"),
        };
    }
}
