//! Alerts over the API, with targets that are real sockets.

use std::os::unix::fs::OpenOptionsExt as _;
use std::time::Duration;

use mission::Level;
use mission::alert::{AlertKind, Condition};
use serde_json::{Value, json};

use super::Bench;
use crate::alerts::catchers::{Hook, Mailbox};
use crate::clock::wall_sleep;
use crate::storage::Page;

fn backup_failed(bench: &Bench, level: Level) {
    let condition = Condition::new(AlertKind::Backup, "nightly", level, "the backup failed: no space left");
    bench.alerts.report("backup", Some(condition));
}

async fn open(bench: &Bench, count: usize) -> Vec<Value> {
    for _ in 0..600 {
        let items = bench.get("/api/v1/alerts").await.ok()["items"].as_array().unwrap().clone();
        if items.len() == count {
            return items;
        }
        wall_sleep(Duration::from_millis(20)).await;
    }
    panic!("there never were {count} open alerts");
}

#[tokio::test]
async fn an_alert_is_raised_acknowledged_assigned_shelved_and_closes() {
    let bench = Bench::watching("").await;
    backup_failed(&bench, Level::Warning);
    let alert = open(&bench, 1).await[0].clone();
    assert_eq!((&alert["state"], &alert["level"]), (&json!("unacknowledged"), &json!("warning")));
    assert_eq!(
        (&alert["kind"], &alert["subject"], &alert["id"]),
        (&json!("backup"), &json!("nightly"), &json!(1))
    );
    assert_eq!(bench.get("/api/v1/alerts/1").await.ok(), alert);

    let body = json!({"note": "disk is on order"});
    let known = bench.post("/api/v1/alerts/1/acknowledge", "a", &body).await;
    assert_eq!(known.ok()["state"], "acknowledged");
    assert_eq!(known.ok()["acknowledged_by"], "local");
    let again = bench.post("/api/v1/alerts/1/acknowledge", "a", &body).await;
    assert_eq!((again.ok(), again.header("idempotency-replayed")), (known.ok(), "true"));
    let other = bench.post("/api/v1/alerts/1/acknowledge", "a", &json!({"note": "x"})).await;
    assert_eq!(other.problem(), "idempotency-key-reused");

    let given = bench.post("/api/v1/alerts/1/assign", "b", &json!({"to": "ben"})).await.ok();
    assert_eq!((&given["assignee"], &given["note"]), (&json!("ben"), &json!("disk is on order")));
    let until = api::Time::from_unix_us(bench.timer.now().utc.0 + 3_600_000_000);
    let shelved = bench.post("/api/v1/alerts/1/shelve", "c", &json!({"until": until})).await.ok();
    assert_eq!((&shelved["state"], &shelved["shelved_by"]), (&json!("shelved"), &json!("local")));
    let past = bench.post("/api/v1/alerts/1/shelve", "d", &json!({"until": "2020-01-01T00:00:00Z"})).await;
    assert_eq!(
        (past.problem(), past.json()["errors"][0]["field"].clone()),
        ("bad-argument".into(), json!("until"))
    );
    assert_eq!(bench.post("/api/v1/alerts/1/unshelve", "e", &json!({})).await.ok()["state"], "acknowledged");

    bench.alerts.report("backup", None);
    open(&bench, 0).await;
    let history = bench.get("/api/v1/alerts?state=closed").await.ok();
    assert_eq!(history["items"][0]["state"], "closed");
    assert_eq!(bench.post("/api/v1/alerts/1/acknowledge", "f", &json!({})).await.problem(), "alert-not-open");
    assert_eq!(bench.post("/api/v1/alerts/2/acknowledge", "g", &json!({})).await.problem(), "not-found");
    assert_eq!(bench.get("/api/v1/alerts?state=lost").await.problem(), "bad-parameter");

    let audit = bench.get("/api/v1/audit").await.ok();
    let actions: Vec<&str> =
        audit["items"].as_array().unwrap().iter().filter_map(|row| row["action"].as_str()).collect();
    for action in ["alert.acknowledge", "alert.assign", "alert.shelve", "alert.unshelve"] {
        assert!(actions.contains(&action), "{actions:?}");
    }
    let events = bench.get("/api/v1/events?kind=alert").await.ok();
    let told: Vec<&str> =
        events["items"].as_array().unwrap().iter().filter_map(|event| event["message"].as_str()).collect();
    assert!(told.last().unwrap().contains("raised: the backup failed"), "{told:?}");
    assert!(told[0].contains("returned to normal"), "{told:?}");
}

