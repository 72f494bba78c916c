//! A value with its name, unit, level and age; and how strongly a link is heard.

use egui::{
    Align2, Color32, Painter, Rect, Response, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};
use jiff::{SignedDuration, Timestamp};

use crate::fonts;
use crate::format::{self, Quantity};
use crate::level::{Level, paint_shape};
use crate::theme::Theme;

/// How much a value can be believed to be of now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Freshness {
    /// As new as it should be.
    Fresh,
    /// Older than it should be.
    Stale(SignedDuration),
    /// The satellite is out of view: nothing is expected until then, so nothing is late.
    OutOfView {
        /// How old the value is.
        age: SignedDuration,
        /// The next contact, where one is known.
        until: Option<Timestamp>,
    },
    /// It never came.
    Never,
}

impl Freshness {
    /// What is said of it; nothing for what is fresh.
    #[must_use]
    pub fn text(self, now: Timestamp) -> String {
        match self {
            Self::Fresh => String::new(),
            Self::Stale(age) => format!("{} old", format::age(age)),
            Self::OutOfView { until: Some(until), .. } => {
                format!("no contact expected until {}", format::near(until, now))
            }
            Self::OutOfView { age, until: None } => format!("{} ago, no contact planned", format::age(age)),
            Self::Never => "never received".into(),
        }
    }
}

/// A value in a row.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueRow<'a> {
    /// Its name.
    pub label: &'a str,
    /// Itself.
    pub value: Quantity,
    /// The limit that it breaks, and whether it lies above it (an arrow up) or below.
    pub level: Option<(Level, Over)>,
    /// How old it is.
    pub freshness: Freshness,
}

/// Which limit is broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// Above the upper one.
    Above,
    /// Below the lower one.
    Below,
    /// Neither: a state that should not be.
    Neither,
}

/// Draws a row: label, value and unit, level, age.
pub fn value_row(ui: &mut Ui, row: &ValueRow<'_>, now: Timestamp) -> Response {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 24.0), Sense::hover());
    let said = row.freshness.text(now);
    if ui.is_rect_visible(rect) {
        paint_value(&ui.painter().with_clip_rect(ui.clip_rect().intersect(rect)), rect, row, &said, theme);
    }
    let level = row.level.map_or(String::new(), |(level, _)| format!(", {}", level.word()));
    let age = if said.is_empty() { String::new() } else { format!(", {said}") };
    let told = format!("{}: {}{level}{age}", row.label, row.value);
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &told));
    match row.freshness {
        Freshness::OutOfView { age, .. } => {
            response.on_hover_text(format!("{told}\nlast received {} ago", format::age(age)))
        }
        _ => response.on_hover_text(told),
    }
}

fn paint_value(painter: &Painter, rect: Rect, row: &ValueRow<'_>, said: &str, theme: &Theme) {
    let y = rect.center().y;
    // Figures end at one line, units begin there
    let edge = rect.left() + (rect.width() * 0.5).clamp(120.0, 240.0);
    painter.text(pos2(rect.left(), y), Align2::LEFT_CENTER, row.label, fonts::body(), theme.dim);
    let is_old = !matches!(row.freshness, Freshness::Fresh);
    let ink = match row.level {
        Some((level, _)) if !is_old => level.colour(theme),
        _ if is_old => theme.dim,
        _ => theme.text,
    };
    let number =
        painter.text(pos2(edge, y), Align2::RIGHT_CENTER, &row.value.number, fonts::figures(14.0), ink);
    let gap = if row.value.gap().is_empty() { 1.0 } else { 5.0 };
    let unit = pos2(number.right() + gap, y);
    painter.text(unit, Align2::LEFT_CENTER, &row.value.unit, fonts::small(), theme.dim);
    let mut x = edge + 52.0;
    if let Some((level, over)) = row.level {
        let colour = if is_old { theme.dim } else { level.colour(theme) };
        paint_shape(painter, pos2(x, y), 13.0, level, colour);
        arrow(painter, pos2(x + 13.0, y), over, colour);
        let word = pos2(x + 22.0, y);
        x = painter.text(word, Align2::LEFT_CENTER, level.word(), fonts::small(), theme.text).right() + 12.0;
    }
    let mut job = egui::text::LayoutJob::simple_singleline(said.to_owned(), fonts::small(), theme.dim);
    job.wrap = egui::text::TextWrapping::truncate_at_width((rect.right() - x).max(10.0));
    let galley = painter.layout_job(job);
    painter.galley(
        pos2((rect.right() - galley.size().x).max(x), y - galley.size().y / 2.0),
        galley,
        theme.dim,
    );
}

fn arrow(painter: &Painter, at: egui::Pos2, over: Over, colour: Color32) {
    let tip = match over {
        Over::Above => -4.0,
        Over::Below => 4.0,
        Over::Neither => return,
    };
    let corners = vec![at + vec2(0.0, tip), at + vec2(-4.0, -tip * 0.6), at + vec2(4.0, -tip * 0.6)];
    painter.add(Shape::convex_polygon(corners, colour, Stroke::NONE));
}

/// How a frame was heard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heard {
    /// When.
    pub at: Timestamp,
    /// Power at the receiver, dBm.
    pub rssi_dbm: Option<f32>,
    /// Over the noise, dB; LoRa is heard below zero, too.
    pub snr_db: Option<f32>,
}

