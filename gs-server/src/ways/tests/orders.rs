//! Five ways in each of their 120 orders, on both databases, now and then with a restart between two of them.

use mission::reception::Ear;
use mission::{LinkId, SatelliteId, Source, UtcUs};
use tempfile::TempDir;

use super::bench::{base64, heartbeat, rx as board};
use crate::clock::wall_sleep;
use crate::config::Config;
use crate::elements::Offline;
use crate::engine::EngineMessage;
use crate::ingest::formats::{self, Context, Format, Topic};
use crate::ingest::{Aliases, Ears, Outcome};
use crate::storage::{FrameQuery, ReceiversQuery};

struct Station {
    config: Config,
    open: Option<Offline>,
    satellite: SatelliteId,
    _folder: TempDir,
}

impl Station {
    async fn new(database: Option<&str>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let database = database.map(|address| format!("database = \"{address}\"\n")).unwrap_or_default();
        let text = format!(
            "[station]\nname = \"roof\"\nclock = \"trust\"\n[[satellites]]\nname = \"pixelsat-1\"\naliases = [\"PixelSat-I\"]\n\
             [[links]]\nname = \"radio\"\nsatellite = \"pixelsat-1\"\nkind = \"tcp\"\nconnect = \"localhost:9\"\nsimulated = true\n\
             [storage]\nfolder = \"data\"\nreserve_bytes = 65536\n{database}"
        );
        let config = Config::from_toml(&text, folder.path()).unwrap();
        config.check().unwrap();
        let satellite = SatelliteId::new("pixelsat-1").unwrap();
        let mut station = Self { config, open: None, satellite, _folder: folder };
        station.restart().await;
        station
    }

    async fn restart(&mut self) {
        if let Some(open) = self.open.take() {
            open.close().await.unwrap();
        }
        self.open = Some(Offline::open(&self.config).await.unwrap());
    }

    fn open(&self) -> &Offline {
        self.open.as_ref().unwrap()
    }

    fn now(&self) -> UtcUs {
        self.open().timer.now().utc
    }

    async fn heard(&self) -> (usize, usize, usize) {
        let store = &self.open().door.store;
        let heard = store.frames(&FrameQuery::default()).await.unwrap();
        let Some(newest) = heard.first() else { return (0, 0, 0) };
        let others = store.outside_of(&[newest.frame.id]).await.unwrap();
        (heard.len(), newest.receptions.len(), others.get(&newest.frame.id).map_or(0, Vec::len))
    }

    async fn by(&self, way: usize, frame: &[u8], at: UtcUs) {
        let open = self.open();
        let context = Context::file(Aliases::of(&self.config).admission(&self.satellite, self.now()));
        let found = match way {
            0 => {
                let (_, before, _) = self.of(frame).await;
                let link = LinkId::new("radio").unwrap();
                let bytes = frame.to_vec();
                open.inbox
                    .send(EngineMessage::Bytes {
                        link,
                        bytes,
                        source: Source::Radio,
                        received: open.timer.now(),
                    })
                    .await;
                while self.of(frame).await.1 == before {
                    wall_sleep(std::time::Duration::from_millis(1)).await;
                }
                return;
            }
            1 => {
                let topic = Topic::parse("tinygs/team/roof/tele/rx").unwrap();
                formats::rx(
                    &topic,
                    board(frame, at.0).as_bytes(),
                    &Context { arrived: Some(self.now()), ..context },
                )
            }
            2 => {
                let id = hex::encode(&frame[8..12]);
                let packet = format!(
                    r#"{{"packets":[{{"id":"{id}","serverTime":{},"raw":"{}"}}]}}"#,
                    at.0 / 1_000 + 3_000,
                    base64(frame)
                );
                formats::message(packet.as_bytes(), &context)
            }
            3 => {
                let stamp = jiff::Timestamp::from_microsecond(at.0 - 2_000_000).unwrap();
                let row = format!(
                    r#"[{{"frame":"{}","observer":"DL0XYZ-JO62qn","timestamp":"{stamp}"}}]"#,
                    hex::encode(frame)
                );
                formats::message(row.as_bytes(), &context)
            }
            _ => {
                let mut kiss = vec![0xC0, 0];
                for byte in frame {
                    match byte {
                        0xC0 => kiss.extend([0xDB, 0xDC]),
                        0xDB => kiss.extend([0xDB, 0xDD]),
                        byte => kiss.push(*byte),
                    }
                }
                kiss.push(0xC0);
                formats::receptions(Format::Kiss, &kiss[..], &context).map(Result::unwrap).collect()
            }
        };
        let ears = Ears::new(open.door.store.clone(), open.inbox.clone(), open.timer.clone());
        let outcome = ears.take(&self.satellite, Ear::File, found).await.unwrap();
        assert_eq!(outcome.frames + outcome.merged, 1, "{:?}", Outcome::default());
    }

    /// Frames of these bytes, and who heard the newest of them.
    async fn of(&self, frame: &[u8]) -> (usize, usize, usize) {
        let store = &self.open().door.store;
        let heard = store.frames(&FrameQuery::default()).await.unwrap();
        let same: Vec<_> = heard.iter().filter(|heard| heard.frame.bytes == frame).collect();
        (same.len(), same.first().map_or(0, |heard| heard.receptions.len()), 0)
    }
}

/// All orders of 0 to 4.
fn orders() -> Vec<Vec<usize>> {
    let mut orders = vec![Vec::new()];
    for _ in 0..5 {
        let longer = |order: &Vec<usize>| {
            let order = order.clone();
            (0..5)
                .filter(|way| !order.contains(way))
                .map(|way| [&order[..], &[way]].concat())
                .collect::<Vec<_>>()
        };
        orders = orders.iter().flat_map(longer).collect();
    }
    orders
}

async fn all_orders(database: Option<&str>) {
    let mut station = Station::new(database).await;
    let orders = orders();
    assert_eq!(orders.len(), 120);
    for (number, order) in orders.iter().enumerate() {
        let frame = heartbeat(number as u32 * 1_000 + 7);
        let at = station.now();
        for (place, way) in order.iter().enumerate() {
            station.by(*way, &frame, at).await;
            if number % 8 == 0 && place == number / 8 % 5 {
                station.restart().await;
            }
        }
        assert_eq!(station.heard().await, ((number + 1).min(100), 1, 4), "{order:?}");
    }
    let receivers = station.open().door.store.receivers(&ReceiversQuery::default()).await.unwrap();
    let told: Vec<_> = receivers.iter().map(|who| (who.id.as_str(), who.frames, who.median_snr_db)).collect();
    assert!(
        told.contains(&("team/roof", 120, Some(-11.75))) && told.contains(&("DL0XYZ-JO62qn", 120, None)),
        "{told:?}"
    );
    assert_eq!(receivers.iter().find(|who| who.id == "team/roof").unwrap().place, Some((12.971, 77.594)));
    station.open.take().unwrap().close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn five_ways_in_any_of_120_orders_are_one_frame_on_sqlite() {
    all_orders(None).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn five_ways_in_any_of_120_orders_are_one_frame_on_postgres() {
    let database = migrations::cluster::Database::fresh().unwrap();
    all_orders(Some(&database.address().unwrap())).await;
}
