//! Every kind of record is written, and read back through the questions that others ask.

use mission::record::{DownloadState, EventKind, EventRecord, ReceptionRssi, Record, Subject};
use mission::{Accepted, CommandId, DownloadId, ImageId, Level, Principal, Stage, UtcUs};
use protocol::{Downlink, Telecommand};

use super::super::*;
use super::records::*;
use super::{Kind, fresh, reopen};

both!(a_heard_frame_is_read_back_with_who_heard_it);
async fn a_heard_frame_is_read_back_with_who_heard_it(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let packet = Downlink::Heartbeat(heartbeat(1));
    let frame = frame_of(1, &packet, &route());
    let first = reception_of(&frame);
    let second = mission::record::ReceptionRecord {
        route: other_route(),
        source: mission::Source::File,
        rssi_dbm: Some(-97),
        ..first.clone()
    };
    let level =
        ReceptionRssi { frame: frame.id, route: route(), received_at: first.received_at, rssi_dbm: -104 };
    let records = vec![
        Record::Frame(frame.clone()),
        Record::Reception(first),
        Record::Reception(second),
        Record::ReceptionRssi(level),
    ];
    assert_eq!(store.apply(&batch(records)).await.unwrap(), []);
    let read = store.frame(1).await.unwrap().unwrap();
    assert_eq!(read.frame.bytes, frame.bytes.to_vec());
    assert_eq!(
        (read.frame.form.as_str(), read.frame.packet_type, read.frame.tag),
        ("short", Some(6), Some(1))
    );
    assert_eq!((read.frame.heard_at_us, read.frame.nested), (NOON_US + 1_000_000, false));
    let who: Vec<_> = read
        .receptions
        .iter()
        .map(|r| (r.station.as_str(), r.source().unwrap().name(), r.rssi_dbm))
        .collect();
    assert_eq!(who, [("oslo", "radio", Some(-104)), ("tromso", "file", Some(-97))]);
    assert_eq!(store.frames(&FrameQuery::default()).await.unwrap(), [read]);
    assert_eq!(store.frame(2).await.unwrap(), None);
}

both!(a_frame_inside_what_was_no_frame_counts_after_all);
async fn a_frame_inside_what_was_no_frame_counts_after_all(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let frame = frame_of(1, &Downlink::Heartbeat(heartbeat(1)), &route());
    let nested = mission::record::FrameRecord { nested: true, ..frame.clone() };
    store.apply(&batch(vec![Record::Frame(nested)])).await.unwrap();
    assert!(store.frame(1).await.unwrap().unwrap().frame.nested);
    let later =
        mission::record::FrameRecord { heard_at: UtcUs(NOON_US + 9), route: other_route(), ..frame.clone() };
    store.apply(&batch(vec![Record::Frame(later)])).await.unwrap();
    let read = store.frame(1).await.unwrap().unwrap().frame;
    assert!(!read.nested);
    assert_eq!((read.heard_at_us, read.station.as_str()), (frame.heard_at.0, "oslo"), "nothing else changes");
}

both!(frames_come_in_pages_both_ways_and_by_scope_and_type);
async fn frames_come_in_pages_both_ways_and_by_scope_and_type(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    for id in 1..=250 {
        let (packet, route) = if id % 50 == 0 {
            (Downlink::Pong, other_route())
        } else {
            (Downlink::Heartbeat(heartbeat(id)), route())
        };
        let frame = frame_of(id, &packet, &route);
        let reception = reception_of(&frame);
        store.apply(&batch(vec![Record::Frame(frame), Record::Reception(reception)])).await.unwrap();
    }
    let ids = async |query: FrameQuery| -> Vec<i64> {
        let frames = store.frames(&query).await.unwrap();
        assert!(frames.iter().all(|heard| heard.receptions.len() == 1));
        frames.iter().map(|heard| heard.frame.id).collect()
    };
    let page =
        |after, before, limit| FrameQuery { page: Page { after, before, limit }, ..FrameQuery::default() };
    assert_eq!(ids(FrameQuery::default()).await, (151..=250).rev().collect::<Vec<_>>());
    assert_eq!(ids(page(None, Some(151), 3)).await, [150, 149, 148]);
    assert_eq!(ids(page(Some(10), None, 3)).await, [11, 12, 13]);
    assert_eq!(ids(page(Some(10), Some(12), 3)).await, [11]);
    assert_eq!(ids(page(None, None, u32::MAX)).await.len(), 250);
    assert_eq!(
        ids(FrameQuery { packet_type: Some(0), ..page(None, None, 0) }).await,
        [250, 200, 150, 100, 50]
    );
    let scope = Scope { station: Some("tromso".into()), ..Scope::default() };
    assert_eq!(ids(FrameQuery { scope, ..page(Some(0), None, 2) }).await, [50, 100]);
    let scope = Scope { satellite: Some("' or true --".into()), ..Scope::default() };
    assert_eq!(ids(FrameQuery { scope, ..FrameQuery::default() }).await, [0; 0]);
}

