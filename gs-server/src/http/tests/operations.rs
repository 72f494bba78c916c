//! `/metrics`, `/healthz` and `/readyz`.

use axum::http::StatusCode;

use super::Bench;

#[tokio::test]
async fn metrics_are_prometheus_text_with_few_labels() {
    let bench = Bench::new().await;
    let answer = bench.get("/metrics").await;
    assert_eq!(answer.parts.status, StatusCode::OK);
    assert_eq!(answer.parts.headers["content-type"], "text/plain; version=0.0.4; charset=utf-8");
    let text = String::from_utf8(answer.bytes).unwrap();
    let mut metric = "";
    for line in text.lines() {
        if let Some(help) = line.strip_prefix("# HELP ") {
            metric = help.split(' ').next().unwrap();
        } else if let Some(kind) = line.strip_prefix("# TYPE ") {
            assert!(kind.starts_with(&format!("{metric} ")), "{line} after the help of {metric}");
        } else {
            assert!(line.starts_with(metric), "{line} belongs to {metric}");
            let (_, value) = line.rsplit_once(' ').unwrap();
            assert!(value.parse::<f64>().is_ok_and(f64::is_finite), "{line}");
        }
    }
    for wanted in [
        "gs_link_state{satellite=\"pixelsat-1\",link=\"e22\",state=\"ok\"} ",
        "gs_clock_synchronised 1\n",
        "gs_event_sequence 1\n",
        "gs_persist_seconds_count ",
        "gs_storage_failing 0\n",
        "gs_streams 0\n",
        "process_resident_memory_bytes ",
    ] {
        assert!(text.contains(wanted), "{wanted} is missing:\n{text}");
    }
}

#[tokio::test]
async fn who_lives_and_is_ready_says_so_and_who_stops_is_not_ready() {
    let bench = Bench::new().await;
    for path in ["/healthz", "/readyz"] {
        let answer = bench.get(path).await.ok();
        assert_eq!((&answer["live"], &answer["ready"]), (&true.into(), &true.into()), "{path}: {answer}");
    }
    bench.stop.cancel();
    // The engine ends as well here, and then nobody answers for it.
    crate::clock::wall_sleep(std::time::Duration::from_millis(300)).await;
    let answer = bench.get("/readyz").await;
    assert_eq!(answer.parts.status, StatusCode::SERVICE_UNAVAILABLE);
    let told: serde_json::Value = serde_json::from_slice(&answer.bytes).unwrap();
    let reasons = told["reasons"].to_string();
    assert!(reasons.contains("stopping") && reasons.contains("engine"), "{told}");
    assert_eq!(bench.get("/healthz").await.parts.status, StatusCode::SERVICE_UNAVAILABLE);
}
