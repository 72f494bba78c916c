//! What was and what comes, from days to seconds: passes, plans, contacts, commands, alarms. Wheel zooms at the pointer,
//! dragging moves; a plan can be dropped on a pass. What was clicked or dropped is returned, never done here.

use std::sync::Arc;

use egui::{
    Align2, Color32, CornerRadius, Painter, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo,
    pos2, vec2,
};
use jiff::Timestamp;

use crate::labels::{self, Labels};
use crate::lane::{Cluster, Item, Kind, Lane, seconds};
use crate::level::{Level, paint_shape};
use crate::theme::Theme;
use crate::time_axis::Axis;
use crate::{fonts, format};

/// What is dragged onto an item: a plan, by its id. Whoever lists plans outside the timeline drags one of these, too
/// (`ui.dnd_drag_source(id, Dragged(..), ..)`).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dragged(pub String);

/// One item of a timeline.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ItemRef {
    /// The lane's index.
    pub lane: usize,
    /// The item's id.
    pub id: String,
}

/// What hands did in this frame.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Touched {
    /// An item was clicked.
    pub clicked: Option<ItemRef>,
    /// The pointer rests on one.
    pub hovered: Option<ItemRef>,
    /// A plan (by its id) was dropped on one.
    pub dropped: Option<(String, ItemRef)>,
}

/// What a timeline keeps between frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Timeline {
    /// At the left edge, seconds since 1970; nothing until it is first shown.
    pub start_s: Option<f64>,
    /// From edge to edge, seconds.
    pub span_s: f64,
    /// Moves along with time until a hand moves it; Home begins it again.
    pub follows_now: bool,
    /// The chosen item.
    pub selected: Option<ItemRef>,
}

impl Default for Timeline {
    fn default() -> Self {
        Self { start_s: None, span_s: 86_400.0, follows_now: true, selected: None }
    }
}

const LANE: f32 = 30.0;
const HEAD: f32 = 36.0;
const NAMES: f32 = 104.0;
const SPAN_MIN_S: f64 = 5.0;
const SPAN_MAX_S: f64 = 400.0 * 86_400.0;
/// More items than this are drawn but cannot be reached by the keyboard; zooming in reaches them.
const REACHED: usize = 300;

impl Timeline {
    /// One that begins at a time and shows so many seconds.
    #[must_use]
    pub fn from(start: Timestamp, span_s: f64) -> Self {
        Self { start_s: Some(seconds(start)), span_s, follows_now: false, selected: None }
    }

    /// Draws the lanes one below the other.
    pub fn show(&mut self, ui: &mut Ui, lanes: &[Lane], now: Timestamp) -> Touched {
        let theme = Theme::current(ui);
        let height = HEAD + LANE * lanes.len() as f32;
        let size = vec2(ui.available_width().max(NAMES + 40.0), height);
        let (response, painter) = ui.allocate_painter(size, Sense::click_and_drag());
        let rect = response.rect;
        let body = Rect::from_min_max(pos2(rect.left() + NAMES, rect.top() + HEAD), rect.max);
        let axis = self.hands(ui, &response, body, now);
        response.widget_info(|| WidgetInfo::labeled(Role::Grid, true, self.told(lanes.len())));
        let mut touched = Touched::default();
        if !ui.is_rect_visible(rect) {
            return touched;
        }
        painter.rect_filled(body, 0.0, theme.ground);
        let head = Rect::from_min_max(pos2(body.left(), rect.top()), pos2(rect.right(), body.top()));
        let inner = painter.with_clip_rect(painter.clip_rect().intersect(head.union(body)));
        let plate = now_plate(&inner, &axis, head, body, now);
        axis.paint(&inner, head, body, plate, theme);
        let mut reached = 0;
        for (index, lane) in lanes.iter().enumerate() {
            let top = body.top() + LANE * index as f32;
            let row = Rect::from_min_max(pos2(body.left(), top), pos2(body.right(), top + LANE));
            painter.hline(rect.x_range(), row.bottom(), Stroke::new(1.0, theme.line));
            let name = pos2(rect.left() + 4.0, row.center().y);
            painter.text(name, Align2::LEFT_CENTER, lane.name(), fonts::body(), theme.dim);
            let mut labels = Labels::new();
            let mut named = Vec::new();
            let pen =
                Pen { painter: inner.with_clip_rect(inner.clip_rect().intersect(row)), theme, axis, row };
            lane.in_view(axis.start_s, axis.end_s(), axis.seconds_a_point() * 3.0, |cluster| {
                let place = pen.place(lane, cluster);
                let Some(item) = lane.items().get(cluster.first) else { return };
                if cluster.count > 1 {
                    pen.cluster(cluster, place);
                    labels.keep_off(place);
                    return;
                }
                let here = ItemRef { lane: index, id: item.id.clone() };
                let is_selected = self.selected.as_ref() == Some(&here);
                named.push((item, pen.item(item, place, is_selected, seconds(now), &mut labels)));
                reached += 1;
                if reached <= REACHED {
                    self.touch(
                        ui,
                        item,
                        lane,
                        place.expand2(vec2(2.0, 4.0)).intersect(row),
                        here,
                        &mut touched,
                    );
                }
            });
            if plate.is_some() {
                let x = axis.x(seconds(now));
                labels.keep_off(Rect::from_min_max(pos2(x - 1.0, row.top()), pos2(x + 1.0, row.bottom())));
            }
            // Once all items of the row are there, so that no label lies on a later one
            for (item, (place, ink)) in named {
                pen.label(item, place, ink, &mut labels);
            }
        }
        if let Some(plate) = plate {
            now_line(&inner, &axis, body, now, plate, theme);
        }
        crate::lamps::focus_ring(ui, rect, &response);
        touched
    }