both!(a_command_is_read_back_with_its_life);
async fn a_command_is_read_back_with_its_life(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    let telecommand = Telecommand::GetImageChunk { first: 3, count: 9 };
    let records = vec![
        Record::Stage(stage(1, 0, Stage::Queued, NOON_US)),
        Record::Command(mission::record::CommandRecord {
            download: Some(DownloadId(1)),
            ..command(1, telecommand.clone())
        }),
        Record::Download(download(1, None, DownloadState::Active)),
        Record::Stage(stage(1, 1, Stage::Sealed, NOON_US + 1)),
        Record::Sealed(sealed(1, 1, 77)),
        Record::Command(command(2, Telecommand::Ping)),
        Record::Stage(stage(2, 0, Stage::Queued, NOON_US)),
    ];
    store.apply(&batch(records)).await.unwrap();
    store.close().await.unwrap();
    drop(store);
    let store = reopen(&parent).await.unwrap();
    let late = batch(vec![Record::Stage(stage(2, 0, Stage::Cancelled, NOON_US + 2))]);
    store.apply(&late).await.unwrap();
    let cancelled = store.command(2).await.unwrap().unwrap();
    let life = store.command(1).await.unwrap().unwrap();
    for stage in life.stages.iter().chain(&cancelled.stages) {
        let found = [&stage.satellite, &stage.station, &stage.link, &stage.key];
        assert_eq!(found, ["pixelsat-1", "oslo", route().link.as_str(), &key().to_string()]);
    }
    assert_eq!(life.command.telecommand().unwrap(), telecommand);
    assert_eq!((life.command.name.as_str(), life.command.download), ("GetImageChunk", Some(1)));
    assert_eq!((life.command.gate.as_str(), life.command.priority), ("heard", -3));
    assert_eq!((life.command.key.clone(), life.command.attempts_allowed), (key().to_string(), 5));
    let stages: Vec<_> = life.stages.iter().map(|s| (s.stage.as_str(), s.attempt, s.why.as_str())).collect();
    assert_eq!(stages, [("queued", 0, "it is queued now"), ("sealed", 1, "it is sealed now")]);
    assert_eq!(
        (life.sealed[0].counter, life.sealed[0].bytes.len(), life.sealed[0].nonce.len()),
        (77, 240, 12)
    );

    let now = |list: Vec<CommandNow>| -> Vec<(i64, String)> {
        list.into_iter().map(|now| (now.command.id, now.last.unwrap().stage)).collect()
    };
    let everything = now(store.commands(&CommandQuery::default()).await.unwrap());
    assert_eq!(everything, [(2, "cancelled".into()), (1, "sealed".into())]);
    let query = CommandQuery { stage: Some(Stage::Sealed), ..CommandQuery::default() };
    assert_eq!(now(store.commands(&query).await.unwrap()), [(1, "sealed".into())]);
    let query = CommandQuery { key: Some("00000000".into()), ..CommandQuery::default() };
    assert_eq!(now(store.commands(&query).await.unwrap()), []);
    assert_eq!(store.command(3).await.unwrap(), None);
}

