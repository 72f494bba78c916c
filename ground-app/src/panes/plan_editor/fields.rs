//! Numbers that may be left out, and conditions.

use api::{ConditionText, GuardText};
use egui::{DragValue, TextEdit, Ui};

const OPERATORS: [&str; 6] = ["<", "<=", ">", ">=", "==", "!="];

/// A number that is given or left out.
pub(super) fn number(ui: &mut Ui, name: &str, unit: &str, value: &mut Option<f64>, first: f64) {
    ui.horizontal(|ui| {
        let mut given = value.is_some();
        let label = ui.checkbox(&mut given, name);
        if given != value.is_some() {
            *value = given.then_some(first);
        }
        if let Some(value) = value {
            required(ui, label.id, unit, value);
        }
    });
}

/// A number that must be there, labelled by something that is drawn already.
pub(super) fn required(ui: &mut Ui, label: egui::Id, unit: &str, value: &mut f64) {
    let suffix = if unit.is_empty() || unit == "°" { unit.to_owned() } else { format!(" {unit}") };
    ui.add(DragValue::new(value).speed(1.0).suffix(suffix)).labelled_by(label);
}

/// A whole number from 1 on that is given or left out.
pub(super) fn count<T: egui::emath::Numeric>(ui: &mut Ui, name: &str, value: &mut Option<T>, first: T) {
    ui.horizontal(|ui| {
        let mut given = value.is_some();
        let label = ui.checkbox(&mut given, name);
        if given != value.is_some() {
            *value = given.then_some(first);
        }
        if let Some(value) = value {
            ui.add(DragValue::new(value).speed(0.1)).labelled_by(label.id);
        }
    });
}

/// A condition that is given or left out.
pub(super) fn condition(ui: &mut Ui, name: &str, condition: &mut Option<ConditionText>) {
    let mut given = condition.is_some();
    if ui.checkbox(&mut given, name).changed() {
        *condition = given.then(ConditionText::default);
    }
    let Some(condition) = condition else { return };
    ui.indent(name, |ui| {
        ui.horizontal_wrapped(|ui| {
            number(ui, "elevation at least", "°", &mut condition.elevation_deg, 10.0);
            number(ui, "heard within", "s", &mut condition.heard_within_s, 60.0);
            number(ui, "after AOS", "s", &mut condition.after_aos_s, 30.0);
            number(ui, "before LOS", "s", &mut condition.before_los_s, 60.0);
        });
        let mut away = None;
        for (index, guard) in condition.telemetry.iter_mut().enumerate() {
            ui.horizontal_wrapped(|ui| {
                guard_ui(ui, guard, index);
                if ui.button("Remove value").clicked() {
                    away = Some(index);
                }
            });
        }
        if let Some(index) = away {
            condition.telemetry.remove(index);
        }
        if ui
            .button("Add a value")
            .on_hover_text("A value of the satellite, compared with a number")
            .clicked()
        {
            condition.telemetry.push(GuardText {
                parameter: "heartbeat.temp".to_owned(),
                op: "<".to_owned(),
                value: 40.0,
                max_age_s: 120.0,
            });
        }
    });
}

fn guard_ui(ui: &mut Ui, guard: &mut GuardText, index: usize) {
    let label = ui.label("value");
    ui.add(TextEdit::singleline(&mut guard.parameter).desired_width(150.0)).labelled_by(label.id);
    egui::ComboBox::from_id_salt(("operator", index)).selected_text(&guard.op).width(48.0).show_ui(
        ui,
        |ui| {
            for op in OPERATORS {
                ui.selectable_value(&mut guard.op, op.to_owned(), op);
            }
        },
    );
    required(ui, label.id, "", &mut guard.value);
    let age = ui.label("not older than");
    required(ui, age.id, "s", &mut guard.max_age_s);
}
