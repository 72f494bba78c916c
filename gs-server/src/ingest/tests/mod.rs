//! The way into a real archive, by a real engine without links: one frame, whoever heard it, in whatever order.

use mission::reception::{Ear, Refusal};
use mission::{LinkId, SatelliteId, Source, UtcUs};
use tempfile::TempDir;

use super::formats::{Context, Format, Read, Refused, Topic, message, receptions, rx};
use super::{Aliases, Ears, Outcome};
use crate::clock::wall_sleep;
use crate::config::Config;
use crate::elements::Offline;
use crate::engine::EngineMessage;
use crate::storage::{FrameQuery, OutsideQuery, Page, Store};

mod paths;

const CONFIG: &str = "[station]\nname = \"roof\"\nclock = \"trust\"\n[[satellites]]\nname = \"pixelsat-1\"\n\
    aliases = [\"PixelSat-I\"]\n[[links]]\nname = \"radio\"\nsatellite = \"pixelsat-1\"\nkind = \"tcp\"\n\
    connect = \"localhost:9\"\nsimulated = true\n[storage]\nfolder = \"data\"\nreserve_bytes = 65536\n";

/// Which database.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Lite,
    Pg,
}

/// A station whose engine runs, and stops, and runs again.
struct Bench {
    config: Config,
    station: Option<Offline>,
    satellite: SatelliteId,
    _database: Option<migrations::cluster::Database>,
    _folder: TempDir,
}

impl Bench {
    async fn new() -> Self {
        Self::on(Kind::Lite).await
    }

    async fn on(kind: Kind) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let database = (kind == Kind::Pg).then(|| migrations::cluster::Database::fresh().unwrap());
        let address = database.as_ref().map(|database| database.address().unwrap());
        let line = address.map(|address| format!("database = \"{address}\"\n")).unwrap_or_default();
        let config = Config::from_toml(&format!("{CONFIG}{line}"), folder.path()).unwrap();
        config.check().unwrap();
        let mut bench = Self {
            config,
            station: None,
            satellite: SatelliteId::new("pixelsat-1").unwrap(),
            _database: database,
            _folder: folder,
        };
        bench.restart().await;
        bench
    }

    async fn restart(&mut self) {
        if let Some(station) = self.station.take() {
            station.close().await.unwrap();
        }
        self.station = Some(Offline::open(&self.config).await.unwrap());
    }

    fn station(&self) -> &Offline {
        self.station.as_ref().unwrap()
    }

    fn store(&self) -> &Store {
        &self.station().door.store
    }

    fn now(&self) -> UtcUs {
        self.station().timer.now().utc
    }

    fn ears(&self) -> Ears {
        let station = self.station();
        Ears::new(self.store().clone(), station.inbox.clone(), station.timer.clone())
    }

    fn context(&self) -> Context {
        Context::file(Aliases::of(&self.config).admission(&self.satellite, self.now()))
    }

    async fn take(&self, found: Vec<Read>) -> Outcome {
        self.ears().take(&self.satellite, Ear::File, found).await.unwrap()
    }

    /// Our own radio hears this, and it is durable.
    async fn radio(&self, bytes: &[u8]) {
        let before = self.receptions().await;
        let received = self.station().timer.now();
        let link = LinkId::new("radio").unwrap();
        let message = EngineMessage::Bytes { link, bytes: bytes.to_vec(), source: Source::Radio, received };
        self.station().inbox.send(message).await;
        while self.receptions().await == before {
            wall_sleep(std::time::Duration::from_millis(2)).await;
        }
    }

    async fn receptions(&self) -> i64 {
        let during = crate::storage::During::default();
        let (mut count, mut last) = (0, 0);
        loop {
            let page = crate::storage::Export::of(self.store()).own(None, &during, last).await.unwrap();
            let Some((id, _)) = page.last() else { return count };
            (count, last) = (count + page.len() as i64, *id);
        }
    }

    /// The bytes of the newest frame, and how many of ours and how many others heard it.
    async fn newest(&self) -> (Vec<u8>, usize, usize) {
        let newest = self.all_frames().await.pop().unwrap();
        let others = self.store().outside_of(&[newest.frame.id]).await.unwrap();
        (newest.frame.bytes, newest.receptions.len(), others.get(&newest.frame.id).map_or(0, Vec::len))
    }

    async fn frame_count(&self) -> usize {
        self.all_frames().await.len()
    }

    /// Oldest first.
    async fn all_frames(&self) -> Vec<crate::storage::Heard> {
        let (mut all, mut last) = (Vec::new(), 0);
        loop {
            let page = Page { after: Some(last), before: None, limit: 500 };
            let part = self.store().frames(&FrameQuery { page, ..FrameQuery::default() }).await.unwrap();
            let Some(newest) = part.last() else { return all };
            last = newest.frame.id;
            all.extend(part);
        }
    }

    /// Frames, and of the newest how many of ours and how many others heard it.
    async fn heard(&self) -> (usize, usize, usize) {
        let heard = self.store().frames(&FrameQuery::default()).await.unwrap();
        let Some(newest) = heard.first() else { return (0, 0, 0) };
        let others = self.store().outside_of(&[newest.frame.id]).await.unwrap();
        (heard.len(), newest.receptions.len(), others.get(&newest.frame.id).map_or(0, Vec::len))
    }

    async fn values(&self) -> usize {
        self.store().latest("pixelsat-1").await.unwrap().len()
    }
}

