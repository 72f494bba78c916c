//! Telemetry over time: several values, each on the scale of its unit, with limits, gaps and a common cursor.
//!
//! What is drawn costs by the width of the picture, not by the number of samples ([`Series`] keeps extremes of each
//! stretch). Time is UTC throughout.

mod axis;
mod series;
pub(crate) mod thin;
mod view;

use egui::{Color32, Key, Response, Role, Stroke, Ui, WidgetInfo, vec2};
use egui_plot::{AxisHints, GridMark, HPlacement, Line, Plot, PlotBounds, PlotPoint, PlotPoints, Points};
use jiff::Timestamp;

use crate::chip::chip;
use crate::fonts;
use crate::format;
use crate::level::Level;
use crate::theme::{self, Theme};

use axis::Scale;
pub use series::{Reading, Series};
use thin::{Thinned, thin};
pub use view::View;

/// Markers are drawn where fewer samples than this are in sight.
const MARKERS_BELOW: usize = 50;

/// Room for the marks of a scale, so that plots above each other line up.
const SCALE_WIDTH: f32 = 60.0;

/// One line in a plot.
#[derive(Debug, Clone, Copy)]
pub struct Curve<'a> {
    /// What it is, as a person calls it.
    pub name: &'a str,
    /// Unit of its values; curves of the same unit share a scale. Empty for plain numbers.
    pub unit: &'a str,
    /// Its samples.
    pub series: &'a Series,
    /// Stretches of values at which an alarm is raised, drawn as faint bands.
    pub limits: &'a [Limit],
    /// Its colour where the order of curves shall not decide.
    pub colour: Option<Color32>,
}

/// Values from `low` to `high` are at this level. Either end may be infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// How much it matters.
    pub level: Level,
    /// Lower end, in the unit of the curve.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Draws the curves over the view's stretch of time and lets it be moved: dragging pans, the wheel with Ctrl (or a
/// pinch) zooms, the wheel sideways pans, a double click follows the clock again; with the keyboard arrows pan, plus
/// and minus zoom, End follows. `height` is that of the whole, in points.
pub fn plot_ui(
    ui: &mut Ui,
    id: impl std::hash::Hash + std::fmt::Debug,
    curves: &[Curve<'_>],
    view: &mut View,
    now: Timestamp,
    height: f32,
) -> Response {
    view.advance(now);
    let theme = Theme::current(ui);
    let id = ui.make_persistent_id(("telemetry plot", id));
    ui.vertical(|ui| {
        ui.spacing_mut().item_spacing.y = theme::space();
        let top = ui.cursor().top();
        let scales = scales(curves, view, height);
        header(ui, theme, curves, &scales, view, now);
        let left = (height - (ui.cursor().top() - top)).max(64.0);
        let response = body(ui, id, theme, curves, &scales, view, left);
        hands(ui, &response, view);
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, spoken(curves, view)));
        response
    })
    .inner
}

/// One scale for each unit, in the order in which units appear.
fn scales<'a>(curves: &[Curve<'a>], view: &View, height: f32) -> Vec<(&'a str, Scale)> {
    let steps = (height / 48.0).clamp(2.0, 6.0) as usize;
    let mut ranges: Vec<(&str, Option<(f64, f64)>)> = Vec::new();
    for curve in curves {
        let range = curve.series.range(view.from(), view.to());
        match ranges.iter_mut().find(|(unit, _)| *unit == curve.unit) {
            None => ranges.push((curve.unit, range)),
            Some((_, all)) => {
                *all = match (*all, range) {
                    (Some((low, high)), Some((lower, higher))) => Some((low.min(lower), high.max(higher))),
                    (one, other) => one.or(other),
                };
            }
        }
    }
    let scale = |(low, high)| Scale::holding(low, high, steps);
    ranges.into_iter().map(|(unit, range)| (unit, scale(range.unwrap_or((0.0, 1.0))))).collect()
}

fn scale_of(scales: &[(&str, Scale)], unit: &str) -> (usize, Scale) {
    let found = scales.iter().position(|(other, _)| *other == unit);
    found.map_or((0, Scale { low: 0.0, step: 1.0, steps: 1 }), |index| (index, scales[index].1))
}

