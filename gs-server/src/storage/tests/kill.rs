//! The process is killed while it stores: what it had acknowledged is there, and nothing is there by half.

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Command, Stdio};

use super::super::{EventQuery, FrameQuery, Page};
use super::records::*;
use super::{Dice, options, reopen};

const FOLDER: &str = "GS_STORAGE_KILL_FOLDER";
const CYCLES: u64 = 30;

/// The process that is killed: stores batches and says so on its output, for ever.
#[tokio::test]
#[ignore = "a part of the test below, which runs it in a process of its own"]
async fn child() {
    let Ok(folder) = std::env::var(FOLDER) else { return };
    let store = super::Store::open(super::StoreOptions {
        folder: folder.into(),
        station: Some(super::records::route().station),
        simulated: false,
        max_page_count: None,
        postgres: None,
        reserve_bytes: 0,
    })
    .await
    .unwrap();
    let next = store.snapshot(&[], &[]).await.unwrap().last_ids.frame + 1;
    for id in next.. {
        let events = store.apply(&batch(heard(id))).await.unwrap();
        let mut out = std::io::stdout().lock();
        writeln!(out, "\nack {id} {}", events[1].sequence).unwrap();
        out.flush().unwrap();
    }
}

#[tokio::test]
async fn nothing_acknowledged_is_lost_when_the_process_is_killed() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("data");
    let mut dice = Dice(2026);
    let (mut acknowledged, mut cycles_with_more) = (0, 0);
    for cycle in 0..CYCLES {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "storage::tests::kill::child", "--ignored", "--nocapture"])
            .env(FOLDER, &folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let wanted = 1 + dice.below(25);
        let mut last = (0, 0);
        for line in
            lines.by_ref().map(Result::unwrap).filter(|line| line.starts_with("ack ")).take(wanted as usize)
        {
            last = parse(&line);
        }
        assert_ne!(last, (0, 0), "cycle {cycle}: the child did nothing");
        // Anywhere in the next batches.
        for _ in 0..dice.below(400_000) {
            std::hint::spin_loop();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        // What it said before it died counts as well.
        for line in lines.map_while(Result::ok).filter(|line| line.starts_with("ack ")) {
            if line.split(' ').count() == 3 && line.split(' ').all(|word| !word.is_empty()) {
                last = parse(&line).max(last);
            }
        }
        acknowledged += wanted;

        let store = reopen(&parent).await.unwrap();
        let counts = store.counts().await.unwrap();
        assert!(
            counts.frames >= last.0,
            "cycle {cycle}: frame {} was acknowledged, {} are there",
            last.0,
            counts.frames
        );
        assert!(store.last_event_seq().await.unwrap() >= last.1);
        assert_eq!(
            (counts.receptions, counts.events),
            (counts.frames, 2 * counts.frames),
            "something is half"
        );
        cycles_with_more += u64::from(counts.frames > last.0);
        let page = Page { before: Some(last.0 + 2), limit: 50, ..Page::default() };
        let frames = store.frames(&FrameQuery { page, ..FrameQuery::default() }).await.unwrap();
        assert!(frames.iter().all(|heard| heard.frame.bytes == expected(heard.frame.id)));
        let events =
            store.events(&EventQuery { page: Page::default(), ..EventQuery::default() }).await.unwrap();
        assert!(events.windows(2).all(|pair| pair[0].sequence == pair[1].sequence + 1));
        store.close().await.unwrap();
    }
    let store = super::Store::open(options(&parent)).await.unwrap();
    let report = store.redecode(|_| {}).await.unwrap();
    assert_eq!((report.damaged, report.added, report.changed, report.removed), (0, 0, 0, 0), "{report:?}");
    println!(
        "{CYCLES} kills, more than {acknowledged} acknowledged batches, 0 lost; {cycles_with_more} times a batch was \
         durable whose acknowledgement was cut off"
    );
}

fn parse(line: &str) -> (i64, i64) {
    let mut numbers = line.split(' ').skip(1).map(|word| word.parse().unwrap());
    (numbers.next().unwrap(), numbers.next().unwrap())
}

fn expected(id: i64) -> Vec<u8> {
    frame_of(id.cast_unsigned(), &protocol::Downlink::Heartbeat(heartbeat(id.cast_unsigned())), &route())
        .bytes
        .to_vec()
}
