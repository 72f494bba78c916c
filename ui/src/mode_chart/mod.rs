//! The modes of a satellite and the ways between them, from a plain table: the current one lit, the last ways marked.

mod layout;

use egui::{Painter, Pos2, Rect, Role, Sense, Shape, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, pos2, vec2};
use jiff::Timestamp;

use crate::fonts;
use crate::format;
use crate::theme::{self, Theme};

const HEIGHT: f32 = 28.0;

/// Room for the words about the last ways.
const FOOTER: f32 = 20.0;

/// How strongly the last ways are drawn, the newest first.
const STRENGTH: [f32; 3] = [1.0, 0.6, 0.35];

/// A way from one mode to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transition<'a> {
    /// Mode it leaves, as an index.
    pub from: usize,
    /// Mode it enters.
    pub to: usize,
    /// What makes it happen.
    pub name: &'a str,
}

/// What a chart shows.
#[derive(Debug, Clone, Copy)]
pub struct ModeChart<'a> {
    /// Names of the modes; the first is the one that all begins with.
    pub modes: &'a [&'a str],
    /// The ways between them.
    pub transitions: &'a [Transition<'a>],
    /// The mode it is in, as far as is known.
    pub current: Option<usize>,
    /// Since when.
    pub since: Option<Timestamp>,
    /// The last ways that were gone, newest first, as modes left and entered; three are marked.
    pub taken: &'a [(usize, usize, Timestamp)],
}

/// Draws the chart as wide as there is room, and tells which mode was clicked.
pub fn mode_chart_ui(ui: &mut Ui, chart: &ModeChart<'_>, height: f32, now: Timestamp) -> Option<usize> {
    let theme = Theme::current(ui);
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    let painter = ui.painter_at(rect);
    let below = if chart.taken.is_empty() { 0.0 } else { FOOTER };
    let places = places(ui, chart, Rect::from_min_max(rect.min, rect.max - vec2(0.0, below)));
    let mut clicked = None;
    let mut lit = None;
    for (mode, &place) in places.iter().enumerate() {
        let response = ui.interact(place, ui.scope_id().with(("mode", mode)), Sense::click());
        let is_current = chart.current == Some(mode);
        response.widget_info(|| {
            let current = if is_current { ", current" } else { "" };
            WidgetInfo::selected(
                Role::Button,
                true,
                is_current,
                format!("Mode {}{current}", chart.modes[mode]),
            )
        });
        if response.hovered() || response.has_focus() {
            lit = Some(mode);
        }
        if response.clicked() {
            clicked = Some(mode);
        }
        response.on_hover_text(ways_out(chart, mode));
    }
    for (index, way) in chart.transitions.iter().enumerate() {
        let is_first =
            chart.transitions[..index].iter().all(|other| (other.from, other.to) != (way.from, way.to));
        let is_marked = chart.taken.iter().take(3).any(|&(from, to, _)| (from, to) == (way.from, way.to));
        if is_first && !is_marked {
            let stroke = if lit == Some(way.from) {
                Stroke::new(1.5, theme.dim)
            } else {
                Stroke::new(1.0, theme.faint.gamma_multiply(0.7))
            };
            draw_way(&painter, &places, (way.from, way.to), stroke);
        }
    }
    // The newest last, so that it lies on top.
    for (age, &(from, to, _)) in chart.taken.iter().take(3).enumerate().rev() {
        let colour = theme.accent.gamma_multiply(STRENGTH[age]);
        draw_way(&painter, &places, (from, to), Stroke::new(2.0, colour));
    }
    for (mode, &place) in places.iter().enumerate() {
        draw_mode(&painter, theme, place, chart.modes[mode], chart.current == Some(mode), lit == Some(mode));
    }
    footer(&painter, theme, chart, rect, now);
    if let (Some(place), Some(since)) = (chart.current.and_then(|mode| places.get(mode)), chart.since) {
        let told = format!("for {}", format::age(now.duration_since(since)));
        let at = place.center_bottom() + vec2(0.0, 3.0);
        painter.text(at, egui::Align2::CENTER_TOP, told, fonts::text(11.0), theme.dim);
    }
    clicked
}

/// The last ways in words with their ages, each with a line as it is drawn above.
fn footer(painter: &Painter, theme: &Theme, chart: &ModeChart<'_>, rect: Rect, now: Timestamp) {
    let mut left = rect.left() + 4.0;
    let middle = rect.bottom() - 8.0;
    for (&(from, to, at), strength) in chart.taken.iter().zip(STRENGTH) {
        let name = |mode: usize| chart.modes.get(mode).copied().unwrap_or(format::UNKNOWN);
        let told = format!("{} → {}  {}", name(from), name(to), format::age(now.duration_since(at)));
        let galley = painter.layout_no_wrap(told, fonts::small(), theme.dim);
        if left + 20.0 + galley.size().x > rect.right() {
            break;
        }
        painter.hline(left..=left + 14.0, middle, Stroke::new(2.0, theme.accent.gamma_multiply(strength)));
        left += 20.0;
        let wide = galley.size().x;
        painter.galley(pos2(left, middle - galley.size().y / 2.0), galley, theme.dim);
        left += wide + 16.0;
    }
}

