//! Commands on their way and those that were: each with its stages as they happen, and what may be done with it.

use std::collections::BTreeMap;

use api::client::Client;
use api::{CommandView, StageView, Time};
use egui::{RichText, ScrollArea, Sense, TextEdit, Ui, vec2};
use ui::{Theme, format};

use super::super::{Pane, Scene, may};
use super::draft::why;
use super::one_line;
use super::send::Sender;
use crate::desk::Draft;
use crate::link::Pending;

/// Commands whose stages are kept.
const DETAILS_MAX: usize = 64;
/// Cards below the sender.
const NEWEST: usize = 4;
/// Height of a row of the list.
const ROW: f32 = 40.0;
/// What a command goes through when all goes well.
const STAGES: [&str; 4] = ["queued", "sealed", "radiated", "answered"];

/// What this part keeps between frames.
#[derive(Default)]
pub(super) struct State {
    find: String,
    selected: Option<u64>,
    /// Commands with all their stages, as they were asked for.
    details: BTreeMap<u64, CommandView>,
    asking: Option<(u64, Pending<CommandView>)>,
    draft: Option<Draft>,
}

impl State {
    /// A draft that is to be opened.
    pub(super) fn take_draft(&mut self) -> Option<Draft> {
        self.draft.take()
    }

    /// The command with its stages, asked for when it changed.
    fn detail(&mut self, scene: &Scene<'_>, command: &CommandView) -> Option<&CommandView> {
        if let Some((id, pending)) = &self.asking
            && let Some(answer) = pending.take()
        {
            let id = *id;
            self.asking = None;
            if let Ok(view) = answer {
                self.details.insert(id, view);
                while self.details.len() > DETAILS_MAX {
                    self.details.pop_first();
                }
            }
        }
        let held = self.details.get(&command.id);
        let is_fresh =
            held.is_some_and(|held| held.stage_at >= command.stage_at && held.stage == command.stage);
        if !is_fresh && self.asking.is_none() && scene.model.connection.is_live() {
            let id = command.id;
            let asked = scene.courier.ask(move |client: Client| async move { client.command(id).await });
            self.asking = Some((id, asked));
        }
        self.details.get(&command.id)
    }
}

/// Whether it is on its way still.
fn is_open(command: &CommandView) -> bool {
    matches!(command.stage.as_str(), "queued" | "sealed" | "radiating" | "radiated")
}

/// How many are on their way.
pub(super) fn waiting(scene: &Scene<'_>) -> usize {
    scene.model.all_commands().filter(|command| is_open(command)).count()
}

/// The newest, below the sender.
pub(super) fn newest(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State, sender: &mut Sender) {
    let commands: Vec<CommandView> = scene.model.all_commands().take(NEWEST).cloned().collect();
    for command in &commands {
        ui.push_id(command.id, |ui| card(ui, scene, state, sender, command));
    }
}

/// All of them.
pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State, sender: &mut Sender) {
    let find = TextEdit::singleline(&mut state.find).hint_text("find: name, number, stage, who, argument");
    ui.add(find.desired_width(f32::INFINITY)).accessible_name("Find in commands");
    let wanted = state.find.to_lowercase();
    let has = |command: &&CommandView| {
        let text = || {
            let arguments = one_line(&command.arguments);
            format!("{} {} {} {} {arguments}", command.id, command.command, command.stage, command.principal)
        };
        wanted.is_empty() || wanted.split_whitespace().all(|word| text().to_lowercase().contains(word))
    };
    let mut found: Vec<&CommandView> = scene.model.all_commands().filter(has).collect();
    // What waits stands first, in the order in which it leaves
    found.sort_by_key(|command| {
        let open = is_open(command);
        (!open, if open { -i32::from(command.priority) } else { 0 }, if open { command.id } else { 0 })
    });
    let chosen = state.selected.and_then(|id| found.iter().find(|command| command.id == id));
    let chosen: Option<CommandView> = chosen.map(|command| (*command).clone());
    if let Some(command) = &chosen {
        ScrollArea::vertical().id_salt("chosen").max_height(ui.available_height() * 0.5).show(ui, |ui| {
            card(ui, scene, state, sender, command);
            detail(ui, scene, state, command);
        });
        ui.separator();
    }
    let mut selected = state.selected;
    ScrollArea::vertical().id_salt("all").auto_shrink(false).show_rows(ui, ROW, found.len(), |ui, rows| {
        for command in found.get(rows).unwrap_or_default() {
            if row(ui, command, selected == Some(command.id)) {
                selected = if selected == Some(command.id) { None } else { Some(command.id) };
            }
        }
    });
    state.selected = selected;
}

