//! From what the station shows to what is kept.

use mission::Principal;
use mission::alert::AlertState;

use super::super::{Action, ActionFailure};
use super::*;

fn who() -> (Principal, String, [u8; 32]) {
    (Principal::new("anna"), "key-1".to_owned(), [7; 32])
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_link_is_an_alert_after_half_a_minute_and_over_a_minute_after_it_is_back() {
    let folder = tempfile::tempdir().unwrap();
    let life = Life::begin(&folder, "", UtcUs(NOON_US)).await;
    life.pass(10).await;
    assert_eq!(life.alerts().await, []);
    life.show(status(LinkState::Unavailable { reason: "unplugged".into() }));
    life.pass(25).await;
    assert_eq!(life.alerts().await, []);
    life.pass(12).await;
    let alerts = life.alerts().await;
    assert_eq!((alerts.len(), alerts[0].state()), (1, AlertState::Unacknowledged));
    assert_eq!((alerts[0].level, alerts[0].subject.as_str()), (Level::Warning, "e22"));
    life.show(status(LinkState::Ok));
    life.pass(70).await;
    assert_eq!(life.alerts().await[0].state(), AlertState::Returned);
    let done = life.handle.act(alerts[0].id, Action::Acknowledge, None, who()).await.unwrap();
    assert_eq!((done.alert.state(), done.replayed), (AlertState::Closed, false));
    assert_eq!(life.store.open_alerts().await.unwrap().0, []);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_life_knows_what_was_open_and_what_was_done() {
    let folder = tempfile::tempdir().unwrap();
    let life = Life::begin(&folder, "", UtcUs(NOON_US)).await;
    life.report(Level::Distress);
    life.pass(6).await;
    let id = life.alerts().await[0].id;
    life.handle.act(id, Action::Assign { to: Some("ben".into()) }, Some("soon".into()), who()).await.unwrap();
    let before = life.alerts().await;
    let later = life.now();
    drop(life);

    let life = Life::begin(&folder, "", later).await;
    life.report(Level::Distress);
    life.pass(6).await;
    assert_eq!(life.alerts().await, before, "nothing is raised anew");
    let again =
        life.handle.act(id, Action::Assign { to: Some("ben".into()) }, Some("soon".into()), who()).await;
    assert!(again.unwrap().replayed);
    let (anna, key, _) = who();
    let other = life.handle.act(id, Action::Acknowledge, None, (anna, key, [8; 32])).await;
    assert_eq!(other, Err(ActionFailure::KeyReused));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_happened_just_before_a_kill_is_an_alert_of_the_next_life_and_only_once() {
    let folder = tempfile::tempdir().unwrap();
    let life = Life::begin(&folder, "", UtcUs(NOON_US)).await;
    life.pass(6).await;
    // Time stands still while the test is at work, so nobody has looked yet.
    life.store.apply(&event(life.now(), Level::Distress, "sat reports error 32")).await.unwrap();
    let store = life.store.clone();
    drop((life, store));
    for times in [1, 1, 1] {
        let life = Life::begin(&folder, "", UtcUs(NOON_US + 60_000_000)).await;
        life.pass(6).await;
        let alerts = life.alerts().await;
        assert_eq!(
            (alerts.len(), alerts[0].times, alerts[0].message.as_str()),
            (1, times, "sat reports error 32")
        );
    }
}