both!(an_image_grows_and_is_cut_at_its_size);
async fn an_image_grows_and_is_cut_at_its_size(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let frames = (1..=9).map(|id| Record::Frame(frame_of(id, &Downlink::Pong, &route())));
    let mut records: Vec<Record> = frames.collect();
    records.push(Record::Image(image(1, 1, 4)));
    for (index, frame) in [(0, 2), (1, 3), (3, 4)] {
        records.push(Record::Chunk(chunk(1, index, frame, index as u8 + 1, false)));
    }
    records.push(Record::Chunk(chunk(1, 1, 5, 0xee, true)));
    records.push(Record::Image(mission::record::ImageRecord { held: 3, conflicts: 1, ..image(1, 1, 4) }));
    store.apply(&batch(records)).await.unwrap();

    let map = store.image(1).await.unwrap().unwrap();
    assert_eq!((map.image.held, map.image.conflicts, map.image.width_px), (3, 1, 640));
    let held: Vec<_> =
        map.chunks.iter().map(|chunk| (chunk.index, chunk.frame, chunk.conflicts.clone())).collect();
    assert_eq!(held, [(0, Some(2), vec![]), (1, Some(3), vec![5]), (2, None, vec![]), (3, Some(4), vec![])]);
    let bytes = store.image_bytes(1).await.unwrap().unwrap();
    assert_eq!((bytes.bytes.len(), bytes.contiguous, bytes.complete), (4 * 222 - 100, 444, false));
    assert_eq!((bytes.bytes[0], bytes.bytes[222], bytes.bytes[444], bytes.bytes[666]), (1, 2, 0, 4));

    let done = mission::record::ImageRecord {
        held: 4,
        conflicts: 1,
        completed_at: Some(UtcUs(NOON_US + 5)),
        sha256: Some([3; 32]),
        ..image(1, 1, 4)
    };
    store.apply(&batch(vec![Record::Chunk(chunk(1, 2, 6, 3, false)), Record::Image(done)])).await.unwrap();
    let bytes = store.image_bytes(1).await.unwrap().unwrap();
    assert_eq!((bytes.contiguous, bytes.complete), (4 * 222 - 100, true));
    let images = store.images(&Scope::default(), &Page::default()).await.unwrap();
    assert_eq!((images.len(), images[0].sha256.clone()), (1, Some(vec![3; 32])));
    assert_eq!(store.image_bytes(2).await.unwrap(), None);
}

both!(downloads_limits_audit_and_intents_are_read_back);
async fn downloads_limits_audit_and_intents_are_read_back(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let records = vec![
        Record::Frame(frame_of(1, &Downlink::Pong, &route())),
        Record::Image(image(1, 1, 4)),
        Record::Download(download(1, None, DownloadState::Active)),
        Record::Download(download(1, Some(1), DownloadState::Complete)),
        Record::Limit(limit("heartbeat.temp", Level::Watch, Some(41.0))),
        Record::Limit(limit("heartbeat.temp", Level::Severe, Some(61.5))),
        Record::Limit(limit("heartbeat.rad", Level::Normal, None)),
        Record::Audit(audit("command.create")),
        Record::Audit(audit("command.cancel")),
        Record::CounterFloor(floor(5)),
    ];
    store.apply(&batch(records)).await.unwrap();
    let download = store.download(1).await.unwrap().unwrap();
    assert_eq!((download.state.as_str(), download.image, download.chunks_bridged), ("complete", Some(1), 1));
    assert_eq!(store.downloads(&Scope::default(), &Page::default()).await.unwrap(), [download]);
    let limits = store.limits().await.unwrap();
    let limits: Vec<_> = limits.iter().map(|l| (l.parameter.as_str(), l.level.as_str(), l.value)).collect();
    assert_eq!(limits, [("heartbeat.rad", "normal", None), ("heartbeat.temp", "severe", Some(61.5))]);
    let audit = store.audit(&During::default(), &Page::default()).await.unwrap();
    let audit: Vec<_> = audit.iter().map(|row| (row.id, row.station.as_str(), row.action.as_str())).collect();
    assert_eq!(audit, [(2, "oslo", "command.cancel"), (1, "oslo", "command.create")]);

    let all = [
        Accepted::Command(CommandId(1)),
        Accepted::Cancelled(CommandId(2)),
        Accepted::Download(DownloadId(3)),
        Accepted::DownloadCancelled(DownloadId(4)),
        Accepted::Done,
    ];
    for (number, accepted) in all.into_iter().enumerate() {
        let record = Record::Intent(receipt(&number.to_string(), accepted.clone()));
        store.apply(&batch(vec![record])).await.unwrap();
        let found = store.find_intent(&Principal::new("ada"), &number.to_string()).await.unwrap();
        assert_eq!(found, Some(StoredIntent { digest: [9; 32], accepted }));
    }
    assert_eq!(store.find_intent(&Principal::new("eve"), "0").await.unwrap(), None);
}

