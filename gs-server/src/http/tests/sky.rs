//! Passes, plots and looks: told from stored elements, and from nothing when there are none.

use std::sync::Arc;

use api::FineTime;
use axum::http::StatusCode;
use mission::record::{ElementsRecord, PassRecord, Record};
use mission::{Batch, BatchId, ElementsId, PassId, Principal, SatelliteId, Site, UtcUs};
use serde_json::{Value, json};
use tle::formats::{Checksums, sets};
use tle::{EarthOrientation, Station};

use super::{Bench, station};

const HOUR_US: i64 = 3_600_000_000;
const COMPUTED: [&str; 5] = [
    "/api/v1/passes",
    "/api/v1/passes.ics",
    "/api/v1/passes/timeline.svg",
    "/api/v1/passes/sky.svg",
    "/api/v1/look",
];

fn omm(epoch_us: i64) -> String {
    let epoch = FineTime::from_unix_us(epoch_us).to_string();
    json!([{
        "OBJECT_NAME": "ISS (ZARYA)", "OBJECT_ID": "1998-067A", "NORAD_CAT_ID": 25_544,
        "EPOCH": epoch.trim_end_matches('Z'), "MEAN_MOTION": 15.495, "ECCENTRICITY": 0.0001413,
        "INCLINATION": 51.6461, "RA_OF_ASC_NODE": 221.2784, "ARG_OF_PERICENTER": 89.1723, "MEAN_ANOMALY": 280.4612,
        "BSTAR": 0.00003,
    }])
    .to_string()
}

async fn with_place() -> Bench {
    let place = Station::new(46.5191, 6.5668, 410.0).unwrap();
    let site = Site { place, min_elevation_deg: 5.0, orientation: EarthOrientation::new(0.1).unwrap() };
    Bench::of(mission::StationConfig { site: Some(site), ..station() }).await
}

/// With elements from an hour ago.
pub(super) async fn with_elements() -> Bench {
    let bench = with_place().await;
    let now = bench.timer.now().utc.0;
    let added = bench.post("/api/v1/elements", "e", &json!({"text": omm(now - HOUR_US)})).await.ok();
    assert_eq!(added["added"], 1, "{added}");
    bench
}

