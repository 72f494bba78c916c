//! Elements, and passes with what they used.

use std::sync::Arc;

use mission::record::{ElementsRecord, PassRecord, Record};
use mission::{ElementsId, PassId, Principal, SatelliteId, UtcUs};
use tle::formats::{Checksums, sets};
use tle::{Elements, UtcInstant};

use super::super::{Page, Scope, Store, StoreError};
use super::records::*;
use super::{Dice, Kind, fresh, reopen};

/// Every field that a message can have, and numbers without a short decimal form.
const OMM: &str = r#"[{"CCSDS_OMM_VERS":"3.0","COMMENT":"café \"quoted\"","CREATION_DATE":"2026-11-20T01:02:03.000004","ORIGINATOR":"18 SPCS",
  "OBJECT_NAME":"PIXELSAT-1","OBJECT_ID":"2026-123AB","CENTER_NAME":"EARTH","REF_FRAME":"TEME","TIME_SYSTEM":"UTC",
  "MEAN_ELEMENT_THEORY":"SGP4","EPOCH":"2026-11-20T11:33:20.123457","MEAN_MOTION":15.219999999999999,"ECCENTRICITY":0.00012345678901234567,
  "INCLINATION":97.50000000000001,"RA_OF_ASC_NODE":123.45678901234567,"ARG_OF_PERICENTER":0.1,"MEAN_ANOMALY":359.99999999999994,
  "EPHEMERIS_TYPE":0,"CLASSIFICATION_TYPE":"U","NORAD_CAT_ID":270000123,"ELEMENT_SET_NO":999,"REV_AT_EPOCH":1234,
  "BSTAR":0.00010270000000000001,"MEAN_MOTION_DOT":2.182e-05,"MEAN_MOTION_DDOT":1e-300}]"#;

fn omm() -> Elements {
    sets(OMM, Checksums::Strict).unwrap().next().unwrap().unwrap().elements
}

fn at(us: i64) -> UtcInstant {
    UtcInstant::from_unix_us(us)
}

fn elements(id: u64, satellite: &SatelliteId, set: Elements) -> Record {
    Record::Elements(ElementsRecord {
        id: ElementsId(id),
        satellite: satellite.clone(),
        station: route().station,
        source: "https://example.org/gp.php".to_owned(),
        added_at: UtcUs(NOON_US + id.cast_signed()),
        who: Principal::new("ada"),
        elements: Arc::new(set),
    })
}

pub(super) fn epoch(id: u64, epoch_us: i64) -> Record {
    elements(id, &route().satellite, Elements { epoch: at(epoch_us), ..omm() })
}

pub(super) fn pass(id: u64, used: &[(u64, i64)], ended_at: Option<i64>) -> PassRecord {
    PassRecord {
        id: PassId(id),
        satellite: route().satellite,
        station: route().station,
        aos_at: UtcUs(NOON_US + 1),
        tca_at: UtcUs(NOON_US + 300_000_001),
        los_at: Some(UtcUs(NOON_US + 600_000_003)),
        max_elevation_deg: 100.0 / 3.0,
        elements: used.iter().map(|(id, from_us)| (ElementsId(*id), UtcUs(*from_us))).collect(),
        ended_at: ended_at.map(UtcUs),
    }
}

fn everything() -> Page {
    Page { after: Some(0), limit: 1000, ..Page::default() }
}

/// All numbers of a set, bit for bit.
fn bits(set: &Elements) -> Vec<u64> {
    [
        set.mean_motion_rev_day,
        set.eccentricity,
        set.inclination_deg,
        set.raan_deg,
        set.arg_of_perigee_deg,
        set.mean_anomaly_deg,
        set.bstar,
        set.mean_motion_dot,
        set.mean_motion_ddot,
    ]
    .map(f64::to_bits)
    .to_vec()
}

