//! A mark with a few words, laid out as one piece so that a line never breaks within it.

use egui::{Color32, FontId, Rect, Sense, Ui, Vec2, vec2};

use crate::theme;

/// Draws a mark of this size and the words after it, each in its face and colour.
pub(crate) fn chip(
    ui: &mut Ui,
    mark: Vec2,
    words: Vec<(String, FontId, Color32)>,
    draw: impl FnOnce(&mut Ui, Rect),
) {
    let gap = theme::space();
    let galleys: Vec<_> = words
        .into_iter()
        .filter(|(text, ..)| !text.is_empty())
        .map(|(text, font, colour)| (ui.painter().layout_no_wrap(text, font, colour), colour))
        .collect();
    let wide: f32 = galleys.iter().map(|(galley, _)| galley.size().x + gap).sum();
    let high = galleys.iter().map(|(galley, _)| galley.size().y).fold(mark.y, f32::max);
    let (rect, response) = ui.allocate_exact_size(vec2(mark.x + wide, high), Sense::hover());
    response.widget_info(|| {
        let text: Vec<&str> = galleys.iter().map(|(galley, _)| galley.text()).collect();
        egui::WidgetInfo::labeled(egui::Role::Label, true, text.join(" "))
    });
    if mark.x > 0.0 {
        draw(ui, Rect::from_center_size(rect.left_center() + vec2(mark.x / 2.0, 0.0), mark));
    }
    let mut left = rect.left() + if mark.x > 0.0 { mark.x + gap } else { 0.0 };
    for (galley, colour) in galleys {
        let at = egui::pos2(left, rect.center().y - galley.size().y / 2.0);
        left += galley.size().x + gap;
        ui.painter().galley(at, galley, colour);
    }
}
