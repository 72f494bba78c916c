//! A bulk import against SQLite's own speed with the same bytes.
//!
//! `scripts/bench-import` runs it; the figures are in docs/performance.md.

use std::io::Write as _;

use mission::reception::Ear;
use mission::{Clock as _, SatelliteId, UtcUs};
use rayon::prelude::*;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous};
use sqlx::{Connection as _, SqliteConnection};

use super::super::db::{Builder, Connection, sql};
use crate::clock::{SystemClock, wall_sleep};
use crate::config::Config;
use crate::elements::Offline;
use crate::ingest::formats::{Context, Format, Items, read};
use crate::ingest::{Aliases, Ears, Outcome, TOGETHER_ALONE};

/// After all of them.
const NOW: UtcUs = UtcUs(1_790_000_000_000_000);
/// Stations that hear each frame.
const STATIONS: usize = 5;
const CONFIG: &str = "[station]\nname = \"roof\"\nclock = \"trust\"\n[[satellites]]\nname = \"pixelsat-1\"\n[[links]]\n\
    name = \"radio\"\nsatellite = \"pixelsat-1\"\nkind = \"tcp\"\nconnect = \"localhost:9\"\nsimulated = true\n[storage]\n\
    folder = \"data\"\nreserve_bytes = 65536\n";

/// The reports of a network over months: chunks mostly, heartbeats among them, each heard by several.
fn packets(count: usize) -> Vec<u8> {
    use base64::Engine as _;
    let mut text = Vec::new();
    for number in 0..count {
        let (frame, station) = (number / STATIONS, number % STATIONS);
        let (packet_type, mut payload) = if frame % 10 == 0 { (6, vec![0; 117]) } else { (3, vec![0; 224]) };
        let at = if packet_type == 6 { 104 } else { 100 };
        payload[at..at + 4].copy_from_slice(&(frame as u32).to_be_bytes());
        let mut contents = vec![packet_type, 0, 0, payload.len() as u8];
        contents.extend(&payload);
        let bytes = [b"PIXELSAT", &protocol::crc32(&contents).to_be_bytes()[..], &contents].concat();
        let us = 1_780_000_000_000_000_u64 + frame as u64 * 2_000_000 + station as u64 * 1_000;
        let raw = base64::engine::general_purpose::STANDARD.encode(bytes);
        writeln!(
            text,
            "tinygs/user{station}/station{station}/tele/rx {{\"station_location\":[12.971,77.594],\"mode\":\"LoRa\",\
             \"frequency\":435,\"frequency_offset\":-310.5,\"satellite\":\"PixelSat-I\",\"sf\":9,\"cr\":5,\"bw\":125,\
             \"iIQ\":false,\"rssi\":-127.5,\"snr\":-11.75,\"frequency_error\":1843.2,\"unix_GS_time\":{},\"usec_time\":{us},\
             \"crc_error\":false,\"data\":\"{raw}\",\"NORAD\":99999,\"noisy\":false}}",
            us / 1_000_000
        )
        .unwrap();
    }
    text
}

/// Seconds that SQLite takes for the same lines in one table, as durably, in the same transactions.
async fn plain_s(folder: &std::path::Path, text: &[u8]) -> f64 {
    let options = SqliteConnectOptions::new()
        .filename(folder.join("plain.sqlite3"))
        .create_if_missing(true)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full);
    let mut connection = Connection::Lite(SqliteConnection::connect_with(&options).await.unwrap());
    sql("create table plain (id integer primary key, line blob not null) strict")
        .execute(&mut connection)
        .await
        .unwrap();
    let lines: Vec<&[u8]> = text.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()).collect();
    let clock = SystemClock::new();
    let began = clock.now();
    for together in lines.chunks(TOGETHER_ALONE) {
        sql("begin immediate").execute(&mut connection).await.unwrap();
        for lines in together.chunks(250) {
            let mut statement = Builder::new("insert into plain (line) values ");
            for (at, line) in lines.iter().enumerate() {
                statement.push(if at == 0 { "(" } else { ", (" }).push_bind(*line).push(")");
            }
            statement.build().execute(&mut connection).await.unwrap();
        }
        sql("commit").execute(&mut connection).await.unwrap();
    }
    clock.now().mono.since(began.mono) as f64 / 1e6
}

/// Reports a second that one core reads, decodes and checks, without an archive; of so many of the lines as that takes
/// a few seconds.
fn decoded_by_one_per_s(text: &[u8], context: &Context) -> f64 {
    let clock = SystemClock::new();
    let began = clock.now();
    let mut decoded = 0;
    for item in Items::new(Format::Json, text).map(Result::unwrap).take(200_000) {
        let mut out = Vec::new();
        read(&item, context, &mut out);
        decoded += out.iter().flatten().filter(|reception| reception.frame().is_some()).count();
    }
    decoded as f64 * 1e6 / clock.now().mono.since(began.mono) as f64
}

