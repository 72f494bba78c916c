//! One telecommand as a card.

use egui::{Button, Frame, Margin, Response, RichText, Sense, Stroke, Ui, UiBuilder};
use egui_material_icons::icons;
use jiff::Timestamp;

use super::lights::{Lights, stage_lights_ui};
use crate::fonts;
use crate::format;
use crate::theme::{self, Theme};

/// What a card tells.
#[derive(Debug, Clone, Copy)]
pub struct Command<'a> {
    /// Name of the telecommand.
    pub name: &'a str,
    /// Its arguments as one line; empty without any.
    pub arguments: &'a str,
    /// Who wants it.
    pub who: &'a str,
    /// How far it came.
    pub lights: Lights,
    /// The frame that proves the last stage.
    pub proof: Option<u64>,
    /// Why it is where it is, as a sentence; empty where there is nothing to say.
    pub why: &'a str,
    /// Number of the attempt, from 1; 0 before the first.
    pub attempt: u16,
    /// How many attempts are allowed.
    pub attempts_allowed: u16,
    /// When the next attempt is due.
    pub next_at: Option<Timestamp>,
    /// Not radiated after this.
    pub expires_at: Option<Timestamp>,
    /// Whether this operator may withdraw it now.
    pub may_cancel: bool,
    /// Whether this operator may make a new command like it.
    pub may_repeat: bool,
    /// Whether it is the chosen one.
    pub is_selected: bool,
}

/// What was asked for by a click.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CardAction {
    /// Choose this command.
    Select,
    /// Withdraw it.
    Cancel,
    /// Open a draft with the same arguments. Never a sending.
    Repeat,
    /// Show the frame that proves it.
    ShowProof(u64),
}

/// Draws a card as wide as there is room, and tells what was clicked.
pub fn command_card_ui(ui: &mut Ui, command: &Command<'_>, now: Timestamp) -> Option<CardAction> {
    let theme = Theme::current(ui);
    let border = if command.is_selected { theme.accent } else { theme.raised };
    let mut action = None;
    // The card lies below what is on it, so that buttons and links on it get their own clicks.
    let shown = ui.scope_builder(UiBuilder::new().sense(Sense::click()), |ui| {
        Frame::NONE
            .fill(theme.raised)
            .stroke(Stroke::new(1.0, border))
            .corner_radius(theme::space())
            .inner_margin(Margin::symmetric(12, 8))
            .show(ui, |ui| {
                ui.set_width(ui.available_width());
                ui.spacing_mut().item_spacing.y = theme::space();
                title(ui, theme, command, now, &mut action);
                stage_lights_ui(ui, &command.lights);
                story(ui, theme, command, now, &mut action);
            });
        ui.response()
    });
    let card = shown.inner;
    card.widget_info(|| {
        let label = format!("{} {}: {}", command.name, command.arguments, command.lights.word());
        egui::WidgetInfo::selected(egui::Role::Button, true, command.is_selected, label)
    });
    if card.clicked() && action.is_none() {
        action = Some(CardAction::Select);
    }
    action
}

fn title(ui: &mut Ui, theme: &Theme, command: &Command<'_>, now: Timestamp, action: &mut Option<CardAction>) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(command.name).strong().color(theme.text));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if command.may_cancel && small(ui, icons::ICON_CLOSE.codepoint, "Withdraw this command").clicked()
            {
                *action = Some(CardAction::Cancel);
            }
            if command.may_repeat && small(ui, icons::ICON_REPLAY.codepoint, "Draft the same again").clicked()
            {
                *action = Some(CardAction::Repeat);
            }
            if let Some(at) = command.lights.changed_at() {
                let age = RichText::new(format::age(now.duration_since(at)))
                    .font(fonts::figures(theme::sizes().small));
                ui.label(age.color(theme.dim)).on_hover_text(format::utc_ms(at));
                ui.add_space(2.0 * theme::space());
            }
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                let arguments = RichText::new(command.arguments).font(fonts::figures(theme::sizes().small));
                ui.add(egui::Label::new(arguments.color(theme.dim)).truncate());
            });
        });
    });
}

/// Who, which attempt, until when, what proves it, and why.
fn story(ui: &mut Ui, theme: &Theme, command: &Command<'_>, now: Timestamp, action: &mut Option<CardAction>) {
    let small = theme::sizes().small;
    let text = |text: String| RichText::new(text).size(small).color(theme.dim);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0 * theme::space();
        ui.label(text(command.who.to_owned()));
        if command.attempts_allowed > 1 || command.attempt > 1 {
            ui.label(text(format!("attempt {} of {}", command.attempt, command.attempts_allowed)));
        }
        if !command.lights.is_over() {
            if let Some(at) = command.next_at.filter(|&at| at > now) {
                ui.label(text(format!("again in {}", format::age(at.duration_since(now)))));
            }
            if let Some(at) = command.expires_at {
                let left = at.duration_since(now);
                let told = if left.is_negative() {
                    "expired".to_owned()
                } else {
                    format!("expires in {}", format::age(left))
                };
                ui.label(text(told)).on_hover_text(format::utc(at));
            }
        }
        if let Some(frame) = command.proof {
            let link = ui.link(RichText::new(format!("frame {frame}")).size(small).color(theme.accent));
            if link.on_hover_text("Show the frame that proves it").clicked() {
                *action = Some(CardAction::ShowProof(frame));
            }
        }
        if !command.why.is_empty() {
            ui.label(text(command.why.to_owned()));
        }
    });
}

/// A small button with an icon, and its words for those who hover or listen.
fn small(ui: &mut Ui, icon: &str, words: &str) -> Response {
    let theme = Theme::current(ui);
    let icon = RichText::new(icon).size(16.0).color(theme.dim);
    let response = ui.add(Button::new(icon).frame(false));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, words));
    response.on_hover_text(words)
}
