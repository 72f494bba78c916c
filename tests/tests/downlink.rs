//! The planner of blind downlinks beside a running server: its elements, its place, what its images miss, and who heard it.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::fmt::Write as _;

use end_to_end::process::{gs_server, run};
use end_to_end::{Folder, Server};
use serde_json::{Value, json};

/// So many hours before the server's now, UTC.
fn hours_ago(server: &Server, hours: i64) -> String {
    api::Time::from_unix_us(server.station().at.unix_us() - hours * 3_600_000_000).to_string()
}

fn verb(folder: &Folder, words: &[&str]) -> (i32, String, String) {
    let mut command = gs_server(words);
    command.arg("--config").arg(folder.write_config());
    run(command)
}

fn file(folder: &Folder, name: &str, text: &str) -> String {
    let path = folder.file(name);
    std::fs::write(&path, text).expect("a file");
    path.display().to_string()
}

#[test]
fn planner_takes_what_the_station_knows_and_its_plan_goes_the_way_of_every_plan() {
    let mut folder = Folder::new();
    folder.station = "latitude_deg = 46.52\nlongitude_deg = 6.57\nheight_m = 410\n".into();
    folder.satellite = "norad_cat_id = 100123\n".into();
    let server = Server::start(&folder);
    let set = json!([{"OBJECT_NAME": "SAT", "OBJECT_ID": "2026-101C", "EPOCH": hours_ago(&server, 1).trim_end_matches('Z'), "MEAN_MOTION": 15.2,
        "ECCENTRICITY": 0.001, "INCLINATION": 97.4, "RA_OF_ASC_NODE": 10, "ARG_OF_PERICENTER": 20, "MEAN_ANOMALY": 30, "EPHEMERIS_TYPE": 0,
        "CLASSIFICATION_TYPE": "U", "NORAD_CAT_ID": 100123, "ELEMENT_SET_NO": 999, "REV_AT_EPOCH": 7, "BSTAR": 0.0001,
        "MEAN_MOTION_DOT": 0.00001, "MEAN_MOTION_DDOT": 0}]);
    let elements = file(&folder, "gp.json", &set.to_string());
    let (code, out, error) = verb(&folder, &["elements", "add", &elements]);
    assert_eq!(code, 0, "{out}{error}");

    let plan = ["downlink", "plan", "--chunks", "0-40", "--json"];
    let (code, _, error) = verb(&folder, &plan);
    assert!(code == 1 && error.contains("nobody has heard the satellite yet"), "{code}: {error}");
    let (code, _, error) = verb(&folder, &["downlink", "plan"]);
    assert!(code == 1 && error.contains("no image of sat is unfinished"), "{code}: {error}");

    // Two strangers heard it, one of them a packet of which its board kept no bytes.
    let mut reports = String::new();
    for (number, (name, latitude, longitude)) in
        [("Tromso_1", 69.6, 18.9), ("Tromso_1", 69.6, 18.9), ("Nairobi_1", -1.3, 36.8)]
            .into_iter()
            .enumerate()
    {
        let at = hours_ago(&server, 2 + 3 * i64::try_from(number).expect("small"));
        let report = json!({"pixelsat_reception": 1, "source": "tinygs-api", "source_id": number.to_string(), "label": "sat",
            "receiver": {"id": name, "name": name, "latitude_deg": latitude, "longitude_deg": longitude},
            "received_at": at, "radio_crc": "wrong", "hex": null});
        let _ = writeln!(reports, "{report}");
    }
    let heard = file(&folder, "heard.ndjson", &reports);
    let (code, out, error) = verb(&folder, &["import", &heard, "--json"]);
    assert_eq!(code, 0, "{out}{error}");

    let stations = json!([{"name": "Uppsala_1", "location": [59.9, 17.6]}, {"name": "tromso_1", "location": [69.6, 18.9]}]);
    let (stations, text) = (file(&folder, "stations.json", &stations.to_string()), folder.file("night.toml"));
    let text = text.display().to_string();
    let (code, out, error) =
        verb(&folder, &[&plan[..], &["--stations", &stations, "--plan", &text, "--name", "night"]].concat());
    assert_eq!(code, 0, "{out}{error}");
    let answer: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((&answer["satellite"], &answer["stations"]), (&json!("sat"), &json!(3)), "{out}");
    let expected = answer["expected_chunks"].as_f64().expect("a number");
    assert!(expected > 1.0 && answer["upper_bound_chunks"].as_f64() >= Some(expected), "{out}");

    // A weak battery allows less.
    let battery = "capacity_wh=40,charge_wh=20.01,floor_wh=20,sunlit_w=0,load_w=0,transmit_w=6";
    let (_, out, error) = verb(&folder, &[&plan[..], &["--battery", battery]].concat());
    let weak: Value = serde_json::from_str(&out).expect(&error);
    assert!(weak["expected_chunks"].as_f64() < Some(expected / 2.0), "{out}");
    // An antenna that must be turned carries attitudes.
    let (_, out, error) = verb(&folder, &[&plan[..], &["--antenna", "axis=0/0/1"]].concat());
    let turned: Value = serde_json::from_str(&out).expect(&error);
    assert!(turned["entries"][0]["attitude_mrp"].is_array(), "{out}");

    let (code, out, error) = verb(&folder, &["plan", "add", &text]);
    assert_eq!(code, 0, "{out}{error}");
    let (code, out, error) = verb(&folder, &["plan", "list", "--json"]);
    assert!(code == 0 && out.contains("\"night\""), "{out}{error}");
    server.stop();
}
