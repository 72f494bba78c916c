//! The steps of a plan as rows; the chosen one is opened below its row.

use api::{FieldError, GateWord, OnFailureWord, StepText};
use egui::{ComboBox, TextEdit, Ui};
use serde_json::{Map, Value};

use super::{fields, told_at, told_ui};
use crate::panes::plan_words;

const KINDS: [&str; 6] =
    ["listen", "command", "wait-for", "download-image", "upload-schedule", "repeat-until"];
/// Repeats inside each other, as the server takes them.
const DEEPEST: usize = 4;
const STEPS_MAX: usize = 100;

/// What is open, and arguments that are being written and are none yet.
#[derive(Debug, Default)]
pub(super) struct Rows {
    open: Option<String>,
    /// Place of the step and its arguments as text.
    arguments: Option<(String, String)>,
}

enum Change {
    Up(usize),
    Down(usize),
    Remove(usize),
    After(usize),
}

impl Rows {
    pub(super) fn show(&mut self, ui: &mut Ui, steps: &mut Vec<StepText>, errors: &[FieldError]) {
        told_ui(ui, errors, "steps");
        self.list(ui, steps, "steps", 0, errors);
    }

    fn list(
        &mut self,
        ui: &mut Ui,
        steps: &mut Vec<StepText>,
        path: &str,
        depth: usize,
        errors: &[FieldError],
    ) {
        let mut change = None;
        let count = steps.len();
        for (index, step) in steps.iter_mut().enumerate() {
            let place = format!("{path}[{index}]");
            ui.push_id(&place, |ui| {
                if let Some(made) = self.row(ui, step, (index, count), &place, errors) {
                    change = Some(made);
                }
                if self.open.as_deref() == Some(&place) {
                    ui.indent("open", |ui| self.detail(ui, step, &place));
                }
                told_ui(ui, errors, &place);
                if step.what == "repeat-until" && depth < DEEPEST {
                    let inner = step.steps.get_or_insert_default();
                    ui.indent("steps", |ui| {
                        self.list(ui, inner, &format!("{place}.steps"), depth + 1, errors)
                    });
                }
            });
        }
        if steps.is_empty() && ui.button("Add a step").clicked() {
            steps.push(fresh());
            self.open = Some(format!("{path}[0]"));
        }
        if let Some(change) = change {
            self.apply(steps, path, change);
        }
    }

    fn row(
        &mut self,
        ui: &mut Ui,
        step: &mut StepText,
        (index, count): (usize, usize),
        place: &str,
        errors: &[FieldError],
    ) -> Option<Change> {
        let mut change = None;
        let theme = ui::Theme::current(ui);
        ui.horizontal(|ui| {
            let number = index + 1;
            let open = self.open.as_deref() == Some(place);
            let mut words = egui::RichText::new(format!("{number:>2}  {}", plan_words::step(step)));
            if told_at(errors, place).next().is_some() {
                words = words.color(theme.critical);
            }
            let row = ui.selectable_label(open, words);
            if row.clicked() {
                self.open = (!open).then(|| place.to_owned());
            }
            if let Some(when) = &step.when {
                ui.weak(format!("when {}", plan_words::condition(when)));
            }
            if let Some(limit_s) = step.limit_s {
                ui.weak(format!("at most {} s", plan_words::plain(limit_s)));
            }
            if open {
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if ui.add_enabled(count < STEPS_MAX, egui::Button::new("Add below")).clicked() {
                        change = Some(Change::After(index));
                    }
                    if ui.button("Remove").clicked() {
                        change = Some(Change::Remove(index));
                    }
                    if ui.add_enabled(index + 1 < count, egui::Button::new("Down")).clicked() {
                        change = Some(Change::Down(index));
                    }
                    if ui.add_enabled(index > 0, egui::Button::new("Up")).clicked() {
                        change = Some(Change::Up(index));
                    }
                });
            }
        });
        change
    }

    fn apply(&mut self, steps: &mut Vec<StepText>, path: &str, change: Change) {
        self.arguments = None;
        let open = match change {
            Change::Up(index) => {
                steps.swap(index, index - 1);
                Some(index - 1)
            }
            Change::Down(index) => {
                steps.swap(index, index + 1);
                Some(index + 1)
            }
            Change::Remove(index) => {
                steps.remove(index);
                None
            }
            Change::After(index) => {
                steps.insert(index + 1, fresh());
                Some(index + 1)
            }
        };
        self.open = open.map(|index| format!("{path}[{index}]"));
    }

    fn detail(&mut self, ui: &mut Ui, step: &mut StepText, place: &str) {
        ComboBox::from_label("does").selected_text(&step.what).show_ui(ui, |ui| {
            for kind in KINDS {
                if ui.selectable_label(step.what == kind, kind).clicked() && step.what != kind {
                    *step = StepText {
                        when: step.when.take(),
                        limit_s: step.limit_s,
                        on_failure: step.on_failure,
                        ..of_kind(kind)
                    };
                    self.arguments = None;
                }
            }
        });
        match step.what.as_str() {
            "listen" => labelled(ui, "for", |ui, label| {
                fields::required(ui, label, "s", step.for_s.get_or_insert(30.0));
            }),
            "command" => self.command(ui, step, place),
            "wait-for" => {
                fields::condition(ui, "until", &mut step.until);
                labelled(ui, "for at most", |ui, label| {
                    fields::required(ui, label, "s", step.timeout_s.get_or_insert(300.0));
                });
            }
            "repeat-until" => {
                fields::condition(ui, "until", &mut step.until);
                fields::count(ui, "rounds at most", &mut step.at_most, 3);
            }
            "upload-schedule" => {
                ui.weak("Slots are laid out on the pane Downlink schedule, or written as text");
                sending(ui, step);
            }
            _ => {}
        }
        fields::condition(ui, "when", &mut step.when);
        ui.horizontal_wrapped(|ui| {
            fields::number(ui, "at most", "s", &mut step.limit_s, 120.0);
            ui.label("on failure");
            for (word, name) in [
                (OnFailureWord::Abort, "abort"),
                (OnFailureWord::Skip, "skip"),
                (OnFailureWord::Continue, "continue"),
            ] {
                let chosen = step.on_failure.unwrap_or_default() == word;
                if ui.selectable_label(chosen, name).clicked() {
                    step.on_failure = (word != OnFailureWord::Abort).then_some(word);
                }
            }
        });
    }

    fn command(&mut self, ui: &mut Ui, step: &mut StepText, place: &str) {
        let shown = step.command.clone().unwrap_or_default();
        ui.horizontal_wrapped(|ui| {
            ComboBox::from_label("command").selected_text(shown).show_ui(ui, |ui| {
                for name in api::telecommand::NAMES {
                    if ui.selectable_label(step.command.as_deref() == Some(name), name).clicked() {
                        step.command = Some(name.to_owned());
                    }
                }
            });
            let label = ui.label("arguments");
            let written = step.arguments.as_ref().map(|map| Value::Object(map.clone()).to_string());
            let mut text = match &self.arguments {
                Some((at, text)) if at == place => text.clone(),
                _ => written.unwrap_or_default(),
            };
            let edit = TextEdit::singleline(&mut text)
                .desired_width(220.0)
                .hint_text("{\"first\": 0, \"count\": 10}");
            if ui.add(edit).labelled_by(label.id).changed() {
                match arguments(&text) {
                    Some(read) => {
                        step.arguments = read;
                        self.arguments = None;
                    }
                    None => self.arguments = Some((place.to_owned(), text)),
                }
            }
            if self.arguments.as_ref().is_some_and(|(at, _)| at == place) {
                let theme = ui::Theme::current(ui);
                ui.colored_label(theme.distress, "no JSON object yet");
            }
        });
        sending(ui, step);
    }
}

