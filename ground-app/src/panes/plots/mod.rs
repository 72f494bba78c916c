//! Values over time: from live to years, several plots on one stretch of time.

mod compare;

use api::ProblemKind;
use api::client::Client;
use egui::{Role, WidgetInfo};
use jiff::SignedDuration;
use ui::plot::{Curve, Series, View, plot_ui};

use super::export::drawing::{self, Form};
use super::export::table::{self, Column};
use super::export::{Exports, folder, stamp};
use super::history::{Look, at};
use super::{Scene, blank};
use crate::desk::{CURVES_MAX, PLOTS_MAX};
use crate::link::Pending;

/// No plot is lower.
const LOWEST: f32 = 150.0;
const HOUR_S: f64 = 3600.0;
/// Lengths to choose from.
const LENGTHS: [(&str, f64); 8] = [
    ("10 min", 600.0),
    ("1 h", HOUR_S),
    ("6 h", 6.0 * HOUR_S),
    ("1 d", 24.0 * HOUR_S),
    ("7 d", 168.0 * HOUR_S),
    ("30 d", 720.0 * HOUR_S),
    ("1 y", 8766.0 * HOUR_S),
    ("10 y", 87_660.0 * HOUR_S),
];

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    view: Option<View>,
    exports: Exports,
    /// Values that are fetched to be exported, and as what.
    fetching: Option<(FileForm, i64, i64, Pending<Vec<Column>>)>,
    search: String,
    compare: compare::State,
    empty: Series,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FileForm {
    Csv,
    Parquet,
    Picture(Form),
}

impl FileForm {
    const ALL: [Self; 4] = [Self::Csv, Self::Parquet, Self::Picture(Form::Png), Self::Picture(Form::Svg)];

    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Csv => ("CSV", "csv"),
            Self::Parquet => ("Parquet", "parquet"),
            Self::Picture(Form::Png) => ("PNG", "png"),
            Self::Picture(Form::Svg) => ("SVG", "svg"),
        }
    }
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let satellite = scene.satellite().map(|satellite| satellite.satellite.clone());
    let (Some(satellite), Some(now_us)) = (satellite, scene.now_us) else { return blank::show(ui, scene) };
    let mut state = std::mem::take(&mut scene.kept.plots);
    let mut view = match state.view.take() {
        Some(view) => view,
        None => view_of_desk(scene, now_us),
    };
    if let Some(point_us) = scene.kept.point_at.take() {
        if point_us < view.from().as_microsecond() || point_us > view.to().as_microsecond() {
            let half = view.length() / 2;
            view.set(at(point_us) - half, at(point_us) + half);
        }
        view.set_cursor(Some(at(point_us)));
    }
    view.advance(at(now_us));
    tools(ui, scene, &mut state, &mut view, &satellite, now_us);
    if scene.desk.plots.compare {
        compare::show(ui, scene, &mut state.compare, &satellite);
    } else {
        plots(ui, scene, &mut state, &mut view, &satellite, now_us);
    }
    scene.desk.plots.length_s = view.length().as_secs_f64();
    scene.desk.plots.to_us = (!view.is_following()).then(|| view.to().as_microsecond());
    state.view = Some(view);
    scene.kept.plots = state;
}

fn view_of_desk(scene: &Scene<'_>, now_us: i64) -> View {
    let desk = &scene.desk.plots;
    let length_us = (desk.length_s.clamp(1.0, 1e10) * 1e6) as i64;
    match desk.to_us {
        Some(to_us) => View::new(at(to_us.saturating_sub(length_us)), at(to_us)),
        None => View::following(SignedDuration::from_micros(length_us), at(now_us)),
    }
}