both!(elements_come_back_bit_for_bit);
async fn elements_come_back_bit_for_bit(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    let mut dice = Dice(11);
    let mut given = vec![omm()];
    for _ in 0..40 {
        let mut number = |whole: f64| whole * (dice.below(1 << 53) as f64 / (1_u64 << 53) as f64);
        given.push(Elements {
            mean_motion_rev_day: 1.0 + number(15.0),
            eccentricity: number(0.7),
            inclination_deg: number(180.0),
            raan_deg: number(360.0),
            arg_of_perigee_deg: number(360.0),
            mean_anomaly_deg: number(360.0),
            bstar: number(1e-3) - 5e-4,
            mean_motion_dot: number(1e-4),
            name: None,
            norad_cat_id: None,
            epoch: at(NOON_US + number(1e12) as i64),
            ..omm()
        });
    }
    let records = given.iter().zip(1..).map(|(set, id)| elements(id, &route().satellite, set.clone()));
    store.apply(&batch(records.collect())).await.unwrap();
    store.close().await.unwrap();
    drop(store);

    let store = reopen(&parent).await.unwrap();
    let rows = store.elements(&Scope::default(), &everything()).await.unwrap();
    assert_eq!(rows.len(), given.len());
    for (row, set) in rows.iter().zip(&given) {
        let back = row.elements().unwrap();
        assert_eq!((&back, bits(&back)), (set, bits(set)), "{}", row.omm);
        assert_eq!(row.epoch_us, set.epoch.unix_us());
    }
    let first = store.element_set(1).await.unwrap().unwrap();
    assert_eq!((first.norad_cat_id, first.object_name.as_deref()), (Some(270_000_123), Some("PIXELSAT-1")));
    assert_eq!((first.who.as_str(), first.source.as_str()), ("ada", "https://example.org/gp.php"));
    assert_eq!(first.added_at_us, NOON_US + 1);
    assert_eq!(store.element_set(1000).await.unwrap(), None);
    let other = Scope { satellite: Some("pixelsat-2".to_owned()), ..Scope::default() };
    assert_eq!(store.elements(&other, &everything()).await.unwrap(), []);
}

both!(sets_of_a_window_are_those_that_tell_something_in_it);
async fn sets_of_a_window_are_those_that_tell_something_in_it(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    // Not in the order of their epochs; two of one epoch; one of somebody else.
    let mut records: Vec<Record> =
        [(1, 50), (2, 10), (3, 30), (4, 30), (5, 20)].map(|(id, us)| epoch(id, us)).into();
    records.push(elements(6, &other_route().satellite, Elements { epoch: at(25), ..omm() }));
    store.apply(&batch(records)).await.unwrap();
    let ids = async |from_us, until_us, limit| -> Vec<i64> {
        let satellite = route().satellite;
        let rows = store.elements_between(satellite.as_str(), (from_us, until_us), limit).await.unwrap();
        rows.iter().map(|row| row.id).collect()
    };
    assert_eq!(ids(25, 40, 100).await, [5, 3, 4], "the newest before, and those within");
    assert_eq!(ids(30, 30, 100).await, [3, 4], "at the instant itself");
    assert_eq!(ids(60, 90, 100).await, [1], "the newest before");
    assert_eq!(ids(0, 5, 100).await, [2], "none before: the nearest");
    assert_eq!(ids(0, 25, 100).await, [2, 5]);
    assert_eq!(ids(0, 90, 2).await, [4, 1], "the newest of too many");
    assert!(store.elements_between("nobody", (0, 90), 100).await.unwrap().is_empty());
}

both!(a_pass_is_brought_up_to_date_and_keeps_what_it_used);
async fn a_pass_is_brought_up_to_date_and_keeps_what_it_used(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    store.apply(&batch(vec![epoch(1, 10), epoch(2, 20)])).await.unwrap();
    store.apply(&batch(vec![Record::Pass(pass(1, &[(1, 100)], None))])).await.unwrap();
    let later = PassRecord {
        tca_at: UtcUs(NOON_US + 300_000_777),
        max_elevation_deg: 34.5,
        ..pass(1, &[(1, 100), (2, 200)], Some(NOON_US + 600_000_777))
    };
    store.apply(&batch(vec![Record::Pass(later.clone())])).await.unwrap();
    let rows = store.passes(&Scope::default(), &everything()).await.unwrap();
    assert_eq!(rows.len(), 1);
    assert_eq!((rows[0].tca_at_us, rows[0].max_elevation_deg), (later.tca_at.0, 34.5));
    assert_eq!(
        (rows[0].los_at_us, rows[0].ended_at_us),
        (Some(NOON_US + 600_000_003), Some(NOON_US + 600_000_777))
    );
    let used = store.pass_elements(1).await.unwrap();
    assert_eq!(used.iter().map(|u| (u.elements, u.from_us)).collect::<Vec<_>>(), [(1, 100), (2, 200)]);
    // A pass that names elements nobody has is refused as a whole.
    let error = store.apply(&batch(vec![Record::Pass(pass(2, &[(9, 1)], None))])).await.unwrap_err();
    assert!(matches!(error, StoreError::Conflict(_)), "{error:?}");
    assert_eq!(store.passes(&Scope::default(), &everything()).await.unwrap().len(), 1);
}

