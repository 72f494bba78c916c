//! How strong the satellite was: over time with its height, and over its height.

use api::{DayCount, PassReport, PathPoint, SignalPoint, Time};

use crate::sky::svg::{Anchor, Canvas, Part, Px, svg, token};
use crate::sky::with_tokens;

const SIZE_PX: (u32, u32) = (520, 300);
/// Where curves may stand.
const LEFT: f64 = 48.0;
const RIGHT: f64 = 472.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 256.0;
/// The least range of strength that is shown, dB.
const RANGE_DB: f64 = 20.0;
/// Above so many dots they are smaller.
const DOTS_MANY: usize = 150;

/// The plots that a pass gives: none without a frame.
pub(super) fn plots(report: &PassReport) -> Vec<String> {
    let mut plots = Vec::new();
    if report.signal.is_empty() && report.path.is_empty() {
        return plots;
    }
    plots.push(over_time(report));
    if report.signal.iter().any(|point| point.elevation_deg.is_some() && point.rssi_dbm.is_some()) {
        plots.push(over_elevation(report));
    }
    plots.iter().map(|svg| with_tokens(svg)).collect()
}

/// A scale from values to pixels.
#[derive(Clone, Copy)]
struct Scale {
    from: (f64, f64),
    to: (f64, f64),
}

impl Scale {
    fn of(self, value: f64) -> f64 {
        let whole = self.from.1 - self.from.0;
        let part = if whole == 0.0 { 0.5 } else { (value - self.from.0) / whole };
        self.to.0 + (self.to.1 - self.to.0) * part.clamp(0.0, 1.0)
    }
}

/// Strengths, on the right: whole tens around what there is.
fn strength(signal: &[SignalPoint]) -> Option<Scale> {
    let told = || signal.iter().filter_map(|point| point.rssi_dbm).map(f64::from);
    let (low, high) = (told().reduce(f64::min)?, told().reduce(f64::max)?);
    let low = (low / 10.0).floor() * 10.0;
    let high = ((high / 10.0).ceil() * 10.0).max(low + RANGE_DB);
    Some(Scale { from: (low, high), to: (BOTTOM, TOP) })
}

fn us(at: Time) -> f64 {
    at.unix_us() as f64
}

fn over_time(report: &PassReport) -> String {
    let ends = |points: Option<(Time, Time)>| points.map(|(first, last)| (us(first), us(last)));
    let path = report.path.first().zip(report.path.last()).map(|(a, b)| (a.at, b.at));
    let heard = report.signal.first().zip(report.signal.last()).map(|(a, b)| (a.at, b.at));
    let spans = [ends(path), ends(heard)];
    let from = spans.iter().flatten().map(|span| span.0).fold(f64::INFINITY, f64::min);
    let to = spans.iter().flatten().map(|span| span.1).fold(f64::NEG_INFINITY, f64::max);
    let x = Scale { from: (from, to), to: (LEFT, RIGHT) };
    let height = Scale { from: (0.0, 90.0), to: (BOTTOM, TOP) };
    svg(&Part::whole(SIZE_PX), "Strength and elevation over time", |canvas| {
        for gap in &report.gaps {
            let (a, b) = (x.of(us(gap.start)), x.of(us(gap.stop)));
            canvas.rectangle((a, TOP), (b, BOTTOM), token("raised"));
        }
        frame(canvas, "Strength over time");
        time_axis(canvas, x);
        if !report.path.is_empty() {
            for elevation in [0.0, 30.0, 60.0, 90.0] {
                rule(canvas, height.of(elevation));
                let at = (LEFT - 6.0, height.of(elevation));
                canvas.text(&format!("{elevation:.0}°"), at, Anchor::Right, 11.0, token("dim"));
            }
            let curve: Vec<Px> = report
                .path
                .iter()
                .filter(|point| point.elevation_deg >= -1.0)
                .map(|point| (x.of(us(point.at)), height.of(point.elevation_deg)))
                .collect();
            canvas.line(&curve, token("faint"), 1.5);
        }
        match strength(&report.signal) {
            Some(scale) => {
                strength_axis(canvas, scale);
                let radius = dot(report.signal.len());
                for point in &report.signal {
                    if let Some(rssi) = point.rssi_dbm {
                        canvas.disc((x.of(us(point.at)), scale.of(rssi.into())), radius, token("accent"));
                    }
                }
            }
            // When frames came is known even where nobody told how strong they were.
            None => report.signal.iter().for_each(|point| {
                let x = x.of(us(point.at));
                canvas.line(&[(x, BOTTOM - 10.0), (x, BOTTOM)], token("accent"), 1.0);
            }),
        }
        legend(canvas, !report.path.is_empty(), !report.gaps.is_empty());
    })
}

