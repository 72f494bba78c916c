//! What is written down is sent: refused, hung up on, answered wrong, killed in between, held over the night.

use super::*;

const MINUTE: u64 = 60;

#[tokio::test(flavor = "multi_thread")]
async fn a_far_end_that_fails_is_asked_again_with_the_same_number_until_it_takes_it() {
    let folder = tempfile::tempdir().unwrap();
    let hook = Hook::saying(500).await;
    let life = Life::begin(&folder, &webhook(&folder, "hook", &hook), UtcUs(NOON_US)).await;
    life.report(Level::Warning);
    life.pass(3 * MINUTE).await;
    let tries = hook.count();
    assert!((3..=6).contains(&tries), "{tries} attempts in three minutes");
    let row = life.deliveries().await.remove(0);
    assert_eq!((row.state.as_str(), row.attempts), ("waiting", tries as i64));
    assert!(row.error.unwrap().contains("500"));
    hook.now_says(200);
    life.pass(10 * MINUTE).await;
    let posted = hook.wait(tries + 1).await;
    let first = &posted[0];
    for other in &posted[..=tries] {
        assert_eq!((other.header("webhook-id"), &other.body), (first.header("webhook-id"), &first.body));
        assert_eq!(other.header("webhook-signature"), first.header("webhook-signature"));
    }
    assert_eq!(life.deliveries().await[0].state, "sent");
    // Three failures in a row were an alert themselves, and it is over.
    let alerts = life.alerts().await;
    assert!(alerts.iter().any(|alert| alert.kind == AlertKind::Delivery && !alert.active), "{alerts:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn after_a_day_a_message_is_given_up() {
    let folder = tempfile::tempdir().unwrap();
    let hook = Hook::saying(503).await;
    let targets = webhook(&folder, "hook", &hook);
    let life = Life::begin(&folder, &targets, UtcUs(NOON_US)).await;
    life.report(Level::Warning);
    life.pass(MINUTE).await;
    let made = life.deliveries().await[0].made_at_us;
    drop(life);
    // Nobody was there for a day but for a few seconds: once more now, and at its very end for the last time.
    let life = Life::begin(&folder, &targets, UtcUs(made + 86_395_000_000)).await;
    life.report(Level::Warning);
    life.pass(3).await;
    let (before, row) = (hook.count(), life.deliveries().await.remove(0));
    assert_eq!((row.state.as_str(), row.next_at_us), ("waiting", made + 86_400_000_000));
    life.pass(60 * MINUTE).await;
    let row = life.deliveries().await.remove(0);
    assert_eq!((row.state.as_str(), hook.count()), ("given-up", before + 1));
    assert_eq!(row.attempts, hook.count() as i64);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_kill_between_the_archive_and_the_far_end_loses_nothing_and_keeps_the_number() {
    let folder = tempfile::tempdir().unwrap();
    // It takes the request and never answers: the life ends there.
    let hook = Hook::saying(0).await;
    let targets = webhook(&folder, "hook", &hook);
    let life = Life::begin(&folder, &targets, UtcUs(NOON_US)).await;
    life.report(Level::Critical);
    life.run_free();
    let lost = hook.wait(1).await.remove(0);
    assert_eq!(life.deliveries().await[0].attempts, 0);
    let at = life.now();
    drop(life);

    hook.now_says(200);
    let life = Life::begin(&folder, &targets, at).await;
    life.report(Level::Critical);
    life.pass(6).await;
    let posted = hook.wait(2).await;
    assert_eq!(posted[1].header("webhook-id"), lost.header("webhook-id"));
    life.pass(MINUTE).await;
    assert_eq!((hook.count(), life.deliveries().await[0].state.as_str()), (2, "sent"));
    drop(life);

    let life = Life::begin(&folder, &targets, UtcUs(at.0 + 600_000_000)).await;
    life.report(Level::Critical);
    life.pass(5 * MINUTE).await;
    assert_eq!(hook.count(), 2, "what was told is not told again");
}

#[tokio::test(flavor = "multi_thread")]
async fn one_that_hangs_holds_up_nobody_else() {
    let folder = tempfile::tempdir().unwrap();
    let (hung, mailbox) = (Hook::saying(0).await, Mailbox::new().await);
    let targets = format!("{}{}", webhook(&folder, "hook", &hung), mail("mail", &mailbox));
    let life = Life::begin(&folder, &targets, UtcUs(NOON_US)).await;
    life.report(Level::Warning);
    life.run_free();
    let mail = mailbox.wait(1).await.remove(0);
    assert!(mail.contains("Subject: ") && mail.contains("To: ops@example.org"), "{mail}");
    assert!(mail.contains("gs-server alert acknowledge 1"), "{mail}");
    assert_eq!(hung.wait(1).await.len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_mail_server_that_refuses_is_asked_again() {
    let folder = tempfile::tempdir().unwrap();
    let mailbox = Mailbox::new().await;
    mailbox.now_says("451 come back later");
    let life = Life::begin(&folder, &mail("mail", &mailbox), UtcUs(NOON_US)).await;
    life.report(Level::Warning);
    life.pass(MINUTE).await;
    let row = life.deliveries().await.remove(0);
    assert!(row.attempts >= 1 && row.error.as_ref().unwrap().contains("come back later"), "{row:?}");
    mailbox.now_says("250 ok");
    life.pass(10 * MINUTE).await;
    let mail = mailbox.wait(1).await.remove(0);
    assert!(mail.contains(&format!("Message-ID: <{}@roof", row.message_id)), "{mail}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_night_is_told_in_the_morning_in_one_message_and_the_gravest_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let hook = Hook::saying(200).await;
    let text = format!("[alerts]\nquiet_hours = [\"21:00-05:00\"]\n{}", webhook(&folder, "hook", &hook));
    let evening = UtcUs(NOON_US + 10 * 3_600_000_000);
    let life = Life::begin(&folder, &text, evening).await;
    life.report(Level::Warning);
    life.pass(20).await;
    let other = Condition::new(AlertKind::Backup, "weekly", Level::Distress, "the other backup failed");
    life.handle.report("weekly", Some(other));
    life.pass(60 * MINUTE).await;
    assert_eq!(hook.count(), 0);
    assert!(life.deliveries().await.iter().all(|row| row.state == "held"));
    let night = life.now();
    drop(life);

    // A restart in the night changes nothing.
    let life = Life::begin(&folder, &text, night).await;
    life.report(Level::Critical);
    life.pass(MINUTE).await;
    assert_eq!(hook.count(), 1, "critical passes");
    life.pass(7 * 60 * MINUTE).await;
    let posted = hook.wait(2).await;
    let digest: serde_json::Value = serde_json::from_str(&posted[1].body).unwrap();
    assert_eq!(digest["type"], "alert.digest");
    let text = digest["text"].as_str().unwrap();
    assert!(
        text.contains("the backup failed: warning") && text.contains("the other backup failed"),
        "{text}"
    );
    life.pass(60 * MINUTE).await;
    assert_eq!(hook.count(), 2);
    assert!(life.deliveries().await.iter().all(|row| ["sent", "in-digest"].contains(&row.state.as_str())));
}

#[tokio::test(flavor = "multi_thread")]
async fn that_the_archive_takes_nothing_is_told_without_the_archive() {
    let folder = tempfile::tempdir().unwrap();
    let hook = Hook::saying(200).await;
    let life = Life::begin(&folder, &webhook(&folder, "hook", &hook), UtcUs(NOON_US)).await;
    life.pass(10).await;
    life.store.set_max_page_count(1).await.unwrap();
    while life.store.apply(&event(life.now(), Level::Normal, &"x".repeat(500))).await.is_ok() {}
    let failing = StorageStatus { failing: Some("the disk is full".into()), ..StorageStatus::default() };
    life.show(Status { storage: failing, ..status(LinkState::Ok) });
    for _ in 0..200 {
        life.pass(5).await;
        if hook.count() > 0 {
            break;
        }
    }
    let told = hook.wait(1).await.remove(0);
    assert!(told.body.contains("the disk is full"), "{}", told.body);
    life.store.set_max_page_count(1_000_000).await.unwrap();
    life.show(status(LinkState::Ok));
    life.pass(5 * MINUTE).await;
    let rows = life.deliveries().await;
    assert_eq!(rows.iter().filter(|row| row.message_id == told.header("webhook-id")).count(), 1);
    let twice =
        hook.wait(1).await.iter().filter(|p| p.header("webhook-id") == told.header("webhook-id")).count();
    assert_eq!(twice, 1, "it is kept as sent");
}

#[tokio::test]
async fn each_form_of_chat_gets_what_it_takes() {
    use super::super::target::{Letter, Target};
    use crate::config::TargetSection;
    let hook = Hook::saying(200).await;
    let base = hook.url.strip_suffix("/hook").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let letter = Letter {
        message_id: "number-7".into(),
        kind: "alert.raised".into(),
        title: "[roof] WARNING: a < b".into(),
        text: "call @everyone & go\n".into(),
        made_at_us: NOON_US,
        data: serde_json::Value::Null,
    };
    for (at, (kind, secret, more)) in [
        ("matrix", "syt_token".to_owned(), format!("url = \"{base}\"\nroom = \"!a/b:example.org\"")),
        ("slack", hook.url.clone(), String::new()),
        ("discord", hook.url.clone(), String::new()),
    ]
    .into_iter()
    .enumerate()
    {
        secret_file(&folder, kind, &secret);
        let path = folder.path().join(kind);
        let text = format!("name = \"x\"\nkind = \"{kind}\"\nsecret_file = \"{}\"\n{more}", path.display());
        let section: TargetSection = toml::from_str(&text).unwrap();
        let target = Target::new(&section, "targets[0]", "roof").unwrap();
        assert!(!format!("{target:?} {}", target.shown).contains(&secret) || kind == "matrix");
        target.send(&letter).await.unwrap();
        let posted = hook.wait(at + 1).await.remove(at);
        let body: serde_json::Value = serde_json::from_str(&posted.body).unwrap();
        match kind {
            "matrix" => {
                let path = "PUT /_matrix/client/v3/rooms/!a%2Fb:example.org/send/m.room.message/number-7";
                assert_eq!(
                    (posted.line.as_str(), posted.header("authorization")),
                    (path, "Bearer syt_token")
                );
                assert!(body["body"].as_str().unwrap().contains("a < b"));
            }
            "slack" => assert!(body["text"].as_str().unwrap().contains("a &lt; b*\ncall @everyone &amp; go")),
            _ => assert_eq!(body["allowed_mentions"]["parse"], serde_json::json!([])),
        }
        // What fails names neither the address nor the token.
        hook.now_says(404);
        let error = target.send(&letter).await.unwrap_err().to_string();
        assert!(error.contains("404") && !error.contains("127.0.0.1") && !error.contains("syt"), "{error}");
        hook.now_says(200);
        drop(hook.wait(at + 2).await);
        hook.forget_last();
    }
}
