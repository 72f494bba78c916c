//! Values are made again from raw frames, and damage to them is found and mended.

use super::super::*;
use super::records::*;
use super::{Kind, fresh};
use mission::record::{DECODER_VERSION, Record};
use protocol::Downlink;

/// Changes rows behind the store's back, as a failing disk or an old program would have left them.
async fn meddle(store: &Store, statement: &'static str) {
    let mut writer = store.0.writer.lock().await;
    let mut connection = writer.begin().await.unwrap();
    super::super::db::sql(statement).execute(&mut connection).await.unwrap();
    writer.end(connection, Ok(())).await.unwrap();
}

both!(what_is_right_is_left_alone);
async fn what_is_right_is_left_alone(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    for id in 1..=450 {
        store.apply(&batch(heard(id))).await.unwrap();
    }
    store.apply(&batch(vec![Record::Frame(frame_of(451, &Downlink::Pong, &route()))])).await.unwrap();
    let mut told = Vec::new();
    let report = store.redecode(|progress| told.push((progress.frame, progress.last_frame))).await.unwrap();
    assert_eq!(told, [(200, 451), (400, 451), (451, 451)]);
    assert_eq!((report.frames, report.unchanged), (451, 450 * 29));
    assert_eq!((report.added, report.changed, report.removed, report.damaged), (0, 0, 0, 0), "{report:?}");
}

both!(what_is_missing_wrong_or_too_much_is_mended);
async fn what_is_missing_wrong_or_too_much_is_mended(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    for id in 1..=20 {
        store.apply(&batch(heard(id))).await.unwrap();
    }
    let before = store.latest("pixelsat-1").await.unwrap();
    meddle(&store, "delete from telemetry where frame = 3").await;
    meddle(&store, "update telemetry set value = 1e9 where frame = 4 and value = 42.0").await;
    meddle(&store, "update telemetry set decoder_version = 0 where frame = 5").await;
    let mut elsewhere = heard(7);
    elsewhere.retain_mut(|record| match record {
        Record::Telemetry(telemetry) => {
            telemetry.route.station = other_route().station;
            true
        }
        _ => false,
    });
    store.apply(&batch(elsewhere)).await.unwrap();
    meddle(&store, "insert into telemetry values (1, 5, 6, 1, 1.0, 1, 0)").await;
    let mut records = heard(21);
    records.retain(|record| matches!(record, Record::Frame(_)));
    store.apply(&batch(records)).await.unwrap();

    let report = store.redecode(|_| {}).await.unwrap();
    assert_eq!((report.added, report.removed), (29 + 29, 1), "{report:?}");
    assert_eq!((report.changed, report.damaged), (1 + 29 + 29, 1 + 29), "{report:?}");
    assert_eq!(report.findings.len(), 30);
    let again = store.redecode(|_| {}).await.unwrap();
    assert_eq!(
        (again.unchanged, again.added, again.changed, again.removed, again.damaged),
        (21 * 29, 0, 0, 0, 0)
    );
    let after = store.latest("pixelsat-1").await.unwrap();
    assert_eq!(before.len(), after.len());
    assert!(after.iter().all(|value| value.sample.frame == 21));
}

both!(it_goes_on_where_it_was_broken_off);
async fn it_goes_on_where_it_was_broken_off(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    for id in 1..=10 {
        store.apply(&batch(heard(id))).await.unwrap();
    }
    let cursor = format!("insert into redecode (decoder_version, last_frame) values ({DECODER_VERSION}, 7)");
    let cursor: &'static str = Box::leak(cursor.into_boxed_str());
    meddle(&store, cursor).await;
    assert_eq!(store.redecode(|_| {}).await.unwrap().frames, 3);
    assert_eq!(
        store.redecode(|_| {}).await.unwrap().frames,
        10,
        "done: the next one begins at the beginning"
    );
}

both!(damage_that_cannot_be_mended_is_told);
async fn damage_that_cannot_be_mended_is_told(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    store.apply(&batch(heard(1))).await.unwrap();
    let drop = match kind {
        Kind::Lite => "drop trigger events_are_never_changed",
        Kind::Pg => "drop trigger events_are_never_changed on events",
    };
    meddle(&store, drop).await;
    meddle(&store, "update events set message = 'nothing happened' where seq = 1").await;
    let report = store.redecode(|_| {}).await.unwrap();
    assert_eq!((report.damaged, report.findings.len()), (1, 1));
    assert!(report.findings[0].contains("the row of events that begins with 1"), "{report:?}");
    assert!(matches!(store.events(&EventQuery::default()).await.unwrap_err(), StoreError::Damaged { .. }));
}