both!(events_keep_their_place_and_everything_they_say);
async fn events_keep_their_place_and_everything_they_say(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    let full = EventRecord {
        level: Level::Distress,
        key: Some(key()),
        subject: Subject {
            frame: Some(mission::FrameId(1)),
            command: Some(CommandId(2)),
            image: Some(ImageId(3)),
            download: Some(DownloadId(4)),
        },
        ..event(EventKind::Sealing, "sealing with this key is locked")
    };
    let bare = EventRecord { satellite: None, link: None, ..event(EventKind::Station, "started") };
    let stored = store
        .apply(&batch(vec![
            Record::Event(full.clone()),
            Record::Audit(audit("x")),
            Record::Event(bare.clone()),
        ]))
        .await
        .unwrap();
    let expected = [StoredEvent { sequence: 1, record: full }, StoredEvent { sequence: 2, record: bare }];
    assert_eq!(stored, expected);
    drop(store);
    let store = reopen(&parent).await.unwrap();
    let rest = EventKind::ALL.map(|kind| Record::Event(event(kind, kind.name())));
    let stored = store.apply(&batch(rest.to_vec())).await.unwrap();
    let last = 2 + i64::try_from(EventKind::ALL.len()).unwrap();
    assert_eq!(stored.iter().map(|event| event.sequence).collect::<Vec<_>>(), (3..=last).collect::<Vec<_>>());
    assert_eq!(store.last_event_seq().await.unwrap(), last);

    let query = |page| EventQuery { page, ..EventQuery::default() };
    let all = store.events(&query(Page { after: Some(0), ..Page::default() })).await.unwrap();
    assert_eq!(all[..2], expected);
    assert_eq!(all[2..], stored);
    let newest = store.events(&query(Page { limit: 1, ..Page::default() })).await.unwrap();
    assert_eq!(newest, [stored[stored.len() - 1].clone()]);
    let grave = EventQuery { level: Level::Watch, ..EventQuery::default() };
    assert_eq!(store.events(&grave).await.unwrap(), [expected[0].clone()]);
    let of_key = EventQuery { key: Some(key().to_string()), ..EventQuery::default() };
    assert_eq!(store.events(&of_key).await.unwrap(), [expected[0].clone()]);
    let kinds = EventQuery { kinds: vec![EventKind::Station, EventKind::Limit], ..EventQuery::default() };
    let sequences: Vec<_> = store.events(&kinds).await.unwrap().iter().map(|event| event.sequence).collect();
    let place =
        |kind| 3 + i64::try_from(EventKind::ALL.iter().position(|other| *other == kind).unwrap()).unwrap();
    assert_eq!(sequences, [place(EventKind::Station), place(EventKind::Limit), 2]);
}

both!(everything_is_counted);
async fn everything_is_counted(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    store.apply(&batch(heard(1))).await.unwrap();
    let counts = store.counts().await.unwrap();
    assert_eq!(counts, Counts { frames: 1, receptions: 1, events: 2, ..Counts::default() });
}

/// How long a typical batch takes on this machine, for docs/storage.md.
#[tokio::test]
#[ignore = "a figure, not a check"]
async fn figure_latency_of_a_typical_batch() {
    let (_parent, store) = fresh(Kind::Lite).await;
    let mut micros = Vec::new();
    for id in 1..=1000 {
        let records = batch(heard(id));
        #[expect(clippy::disallowed_methods, reason = "a stopwatch on the real disk")]
        let begun = std::time::Instant::now();
        store.apply(&records).await.unwrap();
        micros.push(begun.elapsed().as_micros());
    }
    micros.sort_unstable();
    println!("apply: median {} us, 99 % {} us, worst {} us", micros[500], micros[990], micros[999]);
}
