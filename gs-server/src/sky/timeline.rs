//! The timeline: when which satellite is above which station, and how high.

use api::PassView;
use plotters::style::Color as _;
use tle::UtcInstant;

use super::instant;
use super::svg::{Anchor, Canvas, Px, svg, token};
use super::table::{clock, day};

const WIDTH_PX: u32 = 1080;
const LEFT_PX: f64 = 190.0;
const RIGHT_PX: f64 = 1056.0;
const TOP_PX: f64 = 84.0;
const LANE_PX: f64 = 44.0;
/// Lanes that are drawn.
const LANES_MAX: usize = 60;
/// Satellites of a station that have a lane each; more share one.
const SATELLITES_MAX: usize = 12;
/// Passes of a lane that are drawn: more than there are pixels tell nothing.
const BARS_MAX: usize = 2000;
const HOUR_US: i64 = 3_600_000_000;

/// What a timeline shows.
#[derive(Debug, Clone, Copy)]
pub struct Timeline<'a> {
    /// Where it begins.
    pub start: UtcInstant,
    /// Where it ends.
    pub stop: UtcInstant,
    /// The passes, of any satellites and stations.
    pub passes: &'a [PassView],
}

/// One line of bars.
struct Lane<'a> {
    station: &'a str,
    /// `None`: several satellites.
    satellite: Option<&'a str>,
    passes: Vec<&'a PassView>,
}

/// Draws a bar for each pass, as high as the pass is (full height: the zenith), a lane for each station and satellite.
#[must_use]
pub fn timeline_svg(timeline: &Timeline<'_>) -> String {
    let lanes = lanes(timeline.passes);
    let drawn = lanes.len().clamp(1, LANES_MAX);
    let bottom = TOP_PX + LANE_PX * drawn as f64;
    let height = bottom + if lanes.len() > LANES_MAX { 52.0 } else { 32.0 };
    let title = format!(
        "{} passes, {} {}Z to {} {}Z",
        timeline.passes.len(),
        day(timeline.start),
        clock(timeline.start),
        day(timeline.stop),
        clock(timeline.stop)
    );
    svg((WIDTH_PX, height.ceil() as u32), &title, |canvas| {
        canvas.text("Passes", (24.0, 26.0), Anchor::Left, 18.0, token("text"));
        let words = "height of a bar: greatest elevation, 90° is the whole lane";
        canvas.text(words, (RIGHT_PX, 26.0), Anchor::Right, 12.0, token("dim"));
        axis(canvas, timeline, bottom);
        for (index, lane) in lanes.iter().take(LANES_MAX).enumerate() {
            draw_lane(canvas, timeline, lane, TOP_PX + LANE_PX * index as f64);
        }
        if lanes.is_empty() {
            let middle = (f64::midpoint(LEFT_PX, RIGHT_PX), TOP_PX + LANE_PX / 2.0);
            canvas.text("no passes in this time", middle, Anchor::Middle, 14.0, token("dim"));
        }
        if lanes.len() > LANES_MAX {
            let more = format!("{} lanes more are not drawn", lanes.len() - LANES_MAX);
            canvas.text(&more, (24.0, bottom + 32.0), Anchor::Left, 12.0, token("dim"));
        }
    })
}

/// Stations and satellites in the order in which they first appear.
fn lanes(passes: &[PassView]) -> Vec<Lane<'_>> {
    let mut stations: Vec<(&str, Vec<Lane<'_>>)> = Vec::new();
    for pass in passes {
        let at = stations.iter().position(|(name, _)| *name == pass.station).unwrap_or_else(|| {
            stations.push((&pass.station, Vec::new()));
            stations.len() - 1
        });
        let own = &mut stations[at].1;
        // One more than may be drawn apart shows that they must share; the rest need not be told apart then.
        let known = own.iter().position(|lane| lane.satellite == Some(pass.satellite.as_str()));
        match known.or_else(|| (own.len() > SATELLITES_MAX).then_some(SATELLITES_MAX)) {
            Some(lane) => own[lane].passes.push(pass),
            None => own.push(Lane {
                station: &pass.station,
                satellite: Some(&pass.satellite),
                passes: vec![pass],
            }),
        }
    }
    stations
        .into_iter()
        .flat_map(|(station, own)| {
            if own.len() <= SATELLITES_MAX {
                return own;
            }
            let mut passes: Vec<_> = own.into_iter().flat_map(|lane| lane.passes).collect();
            passes.sort_by_key(|pass| pass.aos);
            vec![Lane { station, satellite: None, passes }]
        })
        .collect()
}

