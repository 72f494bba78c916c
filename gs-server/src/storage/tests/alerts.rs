//! Alerts and the messages about them: whole or not at all, and back as they were.

use mission::alert::{Alert, AlertKind, Shelf, Signed, Told};
use mission::{AlertId, Level, Principal, UtcUs};

use super::super::{AlertBatch, AlertQuery, Delivery, DeliveryState, Page};
use super::records::*;
use super::{Kind, fresh, reopen};

fn alert(id: u64, level: Level) -> Alert {
    Alert {
        id: AlertId(id),
        rule: "link".into(),
        kind: AlertKind::Link,
        subject: "e22".into(),
        satellite: Some(route().satellite),
        level,
        worst: Level::Severe,
        active: true,
        message: "link e22 is unavailable: 'unplugged'; drop table alerts".into(),
        times: 3,
        raised_at: UtcUs(NOON_US),
        changed_at: UtcUs(NOON_US + 1),
        waiting_since: UtcUs(NOON_US + 2),
        returned_at: None,
        acknowledged: None,
        shelved: None,
        assignee: None,
        note: None,
        closed_at: None,
        told: None,
        escalated: 0,
    }
}

pub(super) fn full_of_everything(id: u64) -> Alert {
    Alert {
        returned_at: Some(UtcUs(NOON_US + 3)),
        acknowledged: Some(Signed { who: Principal::new("anna"), at: UtcUs(NOON_US + 4) }),
        shelved: Some(Shelf { who: Principal::new("ben"), until: UtcUs(NOON_US + 5) }),
        assignee: Some("carl".into()),
        note: Some("an antenna\nin repair".into()),
        closed_at: Some(UtcUs(NOON_US + 6)),
        told: Some(Told { active: false, level: Level::Watch, times: 2, at: UtcUs(NOON_US + 7) }),
        escalated: 2,
        active: false,
        ..alert(id, Level::Watch)
    }
}

pub(super) fn message(number: &str, alert: u64, state: DeliveryState) -> Delivery {
    Delivery {
        message_id: number.into(),
        alert: Some(AlertId(alert)),
        target: "chat".into(),
        what: "raised",
        level: Level::Warning,
        title: "a title".into(),
        body: "a text\n".into(),
        made_at: UtcUs(NOON_US),
        state,
    }
}

fn batch(alerts: Vec<Alert>, deliveries: Vec<Delivery>) -> AlertBatch {
    AlertBatch { alerts, deliveries, ..AlertBatch::default() }
}

both!(alerts_come_back_as_they_were_and_history_is_no_burden);
async fn alerts_come_back_as_they_were_and_history_is_no_burden(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    let kept =
        AlertBatch { progress: Some((17, NOON_US)), ..batch(vec![alert(1, Level::Watch)], Vec::new()) };
    store.keep_alerts(&kept).await.unwrap();
    store
        .keep_alerts(&batch(vec![full_of_everything(2), alert(1, Level::Severe)], Vec::new()))
        .await
        .unwrap();
    store.close().await.unwrap();
    drop(store);
    let store = reopen(&parent).await.unwrap();
    assert_eq!(store.open_alerts().await.unwrap(), (vec![alert(1, Level::Severe)], 2));
    assert_eq!(store.alert(2).await.unwrap(), Some(full_of_everything(2)));
    let progress = store.alert_progress().await.unwrap().unwrap();
    assert_eq!((progress.events_through, progress.runs_through_us), (17, NOON_US));
    let ask = |open, level| AlertQuery { open, level, ..AlertQuery::default() };
    for (open, ids) in [(None, vec![2, 1]), (Some(true), vec![1]), (Some(false), vec![2])] {
        let found: Vec<u64> =
            store.alerts(&ask(open, Level::Normal)).await.unwrap().iter().map(|alert| alert.id.0).collect();
        assert_eq!(found, ids);
    }
    assert_eq!(store.alerts(&ask(None, Level::Severe)).await.unwrap().len(), 2);
}

both!(a_batch_is_kept_whole_or_not_at_all);
async fn a_batch_is_kept_whole_or_not_at_all(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let first = message("a", 1, DeliveryState::Waiting);
    store.keep_alerts(&batch(vec![alert(1, Level::Watch)], vec![first.clone()])).await.unwrap();
    // The same batch again, because its answer was lost, changes nothing.
    store.keep_alerts(&batch(vec![alert(1, Level::Watch)], vec![first])).await.unwrap();
    // A message is about an alert that is there.
    let wrong = message("b", 9, DeliveryState::Waiting);
    assert!(store.keep_alerts(&batch(vec![alert(2, Level::Watch)], vec![wrong])).await.is_err());
    assert_eq!(store.open_alerts().await.unwrap().1, 1);
    assert_eq!(store.deliveries(None, &Page::default()).await.unwrap().len(), 1);
    store.keep_alerts(&batch(vec![alert(2, Level::Watch)], Vec::new())).await.unwrap();
}

both!(a_night_becomes_one_message_and_a_single_one_goes_as_it_is);
async fn a_night_becomes_one_message_and_a_single_one_goes_as_it_is(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let held = |number| message(number, 1, DeliveryState::Held);
    store.keep_alerts(&batch(vec![alert(1, Level::Watch)], vec![held("a")])).await.unwrap();
    assert!(store.has_held_deliveries("chat").await.unwrap());
    assert!(!store.has_held_deliveries("mail").await.unwrap());
    let at = UtcUs(NOON_US + 1_000);
    store.digest_deliveries("chat", "d", at, |_| panic!("one is no digest")).await.unwrap();
    let waiting = store.waiting_deliveries("chat").await.unwrap();
    assert_eq!((waiting.len(), waiting[0].message_id.as_str(), waiting[0].next_at_us), (1, "a", at.0));

    store.keep_alerts(&batch(Vec::new(), vec![held("b"), held("c")])).await.unwrap();
    let compose = |rows: &[super::super::DeliveryRow]| ("night".to_owned(), format!("{} rows", rows.len()));
    store.digest_deliveries("chat", "d", at, compose).await.unwrap();
    store.digest_deliveries("chat", "e", at, compose).await.unwrap();
    let waiting = store.waiting_deliveries("chat").await.unwrap();
    assert_eq!(waiting.len(), 2);
    assert_eq!((waiting[1].message_id.as_str(), waiting[1].body.as_str()), ("d", "2 rows"));
    let told = store.deliveries(Some("chat"), &Page::default()).await.unwrap();
    assert!(told.iter().filter(|row| row.state == "in-digest").all(|row| row.digest == Some(waiting[1].id)));
}