fn colour_of(theme: &Theme, index: usize, curve: &Curve<'_>) -> Color32 {
    curve.colour.unwrap_or_else(|| theme.series(index))
}

/// The names with their values at the cursor, or else the last ones.
fn header(
    ui: &mut Ui,
    theme: &Theme,
    curves: &[Curve<'_>],
    scales: &[(&str, Scale)],
    view: &View,
    now: Timestamp,
) {
    let figures = fonts::figures(theme::sizes().small);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0 * theme::space(), 0.0);
        let moment = view.cursor().unwrap_or_else(|| view.to().min(now));
        for (index, curve) in curves.iter().enumerate() {
            let (_, scale) = scale_of(scales, curve.unit);
            let decimals = scale.decimals() + usize::from(view.cursor().is_some());
            let (text, colour) = match curve.series.reading(moment) {
                Reading::Value { value, .. } => (format::number(value, decimals), theme.text),
                Reading::Invalid { .. } => ("invalid".to_owned(), theme.distress),
                Reading::Nothing => (format::UNKNOWN.to_owned(), theme.dim),
            };
            // As wide as the widest value of the scale, so that nothing moves when the figures change.
            let wide = |part| format::number(scale.value(part), decimals).chars().count();
            let width = wide(0.0).max(wide(1.0));
            let words = vec![
                (curve.name.to_owned(), fonts::small(), theme.dim),
                (format!("{text:>width$}"), figures.clone(), colour),
                (curve.unit.to_owned(), fonts::small(), theme.dim),
            ];
            let stroke = Stroke::new(2.5, colour_of(theme, index, curve));
            chip(ui, vec2(14.0, 4.0), words, |ui, mark| {
                ui.painter().hline(mark.x_range(), mark.center().y, stroke);
            });
        }
        if let Some(cursor) = view.cursor() {
            chip(ui, vec2(0.0, 0.0), vec![(format::utc_ms(cursor), figures, theme.dim)], |_, _| ());
        }
    });
}