fn row(ui: &mut Ui, command: &CommandView, is_selected: bool) -> bool {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let told = format!("Command {} {}: {}", command.id, command.command, command.stage);
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::ListItem, true, is_selected, &told));
    if is_selected || response.hovered() || response.has_focus() {
        ui.painter().rect_filled(rect, 4.0, if is_selected { theme.selection } else { theme.raised });
    }
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(rect.shrink2(vec2(6.0, 2.0))));
    child.horizontal(|ui| {
        ui.monospace(format!("{:>5}", command.id));
        ui.label(RichText::new(&command.command).color(theme.text));
        ui.add(
            egui::Label::new(RichText::new(one_line(&command.arguments)).small().color(theme.dim)).truncate(),
        );
    });
    child.horizontal(|ui| {
        let colour = stage_colour(theme, &command.stage);
        ui.label(RichText::new(&command.stage).small().color(colour));
        let priority =
            if command.priority == 0 { String::new() } else { format!(", priority {}", command.priority) };
        let words = format!("{} by {}{priority}", command.stage_at, command.principal);
        ui.add(egui::Label::new(RichText::new(words).small().color(theme.dim)).truncate());
    });
    response.clicked()
}

fn stage_colour(theme: &Theme, stage: &str) -> egui::Color32 {
    match stage {
        "unknown" => theme.distress,
        "failed" | "rejected" => theme.critical,
        "expired" | "cancelled" => theme.dim,
        _ => theme.text,
    }
}

/// One command: name, lights, why, and what may be done.
fn card(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State, sender: &mut Sender, command: &CommandView) {
    let theme = Theme::current(ui);
    let stages: Vec<StageView> =
        state.detail(scene, command).and_then(|view| view.stages.clone()).unwrap_or_default();
    let last = stages.iter().rfind(|stage| stage.stage == command.stage);
    egui::Frame::new().fill(theme.raised).inner_margin(8).corner_radius(4).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal_wrapped(|ui| {
            ui.strong(format!("{} {}", command.id, command.command));
            ui.label(RichText::new(one_line(&command.arguments)).small().color(theme.dim));
            let at = jiff::Timestamp::from_microsecond(command.stage_at.unix_us()).unwrap_or_default();
            let age = format::age(scene.timestamp().duration_since(at));
            ui.label(RichText::new(age).small().monospace().color(theme.dim))
                .on_hover_text(command.stage_at.to_string());
        });
        lights(ui, command, &stages);
        let mut story = vec![format!("by {}", command.principal)];
        if command.attempts_allowed > 1 || command.attempt > 1 {
            story.push(format!("attempt {} of {}", command.attempt, command.attempts_allowed));
        }
        if let (Some(at), true) = (command.expires_at, is_open(command)) {
            story.push(format!("given up at {at}"));
        }
        if let Some(why) = last.map(|stage| stage.why.as_str()).filter(|why| !why.is_empty()) {
            story.push(why.to_owned());
        }
        ui.add(egui::Label::new(RichText::new(story.join(" · ")).small().color(theme.dim)).wrap());
        if command.stage == "unknown" {
            ui.add(egui::Label::new(RichText::new(unknown(command)).color(theme.distress)).wrap());
        }
        ui.horizontal_wrapped(|ui| {
            if let Some(frame) = last.and_then(|stage| stage.frame)
                && ui.link(format!("frame {frame}")).on_hover_text("The frame that proves it").clicked()
            {
                show_frame(scene, frame);
            }
            acts(ui, scene, state, sender, command);
        });
    });
    ui.add_space(4.0);
}

fn acts(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State, sender: &mut Sender, command: &CommandView) {
    if ui.small_button("Draft again").on_hover_text("The same as a new draft; sends nothing").clicked() {
        let mut draft = Draft::again(&command.command, &command.arguments);
        draft.gate.priority = command.priority;
        draft.gate.blind = command.gate == api::GateWord::Blind;
        state.draft = Some(draft);
    }
    if command.stage != "queued" {
        return;
    }
    let may_command = scene.may("command");
    if may::button(ui, format!("Withdraw {}", command.id), &may_command) {
        sender.cancel(scene, command.id, None);
    }
    let known = sender.sent.get(&command.id).cloned().filter(|request| request.confirm.is_none());
    let can = match &known {
        Some(_) => may_command.clone(),
        None => Err("only what was sent from this window, and is not critical, can be moved".to_owned()),
    };
    for (name, by) in [("Sooner", 1_i16), ("Later", -1)] {
        if may::button(ui, format!("{name} {}", command.id), &can)
            && let Some(request) = &known
        {
            let priority = command.priority.saturating_add(by);
            sender.cancel(scene, command.id, Some(api::CommandRequest { priority, ..request.clone() }));
        }
    }
    if may_command.is_err() {
        why(ui, &may_command);
    }
}

