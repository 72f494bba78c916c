//! Two passes over each other, aligned at AOS.

use api::client::Filter;
use api::{Page, PassKept, ProblemKind};
use egui::{Role, WidgetInfo};
use jiff::SignedDuration;
use ui::plot::{Curve, Series, View, plot_ui};

use super::super::Scene;
use super::super::export::table::{self, Column};
use super::super::history::at;
use crate::link::Pending;

/// Values a little before AOS and after LOS belong to the pass.
const MARGIN_US: i64 = 60_000_000;
/// Passes to choose from.
const PASSES: u32 = 100;

/// What is compared.
#[derive(Default)]
pub(super) struct State {
    asked: Option<(String, Option<Pending<Page<PassKept>>>)>,
    passes: Vec<PassKept>,
    failure: Option<String>,
    chosen: [Option<u64>; 2],
    held: Option<Held>,
}

struct Held {
    of: ([u64; 2], Vec<Vec<String>>),
    view: View,
    asking: Option<Pending<Vec<[Column; 2]>>>,
    /// For each parameter, in the order of the plots: its series in each of the two passes, the second moved to the AOS
    /// of the first.
    series: Vec<(String, String, [Series; 2])>,
}

fn aos_us(pass: &PassKept) -> i64 {
    pass.aos.unix_us()
}

fn los_us(pass: &PassKept) -> i64 {
    let end = pass.los.or(pass.ended_at).map(|los| los.unix_us());
    end.unwrap_or(aos_us(pass) + 15 * MARGIN_US).max(aos_us(pass) + 1)
}

fn title(pass: &PassKept) -> String {
    format!("{} {:.0}°", ui::format::utc(at(aos_us(pass))), pass.max_elevation_deg)
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>, state: &mut State, satellite: &str) {
    ask_passes(state, scene, satellite);
    let gone: Vec<&PassKept> =
        state.passes.iter().filter(|pass| scene.now_us.is_none_or(|now| aos_us(pass) <= now)).collect();
    if state.chosen == [None, None] && gone.len() > 1 {
        state.chosen = [Some(gone[0].id), Some(gone[1].id)];
    }
    ui.horizontal_wrapped(|ui| {
        for (chosen, words) in state.chosen.iter_mut().zip(["First pass", "Second pass"]) {
            let text = gone.iter().find(|pass| Some(pass.id) == *chosen).map(|pass| title(pass));
            let combo = egui::ComboBox::from_id_salt(words)
                .width(230.0)
                .selected_text(text.unwrap_or_else(|| words.to_owned()))
                .show_ui(ui, |ui| {
                    for pass in &gone {
                        ui.selectable_value(chosen, Some(pass.id), title(pass));
                    }
                });
            combo.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, words));
        }
    });
    if let Some(failure) = &state.failure {
        ui.weak(failure);
    }
    let pass = |chosen: Option<u64>| gone.iter().find(|pass| Some(pass.id) == chosen).copied().cloned();
    let (Some(first), Some(second)) = (pass(state.chosen[0]), pass(state.chosen[1])) else {
        ui.weak(if state.asked.as_ref().is_some_and(|(_, pending)| pending.is_some()) {
            "Waiting for the passes"
        } else {
            "Two passes are needed to compare"
        });
        return;
    };
    let of = ([first.id, second.id], scene.desk.plots.plots.clone());
    if state.held.as_ref().is_none_or(|held| held.of != of) {
        state.held = Some(ask(scene, satellite, of, &first, &second));
    }
    let Some(held) = &mut state.held else { return };
    take(held, &mut state.failure, &first, &second);
    if held.asking.is_some() {
        ui.weak("Fetching the values");
    }
    let now = at(scene.now_us.unwrap_or(0));
    let names = [title(&first), title(&second)];
    egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        for (parameter, unit, series) in &held.series {
            ui.label(parameter);
            let curve = |pass: usize| Curve {
                name: &names[pass],
                unit,
                series: &series[pass],
                limits: &[],
                colour: None,
            };
            plot_ui(ui, parameter, &[curve(0), curve(1)], &mut held.view, now, 180.0);
        }
    });
}

fn ask_passes(state: &mut State, scene: &Scene<'_>, satellite: &str) {
    if state.asked.as_ref().is_none_or(|(asked, _)| asked != satellite) {
        let filter = Filter::new().satellite(satellite).limit(PASSES);
        let pending = scene.courier.ask(move |client| async move { client.passes_history(&filter).await });
        *state = State { asked: Some((satellite.to_owned(), Some(pending))), ..State::default() };
    }
    let Some((_, pending)) = &mut state.asked else { return };
    if let Some(answer) = pending.as_ref().and_then(Pending::take) {
        *pending = None;
        match answer {
            Ok(page) => state.passes = page.items,
            Err(error) => state.failure = Some(error.to_string()),
        }
    }
}

fn ask(
    scene: &Scene<'_>,
    satellite: &str,
    of: ([u64; 2], Vec<Vec<String>>),
    first: &PassKept,
    second: &PassKept,
) -> Held {
    let mut parameters = of.1.concat();
    parameters.dedup();
    let spans = [first, second].map(|pass| (aos_us(pass) - MARGIN_US, los_us(pass) + MARGIN_US));
    let satellite = satellite.to_owned();
    let asking = scene.courier.ask(move |client| async move {
        let mut both = Vec::new();
        for parameter in parameters {
            let [(from, to), (other_from, other_to)] = spans;
            let first = table::fetch(&client, &satellite, &parameter, from, to).await;
            let first = match first {
                Err(error) if error.kind() == Some(ProblemKind::NotFound) => continue,
                first => first?,
            };
            both.push([first, table::fetch(&client, &satellite, &parameter, other_from, other_to).await?]);
        }
        Ok(both)
    });
    let view = View::new(at(spans[0].0), at(spans[0].1.max(spans[0].0 + spans[1].1 - spans[1].0)));
    Held { of, view, asking: Some(asking), series: Vec::new() }
}

fn take(held: &mut Held, failure: &mut Option<String>, first: &PassKept, second: &PassKept) {
    let Some(answer) = held.asking.as_ref().and_then(Pending::take) else { return };
    held.asking = None;
    match answer {
        Err(error) => *failure = Some(error.to_string()),
        Ok(both) => {
            *failure = None;
            let moved_us = [0, aos_us(first) - aos_us(second)];
            held.series = both
                .into_iter()
                .map(|[one, other]| {
                    let (parameter, unit) = (one.parameter.clone(), one.unit.clone());
                    (parameter, unit, [aligned(&one, moved_us[0]), aligned(&other, moved_us[1])])
                })
                .collect();
        }
    }
}

/// The values of a pass, moved in time.
fn aligned(column: &Column, by_us: i64) -> Series {
    let mut series = Series::new(Some(SignedDuration::from_mins(5)));
    series.extend(column.rows.iter().map(|(at_us, value, _)| (at(at_us + by_us), *value)));
    series
}

#[cfg(test)]
mod tests {
    use ui::plot::Reading;

    use super::*;

    #[test]
    fn the_second_pass_is_moved_to_the_aos_of_the_first() {
        let column = Column {
            satellite: "s".to_owned(),
            parameter: "p".to_owned(),
            unit: String::new(),
            rows: vec![(5_000_000, Some(1.0), 1), (6_000_000, None, 2)],
        };
        let series = aligned(&column, -4_000_000);
        assert_eq!(series.reading(at(1_500_000)), Reading::Value { at: at(1_000_000), value: 1.0 });
        assert_eq!(series.reading(at(2_000_000)), Reading::Invalid { at: at(2_000_000) });
    }
}
