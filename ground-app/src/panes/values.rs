//! Values with limits and ages, packet by packet.

use std::collections::{BTreeMap, BTreeSet};

use api::client::Filter;
use api::{LatestValue, Page};
use egui::{Align2, Role, Sense, WidgetInfo, vec2};
use jiff::SignedDuration;
use ui::fonts;
use ui::level::paint_shape;
use ui::sparkline::sparkline_ui;
use ui::{Level, Theme};

use super::history::{Look, at};
use super::{Scene, blank, words};
use crate::link::Pending;
use crate::model::{Model, Point};

const ROW: f32 = 22.0;
/// What the small course beside a value shows.
const COURSE_US: i64 = 12 * 3600 * 1_000_000;
/// A packet that was heard longer ago is old while the satellite is in view, unless the station knows better.
const OLD_US: i64 = 150 * 1_000_000;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    search: String,
    closed: BTreeSet<String>,
    /// Where there are several satellites, the newest values are asked for each.
    asked: Option<(String, Option<Pending<Page<LatestValue>>>)>,
    of_one: Vec<LatestValue>,
}

struct Value<'a> {
    parameter: &'a str,
    field: &'a str,
    unit: &'a str,
    point: Point,
    level: Option<Level>,
}

enum Row<'a> {
    Packet { name: &'a str, heard_us: i64, worst: Option<Level>, count: usize },
    Value(Value<'a>, i64),
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let Some(satellite) = scene.satellite().cloned() else { return blank::show(ui, scene) };
    let name = satellite.satellite.clone();
    let mut state = std::mem::take(&mut scene.kept.values);
    ask_for_one(&mut state, scene, &name);
    let typed =
        egui::TextEdit::singleline(&mut state.search).hint_text("Search values").desired_width(f32::INFINITY);
    let typed = ui.add(typed);
    typed.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Search values"));
    let model = scene.model;
    let packets = packets(model, &state, &name);
    if packets.is_empty() {
        let words = if state.search.is_empty() { "Nothing was heard yet" } else { "No value of that name" };
        ui.weak(words);
    }
    let mut rows = Vec::new();
    for (packet, values) in packets {
        let heard_us = values.iter().map(|value| value.point.at_us).max().unwrap_or(0);
        let worst = values.iter().filter_map(|value| value.level).max();
        rows.push(Row::Packet { name: packet, heard_us, worst, count: values.len() });
        if !state.closed.contains(packet) {
            rows.extend(values.into_iter().map(|value| Row::Value(value, heard_us)));
        }
    }
    let mut toggled = None;
    let mut chosen = None;
    let spacing = std::mem::replace(&mut ui.spacing_mut().item_spacing.y, 0.0);
    egui::ScrollArea::vertical().auto_shrink([false, false]).show_rows(ui, ROW, rows.len(), |ui, range| {
        for row in &rows[range] {
            match row {
                Row::Packet { name, heard_us, worst, count } => {
                    let closed = state.closed.contains(*name);
                    if packet_row(ui, scene, &satellite, (name, *heard_us, *worst, *count), closed) {
                        toggled = Some((*name).to_owned());
                    }
                }
                Row::Value(value, heard_us) => {
                    if value_row(ui, scene, &satellite, value, *heard_us) {
                        chosen = Some(value.parameter.to_owned());
                    }
                }
            }
        }
    });
    ui.spacing_mut().item_spacing.y = spacing;
    if let Some(packet) = toggled
        && !state.closed.remove(&packet)
    {
        state.closed.insert(packet);
    }
    if let Some(parameter) = chosen {
        scene.desk.plots.show(&parameter);
    }
    scene.kept.values = state;
}

/// The values by packet: as the archive had them, or newer as they came.
fn packets<'a>(model: &'a Model, state: &'a State, satellite: &str) -> BTreeMap<&'a str, Vec<Value<'a>>> {
    let mut newest: BTreeMap<&str, (&str, Point)> = BTreeMap::new();
    let archived = model.latest.value().map_or(&[][..], |page| &page.items);
    for value in archived.iter().chain(&state.of_one).filter(|value| value.satellite == satellite) {
        let point = Point { at_us: value.at.unix_us(), value: value.value, frame: value.frame };
        keep_newer(&mut newest, &value.parameter, &value.unit, point);
    }
    for (parameter, unit, point) in model.values.newest(satellite) {
        keep_newer(&mut newest, parameter, unit, point);
    }
    let limits = model.limits.value().map_or(&[][..], |page| &page.items);
    let limits = limits.iter().filter(|limit| limit.satellite == satellite);
    let levels: BTreeMap<&str, Option<Level>> =
        limits.map(|limit| (limit.parameter.as_str(), words::level(&limit.level))).collect();
    let wanted = state.search.trim().to_lowercase();
    let mut packets: BTreeMap<&str, Vec<Value<'_>>> = BTreeMap::new();
    for (parameter, (unit, point)) in newest {
        if !wanted.is_empty() && !parameter.to_lowercase().contains(&wanted) {
            continue;
        }
        let (packet, field) = parameter.split_once('.').unwrap_or(("", parameter));
        let level = levels.get(parameter).copied().flatten();
        packets.entry(packet).or_default().push(Value { parameter, field, unit, point, level });
    }
    packets
}