    fn told(&self, lanes: usize) -> String {
        let start = self.start_s.map_or(format::UNKNOWN.into(), utc_of);
        format!("Timeline of {lanes} rows from {start}")
    }

    /// What mouse and keyboard do to the view; returns the axis to draw.
    fn hands(&mut self, ui: &Ui, response: &Response, body: Rect, now: Timestamp) -> Axis {
        let now_s = seconds(now);
        self.span_s =
            if self.span_s.is_finite() { self.span_s.clamp(SPAN_MIN_S, SPAN_MAX_S) } else { 86_400.0 };
        if self.follows_now || self.start_s.is_none() {
            self.start_s = Some(now_s - 0.2 * self.span_s);
        }
        let axis = |this: &Self| Axis {
            start_s: this.start_s.unwrap_or(now_s),
            span_s: this.span_s,
            left: body.left(),
            right: body.right(),
        };
        if response.dragged() {
            self.pan(-f64::from(response.drag_delta().x) * axis(self).seconds_a_point());
        }
        if let Some(pointer) = response.hover_pos() {
            let (zoom, scroll) = ui.input(|input| (input.zoom_delta(), input.smooth_scroll_delta()));
            let factor = f64::from(zoom) * f64::from(scroll.y / 200.0).exp();
            if (factor - 1.0).abs() > 1e-4 {
                self.zoom(factor, axis(self).at_s(pointer.x.max(body.left())));
            }
            if scroll.x.abs() > 0.0 {
                self.pan(-f64::from(scroll.x) * axis(self).seconds_a_point());
            }
        }
        if response.has_focus() {
            ui.memory_mut(|memory| {
                let keys = egui::EventFilter { horizontal_arrows: true, ..Default::default() };
                memory.set_focus_lock_filter(response.id, keys);
            });
            let key = |key| ui.input(|input| input.key_pressed(key));
            let step = i8::from(key(egui::Key::ArrowRight)) - i8::from(key(egui::Key::ArrowLeft));
            if step != 0 {
                self.pan(f64::from(step) * self.span_s / 8.0);
            }
            let middle_s = axis(self).start_s + self.span_s / 2.0;
            if key(egui::Key::Plus) || key(egui::Key::Equals) {
                self.zoom(1.5, middle_s);
            }
            if key(egui::Key::Minus) {
                self.zoom(1.0 / 1.5, middle_s);
            }
            self.follows_now |= key(egui::Key::Home);
        }
        if response.double_clicked() {
            self.follows_now = true;
        }
        axis(self)
    }

    fn pan(&mut self, by_s: f64) {
        // Some thousand years to each side: a time that can still be written
        self.start_s = self.start_s.map(|start_s| (start_s + by_s).clamp(-3e10, 2e11));
        self.follows_now = false;
    }

    fn zoom(&mut self, factor: f64, around_s: f64) {
        let span_s = (self.span_s / factor).clamp(SPAN_MIN_S, SPAN_MAX_S);
        let ratio = span_s / self.span_s;
        // While it follows, now keeps its place; else what is under the pointer does
        self.start_s = self.start_s.map(|start_s| around_s - (around_s - start_s) * ratio);
        self.span_s = span_s;
    }

