//! A plan as text, in TOML or JSON: the same words. What cannot be read yet is kept as it is written.

use api::{FieldError, PlanText};
use egui::{FontSelection, TextEdit, Ui};
use serde_json::Value;

use crate::desk::PlanDraft;

/// The form of the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Words {
    Toml,
    Json,
}

/// The text as it was written from the plan last: written anew only when the plan changed.
#[derive(Default)]
pub(super) struct Page {
    written: Option<(PlanText, Words, String)>,
    fault: Option<String>,
}

impl Page {
    pub(super) fn show(&mut self, ui: &mut Ui, draft: &mut PlanDraft, words: Words, errors: &[FieldError]) {
        let mut text = match &draft.unread {
            Some(text) => text.clone(),
            None => self.of(&draft.plan, words),
        };
        if draft.unread.is_some() && self.fault.is_none() {
            self.fault = read(&text, words).err();
        }
        let theme = ui::Theme::current(ui);
        match &self.fault {
            Some(fault) if draft.unread.is_some() => {
                ui.colored_label(theme.critical, fault);
            }
            _ => {
                self.fault = None;
            }
        }
        for error in errors {
            ui.colored_label(theme.critical, format!("{}: {}", error.field, error.message));
        }
        let edit = TextEdit::multiline(&mut text)
            .font(FontSelection::FontId(ui::fonts::figures(ui::theme::sizes().body)))
            .desired_width(f32::INFINITY)
            .desired_rows(18)
            .lock_focus(true);
        let label = ui.label("Text of the plan");
        if !ui.add(edit).labelled_by(label.id).changed() {
            return;
        }
        match read(&text, words) {
            Ok(plan) => {
                // Kept as it was written, with its own order and spaces, while it says the same.
                self.written = Some((plan.clone(), words, text));
                draft.plan = plan;
                draft.unread = None;
                self.fault = None;
            }
            Err(fault) => {
                self.fault = Some(fault);
                draft.unread = Some(text);
            }
        }
    }

    fn of(&mut self, plan: &PlanText, words: Words) -> String {
        match &self.written {
            Some((of, form, text)) if of == plan && *form == words => text.clone(),
            _ => {
                let text = write(plan, words);
                self.written = Some((plan.clone(), words, text.clone()));
                text
            }
        }
    }
}

/// The plan that the text says.
fn read(text: &str, words: Words) -> Result<PlanText, String> {
    match words {
        Words::Toml => toml::from_str(text).map_err(|error| error.to_string()),
        Words::Json => serde_json::from_str(text).map_err(|error| error.to_string()),
    }
}

/// The text that says the plan.
fn write(plan: &PlanText, words: Words) -> String {
    let mut plan = plan.clone();
    let written = match words {
        Words::Toml => {
            plan.steps.iter_mut().for_each(drop_nulls);
            toml::to_string_pretty(&plan).map_err(|error| error.to_string())
        }
        Words::Json => serde_json::to_string_pretty(&plan).map_err(|error| error.to_string()),
    };
    written.unwrap_or_else(|error| format!("# {error}\n"))
}

/// TOML has no null; what is null may be left out.
fn drop_nulls(step: &mut api::StepText) {
    if let Some(arguments) = &mut step.arguments {
        arguments.retain(|_, value| !value.is_null());
        arguments.values_mut().for_each(without_nulls);
    }
    step.slots.iter_mut().chain(&mut step.entries).flatten().for_each(without_nulls);
    step.steps.iter_mut().flatten().for_each(drop_nulls);
}

fn without_nulls(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|_, value| !value.is_null());
            map.values_mut().for_each(without_nulls);
        }
        Value::Array(list) => list.iter_mut().for_each(without_nulls),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN: &str = r#"{"name":"night","satellite":"pixelsat-1","transmit":true,"steps":[
        {"do":"wait-for","until":{"heard_within_s":60,"telemetry":[{"parameter":"heartbeat.temp","op":"<","value":40,"max_age_s":120}]},"timeout_s":300},
        {"do":"repeat-until","at_most":2,"steps":[{"do":"command","command":"GetImageChunk","arguments":{"first":0,"count":10}}]},
        {"do":"upload-schedule","slots":[{"time":"2026-12-01T00:00:00Z","first":0,"count":10,"attitude_mrp":null}]}]}"#;

    #[test]
    fn toml_and_json_say_the_same() {
        let plan = read(PLAN, Words::Json).unwrap();
        assert_eq!(read(&write(&plan, Words::Json), Words::Json).unwrap(), plan);
        let toml = read(&write(&plan, Words::Toml), Words::Toml).unwrap();
        let mut without = plan;
        without.steps.iter_mut().for_each(drop_nulls);
        assert_eq!(toml, without);
    }

    #[test]
    fn a_mistake_is_told_with_its_line() {
        let fault = read("name = 'a'\nsatellite = 'b'\nstepz = []\n", Words::Toml).unwrap_err();
        assert!(fault.contains("stepz") && fault.contains('3'), "{fault}");
    }
}
