//! Who hears the satellite: strangers' stations and one's own boards.

use egui::{Grid, RichText, ScrollArea, Ui};
use jiff::Timestamp;
use ui::{Theme, format};

use super::{Scene, blank};

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let Some(page) = scene.model.receivers.value() else { return blank::show(ui, scene) };
    if page.items.is_empty() {
        ui.centered_and_justified(|ui| ui.weak("Nobody but us has reported it within the last weeks"));
        return;
    }
    let now = scene.timestamp();
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        Grid::new("receivers").num_columns(5).striped(true).spacing([16.0, 4.0]).show(ui, |ui| {
            for head in ["Receiver", "Last heard", "Frames", "SNR", "Sources"] {
                ui.weak(head);
            }
            ui.end_row();
            for one in &page.items {
                let name = one.name.as_deref().unwrap_or(&one.id);
                let shown: String = name.chars().filter(char::is_ascii).take(32).collect();
                ui.label(RichText::new(shown).color(Theme::current(ui).text)).on_hover_text(&one.id);
                let at = one.last_heard_at.and_then(|at| Timestamp::from_microsecond(at.unix_us()).ok());
                ui.label(at.map_or(format::UNKNOWN.to_owned(), |at| {
                    format!("{} ago", format::age(now.duration_since(at)))
                }));
                ui.label(one.frames.to_string());
                ui.label(format::db(one.median_snr_db).to_string());
                ui.label(one.sources.join(", "));
                ui.end_row();
            }
        });
    });
}
