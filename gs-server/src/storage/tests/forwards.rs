//! What is passed on: each reception once for each target, whatever comes in between.

use std::sync::Arc;

use mission::reception::{Content, Doubts, Ear, RadioCrc, Receiver, Reception, Signal, TimeBasis, Trim};
use mission::record::{FrameRecord, OutsideRecord, ReceptionRecord, Record, Source};
use mission::{Principal, UtcUs};
use protocol::Downlink;

use super::super::{During, ForwardQuery, ForwardRow, ForwardState, ForwardWish, Page, Store};
use super::records::*;
use super::{DATABASE, Home as _, Kind, fresh, reopen};

fn wish(target: &str) -> ForwardWish {
    ForwardWish {
        target: target.into(),
        satellites: Vec::new(),
        own_boards: true,
        receiver: "HB9XYZ".into(),
        since_us: None,
        dry: false,
    }
}

fn frame(id: u64) -> FrameRecord {
    frame_of(id, &Downlink::Heartbeat(heartbeat(id)), &route())
}

fn by_radio(id: u64, source: Source) -> Vec<Record> {
    let frame = frame(id);
    vec![
        Record::Reception(ReceptionRecord { source, rssi_dbm: Some(-101), ..reception_of(&frame) }),
        Record::Frame(frame),
    ]
}

/// A report of a frame that is there.
fn by_others(id: u64, ear: Ear, receiver: &str) -> Record {
    let frame = frame(id);
    let reception = Reception {
        ear,
        source_id: format!("report {id}"),
        receiver: Receiver {
            id: Some(receiver.into()),
            name: None,
            latitude_deg: Some(-33.9),
            longitude_deg: Some(18.4),
            altitude_m: None,
        },
        received_at: frame.heard_at,
        time_basis: TimeBasis::Arrival,
        time_error_us: None,
        signal: Signal::default(),
        radio_crc: RadioCrc::Right,
        noisy: false,
        label: None,
        norad: None,
        content: Content::Frame { bytes: frame.bytes.clone(), trim: Trim::default() },
        doubts: Doubts::default(),
        original: None,
    };
    Record::Outside(Box::new(OutsideRecord {
        satellite: frame.route.satellite,
        station: frame.route.station,
        frame: Some(frame.id),
        reception: Arc::new(reception),
        taken_at: UtcUs(NOON_US),
    }))
}

async fn take_up(store: &Store, wish: &ForwardWish) -> usize {
    let mut place = store.forward_target(&wish.target, wish.since_us.is_some()).await.unwrap();
    store.take_up_forwards(&mut place, wish, UtcUs(NOON_US)).await.unwrap()
}

async fn rows(store: &Store) -> Vec<ForwardRow> {
    let mut rows = store.forwards(&ForwardQuery::default()).await.unwrap();
    rows.reverse();
    rows
}

both!(each_reception_is_taken_up_once_for_each_target);
async fn each_reception_is_taken_up_once_for_each_target(kind: Kind) {
    let (place, store) = fresh(kind).await;
    store.apply(&batch(by_radio(1, Source::Radio))).await.unwrap();
    // What was there before the target was is not for it.
    assert_eq!(take_up(&store, &wish("late")).await, 0);
    for id in 2..5 {
        store.apply(&batch(by_radio(id, Source::Radio))).await.unwrap();
    }
    store.apply(&batch(by_radio(5, Source::File))).await.unwrap();
    let boards = [
        by_others(2, Ear::OwnMqtt, "roof-board"),
        by_others(3, Ear::TinygsApi, "stranger"),
        by_others(4, Ear::OwnMqtt, "roof-board"),
    ];
    store.apply(&batch(boards.to_vec())).await.unwrap();
    assert_eq!(take_up(&store, &wish("late")).await, 4 + 3);
    assert_eq!(take_up(&store, &wish("late")).await, 0);
    let late = rows(&store).await;
    let told: Vec<_> =
        late.iter().map(|row| (row.frame, row.receiver.as_str(), row.source.as_str())).collect();
    let (ours, board) = ("HB9XYZ", "roof-board");
    assert_eq!(
        told,
        [
            (2, ours, "radio"),
            (3, ours, "radio"),
            (4, ours, "radio"),
            (2, board, "own-mqtt"),
            (4, board, "own-mqtt")
        ],
        "neither what was replayed nor what strangers heard"
    );
    // Of the same radio's second reception of a frame nobody hears twice.
    let again = ReceptionRecord { frame: mission::FrameId(2), ..reception_of(&frame(2)) };
    store.apply(&batch(vec![Record::Reception(again)])).await.unwrap();
    assert_eq!(take_up(&store, &wish("late")).await, 1);
    assert_eq!(rows(&store).await.len(), late.len());

    // Another target has a place of its own, and asks for all since a time.
    let since_us = Some(NOON_US + 3_000_000);
    let other = ForwardWish { since_us, own_boards: false, dry: true, ..wish("other") };
    assert!(take_up(&store, &other).await > 0);
    store.close().await.unwrap();
    drop(store);
    let store = reopen(&place).await.unwrap();
    assert_eq!((take_up(&store, &wish("late")).await, take_up(&store, &other).await), (0, 0));
    let query = ForwardQuery { target: Some("other".into()), ..ForwardQuery::default() };
    let dry = store.forwards(&query).await.unwrap();
    assert_eq!(
        dry.iter().map(|row| (row.frame, row.state.as_str())).collect::<Vec<_>>(),
        [(4, "dry"), (3, "dry")]
    );
    let mut ids: Vec<_> = rows(&store).await.into_iter().map(|row| row.message_id).collect();
    ids.sort();
    ids.dedup();
    assert_eq!(ids.len(), 7, "no two have one number");
    // What a far end may be told of a board's reception.
    let subject = store.forward_subject(&late[3]).await.unwrap();
    assert_eq!(subject.outside.unwrap().latitude_deg, Some(-33.9));
    assert_eq!(store.forward_subject(&late[0]).await.unwrap().rssi_dbm, Some(-101.0));
}

