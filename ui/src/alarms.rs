//! The list of alarms: level by shape, bars, colour and word; what can be done is returned, never done here.

use std::cmp::Ordering;

use egui::{Align2, Button, Rect, Response, Role, ScrollArea, Sense, Ui, UiBuilder, WidgetInfo, pos2, vec2};
use jiff::Timestamp;

use crate::level::{Level, paint_bars, paint_shape};
use crate::theme::Theme;
use crate::{fonts, format};

/// Where an alarm stands (ISA-18.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum State {
    /// It holds, and nobody has taken it up.
    New,
    /// It has gone away by itself, and nobody had seen it.
    Returned,
    /// It holds, and somebody has taken it up.
    Acknowledged,
    /// Put away for a time.
    Shelved,
    /// It is over.
    Cleared,
}

impl State {
    /// Its word.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::New => "new",
            Self::Returned => "returned",
            Self::Acknowledged => "acknowledged",
            Self::Shelved => "shelved",
            Self::Cleared => "cleared",
        }
    }
}

/// One alarm.
#[derive(Debug, Clone, PartialEq)]
pub struct Alarm {
    /// By which its owner knows it.
    pub id: String,
    /// How much it matters.
    pub level: Level,
    /// What it is about: a value, a link, the disk.
    pub name: String,
    /// What happened, in one line.
    pub text: String,
    /// Since when.
    pub since: Timestamp,
    /// Where it stands.
    pub state: State,
    /// Who has acknowledged it, shelved it or takes care of it.
    pub person: Option<String>,
}

/// What the operator asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deed {
    /// The row was clicked.
    Select,
    /// Take it up with name and note.
    Acknowledge,
    /// Put it away for a time.
    Shelve,
    /// Give it to somebody.
    Assign,
}

/// By what the rows are ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// The worst first, and of those the newest.
    #[default]
    Level,
    /// The newest first.
    Newest,
    /// By name.
    Name,
    /// What waits for a hand first.
    State,
}

/// What the list keeps between frames.
#[derive(Debug, Clone, Default)]
pub struct AlarmList {
    /// By what the rows are ordered.
    pub order: Order,
    /// The other way round.
    pub reversed: bool,
    /// The chosen alarm's id.
    pub selected: Option<String>,
    sorted: Vec<usize>,
    sorted_for: Option<(u64, Order, bool, usize)>,
}

const ROW: f32 = 36.0;
const COLUMNS: [(&str, Order, f32); 4] = [
    ("Level", Order::Level, 116.0),
    ("Age", Order::Newest, 72.0),
    ("Name", Order::Name, 180.0),
    ("State", Order::State, 0.0),
];

impl AlarmList {
    /// Shows the alarms; only the rows in view are looked at. `revision` changes whenever `alarms` does: the order is
    /// made anew then and not before. Returns the alarm (by index) and what is to be done with it.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        alarms: &[Alarm],
        revision: u64,
        now: Timestamp,
    ) -> Option<(usize, Deed)> {
        self.sort(alarms, revision);
        self.header(ui);
        if alarms.is_empty() {
            let theme = Theme::current(ui);
            ui.add_space(8.0);
            ui.label(egui::RichText::new("No alarm.").color(theme.dim));
            return None;
        }
        let mut asked = None;
        ui.spacing_mut().item_spacing.y = 0.0;
        ScrollArea::vertical().auto_shrink([false, true]).show_rows(ui, ROW, alarms.len(), |ui, rows| {
            for row in rows {
                let Some((index, alarm)) =
                    self.sorted.get(row).and_then(|&index| Some((index, alarms.get(index)?)))
                else {
                    continue;
                };
                let is_selected = self.selected.as_deref() == Some(&alarm.id);
                if let Some(deed) = alarm_row(ui, alarm, is_selected, now) {
                    asked = Some((index, deed));
                    self.selected = Some(alarm.id.clone());
                }
            }
        });
        asked
    }

    fn sort(&mut self, alarms: &[Alarm], revision: u64) {
        let wanted = (revision, self.order, self.reversed, alarms.len());
        if self.sorted_for == Some(wanted) {
            return;
        }
        self.sorted_for = Some(wanted);
        let (order, reversed) = (self.order, self.reversed);
        self.sorted = (0..alarms.len()).collect();
        self.sorted.sort_by(|&a, &b| match (alarms.get(a), alarms.get(b)) {
            (Some(a), Some(b)) => {
                let by = compare(a, b, order);
                if reversed { by.reverse() } else { by }
            }
            _ => Ordering::Equal,
        });
    }

    fn header(&mut self, ui: &mut Ui) {
        let theme = Theme::current(ui);
        let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 24.0), Sense::hover());
        let mut x = rect.left();
        for (title, order, wide) in COLUMNS {
            // What has no width of its own stands at the right end, as the words below it do
            let (left, wide) = if wide > 0.0 { (x, wide) } else { (rect.right() - 54.0, 54.0) };
            let cell = Rect::from_min_size(pos2(left, rect.top()), vec2(wide, rect.height()));
            let response = ui.interact(cell, ui.scope_id().with(("alarm order", title)), Sense::click());
            if response.clicked() {
                self.reversed = self.order == order && !self.reversed;
                self.order = order;
            }
            let is_order = self.order == order;
            let colour = if is_order || response.hovered() { theme.text } else { theme.dim };
            let written = ui.painter().text(
                cell.left_center() + vec2(4.0, 0.0),
                Align2::LEFT_CENTER,
                title,
                fonts::small(),
                colour,
            );
            if is_order {
                paint_direction(
                    ui,
                    pos2(written.right() + 8.0, cell.center().y),
                    self.reversed,
                    theme.accent,
                );
            }
            crate::lamps::focus_ring(ui, cell.shrink(2.0), &response);
            response.widget_info(|| {
                WidgetInfo::selected(
                    Role::Button,
                    true,
                    is_order,
                    format!("Order by {}", title.to_lowercase()),
                )
            });
            x += wide;
        }
        ui.painter().hline(rect.x_range(), rect.bottom(), egui::Stroke::new(1.0, theme.line));
    }
}