fn tools(
    ui: &mut egui::Ui,
    scene: &mut Scene<'_>,
    state: &mut State,
    view: &mut View,
    satellite: &str,
    now_us: i64,
) {
    ui.horizontal_wrapped(|ui| {
        for (name, length_s) in LENGTHS {
            let now_s = view.length().as_secs_f64();
            let chosen = (now_s - length_s).abs() < 0.5;
            let button = ui.selectable_label(chosen, name);
            button.widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, format!("Show {name}")));
            if button.clicked() {
                let length_us = (length_s * 1e6) as i64;
                let end_us = if view.is_following() { now_us } else { view.to().as_microsecond() };
                let follow = view.is_following();
                view.set(at(end_us.saturating_sub(length_us)), at(end_us));
                view.follow(follow);
            }
        }
        let mut follow = view.is_following();
        if ui.checkbox(&mut follow, "Follow now").changed() {
            view.follow(follow);
        }
        ui.checkbox(&mut scene.desk.plots.compare, "Compare passes");
    });
    ui.horizontal_wrapped(|ui| {
        add_menu(ui, scene, state, satellite);
        for form in FileForm::ALL {
            let (words, _) = form.words();
            let ready = !state.exports.is_busy() && state.fetching.is_none();
            let button = ui.add_enabled(ready, egui::Button::new(words));
            button.widget_info(|| WidgetInfo::labeled(Role::Button, ready, format!("Export {words}")));
            if button.on_hover_text("Every value of what is shown, none thinned").clicked() {
                let (from_us, to_us) = (view.from().as_microsecond(), view.to().as_microsecond());
                let mut parameters: Vec<String> = scene.desk.plots.plots.concat();
                parameters.sort_unstable();
                parameters.dedup();
                let satellite = satellite.to_owned();
                let pending = scene.courier.ask(move |client| async move {
                    all(&client, &satellite, parameters, from_us, to_us).await
                });
                state.fetching = Some((form, from_us, to_us, pending));
            }
        }
        folder(ui, scene);
        take_export(scene, state);
        if state.fetching.is_some() {
            ui.weak("Fetching the values");
        }
        state.exports.show(ui);
    });
}

