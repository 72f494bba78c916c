//! What the database refuses, and that nothing of it remains.

use mission::record::{EventKind, ReceptionRssi, Record};
use mission::{FrameId, Stage, UtcUs};
use protocol::{Counter, Downlink, Nonce, Telecommand};

use super::super::StoreError;
use super::records::*;
use super::{Kind, Store, fresh};

/// A batch of good records with a bad one at the end leaves nothing, and the next one is stored.
async fn refused(store: &Store, bad: Record) {
    let before = (store.counts().await.unwrap(), store.last_event_seq().await.unwrap());
    let mut records = heard(1000);
    records.push(bad);
    let error = store.apply(&batch(records)).await.unwrap_err();
    assert!(matches!(error, StoreError::Conflict(_) | StoreError::OutOfRange { .. }), "{error:?}");
    assert!(!error.is_temporary());
    assert_eq!((store.counts().await.unwrap(), store.last_event_seq().await.unwrap()), before);
    let next =
        store.apply(&batch(vec![Record::Event(event(EventKind::Station, "still here"))])).await.unwrap();
    assert_eq!(next[0].sequence, before.1 + 1, "no gap in the sequence");
}

both!(a_counter_or_a_nonce_is_spent_once);
async fn a_counter_or_a_nonce_is_spent_once(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let records = vec![Record::Command(command(1, Telecommand::Ping)), Record::Sealed(sealed(1, 1, 100))];
    store.apply(&batch(records)).await.unwrap();
    refused(&store, Record::Sealed(sealed(1, 2, 100))).await;
    let same_counter =
        mission::record::SealedRecord { nonce: Nonce::new(Counter(100), [9; 4]), ..sealed(1, 2, 100) };
    refused(&store, Record::Sealed(same_counter)).await;
    let same_nonce = mission::record::SealedRecord { counter: Counter(101), ..sealed(1, 2, 100) };
    refused(&store, Record::Sealed(same_nonce)).await;
    let other_key =
        mission::record::SealedRecord { key: protocol::Key::from_bytes([1; 16]).id(), ..sealed(1, 2, 100) };
    store.apply(&batch(vec![Record::Sealed(other_key)])).await.unwrap();
    store.apply(&batch(vec![Record::Sealed(sealed(1, 2, 101))])).await.unwrap();
}

both!(rows_that_point_nowhere_or_stand_there_already_are_refused);
async fn rows_that_point_nowhere_or_stand_there_already_are_refused(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let records = vec![
        Record::Frame(frame_of(1, &Downlink::Pong, &route())),
        Record::Image(image(1, 1, 3)),
        Record::Chunk(chunk(1, 0, 1, 1, false)),
        Record::Intent(receipt("once", mission::Accepted::Done)),
    ];
    store.apply(&batch(records)).await.unwrap();
    refused(&store, Record::Stage(stage(9, 0, Stage::Queued, NOON_US))).await;
    refused(&store, Record::Sealed(sealed(9, 1, 1))).await;
    refused(&store, Record::Chunk(chunk(1, 1, 99, 1, false))).await;
    refused(&store, Record::Chunk(chunk(1, 0, 1, 2, false))).await;
    let other_bytes = Record::Frame(frame_of(1, &Downlink::Heartbeat(heartbeat(1)), &route()));
    refused(&store, other_bytes).await;
    refused(&store, Record::Intent(receipt("once", mission::Accepted::Done))).await;
    let nobody_heard_it =
        ReceptionRssi { frame: FrameId(1), route: route(), received_at: UtcUs(0), rssi_dbm: -90 };
    refused(&store, Record::ReceptionRssi(nobody_heard_it)).await;
    refused(&store, Record::CounterFloor(floor(u64::MAX))).await;
}

both!(history_cannot_be_rewritten);
async fn history_cannot_be_rewritten(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    let mut records = heard(1);
    records.extend([
        Record::Command(command(1, Telecommand::Ping)),
        Record::Stage(stage(1, 0, Stage::Queued, NOON_US)),
        Record::Sealed(sealed(1, 1, 100)),
        Record::CounterFloor(floor(100)),
        Record::Image(image(1, 1, 3)),
        Record::Chunk(chunk(1, 0, 1, 1, false)),
        Record::Audit(audit("x")),
        Record::Intent(receipt("once", mission::Accepted::Done)),
    ]);
    store.apply(&batch(records)).await.unwrap();
    let changes = [
        "update frames set heard_at_us = 1",
        "delete from frames",
        "delete from receptions",
        "update routes set link = 'x'",
        "delete from routes",
        "update commands set priority = 9",
        "delete from commands",
        "update command_stages set stage = 'answered'",
        "delete from command_stages",
        "update sealed_frames set counter = 5",
        "delete from sealed_frames",
        "update counter_floors set counter = 5",
        "delete from counter_floors",
        "update chunks set conflict = 1",
        "delete from chunks",
        "update events set message = ''",
        "delete from events",
        "update audit set who = 'eve'",
        "delete from audit",
        "update intents set accepted = 'done'",
        "delete from intents",
    ];
    for change in changes {
        let error = parent.meddle(change).await.unwrap_err();
        assert!(error.contains("never"), "{change}: {error}");
    }
}

both!(a_future_that_is_dropped_midway_does_not_stand_in_the_way);
async fn a_future_that_is_dropped_midway_does_not_stand_in_the_way(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    for id in 1..=20 {
        let records = batch(heard(id));
        let mut apply = Box::pin(store.apply(&records));
        for _ in 0..id {
            let _ = futures_util::poll!(&mut apply);
            tokio::task::yield_now().await;
        }
        drop(apply);
    }
    let frames = store.counts().await.unwrap().frames;
    let stored = store.apply(&batch(heard(100))).await.unwrap();
    let counts = store.counts().await.unwrap();
    assert!(counts.frames > frames && counts.events == 2 * counts.frames, "{counts:?}");
    assert_eq!(stored[1].sequence, counts.events);
}