fn heartbeat(uptime_ms: u32) -> Vec<u8> {
    let mut payload = [0; 117];
    payload[100..104].copy_from_slice(&21.5_f32.to_be_bytes());
    payload[104..108].copy_from_slice(&uptime_ms.to_be_bytes());
    let contents = [&[6, 0, 0, 117][..], &payload].concat();
    [b"PIXELSAT", &protocol::crc32(&contents).to_be_bytes()[..], &contents].concat()
}

/// Between two ends, with its escapes.
fn kiss(frame: &[u8]) -> Vec<u8> {
    let mut out = vec![0xC0, 0];
    for &byte in frame {
        match byte {
            0xC0 => out.extend([0xDB, 0xDC]),
            0xDB => out.extend([0xDB, 0xDD]),
            byte => out.push(byte),
        }
    }
    out.push(0xC0);
    out
}

fn base64(bytes: &[u8]) -> String {
    use base64::Engine as _;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

fn stamp(at: UtcUs) -> String {
    jiff::Timestamp::from_microsecond(at.0).unwrap().to_string()
}

/// What a board says of these bytes.
fn board(bytes: &[u8], at: UtcUs) -> String {
    format!(
        r#"{{"station_location":[12.9,77.5],"mode":"LoRa","frequency":435,"satellite":"PixelSat-I","rssi":-120.5,"snr":-9.25,
            "frequency_error":812.5,"unix_GS_time":{},"usec_time":{},"crc_error":false,"data":"{}","NORAD":0,"noisy":false}}"#,
        at.0 / 1_000_000,
        at.0,
        base64(bytes)
    )
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Way {
    Radio,
    Mqtt,
    Api,
    Satnogs,
    Kiss,
}

const WAYS: [Way; 5] = [Way::Radio, Way::Mqtt, Way::Api, Way::Satnogs, Way::Kiss];

async fn deliver(bench: &Bench, way: Way, frame: &[u8], at: UtcUs) -> Option<Outcome> {
    let context = bench.context();
    let found = match way {
        Way::Radio => {
            bench.radio(frame).await;
            return None;
        }
        Way::Mqtt => {
            let topic = Topic::parse("tinygs/team/roof/tele/rx").unwrap();
            // A module's header in front, as a board delivers it.
            let delivered = [&[0xDE, 0x70, 0x19][..], frame].concat();
            rx(&topic, board(&delivered, at).as_bytes(), &Context { arrived: Some(bench.now()), ..context })
        }
        Way::Api => {
            let at_ms = at.0 / 1000 + 3_000;
            let packet = format!(
                r#"{{"id":"{}","serverTime":{at_ms},"raw":"{}","mode":"LoRa","freq":435.0,"satellite":"Norbi","norad":0}}"#,
                hex::encode(&frame[8..12]),
                base64(frame)
            );
            message(format!("{{\"packets\":[{packet}]}}").as_bytes(), &context)
        }
        Way::Satnogs => {
            let hex = hex::encode_upper(frame);
            let row = format!(
                r#"[{{"norad_cat_id":98765,"frame":"{hex}","observer":"DL0XYZ-JO62qn","timestamp":"{}"}}]"#,
                stamp(at.plus(-2_000_000))
            );
            message(row.as_bytes(), &context)
        }
        Way::Kiss => receptions(Format::Kiss, &kiss(frame)[..], &context).map(Result::unwrap).collect(),
    };
    Some(bench.take(found).await)
}