fn us(value: &Value) -> i64 {
    value.as_str().unwrap().parse::<FineTime>().unwrap().unix_us()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[tokio::test]
async fn a_station_without_a_place_says_what_to_set() {
    let bench = Bench::new().await;
    for path in COMPUTED {
        let answer = bench.get(path).await;
        assert_eq!(
            (answer.status(), answer.problem().as_str()),
            (StatusCode::CONFLICT, "no-place"),
            "{path}"
        );
        let detail = answer.json()["detail"].to_string();
        assert!(detail.contains("latitude_deg") && detail.contains("[station]"), "{path}: {detail}");
    }
    assert_eq!(bench.get("/api/v1/passes/history").await.ok(), json!({"items": [], "next": null}));
}

#[tokio::test]
async fn a_satellite_without_elements_says_how_to_add_some() {
    let bench = with_place().await;
    for path in COMPUTED {
        let answer = bench.get(path).await;
        assert_eq!(
            (answer.status(), answer.problem().as_str()),
            (StatusCode::CONFLICT, "no-elements"),
            "{path}"
        );
        let detail = answer.json()["detail"].to_string();
        assert!(
            detail.contains("gs-server elements add") && detail.contains("pixelsat-1"),
            "{path}: {detail}"
        );
    }
}

#[tokio::test]
async fn passes_agree_with_looks_at_their_ends() {
    let bench = with_elements().await;
    let start = FineTime::from_unix_us(bench.timer.now().utc.0 + 100 * HOUR_US);
    let stop = FineTime::from_unix_us(start.unix_us() + 72 * HOUR_US);
    let path = format!(
        "/api/v1/passes?satellite=pixelsat-1&start={start}&stop={stop}&min_elevation=2.5&frequency=435e6"
    );
    let list = bench.get(&path).await.ok();
    assert_eq!(
        (&list["station"], &list["start"], &list["min_elevation_deg"], &list["ut1_minus_utc_s"]),
        (&json!("bench"), &json!(start.to_string()), &json!(2.5), &json!(0.1))
    );
    assert_eq!((&list["gaps"], &list["without_elements"]), (&json!([]), &json!([])));
    let passes = list["passes"].as_array().unwrap();
    assert!(passes.len() > 8, "three days have more than {}", passes.len());
    for pass in passes {
        assert_eq!((&pass["satellite"], &pass["norad_cat_id"]), (&json!("pixelsat-1"), &json!(25_544)));
        let [aos, tca, los] = ["aos", "tca", "los"].map(|name| us(&pass[name]));
        assert!(start.unix_us() <= aos && aos <= tca && tca <= los && los <= stop.unix_us());
        // Cut by the window, a pass may be at its highest where it is cut.
        if pass["aos_clipped"] == json!(true) || pass["los_clipped"] == json!(true) {
            continue;
        }
        assert!(aos < tca && tca < los);
        assert!(number(&pass["aos_doppler_hz"]) > 0.0 && number(&pass["los_doppler_hz"]) < 0.0);
        let at = ["aos", "tca", "los"].map(|name| pass[name].as_str().unwrap()).join(",");
        let looks = bench.get(&format!("/api/v1/look?at={at}&frequency=435e6")).await.ok();
        let looks = looks["looks"].as_array().unwrap().clone();
        assert_eq!(looks.len(), 3);
        for (look, wanted) in looks.iter().zip([2.5, number(&pass["max_elevation_deg"]), 2.5]) {
            let found = number(&look["elevation_deg"]);
            assert!((found - wanted).abs() < 1e-4, "{found} instead of {wanted} degrees");
        }
        let shift = number(&looks[0]["doppler_hz"]) - number(&pass["aos_doppler_hz"]);
        assert!(shift.abs() < 0.1, "{shift} Hz");
    }
    // Without a frequency nothing is said about shifts; without a window it is the next two days.
    let list = bench.get("/api/v1/passes").await.ok();
    assert_eq!(us(&list["stop"]) - us(&list["start"]), 48 * HOUR_US);
    assert_eq!((&list["min_elevation_deg"], &list["frequency_hz"]), (&json!(5.0), &Value::Null));
    assert_eq!(list["passes"][0]["aos_doppler_hz"], Value::Null);
    let now = bench.get("/api/v1/look").await.ok();
    assert_eq!((now["looks"].as_array().unwrap().len(), &now["looks"][0]["uplink_hz"]), (1, &Value::Null));
}

#[tokio::test]
async fn wrong_parameters_are_named() {
    let bench = with_elements().await;
    let a_year = "start=2026-01-01T00:00:00Z&stop=2026-12-01T00:00:00Z";
    for (path, field) in [
        (format!("/api/v1/passes?{a_year}"), "stop"),
        (format!("/api/v1/passes/timeline.svg?{a_year}"), "stop"),
        ("/api/v1/passes?start=2026-01-02T00:00:00Z&stop=2026-01-01T00:00:00Z".to_owned(), "stop"),
        ("/api/v1/passes?start=1800-01-01T00:00:00Z".to_owned(), "start"),
        ("/api/v1/passes?min_elevation=91".to_owned(), "min_elevation"),
        ("/api/v1/passes?min_elevation=NaN".to_owned(), "min_elevation"),
        ("/api/v1/passes.ics?min_elevation=-91".to_owned(), "min_elevation"),
        ("/api/v1/passes?frequency=435".to_owned(), "frequency"),
        ("/api/v1/look?frequency=NaN".to_owned(), "frequency"),
        ("/api/v1/look?at=2026-01-01T00:00:00Z,tomorrow".to_owned(), "at"),
        ("/api/v1/look?at=".to_owned(), "at"),
        (format!("/api/v1/look?at={}", vec!["2026-01-01T00:00:00Z"; 1001].join(",")), "at"),
        ("/api/v1/look?at=9999-01-01T00:00:00Z".to_owned(), "at"),
        ("/api/v1/passes/sky.svg?at=9999-01-01T00:00:00Z".to_owned(), "at"),
        ("/api/v1/passes/timeline.svg?width=5".to_owned(), "width"),
        ("/api/v1/passes/history?link=e22".to_owned(), "link"),
        ("/api/v1/passes/history?limit=0".to_owned(), "limit"),
    ] {
        let answer = bench.get(&path).await;
        assert_eq!(
            (answer.status().as_u16(), answer.problem().as_str()),
            (400, "bad-parameter"),
            "{path:.80}"
        );
        assert_eq!(answer.json()["errors"][0]["field"], field, "{path:.80}");
    }
    // What axum reads by itself is named in the sentence.
    for (path, name) in [
        ("/api/v1/passes?start=yesterday", "start"),
        ("/api/v1/passes?nobody=knows", "nobody"),
        ("/api/v1/passes/sky.svg?theme=pink", "theme"),
    ] {
        let answer = bench.get(path).await;
        assert_eq!(answer.problem(), "bad-parameter", "{path}");
        assert!(answer.json()["detail"].to_string().contains(name), "{path}: {}", answer.json());
    }
    for path in COMPUTED {
        let answer = bench.get(&format!("{path}?satellite=sputnik")).await;
        assert_eq!(
            (answer.status().as_u16(), answer.problem().as_str()),
            (422, "unknown-satellite"),
            "{path}"
        );
    }
}

#[tokio::test]
async fn plots_are_svg_in_both_themes_with_a_mark_while_the_satellite_is_up() {
    let bench = with_elements().await;
    let pass = bench.get("/api/v1/passes").await.ok()["passes"][1].clone();
    let (aos, tca) = (us(&pass["aos"]), us(&pass["tca"]));
    let plot = async |query: String| {
        let answer = bench.get(&format!("/api/v1/passes/{query}")).await;
        assert_eq!(
            (answer.status().as_u16(), answer.header("content-type")),
            (200, "image/svg+xml"),
            "{query}"
        );
        String::from_utf8(answer.bytes).unwrap()
    };
    let before = FineTime::from_unix_us(aos - 1_000_000);
    let during = FineTime::from_unix_us(tca);
    let to_come = plot(format!("sky.svg?at={before}")).await;
    let title = format!("<title>pixelsat-1 over bench, {}", &pass["aos"].as_str().unwrap()[..10]);
    assert!(to_come.contains(&title), "{title}");
    let is_up = plot(format!("sky.svg?at={during}")).await;
    assert_eq!(is_up.matches("<circle").count(), to_come.matches("<circle").count() + 3);
    let compact = plot(format!("sky.svg?at={during}&form=compact")).await;
    assert!(!compact.contains("azimuth") && is_up.contains("azimuth"));
    let bright = plot(format!("sky.svg?at={during}&theme=light")).await;
    assert!(is_up.contains("#0E1116") && !bright.contains("#0E1116"));

    let wide = plot("timeline.svg".to_owned()).await;
    let narrow = plot("timeline.svg?width=330&theme=light&satellite=pixelsat-1".to_owned()).await;
    assert!(wide.contains("width=\"1080\"") && narrow.contains("width=\"330\""));
    let answer = bench.get("/api/v1/passes/sky.svg?min_elevation=89.99").await;
    assert_eq!(answer.problem(), "not-found");
    assert!(answer.json()["detail"].as_str().unwrap().contains("within 14 days"));
}

#[tokio::test]
async fn the_calendar_has_the_passes_of_two_weeks() {
    let bench = with_elements().await;
    let now = bench.timer.now().utc.0;
    let stop = FineTime::from_unix_us(now + 14 * 24 * HOUR_US);
    let list = bench.get(&format!("/api/v1/passes?stop={stop}&min_elevation=20")).await.ok();
    let answer = bench.get("/api/v1/passes.ics?min_elevation=20").await;
    assert_eq!(answer.header("content-type"), "text/calendar; charset=utf-8");
    let text = String::from_utf8(answer.bytes).unwrap();
    let events = text.matches("BEGIN:VEVENT").count();
    let expected = list["passes"].as_array().unwrap().len();
    assert!(events > 20 && events.abs_diff(expected) <= 1, "{events} events, {expected} passes");
    assert!(text.starts_with("BEGIN:VCALENDAR\r\n") && text.contains("SUMMARY:pixelsat-1 over bench"));
}

#[tokio::test]
async fn passes_that_began_are_kept_with_the_elements_they_used() {
    let bench = Bench::new().await;
    let satellite = SatelliteId::new("pixelsat-2").unwrap();
    let set = sets(&omm(1_795_000_000_000_000), Checksums::Strict).unwrap().next().unwrap().unwrap().elements;
    let elements = |id| {
        Record::Elements(ElementsRecord {
            id: ElementsId(id),
            satellite: satellite.clone(),
            station: station().station,
            source: "test".to_owned(),
            added_at: UtcUs(1),
            who: Principal::new("ada"),
            elements: Arc::new(set.clone()),
        })
    };
    let pass = |id: u64, ended_at| {
        Record::Pass(PassRecord {
            id: PassId(id),
            satellite: satellite.clone(),
            station: station().station,
            aos_at: UtcUs(1_795_000_000_000_001),
            tca_at: UtcUs(1_795_000_300_000_000),
            los_at: None,
            max_elevation_deg: 12.5,
            elements: vec![(ElementsId(900), UtcUs(5)), (ElementsId(901), UtcUs(1_795_000_100_000_000))],
            ended_at,
        })
    };
    let records =
        vec![elements(900), elements(901), pass(100, Some(UtcUs(1_795_000_600_000_000))), pass(101, None)];
    bench.store.apply(&Batch { id: BatchId(1), records }).await.unwrap();
    let list = bench.get("/api/v1/passes/history?satellite=pixelsat-2&limit=1").await.ok();
    let newest = &list["items"][0];
    assert_eq!((&newest["id"], &list["next"]), (&json!(101), &json!(101)));
    assert_eq!((&newest["los"], &newest["ended_at"]), (&Value::Null, &Value::Null));
    assert_eq!(newest["aos"], "2026-11-18T11:06:40.000001Z");
    let used: Vec<_> = newest["elements"].as_array().unwrap().iter().map(|used| &used["id"]).collect();
    assert_eq!(used, [900, 901]);
    assert_eq!(newest["elements"][0]["epoch"], "2026-11-18T11:06:40.000000Z");
    let older = bench.get("/api/v1/passes/history?before=101&satellite=pixelsat-2").await.ok();
    assert_eq!((older["items"].as_array().unwrap().len(), &older["next"]), (1, &Value::Null));
    assert_eq!(older["items"][0]["ended_at"], "2026-11-18T11:16:40.000000Z");
    assert_eq!(bench.get("/api/v1/passes/history?satellite=pixelsat-1").await.ok()["items"], json!([]));
}