/// Rising and setting apart: what differs between them is the place, not the height.
fn over_elevation(report: &PassReport) -> String {
    let x = Scale { from: (0.0, 90.0), to: (LEFT, RIGHT) };
    let tca = report.planned.tca;
    svg(&Part::whole(SIZE_PX), "Strength over elevation", |canvas| {
        frame(canvas, "Strength over elevation");
        for elevation in [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0] {
            let at = x.of(elevation);
            canvas.line(&[(at, TOP), (at, BOTTOM)], token("edge"), 1.0);
            canvas.text(&format!("{elevation:.0}°"), (at, BOTTOM + 14.0), Anchor::Middle, 11.0, token("dim"));
        }
        let Some(scale) = strength(&report.signal) else { return };
        strength_axis(canvas, scale);
        let radius = dot(report.signal.len());
        for point in &report.signal {
            if let (Some(elevation), Some(rssi)) = (point.elevation_deg, point.rssi_dbm) {
                let at = (x.of(elevation), scale.of(rssi.into()));
                if point.at <= tca {
                    canvas.disc(at, radius, token("accent"));
                } else {
                    canvas.ring(at, radius, token("text"), 1.0);
                }
            }
        }
        let y = 286.0;
        canvas.disc((LEFT, y), 3.0, token("accent"));
        canvas.text("rising", (LEFT + 8.0, y), Anchor::Left, 11.0, token("dim"));
        canvas.ring((LEFT + 64.0, y), 3.0, token("text"), 1.0);
        canvas.text("setting", (LEFT + 72.0, y), Anchor::Left, 11.0, token("dim"));
    })
}

fn dot(count: usize) -> f64 {
    if count > DOTS_MANY { 1.8 } else { 3.0 }
}

fn frame(canvas: &Canvas<'_>, title: &str) {
    canvas.text(title, (LEFT, 20.0), Anchor::Left, 14.0, token("text"));
    canvas.line(&[(LEFT, BOTTOM), (RIGHT, BOTTOM)], token("faint"), 1.0);
}

fn rule(canvas: &Canvas<'_>, y: f64) {
    canvas.line(&[(LEFT, y), (RIGHT, y)], token("edge"), 1.0);
}

fn strength_axis(canvas: &Canvas<'_>, scale: Scale) {
    canvas.text("dBm", (RIGHT + 6.0, 20.0), Anchor::Left, 11.0, token("dim"));
    let (low, high) = scale.from;
    let tens = ((high - low) / 10.0).round() as i32;
    let every = if tens > 8 { 2 } else { 1 };
    for ten in (0..=tens).step_by(every) {
        let value = low + 10.0 * f64::from(ten);
        let at = (RIGHT + 6.0, scale.of(value));
        canvas.text(&format!("{value:.0}"), at, Anchor::Left, 11.0, token("dim"));
    }
}

fn time_axis(canvas: &Canvas<'_>, x: Scale) {
    let minute = 60e6;
    let minutes = (x.from.1 - x.from.0) / minute;
    let step = [1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 360.0]
        .into_iter()
        .find(|step| minutes / step <= 7.0)
        .unwrap_or((minutes / 7.0).ceil());
    let mut tick = (x.from.0 / (minute * step)).ceil();
    // Bounded: at most seven steps fit.
    for _ in 0..8 {
        let at = tick * minute * step;
        if at > x.from.1 {
            break;
        }
        let label = Time::from_unix_us(at as i64).to_string();
        let place = x.of(at);
        canvas.line(&[(place, TOP), (place, BOTTOM)], token("edge"), 1.0);
        let words = label.get(11..16).unwrap_or_default();
        canvas.text(words, (place, BOTTOM + 14.0), Anchor::Middle, 11.0, token("dim"));
        tick += 1.0;
    }
    canvas.text("UTC", (RIGHT + 6.0, BOTTOM + 14.0), Anchor::Left, 11.0, token("dim"));
}

