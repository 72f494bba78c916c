//! `schedule --stations`: many satellites over several stations, from files.

use std::fs;
use std::path::Path;

use satellite::Orbit;
use tle::UtcInstant;
use tle::formats::{self, Form};

use super::{json, run};

/// 2027-06-01T04:05:06.789Z.
const ZERO: UtcInstant = UtcInstant::from_unix_us(1_811_822_706_789_000);

const STATIONS: &str = r#"
[[stations]]
name = "lausanne"
latitude_deg = 46.52
longitude_deg = 6.57
[[stations]]
name = "vienna"
latitude_deg = 48.2
longitude_deg = 16.4
antennas = ["yagi", "dish"]
blackouts = [{ start = "2027-06-02T00:00:00Z", stop = "2027-06-02T12:00:00Z", reason = "wind" }]
[[satellites]]
name = "one"
priority = 3
[[satellites]]
name = "two"
elements = "SECOND"
min_duration_s = 120
[[satellites]]
name = "three"
stations = ["lausanne"]
min_max_elevation_deg = 20
[[satellites]]
name = "four"
"#;

struct Files {
    stations: String,
    elements: String,
}

/// Four satellites on planes that lie close together, so that they are in each other's way.
fn files(folder: &Path, stations: &str) -> Files {
    let [path, elements] = ["stations.toml", "gp.json"].map(|name| folder.join(name).display().to_string());
    let base = Orbit::fictional(3, ZERO);
    let sets: Vec<_> = ["one", "SECOND", "three", "four"]
        .iter()
        .enumerate()
        .map(|(n, name)| {
            let mut set = base.clone().named(name).elements().clone();
            set.norad_cat_id = Some(100_001 + n as u32);
            set.mean_anomaly_deg = (set.mean_anomaly_deg - 4.0 * n as f64).rem_euclid(360.0);
            set
        })
        .collect();
    fs::write(&elements, formats::write(Form::OmmJson, &sets).unwrap()).unwrap();
    fs::write(&path, stations).unwrap();
    Files { stations: path, elements }
}

impl Files {
    fn ask(&self, more: &[&str]) -> (i32, String, String) {
        let usual = [
            "schedule",
            "--stations",
            &self.stations,
            "--elements",
            &self.elements,
            "--start",
            "2027-06-01T05:00:00Z",
        ];
        run(usual.iter().chain(more))
    }
}

#[test]
fn satellites_are_spread_over_stations_and_every_choice_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let files = files(folder.path(), STATIONS);
    let (code, out, error) = files.ask(&["--days", "3", "--json"]);
    assert_eq!((code, error.as_str()), (0, ""), "{out}");
    assert_eq!(files.ask(&["--days", "3", "--json"]).1, out, "the same question has the same answer");
    let told = json(&out);
    let list = |name: &str| told[name].as_array().unwrap().clone();
    let (contacts, refused) = (list("contacts"), list("refused"));
    assert_eq!(told["passes"].as_u64().unwrap() as usize, contacts.len() + refused.len());
    assert!(contacts.len() > 20 && !refused.is_empty(), "{} {}", contacts.len(), refused.len());
    assert!(
        contacts.iter().chain(&refused).all(|one| one["why"].as_str().is_some_and(|why| !why.is_empty()))
    );
    assert!(refused.iter().any(|one| one["why"].as_str().unwrap().contains("loses to")), "{refused:#?}");
    assert!(refused.iter().any(|one| one["why"].as_str().unwrap().contains("wind")), "{refused:#?}");
    // What is asked for is kept: stations, durations, one satellite at a time for an antenna.
    assert!(contacts.iter().filter(|c| c["satellite"] == "three").all(|c| c["station"] == "lausanne"));
    let span = |one: &serde_json::Value| {
        ["start", "stop"].map(|name| one[name].as_str().unwrap().parse::<api::Time>().unwrap().unix_us())
    };
    for one in contacts.iter().filter(|one| one["satellite"] == "two") {
        let [start, stop] = span(one);
        assert!(stop - start >= 120_000_000);
    }
    for (at, one) in contacts.iter().enumerate() {
        for other in contacts[at + 1..].iter().filter(|other| other["antenna"] == one["antenna"]) {
            let ([a, b], [c, d]) = (span(one), span(other));
            assert!(b <= c || d <= a, "{one} {other}");
        }
    }
    let (worth, bound, gap) = (&told["worth"], &told["bound"], &told["gap"]);
    assert!(
        worth.as_f64() <= bound.as_f64() && (0.0..1.0).contains(&gap.as_f64().unwrap()),
        "{worth} {bound} {gap}"
    );

    let (code, out, error) = files.ask(&["--days", "3"]);
    assert_eq!((code, error.as_str()), (0, ""));
    assert!(out.contains("vienna/yagi") && out.contains("refused"), "{out}");
    let last = out.lines().last().unwrap();
    assert!(last.contains("no schedule is worth more") || last.contains("may be missing"), "{last}");
}

#[test]
fn an_unfit_station_gets_nothing_and_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let unfit = STATIONS.replacen("name = \"vienna\"", "name = \"vienna\"\nunfit = \"the mast is down\"", 1);
    let (code, out, error) = files(folder.path(), &unfit).ask(&["--days", "1", "--json"]);
    assert_eq!(code, 0, "{error}");
    let told = json(&out);
    assert!(told["contacts"].as_array().unwrap().iter().all(|one| one["station"] == "lausanne"));
    let refused = told["refused"].as_array().unwrap();
    let of_it: Vec<_> = refused.iter().filter(|one| one["station"] == "vienna").collect();
    assert!(
        !of_it.is_empty()
            && of_it.iter().all(|one| one["why"].as_str().unwrap().contains("the mast is down"))
    );
}

#[test]
fn what_cannot_be_planned_says_where_and_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let good = files(folder.path(), STATIONS);
    for (days, code) in [("0", 2), ("40", 2), ("-1", 2)] {
        assert_eq!(good.ask(&[&format!("--days={days}")]).0, code, "{days}");
    }
    for (found, instead, code, says) in [
        ("latitude_deg = 46.52", "latitude_deg = 146.52", 2, "stations[0].latitude_deg"),
        ("priority = 3", "priority = 30", 2, "satellites[0].priority: must lie from 1 to 10, found 30"),
        ("priority = 3", "prioritty = 3", 2, "unknown field `prioritty`"),
        ("elements = \"SECOND\"", "elements = \"THIRD\"", 1, "satellites[1]: "),
        (
            "stations = [\"lausanne\"]",
            "stations = [\"moon\"]",
            2,
            "satellites[2].stations[0]: there is no station 'moon'",
        ),
    ] {
        let wrong = files(folder.path(), &STATIONS.replacen(found, instead, 1));
        let (exit, out, error) = wrong.ask(&[]);
        assert_eq!((exit, out.as_str()), (code, ""), "{instead}: {error}");
        assert!(error.contains("stations.toml") && error.contains(says), "{instead}: {error}");
    }
    let nowhere = run(["schedule", "--stations", "none.toml", "--elements", &good.elements]);
    assert!(nowhere.0 == 1 && nowhere.2.contains("none.toml"), "{nowhere:?}");
    assert_eq!(run(["schedule"]).0, 2);
    assert_eq!(run(["schedule", "--stations", &good.stations]).0, 2, "of which elements?");
    assert_eq!(run(["schedule", "--config", "a.toml", "--days", "3"]).0, 2, "that is not asked of a server");
}
