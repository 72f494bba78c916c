//! What was: by words, times, kinds.

mod item;

use api::client::Filter;
use api::{Page, Time};
use egui::{Align2, Role, Sense, WidgetInfo, vec2};
use ui::level::paint_shape;
use ui::{Theme, fonts};

use super::export::{Exports, folder, stamp};
use super::history::at;
use super::{Scene, blank};
use crate::link::Pending;
use item::{Item, Kind};

const ROW: f32 = 22.0;
const PAGE: u32 = 500;
/// Entries that are kept.
const ITEMS_MAX: usize = 50_000;
/// Pages that one search looks through by itself.
const PAGES_MAX: usize = 20;
/// So many rows are looked for before one scrolls.
const FIRST: usize = 60;
const HOUR_US: i64 = 3_600_000_000;
/// Times to choose from; 0: all.
const SPANS: [(&str, i64); 5] =
    [("1 h", HOUR_US), ("1 d", 24 * HOUR_US), ("7 d", 168 * HOUR_US), ("30 d", 720 * HOUR_US), ("all", 0)];

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    kind: Kind,
    text: String,
    span_us: i64,
    found: Found,
    exports: Exports,
}

#[derive(Default)]
struct Found {
    /// Kind, satellite, from when: what was asked.
    of: Option<(Kind, String, i64)>,
    items: Vec<Item>,
    pending: Option<Pending<Page<Item>>>,
    next: Option<u64>,
    pages: usize,
    begun: bool,
    failure: Option<String>,
    /// The items with the text, and how many items were looked at.
    shown: Vec<usize>,
    looked_at: usize,
    text: String,
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let Some(satellite) = scene.satellite().map(|satellite| satellite.satellite.clone()) else {
        return blank::show(ui, scene);
    };
    let mut state = std::mem::take(&mut scene.kept.search);
    let again = tools(ui, &mut state);
    let now_us = scene.now_us.unwrap_or(0);
    if again
        || state.found.of.as_ref().is_none_or(|(kind, of, span)| {
            (*kind, of.as_str(), *span) != (state.kind, satellite.as_str(), state.span_us)
        })
    {
        let of = Some((state.kind, satellite.clone(), state.span_us));
        state.found = Found { of, text: String::new(), ..Found::default() };
    }
    let found = &mut state.found;
    found.take();
    found.filter(&state.text.trim().to_lowercase());
    ui.horizontal_wrapped(|ui| {
        let more = if found.next.is_some() { "more to look through" } else { "that is all" };
        ui.weak(match found.pending.is_some() || !found.begun {
            true => format!("{} found, looking on", found.shown.len()),
            false => format!("{} found in {}, {more}", found.shown.len(), found.items.len()),
        });
        let stuck = found.pending.is_none() && found.next.is_some() && found.pages >= PAGES_MAX;
        if stuck && ui.button("Look further").clicked() {
            found.pages = 0;
        }
        for (words, ending) in [("Export CSV", "csv"), ("Export NDJSON", "ndjson")] {
            let button = egui::Button::new(words);
            if ui.add_enabled(!state.exports.is_busy() && !found.shown.is_empty(), button).clicked() {
                let items: Vec<Item> = found.shown.iter().map(|index| found.items[*index].clone()).collect();
                let kind = state.kind.name().to_lowercase();
                let name = format!("{kind}-{}.{ending}", stamp(scene.now_us));
                let place = scene.desk.plots.folder.as_deref();
                state.exports.save(place, &name, scene.courier, move || {
                    Ok(if ending == "csv" { item::csv(&items) } else { item::ndjson(&items) })
                });
            }
        }
        folder(ui, scene);
        state.exports.show(ui);
    });
    if let Some(why) = &found.failure {
        ui.label(why);
    }
    let mut opened = None;
    let mut last = 0;
    let spacing = std::mem::replace(&mut ui.spacing_mut().item_spacing.y, 0.0);
    let opened_frame = scene.kept.opened_frame;
    let rows = found.shown.len();
    egui::ScrollArea::vertical().auto_shrink([false, false]).show_rows(ui, ROW, rows, |ui, range| {
        last = range.end;
        for index in &found.shown[range] {
            let item = &found.items[*index];
            let is_open = item.frame().is_some() && item.frame() == opened_frame;
            if row(ui, item, is_open) {
                opened = Some((item.frame(), item.image(), item.at_us()));
            }
        }
    });
    ui.spacing_mut().item_spacing.y = spacing;
    let wanted = (last + FIRST).max(FIRST);
    if found.shown.len() < wanted && found.may_ask() {
        found.ask(scene, now_us);
    }
    if let Some((frame, image, at_us)) = opened {
        if let Some(frame) = frame {
            scene.kept.open_frame(frame);
        }
        if let Some(image) = image {
            scene.kept.album.choose(image);
        }
        scene.kept.point_at = Some(at_us);
    }
    scene.kept.search = state;
}

