//! Sky and Earth: a pass over Lausanne by an orbit that is simple, not ours.

use egui::Ui;
use ui::geo::{Place, circle};
use ui::map::{Receiver, Satellite, Station, TrackPoint, World, WorldMap};
use ui::map_base::View;
use ui::sky::{Antenna, Direction, SkyPlot, SkySample};

use crate::desk::{now, seconds};

/// A pass that goes straight over the sky from one azimuth to another, at this distance from the zenith.
fn pass(from_deg: f64, to_deg: f64, highest_deg: f64) -> Vec<SkySample> {
    let at = |deg: f64| (deg.to_radians().sin(), deg.to_radians().cos());
    let (from, to) = (at(from_deg), at(to_deg));
    let middle = ((from.0 + to.0) / 2.0, (from.1 + to.1) / 2.0);
    let length = middle.0.hypot(middle.1).max(1e-9);
    let wanted = (90.0 - highest_deg) / 90.0;
    let bend = (middle.0 / length * wanted - middle.0, middle.1 / length * wanted - middle.1);
    (0..=48)
        .map(|step| {
            let along = f64::from(step) / 48.0;
            // Slow at the horizon, fast at the top
            let part = along + 0.12 * (along * std::f64::consts::TAU).sin();
            let arch = 4.0 * part * (1.0 - part);
            let x = from.0 + (to.0 - from.0) * part + bend.0 * arch;
            let y = from.1 + (to.1 - from.1) * part + bend.1 * arch;
            let azimuth_deg = x.atan2(y).to_degrees().rem_euclid(360.0);
            let direction = Direction::new(azimuth_deg, 90.0 * (1.0 - x.hypot(y).min(1.0)));
            SkySample { at: now() + seconds(i64::from(step) * 12 - 230), direction }
        })
        .collect()
}

const MASK: [(f64, f64); 8] = [
    (0.0, 4.0),
    (40.0, 6.0),
    (80.0, 12.0),
    (110.0, 9.0),
    (150.0, 14.0),
    (200.0, 8.0),
    (250.0, 3.0),
    (310.0, 5.0),
];

pub(crate) fn sky(ui: &mut Ui) {
    let path = pass(195.0, 25.0, 62.0);
    SkyPlot {
        now: now(),
        path: &path,
        mask: &MASK,
        antenna: Some(Antenna { direction: Direction::new(230.0, 44.0), beam_width_deg: 40.0 }),
        sun: Some(Direction::new(215.0, 18.0)),
    }
    .show(ui, 416.0);
}

pub(crate) fn sky_over_north(ui: &mut Ui) {
    let path = pass(310.0, 60.0, 35.0);
    SkyPlot {
        now: now() - seconds(400),
        path: &path,
        mask: &[],
        antenna: Some(Antenna { direction: Direction::new(350.0, 5.0), beam_width_deg: 60.0 }),
        sun: None,
    }
    .show(ui, 416.0);
}

fn track(minutes: std::ops::RangeInclusive<i64>) -> Vec<TrackPoint> {
    minutes
        .map(|minute| TrackPoint { at: now() + seconds(minute * 60), place: below(minute as f64) })
        .collect()
}

/// Below a satellite of 97.5 degrees inclination, 95 minutes a turn, some minutes from now.
fn below(minutes: f64) -> Place {
    let along = (minutes / 95.0 * 360.0 + 35.0).to_radians();
    let inclination = 97.5_f64.to_radians();
    let latitude = (along.sin() * inclination.sin()).asin();
    let longitude = (along.sin() * inclination.cos()).atan2(along.cos());
    Place::new(longitude.to_degrees() + 5.0 - minutes * 0.25, latitude.to_degrees())
}

fn world(ui: &mut Ui, view: View) {
    let track = track(-60..=190);
    let here = below(0.0);
    let footprint = circle(here, 21.0, 90);
    let receivers: Vec<Receiver<'_>> = [
        ("volunteer 1", -0.1, 51.5, 600),
        ("volunteer 2", 12.5, 41.9, 90_000),
        ("volunteer 3", 139.7, 35.7, 2_000_000),
        ("volunteer 4", -46.6, -23.5, 50_000),
        ("volunteer 5", 151.2, -33.9, 300_000),
        ("volunteer 6", 2.35, 48.9, 1_000),
        ("volunteer 7", -122.4, 37.8, 4_000),
        ("volunteer 8", 28.0, -26.2, 500_000),
    ]
    .into_iter()
    .map(|(name, x, y, age)| Receiver { name, place: Place::new(x, y), last_heard: now() - seconds(age) })
    .collect();
    let mut map = WorldMap::new(view);
    map.show(
        ui,
        496.0,
        &World {
            now: now(),
            subsolar: Some(Place::new(-34.0, -20.2)),
            satellites: &[
                Satellite {
                    name: "PixelSat I",
                    place: Some(here),
                    track: &track,
                    footprint: &footprint,
                    is_ours: true,
                },
                Satellite {
                    name: "CHESS",
                    place: Some(below(52.0)),
                    track: &[],
                    footprint: &[],
                    is_ours: false,
                },
            ],
            stations: &[
                Station { name: "Lausanne", place: Place::new(6.57, 46.52) },
                Station { name: "Svalbard", place: Place::new(15.4, 78.2) },
            ],
            receivers: &receivers,
        },
    );
}

pub(crate) fn map(ui: &mut Ui) {
    world(ui, View::default());
}

pub(crate) fn map_near(ui: &mut Ui) {
    world(ui, View { centre: Place::new(10.0, 47.0), zoom: 8.0 });
}
