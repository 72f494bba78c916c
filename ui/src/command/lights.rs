//! The stages of a telecommand as a row of lights, and the ends it may come to.

use egui::{Color32, Painter, Pos2, Response, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};
use jiff::Timestamp;

use crate::fonts;
use crate::format;
use crate::theme::Theme;

/// What a telecommand goes through when all goes well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Accepted, durably.
    Queued,
    /// Its bytes are made, durably.
    Sealed,
    /// It went out.
    Radiated,
    /// The satellite answered.
    Answered,
}

impl Stage {
    /// All four in their order.
    pub const ALL: [Self; 4] = [Self::Queued, Self::Sealed, Self::Radiated, Self::Answered];

    /// The word for it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Sealed => "sealed",
            Self::Radiated => "radiated",
            Self::Answered => "answered",
        }
    }
}

/// What else may become of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The satellite answered that it refuses.
    Rejected,
    /// It did not go out.
    Failed,
    /// It went out, and nobody knows what became of it.
    Unknown,
    /// Its time was over before it went out.
    Expired,
    /// Somebody withdrew it.
    Cancelled,
}

impl End {
    /// The word for it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Rejected => "rejected",
            Self::Failed => "failed",
            Self::Unknown => "unknown",
            Self::Expired => "expired",
            Self::Cancelled => "cancelled",
        }
    }

    /// Its colour. What needs a look has one, what a person wanted so is grey.
    #[must_use]
    pub fn colour(self, theme: &Theme) -> Color32 {
        match self {
            Self::Rejected | Self::Failed => theme.critical,
            Self::Unknown => theme.distress,
            Self::Expired | Self::Cancelled => theme.dim,
        }
    }
}

/// How far a telecommand came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Lights {
    /// When each stage of [`Stage::ALL`] was reached.
    pub reached: [Option<Timestamp>; 4],
    /// It is on its way out right now.
    pub is_radiating: bool,
    /// Where it ended otherwise than by an answer, and when.
    pub end: Option<(End, Timestamp)>,
}

impl Lights {
    /// The last stage that was reached.
    #[must_use]
    pub fn last(&self) -> Option<Stage> {
        Stage::ALL.into_iter().zip(self.reached).rev().find_map(|(stage, at)| at.map(|_| stage))
    }

    /// When it last changed.
    #[must_use]
    pub fn changed_at(&self) -> Option<Timestamp> {
        self.reached.into_iter().flatten().chain(self.end.map(|(_, at)| at)).max()
    }

