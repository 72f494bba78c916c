//! The head of a plan.

use api::{AtLosWord, AttachText, FieldError, PlanText};
use egui::{ComboBox, DragValue, TextEdit, Ui};

use super::{fields, told_ui};

const HEAD: [&str; 9] =
    ["name", "satellite", "transmit", "priority", "worth", "at_los", "limit_s", "min_pass", "attach"];

pub(super) fn show(ui: &mut Ui, plan: &mut PlanText, satellites: &[String], errors: &[FieldError]) {
    ui.horizontal_wrapped(|ui| {
        let label = ui.label("Name");
        ui.add(TextEdit::singleline(&mut plan.name).desired_width(140.0).char_limit(32))
            .labelled_by(label.id);
        ComboBox::from_label("satellite").selected_text(&plan.satellite).show_ui(ui, |ui| {
            for satellite in satellites {
                ui.selectable_value(&mut plan.satellite, satellite.clone(), satellite);
            }
        });
        ui.checkbox(&mut plan.transmit, "may transmit");
        let label = ui.label("priority");
        ui.add(DragValue::new(&mut plan.priority).speed(0.1)).labelled_by(label.id);
        let label = ui.label("worth");
        ui.add(DragValue::new(&mut plan.worth).speed(0.1)).labelled_by(label.id);
    });
    ui.horizontal_wrapped(|ui| {
        let mut later = plan.at_los == AtLosWord::FinishLater;
        ui.checkbox(&mut later, "finish in the next pass")
            .on_hover_text("What is undone at LOS goes on there");
        plan.at_los = if later { AtLosWord::FinishLater } else { AtLosWord::Stop };
        fields::number(ui, "at most", "s", &mut plan.limit_s, 480.0);
        let label = ui.label("passes from");
        fields::required(ui, label.id, "°", &mut plan.min_pass.max_elevation_deg);
        let label = ui.label("and");
        fields::required(ui, label.id, "s", &mut plan.min_pass.duration_s);
    });
    attach(ui, &mut plan.attach);
    for place in HEAD {
        told_ui(ui, errors, place);
    }
}

/// The rule by which it finds its passes itself.
fn attach(ui: &mut Ui, attach: &mut Option<AttachText>) {
    ui.horizontal_wrapped(|ui| {
        let mut given = attach.is_some();
        if ui.checkbox(&mut given, "finds its passes itself").changed() {
            let rule = AttachText {
                min_max_elevation_deg: Some(20.0),
                hours_utc: Vec::new(),
                sunlit: None,
                every: 1,
            };
            *attach = given.then_some(rule);
        }
        let Some(rule) = attach else { return };
        fields::number(ui, "that come to", "°", &mut rule.min_max_elevation_deg, 20.0);
        let label = ui.label("every");
        ui.add(DragValue::new(&mut rule.every).range(1..=1000).speed(0.1)).labelled_by(label.id);
        for (word, sunlit) in [("any light", None), ("sunlit", Some(true)), ("in shadow", Some(false))] {
            ui.selectable_value(&mut rule.sunlit, sunlit, word);
        }
        let label = ui.label("hours UTC");
        let mut hours = rule.hours_utc.join(", ");
        let hint = TextEdit::singleline(&mut hours).desired_width(130.0).hint_text("18:00-06:00");
        if ui.add(hint).labelled_by(label.id).changed() {
            rule.hours_utc =
                hours.split(',').map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect();
        }
    });
}