fn keep_newer<'a>(
    newest: &mut BTreeMap<&'a str, (&'a str, Point)>,
    parameter: &'a str,
    unit: &'a str,
    point: Point,
) {
    let held = newest.entry(parameter).or_insert((unit, point));
    if (held.1.at_us, held.1.frame) < (point.at_us, point.frame) {
        *held = (unit, point);
    }
}

fn ask_for_one(state: &mut State, scene: &Scene<'_>, satellite: &str) {
    let several = scene.model.status.as_ref().is_some_and(|(status, _)| status.satellites.len() > 1);
    if !several {
        return;
    }
    if state.asked.as_ref().is_none_or(|(asked, _)| asked != satellite) {
        let filter = Filter::new().satellite(satellite);
        let pending = scene.courier.ask(move |client| async move { client.latest(&filter).await });
        state.asked = Some((satellite.to_owned(), Some(pending)));
    }
    if let Some((_, pending)) = &mut state.asked
        && let Some(answer) = pending.as_ref().and_then(Pending::take)
    {
        *pending = None;
        state.of_one = answer.map_or_else(|_| Vec::new(), |page| page.items);
    }
}

/// Whether what was heard then should have been heard again meanwhile: never while nothing is to be expected.
fn is_old(satellite: &api::SatelliteView, packet: &str, heard_us: i64, now_us: i64) -> bool {
    match packet {
        "heartbeat" => satellite.in_view != Some(false) && !satellite.in_contact,
        _ => satellite.in_view == Some(true) && now_us - heard_us > OLD_US,
    }
}

fn packet_row(
    ui: &mut egui::Ui,
    scene: &Scene<'_>,
    satellite: &api::SatelliteView,
    (name, heard_us, worst, count): (&str, i64, Option<Level>, usize),
    closed: bool,
) -> bool {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let age = scene.now_us.map(|now_us| words::age(heard_us, now_us));
    let out_of_view = satellite.in_view == Some(false);
    let tail = match &age {
        Some(_) if out_of_view && name == "heartbeat" && !satellite.expectation.is_empty() => {
            satellite.expectation.clone()
        }
        Some(age) => format!("heard {age} ago"),
        None => String::new(),
    };
    response
        .widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("{name}, {count} values, {tail}")));
    if ui.is_rect_visible(rect) {
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4.0, theme.raised);
        let left = rect.left_center();
        let mark = if closed { "+" } else { "−" };
        painter.text(left + vec2(8.0, 0.0), Align2::LEFT_CENTER, mark, fonts::small_figures(), theme.dim);
        let drawn =
            painter.text(left + vec2(22.0, 0.0), Align2::LEFT_CENTER, name, fonts::body(), theme.text);
        if let Some(level) = worst {
            let at = drawn.right_center() + vec2(16.0, 0.0);
            paint_shape(&painter, at, 12.0, level, level.colour(theme));
        }
        let old = scene.now_us.is_some_and(|now_us| is_old(satellite, name, heard_us, now_us));
        let colour = if old { theme.text } else { theme.dim };
        let right = rect.right_center() - vec2(8.0, 0.0);
        painter.text(right, Align2::RIGHT_CENTER, &tail, fonts::small(), colour);
        if response.has_focus() {
            painter.rect_stroke(rect, 4.0, (1.0, theme.accent), egui::StrokeKind::Inside);
        }
    }
    response.on_hover_text(format!("Heard {}", ui::format::utc(at(heard_us)))).clicked()
}

