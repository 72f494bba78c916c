//! Rehearsals over the API: a job that is asked for, looked at, read and cancelled.

use std::time::Duration;

use serde_json::{Value, json};

use super::sky::with_elements;
use super::{Bench, station};
use crate::clock::wall_sleep;

fn plan(for_s: f64) -> Value {
    json!({"name": "ear", "satellite": "pixelsat-1", "steps": [{"do": "listen", "for_s": for_s}]})
}

async fn ended(bench: &Bench, id: &Value) -> Value {
    for _ in 0..6000 {
        let job = bench.get(&format!("/api/v1/rehearsals/{id}")).await.ok();
        if !["waiting", "running"].contains(&job["state"].as_str().unwrap()) {
            return job;
        }
        wall_sleep(Duration::from_millis(10)).await;
    }
    panic!("rehearsal {id} never ended");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_plan_is_rehearsed_and_answers_as_the_command_line_does() {
    let bench = with_elements().await;
    let asked = json!({"plan": plan(20.0), "runs": 3, "seed": 7});
    let answer = bench.post("/api/v1/rehearsals", "a", &asked).await;
    assert_eq!((answer.status().as_u16(), answer.header("location")), (201, "/api/v1/rehearsals/1"));
    let job = answer.ok();
    assert_eq!((&job["plan"], &job["runs"], &job["who"]), (&json!("ear"), &json!(3), &json!("local")));
    // Asked again because no answer came, it is the same job; the key serves for nothing else.
    let again = bench.post("/api/v1/rehearsals", "a", &asked).await;
    assert_eq!((again.status().as_u16(), again.header("idempotency-replayed")), (200, "true"));
    let other = bench.post("/api/v1/rehearsals", "a", &json!({"plan": plan(10.0)})).await;
    assert_eq!(other.problem(), "idempotency-key-reused");

    let job = ended(&bench, &json!(1)).await;
    assert_eq!((&job["state"], &job["runs_done"]), (&json!("done"), &json!(3)), "{job}");
    let told = &job["answer"];
    assert_eq!((&told["ok"], &told["runs"], &told["seed"]), (&json!(true), &json!(3), &json!(7)));
    assert_eq!((&told["begun"], &told["steps"][0]["do"]), (&json!(3), &json!("listen")));
    assert_eq!(told["pass"]["aos"].as_str().unwrap()[..19], job["aos"].as_str().unwrap()[..19]);
    assert_eq!(told["outcomes"].as_array().unwrap().len(), 3);
    let list = bench.get("/api/v1/rehearsals").await.ok();
    assert_eq!((&list["items"][0]["id"], &list["items"][0]["answer"]), (&json!(1), &Value::Null));
    // The same seeds give the same answer, also of a plan that is in use.
    bench.post("/api/v1/plans", "p", &plan(20.0)).await.ok();
    bench.until("/api/v1/plans", "/items/0/name", &json!("ear")).await;
    bench.post("/api/v1/rehearsals", "b", &json!({"name": "ear", "runs": 3, "seed": 7})).await.ok();
    assert_eq!(&ended(&bench, &json!(2)).await["answer"]["outcomes"], &told["outcomes"]);
    // A plan that cannot fit is told.
    bench.post("/api/v1/rehearsals", "c", &json!({"plan": plan(1500.0), "runs": 1})).await.ok();
    let long = ended(&bench, &json!(3)).await;
    let finding = &long["answer"]["findings"][0];
    assert_eq!((&finding["severity"], &finding["line"]), (&json!("error"), &Value::Null), "{long}");
    assert!(finding["problem"].as_str().unwrap().contains("1500 s at least"), "{finding}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rehearsal_is_cancelled_and_too_many_are_refused() {
    let bench = with_elements().await;
    for key in ["a", "b", "c", "d"] {
        bench.post("/api/v1/rehearsals", key, &json!({"plan": plan(60.0), "runs": 1000})).await.ok();
    }
    let fifth = bench.post("/api/v1/rehearsals", "e", &json!({"plan": plan(60.0)})).await;
    assert_eq!(fifth.problem(), "overloaded");
    for id in ["4", "3", "2", "1"] {
        let job = bench.delete(&format!("/api/v1/rehearsals/{id}"), &format!("x{id}")).await.ok();
        assert_eq!((&job["state"], &job["why"]), (&json!("cancelled"), &json!("local cancelled it")));
    }
    // Whose turn it was has stopped: the next one comes to its end.
    let next = bench.post("/api/v1/rehearsals", "f", &json!({"plan": plan(5.0), "runs": 1})).await.ok();
    assert_eq!(ended(&bench, &next["id"]).await["state"], "done");
    assert_eq!(bench.get("/api/v1/rehearsals/1").await.ok()["state"], "cancelled");
    assert_eq!(bench.get("/api/v1/rehearsals/99").await.problem(), "not-found");
}

#[tokio::test]
async fn what_cannot_be_rehearsed_says_why() {
    let bench = with_elements().await;
    for (asked, problem, says) in [
        (json!({}), "bad-argument", "either a plan"),
        (json!({"plan": plan(5.0), "name": "ear"}), "bad-argument", "either a plan"),
        (json!({"name": "ear"}), "unknown-plan", "no plan 'ear'"),
        (json!({"plan": plan(5.0), "runs": 0}), "bad-argument", "1 to 1000"),
        (json!({"plan": plan(5.0), "runs": 1001}), "bad-argument", "1 to 1000"),
        (json!({"plan": plan(5.0), "seed": u64::MAX}), "bad-argument", "greatest seed"),
        (json!({"plan": plan(5.0), "image_bytes": [9, 3]}), "bad-argument", "range of sizes"),
        (json!({"plan": plan(5.0), "at": "1850-01-01T00:00:00Z"}), "bad-parameter", "1900 to 2200"),
        (
            json!({"plan": {"name": "a", "satellite": "pixelsat-1", "min_pass": {"max_elevation_deg": 89.99}, "steps": [{"do": "listen", "for_s": 1}]}}),
            "pass-refused",
            "no pass",
        ),
        (
            json!({"plan": {"name": "a", "satellite": "pixelsat-1", "transmit": true, "steps": [{"do": "command", "command": "Reset"}]}}),
            "plan-refused",
            "nobody has approved it",
        ),
        (
            json!({"plan": {"name": "a", "satellite": "sputnik", "steps": [{"do": "listen", "for_s": 1}]}}),
            "unknown-satellite",
            "pixelsat-1",
        ),
    ] {
        let answer = bench.post("/api/v1/rehearsals", "k", &asked).await;
        assert_eq!(answer.problem(), problem, "{asked}: {}", answer.json());
        assert!(answer.json()["detail"].as_str().unwrap().contains(says), "{asked}: {}", answer.json());
    }
    let nowhere = Bench::of(station()).await;
    let answer = nowhere.post("/api/v1/rehearsals", "k", &json!({"plan": plan(5.0)})).await;
    assert_eq!(answer.problem(), "no-place");
}
