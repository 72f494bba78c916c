//! The axis of a timeline: which times are labelled at which zoom. UTC always, the date at midnight.

use egui::{Align2, Painter, Rect, Stroke, pos2};
use jiff::Timestamp;

use crate::theme::Theme;
use crate::{fonts, format};

/// From seconds to a quarter of a year.
const STEPS_S: [i64; 22] = [
    1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1_800, 3_600, 7_200, 10_800, 21_600, 43_200, 86_400,
    172_800, 604_800, 2_592_000, 7_776_000,
];
const DAY_S: i64 = 86_400;

/// A stretch of time on a stretch of the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// At the left edge, seconds since 1970.
    pub start_s: f64,
    /// From edge to edge, seconds; above zero.
    pub span_s: f64,
    /// The left edge, points.
    pub left: f32,
    /// The right edge, points.
    pub right: f32,
}

impl Axis {
    /// Where a time lies, points.
    #[must_use]
    pub fn x(&self, at_s: f64) -> f32 {
        let part = (at_s - self.start_s) / self.span_s;
        // What lies far out of view is drawn just out of view, where figures are still exact
        (f64::from(self.left) + part.clamp(-1.0, 2.0) * f64::from(self.right - self.left)) as f32
    }

    /// The time at a place, seconds since 1970.
    #[must_use]
    pub fn at_s(&self, x: f32) -> f64 {
        self.start_s + f64::from((x - self.left) / (self.right - self.left).max(1.0)) * self.span_s
    }

    /// Seconds a point.
    #[must_use]
    pub fn seconds_a_point(&self) -> f64 {
        self.span_s / f64::from((self.right - self.left).max(1.0))
    }

    /// At the right edge, seconds since 1970.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.start_s + self.span_s
    }

    /// The labelled times: round ones, at least `apart` points from each other.
    fn ticks(&self, apart: f32) -> (i64, Vec<i64>) {
        let least = self.seconds_a_point() * f64::from(apart);
        let last = STEPS_S.last().copied().unwrap_or(DAY_S);
        let step = STEPS_S.iter().copied().find(|step| *step as f64 >= least).unwrap_or(last);
        let first = (self.start_s / step as f64).ceil() as i64;
        let count = ((self.span_s / step as f64) as usize + 1).min(400);
        let ticks = (0_i64..).take(count).map(|tick| (first + tick) * step);
        (step, ticks.filter(|tick| *tick as f64 <= self.end_s()).collect())
    }

    /// Draws lines through `body` and labels in the two lines of `head`: days above, times below. No time is written
    /// where `plate` lies.
    pub fn paint(&self, painter: &Painter, head: Rect, body: Rect, plate: Option<Rect>, theme: &Theme) {
        let (step, ticks) = self.ticks(76.0);
        let face = fonts::small_figures();
        let (upper, lower) = (head.top() + 9.0, head.bottom() - 9.0);
        for &tick in &ticks {
            let Ok(at) = Timestamp::from_second(tick) else { continue };
            let x = painter.round_to_pixel_center(self.x(tick as f64));
            let is_midnight = tick.rem_euclid(DAY_S) == 0;
            let colour = if is_midnight && step < DAY_S { theme.faint } else { theme.line };
            painter.vline(x, body.y_range(), Stroke::new(1.0, colour));
            let text = match step {
                DAY_S.. => format::date(at),
                60.. => format::minute(at),
                _ => format::time(at),
            };
            let at = pos2(x + 4.0, lower);
            let is_hidden =
                plate.is_some_and(|plate| plate.left() < at.x + 66.0 && at.x < plate.right() + 4.0);
            if painter.clip_rect().right() > at.x + 70.0 && !is_hidden {
                painter.text(at, Align2::LEFT_CENTER, text, face.clone(), theme.dim);
            }
        }
        if step < DAY_S {
            self.paint_days(painter, upper, theme);
        }
    }

    /// The date of each day in view where it begins, and of the first one at the left edge.
    fn paint_days(&self, painter: &Painter, y: f32, theme: &Theme) {
        let face = fonts::small_figures();
        let wide = 80.0;
        let first_day = (self.start_s / DAY_S as f64).floor() as i64;
        for day in first_day..=first_day + 40 {
            let Ok(at) = Timestamp::from_second(day * DAY_S) else { continue };
            let next_x = self.x(((day + 1) * DAY_S) as f64);
            let x = self.x((day * DAY_S) as f64).max(self.left);
            if x >= self.right {
                return;
            }
            if next_x - x >= wide && self.right - x >= wide {
                painter.text(
                    pos2(x + 4.0, y),
                    Align2::LEFT_CENTER,
                    format::date(at),
                    face.clone(),
                    theme.text,
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn ticks_are_round_in_view_and_apart(start_s in -1e9..4e9_f64, span_s in 5.0..4e7_f64) {
            let axis = Axis { start_s, span_s, left: 100.0, right: 1100.0 };
            let (step, ticks) = axis.ticks(76.0);
            prop_assert!(ticks.len() <= 14);
            for pair in ticks.windows(2) {
                prop_assert!(axis.x(pair[1] as f64) - axis.x(pair[0] as f64) >= 75.9);
            }
            for tick in ticks {
                prop_assert_eq!(tick % step, 0);
                prop_assert!((axis.start_s..=axis.end_s()).contains(&(tick as f64)));
            }
        }

        #[test]
        fn a_time_is_found_where_it_is_drawn(start_s in 1e9..3e9_f64, span_s in 5.0..4e7_f64, part in 0.0..1.0_f64) {
            let axis = Axis { start_s, span_s, left: 100.0, right: 1100.0 };
            let at_s = start_s + part * span_s;
            prop_assert!((axis.at_s(axis.x(at_s)) - at_s).abs() <= axis.seconds_a_point() * 0.01);
        }
    }
}
