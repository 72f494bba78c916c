//! Several servers on one PostgreSQL: numbers, leases, claims, and answers that were lost.

use mission::record::{EventKind, Record};
use mission::{Principal, Stage, StationId};
use protocol::Telecommand;

use super::super::*;
use super::records::*;
use super::{Home as _, Kind, Place, options};

/// Another station on the same database, with a folder of its own.
async fn beside(place: &Place, name: &str) -> (tempfile::TempDir, Store) {
    let parent = tempfile::tempdir().unwrap();
    let station = Some(StationId::new(name).unwrap());
    let options = StoreOptions { folder: parent.folder(), station, ..options(place) };
    (parent, Store::open(options).await.unwrap())
}

async fn two() -> (Place, [Store; 2], tempfile::TempDir) {
    let place = Place::new(Kind::Pg);
    let first = Store::open(options(&place)).await.unwrap();
    let (parent, second) = beside(&place, "tromso").await;
    (place, [first, second], parent)
}

#[tokio::test]
async fn stations_give_ids_of_their_own_and_one_sequence_of_events() {
    let (_place, [a, b], _parent) = two().await;
    let last = b.snapshot(&[], &[]).await.unwrap().last_ids;
    assert_eq!((last.frame, last.command, last.run), (1 << 40, 1 << 40, 1 << 40));
    let mut places = Vec::new();
    for round in 1..=10 {
        places.extend(a.apply(&batch(heard(round))).await.unwrap());
        places.extend(b.apply(&batch(heard((1 << 40) + round))).await.unwrap());
    }
    let places: Vec<i64> = places.iter().map(|event| event.sequence).collect();
    assert_eq!(places, (1..=40).collect::<Vec<_>>());
    assert_eq!(a.snapshot(&[], &[]).await.unwrap().last_ids.frame, 10);
    assert_eq!(b.snapshot(&[], &[]).await.unwrap().last_ids.frame, (1 << 40) + 10);
    assert_eq!(a.counts().await.unwrap().frames, 20);
    let report = b.redecode(|_| {}).await.unwrap();
    assert_eq!((report.frames, report.unchanged, report.damaged), (20, 20 * 29, 0), "{report:?}");
}

#[tokio::test]
async fn a_restart_goes_on_with_what_is_ours_alone() {
    let (_place, [a, b], _parent) = two().await;
    let records = vec![
        Record::Command(command(1, Telecommand::Ping)),
        Record::Stage(stage(1, 0, Stage::Queued, NOON_US)),
    ];
    a.apply(&batch(records)).await.unwrap();
    let satellites = [route().satellite];
    let commands = |snapshot: mission::Snapshot| -> usize {
        snapshot.satellites.iter().map(|left| left.commands.len()).sum()
    };
    assert_eq!(commands(a.snapshot(&satellites, &[]).await.unwrap()), 1);
    assert_eq!(commands(b.snapshot(&satellites, &[]).await.unwrap()), 0);
}

#[tokio::test]
async fn a_batch_whose_answer_was_lost_is_known_when_it_comes_again() {
    let (_place, [a, b], _parent) = two().await;
    let again = batch(heard(1));
    let first = a.apply(&again).await.unwrap();
    b.apply(&batch(heard((1 << 40) + 1))).await.unwrap();
    assert_eq!(a.apply(&again).await.unwrap(), first, "the same events at the same places");
    assert_eq!(a.counts().await.unwrap().frames, 2);
    a.apply(&batch(heard(2))).await.unwrap();
    assert_eq!(a.counts().await.unwrap().events, 6);
}

#[tokio::test]
async fn a_server_that_was_replaced_stores_nothing_any_more() {
    let (place, [a, _b], _parent) = two().await;
    place.meddle("update stations set life = 'another' where number = 0").await.unwrap();
    let error = a.apply(&batch(heard(1))).await.unwrap_err();
    assert!(matches!(error, StoreError::Replaced), "{error:?}");
    assert_eq!(a.counts().await.unwrap().frames, 0);
}

#[tokio::test]
async fn a_second_server_of_one_station_is_refused_while_the_first_works() {
    let place = Place::new(Kind::Pg);
    let first = Store::open(options(&place)).await.unwrap();
    let parent = tempfile::tempdir().unwrap();
    let same = StoreOptions { folder: parent.folder(), ..options(&place) };
    let error = Store::open(same.clone()).await.unwrap_err();
    assert!(matches!(error, StoreError::StationTaken), "{error:?}");
    first.apply(&batch(heard(1))).await.unwrap();
    first.close().await.unwrap();
    drop(first);
    let second = Store::open(same).await.unwrap();
    assert_eq!(second.snapshot(&[], &[]).await.unwrap().last_ids.frame, 1, "the same number");
}

