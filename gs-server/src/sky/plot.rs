//! The sky plot: a pass as it stands over the station's head.

use api::PassView;
use tle::propagator::{ElementsError, PropagationError};
use tle::{EarthOrientation, Elements, HorizonMask, Propagator, UtcInstant};

use super::svg::{Anchor, Canvas, Part, Px, svg, token};
use super::table::{clock, day};
use super::track::TrackPoint;
use super::{Place, SkyTrack, instant};

const SIZE_PX: (u32, u32) = (600, 720);
const CENTRE: Px = (300.0, 334.0);
const RADIUS_PX: f64 = 240.0;
/// How far below the horizon a path is drawn, degrees.
const LOWEST_DEG: f64 = -6.0;
/// Tick labels that fit along a path.
const LABELS_MAX: usize = 8;

/// What a sky plot shows.
#[derive(Debug, Clone, Copy)]
pub struct SkyPlot<'a> {
    /// Name of the satellite.
    pub satellite: &'a str,
    /// Name of the station.
    pub station: &'a str,
    /// What its horizon hides.
    pub mask: &'a HorizonMask,
    /// The pass.
    pub track: &'a SkyTrack,
}

/// Draws a pass: north up, east right, rings at 0, 30, 60 degrees and the zenith in the middle, a tick each minute, the
/// mask shaded, the path dimmed where the satellite is in the Earth's shadow.
#[must_use]
pub fn sky_plot_svg(plot: &SkyPlot<'_>) -> String {
    draw(plot, None, PlotForm::Full)
}

/// `here`: where the satellite is now, when that is to be shown.
fn draw(plot: &SkyPlot<'_>, here: Option<&TrackPoint>, form: PlotForm) -> String {
    let track = plot.track;
    let title = format!(
        "{} over {}, {} {}Z, {:.0}°",
        plot.satellite,
        plot.station,
        day(track.aos.at),
        clock(track.aos.at),
        track.tca.elevation_deg
    );
    let part = match form {
        PlotForm::Full => Part::whole(SIZE_PX),
        PlotForm::Compact => {
            Part { size_px: SIZE_PX, corner_px: (18, 52), part_px: (564, 564), text_scale: 1.8 }
        }
    };
    svg(&part, &title, |canvas| {
        if form == PlotForm::Full {
            canvas.text(plot.satellite, (24.0, 26.0), Anchor::Left, 18.0, token("text"));
            let under = format!("over {}", plot.station);
            canvas.text(&under, (24.0, 48.0), Anchor::Left, 12.0, token("dim"));
            canvas.text(
                &format!("{} UTC", day(track.tca.at)),
                (576.0, 26.0),
                Anchor::Right,
                14.0,
                token("dim"),
            );
        }
        dial(canvas, plot.mask);
        path(canvas, track, form);
        if let Some(here) = here.filter(|here| here.elevation_deg > LOWEST_DEG) {
            satellite(canvas, here);
        }
        if form == PlotForm::Full {
            legend(canvas, plot);
        }
    })
}

/// How much a plot tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PlotForm {
    /// With title and a table of AOS, TCA and LOS.
    #[default]
    Full,
    /// The sky alone, with texts that can be read at half the size.
    Compact,
}

