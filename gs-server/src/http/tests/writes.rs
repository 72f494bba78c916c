//! What is accepted is durable, and the same key gives the same answer.

use serde_json::{Value, json};

use super::Bench;

fn ping() -> Value {
    json!({"command": "Ping"})
}

#[tokio::test]
async fn a_command_is_queued_and_can_be_looked_at_and_withdrawn() {
    let bench = Bench::new().await;
    let answer = bench
        .post(
            "/api/v1/commands",
            "a",
            &json!({"command": "GetImageChunk", "arguments": {"first": 3, "count": 8}, "priority": 5}),
        )
        .await;
    assert_eq!(answer.status(), 201);
    assert_eq!(answer.ok()["outcome"], "command-queued");
    assert_eq!(answer.header("location"), "/api/v1/commands/1");
    assert_eq!(answer.header("idempotency-replayed"), "");

    let command = bench.get("/api/v1/commands/1").await.ok();
    assert_eq!(command["command"], "GetImageChunk");
    assert_eq!(command["arguments"], json!({"first": 3, "count": 8}));
    assert_eq!((&command["stage"], &command["priority"]), (&json!("queued"), &json!(5)));
    assert_eq!(
        (&command["satellite"], &command["station"], &command["link"]),
        (&json!("pixelsat-1"), &json!("bench"), &json!("e22"))
    );
    assert_eq!(command["principal"], "local");
    assert_eq!(command["key"].as_str().unwrap().len(), 8);
    assert_eq!(command["stages"][0]["stage"], "queued");

    let answer = bench.post("/api/v1/commands/1/cancel", "b", &json!({})).await;
    assert_eq!(answer.ok(), json!({"outcome": "command-cancelled", "command": 1, "download": null}));
    assert_eq!(bench.get("/api/v1/commands/1").await.ok()["stage"], "cancelled");
    let list = bench.get("/api/v1/commands?stage=cancelled&satellite=pixelsat-1&limit=1").await.ok();
    assert_eq!((&list["items"][0]["id"], &list["next"]), (&json!(1), &json!(1)));
    assert!(bench.get("/api/v1/commands?stage=queued").await.ok()["items"].as_array().unwrap().is_empty());
    assert_eq!(bench.post("/api/v1/commands/99/cancel", "c", &json!({})).await.problem(), "unknown-command");
}

#[tokio::test]
async fn the_audit_tells_who_did_what_page_by_page() {
    let bench = Bench::new().await;
    bench.post("/api/v1/commands", "a", &ping()).await.ok();
    bench.post("/api/v1/commands/1/cancel", "b", &json!({})).await.ok();
    let newest = bench.get("/api/v1/audit?limit=1").await.ok();
    let row = &newest["items"][0];
    assert_eq!((&row["who"], &row["action"]), (&json!("local"), &json!("command.cancel")));
    assert_eq!((&row["station"], &row["detail"]), (&json!("bench"), &json!("command 1")));
    assert!(row["at"].as_str().unwrap().ends_with('Z'));
    let before = format!("/api/v1/audit?before={}", newest["next"]);
    let older = bench.get(&before).await.ok();
    assert_eq!((&older["items"][0]["action"], &older["next"]), (&json!("command.create"), &Value::Null));
    assert_eq!(older["items"].as_array().unwrap().len(), 1);
    assert_eq!(bench.get("/api/v1/audit?who=eve").await.problem(), "bad-parameter");

    let command = bench.get("/api/v1/commands/1").await.ok();
    for stage in command["stages"].as_array().unwrap() {
        for field in ["satellite", "station", "link", "key"] {
            assert_eq!(stage[field], command[field], "{field}");
        }
    }
}

#[tokio::test]
async fn the_same_key_gives_the_same_answer_and_another_body_is_refused() {
    let bench = Bench::new().await;
    let first = bench.post("/api/v1/commands", "one", &ping()).await;
    // Spacing and order make no difference.
    let again = bench.post("/api/v1/commands", "one", &json!({"command": "Ping"})).await;
    assert_eq!((first.status().as_u16(), again.status().as_u16()), (201, 200));
    assert_eq!(again.header("idempotency-replayed"), "true");
    assert_eq!(first.json(), again.json());
    let other = bench.post("/api/v1/commands", "one", &json!({"command": "GetAdcsInfo"})).await;
    assert_eq!((other.status().as_u16(), other.problem().as_str()), (409, "idempotency-key-reused"));
    let elsewhere = bench.post("/api/v1/clock/vouch", "one", &json!({})).await;
    assert_eq!(elsewhere.problem(), "idempotency-key-reused");
    assert_eq!(bench.store.counts().await.unwrap().commands, 1);
}

