//! `gs-server downlink plan` and `gs-server fit`, over files.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;
use tle::{EarthOrientation, Propagator, Station, UtcInstant, doppler, ecef_from_teme, gmst_rad};

use super::run;

fn example(name: &str) -> String {
    format!("{}/../examples/downlink/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// In 2099, so that the schedule lies ahead; by then nobody knows when the stations were seen.
fn plan(folder: &Path, more: &[&str]) -> (i32, String, String) {
    let moved = |name: &str, what: &str, to: &str| {
        let path = folder.join(name);
        fs::write(&path, fs::read_to_string(example(name)).unwrap().replace(what, to)).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let elements = moved("elements.json", "2026-09-21", "2099-09-21");
    let stations = moved("stations.json", "lastSeen", "seen");
    let mut args = vec![
        "downlink",
        "plan",
        "--elements",
        &elements,
        "--stations",
        &stations,
        "--station",
        "46.5191,6.5668,410",
    ];
    args.extend(["--chunks", "0-112", "--from", "2099-09-22T00:00:00Z"]);
    args.extend(more);
    run(args)
}

#[test]
fn schedule_is_found_told_drawn_and_written_as_a_plan_that_passes_its_check() {
    let folder = tempfile::tempdir().unwrap();
    let (map, text) = (folder.path().join("map.svg"), folder.path().join("night.toml"));
    let (map_name, text_name) = (map.to_str().unwrap(), text.to_str().unwrap());
    let (code, out, error) = plan(
        folder.path(),
        &["--json", "--runs", "5", "--map", map_name, "--plan", text_name, "--name", "night"],
    );
    assert_eq!(code, 0, "{error}");
    let answer: Value = serde_json::from_str(&out).unwrap();
    let number = |key: &str| answer[key].as_f64().unwrap();
    assert_eq!(answer["missing_chunks"], 113);
    assert!(number("expected_chunks") > 60.0 && number("expected_chunks") <= number("upper_bound_chunks"));
    assert!(number("expected_chunks") > number("round_robin_chunks"));
    assert!(answer["rehearsed"]["mean_chunks"].as_f64().unwrap() > 40.0, "{out}");
    let entries = answer["entries"].as_array().unwrap();
    assert!((1..=8).contains(&entries.len()), "{out}");
    assert!(fs::read_to_string(&map).unwrap().contains("Blind downlinks"));
    let (code, out, error) = run(["plan", "check", text_name]);
    assert_eq!(code, 0, "{out}{error}");
    assert_eq!(fs::read_to_string(&text).unwrap().matches("time = ").count(), entries.len());
    let (code, out, _) = plan(folder.path(), &[]);
    assert!(code == 0 && out.contains("expected") && out.contains("at most"), "{out}");
    let (code, _, error) = plan(folder.path(), &["--until", "2099-09-21T00:00:00Z"]);
    assert!(code == 2 && error.contains("before it begins"), "{code}: {error}");
}

#[test]
fn satellite_that_comes_late_is_found_late() {
    let folder = tempfile::tempdir().unwrap();
    let elements = example("elements.json");
    let text = fs::read_to_string(&elements).unwrap();
    let set = tle::formats::sets(&text, tle::formats::Checksums::Strict).unwrap().next().unwrap().unwrap();
    let orbit = Propagator::new(&set.elements).unwrap();
    let mut lines = String::new();
    let start: UtcInstant = "2026-09-21T12:00:00Z".parse().unwrap();
    for (name, latitude, longitude) in
        [("Bern", 46.95, 7.44), ("Madrid", 40.4, -3.7), ("Uppsala", 59.9, 17.6)]
    {
        let station = Station::new(latitude, longitude, 0.0).unwrap();
        for step in 0..4_320 {
            let at = start.plus_seconds(f64::from(step) * 20.0);
            let object = ecef_from_teme(
                &orbit.at(at.plus_seconds(-8.0)).unwrap(),
                gmst_rad(at, EarthOrientation::UT1_IS_UTC),
            );
            let look = station.look(&object);
            if look.elevation_deg > 10.0 {
                let error_hz = 250.0 + doppler::downlink_shift_hz(435e6, look.range_rate_km_s);
                writeln!(
                    lines,
                    "tinygs/me/{name}/tele/rx {{\"station_location\":[{latitude},{longitude}],\"frequency\":435,\
                     \"frequency_error\":{error_hz:.1},\"usec_time\":{},\"data\":\"AAAA\"}}",
                    at.unix_us()
                )
                .unwrap();
            }
        }
    }
    let (heard, corrected) = (folder.path().join("heard.ndjson"), folder.path().join("corrected.json"));
    fs::write(&heard, &lines).unwrap();
    let (heard, corrected_name) = (heard.to_str().unwrap(), corrected.to_str().unwrap());
    let (code, out, error) =
        run(["fit", "--elements", &elements, "--receptions", heard, "--write", corrected_name, "--json"]);
    assert_eq!(code, 0, "{error}");
    let answer: Value = serde_json::from_str(&out).unwrap();
    let (late, sigma) = (answer["late_s"].as_f64().unwrap(), answer["sigma_s"].as_f64().unwrap());
    assert!((late - 8.0).abs() < 3.0 * sigma.max(0.05) && sigma < 2.0, "{out}");
    assert!(fs::read_to_string(&corrected).unwrap().contains("MEAN_ANOMALY"));
    let (code, out, _) = run(["fit", "--elements", &elements, "--receptions", heard]);
    assert!(code == 0 && out.contains("s late") && out.contains("Bern"), "{out}");
    let first = lines.lines().take(3).collect::<Vec<_>>().join("\n");
    fs::write(heard, first).unwrap();
    let (code, _, error) = run(["fit", "--elements", &elements, "--receptions", heard]);
    assert!(code == 1 && error.contains("more of them"), "{code}: {error}");
}
