//! The fields of a telecommand, made from its definition; each with its range, unit and what is wrong with it.

use std::collections::BTreeMap;

use api::telecommand::{Argument, Default as Left, Definition, Kind};
use egui::{Button, ComboBox, RichText, ScrollArea, TextEdit, Ui};
use ui::Theme;

use crate::desk::Draft;

/// Height of a row of a long choice.
const ROW: f32 = 20.0;

/// Draws the fields.
pub(super) fn show(ui: &mut Ui, draft: &mut Draft, errors: &BTreeMap<String, String>, now: jiff::Timestamp) {
    let Some(definition) = Definition::find(&draft.command) else { return };
    ui.label(RichText::new(definition.doc).color(Theme::current(ui).dim));
    if let Some(error) = errors.get("command") {
        wrong(ui, error);
    }
    fields(ui, draft, definition.arguments, "", errors, now);
    if let Some(error) = errors.get("arguments") {
        wrong(ui, error);
    }
}

fn fields(
    ui: &mut Ui,
    draft: &mut Draft,
    arguments: &[Argument],
    at: &str,
    errors: &BTreeMap<String, String>,
    now: jiff::Timestamp,
) {
    for argument in arguments {
        let path = format!("{at}{}", argument.name);
        match argument.kind {
            Kind::List { min, max, entry } => {
                list(ui, draft, argument, &path, (min, max, entry), errors, now)
            }
            Kind::Vectors { min, max } => vectors(ui, draft, argument, &path, (min, max), errors),
            kind => {
                ui.horizontal(|ui| {
                    name(ui, argument, &path);
                    one(ui, draft, argument, kind, &path, now);
                    told(ui, argument);
                });
                under(ui, &path, errors);
            }
        }
    }
}

/// The name of a field, as wide as all of them.
fn name(ui: &mut Ui, argument: &Argument, path: &str) {
    let theme = Theme::current(ui);
    let shown = path.rsplit('.').next().unwrap_or(argument.name);
    let text = RichText::new(shown).color(theme.dim);
    ui.allocate_ui_with_layout(
        [130.0, 20.0].into(),
        egui::Layout::left_to_right(egui::Align::Center),
        |ui| {
            ui.set_min_width(130.0);
            ui.add(egui::Label::new(text).truncate()).on_hover_text(argument.doc);
        },
    );
}

/// Unit, range and default, dim behind the field.
fn told(ui: &mut Ui, argument: &Argument) {
    let mut words = Vec::new();
    if !argument.unit.is_empty() {
        words.push(argument.unit.to_owned());
    }
    match argument.kind {
        Kind::Whole { min, max } => words.push(format!("{min} to {max}")),
        Kind::Number { range: Some((min, max)) } => words.push(format!("{min} to {max}")),
        Kind::Line { length } => words.push(format!("exactly {length}")),
        Kind::Time => words.push("UTC".to_owned()),
        Kind::Vector => words.push("x, y, z".to_owned()),
        _ => {}
    }
    match argument.default {
        Some(Left::Whole(number)) => words.push(format!("else {number}")),
        Some(Left::Absent) => words.push("may stay empty".to_owned()),
        _ => {}
    }
    ui.label(RichText::new(words.join(" · ")).small().color(Theme::current(ui).dim));
}

fn one(ui: &mut Ui, draft: &mut Draft, argument: &Argument, kind: Kind, path: &str, now: jiff::Timestamp) {
    let text = draft.fields.entry(path.to_owned()).or_default();
    match kind {
        Kind::Flag => {
            let mut is_on = text == "true";
            let word = if is_on { "yes" } else { "no" };
            let mark = ui.checkbox(&mut is_on, word);
            mark.widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, is_on, path));
            *text = is_on.to_string();
        }
        Kind::Choice(words) => choice(ui, path, text, words),
        Kind::Time => {
            field(ui, text, path, 190.0, argument);
            if ui.small_button("now").on_hover_text("The server's time").clicked() {
                *text = format!("{now:.3}");
            }
        }
        Kind::Line { .. } => {
            let width = (ui.available_width() - 170.0).max(120.0);
            field(ui, text, path, width, argument);
            let count = text.chars().count();
            ui.label(RichText::new(count.to_string()).small().color(Theme::current(ui).dim));
        }
        Kind::Vector => field(ui, text, path, 190.0, argument),
        _ => field(ui, text, path, 90.0, argument),
    }
}

fn field(ui: &mut Ui, text: &mut String, path: &str, width: f32, argument: &Argument) {
    let edit = TextEdit::singleline(text).desired_width(width).font(egui::TextStyle::Monospace);
    ui.add(edit).accessible_name(path).on_hover_text(argument.doc);
}

/// One of many words; however many there are, only those in view are drawn.
pub(super) fn choice(ui: &mut Ui, path: &str, text: &mut String, words: &[&str]) {
    let shown = if text.is_empty() { "choose".to_owned() } else { text.clone() };
    let combo = ComboBox::from_id_salt(path).selected_text(shown).width(150.0);
    let response = combo.show_ui(ui, |ui| {
        let typed = ui.scope_id().with("typed");
        let mut filter: String = ui.data(|data| data.get_temp(typed)).unwrap_or_default();
        if words.len() > 12 {
            let edit = TextEdit::singleline(&mut filter).hint_text("type to find");
            ui.add(edit).accessible_name(format!("Find {path}"));
            ui.data_mut(|data| data.insert_temp(typed, filter.clone()));
        }
        let wanted = filter.to_lowercase();
        let found: Vec<&&str> = words.iter().filter(|word| word.to_lowercase().contains(&wanted)).collect();
        ScrollArea::vertical().max_height(260.0).show_rows(ui, ROW, found.len(), |ui, rows| {
            for word in found.get(rows).unwrap_or_default() {
                ui.selectable_value(text, (**word).to_owned(), **word);
            }
        });
    });
    let label = format!("{path} {text}");
    response.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, &label));
}

