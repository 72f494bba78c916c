//! Two ways through the same files: report by report, and all at once. They end in the same archive.

use super::*;
use crate::ingest::{Delivery, TOGETHER_ALONE};
use crate::storage::Export;

/// The same numbers in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: u64) -> u64 {
        // splitmix64
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % bound
    }
}

fn short(packet_type: u8, payload: &[u8]) -> Vec<u8> {
    let contents = [&[packet_type, 0, 0, payload.len() as u8][..], payload].concat();
    [b"PIXELSAT", &protocol::crc32(&contents).to_be_bytes()[..], &contents].concat()
}

/// A file as nobody would write it: few frames, often; with a time, without one, damaged, foreign, the same line twice.
fn file(dice: &mut Dice, context: &Context, reports: u64) -> Vec<Read> {
    let began = context.admission.now.plus(-86_400_000_000);
    let mut found: Vec<Read> = Vec::new();
    for number in 0..reports {
        let frame = match dice.below(6) {
            0 | 1 => heartbeat(dice.below(8) as u32),
            2 | 3 => short(0, &[]),
            4 => short(3, &[dice.below(3) as u8; 224]),
            _ => short(4, &[dice.below(4) as u8; 141]),
        };
        let at = began.plus(dice.below(40) as i64 * 7_000_000);
        match dice.below(12) {
            0 => found.extend(found.last().cloned()),
            1 | 2 => {
                let line = format!("station=s{number} {}", hex::encode(&frame));
                found.extend(receptions(Format::Hex, line.as_bytes(), context).map(Result::unwrap));
            }
            3 => found.extend(message(board(b"foreign", at).as_bytes(), context)),
            4 => found.extend(message(board(b"Error_CRC", at).as_bytes(), context)),
            5 => {
                let mut damaged = frame;
                damaged[13] ^= 1 << dice.below(8);
                found.extend(message(board(&damaged, at).as_bytes(), context));
            }
            6 => found
                .extend(message(board_packet(&frame, at, &dice.below(30).to_string()).as_bytes(), context)),
            _ => {
                let topic = Topic::parse(&format!("tinygs/team/s{}/tele/rx", dice.below(4))).unwrap();
                found.extend(rx(&topic, board(&frame, at).as_bytes(), context));
            }
        }
    }
    found
}

/// All that an archive holds of it, whatever its numbers: frames with their receptions, and how many values.
async fn archive(bench: &Bench) -> (Vec<String>, u64) {
    let mut frames = std::collections::HashMap::new();
    for heard in bench.all_frames().await {
        let frame = heard.frame;
        let facts = format!("{} {} {}", hex::encode(&frame.bytes), frame.heard_at_us, frame.link);
        frames.insert(frame.id, facts);
    }
    let (mut lines, mut last) = (Vec::new(), 0);
    let reading = Export::of(bench.store());
    loop {
        let page = Page { after: Some(last), before: None, limit: 500 };
        let rows = bench.store().outside(&OutsideQuery { page, ..OutsideQuery::default() }).await.unwrap();
        let exported = reading.reports(&OutsideQuery::default(), last).await.unwrap();
        assert_eq!(exported.first().map(|(id, _)| *id), rows.first().map(|(id, _)| *id));
        let Some((newest, _)) = rows.last() else { break };
        last = *newest;
        for (_, mut row) in rows {
            let frame = row.frame.take().map(|frame| frames[&frame].clone());
            row.taken_at_us = 0;
            lines.push(format!("{frame:?} {row:?}"));
        }
    }
    lines.extend(frames.into_values());
    lines.sort_unstable();
    let report = bench.store().redecode(|_| {}).await.unwrap();
    assert_eq!((report.added, report.changed, report.removed, report.damaged), (0, 0, 0, 0), "{report:?}");
    (lines, report.unchanged)
}

async fn settled(delivery: Delivery, sum: &mut Outcome) {
    sum.add(&delivery.end().await.unwrap());
}

async fn both_paths(kind: Kind, seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut dice = Dice(seed);
        let (slow, mut fast) = (Bench::on(kind).await, Bench::on(kind).await);
        let context = slow.context();
        let found = file(&mut dice, &context, 300);
        let (mut one, mut all) = (Outcome::default(), Outcome::default());
        for read in &found {
            one.add(&slow.take(vec![read.clone()]).await);
        }
        let mut rest = &found[..];
        let together = [3, 40, TOGETHER_ALONE][dice.below(3) as usize];
        let deliver = async |bench: &Bench| {
            bench.ears().deliver(&bench.satellite, Ear::File, together, 0).await.unwrap()
        };
        let mut delivery = deliver(&fast).await;
        while !rest.is_empty() {
            let (part, later) = rest.split_at(rest.len().min(1 + dice.below(120) as usize));
            all.add(&delivery.push(part.to_vec()).await.unwrap());
            rest = later;
            if dice.below(4) == 0 {
                settled(delivery, &mut all).await;
                fast.restart().await;
                delivery = deliver(&fast).await;
            }
        }
        settled(delivery, &mut all).await;
        assert_eq!(one, all, "seed {seed}");
        let (slow, fast) = (archive(&slow).await, archive(&fast).await);
        assert_eq!(slow.1, fast.1, "seed {seed}: values");
        for (one, all) in slow.0.iter().zip(&fast.0) {
            assert_eq!(one, all, "seed {seed}");
        }
        assert_eq!(slow.0.len(), fast.0.len(), "seed {seed}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn all_at_once_or_one_by_one_the_archive_is_the_same() {
    let seeds = std::env::var("BULK_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(8);
    both_paths(Kind::Lite, 0..seeds).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn all_at_once_or_one_by_one_the_archive_is_the_same_on_postgresql() {
    both_paths(Kind::Pg, 100..103).await;
}