fn labelled(ui: &mut Ui, name: &str, show: impl FnOnce(&mut Ui, egui::Id)) {
    ui.horizontal(|ui| {
        let label = ui.label(name).id;
        show(ui, label);
    });
}

/// What the steps that send have in common.
fn sending(ui: &mut Ui, step: &mut StepText) {
    ui.horizontal_wrapped(|ui| {
        fields::count(ui, "priority", &mut step.priority, 0);
        fields::count(ui, "attempts", &mut step.attempts, 3);
        let mut blind = step.gate == Some(GateWord::Blind);
        if ui
            .checkbox(&mut blind, "blind")
            .on_hover_text("Also when the satellite was not heard lately")
            .changed()
        {
            step.gate = blind.then_some(GateWord::Blind);
        }
        let mut approved = step.approved_by.is_some();
        if ui.checkbox(&mut approved, "approved by").on_hover_text("Needed where it is critical").changed() {
            let nobody = api::ApprovalText { name: String::new(), digest: None, expires_at: None };
            step.approved_by = approved.then_some(nobody);
        }
        if let Some(approval) = &mut step.approved_by {
            let label = ui.label("person");
            ui.add(TextEdit::singleline(&mut approval.name).desired_width(110.0)).labelled_by(label.id);
            let label = ui.label("digest");
            let mut digest = approval.digest.clone().unwrap_or_default();
            if ui.add(TextEdit::singleline(&mut digest).desired_width(130.0)).labelled_by(label.id).changed()
            {
                approval.digest = (!digest.is_empty()).then_some(digest);
            }
        }
    });
}

fn fresh() -> StepText {
    of_kind("command")
}

/// A step of this kind with what it must have.
fn of_kind(kind: &str) -> StepText {
    let step = StepText { what: kind.to_owned(), ..StepText::default() };
    match kind {
        "listen" => StepText { for_s: Some(30.0), ..step },
        "command" => StepText { command: Some("Ping".to_owned()), ..step },
        "wait-for" => {
            let until = api::ConditionText { heard_within_s: Some(60.0), ..api::ConditionText::default() };
            StepText { until: Some(until), timeout_s: Some(300.0), ..step }
        }
        "upload-schedule" => StepText { slots: Some(Vec::new()), ..step },
        "repeat-until" => StepText { steps: Some(vec![fresh()]), at_most: Some(3), ..step },
        _ => step,
    }
}

/// Arguments as an object; empty: none. `None`: no object.
fn arguments(text: &str) -> Option<Option<Map<String, Value>>> {
    if text.trim().is_empty() {
        return Some(None);
    }
    serde_json::from_str(text).ok().map(Some)
}