    fn touch(
        &mut self,
        ui: &Ui,
        item: &Item,
        lane: &Lane,
        place: Rect,
        here: ItemRef,
        touched: &mut Touched,
    ) {
        let sense = if item.can_be_dragged { Sense::click_and_drag() } else { Sense::click() };
        let id = ui.scope_id().with(("timeline", here.lane, &item.id));
        let response = ui.interact(place, id, sense);
        let is_selected = self.selected.as_ref() == Some(&here);
        response.widget_info(|| {
            WidgetInfo::selected(Role::Button, true, is_selected, format!("{} {}", lane.name(), item.label))
        });
        if item.can_be_dragged {
            response.dnd_set_drag_payload(Dragged(item.id.clone()));
        }
        if lane.takes_drops() {
            let theme = Theme::current(ui);
            if response.dnd_hover_payload::<Dragged>().is_some() {
                ui.painter().rect_stroke(place, 4.0, Stroke::new(2.0, theme.accent), StrokeKind::Inside);
            }
            if let Some(plan) = response.dnd_release_payload::<Dragged>() {
                touched.dropped = Some((Arc::unwrap_or_clone(plan).0, here.clone()));
            }
        }
        if response.clicked() {
            touched.clicked = Some(here.clone());
            self.selected = Some(here.clone());
        }
        if response.hovered() {
            touched.hovered = Some(here);
        }
        crate::lamps::focus_ring(ui, place, &response);
        response.on_hover_ui(|ui| hover(ui, item));
    }
}

/// Where the time of now is written, when it is in view.
fn now_plate(painter: &Painter, axis: &Axis, head: Rect, body: Rect, now: Timestamp) -> Option<Rect> {
    let now_s = seconds(now);
    if now_s < axis.start_s || now_s > axis.end_s() {
        return None;
    }
    let size = labels::size(painter, &format::time(now), &fonts::small_figures()) + vec2(8.0, 2.0);
    let (least, most) = (body.left() + size.x / 2.0, body.right() - size.x / 2.0);
    let middle = axis.x(now_s).clamp(least, most.max(least));
    Some(Rect::from_center_size(pos2(middle, head.bottom() - 9.0), size))
}

fn now_line(painter: &Painter, axis: &Axis, body: Rect, now: Timestamp, plate: Rect, theme: &Theme) {
    let x = painter.round_to_pixel_center(axis.x(seconds(now)));
    painter.vline(x, body.y_range(), Stroke::new(1.5, theme.accent));
    painter.rect_filled(plate, 3.0, theme.accent);
    let face = fonts::small_figures();
    painter.text(plate.center(), Align2::CENTER_CENTER, format::time(now), face, theme.ground);
}

fn utc_of(at_s: f64) -> String {
    Timestamp::from_second(at_s as i64).map_or(format::UNKNOWN.into(), format::utc)
}

fn hover(ui: &mut Ui, item: &Item) {
    let theme = Theme::current(ui);
    ui.label(&item.label);
    if !item.hover.is_empty() {
        ui.label(egui::RichText::new(&item.hover).color(theme.dim));
    }
    let length = item.end.duration_since(item.start);
    let times = if length.is_zero() {
        format::utc(item.start)
    } else {
        format!("{} to {}, {}", format::utc(item.start), format::time(item.end), format::length(length))
    };
    ui.label(egui::RichText::new(times).color(theme.dim).monospace().size(12.0));
    if let Some(why) = &item.conflict {
        ui.label(egui::RichText::new(format!("Conflict: {why}")).color(theme.critical));
    }
}

/// What draws the items of one row.
struct Pen<'a> {
    painter: Painter,
    theme: &'a Theme,
    axis: Axis,
    row: Rect,
}

