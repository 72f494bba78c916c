//! Every list can be cut to a time: what it counts as its time, and that both ends hold.

use api::Time;
use axum::body::Body;
use axum::http::{Method, header};
use serde_json::json;

use super::super::openapi::document;
use super::{Answer, Bench, TOKEN, heartbeat, image_info, request};

/// The lists, and the field that says when.
const LISTS: [(&str, &str); 20] = [
    ("frames", "heard_at"),
    ("receptions", "received_at"),
    ("receivers", "last_heard_at"),
    ("commands", "created_at"),
    ("downloads", "created_at"),
    ("images", "declared_at"),
    ("elements", "added_at"),
    ("passes/history", "aos"),
    ("plans", "added_at"),
    ("rehearsals", "asked_at"),
    ("runs", "aos"),
    ("alerts", "raised_at"),
    ("forwards", "received_at"),
    ("events", "at"),
    ("limits", "since"),
    ("audit", "at"),
    ("approvals", "asked_at"),
    ("transmissions", "at"),
    ("users", "created_at"),
    ("tokens", "created_at"),
];
/// What is no record of a moment: it is how things stand.
const TIMELESS: [&str; 7] = [
    "ears",
    "ears/ways",
    "parameters",
    "telemetry/latest",
    "elements/sources",
    "alerts/targets",
    "forwards/targets",
];

#[test]
fn every_list_of_the_document_takes_start_and_stop() {
    let document = serde_json::to_value(document()).unwrap();
    let mut told = 0;
    for (path, methods) in document["paths"].as_object().unwrap() {
        let schema = &methods["get"]["responses"]["200"]["content"]["application/json"]["schema"]["$ref"];
        let Some(schema) = schema.as_str() else { continue };
        let fields = &document.pointer(schema.trim_start_matches('#')).unwrap()["properties"];
        if fields.get("items").is_none() || fields.get("next").is_none() {
            continue;
        }
        told += 1;
        let path = path.trim_start_matches("/api/v1/");
        let params = methods["get"]["parameters"].as_array().into_iter().flatten();
        let times = params.filter(|param| param["name"] == "start" || param["name"] == "stop").count();
        let wanted = if TIMELESS.contains(&path) { 0 } else { 2 };
        assert_eq!(times, wanted, "{path}");
        assert!(wanted == 0 || LISTS.iter().any(|(list, _)| *list == path), "{path}: add it to this test");
    }
    assert_eq!(told, LISTS.len() + TIMELESS.len());
}

async fn ask(bench: &Bench, path: &str) -> Answer {
    let request = request(Method::GET, &format!("/api/v1/{path}"));
    let request = request.header(header::AUTHORIZATION, format!("Bearer {TOKEN}"));
    bench.send(request.body(Body::empty()).unwrap()).await
}

async fn count(bench: &Bench, path: &str) -> usize {
    ask(bench, path).await.ok()["items"].as_array().unwrap().len()
}

#[tokio::test]
async fn a_list_holds_what_lies_from_start_until_before_stop() {
    let bench = Bench::new().await;
    bench.hear(&heartbeat(20.0)).await;
    bench.hear(&image_info(1000)).await;
    bench.frames(2).await;
    let plan = json!({"name": "status", "satellite": "pixelsat-1", "steps": [{"do": "listen", "for_s": 20}]});
    for (path, body) in [
        ("commands", json!({"command": "Ping"})),
        ("downloads", json!({})),
        ("plans", plan),
        ("tokens", json!({"name": "script", "scopes": ["look"], "days": 30})),
    ] {
        bench.post(&format!("/api/v1/{path}"), path, &body).await.ok();
    }
    bench.until("/api/v1/plans", "/items/0/name", &json!("status")).await;

    let mut filled = 0;
    for (path, field) in LISTS {
        let whole = count(&bench, path).await;
        let wrong =
            ask(&bench, &format!("{path}?start=2020-01-02T00:00:00Z&stop=2020-01-01T00:00:00Z")).await;
        assert_eq!(wrong.problem(), "bad-parameter", "{path}");
        assert_eq!(wrong.json()["errors"][0]["field"], "stop", "{path}");
        for (query, wanted) in [
            ("start=2020-01-01T00:00:00Z", whole),
            ("start=2020-01-01T00:00:00%2B01:00&stop=2999-01-01T00:00:00Z", whole),
            ("start=2999-01-01T00:00:00Z", 0),
            ("stop=2020-01-01T00:00:00Z", 0),
        ] {
            assert_eq!(count(&bench, &format!("{path}?{query}")).await, wanted, "{path}?{query}");
        }
        if whole > 0 {
            filled += 1;
            // Microseconds are kept, milliseconds are shown.
            let newest = ask(&bench, path).await.ok()["items"][0][field].clone();
            let at: Time =
                newest.as_str().unwrap_or_else(|| panic!("{path} has no {field}")).parse().unwrap();
            let after = Time::from_unix_us(at.unix_us() + 1000);
            assert_eq!(count(&bench, &format!("{path}?start={after}")).await, 0, "{path} from {after}");
            assert!(count(&bench, &format!("{path}?start={at}&stop={after}")).await > 0, "{path} at {at}");
            assert!(count(&bench, &format!("{path}?stop={at}")).await < whole, "{path} until {at}");
        }
    }
    assert!(filled >= 8, "{filled}");
}
