//! The two-person rule: what is critical waits for somebody else's yes to exactly that.

use axum::http::Method;
use serde_json::{Value, json};

use super::people::Browser;
use super::{Answer, Bench};
use crate::people::Role;

fn reset() -> Value {
    json!({"command": "Reset", "confirm": "Reset"})
}

struct Team {
    bench: Bench,
    operator: Browser,
    lead: Browser,
}

impl Team {
    async fn new() -> Self {
        let bench = Bench::with_people(|settings| {
            settings.two_person = true;
            settings.approval_us = 3_600_000_000;
        })
        .await;
        let operator = bench.somebody("otto", Role::Operator).await;
        let lead = bench.somebody("lea", Role::MissionLead).await;
        Self { bench, operator, lead }
    }

    async fn ask(&self, who: &Browser, key: &str, body: &Value) -> Answer {
        self.bench.send(who.write(Method::POST, "/api/v1/commands", key, body)).await
    }

    async fn approve(&self, who: &Browser, id: &Value, digest: &Value) -> Answer {
        let path = format!("/api/v1/approvals/{id}/approve");
        self.bench
            .send(who.write(Method::POST, &path, &format!("{id}{digest}"), &json!({"digest": digest})))
            .await
    }

    async fn commands(&self) -> usize {
        usize::try_from(self.bench.store.counts().await.unwrap().commands).unwrap()
    }
}

#[tokio::test]
async fn a_critical_command_goes_when_another_person_has_said_yes() {
    let team = Team::new().await;
    // What is not critical goes as ever.
    assert_eq!(team.ask(&team.operator, "p", &json!({"command": "Ping"})).await.status().as_u16(), 201);
    assert_eq!(
        team.ask(&team.operator, "n", &json!({"command": "Reset"})).await.problem(),
        "needs-confirmation"
    );
    let asked = team.ask(&team.operator, "r", &reset()).await;
    assert_eq!((asked.status().as_u16(), asked.header("location")), (202, "/api/v1/approvals/1"));
    assert_eq!(
        asked.ok(),
        json!({"outcome": "awaiting-approval", "command": null, "download": null, "approval": 1})
    );
    let again = team.ask(&team.operator, "r", &reset()).await;
    assert_eq!((again.status().as_u16(), again.header("idempotency-replayed")), (202, "true"));
    assert_eq!(team.commands().await, 1, "nothing but the ping");

    let list = team.bench.send(team.lead.read("/api/v1/approvals?open=true")).await.ok();
    let waiting = &list["items"][0];
    assert_eq!((&waiting["state"], &waiting["person"]), (&json!("awaiting"), &json!("otto")));
    let digest = waiting["digest"].clone();
    assert_eq!(team.approve(&team.operator, &json!(1), &digest).await.problem(), "forbidden");
    let other = json!("0".repeat(64));
    assert_eq!(team.approve(&team.lead, &json!(1), &other).await.problem(), "approval-refused");
    assert_eq!(team.commands().await, 1);
    let done = team.approve(&team.lead, &json!(1), &digest).await.ok();
    assert_eq!((&done["outcome"], &done["command"]), (&json!("command-queued"), &json!(2)));
    // Said twice, it counts once.
    let twice = team.bench.send(team.lead.write(
        Method::POST,
        "/api/v1/approvals/1/approve",
        "another-key",
        &json!({"digest": digest}),
    ));
    assert_eq!(twice.await.ok()["command"], 2);
    assert_eq!(team.commands().await, 2);
    let command = team.bench.send(team.lead.read("/api/v1/commands/2")).await.ok();
    assert_eq!((&command["principal"], &command["command"]), (&json!("otto"), &json!("Reset")));
    // Whoever asked hears of it under the same key.
    let heard = team.ask(&team.operator, "r", &reset()).await;
    assert_eq!((heard.header("idempotency-replayed"), &heard.ok()["command"]), ("true", &json!(2)));
    let settled = team.bench.send(team.lead.read("/api/v1/approvals/1")).await.ok();
    assert_eq!((&settled["state"], &settled["decided_by"]), (&json!("approved"), &json!("lea")));
}

