//! A satellite that passes when a test wants it: real elements, turned so that a real pass begins at a given time.

use api::FineTime;
use serde_json::{Value, json};

use crate::Folder;
use crate::process::{gs_server, run};

/// What stands in the station's section: where it is.
pub const PLACE: &str = "latitude_deg = 46.5191\nlongitude_deg = 6.5668\nheight_m = 410\n";
/// What stands in the satellite's section: which elements are its own.
pub const NUMBER: &str = "norad_cat_id = 100123\n";
/// Degrees that the Earth turns in a second, against the stars.
const EARTH_DEG_S: f64 = 360.985_647_3 / 86_400.0;

fn omm(epoch_us: i64, raan_deg: f64) -> Value {
    let epoch = FineTime::from_unix_us(epoch_us).to_string();
    json!([{
        "OBJECT_NAME": "SAT", "OBJECT_ID": "2026-101C", "NORAD_CAT_ID": 100_123,
        "EPOCH": epoch.trim_end_matches('Z'), "MEAN_MOTION": 15.2, "ECCENTRICITY": 0.001,
        "INCLINATION": 97.4, "RA_OF_ASC_NODE": raan_deg.rem_euclid(360.0), "ARG_OF_PERICENTER": 20, "MEAN_ANOMALY": 30,
        "BSTAR": 0.0001, "MEAN_MOTION_DOT": 0.00001,
    }])
}

/// The passes of a day over the station, as the program tells them: AOS, duration in seconds, greatest elevation.
fn passes(folder: &Folder, omm: &Value, start_us: i64) -> Vec<(i64, f64, f64)> {
    let file = folder.file("overhead.json");
    std::fs::write(&file, omm.to_string()).expect("a file");
    let start = FineTime::from_unix_us(start_us).to_string();
    let mut command =
        gs_server(["passes", "--json", "--station", "46.5191,6.5668,410", "--start", &start, "--elements"]);
    command.arg(file);
    let (code, out, error) = run(command);
    assert_eq!(code, 0, "{error}");
    let told: Value = serde_json::from_str(&out).expect("JSON");
    let number = |pass: &Value, name: &str| pass[name].as_f64().expect("a number");
    let us = |text: &Value| {
        text.as_str().and_then(|text| text.parse::<FineTime>().ok()).expect("a time").unix_us()
    };
    let list = told["passes"].as_array().expect("passes");
    list.iter()
        .map(|pass| (us(&pass["aos"]), number(pass, "duration_s"), number(pass, "max_elevation_deg")))
        .collect()
}

/// Elements by which a pass of eight minutes at least begins at this time, to a few seconds.
///
/// The passes of a day depend on the orbit's plane: where one plane has no good pass at this hour, the next is tried.
///
/// # Panics
/// When the sky cannot be arranged so.
#[must_use]
pub fn elements(folder: &Folder, aos_us: i64) -> String {
    let planes = (0..12_u8).map(|step| 10.0 + 30.0 * f64::from(step));
    let mut found = planes.filter_map(|raan_deg| turned(folder, aos_us, raan_deg));
    found.next().expect("a plane that has a good pass").to_string()
}

/// The elements of the plane with this node, made later or earlier and turned with the Earth until a good pass begins at this time.
fn turned(folder: &Folder, aos_us: i64, raan_deg: f64) -> Option<Value> {
    let epoch_us = aos_us - 7_200_000_000;
    let found = passes(folder, &omm(epoch_us, raan_deg), epoch_us);
    let good = |(at, lasts_s, high): &&(i64, f64, f64)| {
        *at > epoch_us + 600_000_000 && *lasts_s > 500.0 && *high > 30.0
    };
    let (at, ..) = found.iter().find(good)?;
    // Everything so much earlier, and the orbit's plane turned back with the Earth.
    let shift_us = aos_us - at;
    let turned = omm(epoch_us + shift_us, raan_deg + EARTH_DEG_S * shift_us as f64 / 1e6);
    let found = passes(folder, &turned, aos_us - 600_000_000);
    let is_so = found.iter().any(|(at, lasts_s, _)| at.abs_diff(aos_us) < 5_000_000 && *lasts_s > 480.0);
    is_so.then_some(turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_every_hour_of_a_day_a_pass_can_be_arranged() {
        let folder = Folder::new();
        let noon_us = 1_795_600_000_000_000;
        for hour in 0..24 {
            assert!(!elements(&folder, noon_us + hour * 3_600_000_000).is_empty());
        }
    }
}
