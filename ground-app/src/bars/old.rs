//! What lies over everything while the line is away: what is shown is old, and says how old.

use egui::{Align2, Color32, Id, LayerId, Order, Rect, RichText, Stroke, pos2};
use ui::Theme;

use crate::model::Connection;
use crate::panes::Scene;

/// Hatches what is old, and says why it is and since when.
pub(crate) fn over(context: &egui::Context, rect: Rect, scene: &Scene<'_>) {
    let Some((words, is_anything_shown)) = words(scene) else { return };
    let theme = Theme::of(scene.desk.theme);
    if is_anything_shown {
        let painter =
            context.layer_painter(LayerId::new(Order::Middle, Id::unique("old"))).with_clip_rect(rect);
        let veil = |alpha: u8| {
            let [r, g, b, _] = theme.ground.to_array();
            Color32::from_rgba_unmultiplied(r, g, b, alpha)
        };
        painter.rect_filled(rect, 0.0, veil(120));
        let (mut x, stroke) = (rect.left() - rect.height(), Stroke::new(2.0, veil(150)));
        while x < rect.right() {
            painter.line_segment([pos2(x, rect.bottom()), pos2(x + rect.height(), rect.top())], stroke);
            x += 14.0;
        }
    }
    let area = egui::Area::new(Id::unique("old words")).order(Order::Foreground).interactable(false);
    area.pivot(Align2::CENTER_TOP).fixed_pos(rect.center_top() + egui::vec2(0.0, 36.0)).show(context, |ui| {
        let frame = egui::Frame::new().fill(theme.raised).stroke(Stroke::new(1.5, theme.distress));
        frame.corner_radius(4).inner_margin(8).show(ui, |ui| {
            ui.set_max_width((rect.width() - 40.0).min(720.0));
            ui.label(RichText::new(words).color(theme.text));
        });
    });
}

fn words(scene: &Scene<'_>) -> Option<(String, bool)> {
    let model = scene.model;
    let held = model.status.is_some();
    let old = model.old_for(scene.now).map(|old| old.as_secs());
    let seconds = old.unwrap_or(0);
    match &model.connection {
        Connection::Lost { why, again_at, .. } => {
            let next = again_at.saturating_duration_since(scene.now).as_secs();
            let what = if held { format!("All that is shown is {seconds} s old. ") } else { String::new() };
            let remedy = remedy(why);
            Some((format!("The server is away. {what}{why}. {remedy}Next attempt in {next} s."), held))
        }
        Connection::Connecting => None,
        Connection::CatchingUp { .. } | Connection::Live { .. } => {
            old.map(|_| (format!("No word from the server for {seconds} s: all that is shown is old."), held))
        }
    }
}

/// What to do about it, where that can be told.
fn remedy(why: &str) -> &'static str {
    if why.contains("token") || why.starts_with("the server refuses") {
        "Give a good token (--token-file or GROUND_TOKEN). "
    } else if why.starts_with("no server answers") {
        "Is the address right, and does gs-server run there? "
    } else {
        ""
    }
}
