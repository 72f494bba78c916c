//! A full disk stops the writing, keeps what is there, and is forgotten when there is room again.

use mission::record::Record;

use super::super::{During, FrameQuery, Page, Store, StoreError, StoreOptions};
use super::records::*;
use super::{Dice, options};

/// Fills the database up to its limit; the number of batches that were stored.
async fn fill(store: &Store) -> u64 {
    for id in 1..100_000 {
        match store.apply(&batch(heard(id))).await {
            Ok(_) => {}
            Err(StoreError::Full) => return id - 1,
            Err(error) => panic!("{error:?}"),
        }
    }
    panic!("never full");
}

#[tokio::test]
async fn at_its_size_limit_it_says_full_and_goes_on_when_there_is_room() {
    let parent = tempfile::tempdir().unwrap();
    let small = StoreOptions { max_page_count: Some(150), ..options(&parent) };
    let store = Store::open(small).await.unwrap();
    let stored = fill(&store).await;
    assert!(stored > 3);
    for _ in 0..3 {
        let error = store.apply(&batch(heard(stored + 1))).await.unwrap_err();
        assert!(matches!(error, StoreError::Full) && error.is_temporary());
        assert!(error.to_string().contains("make room"), "{error}");
    }
    let counts = store.counts().await.unwrap();
    assert_eq!(counts.frames.cast_unsigned(), stored);
    assert_eq!(counts.events, 2 * counts.frames, "nothing half");

    store.set_max_page_count(1_000_000).await.unwrap();
    let events = store.apply(&batch(heard(stored + 1))).await.unwrap();
    assert_eq!(events[0].sequence, counts.events + 1, "no gap in the sequence");
    store.close().await.unwrap();
    drop(store);

    let store = Store::open(options(&parent)).await.unwrap();
    assert_eq!(store.counts().await.unwrap().frames, counts.frames + 1);
    let page = Page { after: Some(0), limit: 1000, ..Page::default() };
    let frames = store.frames(&FrameQuery { page, ..FrameQuery::default() }).await.unwrap();
    assert!(frames.iter().all(|heard| heard.receptions.len() == 1));
}

#[tokio::test]
async fn a_limit_hit_anywhere_in_a_batch_leaves_nothing_half() {
    let mut dice = Dice(7);
    for _ in 0..8 {
        let parent = tempfile::tempdir().unwrap();
        let pages = 130 + dice.below(40) as u32;
        let store =
            Store::open(StoreOptions { max_page_count: Some(pages), ..options(&parent) }).await.unwrap();
        let stored = fill(&store).await;
        // Small batches may still fit; what they store is whole as well.
        let mut extra = 0;
        for number in 0..40 {
            let record = Record::Audit(audit(if number % 2 == 0 { "a" } else { "b" }));
            extra += u64::from(store.apply(&batch(vec![record])).await.is_ok());
        }
        let counts = store.counts().await.unwrap();
        assert_eq!(
            (counts.frames.cast_unsigned(), counts.receptions, counts.events),
            (stored, counts.frames, 2 * counts.frames)
        );
        let audit = store.audit(&During::default(), &Page { limit: 1000, ..Page::default() }).await.unwrap();
        assert_eq!(audit.len() as u64, extra);
        store.close().await.unwrap();
        drop(store);
        Store::open(options(&parent)).await.unwrap();
    }
}

const FOLDER: &str = "GS_STORAGE_FILE_LIMIT_FOLDER";

/// Runs in a process of its own, because the limit holds for a whole process.
#[tokio::test]
#[ignore = "a part of the test below, which runs it in a process of its own"]
async fn child() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let Ok(folder) = std::env::var(FOLDER) else { return };
    let options = StoreOptions {
        folder: folder.into(),
        station: Some(super::records::route().station),
        simulated: false,
        max_page_count: None,
        postgres: None,
        reserve_bytes: 16 * 512,
    };
    let store = Store::open(options).await.unwrap();
    store.apply(&batch(heard(1))).await.unwrap();
    let before = getrlimit(Resource::Fsize);
    setrlimit(Resource::Fsize, Rlimit { current: Some(200_000), ..before }).unwrap();
    let mut id = 2;
    let error = loop {
        match store.apply(&batch(heard(id))).await {
            Ok(_) => id += 1,
            Err(error) => break error,
        }
        assert!(id < 1000, "the limit never held");
    };
    assert!(error.is_temporary(), "{error:?}");
    assert_eq!(store.counts().await.unwrap().frames, id.cast_signed() - 1);
    let frame = mission::ReservedFrame {
        route: route(),
        source: mission::Source::Radio,
        received_at: mission::UtcUs(NOON_US),
        rssi_dbm: None,
        bytes: vec![1; 240].into(),
    };
    store.reserve_push(frame).await.unwrap();
    setrlimit(Resource::Fsize, before).unwrap();
    store.apply(&batch(heard(id))).await.unwrap();
    assert_eq!(store.counts().await.unwrap().events, 2 * id.cast_signed());
    println!("\nthe limit came back as: {error}");
}

#[tokio::test]
async fn a_file_size_limit_of_the_shell_is_an_error_not_the_end() {
    let parent = tempfile::tempdir().unwrap();
    let output = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "storage::tests::full::child", "--ignored", "--nocapture"])
        .env(FOLDER, parent.path().join("data"))
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && told.contains("the limit came back as"), "{output:?}");
    let store = Store::open(options(&parent)).await.unwrap();
    assert_eq!(store.reserve_read().await.unwrap().len(), 1);
}