type ListShape = (usize, usize, &'static [Argument]);

fn list(
    ui: &mut Ui,
    draft: &mut Draft,
    argument: &Argument,
    path: &str,
    (min, max, entry): ListShape,
    errors: &BTreeMap<String, String>,
    now: jiff::Timestamp,
) {
    let count = draft.entries.get(path).copied().unwrap_or(0);
    head(ui, argument, count, max, path, draft, |draft| draft.add_entry(path, entry));
    under(ui, path, errors);
    let mut removed = None;
    for index in 0..count {
        let at = format!("{path}[{index}]");
        ui.horizontal(|ui| {
            ui.label(RichText::new(format!("{}", index + 1)).monospace());
            let remove = ui.add_enabled(count > min, Button::new("Remove").small());
            remove.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::Button, count > min, format!("Remove {at}"))
            });
            if remove.clicked() {
                removed = Some(index);
            }
        });
        ui.indent(&at, |ui| fields(ui, draft, entry, &format!("{at}."), errors, now));
        under(ui, &at, errors);
    }
    if let Some(index) = removed {
        draft.remove_entry(path, index);
    }
}

fn vectors(
    ui: &mut Ui,
    draft: &mut Draft,
    argument: &Argument,
    path: &str,
    (min, max): (usize, usize),
    errors: &BTreeMap<String, String>,
) {
    let count = draft.entries.get(path).copied().unwrap_or(0);
    head(ui, argument, count, max, path, draft, |draft| {
        *draft.entries.entry(path.to_owned()).or_default() += 1
    });
    let mut removed = None;
    for index in 0..count {
        let at = format!("{path}[{index}]");
        ui.horizontal(|ui| {
            ui.label(RichText::new(format!("t^{index}")).monospace());
            field(ui, draft.fields.entry(at.clone()).or_default(), &at, 190.0, argument);
            if ui.add_enabled(count > min, Button::new("Remove").small()).clicked() {
                removed = Some(index);
            }
        });
        under(ui, &at, errors);
    }
    under(ui, path, errors);
    if let Some(index) = removed {
        draft.remove_entry(path, index);
    }
}

fn head(
    ui: &mut Ui,
    argument: &Argument,
    count: usize,
    max: usize,
    path: &str,
    draft: &mut Draft,
    add: impl FnOnce(&mut Draft),
) {
    ui.horizontal(|ui| {
        name(ui, argument, path);
        ui.label(format!("{count} of {max}"));
        let more = ui.add_enabled(count < max, Button::new("Add").small());
        more.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Button, count < max, format!("Add to {path}"))
        });
        if more.clicked() {
            add(draft);
        }
        ui.label(RichText::new(argument.doc).small().color(Theme::current(ui).dim));
    });
}

/// What is wrong with this field, under it.
pub(super) fn under(ui: &mut Ui, path: &str, errors: &BTreeMap<String, String>) {
    let of_parts = |field: &str| {
        let rest = field.strip_prefix(path).unwrap_or("");
        rest.starts_with('[') && !rest.contains('.')
    };
    if let Some(error) = errors.get(path) {
        wrong(ui, error);
    }
    for (_, error) in errors.iter().filter(|(field, _)| of_parts(field)) {
        wrong(ui, error);
    }
}

pub(super) fn wrong(ui: &mut Ui, error: &str) {
    ui.horizontal(|ui| {
        ui.add_space(8.0);
        ui.add(egui::Label::new(RichText::new(error).color(Theme::current(ui).critical)).wrap());
    });
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable as _;

    use super::*;

    #[test]
    fn a_choice_of_a_thousand_words_is_drawn_in_less_than_a_tenth_of_a_second() {
        let words: Vec<String> = (0..1000).map(|index| format!("MODE_{index:03}")).collect();
        let mut harness = Harness::builder().with_size([400.0, 400.0]).build_ui_state(
            |ui, (text, words): &mut (String, Vec<String>)| {
                ui::install(ui.ctx(), ui::Mode::Dark);
                let words: Vec<&str> = words.iter().map(String::as_str).collect();
                choice(ui, "mode", text, &words);
            },
            (String::new(), words),
        );
        harness.run_steps(2);
        harness.get_by_label_contains("mode").click();
        harness.run_steps(3);
        let begun = crate::clock::instant();
        harness.run_steps(10);
        let took = crate::clock::instant().duration_since(begun) / 10;
        assert!(took.as_millis() < 100, "{took:?} a frame");
        let drawn = harness.query_all_by_label_contains("MODE_").count();
        assert!((5..40).contains(&drawn), "{drawn} words were laid out");
        harness.get_by_label("MODE_003").click();
        harness.run_steps(3);
        assert_eq!(harness.state().0, "MODE_003");
    }
}