#[tokio::test]
async fn connections_that_are_cut_come_back() {
    let (place, [a, _b], _parent) = two().await;
    a.apply(&batch(heard(1))).await.unwrap();
    place
        .meddle("select pg_terminate_backend(pid) from pg_stat_activity where datname = current_database() and pid <> pg_backend_pid()")
        .await
        .unwrap();
    let next = batch(heard(2));
    let mut tries = 0;
    while let Err(error) = a.apply(&next).await {
        assert!(error.is_temporary() || matches!(error, StoreError::StationTaken), "{error:?}");
        tries += 1;
        assert!(tries < 20, "{error:?}");
    }
    assert_eq!(a.counts().await.unwrap().frames, 2);
}

fn sealing(station: u64, id: u64, counter: u64) -> mission::Batch {
    let id = (station << 40) + id;
    batch(vec![Record::Command(command(id, Telecommand::Ping)), Record::Sealed(sealed(id, 1, counter))])
}

#[tokio::test]
async fn a_key_is_used_by_one_server_at_a_time() {
    let (place, [a, b], _parent) = two().await;
    assert!(matches!(a.lease(key(), true).await.unwrap(), Some(Leased::Ours { spent: None, .. })));
    let Some(Leased::Other { station, .. }) = b.lease(key(), true).await.unwrap() else {
        panic!("two hold it");
    };
    assert_eq!(station, "oslo");
    a.apply(&sealing(0, 1, 5)).await.unwrap();
    let error = b.apply(&sealing(1, 1, 6)).await.unwrap_err();
    assert!(matches!(error, StoreError::Leased { .. }) && error.is_temporary(), "{error:?}");
    assert!(error.to_string().contains("is used by station oslo until 20"), "{error}");
    assert_eq!(b.counts().await.unwrap().commands, 1, "nothing of it is stored");

    assert_eq!(a.lease(key(), false).await.unwrap(), Some(Leased::Free));
    let Some(Leased::Ours { spent, .. }) = b.lease(key(), true).await.unwrap() else { panic!("it is free") };
    assert_eq!(spent, Some(protocol::Counter(5)), "what others spent is told");
    // It is marked as radiating only by who holds the lease.
    let mark = batch(vec![Record::Stage(stage(1, 1, Stage::Radiating, NOON_US))]);
    assert!(matches!(a.apply(&mark).await.unwrap_err(), StoreError::Leased { .. }));
    // A lease that nobody renewed can be taken; the one who had it finds out at its next frame.
    place.meddle("update leases set until_us = 1").await.unwrap();
    a.apply(&mark).await.unwrap();
    assert!(matches!(b.apply(&sealing(1, 2, 7)).await.unwrap_err(), StoreError::Leased { .. }));
    assert_eq!(a.lease(key(), false).await.unwrap(), Some(Leased::Free));
}

#[tokio::test]
async fn an_intent_is_taken_by_one_server() {
    let (place, [a, b], _parent) = two().await;
    let ada = Principal::new("ada");
    assert_eq!(a.find_or_claim_intent(&ada, "once").await.unwrap(), None);
    assert_eq!(a.find_or_claim_intent(&ada, "once").await.unwrap(), None, "it is ours");
    let error = b.find_or_claim_intent(&ada, "once").await.unwrap_err();
    assert!(matches!(error, StoreError::Claimed), "{error:?}");
    a.apply(&batch(vec![Record::Intent(receipt("once", mission::Accepted::Done))])).await.unwrap();
    assert!(b.find_or_claim_intent(&ada, "once").await.unwrap().is_some());

    assert_eq!(a.find_or_claim_intent(&ada, "twice").await.unwrap(), None);
    place.meddle("update stations set life = 'gone' where number = 0").await.unwrap();
    assert_eq!(b.find_or_claim_intent(&ada, "twice").await.unwrap(), None, "its life is over");
}