impl Pen<'_> {
    fn place(&self, lane: &Lane, cluster: Cluster) -> Rect {
        let left =
            lane.items().get(cluster.first).map_or(self.row.left(), |item| self.axis.x(seconds(item.start)));
        let right = self.axis.x(cluster.end_s).max(left + 3.0);
        Rect::from_min_max(pos2(left, self.row.top() + 5.0), pos2(right, self.row.bottom() - 5.0))
    }

    fn cluster(&self, cluster: Cluster, place: Rect) {
        let colour = cluster.worst.map_or(self.theme.dim, |level| level.colour(self.theme));
        self.painter.rect_filled(place, 1.0, colour.gamma_multiply(0.8));
        if cluster.has_conflict {
            self.hatch(place);
        }
    }

    fn item(
        &self,
        item: &Item,
        place: Rect,
        is_selected: bool,
        now_s: f64,
        labels: &mut Labels,
    ) -> (Rect, Color32) {
        let (theme, painter) = (self.theme, &self.painter);
        let is_past = seconds(item.end) < now_s;
        let round = CornerRadius::same(3);
        let main = if is_past { theme.faint } else { theme.accent };
        let mut ink = theme.text;
        let mut label_place = place;
        match item.kind {
            Kind::Pass { quality } => {
                let quality = if quality.is_finite() { quality.clamp(0.0, 1.0) } else { 0.0 };
                let top = place.bottom() - place.height() * (0.25 + 0.75 * quality);
                painter.rect_filled(place, round, main.gamma_multiply(0.15));
                let bar = Rect::from_min_max(pos2(place.left(), top), place.max);
                painter.rect_filled(bar, round, main.gamma_multiply(0.3 + 0.3 * quality));
            }
            Kind::Plan => {
                painter.rect(place, round, theme.raised, Stroke::new(1.0, main), StrokeKind::Inside);
            }
            Kind::Run => {
                painter.rect_filled(place, round, if is_past { theme.raised } else { theme.selection });
                painter.rect_stroke(place, round, Stroke::new(1.0, main), StrokeKind::Inside);
            }
            Kind::Contact => {
                let bar = Rect::from_center_size(place.center(), vec2(place.width(), 8.0));
                painter.rect_filled(bar, 2.0, theme.dim);
                ink = theme.dim;
                label_place = Rect::from_min_size(bar.right_top(), vec2(0.0, 8.0));
            }
            Kind::Command => {
                let at = pos2(place.left(), place.center().y);
                painter.vline(at.x, place.y_range(), Stroke::new(1.5, main));
                painter.circle_filled(pos2(at.x, place.top() + 3.0), 3.0, main);
                ink = theme.dim;
                label_place = Rect::from_min_size(pos2(at.x, place.top()), vec2(4.0, place.height()));
            }
            Kind::Alarm(level) => {
                self.alarm(level, place);
                label_place = Rect::from_min_max(
                    place.min,
                    pos2(place.right().max(place.left() + 14.0), place.bottom()),
                );
            }
        }
        if item.conflict.is_some() {
            self.hatch(place);
        }
        if is_selected {
            painter.rect_stroke(place.expand(2.0), 4.0, Stroke::new(2.0, theme.text), StrokeKind::Inside);
        }
        labels.keep_off(place.intersect(self.row));
        (label_place, ink)
    }

    fn alarm(&self, level: Level, place: Rect) {
        let colour = level.colour(self.theme);
        let bar = Rect::from_min_max(pos2(place.left(), place.bottom() - 3.0), place.max);
        self.painter.rect_filled(bar, 1.0, colour);
        paint_shape(&self.painter, pos2(place.left() + 6.0, place.center().y - 2.0), 12.0, level, colour);
    }

    fn hatch(&self, place: Rect) {
        let painter = self.painter.with_clip_rect(self.painter.clip_rect().intersect(place));
        let stroke = Stroke::new(1.0, self.theme.critical);
        let seen = place.intersect(self.row);
        let mut x = seen.left() - seen.height();
        while x < seen.right() {
            painter.line_segment([pos2(x, seen.bottom()), pos2(x + seen.height(), seen.top())], stroke);
            x += 6.0;
        }
        self.painter.rect_stroke(place, 3.0, Stroke::new(1.5, self.theme.critical), StrokeKind::Inside);
    }

    /// Inside the item where it fits there, else to the right of it where nothing lies; else not at all.
    fn label(&self, item: &Item, place: Rect, ink: Color32, labels: &mut Labels) {
        if item.label.is_empty() {
            return;
        }
        let face = fonts::small();
        let size = labels::size(&self.painter, &item.label, &face);
        let seen = place.intersect(self.row);
        let is_alarm = matches!(item.kind, Kind::Alarm(_));
        let indent = if is_alarm { 16.0 } else { 5.0 };
        let mut places = Vec::new();
        let has_plate = item.conflict.is_none();
        if seen.width() >= size.x + indent + 4.0 && has_plate {
            places.push(vec2(seen.left() + indent + size.x / 2.0, seen.center().y));
        } else if !is_alarm || seen.width() < size.x {
            places.push(vec2(seen.right().max(seen.left()) + 4.0 + size.x / 2.0, seen.center().y));
        }
        // What lies inside its own item may lie there
        if let Some(inside) = places.first().filter(|at| at.x + size.x / 2.0 <= seen.right()) {
            let galley = self.painter.layout_no_wrap(item.label.clone(), face, ink);
            self.painter.galley(pos2(inside.x - size.x / 2.0, inside.y - size.y / 2.0), galley, ink);
        } else {
            labels.write(&self.painter, self.row, pos2(0.0, 0.0), &places, &item.label, face, ink);
        }
    }
}