fn value_row(
    ui: &mut egui::Ui,
    scene: &mut Scene<'_>,
    satellite: &api::SatelliteView,
    value: &Value<'_>,
    heard_us: i64,
) -> bool {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let quantity = words::quantity(value.parameter, value.unit, value.point.value);
    let packet = value.parameter.split('.').next().unwrap_or_default();
    let now_us = scene.now_us.unwrap_or(heard_us);
    let old = value.point.at_us < heard_us || is_old(satellite, packet, value.point.at_us, now_us);
    let age = old.then(|| words::age(value.point.at_us, now_us));
    response.widget_info(|| {
        let mut words = format!("{} {quantity}", value.parameter);
        if let Some(level) = value.level {
            words = format!("{words}, {}", level.word());
        }
        if let Some(age) = &age {
            words = format!("{words}, {age} old");
        }
        WidgetInfo::labeled(Role::Button, true, words)
    });
    if !ui.is_rect_visible(rect) {
        return response.clicked();
    }
    let painter = ui.painter_at(rect);
    if response.hovered() || response.has_focus() {
        painter.rect_filled(rect, 4.0, theme.raised);
    }
    if response.has_focus() {
        painter.rect_stroke(rect, 4.0, (1.0, theme.accent), egui::StrokeKind::Inside);
    }
    // From the right: age, course, unit, number; the name has what is left.
    let wide = rect.width() > 300.0;
    let right = rect.right() - 8.0;
    let age_right = right;
    let course_right = right - if wide { 44.0 } else { 0.0 };
    let course_width = if wide { 72.0 } else { 0.0 };
    let unit_left = course_right - course_width - 44.0;
    let middle = rect.center().y;
    if let Some(age) = &age {
        let place = egui::pos2(age_right, middle);
        painter.text(place, Align2::RIGHT_CENTER, age, fonts::small_figures(), theme.dim);
    }
    let quiet = value.point.value.is_none() || old;
    let colour = match value.level {
        Some(level) => level.colour(theme),
        None if quiet => theme.dim,
        None => theme.text,
    };
    let number = painter.text(
        egui::pos2(unit_left - 4.0, middle),
        Align2::RIGHT_CENTER,
        &quantity.number,
        fonts::figures(ui::theme::sizes().body),
        colour,
    );
    if let Some(level) = value.level {
        let place = egui::pos2(number.left() - 12.0, middle);
        paint_shape(&painter, place, 12.0, level, level.colour(theme));
    }
    painter.text(
        egui::pos2(unit_left, middle),
        Align2::LEFT_CENTER,
        &quantity.unit,
        fonts::small(),
        theme.dim,
    );
    let room = egui::Rect::from_min_max(
        rect.left_top(),
        egui::pos2(number.left() - if value.level.is_some() { 22.0 } else { 6.0 }, rect.bottom()),
    );
    let name_at = rect.left_center() + vec2(22.0, 0.0);
    let clipped = painter.with_clip_rect(room);
    clipped.text(name_at, Align2::LEFT_CENTER, value.field, fonts::body(), theme.dim);
    if wide {
        let (satellite, parameter) = (satellite.satellite.as_str(), value.parameter);
        let look = Look { satellite, parameter, from_us: now_us - COURSE_US, to_us: now_us };
        scene.kept.history.want(look, scene.model, scene.courier, scene.now);
        if let Some(series) = scene.kept.history.series(look) {
            let place = egui::Rect::from_min_size(
                egui::pos2(course_right - course_width, rect.top() + 2.0),
                vec2(course_width, ROW - 4.0),
            );
            let mut inside = ui.new_child(egui::UiBuilder::new().max_rect(place));
            let length = SignedDuration::from_micros(COURSE_US);
            sparkline_ui(&mut inside, parameter, series, length, at(now_us), place.size());
        }
    }
    let hint = match value.level {
        Some(level) => format!("{}: {}. Click to plot", value.parameter, level.word()),
        None => format!("{}. Click to plot", value.parameter),
    };
    response.on_hover_text(hint).clicked()
}