fn paint_direction(ui: &Ui, at: egui::Pos2, reversed: bool, colour: egui::Color32) {
    let turn = if reversed { -1.0 } else { 1.0 };
    let corners = vec![at + vec2(-4.0, -2.0 * turn), at + vec2(4.0, -2.0 * turn), at + vec2(0.0, 3.0 * turn)];
    ui.painter().add(egui::Shape::convex_polygon(corners, colour, egui::Stroke::NONE));
}

fn compare(a: &Alarm, b: &Alarm, order: Order) -> Ordering {
    let newest = || b.since.cmp(&a.since).then_with(|| a.id.cmp(&b.id));
    match order {
        Order::Level => b.level.cmp(&a.level).then_with(newest),
        Order::Newest => newest(),
        Order::Name => a.name.cmp(&b.name).then_with(newest),
        Order::State => a.state.cmp(&b.state).then(b.level.cmp(&a.level)).then_with(newest),
    }
}

fn alarm_row(ui: &mut Ui, alarm: &Alarm, is_selected: bool, now: Timestamp) -> Option<Deed> {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let waits = matches!(alarm.state, State::New | State::Returned);
    paint_row(ui, rect, &response, alarm, is_selected, now);
    let mut deed = response.clicked().then_some(Deed::Select);
    let told = format!("{} {}: {}, {}", alarm.level.word(), alarm.name, alarm.text, alarm.state.word());
    response.widget_info(|| WidgetInfo::selected(Role::ListItem, true, is_selected, &told));
    response.clone().on_hover_ui(|ui| {
        ui.label(format!("{}: {}", alarm.name, alarm.text));
        let by = alarm.person.as_ref().map_or(String::new(), |person| format!(" by {person}"));
        ui.label(
            egui::RichText::new(format!("{}{by}, since {}", alarm.state.word(), format::utc(alarm.since)))
                .color(theme.dim),
        );
    });
    // Each button has its own place, so that none slides under a pointer that was on its way to another. They show where
    // the pointer or the choice is; elsewhere the list stays calm
    let all = is_selected || response.contains_pointer();
    for (text, wanted, shown, right, wide) in [
        ("Ack", Deed::Acknowledge, waits, 4.0, 40.0),
        ("Shelve", Deed::Shelve, all, 48.0, 54.0),
        ("Assign", Deed::Assign, all, 106.0, 54.0),
    ] {
        if shown {
            let place = Rect::from_min_max(
                pos2(rect.right() - right - wide, rect.top() + 6.0),
                pos2(rect.right() - right, rect.bottom() - 6.0),
            );
            let button = Button::new(egui::RichText::new(text).size(12.0));
            let mut child = ui.new_child(UiBuilder::new().id_salt((&alarm.id, text)).max_rect(place));
            let button = child.put(place, button);
            button.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("{text} {}", alarm.name)));
            if button.clicked() {
                deed = Some(wanted);
            }
        }
    }
    deed
}

fn paint_row(ui: &Ui, rect: Rect, response: &Response, alarm: &Alarm, is_selected: bool, now: Timestamp) {
    if !ui.is_rect_visible(rect) {
        return;
    }
    let theme = Theme::current(ui);
    let painter = ui.painter();
    if is_selected {
        painter.rect_filled(rect, 4.0, theme.selection);
    } else if response.contains_pointer() {
        painter.rect_filled(rect, 4.0, theme.raised);
    }
    crate::lamps::focus_ring(ui, rect.shrink(2.0), response);
    let waits = matches!(alarm.state, State::New | State::Returned);
    let ink = if waits { theme.text } else { theme.dim };
    let colour = alarm.level.colour(theme);
    let middle = rect.left_center();
    paint_shape(painter, middle + vec2(12.0, 0.0), 14.0, alarm.level, colour);
    paint_bars(painter, middle + vec2(24.0, 0.0), 12.0, alarm.level, colour, theme.line);
    let mut x = rect.left() + 54.0;
    painter.text(pos2(x, middle.y), Align2::LEFT_CENTER, alarm.level.word(), fonts::small(), ink);
    x = rect.left() + COLUMNS[0].2 + 4.0;
    let age = format::age(now.duration_since(alarm.since));
    painter.text(pos2(x, middle.y), Align2::LEFT_CENTER, age, fonts::small_figures(), theme.dim);
    x = rect.left() + COLUMNS[0].2 + COLUMNS[1].2 + 4.0;
    // Name above, what happened below; both end before the buttons
    let wide = (rect.right() - 168.0 - x).max(40.0);
    let line = |text: &str, face, colour, y| {
        let mut job = egui::text::LayoutJob::simple_singleline(text.to_owned(), face, colour);
        job.wrap = egui::text::TextWrapping::truncate_at_width(wide);
        let galley = painter.layout_job(job);
        painter.galley(pos2(x, y - galley.size().y / 2.0), galley, colour);
    };
    line(&alarm.name, fonts::body(), ink, middle.y - 8.0);
    line(&alarm.text, fonts::small(), theme.dim, middle.y + 9.0);
    if !waits && !is_selected && !response.contains_pointer() {
        let by = alarm.person.as_ref().map_or(String::new(), |person| format!(" by {person}"));
        let said = format!("{}{by}", alarm.state.word());
        painter.text(
            rect.right_center() - vec2(8.0, 0.0),
            Align2::RIGHT_CENTER,
            said,
            fonts::small(),
            theme.dim,
        );
    }
}
