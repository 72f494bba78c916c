//! The five levels of an alarm (XTCE's names), each told three ways: a colour, a shape with one to five bars, a word.

use egui::{
    Color32, Painter, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use serde::{Deserialize, Serialize};

use crate::theme::Theme;

/// How much something matters, least first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Keep an eye on it: ○.
    Watch,
    /// △.
    Warning,
    /// ◇.
    Distress,
    /// ⬠.
    Critical,
    /// ■, the only one that is filled.
    Severe,
}

impl Level {
    /// All five, least first.
    pub const ALL: [Self; 5] = [Self::Watch, Self::Warning, Self::Distress, Self::Critical, Self::Severe];

    /// 0 for watch to 4 for severe.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// How many bars stand beside it: 1 to 5.
    #[must_use]
    pub const fn bars(self) -> usize {
        self.index() + 1
    }

    /// The word as it is shown and spoken.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Watch => "watch",
            Self::Warning => "warning",
            Self::Distress => "distress",
            Self::Critical => "critical",
            Self::Severe => "severe",
        }
    }

    /// Its colour.
    #[must_use]
    pub fn colour(self, theme: &Theme) -> Color32 {
        match self {
            Self::Watch => theme.watch,
            Self::Warning => theme.warning,
            Self::Distress => theme.distress,
            Self::Critical => theme.critical,
            Self::Severe => theme.severe,
        }
    }
}

/// Paints the shape of a level, `size` points high.
pub fn paint_shape(painter: &Painter, centre: Pos2, size: f32, level: Level, colour: Color32) {
    let radius = size / 2.0 - 1.0;
    let stroke = Stroke::new((size / 8.0).max(1.5), colour);
    // Corners on a circle, the first one at `first` turns clockwise from the top.
    let corners = |count: usize, first: f32, radius: f32, down: f32| -> Vec<Pos2> {
        (0..count)
            .map(|corner| {
                let turn = (first + corner as f32 / count as f32) * std::f32::consts::TAU;
                centre + vec2(turn.sin(), -turn.cos()) * radius + vec2(0.0, down)
            })
            .collect()
    };
    match level {
        Level::Watch => painter.circle_stroke(centre, radius * 0.9, stroke),
        Level::Warning => {
            painter.add(Shape::closed_line(corners(3, 0.0, radius * 1.1, radius * 0.2), stroke))
        }
        Level::Distress => painter.add(Shape::closed_line(corners(4, 0.0, radius * 1.05, 0.0), stroke)),
        Level::Critical => painter.add(Shape::closed_line(corners(5, 0.0, radius, radius * 0.06), stroke)),
        Level::Severe => {
            painter.rect_filled(Rect::from_center_size(centre, Vec2::splat(radius * 1.75)), 1.0, colour)
        }
    };
}

/// Paints five bars, as many of them filled as the level has, to the right of `left` (middle of the left edge), and
/// returns the width taken.
pub fn paint_bars(
    painter: &Painter,
    left: Pos2,
    height: f32,
    level: Level,
    colour: Color32,
    empty: Color32,
) -> f32 {
    let (width, gap) = (3.0, 2.0);
    for bar in 0..5_u8 {
        let tall = height * (0.4 + 0.15 * f32::from(bar));
        let x = left.x + f32::from(bar) * (width + gap);
        let bottom = left.y + height / 2.0;
        let rect = Rect::from_min_max(pos2(x, bottom - tall), pos2(x + width, bottom));
        painter.rect_filled(rect, 0.5, if usize::from(bar) < level.bars() { colour } else { empty });
    }
    5.0 * (width + gap) - gap
}

/// Shape, bars and word in one line, as wide for each level.
pub fn mark(ui: &mut Ui, level: Level) -> Response {
    let theme = Theme::current(ui);
    let colour = level.colour(theme);
    let height = ui.spacing().interact_size.y;
    let (rect, response) = ui.allocate_exact_size(vec2(108.0, height), Sense::hover());
    if ui.is_rect_visible(rect) {
        let middle = rect.left_center();
        paint_shape(ui.painter(), middle + vec2(8.0, 0.0), 14.0, level, colour);
        paint_bars(ui.painter(), middle + vec2(20.0, 0.0), 12.0, level, colour, theme.line);
        ui.painter().text(
            middle + vec2(50.0, 0.0),
            egui::Align2::LEFT_CENTER,
            level.word(),
            crate::fonts::body(),
            theme.text,
        );
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, level.word()));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_is_the_greatest_and_has_the_most_bars() {
        assert!(Level::ALL.is_sorted());
        assert_eq!(Level::ALL.map(Level::bars), [1, 2, 3, 4, 5]);
        assert_eq!(Level::ALL.iter().max(), Some(&Level::Severe));
    }

    #[test]
    fn each_level_has_a_colour_of_its_own_in_both_modes() {
        for mode in [crate::Mode::Dark, crate::Mode::Light] {
            let theme = Theme::of(mode);
            for one in Level::ALL {
                for other in Level::ALL {
                    assert_eq!(one == other, one.colour(theme) == other.colour(theme), "{one:?} {other:?}");
                }
            }
        }
    }
}