/// A pass that cannot be drawn: the elements are not those of the pass.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PlotError {
    /// They describe no orbit.
    #[error(transparent)]
    Elements(#[from] ElementsError),
    /// They have no state at TCA.
    #[error(transparent)]
    NoState(#[from] PropagationError),
}

/// Draws a pass of these elements over a place; see [`sky_plot_svg`].
///
/// # Errors
/// When the pass is not of these elements.
pub fn plot_pass(
    pass: &PassView,
    elements: &Elements,
    over: &Place,
    orientation: EarthOrientation,
) -> Result<String, PlotError> {
    let propagator = Propagator::new(elements)?;
    let times = (instant(pass.aos), instant(pass.tca), instant(pass.los));
    let track = SkyTrack::new(&propagator, &over.station, orientation, times)?;
    Ok(sky_plot_svg(&SkyPlot {
        satellite: &pass.satellite,
        station: &pass.station,
        mask: over.station.mask(),
        track: &track,
    }))
}

/// [`plot_pass`] with a mark where the satellite stands at `at`, when it is up.
///
/// # Errors
/// When the pass is not of these elements.
pub fn plot_pass_at(
    pass: &PassView,
    elements: &Elements,
    over: &Place,
    orientation: EarthOrientation,
    at: UtcInstant,
    form: PlotForm,
) -> Result<String, PlotError> {
    let propagator = Propagator::new(elements)?;
    let times = (instant(pass.aos), instant(pass.tca), instant(pass.los));
    let track = SkyTrack::new(&propagator, &over.station, orientation, times)?;
    let plot = SkyPlot {
        satellite: &pass.satellite,
        station: &pass.station,
        mask: over.station.mask(),
        track: &track,
    };
    // Outside of the pass there is nothing to mark.
    let is_up = times.0 <= at && at <= times.2;
    let here = is_up.then(|| TrackPoint::at(&propagator, &over.station, orientation, at));
    Ok(draw(&plot, here.and_then(Result::ok).as_ref(), form))
}

/// The satellite itself: a filled dot in a ring, the largest mark of the plot.
fn satellite(canvas: &Canvas<'_>, here: &TrackPoint) {
    canvas.disc(of(here), 9.0, token("ground"));
    canvas.ring(of(here), 9.0, token("accent"), 2.0);
    canvas.disc(of(here), 5.0, token("accent"));
}

fn place(azimuth_deg: f64, elevation_deg: f64) -> Px {
    let radius = RADIUS_PX * (90.0 - elevation_deg.max(LOWEST_DEG)) / 90.0;
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    (CENTRE.0 + radius * sin, CENTRE.1 - radius * cos)
}

fn of(point: &TrackPoint) -> Px {
    place(point.azimuth_deg, point.elevation_deg)
}

fn dial(canvas: &Canvas<'_>, mask: &HorizonMask) {
    canvas.disc(CENTRE, RADIUS_PX, token("panel"));
    if mask.range_deg().1 > 0.0 {
        // Round the horizon and back along the mask.
        let azimuths = (0..=360).map(f64::from);
        let mut points: Vec<Px> = azimuths.clone().map(|azimuth| place(azimuth, 0.0)).collect();
        let edge: Vec<Px> =
            azimuths.rev().map(|azimuth| place(azimuth, mask.elevation_deg(azimuth).max(0.0))).collect();
        points.extend(&edge);
        canvas.polygon(&points, token("edge"));
        canvas.line(&edge, token("faint"), 1.0);
    }
    for elevation in [0.0, 30.0, 60.0] {
        let radius = RADIUS_PX * (90.0 - elevation) / 90.0;
        canvas.ring(CENTRE, radius, token("faint"), if elevation == 0.0 { 1.5 } else { 1.0 });
    }
    for azimuth in [0.0, 90.0, 180.0, 270.0] {
        canvas.line(&[place(azimuth, 0.0), place(azimuth, 88.0)], token("edge"), 1.0);
    }
    for azimuth in (0..360).step_by(30).map(f64::from) {
        canvas.line(&[place(azimuth, 0.0), place(azimuth, 2.0)], token("faint"), 1.0);
    }
    canvas.disc(CENTRE, 1.5, token("faint"));
    for (elevation, text) in [(30.0, "30°"), (60.0, "60°")] {
        let (x, y) = place(45.0, elevation);
        canvas.text(text, (x + 4.0, y - 6.0), Anchor::Left, 11.0, token("faint"));
    }
    for (azimuth, letter) in [(0.0, "N"), (90.0, "E"), (180.0, "S"), (270.0, "W")] {
        let (sin, cos) = f64::to_radians(azimuth).sin_cos();
        let radius = RADIUS_PX + 16.0;
        let at = (CENTRE.0 + radius * sin, CENTRE.1 - radius * cos);
        canvas.text(letter, at, Anchor::Middle, 14.0, token("dim"));
    }
}

fn path(canvas: &Canvas<'_>, track: &SkyTrack, form: PlotForm) {
    // A piece per stretch of light or shadow; neighbours share a point, so that no gap shows.
    let mut from = 0;
    for (index, pair) in track.path.windows(2).enumerate() {
        let is_last = index + 2 == track.path.len();
        if pair[0].sunlit != pair[1].sunlit || is_last {
            let until = if is_last { index + 1 } else { index };
            let piece: Vec<Px> = track.path[from..=until].iter().map(of).collect();
            let colour = if pair[0].sunlit { token("accent") } else { token("dim") };
            canvas.line(&piece, colour, 2.0);
            from = until;
        }
    }
    // Larger labels need more room, outwards as well.
    let (labels, room) = if form == PlotForm::Full { (LABELS_MAX, 1.0) } else { (LABELS_MAX / 2, 1.6) };
    let every = track.ticks.len().div_ceil(labels).max(1);
    for (index, tick) in track.ticks.iter().enumerate() {
        let at = of(tick);
        let along = direction(track, tick);
        let across = (-along.1, along.0);
        canvas.line(
            &[(at.0 - 4.0 * across.0, at.1 - 4.0 * across.1), (at.0 + 4.0 * across.0, at.1 + 4.0 * across.1)],
            token("text"),
            1.0,
        );
        let near_mark =
            [&track.aos, &track.tca, &track.los].iter().any(|mark| distance(of(mark), at) < 34.0 * room);
        if index % every == every / 2 && !near_mark {
            // On the side away from the zenith, where there is room.
            let outwards =
                if (at.0 - CENTRE.0) * across.0 + (at.1 - CENTRE.1) * across.1 < 0.0 { -1.0 } else { 1.0 };
            let (dx, dy) = (across.0 * outwards * 9.0 * room, across.1 * outwards * 11.0 * room);
            let anchor = side(dx);
            let label = clock(tick.at);
            canvas.text(&label[..5], (at.0 + dx, at.1 + dy), anchor, 11.0, token("dim"));
        }
    }
    arrow(canvas, track);
    for (name, mark) in [("AOS", &track.aos), ("TCA", &track.tca), ("LOS", &track.los)] {
        let at = of(mark);
        canvas.disc(at, 4.5, token("ground"));
        canvas.disc(at, 3.5, if name == "AOS" { token("accent") } else { token("text") });
        let (dx, dy) = (at.0 - CENTRE.0, at.1 - CENTRE.1);
        let off = dx.hypot(dy);
        let (ux, uy) = if off > 1.0 { (dx / off, dy / off) } else { (0.0, -1.0) };
        let label_at = if name == "TCA" {
            // Towards the zenith: the ticks' labels stand on the other side.
            (at.0 - 12.0 * ux, at.1 - 14.0 * uy)
        } else {
            (at.0 + 14.0 * ux, at.1 + 14.0 * uy)
        };
        let anchor = if name == "TCA" { side(-ux * 10.0) } else { side(ux * 10.0) };
        // Beside the letter of a cardinal point, not upon it.
        let on_letter = [(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)].iter().any(|&(x, y)| {
            distance((CENTRE.0 + x * (RADIUS_PX + 16.0), CENTRE.1 + y * (RADIUS_PX + 16.0)), label_at) < 22.0
        });
        let label_at = if on_letter && name != "TCA" {
            (label_at.0 + 18.0 * ux, label_at.1 + 14.0 * uy)
        } else {
            label_at
        };
        canvas.text(name, label_at, anchor, 12.0, token("text"));
    }
}

/// Which way the satellite goes.
fn arrow(canvas: &Canvas<'_>, track: &SkyTrack) {
    let at = track.path.len() * 7 / 10;
    let Some(point) = track.path.get(at) else { return };
    let (tip, along) = (of(point), direction(track, point));
    let across = (-along.1, along.0);
    let corner = |side: f64| {
        (tip.0 - 10.0 * along.0 + side * 5.0 * across.0, tip.1 - 10.0 * along.1 + side * 5.0 * across.1)
    };
    canvas.polygon(
        &[tip, corner(1.0), corner(-1.0)],
        if point.sunlit { token("accent") } else { token("dim") },
    );
}

/// The path's direction on the picture, of length 1.
fn direction(track: &SkyTrack, point: &TrackPoint) -> Px {
    let after = track.path.partition_point(|other| other.at <= point.at).clamp(1, track.path.len() - 1);
    let (from, to) = (of(&track.path[after - 1]), of(&track.path[after]));
    let length = distance(from, to);
    if length > 0.0 { ((to.0 - from.0) / length, (to.1 - from.1) / length) } else { (1.0, 0.0) }
}

fn distance(a: Px, b: Px) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

fn side(dx: f64) -> Anchor {
    if dx > 3.0 {
        Anchor::Left
    } else if dx < -3.0 {
        Anchor::Right
    } else {
        Anchor::Middle
    }
}

fn legend(canvas: &Canvas<'_>, plot: &SkyPlot<'_>) {
    let columns =
        [(64.0, Anchor::Left), (216.0, Anchor::Right), (306.0, Anchor::Right), (396.0, Anchor::Right)];
    let row = |y: f64, cells: [&str; 5], colour: &str| {
        canvas.text(cells[0], (24.0, y), Anchor::Left, 12.0, token("dim"));
        for (cell, (x, anchor)) in cells[1..].iter().zip(columns) {
            canvas.text(cell, (x, y), anchor, 12.0, token(colour));
        }
    };
    row(636.0, ["", "UTC", "azimuth", "elevation", "range"], "dim");
    let marks = [("AOS", &plot.track.aos), ("TCA", &plot.track.tca), ("LOS", &plot.track.los)];
    for ((name, mark), y) in marks.into_iter().zip([656.0, 676.0, 696.0]) {
        let cells = [
            format!("{}Z", clock(mark.at)),
            format!("{:.1}°", mark.azimuth_deg),
            // Without a sign before a horizon that is met to the last digit.
            format!("{:.1}°", (mark.elevation_deg * 10.0).round() / 10.0 + 0.0),
            format!("{:.0} km", mark.range_km),
        ];
        row(y, [name, &cells[0], &cells[1], &cells[2], &cells[3]], "text");
    }
    let mut y = 656.0;
    let has = |lit: bool| plot.track.path.iter().any(|point| point.sunlit == lit);
    for (is_there, colour, words) in [(has(true), "accent", "in sunlight"), (has(false), "dim", "in shadow")]
    {
        if is_there {
            canvas.line(&[(450.0, y), (474.0, y)], token(colour), 2.0);
            canvas.text(words, (482.0, y), Anchor::Left, 12.0, token("dim"));
            y += 20.0;
        }
    }
    if plot.mask.range_deg().1 > 0.0 {
        canvas.rectangle((450.0, y - 5.0), (474.0, y + 5.0), token("edge"));
        canvas.text("horizon mask", (482.0, y), Anchor::Left, 12.0, token("dim"));
    }
}