/// All orders of five.
fn orders() -> Vec<Vec<Way>> {
    let mut orders = vec![Vec::new()];
    for _ in WAYS {
        let longer = orders.iter().flat_map(|order: &Vec<Way>| {
            let left = WAYS.into_iter().filter(|way| !order.contains(way));
            left.map(|way| [&order[..], &[way]].concat()).collect::<Vec<_>>()
        });
        orders = longer.collect();
    }
    orders
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn five_ways_are_one_frame_with_five_receptions_in_any_order_and_across_restarts() {
    five_ways(Kind::Lite).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn five_ways_are_one_frame_with_five_receptions_on_postgresql_too() {
    five_ways(Kind::Pg).await;
}

async fn five_ways(kind: Kind) {
    let mut bench = Bench::on(kind).await;
    let mut frames = 0;
    assert_eq!(orders().len(), 120);
    for (number, order) in orders().into_iter().enumerate() {
        frames += 1;
        let frame = heartbeat(frames as u32 * 1_000);
        let at = bench.now();
        for (place, way) in order.iter().enumerate() {
            deliver(&bench, *way, &frame, at).await;
            // Of every fourth order a restart, at each of its places in turn.
            if number % 4 == 0 && number / 4 % WAYS.len() == place {
                bench.restart().await;
            }
        }
        // And all of them once more: nothing changes, but for the radio, whose copy would be a reception.
        for way in order.iter().filter(|way| **way != Way::Radio) {
            let again = deliver(&bench, *way, &frame, at).await.unwrap();
            assert_eq!(again, Outcome { repeated: 1, ..Outcome::default() }, "{way:?} in {order:?}");
        }
        let (heard, ours, others) = bench.newest().await;
        assert_eq!((heard, ours, others), (frame, 1, 4), "{order:?}");
    }
    assert_eq!(bench.frame_count().await, frames);
    assert!(bench.values().await > 20, "values were derived");
    // What was derived stays when everything is derived anew.
    let report = bench.store().redecode(|_| {}).await.unwrap();
    assert_eq!((report.added, report.changed, report.damaged), (0, 0, 0), "{report:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_refused_is_counted_by_reason_and_what_is_damaged_is_kept_apart() {
    let bench = Bench::new().await;
    let ears = bench.ears();
    let context = Context { arrived: Some(bench.now()), ..bench.context() };
    let topic = Topic::parse("tinygs/team/roof/tele/rx").unwrap();
    let mut damaged = heartbeat(5);
    damaged[40] ^= 4;
    let packets: [Vec<u8>; 4] =
        [b"TinyGS-test 1".to_vec(), b"somebody else's satellite".to_vec(), damaged, b"Error_CRC".to_vec()];
    let mut found: Vec<Read> =
        packets.iter().flat_map(|bytes| rx(&topic, board(bytes, bench.now()).as_bytes(), &context)).collect();
    found.extend(rx(&topic, b"{}", &context));
    found.extend(rx(&topic, board(&heartbeat(6), UtcUs(31_000_000)).as_bytes(), &context));
    let outcome = ears.take(&bench.satellite, Ear::OwnMqtt, found).await.unwrap();
    assert_eq!(outcome, Outcome { frames: 1, without_frame: 2, refused: 3, ..Outcome::default() });
    let counts = ears.counts().remove(&Ear::OwnMqtt).unwrap();
    let refused: Vec<_> = counts.refused.into_iter().collect();
    assert_eq!(refused, [("foreign", 1), ("not-a-report", 1), ("test-packet", 1)]);
    assert_eq!(counts.doubts.into_iter().collect::<Vec<_>>(), [("time-too-early", 1)]);
    let kept = bench.store().outside(&OutsideQuery::default()).await.unwrap();
    let kinds: Vec<_> = kept.iter().map(|(_, row)| (row.kind.as_str(), row.frame.is_some())).collect();
    assert_eq!(kinds, [("frame", true), ("detection", false), ("repairable", false)]);
    assert_eq!(kept[2].1.repaired_bit, Some(40 * 8 + 5));
    assert_eq!(kept[1].1.frequency_error_hz, Some(812.5), "a detection tells of Doppler");
    assert_eq!((kept[0].1.latitude_deg, kept[0].1.receiver.as_str()), (Some(12.9), "team/roof"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn late_reports_move_no_newest_value() {
    let bench = Bench::new().await;
    let now = bench.now();
    bench.take(message(board_packet(&heartbeat(900_000), now, "new").as_bytes(), &bench.context())).await;
    let newest = bench.store().latest("pixelsat-1").await.unwrap();
    bench
        .take(message(
            board_packet(&heartbeat(1_000), now.plus(-86_400_000_000), "old").as_bytes(),
            &bench.context(),
        ))
        .await;
    assert_eq!(bench.heard().await.0, 2);
    assert_eq!(bench.store().latest("pixelsat-1").await.unwrap(), newest);
}

fn board_packet(bytes: &[u8], at: UtcUs, id: &str) -> String {
    format!(r#"{{"id":"{id}","serverTime":{},"raw":"{}","satellite":"x"}}"#, at.0 / 1000, base64(bytes))
}

/// Ten thousand messages a second for ten seconds, all of them lies, while the radio goes on.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_of_lies_grows_no_memory_and_costs_the_radio_nothing() {
    let seconds: usize = std::env::var("FLOOD_S").ok().and_then(|s| s.parse().ok()).unwrap_or(1);
    let bench = Bench::new().await;
    let ears = bench.ears();
    let context = bench.context();
    let now = bench.now();
    let flood = {
        let (ears, satellite) = (ears.clone(), bench.satellite.clone());
        tokio::spawn(async move {
            let mut sum = Outcome::default();
            for batch in 0..seconds * 10 {
                let mut found = Vec::with_capacity(1_000);
                for number in 0..1_000 {
                    let text = match number % 10 {
                        0 => "{\"data\":7}".to_owned(),
                        1 => "x".repeat(100),
                        2 => format!("{{\"raw\":{}", "[".repeat(5_000)),
                        3 => board(b"TinyGS-test", now),
                        4 => board(b"foreign", now),
                        _ => {
                            // Forged heartbeats, forged chunks.
                            let uptime = (batch * 1_000 + number) as u32;
                            board(&heartbeat(uptime), now.plus(-(i64::from(uptime) % 500_000_000)))
                        }
                    };
                    found.extend(message(text.as_bytes(), &context));
                }
                sum.add(&ears.take_patiently(&satellite, Ear::OwnMqtt, found, 60).await.unwrap());
            }
            sum
        })
    };
    let before_kib = resident_kib();
    let mut most_kib = before_kib;
    let mut heard = 0;
    while !flood.is_finished() {
        bench.radio(&heartbeat(4_000_000_000 + heard)).await;
        heard += 1;
        most_kib = most_kib.max(resident_kib());
    }
    let sum = flood.await.unwrap();
    assert_eq!(sum.refused as usize, seconds * 5_000, "{sum:?}");
    assert_eq!((sum.frames + sum.merged) as usize, seconds * 5_000, "{sum:?}");
    assert!(heard > 0);
    let counts = ears.counts().remove(&Ear::OwnMqtt).unwrap().refused;
    assert_eq!(counts.values().sum::<u64>(), sum.refused, "each by its reason: {counts:?}");
    println!("{heard} frames by radio meanwhile, memory grew by {} KiB", most_kib - before_kib);
    assert!(most_kib - before_kib < 48 << 10, "{} KiB", most_kib - before_kib);
}

fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kib| kib.parse().ok()).unwrap_or(0)
}

#[test]
fn a_refusal_names_its_line() {
    let refused = Refused { line: 7, reason: Refusal::TestPacket };
    assert_eq!(refused.to_string(), "line 7: it is a test packet of TinyGS");
}
