//! What a month counts.

use mission::UtcUs;

use super::super::{Month, Style, html, markdown, month_document, month_report};
use super::archive::{S, flown};

#[tokio::test]
async fn a_month_is_told_as_the_archive_has_it() {
    let archive = flown().await;
    let (aos, _, los) = archive.times;
    let told = async |month: &str, now: i64| {
        month_report(&archive.store, &archive.identity, month.parse().unwrap(), UtcUs(now)).await.unwrap()
    };
    let report = told("2026-11", los + 40 * 86_400 * S).await;
    insta::assert_snapshot!("month.md", markdown(&month_document(&report)));
    let told_days: Vec<_> = report.days_with_frames();
    assert_eq!(told_days, [("2026-11-22".to_owned(), 1, 19)]);
    let page = html(&month_document(&report), Style::Linked);
    assert!(page.contains("Frames by day") && !page.contains("<script"), "{page}");

    // Every number again from the rows themselves.
    let satellite = &report.satellites[0];
    let frames = archive.store.counts().await.unwrap().frames;
    assert_eq!(i64::try_from(satellite.frames).unwrap(), frames);
    assert_eq!(satellite.packets.iter().map(|count| count.frames).sum::<u64>(), satellite.frames);
    assert_eq!(satellite.commands.iter().map(|count| count.count).sum::<u64>(), 5);
    assert_eq!(satellite.chunks, 7);

    // While the month lasts, nothing of what is still to come.
    let report = told("2026-11", aos + 100 * S).await;
    assert!(!report.is_final);
    assert_eq!((report.satellites[0].frames, report.satellites[0].days.len()), (3, 22));
    let empty = told("2026-10", los).await;
    assert_eq!((empty.satellites[0].passes, empty.satellites[0].frames, empty.incidents.len()), (0, 0, 0));
    assert!(Month::of(UtcUs(los)).to_string() == "2026-11");
}

trait Days {
    fn days_with_frames(&self) -> Vec<(String, u64, u64)>;
}

impl Days for api::MonthReport {
    fn days_with_frames(&self) -> Vec<(String, u64, u64)> {
        let days = self.satellites.iter().flat_map(|satellite| &satellite.days);
        days.filter(|day| day.frames > 0).map(|day| (day.day.clone(), day.passes, day.frames)).collect()
    }
}
