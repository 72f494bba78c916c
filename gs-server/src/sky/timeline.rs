//! The timeline: when which satellite is above which station, and how high.

use api::PassView;
use plotters::style::Color as _;
use tle::UtcInstant;

use super::svg::{Anchor, Canvas, Part, Px, svg, token};
use super::table::{clock, day};
use super::{PlotForm, instant};

const WIDTH_PX: u32 = 1080;
/// Narrower than this, names stand above their lanes and not beside them.
const NARROW_PX: u32 = 640;
const LEFT_PX: f64 = 190.0;
const MARGIN_PX: f64 = 24.0;
const TOP_PX: f64 = 84.0;
/// Room for a name above its lane.
const NAME_PX: f64 = 18.0;
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

/// What is drawn on: the timeline, and where its bars may stand.
struct Sheet<'a> {
    timeline: &'a Timeline<'a>,
    is_narrow: bool,
    left: f64,
    right: f64,
    lane: f64,
}

impl<'a> Sheet<'a> {
    fn new(timeline: &'a Timeline<'a>, width_px: u32) -> Self {
        let is_narrow = width_px < NARROW_PX;
        Self {
            timeline,
            is_narrow,
            left: if is_narrow { MARGIN_PX } else { LEFT_PX },
            right: f64::from(width_px) - MARGIN_PX,
            lane: if is_narrow { LANE_PX + NAME_PX } else { LANE_PX },
        }
    }

    fn x_of(&self, at: UtcInstant) -> f64 {
        let whole = self.timeline.stop.seconds_since(self.timeline.start).max(1e-6);
        self.left + (self.right - self.left) * (at.seconds_since(self.timeline.start) / whole).clamp(0.0, 1.0)
    }
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
    timeline_svg_of_width(timeline, WIDTH_PX, PlotForm::Full)
}

/// [`timeline_svg`] for a page or screen of this width, the least being 280, and in a compact form without its heading.
#[must_use]
pub fn timeline_svg_of_width(timeline: &Timeline<'_>, width_px: u32, form: PlotForm) -> String {
    let width_px = width_px.clamp(280, 4000);
    let sheet = Sheet::new(timeline, width_px);
    let lanes = lanes(timeline.passes);
    let drawn = lanes.len().clamp(1, LANES_MAX);
    let bottom = TOP_PX + sheet.lane * drawn as f64;
    let height = bottom + if lanes.len() > LANES_MAX { 52.0 } else { 32.0 };
    let title = format!(
        "{} passes, {} {}Z to {} {}Z",
        timeline.passes.len(),
        day(timeline.start),
        clock(timeline.start),
        day(timeline.stop),
        clock(timeline.stop)
    );
    let size_px = (width_px, height.ceil() as u32);
    let part = match form {
        PlotForm::Full => Part::whole(size_px),
        PlotForm::Compact => {
            let (above, below) = (34, 20);
            let part_px = (width_px, size_px.1 - above - below);
            Part { size_px, corner_px: (0, above), part_px, text_scale: 1.0 }
        }
    };
    svg(&part, &title, |canvas| {
        canvas.text("Passes", (24.0, 26.0), Anchor::Left, 18.0, token("text"));
        if !sheet.is_narrow {
            let words = "height of a bar: greatest elevation, 90° is the whole lane";
            canvas.text(words, (sheet.right, 26.0), Anchor::Right, 12.0, token("dim"));
        }
        axis(canvas, &sheet, bottom);
        for (index, lane) in lanes.iter().take(LANES_MAX).enumerate() {
            draw_lane(canvas, &sheet, lane, TOP_PX + sheet.lane * index as f64);
        }
        if lanes.is_empty() {
            let middle = (f64::midpoint(sheet.left, sheet.right), TOP_PX + sheet.lane / 2.0);
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

/// UTC above the lanes: times at the hours, dates at midnight.
fn axis(canvas: &Canvas<'_>, sheet: &Sheet<'_>, bottom: f64) {
    let timeline = sheet.timeline;
    let window_us = timeline.stop.us_since(timeline.start).max(1);
    // A label takes 54 pixels.
    let most = ((sheet.right - sheet.left) / 54.0) as i64 - 1;
    let step_us = [5, 10, 15, 30, 60, 120, 180, 360, 720, 1440]
        .into_iter()
        .map(|minutes| minutes * HOUR_US / 60)
        .find(|step| window_us / step <= most)
        .unwrap_or_else(|| 24 * HOUR_US * (1 + window_us / (24 * HOUR_US * most.max(1))));
    if !sheet.is_narrow {
        canvas.text("UTC", (24.0, 66.0), Anchor::Left, 12.0, token("dim"));
    }
    let first = timeline.start.unix_us().div_euclid(step_us) + 1;
    let date = format!("{}{}", day(timeline.start), if sheet.is_narrow { " UTC" } else { "" });
    canvas.text(&date, (sheet.left, 48.0), Anchor::Left, 12.0, token("text"));
    let taken = if sheet.is_narrow { 136.0 } else { 110.0 };
    for tick in first..=timeline.stop.unix_us().div_euclid(step_us) {
        let at = UtcInstant::from_unix_us(tick * step_us);
        let x = sheet.x_of(at);
        let is_midnight = (tick * step_us).rem_euclid(24 * HOUR_US) == 0;
        let colour = if is_midnight { token("faint") } else { token("edge") };
        canvas.line(&[(x, 74.0), (x, bottom)], colour, 1.0);
        if is_midnight && x - sheet.left > taken && sheet.right - x > 12.0 {
            canvas.text(&day(at), (x, 48.0), Anchor::Middle, 12.0, token("text"));
        }
        canvas.text(&clock(at)[..5], (x, 66.0), Anchor::Middle, 12.0, token("dim"));
    }
}

fn draw_lane(canvas: &Canvas<'_>, sheet: &Sheet<'_>, lane: &Lane<'_>, top: f64) {
    let base = top + sheet.lane - 4.0;
    canvas.line(&[(24.0, base), (sheet.right, base)], token("edge"), 1.0);
    let name =
        lane.satellite.map_or_else(|| format!("{} passes", lane.passes.len()), |name| fitting(name, 24));
    if sheet.is_narrow {
        let both = format!("{name} over {}", fitting(lane.station, 20));
        canvas.text(&both, (24.0, top + 10.0), Anchor::Left, 11.0, token("text"));
    } else {
        canvas.text(&name, (24.0, base - 25.0), Anchor::Left, 12.0, token("text"));
        canvas.text(&fitting(lane.station, 26), (24.0, base - 10.0), Anchor::Left, 11.0, token("dim"));
    }
    let top = base + 4.0 - LANE_PX;
    let mut free_from = f64::MIN;
    for pass in lane.passes.iter().take(BARS_MAX) {
        let (from, until) = (sheet.x_of(instant(pass.aos)), sheet.x_of(instant(pass.los)));
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
        if middle.0 - half > free_from && middle.0 + half <= sheet.right + 12.0 {
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
