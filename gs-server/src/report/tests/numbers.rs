//! What a pass report counts.

use mission::UtcUs;

use super::super::{markdown, pass_document, pass_report};
use super::archive::{S, flown};

#[tokio::test]
async fn a_pass_is_told_as_the_archive_has_it() {
    let archive = flown().await;
    let (_, _, los) = archive.times;
    let report =
        pass_report(&archive.store, &archive.identity, 1, UtcUs(los + 3600 * S)).await.unwrap().unwrap();
    insta::assert_snapshot!("pass.md", markdown(&pass_document(&report)));
    assert_eq!(report.path.len(), 121);
    let told = api::PassReport { path: Vec::new(), ..report };
    insta::assert_snapshot!("pass.json", serde_json::to_string_pretty(&told).unwrap());
}

#[tokio::test]
async fn a_pass_that_is_over_is_told_the_same_for_ever() {
    let archive = flown().await;
    let (_, _, los) = archive.times;
    let told = async |now: i64| {
        pass_report(&archive.store, &archive.identity, 1, UtcUs(now)).await.unwrap().unwrap()
    };
    let first = told(los + 60 * S).await;
    assert!(first.is_final);
    assert_eq!(told(los + 400 * 86_400 * S).await, first);
    assert!(!told(los + 59 * S).await.is_final);
}

#[tokio::test]
async fn a_pass_that_lasts_is_told_as_far_as_it_came() {
    let archive = flown().await;
    let (aos, _, _) = archive.times;
    let report =
        pass_report(&archive.store, &archive.identity, 1, UtcUs(aos + 100 * S)).await.unwrap().unwrap();
    assert!(!report.is_final);
    // Before AOS and in the first minute.
    assert_eq!((report.had.frames, report.had.heartbeats_expected), (2, Some(1)));
    assert_eq!(report.commands.len(), 1, "{:?}", report.commands);
    assert_eq!(report.alarms.len(), 2);
    assert!(report.images.is_empty());
    assert_eq!(pass_report(&archive.store, &archive.identity, 2, UtcUs(aos)).await.unwrap(), None);
}

#[tokio::test]
async fn a_station_without_a_place_knows_no_elevations() {
    let mut archive = flown().await;
    archive.identity.site = None;
    archive.identity.satellites.clear();
    let (_, _, los) = archive.times;
    let report =
        pass_report(&archive.store, &archive.identity, 1, UtcUs(los + 60 * S)).await.unwrap().unwrap();
    assert!(report.path.is_empty() && report.next_pass.is_none());
    assert!(report.signal.iter().all(|point| point.elevation_deg.is_none()));
    assert_eq!(
        (report.had.airtime_s, report.had.heartbeats_expected, report.uplink.airtime_s),
        (None, None, None)
    );
    let text = markdown(&pass_document(&report));
    assert!(
        text.contains("does not know where it stands") && text.contains("Airtime down: unknown"),
        "{text}"
    );
}