#[tokio::test]
async fn nobody_approves_himself_by_whatever_way() {
    let team = Team::new().await;
    let asked = team.ask(&team.lead, "r", &reset()).await.ok();
    let approval = team.bench.send(team.lead.read("/api/v1/approvals/1")).await.ok();
    let digest = &approval["digest"];
    assert_eq!(asked["approval"], 1);
    assert_eq!(team.approve(&team.lead, &json!(1), digest).await.problem(), "approval-refused");
    // By a token of the same person, and by the server's own, which is nobody's.
    let root = team.bench.somebody("root-admin", Role::Administrator).await;
    let body = json!({"name": "leas", "scopes": ["look", "approve"], "days": 1, "owner": "lea"});
    let made = team.bench.send(root.write(Method::POST, "/api/v1/tokens", "t", &body)).await.ok();
    let local = super::TOKEN;
    for token in [made["secret"].as_str().unwrap(), local] {
        let mut request = super::write("/api/v1/approvals/1/approve", "k")
            .body(axum::body::Body::from(json!({"digest": digest}).to_string()))
            .unwrap();
        request.headers_mut().insert("authorization", format!("Bearer {token}").parse().unwrap());
        assert_eq!(team.bench.send(request).await.problem(), "approval-refused");
    }
    // And what a person's token asked for that person does not approve either.
    let body =
        json!({"name": "lead-script", "scopes": ["look", "command", "critical"], "days": 1, "owner": "lea"});
    let made = team.bench.send(root.write(Method::POST, "/api/v1/tokens", "u", &body)).await.ok();
    let mut request =
        super::write("/api/v1/commands", "k").body(axum::body::Body::from(reset().to_string())).unwrap();
    let bearer = format!("Bearer {}", made["secret"].as_str().unwrap());
    request.headers_mut().insert("authorization", bearer.parse().unwrap());
    assert_eq!(team.bench.send(request).await.ok()["approval"], 2);
    let second = team.bench.send(team.lead.read("/api/v1/approvals/2")).await.ok();
    assert_eq!(team.approve(&team.lead, &json!(2), &second["digest"]).await.problem(), "approval-refused");
    assert_eq!(team.commands().await, 0);
    team.approve(&root, &json!(2), &second["digest"]).await.ok();
    assert_eq!(team.commands().await, 1);
}

#[tokio::test]
async fn what_is_refused_or_too_late_is_not_released() {
    let team = Team::new().await;
    for (key, n) in [("a", 1), ("b", 2), ("c", 3)] {
        assert_eq!(team.ask(&team.operator, key, &reset()).await.ok()["approval"], n);
    }
    let digest = team.bench.send(team.lead.read("/api/v1/approvals/1")).await.ok()["digest"].clone();
    let refuse = |who: &Browser, id: u64| {
        let path = format!("/api/v1/approvals/{id}/refuse");
        who.write(Method::POST, &path, &format!("no{id}"), &json!({"why": "wrong orbit"}))
    };
    assert_eq!(team.bench.send(refuse(&team.lead, 1)).await.ok()["state"], "refused");
    assert_eq!(team.approve(&team.lead, &json!(1), &digest).await.problem(), "approval-refused");
    assert_eq!(team.ask(&team.operator, "a", &reset()).await.problem(), "approval-refused");
    // Whoever asked takes it back; another operator does not.
    let other = team.bench.somebody("olga", Role::Operator).await;
    assert_eq!(team.bench.send(refuse(&other, 2)).await.problem(), "forbidden");
    assert_eq!(team.bench.send(refuse(&team.operator, 2)).await.ok()["state"], "refused");
    team.bench.hands.pass_h(1.1);
    assert_eq!(team.approve(&team.lead, &json!(3), &digest).await.problem(), "approval-refused");
    assert_eq!(team.bench.send(team.lead.read("/api/v1/approvals/3")).await.ok()["state"], "expired");
    assert_eq!(team.ask(&team.operator, "c", &reset()).await.problem(), "approval-refused");
    let open = team.bench.send(team.lead.read("/api/v1/approvals?open=true")).await.ok();
    assert_eq!(open["items"], json!([]));
    assert_eq!(team.commands().await, 0);
}

