//! Reports over the API: forms, wrong questions, and what strangers wrote into the archive.

use axum::http::StatusCode;
use mission::record::{EventKind, EventRecord, PassRecord, Record, Subject};
use mission::{Batch, BatchId, Level, PassId, SatelliteId, UtcUs};
use serde_json::json;

use super::{Bench, heartbeat, station};

const EVIL: &str = "<script>alert(1)</script>";
const S: i64 = 1_000_000;

/// A pass from an hour ago to ten minutes later, and something bad in it.
async fn with_a_pass() -> (Bench, i64) {
    let bench = Bench::new().await;
    let aos = bench.timer.now().utc.0 - 3600 * S;
    let satellite = SatelliteId::new("pixelsat-1").unwrap();
    let records = vec![
        Record::Pass(PassRecord {
            id: PassId(7),
            satellite: satellite.clone(),
            station: station().station,
            aos_at: UtcUs(aos),
            tca_at: UtcUs(aos + 300 * S),
            los_at: Some(UtcUs(aos + 600 * S)),
            max_elevation_deg: 45.0,
            elements: Vec::new(),
            ended_at: Some(UtcUs(aos + 600 * S)),
        }),
        Record::Event(EventRecord {
            at: UtcUs(aos + 10 * S),
            kind: EventKind::SatelliteError,
            level: Level::Critical,
            satellite: Some(satellite),
            station: station().station,
            link: None,
            key: None,
            subject: Subject::default(),
            message: EVIL.into(),
        }),
    ];
    bench.store.apply(&Batch { id: BatchId(900), records }).await.unwrap();
    (bench, aos)
}

fn text(answer: &super::Answer) -> String {
    assert_eq!(answer.status(), StatusCode::OK);
    String::from_utf8(answer.bytes.clone()).unwrap()
}

#[tokio::test]
async fn each_report_comes_as_value_page_and_text() {
    let (bench, aos) = with_a_pass().await;
    let pass = bench.get("/api/v1/reports/passes/7").await.ok();
    assert_eq!(
        (&pass["pass"], &pass["is_final"], &pass["had"]["frames"]),
        (&json!(7), &json!(true), &json!(0))
    );
    assert_eq!(pass["gaps"].as_array().unwrap().len(), 1, "{pass}");
    let handover = bench.get("/api/v1/reports/handover").await.ok();
    assert_eq!((&handover["now"]["station"], &handover["passes"][0]["pass"]), (&json!("bench"), &json!(7)));
    let month = api::Time::from_unix_us(aos).to_string();
    let path = format!("/api/v1/reports/months/{}", &month[..7]);
    let told = bench.get(&path).await.ok();
    assert_eq!(
        (&told["satellites"][0]["passes"], &told["satellites"][0]["passes_heard"]),
        (&json!(1), &json!(0))
    );
    assert_eq!(told["incidents"][0]["kind"], "satellite-error");
    for path in ["/api/v1/reports/passes/7", "/api/v1/reports/handover", &path] {
        let page = bench.get(&format!("{path}.html")).await;
        assert_eq!(page.header("content-type"), "text/html; charset=utf-8");
        assert!(page.header("content-security-policy").starts_with("default-src 'self'"));
        let page = text(&page);
        assert!(page.contains("&lt;script&gt;alert(1)") && !page.contains("<script"), "{path}: {page}");
        assert!(page.contains("/page/report.css") && !page.contains("style="), "{path}");
        let markdown = bench.get(&format!("{path}.md")).await;
        assert_eq!(markdown.header("content-type"), "text/markdown; charset=utf-8");
        assert!(text(&markdown).starts_with("# ") && !text(&markdown).contains("<script"), "{path}");
    }
    let style = bench.get("/page/report.css").await;
    assert_eq!(style.header("content-type"), "text/css; charset=utf-8");
}

#[tokio::test]
async fn wrong_questions_are_told_what_to_ask() {
    let (bench, _) = with_a_pass().await;
    assert_eq!(bench.get("/api/v1/reports/passes/8").await.problem(), "not-found");
    assert_eq!(bench.get("/api/v1/reports/passes/8.html").await.problem(), "not-found");
    for wrong in [
        "passes/last",
        "passes/7.pdf",
        "passes/-7",
        "months/2026",
        "months/2026-13.md",
        "months/..%2f..%2fetc",
        "handover?since=yesterday",
        "handover?since=2200-01-01T00:00:00Z",
        "handover?until=2026-01-01T00:00:00Z",
    ] {
        let answer = bench.get(&format!("/api/v1/reports/{wrong}")).await;
        assert_eq!(answer.problem(), "bad-parameter", "{wrong}");
    }
}

#[tokio::test]
async fn a_handover_tells_what_was_heard_since_then() {
    let bench = Bench::new().await;
    bench.hear(&heartbeat(20.0)).await;
    bench.frames(1).await;
    let station = bench.get("/api/v1/station").await.ok();
    let since = station["at"].as_str().unwrap().to_owned();
    let told = bench.get(&format!("/api/v1/reports/handover?since={since}")).await.ok();
    assert_eq!(
        (&told["since"], &told["passes"], &told["in_flight"]),
        (&json!(since), &json!([]), &json!([]))
    );
    let ping = bench.post("/api/v1/commands", "k", &json!({"command": "Ping", "gate": "heard"})).await.ok();
    assert_eq!(ping["command"], 1, "{ping}");
    let told = bench.get("/api/v1/reports/handover").await.ok();
    assert_eq!(told["in_flight"][0]["command"], "Ping", "{told}");
    assert!(
        told["actions"].as_array().unwrap().iter().any(|action| action["action"] == "command.create"),
        "{told}"
    );
}