async fn all(
    client: &Client,
    satellite: &str,
    parameters: Vec<String>,
    from_us: i64,
    to_us: i64,
) -> Result<Vec<Column>, api::client::ClientError> {
    let mut columns = Vec::new();
    for parameter in parameters {
        match table::fetch(client, satellite, &parameter, from_us, to_us).await {
            Ok(column) => columns.push(column),
            // Never heard: there is nothing to export of it.
            Err(error) if error.kind() == Some(ProblemKind::NotFound) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(columns)
}

fn take_export(scene: &Scene<'_>, state: &mut State) {
    let Some((form, from_us, to_us, pending)) = &state.fetching else { return };
    let Some(answer) = pending.take() else { return };
    let (form, from_us, to_us) = (*form, *from_us, *to_us);
    state.fetching = None;
    match answer {
        Err(error) => state.exports.fail(error.to_string()),
        Ok(columns) => {
            let name = format!("telemetry-{}.{}", stamp(scene.now_us), form.words().1);
            let place = scene.desk.plots.folder.as_deref();
            state.exports.save(place, &name, scene.courier, move || match form {
                FileForm::Csv => Ok(table::csv(&columns)),
                FileForm::Parquet => table::parquet(&columns),
                FileForm::Picture(form) => drawing::draw(&columns, from_us, to_us, form),
            });
        }
    }
}

/// Parameters to choose from: a click shows one in a plot of its own, with Shift in the plot above.
fn add_menu(ui: &mut egui::Ui, scene: &mut Scene<'_>, state: &mut State, satellite: &str) {
    let room = scene.desk.plots.plots.len() < PLOTS_MAX;
    ui.add_enabled_ui(room, |ui| {
        ui.menu_button("Add a plot", |ui| {
            if let Some(parameter) = choose(ui, scene, &mut state.search, satellite) {
                scene.desk.plots.show(&parameter);
            }
        });
    });
}

fn choose(ui: &mut egui::Ui, scene: &Scene<'_>, search: &mut String, satellite: &str) -> Option<String> {
    let edit = egui::TextEdit::singleline(search).hint_text("Search");
    ui.add(edit).widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Search parameters"));
    let wanted = search.trim().to_lowercase();
    let parameters = scene.model.parameters.value().map_or(&[][..], |page| &page.items);
    let fits: Vec<&str> = parameters
        .iter()
        .filter(|parameter| parameter.satellite == satellite)
        .map(|parameter| parameter.parameter.as_str())
        .filter(|name| wanted.is_empty() || name.to_lowercase().contains(&wanted))
        .collect();
    let mut chosen = None;
    egui::ScrollArea::vertical().max_height(320.0).show_rows(ui, 24.0, fits.len(), |ui, range| {
        for name in &fits[range] {
            if ui.selectable_label(false, *name).clicked() {
                chosen = Some((*name).to_owned());
                ui.close();
            }
        }
    });
    chosen
}

fn plots(
    ui: &mut egui::Ui,
    scene: &mut Scene<'_>,
    state: &mut State,
    view: &mut View,
    satellite: &str,
    now_us: i64,
) {
    let shown = scene.desk.plots.plots.clone();
    if shown.is_empty() {
        ui.centered_and_justified(|ui| ui.weak("Choose a value to plot it"));
        return;
    }
    let (from_us, to_us) = (view.from().as_microsecond(), view.to().as_microsecond());
    // Each plot has a line of names above it.
    let each = (ui.available_height() / shown.len() as f32 - 36.0).clamp(LOWEST, 420.0);
    egui::ScrollArea::vertical().auto_shrink([false, false]).show_viewport(ui, |ui, _| {
        for (number, parameters) in shown.iter().enumerate() {
            ui.push_id(number, |ui| {
                names(ui, scene, state, number, parameters, satellite);
                for parameter in parameters {
                    let look = Look { satellite, parameter, from_us, to_us };
                    scene.kept.history.want(look, scene.model, scene.courier, scene.now);
                    if let Some(why) = scene.kept.history.failure(satellite, parameter) {
                        ui.weak(why);
                    }
                }
                // What is not seen is not drawn.
                let place =
                    egui::Rect::from_min_size(ui.cursor().min, egui::vec2(ui.available_width(), each));
                if !ui.is_rect_visible(place) {
                    ui.allocate_rect(place, egui::Sense::hover());
                    return;
                }
                let unit = |parameter: &str| unit_of(scene, satellite, parameter);
                let curves: Vec<Curve<'_>> = parameters
                    .iter()
                    .map(|parameter| {
                        let look = Look { satellite, parameter, from_us, to_us };
                        let series = scene.kept.history.series(look).unwrap_or(&state.empty);
                        Curve { name: parameter, unit: unit(parameter), series, limits: &[], colour: None }
                    })
                    .collect();
                plot_ui(ui, number, &curves, view, at(now_us), each);
            });
        }
    });
}

fn unit_of<'a>(scene: &Scene<'a>, satellite: &str, parameter: &str) -> &'a str {
    let parameters = scene.model.parameters.value().map_or(&[][..], |page| &page.items);
    let found = parameters.iter().find(|known| known.parameter == parameter && known.satellite == satellite);
    // A list of a minute ago does not have what came first since.
    let live = || scene.model.values.unit(satellite, parameter);
    found.map(|known| known.unit.as_str()).or_else(live).unwrap_or_default()
}