/// Seconds for reading, decoding and checking the same lines on all cores, without an archive.
fn decoded_s(text: &[u8], context: &Context, count: usize) -> f64 {
    let clock = SystemClock::new();
    let began = clock.now();
    let mut items = Items::new(Format::Json, text).map(Result::unwrap);
    let mut decoded = 0;
    loop {
        let together: Vec<_> = items.by_ref().take(TOGETHER_ALONE).collect();
        if together.is_empty() {
            break;
        }
        let each = |item: &crate::ingest::formats::Item| {
            let mut out = Vec::new();
            read(item, context, &mut out);
            out.iter().flatten().filter(|reception| reception.frame().is_some()).count()
        };
        decoded += together.par_iter().map(each).sum::<usize>();
    }
    assert_eq!(decoded, count);
    clock.now().mono.since(began.mono) as f64 / 1e6
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "a measurement"]
async fn bulk_import_keeps_up_with_sqlite() {
    let count: usize = std::env::var("BULK").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000);
    let folder = tempfile::tempdir().unwrap();
    let config = Config::from_toml(CONFIG, folder.path()).unwrap();
    let satellite = SatelliteId::new("pixelsat-1").unwrap();
    let text = packets(count);
    if let Ok(path) = std::env::var("BULK_FILE") {
        std::fs::write(path, &text).unwrap();
    }
    let plain_s = plain_s(folder.path(), &text).await;
    let context = Context::file(Aliases::of(&config).admission(&satellite, NOW));
    let decoded_s = decoded_s(&text, &context, count);
    let by_one_per_s = decoded_by_one_per_s(&text, &context).round();
    let mut told = Vec::new();
    for round in ["import", "the same again"] {
        let station = Offline::open(&config).await.unwrap();
        station.door.store.make_room().await.unwrap();
        let ears = Ears::new(station.door.store.clone(), station.inbox.clone(), station.timer.clone());
        let context = Context::file(Aliases::of(&config).admission(&satellite, ears.now()));
        let began = station.timer.now();
        let mut sum = Outcome::default();
        let mut items = Items::new(Format::Json, &text[..]).map(Result::unwrap).peekable();
        let (sender, mut batches) = tokio::sync::mpsc::channel(1);
        let each = move |item: &crate::ingest::formats::Item| {
            let mut out = Vec::new();
            read(item, &context, &mut out);
            out
        };
        let cut = async {
            while items.peek().is_some() {
                let together: Vec<_> = items.by_ref().take(TOGETHER_ALONE).collect();
                let found: Vec<_> =
                    tokio::task::block_in_place(|| together.par_iter().flat_map_iter(&each).collect());
                sender.send(found).await.unwrap();
            }
            drop(sender);
        };
        let take = async {
            let mut delivery = ears.deliver(&satellite, Ear::File, TOGETHER_ALONE, 60).await.unwrap();
            while let Some(found) = batches.recv().await {
                sum.add(&delivery.push(found).await.unwrap());
            }
            sum.add(&delivery.end().await.unwrap());
        };
        tokio::join!(cut, take);
        let took_s = station.timer.now().mono.since(began.mono) as f64 / 1e6;
        told.push((round, took_s, sum));
        drop(ears);
        station.close().await.unwrap();
        wall_sleep(std::time::Duration::from_millis(10)).await;
    }
    println!("{count} packets, {} bytes; plain SQLite {:.0}/s", text.len(), count as f64 / plain_s);
    println!("decoded only: {:.0}/s, {by_one_per_s:.0}/s on one core", count as f64 / decoded_s);
    for (round, took_s, sum) in &told {
        println!("{round}: {:.0}/s, ratio {:.2}: {sum:?}", count as f64 / took_s, plain_s / took_s);
    }
    let per_s = |took_s: f64| (count as f64 / took_s).round();
    let figures = serde_json::json!({
        "packets": count, "bytes": text.len(), "plain_per_s": per_s(plain_s), "decoded_per_s": per_s(decoded_s),
        "decoded_by_one_per_s": by_one_per_s,
        "import_per_s": per_s(told[0].1), "again_per_s": per_s(told[1].1),
    });
    println!("{figures}");
    assert_eq!(told[0].2.frames as usize, count.div_ceil(STATIONS));
    assert_eq!(told[1].2, Outcome { repeated: count as u64, ..Outcome::default() });
}