/// Also when it never comes back; and if it does, it stores nothing of what it had under way.
#[tokio::test]
async fn what_a_dead_server_had_under_way_is_taken_after_the_time_of_a_lease() {
    let (place, [a, b], _parent) = two().await;
    let ada = Principal::new("ada");
    assert_eq!(a.find_or_claim_intent(&ada, "once").await.unwrap(), None);
    place
        .meddle("select pg_terminate_backend(pid) from pg_stat_activity where datname = current_database() and application_name = 'gs-server writer'")
        .await
        .unwrap();
    let claim = async || loop {
        // Its own connection was cut, too.
        match b.find_or_claim_intent(&ada, "once").await {
            Err(StoreError::Claimed) => break Err(()),
            Ok(found) => break Ok(found),
            Err(error) => {
                assert!(error.is_temporary() || matches!(error, StoreError::StationTaken), "{error:?}")
            }
        }
    };
    assert_eq!(claim().await, Err(()), "it has just gone away");
    assert_eq!(claim().await, Err(()), "it has just gone away");
    b.0.writer.lock().await.shared().unwrap().wait_out();
    assert_eq!(claim().await, Ok(None), "it is ours");
    // Now it is back.
    let mut tries = 0;
    let error = loop {
        match a.apply(&batch(vec![Record::Intent(receipt("once", mission::Accepted::Done))])).await {
            Err(error) if error.is_temporary() && tries < 20 => tries += 1,
            other => break other.unwrap_err(),
        }
    };
    assert!(matches!(error, StoreError::Replaced), "{error:?}");
    b.apply(&batch(vec![Record::Intent(receipt("once", mission::Accepted::Done))])).await.unwrap();
}

/// Both want the same key at the same moment, a thousand times: one gets it, and seals.
#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_races_for_a_key_have_one_winner_each() {
    const RACES: u64 = 1_000;
    let (_place, [a, b], _parent) = two().await;
    let mut wins = [0_u64; 2];
    for race in 1..=RACES {
        let (one, two) = (sealing(0, race, 2 * race), sealing(1, race, 2 * race + 1));
        let (first, second) = (a.clone(), b.clone());
        let (left, right) = tokio::join!(
            tokio::spawn(async move { first.apply(&one).await }),
            tokio::spawn(async move { second.apply(&two).await }),
        );
        let results = [left.unwrap(), right.unwrap()];
        let lost = results.iter().filter(|result| matches!(result, Err(StoreError::Leased { .. }))).count();
        assert_eq!((results.iter().filter(|r| r.is_ok()).count(), lost), (1, 1), "race {race}: {results:?}");
        let winner = usize::from(results[1].is_ok());
        wins[winner] += 1;
        let store = [&a, &b][winner];
        assert_eq!(store.lease(key(), false).await.unwrap(), Some(Leased::Free));
    }
    let counts = a.counts().await.unwrap();
    assert_eq!((counts.sealed_frames, counts.commands), (RACES.cast_signed(), RACES.cast_signed()));
    println!("{RACES} races, won {wins:?}");
}

#[tokio::test]
async fn what_another_server_commits_is_told() {
    let (_place, [a, b], _parent) = two().await;
    let mut others = a.others(0).await.unwrap().unwrap();
    a.apply(&batch(vec![Record::Event(event(EventKind::Station, "ours"))])).await.unwrap();
    b.apply(&batch(vec![Record::Event(event(EventKind::Station, "theirs"))])).await.unwrap();
    others.wait().await.unwrap();
    let told = others.read().await.unwrap();
    assert_eq!(told.last().unwrap().record.message, "theirs");
    assert_eq!(others.place(), 2);
}

#[tokio::test]
async fn what_is_stored_does_not_come_back_from_the_reserve() {
    let (_place, [a, _b], _parent) = two().await;
    a.apply(&batch(heard(1))).await.unwrap();
    let stored = a.frame(1).await.unwrap().unwrap().frame;
    let kept = |received_at_us: i64| mission::ReservedFrame {
        route: route(),
        source: mission::Source::Radio,
        received_at: mission::UtcUs(received_at_us),
        rssi_dbm: None,
        bytes: stored.bytes.clone().into(),
    };
    let frames = vec![kept(stored.heard_at_us), kept(stored.heard_at_us + 1)];
    let missing = a.not_yet_stored(frames).await.unwrap();
    assert_eq!(missing, [kept(stored.heard_at_us + 1)]);
}

#[test]
fn an_address_with_a_password_is_refused() {
    for bad in ["postgres://ada:secret@host/db", "postgres://host/db?password=secret", "mysql://host/db", "x"]
    {
        let problem = Postgres::new(bad).unwrap_err();
        assert!(!problem.contains("secret"), "{problem}");
    }
    assert!(Postgres::new("postgresql://ada@host:5433/db?sslmode=verify-full").is_ok());
}
