//! Elements: their age, what error of AOS and LOS to expect, where they came from.

use api::FetchReport;
use api::client::IdempotencyKey;
use egui::{RichText, ScrollArea, Ui};
use jiff::Timestamp;
use ui::{Theme, format};

use super::{Scene, blank, may};
use crate::link::Pending;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    asking: Option<Pending<FetchReport>>,
    told: Vec<String>,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let Some(held) = scene.model.elements.value() else { return blank::show(ui, scene) };
    let mut state = std::mem::take(&mut scene.kept.elements);
    if let Some(answer) = state.asking.as_ref().and_then(Pending::take) {
        state.told = match answer {
            Ok(report) if report.sources.is_empty() => vec!["No source is configured.".to_owned()],
            Ok(report) => {
                report.sources.into_iter().map(|one| format!("{}: {}", one.url, one.detail)).collect()
            }
            Err(error) => vec![error.to_string()],
        };
        state.asking = None;
    }
    ui.horizontal_wrapped(|ui| {
        let can = match &state.asking {
            Some(_) => Err("the sources are being asked".to_owned()),
            None => scene.may("plan"),
        };
        if may::button(ui, "Fetch now", &can) {
            let key = IdempotencyKey::fresh();
            state.asking = Some(scene.courier.ask(|client| async move { client.fetch_elements(&key).await }));
        }
        if state.asking.is_some() {
            ui.weak("asking the sources, as far as they allow");
        }
    });
    for told in &state.told {
        ui.label(told);
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        if held.items.is_empty() {
            ui.weak("No elements: passes are not known. Fetch them, or add some with gs-server elements add");
        }
        for one in &held.items {
            let theme = Theme::current(ui);
            let epoch = Timestamp::from_microsecond(one.elements.epoch.unix_us()).unwrap_or_default();
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new(&one.satellite).strong());
                ui.label(RichText::new(format::utc(epoch)).monospace());
                if one.in_use {
                    ui.label(RichText::new("in use").color(theme.accent));
                }
                if one.level != "normal" {
                    ui.label(RichText::new(&one.level).color(theme.distress));
                }
            });
            let age = format::Quantity::of(Some(one.age_days), 1, "d");
            let error = format::Quantity::of(Some(one.timing_error_s), 0, "s");
            ui.weak(format!(
                "{age} old, AOS and LOS within about {error}; from {}, by {}",
                one.source, one.added_by
            ));
        }
    });
    scene.kept.elements = state;
}
