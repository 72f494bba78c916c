//! A line of a value's last minutes, small enough to stand in a row of a table.

use egui::{Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, lerp, pos2};
use jiff::{SignedDuration, Timestamp};

use crate::plot::Series;
use crate::plot::thin::thin;
use crate::theme::Theme;

/// Draws the last `length` of a series, with a dot where it ends, in so many points of room. Gaps are gaps.
pub fn sparkline_ui(
    ui: &mut Ui,
    name: &str,
    series: &Series,
    length: SignedDuration,
    now: Timestamp,
    size: Vec2,
) -> Response {
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Course of {name}")));
    if !ui.is_rect_visible(rect) {
        return response;
    }
    let theme = Theme::current(ui);
    let from = now.checked_sub(length.abs()).unwrap_or(Timestamp::MIN);
    let (from_us, to_us) = (from.as_microsecond(), now.as_microsecond());
    let inner = rect.shrink(3.0);
    let Some((low, high)) = series.range(from, now) else {
        let middle = rect.center().y;
        ui.painter().add(Shape::dashed_line(
            &[pos2(inner.left(), middle), pos2(inner.right(), middle)],
            Stroke::new(1.0, theme.faint),
            2.0,
            4.0,
        ));
        return response;
    };
    let place = |index: usize| -> Pos2 {
        let x = (series.time_us(index) - from_us) as f64 / (to_us - from_us).max(1) as f64;
        let y = if high > low { (series.value(index) - low) / (high - low) } else { 0.5 };
        pos2(lerp(inner.x_range(), x as f32), lerp(inner.bottom()..=inner.top(), y as f32))
    };
    let painter = ui.painter().with_clip_rect(rect);
    let thinned = thin(series, from_us, to_us, inner.width().max(4.0) as usize);
    let runs: Vec<Vec<Pos2>> =
        thinned.pieces().map(|piece| piece.iter().map(|&index| place(index)).collect()).collect();
    let end = runs.last().and_then(|run| run.last().copied());
    for run in runs {
        if let [only] = run[..] {
            painter.circle_filled(only, 1.2, theme.dim);
        } else if run.len() > 1 {
            painter.add(Shape::line(run, Stroke::new(1.2, theme.dim)));
        }
    }
    if let Some(end) = end.filter(|end| Rect::everything_right_of(inner.left()).contains(*end)) {
        painter.circle_filled(end, 2.0, theme.text);
    }
    response
}
