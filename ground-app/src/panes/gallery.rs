//! All images.

use egui::{Align2, Role, Sense, WidgetInfo, vec2};
use ui::{Theme, fonts};

use super::{Scene, blank, words};

const CARD: f32 = 84.0;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    order: Vec<usize>,
    of: Option<(u64, String)>,
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let Some(satellite) = scene.satellite().map(|satellite| satellite.satellite.clone()) else {
        return blank::show(ui, scene);
    };
    let model = scene.model;
    if let Some(why) = model.images.failure() {
        ui.weak(why);
    }
    let Some(images) = model.images.value().map(|page| &page.items) else {
        return blank::show(ui, scene);
    };
    let state = &mut scene.kept.gallery;
    let of = (model.images.revision(), satellite.clone());
    if state.of.as_ref() != Some(&of) {
        state.order = (0..images.len()).filter(|index| images[*index].satellite == satellite).collect();
        state.order.sort_unstable_by_key(|index| std::cmp::Reverse(images[*index].id));
        state.of = Some(of);
    }
    if state.order.is_empty() {
        ui.weak("No image was declared yet");
        return;
    }
    let shown = scene.kept.album.image(model, &satellite).map(|image| image.id);
    let order = scene.kept.gallery.order.clone();
    let mut chosen = None;
    egui::ScrollArea::vertical().auto_shrink([false, false]).show_rows(ui, CARD, order.len(), |ui, range| {
        for index in &order[range] {
            if card(ui, &images[*index], Some(images[*index].id) == shown) {
                chosen = Some(images[*index].id);
            }
        }
    });
    if let Some(image) = chosen {
        scene.kept.album.choose(image);
    }
}

fn card(ui: &mut egui::Ui, image: &api::ImageView, is_shown: bool) -> bool {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), CARD), Sense::click());
    let state = if image.complete { "complete" } else { "incomplete" };
    let progress = format!("{}/{} chunks", image.held, image.chunks);
    response.widget_info(|| {
        let name = format!("Image {}, {state}, {progress}", image.id);
        WidgetInfo::selected(Role::Button, true, is_shown, name)
    });
    if ui.is_rect_visible(rect) {
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4.0, if is_shown { theme.selection } else { theme.raised });
        if response.hovered() || response.has_focus() {
            painter.rect_stroke(rect, 4.0, (1.0, theme.accent), egui::StrokeKind::Inside);
        }
        let inside = rect.shrink(10.0);
        let text = |at: egui::Pos2, align, words: String, font, colour| {
            painter.text(at, align, words, font, colour);
        };
        let (top, right) = (inside.left_top(), inside.right_top());
        text(top, Align2::LEFT_TOP, format!("Image {}", image.id), fonts::body(), theme.text);
        let declared = ui::format::utc(words::time(image.declared_at));
        text(right, Align2::RIGHT_TOP, declared, fonts::small_figures(), theme.dim);
        let size = ui::format::bytes(image.size_bytes.into());
        let size = format!("{} × {} px · {size}", image.width_px, image.height_px);
        text(top + vec2(0.0, 21.0), Align2::LEFT_TOP, size, fonts::small(), theme.dim);
        let bar = egui::Rect::from_min_size(top + vec2(0.0, 43.0), vec2(inside.width(), 4.0));
        painter.rect_filled(bar, 2.0, theme.line);
        let part = image.held as f32 / image.chunks.max(1) as f32;
        let done = egui::Rect::from_min_size(bar.min, vec2(bar.width() * part.clamp(0.0, 1.0), 4.0));
        painter.rect_filled(done, 2.0, if image.complete { theme.dim } else { theme.accent });
        let below = top + vec2(0.0, 52.0);
        text(below, Align2::LEFT_TOP, progress, fonts::small(), theme.dim);
        let (words, colour) = match (image.conflicts, image.complete) {
            (1.., _) => (format!("{} in conflict", image.conflicts), theme.critical),
            (0, true) => (state.to_owned(), theme.text),
            (0, false) => (state.to_owned(), theme.dim),
        };
        text(egui::pos2(inside.right(), below.y), Align2::RIGHT_TOP, words, fonts::small(), colour);
    }
    response.clicked()
}
