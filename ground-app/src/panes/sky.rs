//! Where the satellite stands in the sky.

use api::PassView;
use egui::Ui;
use ui::format;
use ui::sky::{Antenna, Direction, SkyPlot, SkySample};

use super::Scene;
use crate::model::Model;
use crate::orbit;

/// The beam that is drawn where nobody says how wide the antenna sees, degrees.
const BEAM_DEG: f64 = 30.0;
/// A line of figures below the plot.
const FIGURES_HEIGHT: f32 = 44.0;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    path: Option<Path>,
}

/// The way through the sky in one pass.
struct Path {
    of: (String, u64, i64),
    samples: Vec<SkySample>,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let (Some(now_us), Some(satellite)) =
        (scene.now_us, scene.satellite().map(|view| view.satellite.clone()))
    else {
        return super::blank::show(ui, scene);
    };
    let kept = &mut *scene.kept;
    kept.orbits.renew(scene.model);
    let orbits = &kept.orbits;
    let orbit = orbits.of(scene.model, &satellite);
    let (orbit, station) = match (orbit, orbits.station()) {
        (Ok(orbit), Some(station)) => (orbit, station),
        (Err(why), _) => {
            ui.weak(why.to_string());
            return;
        }
        (Ok(_), None) => {
            ui.weak(no_place(scene.model.passes.failure()));
            return;
        }
    };
    let pass = orbit::current_pass(scene.model, &satellite, now_us);
    let samples: &[SkySample] = match pass {
        Some(pass) => {
            let (aos_us, los_us) = orbit::span_us(pass);
            let of = (satellite.clone(), orbits.revision(), aos_us);
            if kept.sky.path.as_ref().is_none_or(|path| path.of != of) {
                kept.sky.path = Some(Path { of, samples: orbit.path(station, aos_us, los_us) });
            }
            kept.sky.path.as_ref().map_or(&[], |path| &path.samples)
        }
        None => &[],
    };
    let plot = SkyPlot {
        now: orbit::timestamp(now_us),
        path: samples,
        mask: orbits.horizon(),
        antenna: antenna(scene.model),
        sun: orbits.sun(now_us),
    };
    plot.show(ui, (ui.available_height() - FIGURES_HEIGHT).max(80.0));
    let look = orbit.look(station, now_us);
    figures(ui, look, pass, now_us);
}

fn no_place(failure: Option<&str>) -> String {
    match failure {
        Some(why) => format!("No passes are known: {why}"),
        None => "The server does not tell where the station stands".to_owned(),
    }
}

/// Where the rotator stands, brought down from an elevation beyond the zenith.
fn antenna(model: &Model) -> Option<Antenna> {
    let (status, _) = model.status.as_ref()?;
    let position = status.antenna.as_ref()?.rotator.as_ref()?.position?;
    let (azimuth_deg, elevation_deg) = if position.elevation_deg > 90.0 {
        (position.azimuth_deg + 180.0, 180.0 - position.elevation_deg)
    } else {
        (position.azimuth_deg, position.elevation_deg)
    };
    let direction = Direction::new(azimuth_deg.rem_euclid(360.0), elevation_deg);
    Some(Antenna { direction, beam_width_deg: BEAM_DEG })
}

fn figures(ui: &mut Ui, look: Option<tle::LookAngles>, pass: Option<&PassView>, now_us: i64) {
    let figure = |of: &dyn Fn(&tle::LookAngles) -> f64| look.as_ref().map(of);
    ui.horizontal_wrapped(|ui| {
        for (name, quantity) in [
            ("azimuth", format::degrees(figure(&|look| look.azimuth_deg))),
            ("elevation", format::degrees(figure(&|look| look.elevation_deg))),
            ("range", format::Quantity::of(figure(&|look| look.range_km), 0, "km")),
            ("range rate", format::Quantity::of(figure(&|look| look.range_rate_km_s), 2, "km/s")),
        ] {
            ui.weak(name);
            ui.monospace(quantity.to_string());
        }
    });
    let words = match pass {
        Some(pass) if orbit::span_us(pass).0 > now_us => {
            let at = orbit::timestamp(orbit::span_us(pass).0);
            let up = format::degrees(Some(pass.max_elevation_deg));
            format!("next pass {}, up to {up}", format::near(at, orbit::timestamp(now_us)))
        }
        Some(pass) => format!("this pass up to {}", format::degrees(Some(pass.max_elevation_deg))),
        None => "no pass within two days".to_owned(),
    };
    ui.weak(words);
}