/// Returns whether to search anew.
fn tools(ui: &mut egui::Ui, state: &mut State) -> bool {
    let mut again = false;
    ui.horizontal_wrapped(|ui| {
        for kind in Kind::ALL {
            let chosen = state.kind == kind;
            let button = ui.selectable_label(chosen, kind.name());
            button.widget_info(|| {
                WidgetInfo::selected(
                    Role::Button,
                    true,
                    chosen,
                    format!("Search {}", kind.name().to_lowercase()),
                )
            });
            if button.clicked() {
                state.kind = kind;
            }
        }
        ui.separator();
        for (words, span_us) in SPANS {
            let chosen = state.span_us == span_us;
            let button = ui.selectable_label(chosen, words);
            button
                .widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, format!("Within {words}")));
            if button.clicked() {
                state.span_us = span_us;
            }
        }
        again = ui.button("Search anew").clicked();
    });
    let edit = egui::TextEdit::singleline(&mut state.text)
        .hint_text("Words, or hex digits of frames")
        .desired_width(f32::INFINITY);
    ui.add(edit).widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Search the archive"));
    again
}

impl Found {
    fn take(&mut self) {
        let Some(answer) = self.pending.as_ref().and_then(Pending::take) else { return };
        self.pending = None;
        match answer {
            Ok(page) => {
                self.failure = None;
                self.next = page.next.filter(|_| !page.items.is_empty());
                self.items.extend(page.items);
            }
            Err(error) => {
                self.next = None;
                self.failure = Some(error.to_string());
            }
        }
    }

    /// Looks through what is new; through all when the text is another.
    fn filter(&mut self, text: &str) {
        if self.text != text {
            self.text = text.to_owned();
            self.shown.clear();
            self.looked_at = 0;
            self.pages = 0;
        }
        for index in self.looked_at..self.items.len() {
            if text.is_empty() || self.items[index].has(text) {
                self.shown.push(index);
            }
        }
        self.looked_at = self.items.len();
    }

    fn may_ask(&self) -> bool {
        self.pending.is_none()
            && (!self.begun || self.next.is_some())
            && self.pages < PAGES_MAX
            && self.items.len() < ITEMS_MAX
    }

    fn ask(&mut self, scene: &Scene<'_>, now_us: i64) {
        let Some((kind, satellite, span_us)) = &self.of else { return };
        let mut filter = Filter::new().satellite(satellite).limit(PAGE);
        if *span_us > 0 {
            filter = filter.start(Time::from_unix_us(now_us - span_us));
        }
        if let Some(next) = self.next {
            filter = filter.before(i64::try_from(next).unwrap_or(i64::MAX));
        }
        let kind = *kind;
        self.pending = Some(scene.courier.ask(move |client| kind.page(client, filter)));
        self.pages += 1;
        self.begun = true;
    }
}

fn row(ui: &mut egui::Ui, item: &Item, is_open: bool) -> bool {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let at = ui::format::utc(at(item.at_us()));
    let words = item.words();
    response.widget_info(|| {
        WidgetInfo::selected(Role::Button, true, is_open, format!("{} {at} {words}", item.kind()))
    });
    if ui.is_rect_visible(rect) {
        let painter = ui.painter_at(rect);
        if is_open {
            painter.rect_filled(rect, 4.0, theme.selection);
        } else if response.hovered() || response.has_focus() {
            painter.rect_filled(rect, 4.0, theme.raised);
        }
        let middle = rect.left_center();
        let (date, time) = at.split_once('T').unwrap_or(("", &at));
        let figures = fonts::small_figures();
        let drawn =
            painter.text(middle + vec2(4.0, 0.0), Align2::LEFT_CENTER, date, figures.clone(), theme.faint);
        let x = drawn.right() + 6.0;
        let drawn = painter.text(egui::pos2(x, middle.y), Align2::LEFT_CENTER, time, figures, theme.dim);
        let mut x = drawn.right() + 10.0;
        if let Some(level) = item.level() {
            paint_shape(&painter, egui::pos2(x + 6.0, middle.y), 12.0, level, level.colour(theme));
        }
        x += 18.0;
        painter.text(egui::pos2(x, middle.y), Align2::LEFT_CENTER, item.kind(), fonts::small(), theme.dim);
        let x = x + 104.0;
        painter.text(egui::pos2(x, middle.y), Align2::LEFT_CENTER, &words, fonts::body(), theme.text);
    }
    response.on_hover_text(words).clicked()
}
