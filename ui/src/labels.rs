//! Text that never lies on other text: a label takes the first of its places that is free, or is left out.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Vec2, pos2};

/// What is taken already, in one picture and one frame.
#[derive(Debug, Default)]
pub struct Labels {
    taken: Vec<Rect>,
}

impl Labels {
    /// Nothing is taken.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Keeps labels off this place.
    pub fn keep_off(&mut self, rect: Rect) {
        self.taken.push(rect);
    }

    /// Whether nothing lies there.
    #[must_use]
    pub fn is_free(&self, rect: Rect) -> bool {
        !self.taken.iter().any(|taken| taken.intersects(rect))
    }

    /// Writes the text at the first of these places (the text's centre, from the anchor) that is free and inside
    /// `within`. Returns where, or nothing when there was no room.
    #[expect(clippy::too_many_arguments, reason = "a label is just that: what, where, how")]
    pub fn write(
        &mut self,
        painter: &Painter,
        within: Rect,
        anchor: Pos2,
        places: &[Vec2],
        text: &str,
        face: FontId,
        colour: Color32,
    ) -> Option<Rect> {
        let galley = painter.layout_no_wrap(text.to_owned(), face, colour);
        let rect = places
            .iter()
            .map(|place| Rect::from_center_size(anchor + *place, galley.size()))
            .find(|rect| within.contains_rect(*rect) && self.is_free(rect.expand(1.0)))?;
        painter.galley(rect.min, galley, colour);
        self.taken.push(rect);
        Some(rect)
    }
}

/// Right, left, below and above a mark, and the corners between, for a text of this size with this gap.
#[must_use]
pub fn around(size: Vec2, gap: f32) -> [Vec2; 8] {
    let (x, y) = (size.x / 2.0 + gap, size.y / 2.0 + gap);
    [
        egui::vec2(x, 0.0),
        egui::vec2(-x, 0.0),
        egui::vec2(0.0, y),
        egui::vec2(0.0, -y),
        egui::vec2(x, y),
        egui::vec2(-x, y),
        egui::vec2(x, -y),
        egui::vec2(-x, -y),
    ]
}

/// How large a text is.
#[must_use]
pub fn size(painter: &Painter, text: &str, face: &FontId) -> Vec2 {
    painter.layout_no_wrap(text.to_owned(), face.clone(), Color32::PLACEHOLDER).size()
}

/// Writes a text aligned to a point, and keeps others off it.
pub fn fixed(
    labels: &mut Labels,
    painter: &Painter,
    at: Pos2,
    align: Align2,
    text: &str,
    face: FontId,
    colour: Color32,
) {
    labels.keep_off(painter.text(pos2(at.x, at.y), align, text, face, colour));
}
