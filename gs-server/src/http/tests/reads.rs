//! What was heard can be read, and unknown is null.

use serde_json::{Value, json};

use super::{Bench, chunk, heartbeat, image_info};

#[tokio::test]
async fn version_health_and_station_tell_who_is_there() {
    let bench = Bench::new().await;
    let version = bench.get("/api/v1/version").await.ok();
    assert_eq!(
        (&version["api"], &version["station"], &version["simulated"]),
        (&json!(1), &json!("bench"), &json!(true))
    );
    assert!(version["capabilities"].as_array().unwrap().contains(&json!("stream-resume")));
    let health = bench.get("/api/v1/health").await.ok();
    assert_eq!((&health["live"], &health["ready"]), (&json!(true), &json!(true)));
    let station = bench.get("/api/v1/station").await.ok();
    assert_eq!(station["satellites"][0]["heard_at"], Value::Null);
    assert_eq!(station["demo"]["speed"], 1.0);
    assert_eq!(station["sealing"][0]["satellite"], "pixelsat-1");
}

#[tokio::test]
async fn a_server_whose_archive_is_gone_is_alive_and_not_ready() {
    let bench = Bench::new().await;
    bench.store.close().await.unwrap();
    let answer = bench.get("/api/v1/health").await;
    assert_eq!(answer.status(), 503);
    assert_eq!((&answer.json()["live"], &answer.json()["ready"]), (&json!(true), &json!(false)));
    let answer = bench.get("/api/v1/frames").await;
    assert_eq!(answer.problem(), "internal");
    assert!(!answer.json().to_string().contains("sql"), "inner text goes to the log");
}

#[tokio::test]
async fn a_heartbeat_is_a_frame_values_and_an_event() {
    let bench = Bench::new().await;
    for temp in [20.0, 21.5] {
        bench.hear(&heartbeat(temp)).await;
    }
    bench.frames(2).await;
    let frames = bench.get("/api/v1/frames?packet_type=6").await.ok();
    let newest = &frames["items"][0];
    assert_eq!(
        (&newest["id"], &newest["packet_name"], &newest["length"]),
        (&json!(2), &json!("Heartbeat"), &json!(240))
    );
    assert!(newest["hex"].as_str().unwrap().starts_with("504958454c534154"));
    assert_eq!(newest["tag"], Value::Null);
    assert_eq!(bench.get("/api/v1/frames?after=1").await.ok()["items"].as_array().unwrap().len(), 1);
    assert_eq!(bench.get("/api/v1/frames?limit=1").await.ok()["next"], 2);
    assert_eq!(bench.get("/api/v1/frames?link=other").await.ok()["items"], json!([]));

    let frame = bench.get("/api/v1/frames/2").await.ok();
    let field = |name: &str| {
        let fields = frame["packet"]["fields"].as_array().unwrap();
        fields.iter().find(|field| field["name"] == name).unwrap().clone()
    };
    assert_eq!((&field("temp")["value"], &field("temp")["unit"]), (&json!(21.5), &json!("°C")));
    assert_eq!(field("mag.z")["value"], Value::Null, "NaN is null");
    assert_eq!(frame["receptions"][0]["source"], "radio");

    let series = bench.get("/api/v1/telemetry?parameter=heartbeat.temp").await.ok();
    let values: Vec<f64> =
        series["samples"].as_array().unwrap().iter().map(|s| s["value"].as_f64().unwrap()).collect();
    assert_eq!((values, &series["decimated"]), (vec![20.0, 21.5], &json!(false)));
    let thin = bench.get("/api/v1/telemetry?parameter=heartbeat.temp&max_points=1").await.ok();
    assert_eq!(thin["decimated"], true);
    assert_eq!((&thin["buckets"][0]["min"], &thin["buckets"][0]["max"]), (&json!(20.0), &json!(21.5)));
    let later = bench.get("/api/v1/telemetry?parameter=heartbeat.temp&start=2999-01-01T00:00:00Z").await.ok();
    assert_eq!(later["samples"], json!([]));

    let latest = bench.get("/api/v1/telemetry/latest").await.ok();
    let temp =
        latest["items"].as_array().unwrap().iter().find(|i| i["parameter"] == "heartbeat.temp").unwrap();
    assert_eq!((&temp["value"], &temp["frame"], &temp["link"]), (&json!(21.5), &json!(2), &json!("e22")));
    assert!(bench.get("/api/v1/parameters").await.ok()["items"].as_array().unwrap().len() > 20);

    let events = bench.get("/api/v1/events?kind=frame-heard").await.ok();
    assert_eq!(events["items"][0]["frame"], 2);
    assert_eq!(bench.get("/api/v1/limits").await.ok(), json!({"items": [], "next": null}));
}

#[tokio::test]
async fn a_picture_is_served_while_it_grows() {
    let bench = Bench::new().await;
    let file: Vec<u8> = (0..500u16).map(|i| (i % 251) as u8 + 1).collect();
    bench.hear(&image_info(500)).await;
    bench.hear(&chunk(&file, 0)).await;
    bench.hear(&chunk(&file, 2)).await;
    bench.frames(3).await;
    let image = bench.get("/api/v1/images/1").await.ok();
    assert_eq!((&image["held"], &image["chunks"], &image["complete"]), (&json!(2), &json!(3), &json!(false)));
    assert_eq!((&image["sha256"], &image["completed_at"]), (&Value::Null, &Value::Null));
    let map = bench.get("/api/v1/images/1/chunks").await.ok();
    assert_eq!((&map["map"], &map["frames"]), (&json!("#.#"), &json!([2, null, 3])));
    let partial = bench.get("/api/v1/images/1/file").await;
    assert_eq!(partial.header("content-type"), "image/jpeg");
    assert_eq!(
        (partial.header("x-image-complete"), partial.header("x-image-contiguous-bytes")),
        ("false", "222")
    );
    assert_eq!(
        (partial.bytes.len(), &partial.bytes[..222], &partial.bytes[444..]),
        (500, &file[..222], &file[444..])
    );
    assert!(partial.bytes[222..444].iter().all(|byte| *byte == 0));

    // A forged chunk is kept apart; the true one completes the picture.
    bench.hear(&chunk(&[9; 500], 0)).await;
    bench.hear(&chunk(&file, 1)).await;
    bench.frames(5).await;
    let map = bench.get("/api/v1/images/1/chunks").await.ok();
    assert_eq!((&map["map"], &map["conflicts"], &map["held"]), (&json!("!##"), &json!(1), &json!(3)));
    let whole = bench.get("/api/v1/images/1/file").await;
    assert_eq!((whole.header("x-image-complete"), &whole.bytes), ("true", &file));
    assert_eq!(bench.get("/api/v1/images").await.ok()["items"][0]["complete"], true);
    let tag = whole.header("etag").to_owned();
    let again = super::request(axum::http::Method::GET, "/api/v1/images/1/file").header("if-none-match", tag);
    let again = bench.send(again.body(axum::body::Body::empty()).unwrap()).await;
    assert_eq!((again.status().as_u16(), again.bytes.len()), (304, 0));
    assert_eq!(bench.get("/api/v1/images/2/file").await.problem(), "not-found");
}

#[tokio::test]
async fn an_antenna_that_is_not_there_is_told_as_unknown() {
    let bench = Bench::new().await;
    let told = bench.get("/api/v1/antenna").await.ok();
    assert_eq!(told, json!({"rotator": null, "rig": null, "doppler": []}), "nor is there a place");
    assert_eq!(bench.get("/api/v1/station").await.ok()["antenna"], Value::Null);
}