#[tokio::test]
async fn what_the_satellite_reports_is_an_alert_like_a_value() {
    let bench =
        Bench::watching("[[alerts.rules]]\nkind = \"event\"\nevents = [\"link\"]\nmin_level = \"watch\"")
            .await;
    wall_sleep(Duration::from_millis(200)).await;
    bench.hub_event(Level::Watch).await;
    let alert = open(&bench, 1).await[0].clone();
    assert_eq!((&alert["state"], &alert["active"]), (&json!("returned"), &json!(false)));
    assert_eq!(bench.post("/api/v1/alerts/1/acknowledge", "a", &json!({})).await.ok()["state"], "closed");
    open(&bench, 0).await;
}

#[tokio::test]
async fn a_mail_server_and_a_webhook_get_the_message_and_the_test() {
    let (mailbox, hook) = (Mailbox::new().await, Hook::saying(204).await);
    let bench = Bench::watching(&format!(
        "[[alerts.targets]]\nname = \"mail\"\nkind = \"email\"\nserver = \"{}\"\nsecurity = \"none\"\n\
         from = \"Ground <ground@example.org>\"\nto = [\"ops@example.org\"]\n\
         [[alerts.targets]]\nname = \"hook\"\nkind = \"webhook\"\nurl = \"{}\"\nsecret_file = \"hook.key\"\n",
        mailbox.address, hook.url
    ))
    .await;
    secret(&bench, "hook.key", "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw");
    for (target, key) in [("mail", "a"), ("hook", "b")] {
        let tested = bench.post(&format!("/api/v1/alerts/targets/{target}/test"), key, &json!({})).await;
        assert_eq!(tested.ok(), json!({ "target": target }));
    }
    assert!(mailbox.wait(1).await[0].contains("test of the alerts"));
    assert_eq!(
        bench.post("/api/v1/alerts/targets/x/test", "c", &json!({})).await.problem(),
        "unknown-target"
    );

    backup_failed(&bench, Level::Critical);
    let mail = mailbox.wait(2).await[1].clone();
    assert!(mail.contains("the backup failed: no space left") && mail.contains("Message-ID: <"), "{mail}");
    let posted = hook.wait(2).await[1].clone();
    let body: Value = serde_json::from_str(&posted.body).unwrap();
    assert_eq!((&body["type"], &body["data"]["level"]), (&json!("alert.raised"), &json!("critical")));
    assert_eq!(
        (&body["data"]["alert"]["kind"], &body["data"]["simulated"]),
        (&json!("backup"), &json!(true))
    );
    assert_eq!(posted.header("webhook-id"), body["id"].as_str().unwrap());
    assert!(posted.header("webhook-signature").starts_with("v1,"), "{}", posted.header("webhook-signature"));

    // That the message went through is written down before it is told.
    for _ in 0..500 {
        let kept = bench.store.deliveries(None, &Page::default()).await.unwrap();
        if kept.len() == 2 && kept.iter().all(|row| row.state == "sent") {
            break;
        }
        wall_sleep(Duration::from_millis(20)).await;
    }
    for (key, answer) in [(500, "delivery-failed"), (403, "delivery-failed")] {
        hook.now_says(key);
        let failed = bench.post("/api/v1/alerts/targets/hook/test", &key.to_string(), &json!({})).await;
        assert_eq!(failed.problem(), answer);
        assert!(!failed.json().to_string().contains("whsec"));
    }
    let targets = bench.get("/api/v1/alerts/targets").await.ok();
    assert!(targets["items"][1]["failing"].as_str().unwrap().contains("403"), "{targets}");
    assert_eq!(targets["items"][0]["failing"], Value::Null);
    let kept = bench.store.deliveries(None, &Page::default()).await.unwrap();
    assert_eq!(kept.len(), 2, "tests are not kept");
    assert!(!format!("{kept:?}").contains("whsec"));
}

fn secret(bench: &Bench, name: &str, text: &str) {
    use std::io::Write as _;
    let path = bench.folder.path().join(name);
    let mut file =
        std::fs::OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(path).unwrap();
    writeln!(file, "{text}").unwrap();
}