#[tokio::test]
async fn another_request_under_the_key_and_another_digest_for_each_argument() {
    let team = Team::new().await;
    let set = |at: &str| json!({"command": "SetTimestamp", "arguments": {"utc": "2026-11-22T05:19:25.123Z"}, "confirm": "SetTimestamp", "expires_at": at});
    let one = team.ask(&team.operator, "a", &set("2100-01-01T00:00:00Z")).await;
    assert_eq!(one.status().as_u16(), 202, "{:?}", String::from_utf8_lossy(&one.bytes));
    let edited = team.ask(&team.operator, "a", &set("2100-01-02T00:00:00Z")).await;
    assert_eq!(edited.problem(), "idempotency-key-reused");
    team.ask(&team.operator, "b", &set("2100-01-02T00:00:00Z")).await.ok();
    team.ask(&team.operator, "c", &set("2100-01-01T00:00:00Z")).await.ok();
    let mut digests = Vec::new();
    for id in 1..=3 {
        let approval = team.bench.send(team.lead.read(&format!("/api/v1/approvals/{id}"))).await.ok();
        digests.push(approval["digest"].as_str().unwrap().to_owned());
    }
    assert_eq!(digests[0], digests[2]);
    assert_ne!(digests[0], digests[1]);
}

fn plan(note: f64) -> Value {
    json!({
        "name": "risky", "satellite": "pixelsat-1", "transmit": true,
        "steps": [
            {"do": "listen", "for_s": note},
            {"do": "repeat-until", "at_most": 1, "steps": [
                {"do": "command", "command": "Reset", "approved_by": {"name": "otto"}},
            ]},
        ],
    })
}

#[tokio::test]
async fn a_plan_with_critical_steps_is_armed_by_two_and_only_as_it_was_seen() {
    let team = Team::new().await;
    let write = |who: &Browser, path: &str, key: &str, body: &Value| who.write(Method::POST, path, key, body);
    let added = team.bench.send(write(&team.operator, "/api/v1/plans", "a", &plan(5.0))).await;
    assert_eq!(added.status().as_u16(), 200, "{}", String::from_utf8_lossy(&added.bytes));
    let arm = |key: &str| write(&team.operator, "/api/v1/plans/risky/arm", key, &json!({}));
    assert_eq!(team.bench.send(arm("b")).await.ok()["approval"], 1);
    let seen = team.bench.send(team.lead.read("/api/v1/approvals/1")).await.ok();
    assert_eq!(seen["kind"], "arm-plan");
    // The plan is exchanged meanwhile: what was seen is not there any more.
    team.bench.send(write(&team.operator, "/api/v1/plans", "c", &plan(6.0))).await.ok();
    assert_eq!(team.approve(&team.lead, &json!(1), &seen["digest"]).await.problem(), "approval-refused");
    assert_eq!(team.bench.send(arm("d")).await.ok()["approval"], 2);
    let seen = team.bench.send(team.lead.read("/api/v1/approvals/2")).await.ok();
    team.approve(&team.lead, &json!(2), &seen["digest"]).await.ok();
    let mut armed = false;
    for _ in 0..500 {
        let plans = team.bench.send(team.lead.read("/api/v1/plans")).await.ok();
        armed = plans["items"][0]["armed"] == json!(true);
        if armed {
            break;
        }
        crate::clock::wall_sleep(std::time::Duration::from_millis(10)).await;
    }
    assert!(armed);
    // Disarming needs nobody else.
    team.bench.send(write(&team.operator, "/api/v1/plans/risky/disarm", "e", &json!({}))).await.ok();
}

/// Every way to the engine passes the gate, or cannot carry anything critical.
#[test]
fn nothing_goes_round_the_gate() {
    fn files(folder: &std::path::Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                files(&path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    files(&root, &mut found);
    let mut callers: Vec<String> = found
        .iter()
        .filter(|path| !path.components().any(|part| part.as_os_str() == "tests"))
        .filter(|path| std::fs::read_to_string(path).unwrap().contains(".intent("))
        .map(|path| path.strip_prefix(&root).unwrap().display().to_string())
        .collect();
    callers.sort();
    // Elements only; the demo's own operator; the gate and what it lets through; arming links at a reload.
    let known = [
        "demo/operator.rs",
        "demo/scene.rs",
        "elements/door.rs",
        "http/release.rs",
        "http/write.rs",
        "run.rs",
    ];
    assert_eq!(callers, known, "a new way to the engine: lead it through http::release");
}
