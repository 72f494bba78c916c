//! What a rehearsal foretells, as bands: nine of ten outcomes lie within a band, one half on each side of its mark.

use egui::{Rect, Response, Role, Sense, Stroke, Ui, WidgetInfo, lerp, pos2, vec2};

use crate::fonts;
use crate::format;
use crate::theme::{self, Theme};

const ROW: f32 = 26.0;

/// One answer of a rehearsal.
#[derive(Debug, Clone, Copy)]
pub struct Band<'a> {
    /// What is foretold.
    pub name: &'a str,
    /// Its unit; empty for counts.
    pub unit: &'a str,
    /// One of twenty outcomes lies below this.
    pub p5: f64,
    /// One half lies below this.
    pub p50: f64,
    /// One of twenty lies above this.
    pub p95: f64,
    /// The ends of the scale.
    pub scale: (f64, f64),
    /// What is wanted, as a mark on the scale.
    pub goal: Option<f64>,
    /// What really came, once it is known.
    pub actual: Option<f64>,
    /// Decimals to show.
    pub decimals: usize,
}

/// Draws one row for each answer. Values that are no numbers are shown as unknown, without a band.
pub fn bands_ui(ui: &mut Ui, bands: &[Band<'_>]) -> Response {
    let theme = Theme::current(ui);
    let width = ui.available_width();
    let (rect, response) =
        ui.allocate_exact_size(vec2(width, (bands.len() as f32 + 0.8) * ROW), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, spoken(bands)));
    if !ui.is_rect_visible(rect) {
        return response;
    }
    let painter = ui.painter_at(rect);
    let small = fonts::small();
    let figures = fonts::figures(theme::sizes().small);
    let names = (width * 0.28).clamp(96.0, 180.0);
    let numbers = 190.0_f32.min(width * 0.36);
    let column = numbers / 3.4;
    let x_range = rect.left() + names..=rect.right() - numbers - 4.0 * theme::space();
    let number_right = |index: f32| rect.right() - numbers + column * index;
    for (index, head) in ["5 %", "50 %", "95 %"].into_iter().enumerate() {
        let at = pos2(number_right(index as f32 + 1.0), rect.top() + ROW * 0.4);
        painter.text(at, egui::Align2::RIGHT_CENTER, head, fonts::text(11.0), theme.dim);
    }
    for (index, band) in bands.iter().enumerate() {
        let middle = rect.top() + (index as f32 + 1.3) * ROW;
        let clipped = painter.with_clip_rect(Rect::from_min_max(
            pos2(rect.left(), middle - ROW / 2.0),
            pos2(rect.left() + names - 6.0, middle + ROW / 2.0),
        ));
        clipped.text(
            pos2(rect.left(), middle),
            egui::Align2::LEFT_CENTER,
            band.name,
            small.clone(),
            theme.dim,
        );
        let track = Rect::from_x_y_ranges(x_range.clone(), middle - 5.0..=middle + 5.0);
        painter.rect_filled(track, 3.0, theme.ground);
        let x = |value: f64| place(band.scale, value).map(|part| lerp(x_range.clone(), part));
        if let (Some(low), Some(mid), Some(high)) = (x(band.p5), x(band.p50), x(band.p95)) {
            let bar = Rect::from_x_y_ranges(low..=high.max(low + 2.0), track.y_range());
            painter.rect_filled(bar, 3.0, theme.accent.gamma_multiply(0.35));
            painter.vline(mid, middle - 7.0..=middle + 7.0, Stroke::new(2.5, theme.accent));
        }
        if let Some(goal) = band.goal.and_then(x) {
            let corners = [vec2(-4.0, -11.0), vec2(4.0, -11.0), vec2(0.0, -5.0)]
                .map(|corner| pos2(goal, middle) + corner);
            painter.add(egui::Shape::convex_polygon(corners.to_vec(), theme.text, Stroke::NONE));
        }
        if let Some(actual) = band.actual.and_then(x) {
            painter.circle(pos2(actual, middle), 4.0, theme.text, Stroke::new(1.5, theme.panel));
        }
        for (index, value) in [band.p5, band.p50, band.p95].into_iter().enumerate() {
            let shown = Some(value).filter(|value| value.is_finite());
            let text = shown
                .map_or_else(|| format::UNKNOWN.to_owned(), |value| format::number(value, band.decimals));
            let colour = if index == 1 { theme.text } else { theme.dim };
            let at = pos2(number_right(index as f32 + 1.0), middle);
            painter.text(at, egui::Align2::RIGHT_CENTER, text, figures.clone(), colour);
        }
        let at = pos2(number_right(3.0) + 5.0, middle);
        painter.text(at, egui::Align2::LEFT_CENTER, band.unit, small.clone(), theme.dim);
    }
    let row = response.hover_pos().map(|at| ((at.y - rect.top()) / ROW - 0.8) as usize);
    if let Some(band) = row.and_then(|row| bands.get(row)) {
        let number = |value: f64| {
            format!("{} {}", format::number(value, band.decimals), band.unit).trim_end().to_owned()
        };
        let goal = band.goal.map_or(String::new(), |goal| format!("\nwanted: {}", number(goal)));
        let actual = band.actual.map_or(String::new(), |actual| format!("\nreally came: {}", number(actual)));
        let told =
            format!("{}\nnine of ten outcomes: {} to {}", band.name, number(band.p5), number(band.p95));
        return response.on_hover_text_at_pointer(format!("{told}{goal}{actual}"));
    }
    response
}

/// The part of the scale at which a value lies, at its ends where it is beyond them.
fn place((low, high): (f64, f64), value: f64) -> Option<f32> {
    let part = (value - low) / (high - low);
    part.is_finite().then(|| part.clamp(0.0, 1.0) as f32)
}

fn spoken(bands: &[Band<'_>]) -> String {
    let tell = |band: &Band<'_>| {
        let number = |value| format::number(value, band.decimals);
        format!(
            "{} {} ({} to {}) {}",
            band.name,
            number(band.p50),
            number(band.p5),
            number(band.p95),
            band.unit
        )
    };
    format!("Foretold: {}", bands.iter().map(tell).collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_the_scale_stays_at_its_end_and_what_is_no_number_nowhere() {
        assert_eq!(place((0.0, 10.0), 2.5), Some(0.25));
        assert_eq!(place((0.0, 10.0), 12.0), Some(1.0));
        assert_eq!(place((0.0, 10.0), f64::NAN), None);
        assert_eq!(place((3.0, 3.0), 3.0), None);
    }
}