/// The plot itself: across, seconds since the view's beginning; upwards, parts of the scales.
fn body(
    ui: &mut Ui,
    id: egui::Id,
    theme: &Theme,
    curves: &[Curve<'_>],
    scales: &[(&str, Scale)],
    view: &mut View,
    height: f32,
) -> Response {
    let (from_us, to_us) = (view.from().as_microsecond(), view.to().as_microsecond());
    let seconds = |at_us: i64| (at_us - from_us) as f64 / 1e6;
    let columns = (ui.available_width() * ui.pixels_per_point()).max(16.0) as usize;
    let thinned: Vec<Thinned> =
        curves.iter().map(|curve| thin(curve.series, from_us, to_us, columns)).collect();
    let most = ((ui.available_width() - SCALE_WIDTH) / 108.0).max(2.0) as usize;
    let (ticks, step_us) = axis::time_ticks(from_us, to_us, most);
    let marks: Vec<GridMark> = ticks
        .iter()
        .map(|&tick| GridMark { value: seconds(tick), step_size: step_us as f64 / 1e6 })
        .collect();
    let steps = scales.first().map_or(4, |(_, scale)| scale.steps);
    let font = fonts::figures(theme::sizes().small);
    let y_axes = scales.iter().enumerate().map(|(index, &(unit, scale))| {
        let mut mine = curves.iter().enumerate().filter(|(_, curve)| curve.unit == unit);
        let only = mine.next().filter(|_| mine.next().is_none() && scales.len() > 1);
        let colour = only.map_or(theme.dim, |(index, curve)| colour_of(theme, index, curve));
        let unit = unit.to_owned();
        AxisHints::new_y()
            .placement(if index == 0 { HPlacement::Left } else { HPlacement::Right })
            .min_thickness(if index == 0 { SCALE_WIDTH } else { SCALE_WIDTH - 8.0 })
            .label_spacing(egui::Rangef::new(14.0, 15.0))
            .tick_label_color(colour)
            .tick_label_font(font.clone())
            .formatter(move |mark, _| {
                let number = format::number(scale.value(mark.value), scale.decimals());
                if mark.value > 0.999 { format!("{number} {unit}").trim_end().to_owned() } else { number }
            })
    });
    let x_axis = AxisHints::new_x()
        .label_spacing(egui::Rangef::new(20.0, 21.0))
        .tick_label_color(theme.dim)
        .tick_label_font(font.clone())
        .formatter(move |mark, _| axis::tick_text(from_us + (mark.value * 1e6).round() as i64, step_us));
    let plot = Plot::new(id)
        .height(height)
        .show_x(false)
        .show_y(false)
        .show_crosshair(false)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_axis_zoom_drag(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .custom_x_axes(vec![x_axis])
        .custom_y_axes(y_axes.collect())
        .x_grid_spacer(move |_| marks.clone())
        .y_grid_spacer(move |_| {
            (0..=steps)
                .map(|step| GridMark { value: step as f64 / steps as f64, step_size: 1.0 / steps as f64 })
                .collect()
        })
        .grid_color(theme.line)
        .grid_fade(0.0)
        .set_margin_fraction(vec2(0.0, 0.0));
    let end_s = seconds(to_us);
    let shown = plot.show(ui, |plot| {
        plot.set_auto_bounds(false);
        plot.set_plot_bounds(PlotBounds::from_min_max([0.0, -0.05], [end_s, 1.05]));
        for (curve, thinned) in curves.iter().zip(&thinned) {
            let scale = scale_of(scales, curve.unit).1;
            for limit in curve.limits.iter().filter(|_| thinned.in_sight > 0) {
                let part = |value: f64| scale.part(value).clamp(-0.1, 1.1);
                let (low, high) = (part(limit.low), part(limit.high));
                if high > low && high > -0.05 && low < 1.05 {
                    let band = egui_plot::Polygon::new(
                        "",
                        PlotPoints::Owned(vec![
                            PlotPoint::new(0.0, low),
                            PlotPoint::new(end_s, low),
                            PlotPoint::new(end_s, high),
                            PlotPoint::new(0.0, high),
                        ]),
                    );
                    let colour = limit.level.colour(theme);
                    plot.polygon(
                        band.stroke(Stroke::NONE).fill_color(colour.gamma_multiply(0.10)).allow_hover(false),
                    );
                }
            }
        }
        for (index, (curve, thinned)) in curves.iter().zip(&thinned).enumerate() {
            let scale = scale_of(scales, curve.unit).1;
            let point = |&sample: &usize| {
                let part = scale.part(curve.series.value(sample));
                PlotPoint::new(seconds(curve.series.time_us(sample)), part)
            };
            let colour = colour_of(theme, index, curve);
            let has_markers = thinned.in_sight < MARKERS_BELOW;
            // Each piece is a line of its own, so that nothing connects them.
            for (piece, samples) in thinned.pieces().enumerate() {
                let points: Vec<PlotPoint> = samples.iter().map(point).collect();
                if has_markers || points.len() == 1 {
                    let markers =
                        Points::new("", PlotPoints::Owned(points.clone())).radius(2.0).color(colour);
                    plot.points(markers.id((index, piece, "markers")).allow_hover(false));
                }
                let line = Line::new(curve.name, PlotPoints::Owned(points)).id((index, piece));
                plot.line(line.width(1.5).color(colour).allow_hover(false));
            }
        }
        plot.pointer_coordinate().filter(|_| plot.response().hovered())
    });
    let hovered = shown.inner.map(|point| from_us + (point.x * 1e6) as i64);
    take_cursor(ui, id, view, hovered.and_then(|at_us| Timestamp::from_microsecond(at_us).ok()));
    over(ui, theme, curves, scales, &thinned, view, &shown.transform);
    shown.response
}

/// Invalid samples as crosses at the lower edge, and the cursor.
fn over(
    ui: &Ui,
    theme: &Theme,
    curves: &[Curve<'_>],
    scales: &[(&str, Scale)],
    thinned: &[Thinned],
    view: &View,
    transform: &egui_plot::PlotTransform,
) {
    let frame = *transform.frame();
    let painter = ui.painter().with_clip_rect(frame);
    let from_us = view.from().as_microsecond();
    let x = |at_us: i64| transform.position_from_point_x((at_us - from_us) as f64 / 1e6);
    let scale = |curve: &Curve<'_>| scale_of(scales, curve.unit).1;
    for (index, (curve, thinned)) in curves.iter().zip(thinned).enumerate() {
        let y = frame.bottom() - 7.0 - 9.0 * index as f32;
        let stroke = Stroke::new(1.2, colour_of(theme, index, curve));
        let mut last = f32::NEG_INFINITY;
        for &at_us in &thinned.invalid_us {
            let x = x(at_us);
            if x - last >= 7.0 {
                painter.line_segment([egui::pos2(x - 2.5, y - 2.5), egui::pos2(x + 2.5, y + 2.5)], stroke);
                painter.line_segment([egui::pos2(x - 2.5, y + 2.5), egui::pos2(x + 2.5, y - 2.5)], stroke);
                last = x;
            }
        }
    }
    if thinned.iter().all(|thinned| thinned.in_sight == 0) {
        let told = "no samples here";
        painter.text(frame.center(), egui::Align2::CENTER_CENTER, told, fonts::small(), theme.dim);
    }
    if let Some(cursor) = view.cursor() {
        painter.vline(x(cursor.as_microsecond()), frame.y_range(), Stroke::new(1.0, theme.dim));
        for (index, curve) in curves.iter().enumerate() {
            if let Reading::Value { at, value } = curve.series.reading(cursor) {
                let y = transform.position_from_point_y(scale(curve).part(value));
                let at = egui::pos2(x(at.as_microsecond()), y);
                painter.circle(at, 3.5, colour_of(theme, index, curve), Stroke::new(1.5, theme.ground));
            }
        }
    }
}

/// The cursor is where the pointer is in this plot; when it leaves, the cursor goes, unless another plot has it.
fn take_cursor(ui: &Ui, id: egui::Id, view: &mut View, hovered: Option<Timestamp>) {
    let id = id.with("has the cursor");
    let had = ui.data(|data| data.get_temp::<bool>(id)).unwrap_or(false);
    if had != hovered.is_some() {
        ui.data_mut(|data| data.insert_temp(id, hovered.is_some()));
    }
    let frame = ui.ctx().cumulative_frame_nr();
    if hovered.is_some() {
        view.set_cursor(hovered);
        view.cursor_frame = frame;
    } else if had && view.cursor_frame != frame {
        view.set_cursor(None);
    }
}

/// What pointer and keys do to the view.
fn hands(ui: &Ui, response: &Response, view: &mut View) {
    let width = f64::from(response.rect.width().max(1.0));
    if response.clicked() {
        response.request_focus();
    }
    if response.dragged() && response.drag_delta().x != 0.0 {
        view.pan(-f64::from(response.drag_delta().x) / width);
    }
    if response.double_clicked() {
        view.follow(true);
    }
    if response.hovered() {
        let (zoom, sideways) = ui.input(|input| (input.zoom_delta(), input.smooth_scroll_delta().x));
        let centre = view.cursor().unwrap_or_else(|| view.to());
        if (zoom - 1.0).abs() > 1e-4 {
            view.zoom(1.0 / f64::from(zoom), centre);
        }
        if sideways != 0.0 {
            view.pan(-f64::from(sideways) / width);
        }
    }
    if response.has_focus() {
        let pressed = |key| ui.input(|input| input.key_pressed(key));
        let middle = view.cursor().unwrap_or_else(|| view.from() + view.length() / 2);
        if pressed(Key::ArrowLeft) {
            view.pan(-0.1);
        }
        if pressed(Key::ArrowRight) {
            view.pan(0.1);
        }
        if pressed(Key::Plus) || pressed(Key::Equals) {
            view.zoom(0.5, middle);
        }
        if pressed(Key::Minus) {
            view.zoom(2.0, middle);
        }
        if pressed(Key::End) {
            view.follow(true);
        }
    }
}

fn spoken(curves: &[Curve<'_>], view: &View) -> String {
    let names: Vec<String> = curves
        .iter()
        .map(|curve| match curve.series.reading(view.cursor().unwrap_or_else(|| view.to())) {
            Reading::Value { value, .. } => {
                format!("{} {value} {}", curve.name, curve.unit).trim_end().to_owned()
            }
            Reading::Invalid { .. } => format!("{} invalid", curve.name),
            Reading::Nothing => format!("{} unknown", curve.name),
        })
        .collect();
    format!("Plot: {}", names.join(", "))
}
