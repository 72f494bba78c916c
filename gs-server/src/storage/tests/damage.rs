//! A damaged file is noticed, at the opening or at the row; nothing wrong is ever told as right.

use std::path::Path;

use super::super::*;
use super::records::*;
use super::{Dice, reopen};
use mission::record::{DownloadState, Record};
use mission::{Level, Stage};
use protocol::{Downlink, Telecommand};

const CASES: u64 = 50;

/// Everything that the questions tell, as text.
async fn everything(store: &Store) -> Result<Vec<String>, StoreError> {
    let page = Page { after: Some(0), limit: 1000, ..Page::default() };
    let mut told = Vec::new();
    told.push(format!("{:?}", store.frames(&FrameQuery { page, ..FrameQuery::default() }).await?));
    told.push(format!("{:?}", store.events(&EventQuery { page, ..EventQuery::default() }).await?));
    told.push(format!("{:?}", store.commands(&CommandQuery { page, ..CommandQuery::default() }).await?));
    told.push(format!("{:?}", store.command(1).await?));
    told.push(format!("{:?}", store.images(&Scope::default(), &page).await?));
    told.push(format!("{:?}", store.image(1).await?));
    told.push(format!("{:?}", store.image_bytes(1).await?));
    told.push(format!("{:?}", store.downloads(&Scope::default(), &page).await?));
    told.push(format!("{:?}", store.limits().await?));
    told.push(format!("{:?}", store.audit(&During::default(), &page).await?));
    told.push(format!("{:?}", store.find_intent(&mission::Principal::new("ada"), "once").await?));
    told.push(format!("{:?}", store.snapshot(&[route().satellite], &[key()]).await?));
    for parameter in store.parameters().await? {
        let query = TelemetryQuery {
            satellite: parameter.satellite,
            parameter: parameter.name,
            start_us: i64::MIN,
            stop_us: i64::MAX,
            max_points: 1000,
        };
        told.push(format!("{:?}", store.telemetry(&query).await?));
    }
    Ok(told)
}

async fn template(folder: &Path) -> Vec<String> {
    let store = Store::open(StoreOptions {
        folder: folder.to_path_buf(),
        station: Some(route().station),
        simulated: false,
        max_page_count: None,
        postgres: None,
        reserve_bytes: 0,
    })
    .await
    .unwrap();
    for id in 1..=40 {
        store.apply(&batch(heard(id))).await.unwrap();
    }
    let mut records = vec![
        Record::Frame(frame_of(41, &Downlink::Pong, &route())),
        Record::Image(image(1, 41, 30)),
        Record::Download(download(1, Some(1), DownloadState::Active)),
        Record::Limit(limit("heartbeat.temp", Level::Watch, Some(41.0))),
        Record::Audit(audit("command.create")),
        Record::Intent(receipt("once", mission::Accepted::Done)),
        Record::CounterFloor(floor(5)),
    ];
    records.extend((0..29).map(|index| Record::Chunk(chunk(1, index, 41, index as u8, false))));
    for id in 1..=20 {
        records.push(Record::Command(command(id, Telecommand::Ping)));
        records.push(Record::Stage(stage(id, 0, Stage::Queued, NOON_US)));
        records.push(Record::Sealed(sealed(id, 1, 1000 + id)));
    }
    store.apply(&batch(records)).await.unwrap();
    let told = everything(&store).await.unwrap();
    store.close().await.unwrap();
    told
}

#[tokio::test]
async fn flipped_and_cut_files_are_noticed_or_still_right() {
    let parent = tempfile::tempdir().unwrap();
    let told = template(&parent.path().join("data")).await;
    let path = parent.path().join("data").join(DATABASE);
    assert!(!path.with_extension("sqlite3-wal").exists(), "closed in order: everything is in one file");
    let good = std::fs::read(&path).unwrap();
    let mut dice = Dice(5);
    let (mut at_open, mut at_row, mut harmless) = (0, 0, 0);
    for case in 0..CASES {
        let mut bytes = good.clone();
        let what = match case % 5 {
            0..=2 => {
                let at = dice.below(bytes.len() as u64) as usize;
                let flip = 1 << dice.below(8);
                bytes[at] ^= flip;
                format!("byte {at} ^= {flip}")
            }
            3 => {
                let at = (dice.below(bytes.len() as u64 / 512) * 512) as usize;
                bytes[at..at + 512].fill(0);
                format!("sector at {at} zeroed")
            }
            _ => {
                let length = 1 + dice.below(bytes.len() as u64 - 1) as usize;
                bytes.truncate(length);
                format!("cut to {length}")
            }
        };
        for suffix in ["-wal", "-shm"] {
            let _ = std::fs::remove_file(path.with_extension(format!("sqlite3{suffix}")));
        }
        std::fs::write(&path, &bytes).unwrap();
        match reopen(&parent).await {
            Err(StoreError::Damaged { .. }) => at_open += 1,
            Err(error) => panic!("case {case}, {what}: {error:?}"),
            Ok(store) => {
                match everything(&store).await {
                    Err(StoreError::Damaged { .. }) => at_row += 1,
                    Err(error) => panic!("case {case}, {what}: {error:?}"),
                    Ok(now) => {
                        assert_eq!(now, told, "case {case}, {what}: told something wrong as right");
                        harmless += 1;
                    }
                }
                let _ = store.close().await;
            }
        }
    }
    println!(
        "{CASES} cases: {at_open} noticed at opening, {at_row} at the row, {harmless} touched nothing that counts"
    );
}