/// The parameters of a plot, each to be taken away, and one more to be added.
fn names(
    ui: &mut egui::Ui,
    scene: &mut Scene<'_>,
    state: &mut State,
    number: usize,
    parameters: &[String],
    satellite: &str,
) {
    ui.horizontal_wrapped(|ui| {
        for parameter in parameters {
            let button = ui.small_button(format!("{parameter} ×"));
            button.widget_info(|| {
                WidgetInfo::labeled(
                    Role::Button,
                    true,
                    format!("Remove {parameter} from plot {}", number + 1),
                )
            });
            if button.on_hover_text("Show it no more").clicked() {
                scene.desk.plots.remove(number, parameter);
            }
        }
        if parameters.len() < CURVES_MAX {
            ui.menu_button("+", |ui| {
                if let Some(parameter) = choose(ui, scene, &mut state.search, satellite) {
                    scene.desk.plots.add(number, &parameter);
                }
            })
            .response
            .widget_info(|| {
                WidgetInfo::labeled(Role::Button, true, format!("Add a value to plot {}", number + 1))
            });
        }
    });
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use api::{Sample, TelemetryPage, Time};

    use super::*;
    use crate::desk::Desk;
    use crate::link::{Link, Server};
    use crate::model::{Model, Point};
    use crate::panes::Kept;

    const POINTS: i64 = 100_000;
    const STEP_US: i64 = 3_333;
    /// Of 300 packets a second, those of one frame at 60 Hz.
    const PACKETS: i64 = 5;

    fn page(parameter: &str) -> TelemetryPage {
        let sample = |i: i64| Sample {
            at: Time::from_unix_us(i * STEP_US),
            value: (i % 997 != 0).then(|| (i as f64 / 700.0).sin() * 20.0 + (i % 13) as f64 * 0.1),
            frame: i as u64,
        };
        TelemetryPage {
            parameter: parameter.to_owned(),
            unit: "V".to_owned(),
            satellite: "s".to_owned(),
            start: None,
            stop: None,
            decimated: false,
            samples: (0..POINTS).map(sample).collect(),
            buckets: Vec::new(),
        }
    }

    /// 20 plots of so many points and 300 packets a second, each frame of the window from its values to triangles.
    #[test]
    fn twenty_plots_of_many_points_take_what_comes() {
        let server = Server { address: "http://127.0.0.1:9".to_owned(), token: None };
        let link = Link::open(&server, Arc::new(|| {})).unwrap();
        let mut model = Model::new(server.address);
        let names: Vec<String> = (0..20).map(|number| format!("p.{number}")).collect();
        let (mut kept, mut desk) = (Kept::default(), Desk::default());
        desk.plots.plots = names.iter().map(|name| vec![name.clone()]).collect();
        for name in &names {
            kept.history.said(&page(name), 0, &model);
        }
        let context = egui::Context::default();
        ui::install(&context, ui::Mode::Dark);
        let mut state = State::default();
        let mut view = View::following(SignedDuration::from_micros(POINTS * STEP_US), at(POINTS * STEP_US));
        let mut took = Vec::new();
        let mut packet = POINTS;
        for _ in 0..240 {
            let begun = crate::clock::instant();
            for _ in 0..PACKETS {
                packet += 1;
                for name in &names {
                    let value = Some((packet as f64 / 700.0).cos());
                    let point = Point { at_us: packet * STEP_US, value, frame: packet as u64 };
                    model.values.add("s", name, "V", point);
                }
            }
            let now_us = packet * STEP_US;
            let now = crate::clock::instant();
            let mut scene = Scene {
                model: &model,
                desk: &mut desk,
                courier: link.courier(),
                kept: &mut kept,
                now,
                now_us: Some(now_us),
            };
            let input = egui::RawInput {
                screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1600.0, 4400.0))),
                ..egui::RawInput::default()
            };
            let mut output = context.run_ui(input, |ui| {
                view.advance(at(now_us));
                plots(ui, &mut scene, &mut state, &mut view, "s", now_us);
            });
            output.textures_delta.set.clear();
            let shapes = std::mem::take(&mut output.shapes);
            let triangles = context.tessellate(shapes, output.pixels_per_point);
            assert!(!triangles.is_empty());
            output.drop_without_applying_deltas();
            took.push(crate::clock::instant().saturating_duration_since(begun));
        }
        let look = Look { satellite: "s", parameter: "p.7", from_us: 0, to_us: packet * STEP_US };
        let series = kept.history.series(look).unwrap();
        assert_eq!(series.len() as i64, POINTS + 240 * PACKETS, "each once");
        took.drain(..20);
        took.sort_unstable();
        let at = |part: usize| took[(took.len() - 1) * part / 100];
        println!("20 plots of {POINTS} points, 300 packets/s: p50 {:?}, p99 {:?}", at(50), at(99));
        // Far above what a quiet machine takes: only what grows with the points would reach it.
        assert!(at(50) < Duration::from_millis(400), "{:?}", at(50));
    }
}
