//! What is passed on, over the API: how it stands, the exact request, pause and repetition.

use serde_json::json;

use super::*;

const TARGETS: &str = "[[forward]]\nname = \"hook\"\nkind = \"webhook\"\nurl = \"http://127.0.0.1:9/hook\"\nsecret_env = \"NONE\"\nlive = false\n\
    since = \"2020-01-01T00:00:00Z\"\n";

#[tokio::test(flavor = "multi_thread")]
async fn a_dry_run_is_listed_with_its_exact_request() {
    let bench = Bench::watching(TARGETS).await;
    bench.hear(&heartbeat(20.0)).await;
    bench.until("/api/v1/frames", "/items/0/id", &json!(1)).await;
    // It looks now and then, and when it is told to.
    bench.post("/api/v1/forwards/targets/hook/pause", "look", &json!({})).await.ok();
    bench.until("/api/v1/forwards/targets", "/items/0/dry", &json!(1)).await;
    let page = bench.get("/api/v1/forwards?state=dry&target=hook").await.ok();
    let one = &page["items"][0];
    assert_eq!((&one["state"], &one["attempts"], &one["error"]), (&json!("dry"), &json!(0), &Value::Null));
    let id = one["id"].as_u64().unwrap();
    let whole = bench.get(&format!("/api/v1/forwards/{id}")).await.ok();
    assert_eq!(&whole["forward"], one);
    let body: Value = serde_json::from_str(whole["request"]["body"].as_str().unwrap()).unwrap();
    assert_eq!(body["id"], one["message_id"]);
    assert!(body["data"]["frame"].as_str().unwrap().starts_with("504958454C534154"));
    // Somebody wants it sent all the same; then there is nothing more to repeat.
    let again = bench.post(&format!("/api/v1/forwards/{id}/retry"), "again", &json!({})).await.ok();
    assert_eq!(again["state"], "waiting");
    let refused =
        bench.post(&format!("/api/v1/forwards/{id}/retry"), "once-more", &json!({})).await.problem();
    assert_eq!(refused, "too-late");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_target_is_paused_and_goes_on_and_the_audit_says_who() {
    let bench = Bench::watching(TARGETS).await;
    let before = bench.get("/api/v1/forwards/targets").await.ok();
    let target = &before["items"][0];
    assert_eq!((&target["paused_by"], &target["live"]), (&Value::Null, &json!(false)));
    assert_eq!(target["leads_to"], "http://127.0.0.1:9/");
    let paused = bench.post("/api/v1/forwards/targets/hook/pause", "p1", &json!({})).await.ok();
    assert!(paused["paused_by"].is_string() && paused["paused_at"].is_string());
    // Twice is once.
    bench.post("/api/v1/forwards/targets/hook/pause", "p2", &json!({})).await.ok();
    let resumed = bench.post("/api/v1/forwards/targets/hook/resume", "p3", &json!({})).await.ok();
    assert_eq!(resumed["paused_by"], Value::Null);
    let audit = bench.get("/api/v1/audit?limit=2").await.ok();
    let acts: Vec<_> = audit["items"].as_array().unwrap().iter().map(|act| act["action"].clone()).collect();
    assert_eq!(acts, ["forward.resume", "forward.pause"]);
    let problem = bench.post("/api/v1/forwards/targets/nobody/pause", "p4", &json!({})).await.problem();
    assert_eq!(problem, "unknown-target");
    assert_eq!(bench.get("/api/v1/forwards/17").await.problem(), "not-found");
    assert_eq!(bench.get("/api/v1/forwards?state=perhaps").await.problem(), "bad-parameter");
}