/// What unknown means, and what one may do.
fn unknown(command: &CommandView) -> String {
    let harmless = api::telecommand::parse(&command.command, &command.arguments)
        .is_ok_and(|telecommand| telecommand.is_idempotent());
    let then = if harmless {
        "Doing it twice does no harm: draft it again when it matters."
    } else {
        "Doing it twice may do harm: look at telemetry first, and send it again only when you know that it was not done."
    };
    format!(
        "Unknown: it was radiated, or may have been, and nothing proves that the satellite took it or not. {then}"
    )
}

/// The four stages as lights, and the end it came to.
fn lights(ui: &mut Ui, command: &CommandView, stages: &[StageView]) {
    let theme = Theme::current(ui);
    let reached = |name: &str| stages.iter().rfind(|stage| stage.stage == name).map(|stage| stage.at);
    let now = match command.stage.as_str() {
        "radiating" => 1,
        stage => STAGES.iter().position(|name| *name == stage).unwrap_or(0),
    };
    let ended = !is_open(command) && command.stage != "answered";
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (index, name) in STAGES.into_iter().enumerate() {
            let at = reached(name).or((index == 0).then_some(command.created_at));
            let is_lit = at.is_some() || (!ended && index <= now);
            light(ui, theme, name, at, is_lit, index + 1 < STAGES.len() || ended);
        }
        if command.stage == "radiating" {
            ui.label(RichText::new("on air").small().strong().color(theme.on_air));
        }
        if ended {
            let colour = stage_colour(theme, &command.stage);
            ui.label(RichText::new(&command.stage).small().strong().color(colour))
                .on_hover_text(command.stage_at.to_string());
        }
    });
}

fn light(ui: &mut Ui, theme: &Theme, name: &str, at: Option<Time>, is_lit: bool, has_next: bool) {
    let (rect, response) = ui.allocate_exact_size(vec2(12.0, 14.0), Sense::hover());
    let colour = if is_lit { theme.accent } else { theme.faint };
    if is_lit {
        ui.painter().circle_filled(rect.center(), 4.5, colour);
    } else {
        ui.painter().circle_stroke(rect.center(), 4.0, egui::Stroke::new(1.5, colour));
    }
    let told = format!("{name}: {}", if is_lit { "reached" } else { "not yet" });
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &told));
    response.on_hover_text(at.map_or(told.clone(), |at| at.to_string()));
    let ink = if is_lit { theme.text } else { theme.dim };
    ui.label(RichText::new(name).small().color(ink));
    if has_next {
        let (rect, _) = ui.allocate_exact_size(vec2(12.0, 14.0), Sense::hover());
        ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(1.0, colour));
    }
}

/// Every stage with when, who, why and the frame that proves it.
fn detail(ui: &mut Ui, scene: &mut Scene<'_>, state: &State, command: &CommandView) {
    let theme = Theme::current(ui);
    let Some(stages) = state.details.get(&command.id).and_then(|view| view.stages.as_ref()) else {
        ui.label(RichText::new("Stages are being asked for.").color(theme.dim));
        return;
    };
    let mut frame = None;
    for stage in stages {
        ui.horizontal_wrapped(|ui| {
            ui.monospace(stage.at.to_string());
            ui.label(RichText::new(&stage.stage).color(stage_colour(theme, &stage.stage)));
            let words = format!("attempt {}, {}, {}", stage.attempt, stage.who, stage.why);
            ui.label(RichText::new(words).small().color(theme.dim));
            if let Some(id) = stage.frame
                && ui.link(format!("frame {id}")).clicked()
            {
                frame = Some(id);
            }
        });
    }
    if let Some(frame) = frame {
        show_frame(scene, frame);
    }
}

fn show_frame(scene: &mut Scene<'_>, frame: u64) {
    scene.kept.chosen_frame = Some(frame);
    scene.open(Pane::Frame);
}