fn legend(canvas: &Canvas<'_>, has_path: bool, has_gaps: bool) {
    let y = 286.0;
    let mut x = LEFT;
    canvas.disc((x, y), 3.0, token("accent"));
    canvas.text("frame", (x + 8.0, y), Anchor::Left, 11.0, token("dim"));
    x += 64.0;
    if has_path {
        canvas.line(&[(x - 6.0, y), (x + 6.0, y)], token("faint"), 1.5);
        canvas.text("elevation", (x + 12.0, y), Anchor::Left, 11.0, token("dim"));
        x += 84.0;
    }
    if has_gaps {
        canvas.rectangle((x - 6.0, y - 5.0), (x + 6.0, y + 5.0), token("raised"));
        canvas.text("nothing heard", (x + 12.0, y), Anchor::Left, 11.0, token("dim"));
    }
}

/// Frames of each day as bars, with the passes of the day under them: none without a frame.
pub(super) fn days(days: &[DayCount]) -> Vec<String> {
    let Some(most) = days.iter().map(|day| day.frames).max().filter(|most| *most > 0) else {
        return Vec::new();
    };
    let height = Scale { from: (0.0, most as f64), to: (BOTTOM, TOP) };
    let step = (RIGHT - LEFT) / days.len() as f64;
    let plot = svg(&Part::whole(SIZE_PX), "Frames by day", |canvas| {
        frame(canvas, "Frames by day");
        canvas.text(&most.to_string(), (LEFT - 6.0, TOP), Anchor::Right, 11.0, token("dim"));
        rule(canvas, TOP);
        canvas.text("0", (LEFT - 6.0, BOTTOM), Anchor::Right, 11.0, token("dim"));
        for (index, day) in days.iter().enumerate() {
            let left = LEFT + step * index as f64;
            let top = height.of(day.frames as f64);
            canvas.rectangle((left + 1.0, top), (left + step - 1.0, BOTTOM), token("accent"));
            let middle = left + step / 2.0;
            canvas.text(
                day.day.get(8..).unwrap_or_default(),
                (middle, BOTTOM + 14.0),
                Anchor::Middle,
                10.0,
                token("dim"),
            );
            canvas.text(&day.passes.to_string(), (middle, BOTTOM + 30.0), Anchor::Middle, 10.0, token("dim"));
        }
        canvas.text("day", (RIGHT + 6.0, BOTTOM + 14.0), Anchor::Left, 11.0, token("dim"));
        canvas.text("passes", (RIGHT + 6.0, BOTTOM + 30.0), Anchor::Left, 11.0, token("dim"));
    });
    vec![with_tokens(&plot)]
}

/// Frames by bands of elevation: from, to, frames, strengths. Only bands that the way touches.
pub(super) fn bands(signal: &[SignalPoint], path: &[PathPoint]) -> Vec<(u32, u32, Vec<i32>, usize)> {
    (0..9)
        .map(|band| (band * 10, band * 10 + 10))
        .filter_map(|(low, high)| {
            let inside = |elevation: f64| elevation >= f64::from(low) && elevation < f64::from(high);
            // What came from a little below the horizon stands with the lowest.
            let of = |point: &&SignalPoint| {
                point.elevation_deg.is_some_and(|elevation| inside(elevation.clamp(0.0, 89.999)))
            };
            let frames = signal.iter().filter(of).count();
            let is_touched = path.iter().any(|point| inside(point.elevation_deg));
            let mut rssi: Vec<i32> = signal.iter().filter(of).filter_map(|point| point.rssi_dbm).collect();
            rssi.sort_unstable();
            (frames > 0 || is_touched).then_some((low, high, rssi, frames))
        })
        .collect()
}
