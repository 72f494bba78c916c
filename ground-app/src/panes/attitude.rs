//! The body in space, as the satellite tells its attitude.

use ui::attitude::{Attitude, Standpoint, attitude_ui};

use super::{Scene, blank, words};
use crate::model::{Model, Point};

/// Older than this, and the picture is marked as one of the past.
const OLD_US: i64 = 150_000_000;
/// Where the camera looks and the antenna points, in the body. Nobody told: as the twin has them.
const CAMERA: [f64; 3] = [0.0, 0.0, 1.0];
const ANTENNA: [f64; 3] = [0.0, 0.0, -1.0];

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    from: Option<Standpoint>,
}

/// Three values of one packet.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Triple {
    at_us: i64,
    /// `None` where one of them is invalid.
    of: Option<[f64; 3]>,
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let Some(satellite) = scene.satellite().map(|satellite| satellite.satellite.clone()) else {
        return blank::show(ui, scene);
    };
    let model = scene.model;
    let triple = |name: &str| triple(model, &satellite, [".x", ".y", ".z"].map(|end| format!("{name}{end}")));
    let newer = |one: Option<Triple>, other: Option<Triple>| match (one, other) {
        (Some(one), Some(other)) => Some(if other.at_us > one.at_us { other } else { one }),
        (one, other) => one.or(other),
    };
    let Some(mrp) = newer(triple("adcsinfo.attitude"), triple("heartbeat.att")) else {
        ui.weak("The satellite did not tell its attitude yet");
        return;
    };
    let turn = mrp.of.map(quaternion);
    let lit = |sign: &str| {
        let of = ["x", "y", "z"].map(|axis| format!("heartbeat.css.{sign}_{axis}"));
        self::triple(model, &satellite, of).and_then(|lit| lit.of)
    };
    let sun_body =
        lit("plus").zip(lit("minus")).map(|(plus, minus)| [0, 1, 2].map(|axis| plus[axis] - minus[axis]));
    let field_body = newer(triple("adcsinfo.mag"), triple("heartbeat.mag")).and_then(|field| field.of);
    let seen = |body: Option<[f64; 3]>| Some(rotated(turn?, body.filter(|body| length(*body) > 0.0)?));
    let nadir = triple("heartbeat.r_teme").and_then(|place| place.of).map(|place| place.map(|part| -part));
    let attitude = Attitude {
        body_to_reference: turn,
        sun: seen(sun_body),
        field: seen(field_body),
        nadir: nadir.filter(|nadir| length(*nadir) > 0.0),
        camera_body: CAMERA,
        antenna_body: ANTENNA,
        is_eclipsed: false,
    };
    told(ui, scene, mrp, triple("adcsinfo.attitude_error"), triple("heartbeat.omega"));
    let mut from = scene.kept.attitude.from.unwrap_or_default();
    let size = ui.available_size().max(egui::vec2(80.0, 80.0));
    attitude_ui(ui, &attitude, &mut from, size);
    scene.kept.attitude.from = Some(from);
}

/// The age, the angle from the target, and how fast it turns.
fn told(ui: &mut egui::Ui, scene: &Scene<'_>, mrp: Triple, error: Option<Triple>, omega: Option<Triple>) {
    ui.horizontal_wrapped(|ui| {
        let age = scene.now_us.map(|now_us| (now_us - mrp.at_us, words::age(mrp.at_us, now_us)));
        match age {
            Some((age_us, age)) if age_us > OLD_US => drop(ui.label(format!("as of {age} ago"))),
            Some((_, age)) => drop(ui.weak(format!("told {age} ago"))),
            None => {}
        }
        if mrp.of.is_none() {
            ui.label("attitude invalid");
        }
        if let Some(error) = error.and_then(|error| error.of) {
            let angle = ui::format::degrees(Some(4.0 * length(error).atan().to_degrees()));
            ui.weak(format!("{angle} from its target"));
        }
        if let Some(omega) = omega.and_then(|omega| omega.of) {
            let rate = ui::format::number(length(omega).to_degrees(), 2);
            ui.weak(format!("turns {rate} °/s"));
        }
    });
}

fn triple(model: &Model, satellite: &str, names: [String; 3]) -> Option<Triple> {
    let [x, y, z] = names.map(|name| newest(model, satellite, &name));
    let (x, y, z) = (x?, y?, z?);
    let of = match (x.value, y.value, z.value) {
        (Some(x), Some(y), Some(z)) => Some([x, y, z]),
        _ => None,
    };
    Some(Triple { at_us: x.at_us.min(y.at_us).min(z.at_us), of })
}

fn newest(model: &Model, satellite: &str, parameter: &str) -> Option<Point> {
    let live = model.values.points(satellite, parameter).and_then(|points| points.back().copied());
    live.or_else(|| {
        let archived = &model.latest.value()?.items;
        let of =
            archived.iter().find(|value| value.satellite == satellite && value.parameter == parameter)?;
        Some(Point { at_us: of.at.unix_us(), value: of.value, frame: of.frame })
    })
}

/// Modified Rodrigues parameters of the body against the frame of reference, as a turn from the body to that frame:
/// w, x, y, z.
fn quaternion(mrp: [f64; 3]) -> [f64; 4] {
    let square = length(mrp).powi(2);
    let [x, y, z] = mrp.map(|part| 2.0 * part / (1.0 + square));
    [(1.0 - square) / (1.0 + square), x, y, z]
}

/// A vector turned by a unit quaternion.
fn rotated([w, x, y, z]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let axis = [x, y, z];
    let t = cross(axis, v).map(|part| 2.0 * part);
    let u = cross(axis, t);
    [0, 1, 2].map(|part| v[part] + w * t[part] + u[part])
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|part| part * part).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rodrigues_parameters_turn_by_four_times_their_arc() {
        let quarter = (std::f64::consts::FRAC_PI_2 / 4.0).tan();
        let turned = rotated(quaternion([0.0, 0.0, quarter]), [1.0, 0.0, 0.0]);
        let expected = [0.0, 1.0, 0.0];
        assert!((0..3).all(|part| (turned[part] - expected[part]).abs() < 1e-12), "{turned:?}");
        let any = quaternion([0.3, -0.2, 0.9]);
        assert!((any.iter().map(|part| part * part).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((length(rotated(any, [3.0, 4.0, 12.0])) - 13.0).abs() < 1e-9);
    }
}
