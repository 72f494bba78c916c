//! The list of keys under `?`.

use egui::{Align2, Key, Modifiers, RichText};
use ui::Theme;

use crate::keys;

/// Draws the list while it is open; Esc and a click elsewhere close it.
pub(crate) fn show(context: &egui::Context, open: &mut bool) {
    if !*open {
        return;
    }
    if context.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Escape)) {
        *open = false;
        return;
    }
    let window = egui::Window::new("Keys")
        .collapsible(false)
        .resizable(false)
        .open(open)
        .anchor(Align2::CENTER_TOP, [0.0, 72.0]);
    window.show(context, |ui| {
        egui::Grid::new("keys").num_columns(2).spacing([24.0, 4.0]).show(ui, |ui| {
            for binding in &keys::ALL {
                row(ui, binding.written, binding.says);
            }
            for (written, says) in keys::ELSEWHERE {
                row(ui, written, says);
            }
        });
    });
}

fn row(ui: &mut egui::Ui, written: &str, says: &str) {
    let theme = Theme::current(ui);
    ui.label(RichText::new(written).monospace().color(theme.accent));
    ui.label(says);
    ui.end_row();
}