/// Where each mode stands.
fn places(ui: &Ui, chart: &ModeChart<'_>, rect: Rect) -> Vec<Rect> {
    let ways: Vec<(usize, usize)> = chart.transitions.iter().map(|way| (way.from, way.to)).collect();
    let columns = layout::columns(chart.modes.len(), &ways);
    let width = |mode: usize| {
        let font = fonts::text(theme::sizes().body);
        ui.painter().layout_no_wrap(chart.modes[mode].to_owned(), font, egui::Color32::WHITE).size().x + 24.0
    };
    let widths: Vec<f32> =
        columns.iter().map(|column| column.iter().map(|&mode| width(mode)).fold(0.0, f32::max)).collect();
    let gaps = (widths.len().max(2) - 1) as f32;
    let gap = ((rect.width() - 8.0 - widths.iter().sum::<f32>()) / gaps).clamp(12.0, 140.0);
    let all = widths.iter().sum::<f32>() + gap * (widths.len().saturating_sub(1)) as f32;
    let mut left = rect.center().x - all / 2.0;
    let mut places = vec![Rect::ZERO; chart.modes.len()];
    for (column, wide) in columns.iter().zip(&widths) {
        let room = rect.height() / column.len() as f32;
        for (row, &mode) in column.iter().enumerate() {
            let middle = pos2(left + wide / 2.0, rect.top() + (row as f32 + 0.5) * room);
            places[mode] = Rect::from_center_size(middle, vec2(*wide, HEIGHT));
        }
        left += wide + gap;
    }
    places
}

/// Beginning, middle and end of a curve from one mode to another; opposite ways bend apart.
fn way(places: &[Rect], (from, to): (usize, usize)) -> Option<[Pos2; 3]> {
    let (start, end) = (places.get(from)?, places.get(to)?);
    if from == to {
        let top = start.center_top();
        return Some([top - vec2(10.0, 0.0), top - vec2(0.0, 20.0), top + vec2(10.0, 0.0)]);
    }
    let between = end.center() - start.center();
    let length = between.length().max(1.0);
    let side = vec2(between.y, -between.x) / length;
    let bend = (14.0 + length * 0.08).min(48.0);
    let middle = start.center() + between / 2.0 + side * bend;
    Some([leave(*start, middle), middle, leave(*end, middle)])
}

/// The point on the edge of a box in the direction of another point.
fn leave(place: Rect, towards: Pos2) -> Pos2 {
    let way = towards - place.center();
    let half = place.size() / 2.0 + Vec2::splat(3.0);
    let part = (half.x / way.x.abs().max(0.01)).min(half.y / way.y.abs().max(0.01));
    place.center() + way * part.min(1.0)
}

fn draw_way(painter: &Painter, places: &[Rect], ends: (usize, usize), stroke: Stroke) {
    let Some([start, middle, end]) = way(places, ends) else { return };
    // A curve that goes through its middle.
    let control = middle + (middle - start.lerp(end, 0.5));
    let points = [start, control, end];
    painter.add(egui::epaint::QuadraticBezierShape::from_points_stroke(
        points,
        false,
        egui::Color32::TRANSPARENT,
        stroke,
    ));
    let way = (end - control).normalized();
    let side = vec2(-way.y, way.x) * 3.5;
    let base = end - way * 8.0;
    painter.add(Shape::convex_polygon(vec![end, base + side, base - side], stroke.color, Stroke::NONE));
}

fn draw_mode(painter: &Painter, theme: &Theme, place: Rect, name: &str, is_current: bool, is_lit: bool) {
    let (fill, edge, width) = if is_current {
        (theme.selection, theme.accent, 2.0)
    } else {
        (theme.raised, if is_lit { theme.text } else { theme.line }, 1.0)
    };
    painter.rect_filled(place, theme::space(), fill);
    painter.rect_stroke(place, theme::space(), Stroke::new(width, edge), StrokeKind::Inside);
    let colour = if is_current || is_lit { theme.text } else { theme.dim };
    let font = fonts::text(theme::sizes().body);
    painter.text(place.center(), egui::Align2::CENTER_CENTER, name, font, colour);
}

/// The ways that leave a mode, one a line.
fn ways_out(chart: &ModeChart<'_>, mode: usize) -> String {
    let mut lines = vec![chart.modes[mode].to_owned()];
    for way in chart.transitions.iter().filter(|way| way.from == mode) {
        let to = chart.modes.get(way.to).copied().unwrap_or(format::UNKNOWN);
        lines.push(format!("{} → {to}", way.name));
    }
    lines.join("\n")
}