async fn one_of_each(store: &Store) {
    let records = vec![epoch(1, 10), Record::Pass(pass(1, &[(1, 100)], None))];
    store.apply(&batch(records)).await.unwrap();
}

both!(elements_passes_and_what_they_used_are_not_rewritten);
async fn elements_passes_and_what_they_used_are_not_rewritten(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    one_of_each(&store).await;
    for change in [
        "delete from elements",
        "update elements set omm = '[]'",
        "delete from passes",
        "delete from pass_elements",
        "update pass_elements set from_us = 0",
    ] {
        let error = parent.meddle(change).await.unwrap_err();
        assert!(error.contains("never"), "{change}: {error}");
    }
}

both!(a_damaged_row_is_noticed);
async fn a_damaged_row_is_noticed(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    one_of_each(&store).await;
    let scope = Scope::default();
    assert!(store.elements(&scope, &everything()).await.is_ok());
    let drop_trigger = match kind {
        Kind::Lite => {
            ["drop trigger elements_are_never_changed", "drop trigger pass_elements_are_never_changed"]
        }
        Kind::Pg => [
            "drop trigger elements_are_never_changed on elements",
            "drop trigger pass_elements_are_never_changed on pass_elements",
        ],
    };
    for damage in [
        drop_trigger[0],
        "update elements set omm = replace(omm, '15.2', '15.3')",
        "update passes set max_elevation_deg = 89.0",
        drop_trigger[1],
        "update pass_elements set from_us = 101",
    ] {
        parent.meddle(damage).await.unwrap();
    }
    let damaged = |error: StoreError| assert!(matches!(error, StoreError::Damaged { .. }), "{error:?}");
    damaged(store.elements(&scope, &everything()).await.unwrap_err());
    damaged(store.element_set(1).await.unwrap_err());
    damaged(store.elements_between(route().satellite.as_str(), (0, 100), 9).await.unwrap_err());
    damaged(store.passes(&scope, &everything()).await.unwrap_err());
    damaged(store.pass_elements(1).await.unwrap_err());
    damaged(store.snapshot(&[route().satellite], &[]).await.unwrap_err());
}

both!(a_restart_goes_on_with_the_newest_sets_and_the_open_pass);
async fn a_restart_goes_on_with_the_newest_sets_and_the_open_pass(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    // The newest by epoch is the first that was added.
    let sets: Vec<Record> = (1..=70).map(|id| epoch(id, NOON_US - id.cast_signed() * 1_000_000)).collect();
    store.apply(&batch(sets)).await.unwrap();
    let records = vec![
        Record::Pass(pass(1, &[(70, 5)], Some(NOON_US))),
        Record::Pass(pass(2, &[(70, 7), (1, 9)], None)),
    ];
    store.apply(&batch(records)).await.unwrap();
    store.close().await.unwrap();
    drop(store);

    let store = reopen(&parent).await.unwrap();
    let snapshot = store.snapshot(&[route().satellite, other_route().satellite], &[]).await.unwrap();
    assert_eq!((snapshot.last_ids.elements, snapshot.last_ids.pass), (70, 2));
    assert_eq!(snapshot.satellites.len(), 1);
    let left = &snapshot.satellites[0];
    let mut ids: Vec<u64> = left.elements.iter().map(|set| set.id.0).collect();
    ids.sort_unstable();
    assert_eq!(ids, (1..=64).collect::<Vec<_>>());
    let newest = left.elements.iter().find(|set| set.id.0 == 1).unwrap();
    assert_eq!(*newest.elements, Elements { epoch: at(NOON_US - 1_000_000), ..omm() });
    assert_eq!(left.pass, Some(pass(2, &[(70, 7), (1, 9)], None)));

    store.apply(&batch(vec![Record::Pass(pass(2, &[(70, 7), (1, 9)], Some(NOON_US)))])).await.unwrap();
    let snapshot = store.snapshot(&[route().satellite], &[]).await.unwrap();
    assert_eq!(snapshot.satellites[0].pass, None, "it is over");
}
