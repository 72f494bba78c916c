//! What must not happen by accident: a button that is held, and a word that is typed. Enter fires neither.

use egui::{
    Button, Color32, Key, Pos2, Response, Role, Sense, Shape, Stroke, StrokeKind, TextEdit, Ui, WidgetInfo,
    vec2,
};

use crate::fonts;
use crate::lamps::focus_ring;
use crate::theme::{Theme, sizes};

/// How long a button is held before it fires, seconds.
pub const HOLD_S: f64 = 0.8;

/// What a hold button keeps between frames.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Hold {
    /// When the present hold began, egui's time in seconds.
    since_s: Option<f64>,
    /// It has fired, or was given up, and waits to be let go.
    spent: bool,
}

impl Hold {
    /// Goes on by one frame. Returns true once for each hold that lasts [`HOLD_S`].
    fn step(&mut self, is_held: bool, is_given_up: bool, now_s: f64) -> bool {
        if !is_held {
            *self = Self::default();
            return false;
        }
        if is_given_up {
            *self = Self { since_s: None, spent: true };
        }
        if self.spent {
            return false;
        }
        let since_s = *self.since_s.get_or_insert(now_s);
        if now_s - since_s < HOLD_S {
            return false;
        }
        *self = Self { since_s: None, spent: true };
        true
    }

    /// How much of the hold is done, 0 to 1.
    #[must_use]
    pub fn part(&self, now_s: f64) -> f32 {
        self.since_s.map_or(0.0, |since_s| ((now_s - since_s) / HOLD_S).clamp(0.0, 1.0) as f32)
    }
}

/// A button that fires when it was held for [`HOLD_S`], by the mouse or, while it has the keyboard, by the space bar; a
/// ring shows how far it is. Let go early, moved away from, or Esc: nothing. Returns whether it fired now.
///
/// `colour` is that of the ring and the edge: what the deed means.
pub fn hold_button(ui: &mut Ui, hold: &mut Hold, text: &str, colour: Color32) -> bool {
    let theme = Theme::current(ui);
    let galley = ui.painter().layout_no_wrap(text.to_owned(), fonts::body(), theme.text);
    let size = vec2(galley.size().x + 44.0, 32.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let is_enabled = ui.is_enabled();
    let (now_s, by_key, is_given_up) = ui.input(|input| {
        let is_given_up = input.key_pressed(Key::Escape) || !input.focused;
        (input.time, input.key_down(Key::Space), is_given_up)
    });
    let by_mouse = response.is_pointer_button_down_on() && response.contains_pointer();
    // A space bar that was down before the keyboard came here does not count
    let by_key = by_key && response.has_focus() && !response.gained_focus();
    let is_held = is_enabled && (by_mouse || by_key);
    let fired = hold.step(is_held, is_given_up, now_s);
    if hold.since_s.is_some() {
        ui.ctx().request_repaint();
    }
    if ui.is_rect_visible(rect) {
        paint(ui, rect, &response, hold.part(now_s), colour, galley);
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Button, is_enabled, format!("{text} (hold)")));
    response.on_hover_text("Hold for 0.8 s, by the mouse or the space bar. Enter does nothing here");
    fired
}

fn paint(
    ui: &Ui,
    rect: egui::Rect,
    response: &Response,
    part: f32,
    colour: Color32,
    galley: std::sync::Arc<egui::Galley>,
) {
    let theme = Theme::current(ui);
    let painter = ui.painter();
    let (colour, ink) = if ui.is_enabled() { (colour, theme.text) } else { (theme.line, theme.faint) };
    let fill = if response.hovered() || part > 0.0 { theme.raised } else { theme.panel };
    painter.rect(rect, 4.0, fill, Stroke::new(1.5, colour), StrokeKind::Inside);
    let centre = rect.left_center() + vec2(18.0, 0.0);
    painter.circle_stroke(centre, 7.0, Stroke::new(2.5, theme.line));
    if part > 0.0 {
        painter.add(Shape::line(arc(centre, 7.0, part), Stroke::new(2.5, colour)));
    }
    painter.circle_filled(centre, 2.5, colour);
    painter.galley_with_override_text_color(
        egui::pos2(rect.left() + 34.0, rect.center().y - galley.size().y / 2.0),
        galley,
        ink,
    );
    focus_ring(ui, rect, response);
}

/// A part of a circle from the top, clockwise.
fn arc(centre: Pos2, radius: f32, part: f32) -> Vec<Pos2> {
    let count = 2 + (part * 40.0) as usize;
    (0..=count)
        .map(|step| {
            let turn = part * step as f32 / count as f32 * std::f32::consts::TAU;
            centre + vec2(turn.sin(), -turn.cos()) * radius
        })
        .collect()
}

/// What the field of a typed word keeps between frames.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TypedWord {
    /// What was typed so far.
    pub text: String,
}

/// A field for a word and a button beside it that wakes when the word is there, letter for letter. The button is clicked
/// or pressed with the space bar; Enter fires it from neither place. Returns whether it fired now; the field is empty
/// then.
pub fn typed_word(ui: &mut Ui, typed: &mut TypedWord, word: &str, action: &str) -> bool {
    let theme = Theme::current(ui);
    let mut fired = false;
    ui.horizontal(|ui| {
        ui.label(egui::RichText::new("Type").color(theme.dim));
        ui.label(egui::RichText::new(word).monospace().size(sizes().body));
        let field =
            TextEdit::singleline(&mut typed.text).desired_width(120.0).font(fonts::figures(sizes().body));
        ui.add(field).accessible_name(format!("Type {word} to confirm"));
        let is_there = typed.text == word;
        let by_enter = ui.input(|input| input.key_pressed(Key::Enter));
        let button = ui.add_enabled(is_there, Button::new(action));
        fired = is_there && button.clicked() && !by_enter;
    });
    if fired {
        typed.text.clear();
    }
    fired
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hold_fires_once_and_only_when_it_lasts() {
        let mut hold = Hold::default();
        assert!(!hold.step(true, false, 10.0));
        assert!(!hold.step(true, false, 10.79));
        assert!(hold.step(true, false, 10.8));
        assert!(!hold.step(true, false, 12.0), "held on, it does not fire again");
        assert!(!hold.step(false, false, 12.1));
        assert!(!hold.step(true, false, 12.2));
        assert!(!hold.step(false, false, 12.9), "let go early");
        assert!(!hold.step(true, false, 13.1), "two short holds make no long one");
    }

    #[test]
    fn esc_gives_up_until_it_is_let_go() {
        let mut hold = Hold::default();
        assert!(!hold.step(true, false, 0.0));
        assert!(!hold.step(true, true, 0.5));
        assert!(!hold.step(true, false, 5.0));
        assert!(!hold.step(false, false, 5.1));
        assert!(!hold.step(true, false, 5.2));
        assert!(hold.step(true, false, 6.1));
    }
}