/// The least and the most that the two scales show.
const RSSI_DBM: (f32, f32) = (-140.0, -80.0);
const SNR_DB: (f32, f32) = (-20.0, 15.0);

/// How strongly the satellite is heard: the last frame in figures, and the frames of the last `span` as strokes, RSSI
/// above, SNR below (its line is where signal and noise are equal).
pub fn link_meter(ui: &mut Ui, heard: &[Heard], now: Timestamp, span: SignedDuration) -> Response {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 64.0), Sense::hover());
    let last = heard.last();
    let rssi = format::dbm(last.and_then(|last| last.rssi_dbm).map(f64::from));
    let snr = format::db(last.and_then(|last| last.snr_db).map(f64::from));
    if ui.is_rect_visible(rect) {
        let from = now.checked_sub(span).unwrap_or(Timestamp::MIN);
        let heard = heard.get(heard.partition_point(|one| one.at < from)..).unwrap_or_default();
        let history = Rect::from_min_max(pos2(rect.left() + 148.0, rect.top()), rect.max);
        for (index, (name, value, range, pick)) in [
            ("RSSI", &rssi, RSSI_DBM, (|one: &Heard| one.rssi_dbm) as fn(&Heard) -> Option<f32>),
            ("SNR", &snr, SNR_DB, |one: &Heard| one.snr_db),
        ]
        .into_iter()
        .enumerate()
        {
            let top = rect.top() + 34.0 * index as f32;
            let y = top + 15.0;
            let painter = ui.painter();
            painter.text(pos2(rect.left(), y), Align2::LEFT_CENTER, name, fonts::body(), theme.dim);
            let edge = pos2(rect.left() + 100.0, y);
            painter.text(edge, Align2::RIGHT_CENTER, &value.number, fonts::figures(14.0), theme.text);
            painter.text(edge + vec2(5.0, 0.0), Align2::LEFT_CENTER, &value.unit, fonts::small(), theme.dim);
            let strip = Rect::from_min_max(pos2(history.left(), top), pos2(history.right(), top + 30.0));
            strokes(painter, strip, heard, (from, now), range, pick, theme);
        }
    }
    let age = last.map_or(format::UNKNOWN.into(), |last| format::age(now.duration_since(last.at)));
    let told = format!("Link: RSSI {rssi}, SNR {snr}, last frame {age} ago");
    response.widget_info(|| WidgetInfo::labeled(Role::Meter, true, &told));
    response.on_hover_text(told)
}

/// One stroke a frame, at most one a point: of those that fall together the strongest.
fn strokes(
    painter: &Painter,
    strip: Rect,
    heard: &[Heard],
    (from, now): (Timestamp, Timestamp),
    range: (f32, f32),
    pick: fn(&Heard) -> Option<f32>,
    theme: &Theme,
) {
    painter.rect_filled(strip, 2.0, theme.ground);
    let part = |value: f32| ((value - range.0) / (range.1 - range.0)).clamp(0.0, 1.0);
    if range.0 < 0.0 && range.1 > 0.0 {
        let y = strip.bottom() - part(0.0) * strip.height();
        painter.hline(strip.x_range(), y, Stroke::new(1.0, theme.line));
    }
    let whole = now.duration_since(from).as_secs_f32().max(1e-3);
    let columns = strip.width().max(1.0) as usize;
    let mut column_s = 0;
    while column_s < columns {
        // The first frame in this column or after it: as many looks as columns, however many frames there are
        let start = from.checked_add(SignedDuration::from_secs_f32(column_s as f32 / columns as f32 * whole));
        let Ok(start) = start else { return };
        let at = heard.partition_point(|one| one.at < start);
        let Some(next) = heard.get(at) else { return };
        let column = (next.at.duration_since(from).as_secs_f32() / whole * columns as f32) as usize;
        let column = column.clamp(column_s, columns);
        let end =
            from.checked_add(SignedDuration::from_secs_f32((column + 1) as f32 / columns as f32 * whole));
        let Ok(end) = end else { return };
        let together = heard.get(at..).unwrap_or_default();
        let strongest = together.iter().take(64).take_while(|one| one.at < end).filter_map(pick);
        if let Some(value) = strongest.filter(|value| !value.is_nan()).reduce(f32::max) {
            let x = painter.round_to_pixel_center(strip.left() + column as f32);
            let top = strip.bottom() - part(value).max(0.04) * strip.height();
            painter.vline(x, top..=strip.bottom(), Stroke::new(1.5, theme.accent));
        }
        column_s = column + 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn out_of_view_is_not_stale() {
        let now: Timestamp = "2026-11-22T14:00:00Z".parse().unwrap();
        let until = Some("2026-11-22T14:32:00Z".parse().unwrap());
        let hour = SignedDuration::from_hours(1);
        assert_eq!(Freshness::OutOfView { age: hour, until }.text(now), "no contact expected until 14:32Z");
        assert_eq!(Freshness::Stale(hour).text(now), "60 min old");
        assert_eq!(Freshness::Fresh.text(now), "");
        assert_eq!(Freshness::Never.text(now), "never received");
    }
}