    /// Whether nothing more will happen.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.end.is_some() || self.reached[3].is_some()
    }

    /// What it is now, in one word.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match (self.end, self.is_radiating, self.last()) {
            (Some((end, _)), ..) => end.word(),
            (None, true, _) => "radiating",
            (None, false, Some(stage)) => stage.word(),
            (None, false, None) => "draft",
        }
    }

    /// What each of the four lights shows.
    fn shows(&self, index: usize) -> Light {
        let last = self.last().map_or(0, |stage| stage as usize + 1);
        match self.end {
            // An end takes the place of the first stage that was not reached, or of the answer that refused.
            Some((end, _)) if index == last.min(3) => Light::End(end),
            Some(_) if index > last => Light::Never,
            _ if self.reached[index].is_some() => Light::Reached,
            _ if self.is_radiating && index == 2 => Light::Now,
            _ if index < last => Light::Reached,
            _ => Light::Ahead,
        }
    }

    /// Paints the four lights in a row from `left` (the middle of the first), `step` points apart.
    pub(crate) fn paint(&self, painter: &Painter, theme: &Theme, left: Pos2, step: f32, radius: f32) {
        for index in 0..4 {
            let at = left + vec2(index as f32 * step, 0.0);
            let light = self.shows(index);
            if index > 0 {
                let is_behind = matches!(light, Light::Reached | Light::Now | Light::End(_));
                let colour = if is_behind { theme.dim } else { theme.line };
                let ends = [at - vec2(step - radius - 3.0, 0.0), at - vec2(radius + 3.0, 0.0)];
                painter.line_segment(ends, Stroke::new(1.5, colour));
            }
            light.paint(painter, theme, at, radius);
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Light {
    Ahead,
    Now,
    Reached,
    Never,
    End(End),
}

impl Light {
    fn paint(self, painter: &Painter, theme: &Theme, at: Pos2, radius: f32) {
        let wide = (radius / 3.0).max(1.5);
        match self {
            Self::Reached => {
                painter.circle_filled(at, radius, theme.text);
            }
            Self::Ahead => {
                painter.circle_stroke(at, radius - 0.75, Stroke::new(1.5, theme.faint));
            }
            Self::Never => {
                painter.circle_filled(at, 1.5, theme.faint);
            }
            Self::Now => {
                painter.circle_stroke(at, radius - 0.75, Stroke::new(2.0, theme.accent));
                painter.circle_filled(at, radius * 0.4, theme.accent);
            }
            Self::End(end) => paint_end(painter, end, at, radius, Stroke::new(wide, end.colour(theme))),
        }
    }
}

/// Rejected and failed a cross (failed within a ring), unknown a diamond, expired an hour glass, cancelled a bar.
fn paint_end(painter: &Painter, end: End, at: Pos2, radius: f32, stroke: Stroke) {
    let r = radius * 0.9;
    let cross = |r: f32| {
        painter.line_segment([at - vec2(r, r), at + vec2(r, r)], stroke);
        painter.line_segment([at + vec2(-r, r), at + vec2(r, -r)], stroke);
    };
    match end {
        End::Rejected => cross(r),
        End::Failed => {
            painter.circle_stroke(at, radius, Stroke::new(1.5, stroke.color));
            cross(r * 0.5);
        }
        End::Unknown => {
            let r = radius * 1.15;
            let corners =
                [vec2(0.0, -r), vec2(r, 0.0), vec2(0.0, r), vec2(-r, 0.0)].map(|corner| at + corner);
            painter.add(Shape::closed_line(corners.to_vec(), stroke));
        }
        End::Expired => {
            let corners = [vec2(-r, -r), vec2(r, -r), vec2(-r, r), vec2(r, r)].map(|corner| at + corner);
            painter.add(Shape::closed_line(corners.to_vec(), Stroke::new(1.5, stroke.color)));
        }
        End::Cancelled => {
            painter.circle_stroke(at, radius - 0.75, Stroke::new(1.5, stroke.color));
            painter.line_segment([at - vec2(r, 0.0), at + vec2(r, 0.0)], stroke);
        }
    }
}

/// The four lights with their words below, the time of each on hover.
pub fn stage_lights_ui(ui: &mut Ui, lights: &Lights) -> Response {
    let theme = Theme::current(ui);
    let step = 76.0;
    let (rect, mut response) = ui.allocate_exact_size(vec2(4.0 * step, 32.0), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("Stage: {}", lights.word())));
    // The word of the first light begins at the left edge.
    let left = pos2(rect.left() + 21.0, rect.top() + 9.0);
    lights.paint(ui.painter(), theme, left, step, 5.0);
    for (index, stage) in Stage::ALL.into_iter().enumerate() {
        let at = left + vec2(index as f32 * step, 9.0);
        let (word, colour) = match lights.shows(index) {
            Light::End(end) => (end.word(), end.colour(theme)),
            Light::Reached => (stage.word(), theme.text),
            Light::Now => ("radiating", theme.accent),
            Light::Ahead => (stage.word(), theme.dim),
            Light::Never => ("", theme.faint),
        };
        ui.painter().text(at, egui::Align2::CENTER_TOP, word, fonts::small(), colour);
    }
    if let Some(at) = response.hover_pos() {
        let index = (((at.x - left.x) / step).round().max(0.0) as usize).min(3);
        let end = lights.end.filter(|_| matches!(lights.shows(index), Light::End(_)));
        let told = end
            .map(|(end, at)| (end.word(), at))
            .or_else(|| lights.reached[index].map(|at| (Stage::ALL[index].word(), at)));
        if let Some((word, at)) = told {
            response = response.on_hover_text(format!("{word} {}", format::utc_ms(at)));
        }
    }
    response
}

/// Room that a row of small lights takes: width and height.
pub(crate) const SMALL: egui::Vec2 = egui::Vec2::new(3.0 * 10.0 + 8.0, 8.0);

/// Paints small lights, for rows and tracks, from the middle of their left edge.
pub(crate) fn paint_small(painter: &Painter, theme: &Theme, left: Pos2, lights: &Lights) {
    for index in 0..4 {
        let light = lights.shows(index);
        light.paint(painter, theme, left + vec2(4.0 + 10.0 * index as f32, 0.0), 3.2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(second: i64) -> Option<Timestamp> {
        Timestamp::from_second(second).ok()
    }

    #[test]
    fn an_end_stands_where_the_way_stopped_and_nothing_is_lit_after_it() {
        let lights = Lights {
            reached: [at(1), at(2), at(3), None],
            is_radiating: false,
            end: at(9).map(|at| (End::Unknown, at)),
        };
        assert_eq!(lights.word(), "unknown");
        assert_eq!(
            [0, 1, 2, 3].map(|index| lights.shows(index)),
            [Light::Reached, Light::Reached, Light::Reached, Light::End(End::Unknown)]
        );
        let lights =
            Lights { reached: [at(1), None, None, None], end: at(5).map(|at| (End::Expired, at)), ..lights };
        assert_eq!(
            [0, 1, 2, 3].map(|index| lights.shows(index)),
            [Light::Reached, Light::End(End::Expired), Light::Never, Light::Never]
        );
        assert!(lights.is_over());
    }

    #[test]
    fn a_refusal_is_no_answer_that_shines_like_one() {
        let lights = Lights {
            reached: [at(1), at(2), at(3), at(4)],
            is_radiating: false,
            end: at(4).map(|at| (End::Rejected, at)),
        };
        assert_eq!(lights.shows(3), Light::End(End::Rejected));
        assert_eq!(lights.word(), "rejected");
    }

    #[test]
    fn what_is_going_out_says_so() {
        let lights = Lights { reached: [at(1), at(2), None, None], is_radiating: true, end: None };
        assert_eq!(
            (lights.word(), lights.shows(2), lights.shows(3)),
            ("radiating", Light::Now, Light::Ahead)
        );
        assert!(!lights.is_over());
    }
}
