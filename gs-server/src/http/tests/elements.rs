//! Elements over the API: given, held, refused.

use serde_json::{Value, json};

use super::Bench;

const ISS: &str = "ISS (ZARYA)\n1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
    2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";
const BAD: &str = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9993\n\
    2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";

fn of(text: &str) -> Value {
    json!({ "text": text, "source": "test" })
}

#[tokio::test]
async fn elements_are_added_once_and_listed_with_who_and_whence() {
    let bench = Bench::new().await;
    let answer = bench.post("/api/v1/elements", "a", &of(&format!("{ISS}{BAD}"))).await.ok();
    assert_eq!((&answer["added"], &answer["held"], &answer["of_others"]), (&json!(1), &json!(0), &json!(0)));
    assert_eq!(answer["newest_epoch"], "2020-07-12T21:16:01.000416Z");
    assert!(answer["refused"][0]["error"].as_str().unwrap().contains("checksum"), "{answer}");
    let replay = bench.post("/api/v1/elements", "a", &of(&format!("{ISS}{BAD}"))).await;
    assert_eq!((replay.header("idempotency-replayed"), &replay.ok()["held"]), ("true", &json!(1)));
    assert_eq!(bench.post("/api/v1/elements", "a", &of(ISS)).await.problem(), "idempotency-key-reused");
    let again = bench.post("/api/v1/elements", "b", &of(ISS)).await.ok();
    assert_eq!((&again["added"], &again["held"]), (&json!(0), &json!(1)));
    let list = bench.get("/api/v1/elements?satellite=pixelsat-1").await.ok();
    let held = &list["items"][0];
    assert_eq!(list["items"].as_array().unwrap().len(), 1);
    assert_eq!(
        (&held["source"], &held["added_by"], &held["in_use"]),
        (&json!("test"), &json!("local"), &json!(true))
    );
    assert_eq!(held["elements"]["norad_cat_id"], 25_544);
    assert!(held["age_days"].as_f64().unwrap() > 1000.0 && held["level"] == "distress", "{held}");
    assert_eq!(bench.get("/api/v1/elements?link=e22").await.problem(), "bad-parameter");
    // A lenient reader takes the second one, too, and says so.
    let mut lenient = of(BAD);
    lenient["lenient"] = json!(true);
    let answer = bench.post("/api/v1/elements", "c", &lenient).await.ok();
    assert!(answer["warnings"][0].as_str().unwrap().contains("checksum"), "{answer}");
    assert!(bench.get("/api/v1/elements/sources").await.ok()["items"].as_array().unwrap().is_empty());
    assert_eq!(bench.post("/api/v1/elements/fetch", "d", &json!({})).await.ok(), json!({"sources": []}));
}

#[tokio::test]
async fn what_is_no_elements_of_this_satellite_is_refused_with_the_reason() {
    let bench = Bench::new().await;
    let other = ISS.replace("25544", "25545").replace("0  9992", "0  9993").replace("96236008", "96236009");
    for (key, text, says) in [
        ("html", "<!DOCTYPE html><html><title>Sorry</title></html>", "web page"),
        ("empty", " \n", "empty"),
        ("message", "No GP data found", "no elements for this query"),
        ("broken", BAD, "checksum"),
        ("other", other.as_str(), "object 25544"),
    ] {
        let answer = bench.post("/api/v1/elements", key, &of(text)).await;
        assert_eq!(answer.problem(), "bad-argument", "{key}");
        let problem = answer.json();
        assert_eq!(problem["errors"][0]["field"], "text");
        assert!(problem["detail"].as_str().unwrap().contains(says), "{key}: {problem}");
    }
    let mut unknown = of(ISS);
    unknown["satellite"] = json!("sputnik");
    assert_eq!(bench.post("/api/v1/elements", "u", &unknown).await.problem(), "unknown-satellite");
    assert!(bench.get("/api/v1/elements").await.ok()["items"].as_array().unwrap().is_empty());
}
