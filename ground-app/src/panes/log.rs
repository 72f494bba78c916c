//! Frames and events, newest first. Rows are made when something came, not in each frame; only those on the screen are
//! drawn.

use api::{EventView, FrameView};
use egui::{RichText, ScrollArea, Sense, TextEdit, Ui};
use jiff::Timestamp;
use ui::level::paint_shape;
use ui::{Level, Theme, fonts, format};

use super::{Pane, Scene, blank};
use crate::model::Model;

/// Rows at most.
const ROWS_MAX: usize = 2500;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    filter: String,
    frames_only: bool,
    rows: Vec<EventView>,
    made_for: Option<(u64, i64, usize, String, bool)>,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    if scene.model.events.value().is_none() && scene.model.live_events.is_empty() {
        return blank::show(ui, scene);
    }
    let mut state = std::mem::take(&mut scene.kept.log);
    ui.horizontal(|ui| {
        let field =
            TextEdit::singleline(&mut state.filter).hint_text("Words, kind, level").desired_width(180.0);
        ui.add(field).accessible_name("Filter frames and events");
        ui.checkbox(&mut state.frames_only, "Only frames");
        let word = if scene.kept.paused { "Go on" } else { "Hold still" };
        if ui.button(word).on_hover_text("Space does the same. Nothing is lost meanwhile").clicked() {
            scene.kept.paused = !scene.kept.paused;
        }
        ui.weak(format!("{} rows", state.rows.len()));
    });
    derive(&mut state, scene.model, scene.kept.paused);
    let height = 20.0;
    let area = ScrollArea::vertical().auto_shrink(false);
    area.show_rows(ui, height, state.rows.len(), |ui, range| {
        for event in state.rows.get(range).unwrap_or_default() {
            row(ui, scene, event, height);
        }
    });
    scene.kept.log = state;
}

fn derive(state: &mut State, model: &Model, paused: bool) {
    let newest = model.live_events.back().map_or(0, |event| event.sequence);
    let filter = state.filter.trim().to_lowercase();
    let live = model.live_events.len();
    let made_for = (model.events.revision(), newest, live, filter, state.frames_only);
    let is_asked = state.made_for.as_ref().is_none_or(|old| (&old.3, old.4) != (&made_for.3, made_for.4));
    if state.made_for.as_ref() == Some(&made_for) || (paused && !is_asked) {
        return;
    }
    let words: Vec<&str> = made_for.3.split_whitespace().collect();
    let fits = |event: &&EventView| {
        if state.frames_only && event.frame.is_none() {
            return false;
        }
        let text = || format!("{} {} {}", event.message, event.kind, event.level).to_lowercase();
        words.is_empty() || words.iter().all(|word| text().contains(word))
    };
    let oldest_live = model.live_events.front().map_or(i64::MAX, |event| event.sequence);
    let kept = model.events.value().map_or(&[][..], |page| &page.items);
    let kept = kept.iter().filter(|event| event.sequence < oldest_live);
    let all = model.live_events.iter().rev().chain(kept).filter(fits);
    state.rows = all.take(ROWS_MAX).cloned().collect();
    state.made_for = Some(made_for);
}

fn row(ui: &mut Ui, scene: &mut Scene<'_>, event: &EventView, height: f32) {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(egui::vec2(ui.available_width(), height), Sense::click());
    let is_chosen = event.frame.is_some() && event.frame == scene.kept.chosen_frame;
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    if is_chosen || response.hovered() || response.has_focus() {
        painter.rect_filled(rect, 2.0, if is_chosen { theme.selection } else { theme.raised });
    }
    let at = Timestamp::from_microsecond(event.at.unix_us()).unwrap_or_default();
    let left = |x: f32| rect.left_center() + egui::vec2(x, 0.0);
    let write = |x: f32, text: &str, face: egui::FontId, colour| {
        painter.text(left(x), egui::Align2::LEFT_CENTER, text, face, colour);
    };
    write(4.0, &format::time(at), fonts::small_figures(), theme.dim);
    let level = Level::ALL.into_iter().find(|level| level.word() == event.level);
    if let Some(level) = level {
        paint_shape(&painter, left(90.0), 12.0, level, level.colour(theme));
    }
    write(102.0, &event.kind, fonts::small(), theme.dim);
    write(210.0, &event.message, fonts::body(), theme.text);
    let told = match level {
        Some(level) => format!("{} {}: {}", format::time(at), level.word(), event.message),
        None => format!("{} {}", format::time(at), event.message),
    };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ListItem, true, &told));
    if response.clicked()
        && let Some(frame) = event.frame
    {
        scene.kept.chosen_frame = Some(frame);
    }
    if response.double_clicked() && event.frame.is_some() {
        scene.open(Pane::Frame);
    }
    response.on_hover_ui(|ui| {
        ui.label(&event.message);
        ui.weak(format!("{}, event {}", format::utc_ms(at), event.sequence));
        if let Some(frame) = event.frame {
            match held(scene.model, frame) {
                Some(frame) => hex(ui, frame),
                None => _ = ui.weak(format!("frame {frame}: a click shows it in the pane Frame")),
            }
        }
    });
}

fn held(model: &Model, id: u64) -> Option<&FrameView> {
    let kept = model.frames.value().map_or(&[][..], |page| &page.items);
    model.live_frames.iter().rev().chain(kept).find(|frame| frame.id == id)
}

/// The bytes of a frame, sixteen a line.
fn hex(ui: &mut Ui, frame: &FrameView) {
    let name = frame.packet_name.as_deref().unwrap_or("unknown packet");
    ui.label(format!("{name}, {} bytes, {}", frame.length, frame.form));
    for line in frame.hex.as_bytes().chunks(32).take(16) {
        let pairs: Vec<String> =
            line.chunks(2).map(|pair| pair.iter().map(|byte| char::from(*byte)).collect()).collect();
        ui.label(RichText::new(pairs.join(" ")).monospace().small());
    }
}