#[tokio::test]
async fn two_at_once_under_one_key_are_one_command() {
    let bench = Bench::new().await;
    let body = ping();
    let (a, b) =
        tokio::join!(bench.post("/api/v1/commands", "k", &body), bench.post("/api/v1/commands", "k", &body));
    assert_eq!(a.ok(), b.ok());
    assert_eq!(bench.store.counts().await.unwrap().commands, 1);
}

#[tokio::test]
async fn wrong_requests_name_the_field_and_the_remedy() {
    let bench = Bench::new().await;
    for (body, problem, field) in [
        (
            json!({"command": "GetImageChunk", "arguments": {"first": 0, "count": 0}}),
            "bad-argument",
            "arguments.count",
        ),
        (json!({"command": "Pong"}), "bad-argument", "command"),
        (json!({"command": "Ping", "priority": "high"}), "wrong-shape", "priority"),
        (json!({"command": "Ping", "gate": "open"}), "wrong-shape", "gate"),
        (json!({"command": "Ping", "expires_at": "soon"}), "wrong-shape", "expires_at"),
        (json!({"command": "Ping", "expires_at": "1999-01-01T00:00:00Z"}), "already-expired", "expires_at"),
        (json!({"command": "Ping", "attempts": 0}), "bad-argument", "attempts"),
        (json!({"command": "Ping", "satellite": "other"}), "unknown-satellite", "satellite"),
        (json!({"command": "Ping", "link": "No Link"}), "unknown-link", "link"),
        (json!({"command": "Ping", "link": "other"}), "unknown-link", "link"),
        (json!({"command": "Reset"}), "needs-confirmation", "confirm"),
        (
            json!({"command": "GetImageRanges", "arguments": {"ranges": [{"first": 0, "count": 1}]}}),
            "not-in-profile",
            "command",
        ),
    ] {
        let answer = bench.post("/api/v1/commands", "k", &body).await;
        assert_eq!(answer.problem(), problem, "{body}");
        let problem = answer.json();
        assert_eq!(problem["errors"][0]["field"], field, "{problem}");
    }
    assert_eq!(bench.store.counts().await.unwrap().commands, 0);
}

#[tokio::test]
async fn downloads_links_clock_and_keys_reach_the_engine() {
    let bench = Bench::new().await;
    let download = bench.post("/api/v1/downloads", "a", &json!({"satellite": "pixelsat-1"})).await;
    assert_eq!(download.ok()["outcome"], "download-ordered");
    assert_eq!(download.header("location"), "/api/v1/downloads/1");
    let view = bench.get("/api/v1/downloads/1").await.ok();
    assert_eq!((&view["state"], &view["image"]), (&json!("active"), &Value::Null));
    bench.post("/api/v1/downloads/1/cancel", "b", &json!({})).await.ok();
    assert_eq!(bench.get("/api/v1/downloads").await.ok()["items"][0]["state"], "cancelled");

    bench.post("/api/v1/links/e22/disarm", "c", &json!({})).await.ok();
    bench.until("/api/v1/station", "/links/0/armed", &json!(false)).await;
    bench.post("/api/v1/links/e22/arm", "d", &json!({})).await.ok();
    bench.until("/api/v1/station", "/links/0/armed", &json!(true)).await;
    assert_eq!(bench.post("/api/v1/links/none/arm", "e", &json!({})).await.problem(), "unknown-link");

    bench.post("/api/v1/clock/vouch", "f", &json!({})).await.ok();
    let key = bench.get("/api/v1/station").await.ok()["satellites"][0]["key"].as_str().unwrap().to_owned();
    assert_eq!(
        bench.post(&format!("/api/v1/keys/{key}/confirm-counter"), "g", &json!({})).await.problem(),
        "not-locked"
    );
    assert_eq!(
        bench.post("/api/v1/keys/00000000/confirm-counter", "h", &json!({})).await.problem(),
        "unknown-key"
    );
    assert_eq!(
        bench.post("/api/v1/keys/nonsense/confirm-counter", "i", &json!({})).await.problem(),
        "unknown-key"
    );
}