/// A restored archive does not know what its server sent after the backup.
#[tokio::test]
async fn what_waited_in_a_backup_counts_as_on_its_way() {
    let (place, store) = fresh(Kind::Lite).await;
    store.apply(&batch([by_radio(1, Source::Radio), by_radio(2, Source::Radio)].concat())).await.unwrap();
    assert_eq!(take_up(&store, &ForwardWish { since_us: Some(0), ..wish("db") }).await, 2);
    let sent = ForwardRow { state: "sent".into(), ..rows(&store).await.remove(1) };
    store.keep_forward(&sent).await.unwrap();
    store.apply(&batch(by_radio(3, Source::Radio))).await.unwrap();
    store.close().await.unwrap();
    drop(store);
    // Heard just before the backup, and not taken up yet: it may have gone out as well.
    super::super::doubt_forwards(&place.folder().join(DATABASE)).await.unwrap();
    let store = reopen(&place).await.unwrap();
    let states: Vec<_> = rows(&store).await.into_iter().map(|row| row.state).collect();
    assert_eq!(states, ["sending", "sent"]);
    assert_eq!(take_up(&store, &wish("db")).await, 0, "frame 3 stays here");
}

both!(a_pause_lasts_and_only_what_is_open_is_sent_again);
async fn a_pause_lasts_and_only_what_is_open_is_sent_again(kind: Kind) {
    let (place, store) = fresh(kind).await;
    let who = Principal::new("anna");
    let target = store.forward_target("db", true).await.unwrap();
    assert!(store.pause_forwards(&target, true, &who, UtcUs(NOON_US)).await.unwrap());
    assert!(!store.pause_forwards(&target, true, &who, UtcUs(NOON_US)).await.unwrap(), "it was");
    store.apply(&batch(by_radio(1, Source::Radio))).await.unwrap();
    // The place moves, the pause stays.
    assert_eq!(take_up(&store, &wish("db")).await, 1);
    store.close().await.unwrap();
    drop(store);
    let store = reopen(&place).await.unwrap();
    let target = store.find_forward_target("db").await.unwrap().unwrap();
    assert_eq!((target.paused_by.as_deref(), target.paused_at_us), (Some("anna"), Some(NOON_US)));
    assert!(store.pause_forwards(&target, false, &who, UtcUs(NOON_US)).await.unwrap());

    let row = rows(&store).await.remove(0);
    for state in ForwardState::ALL {
        store.keep_forward(&ForwardRow { state: state.name().into(), ..row.clone() }).await.unwrap();
        let again = store.retry_forward(row.id, &who, UtcUs(NOON_US)).await.unwrap();
        let may = matches!(state, ForwardState::Unknown | ForwardState::Refused | ForwardState::Dry);
        assert_eq!(again.map(|row| row.state), may.then(|| "waiting".to_owned()), "{state:?}");
    }
    let counts = store.forward_counts("db").await.unwrap();
    assert_eq!(counts.states, [("waiting".to_owned(), 1)].into());
    let audit = store.audit(&During::default(), &Page::default()).await.unwrap();
    let acts: Vec<_> = audit.iter().map(|row| row.action.as_str()).collect();
    assert_eq!(acts, ["forward.retry", "forward.retry", "forward.retry", "forward.resume", "forward.pause"]);
}
