//! What was stored is what a restart goes on from.

use mission::record::{DownloadState, EventRecord, Record};
use mission::snapshot::Witness;
use mission::{FrameId, Level, Stage, UtcUs};
use protocol::{Counter, Downlink, Key, Telecommand};

use super::records::*;
use super::{Kind, fresh, reopen};

const HOUR_US: i64 = 3_600_000_000;

both!(an_empty_folder_gives_an_empty_snapshot);
async fn an_empty_folder_gives_an_empty_snapshot(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let snapshot = store.snapshot(&[route().satellite], &[key()]).await.unwrap();
    assert_eq!(snapshot.last_ids.frame, 0);
    assert!(snapshot.satellites.is_empty());
    assert_eq!((snapshot.keys[0].counter, snapshot.keys[0].witness.clone()), (None, Witness::Missing));
}

both!(everything_that_is_not_over_comes_back);
async fn everything_that_is_not_over_comes_back(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    let long = Telecommand::SetAdcsTarget { latitude_deg: 59.9, longitude_deg: 10.7 };
    let records = vec![
        Record::Frame(frame_of(1, &Downlink::Pong, &route())),
        Record::Image(image(1, 1, 2)),
        Record::Image(image(2, 1, 5)),
        Record::Chunk(chunk(2, 4, 1, 4, false)),
        Record::Chunk(chunk(2, 0, 1, 9, false)),
        Record::Chunk(chunk(2, 0, 1, 8, true)),
        Record::Chunk(chunk(2, 0, 1, 7, true)),
        Record::Download(download(1, Some(1), DownloadState::Complete)),
        Record::Download(download(2, Some(2), DownloadState::Active)),
        Record::Limit(limit("heartbeat.temp", Level::Watch, Some(41.0))),
        Record::Limit(limit("heartbeat.rad", Level::Normal, Some(1.0))),
        // 1 is answered, 2 waits, 3 is sealed twice, 4 is unknown lately, 5 was long ago.
        Record::Command(command(1, Telecommand::Ping)),
        Record::Stage(stage(1, 0, Stage::Queued, NOON_US)),
        Record::Stage(stage(1, 1, Stage::Answered, NOON_US)),
        Record::Command(command(2, long.clone())),
        Record::Stage(stage(2, 0, Stage::Queued, NOON_US)),
        Record::Command(command(3, Telecommand::GetImageInfo)),
        Record::Stage(stage(3, 0, Stage::Queued, NOON_US)),
        Record::Sealed(sealed(3, 1, 100)),
        Record::Sealed(sealed(3, 2, 101)),
        Record::Stage(stage(3, 2, Stage::Radiating, NOON_US + 2)),
        Record::Command(command(4, Telecommand::Reset)),
        Record::Stage(stage(4, 1, Stage::Unknown, NOON_US - 23 * HOUR_US)),
        Record::Command(command(5, Telecommand::Reset)),
        Record::Stage(stage(5, 1, Stage::Unknown, NOON_US - 25 * HOUR_US)),
        Record::Event(EventRecord { at: UtcUs(NOON_US), ..event(mission::record::EventKind::Station, "x") }),
    ];
    store.apply(&batch(records)).await.unwrap();
    store.apply(&batch(heard(7))).await.unwrap();
    store.raise_witness(key(), Counter(101)).await.unwrap();
    drop(store);

    let store = reopen(&parent).await.unwrap();
    let unused = Key::from_bytes([8; 16]).id();
    let snapshot =
        store.snapshot(&[route().satellite, other_route().satellite], &[key(), unused]).await.unwrap();
    let ids = snapshot.last_ids;
    assert_eq!((ids.frame, ids.command, ids.image, ids.download), (7, 5, 2, 2));
    assert_eq!(snapshot.satellites.len(), 1, "the other satellite has left nothing");
    let left = &snapshot.satellites[0];
    assert_eq!(left.satellite, route().satellite);
    assert_eq!(left.last_tag, Some(sealed(3, 2, 101).tag));
    assert_eq!(left.commands.iter().map(|c| c.record.id.0).collect::<Vec<_>>(), [2, 3, 4]);
    assert_eq!(left.commands[0].record, command(2, long));
    assert_eq!((left.commands[0].stage, left.commands[0].attempt), (Stage::Queued, 0));
    assert!(left.commands[0].sealed.is_none());
    assert_eq!((left.commands[1].stage, left.commands[1].attempt), (Stage::Radiating, 2));
    assert_eq!(left.commands[1].stage_at, UtcUs(NOON_US + 2));
    let last = left.commands[1].sealed.as_ref().unwrap();
    assert_eq!(
        (last.key, last.counter, last.bytes[..].to_vec()),
        (key(), Counter(101), sealed(3, 2, 101).bytes.to_vec())
    );
    let image_left = left.image.as_ref().unwrap();
    assert_eq!(image_left.record, image(2, 1, 5));
    let chunks: Vec<_> = image_left.chunks.iter().map(|(index, data)| (*index, data[0])).collect();
    assert_eq!((chunks, image_left.conflicts.clone()), (vec![(0, 9), (4, 4)], vec![0]));
    assert_eq!(left.downloads, [download(2, Some(2), DownloadState::Active)]);
    assert_eq!(left.limits, [limit("heartbeat.temp", Level::Watch, Some(41.0))]);
    assert_eq!(left.heartbeat, Some((FrameId(7), UtcUs(NOON_US + 7_000_000), 7000)));
    assert_eq!(
        (snapshot.keys[0].counter, snapshot.keys[0].witness.clone()),
        (Some(Counter(101)), Witness::At(Counter(101)))
    );
    assert_eq!((snapshot.keys[1].counter, snapshot.keys[1].witness.clone()), (None, Witness::Missing));
}

both!(the_higher_of_sealed_frames_and_floors_counts);
async fn the_higher_of_sealed_frames_and_floors_counts(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let records = vec![
        Record::Command(command(1, Telecommand::Ping)),
        Record::Sealed(sealed(1, 1, 50)),
        Record::CounterFloor(floor(80)),
        Record::CounterFloor(floor(20)),
    ];
    store.apply(&batch(records)).await.unwrap();
    let snapshot = store.snapshot(&[], &[key()]).await.unwrap();
    assert_eq!(snapshot.keys[0].counter, Some(Counter(80)));
}

both!(a_damaged_witness_is_told_as_such);
async fn a_damaged_witness_is_told_as_such(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    std::fs::write(store.witness().file(key()), "pixelsat-witness-1 key=").unwrap();
    let snapshot = store.snapshot(&[], &[key()]).await.unwrap();
    assert!(matches!(snapshot.keys[0].witness, Witness::Damaged(_)));
}
