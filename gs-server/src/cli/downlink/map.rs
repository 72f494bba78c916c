//! The map: stations, the ground track while the satellite sends, and what it can be heard from.

use std::f64::consts::{FRAC_PI_2, PI};

use mission::UtcUs;
use mission::downlink::{DownlinkPlan, Task};
use mission::sky::instant;
use plotters::style::Color as _;
use tle::ground::{footprint, ground_track, split_at_date_line};
use tle::{Propagator, ecef_from_teme, gmst_rad};

use super::Failure;
use crate::sky::Place;
use crate::sky::svg::{Anchor, Canvas, Part, Px, svg as draw, token};

const WIDTH_PX: u32 = 1080;
const HEIGHT_PX: u32 = 640;
const LEFT_PX: f64 = 24.0;
const TOP_PX: f64 = 56.0;
/// Pixels of a degree.
const SCALE_PX: f64 = (1080.0 - 2.0 * LEFT_PX) / 360.0;

/// Draws it.
pub(super) fn svg(task: &Task, found: &DownlinkPlan, own: &Place) -> Result<String, Failure> {
    let orbit = Propagator::new(&task.elements).map_err(Failure::failed)?;
    let mut tracks = Vec::new();
    for entry in &found.entries {
        let middle = instant(UtcUs(entry.at.0.midpoint(entry.end_at.0)));
        let state = orbit.at(middle).map_err(Failure::failed)?;
        let object = ecef_from_teme(&state, gmst_rad(middle, task.orientation));
        let track = ground_track(&orbit, task.orientation, instant(entry.at), instant(entry.end_at), 5.0)
            .map_err(Failure::failed)?;
        let line: Vec<(f64, f64)> =
            track.iter().map(|point| (point.place.longitude_rad, point.place.latitude_rad)).collect();
        tracks.push((line, footprint(&object, 0.0, 180)));
    }
    let title = format!("Blind downlinks of {}: {} entries", task.elements.label(), found.entries.len());
    Ok(draw(&Part::whole((WIDTH_PX, HEIGHT_PX)), &title, |canvas| {
        canvas.text("Blind downlinks", (LEFT_PX, 26.0), Anchor::Left, 18.0, token("text"));
        let words = format!(
            "{:.0} of {} missing chunks expected; at most {:.0}",
            found.expected_chunks, found.missing, found.upper_bound_chunks
        );
        canvas.text(&words, (f64::from(WIDTH_PX) - LEFT_PX, 26.0), Anchor::Right, 12.0, token("dim"));
        graticule(canvas);
        for (_, edge) in &tracks {
            let closed: Vec<(f64, f64)> = edge.iter().chain(edge.first()).copied().collect();
            for piece in split_at_date_line(&closed) {
                canvas.line(&pixels(&piece), token("accent").mix(0.55), 1.0);
            }
        }
        for listener in &task.listeners {
            let listening = listener.listening(task.from);
            let colour = token("text").mix(0.35 + 0.65 * listening);
            canvas.disc(place_px(&listener.place), 1.6 + 2.0 * listening, colour);
        }
        canvas.ring(place_px(&own.station), 5.0, token("warning"), 1.6);
        for (number, (line, _)) in tracks.iter().enumerate() {
            for piece in split_at_date_line(line) {
                canvas.line(&pixels(&piece), token("accent"), 3.0);
            }
            if let Some(&first) = line.first() {
                let (x, y) = pixel(first);
                canvas.text(&format!("{}", number + 1), (x + 9.0, y), Anchor::Left, 12.0, token("text"));
            }
        }
        let words = "lines: ground track while it sends, numbered in time; rings: its horizon; dots: stations, the larger the \
                     likelier they listen; yellow: our own";
        let below = TOP_PX + 180.0 * SCALE_PX + 26.0;
        canvas.text(words, (LEFT_PX, below), Anchor::Left, 12.0, token("dim"));
    }))
}

fn graticule(canvas: &Canvas<'_>) {
    for step in 0..=12 {
        let longitude = f64::from(step) * PI / 6.0 - PI;
        let strength = if step == 6 { "faint" } else { "edge" };
        canvas.line(&pixels(&[(longitude, -FRAC_PI_2), (longitude, FRAC_PI_2)]), token(strength), 1.0);
    }
    for step in 0..=6 {
        let latitude = f64::from(step) * PI / 6.0 - FRAC_PI_2;
        let strength = if step == 3 { "faint" } else { "edge" };
        canvas.line(&pixels(&[(-PI, latitude), (PI, latitude)]), token(strength), 1.0);
        let (x, y) = pixel((-PI, latitude));
        if step > 0 && step < 6 {
            let degrees = format!("{:.0}°", latitude.to_degrees());
            canvas.text(&degrees, (x + 4.0, y - 7.0), Anchor::Left, 10.0, token("dim"));
        }
    }
}

fn place_px(place: &tle::Station) -> Px {
    let longitude = (place.longitude_deg() + 180.0).rem_euclid(360.0) - 180.0;
    pixel((longitude.to_radians(), place.latitude_deg().to_radians()))
}

fn pixels(line: &[(f64, f64)]) -> Vec<Px> {
    line.iter().map(|&place| pixel(place)).collect()
}

fn pixel((longitude, latitude): (f64, f64)) -> Px {
    (
        LEFT_PX + (longitude.to_degrees() + 180.0) * SCALE_PX,
        TOP_PX + (90.0 - latitude.to_degrees()) * SCALE_PX,
    )
}