fn x_of(timeline: &Timeline<'_>, at: UtcInstant) -> f64 {
    let whole = timeline.stop.seconds_since(timeline.start).max(1e-6);
    LEFT_PX + (RIGHT_PX - LEFT_PX) * (at.seconds_since(timeline.start) / whole).clamp(0.0, 1.0)
}

/// UTC above the lanes: times at the hours, dates at midnight.
fn axis(canvas: &Canvas<'_>, timeline: &Timeline<'_>, bottom: f64) {
    let window_us = timeline.stop.us_since(timeline.start).max(1);
    // At most 16 labels fit.
    let step_us = [5, 10, 15, 30, 60, 120, 180, 360, 720, 1440]
        .into_iter()
        .map(|minutes| minutes * HOUR_US / 60)
        .find(|step| window_us / step <= 15)
        .unwrap_or_else(|| 24 * HOUR_US * (1 + window_us / (24 * HOUR_US * 15)));
    canvas.text("UTC", (24.0, 66.0), Anchor::Left, 12.0, token("dim"));
    let first = timeline.start.unix_us().div_euclid(step_us) + 1;
    canvas.text(&day(timeline.start), (LEFT_PX, 48.0), Anchor::Left, 12.0, token("text"));
    for tick in first..=timeline.stop.unix_us().div_euclid(step_us) {
        let at = UtcInstant::from_unix_us(tick * step_us);
        let x = x_of(timeline, at);
        let is_midnight = (tick * step_us).rem_euclid(24 * HOUR_US) == 0;
        let colour = if is_midnight { token("faint") } else { token("edge") };
        canvas.line(&[(x, 74.0), (x, bottom)], colour, 1.0);
        if is_midnight && x - LEFT_PX > 76.0 && RIGHT_PX - x > 30.0 {
            canvas.text(&day(at), (x, 48.0), Anchor::Middle, 12.0, token("text"));
        }
        canvas.text(&clock(at)[..5], (x, 66.0), Anchor::Middle, 12.0, token("dim"));
    }
}

fn draw_lane(canvas: &Canvas<'_>, timeline: &Timeline<'_>, lane: &Lane<'_>, top: f64) {
    let base = top + LANE_PX - 4.0;
    canvas.line(&[(24.0, base), (RIGHT_PX, base)], token("edge"), 1.0);
    let name = lane.satellite.map_or_else(|| format!("{} passes", lane.passes.len()), |name| fitting(name, 24));
    canvas.text(&name, (24.0, base - 25.0), Anchor::Left, 12.0, token("text"));
    canvas.text(&fitting(lane.station, 26), (24.0, base - 10.0), Anchor::Left, 11.0, token("dim"));
    let mut free_from = f64::MIN;
    for pass in lane.passes.iter().take(BARS_MAX) {
        let (from, until) = (x_of(timeline, instant(pass.aos)), x_of(timeline, instant(pass.los)));
        let until = until.max(from + 2.0);
        let height = (LANE_PX - 16.0) * (pass.max_elevation_deg / 90.0).clamp(0.04, 1.0);
        let colour = token("accent");
        // What never rises far is of little use, and looks it.
        let colour = if pass.max_elevation_deg < 10.0 { colour.mix(0.55) } else { colour };
        canvas.rectangle((from, base - height), (until, base), colour);
        for (is_cut, x) in [(pass.aos_clipped, from), (pass.los_clipped, until)] {
            if is_cut {
                canvas.line(&[(x, top + 10.0), (x, base)], token("warning"), 1.5);
            }
        }
        let label = format!("{:.0}°", pass.max_elevation_deg);
        let middle: Px = (f64::midpoint(from, until), base - height - 7.0);
        let half = 3.5 * label.chars().count() as f64;
        if middle.0 - half > free_from && middle.0 + half <= RIGHT_PX + 12.0 {
            canvas.text(&label, middle, Anchor::Middle, 10.0, token("dim"));
            free_from = middle.0 + half + 2.0;
        }
    }
}

fn fitting(name: &str, most: usize) -> String {
    if name.chars().count() <= most {
        name.to_owned()
    } else {
        name.chars().take(most - 1).chain(['…']).collect()
    }
}
