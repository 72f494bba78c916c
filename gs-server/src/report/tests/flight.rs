//! A whole server through a pass, on a clock that moves only when the test says so: the report is written by itself.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use mission::record::{ElementsRecord, Record};
use mission::{
    Batch, BatchId, Clock as _, ElementsId, LinkId, MonoUs, PassAhead, Principal, SatelliteId, Source,
    StationId, UtcUs,
};
use protocol::{FrameForm, encode_down};
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::archive::{MIDNIGHT_US, S, heartbeat, iss};
use crate::clock::{BusyToken, SteppedClock, SteppedOptions, Timer as _, wall_sleep};
use crate::config::Config;
use crate::engine::EngineMessage;
use crate::run::{Ready, Report, RunError, RunOptions, run_with};
use crate::storage::{Store, StoreOptions};

const STATION: &str = "[station]\nname = \"roof\"\nclock = \"trust\"\nlatitude_deg = 46.5\nlongitude_deg = 6.6\n\
    min_elevation_deg = 5.0\n[[satellites]]\nname = \"iss\"\nnorad_cat_id = 25544\n[[links]]\nname = \"file\"\n\
    satellite = \"iss\"\nkind = \"replay\"\nfile = \"empty.bin\"\nsimulated = true\n[storage]\nfolder = \"data\"\n\
    reserve_bytes = 65536\n";

struct Server {
    clock: SteppedClock,
    awake: BusyToken,
    ready: Ready,
    stop: CancellationToken,
    task: JoinHandle<Result<Report, RunError>>,
}

impl Server {
    async fn start(config: &Config, at: UtcUs) -> Self {
        let clock = SteppedClock::new(SteppedOptions { utc_at_origin: at, speed: None }).unwrap();
        let awake = clock.busy("test");
        let (ready, is_ready) = tokio::sync::oneshot::channel();
        let options = RunOptions {
            timer: Some(Arc::new(clock.clone())),
            ready: Some(ready),
            ..RunOptions::new(config.clone())
        };
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let stop = CancellationToken::new();
        let task = tokio::spawn(run_with(options, listener, stop.clone()));
        let ready = is_ready.await.unwrap();
        Self { clock, awake, ready, stop, task }
    }

    /// Time passes until the clock shows this; everything that is due meanwhile happens.
    async fn until(&mut self, at_us: i64) {
        let now = self.clock.now();
        let wait_us = at_us.checked_sub(now.utc.0).unwrap().max(0).unsigned_abs();
        let sleep = self.clock.sleep_until(MonoUs(now.mono.0 + wait_us));
        self.awake = BusyToken::idle();
        self.awake = sleep.await;
    }

    /// A heartbeat comes out of the radio.
    async fn hear(&self) {
        let mut frame = [0; 240];
        let length = encode_down(&heartbeat(), None, FrameForm::Full, &mut frame);
        let mut bytes = frame[..length].to_vec();
        bytes.push(170);
        let link = LinkId::new("file").unwrap();
        let received = self.clock.now();
        self.ready.inbox.send(EngineMessage::Bytes { link, bytes, source: Source::Radio, received }).await;
    }

    async fn end(self) {
        self.stop.cancel();
        drop(self.awake);
        self.task.await.unwrap().unwrap();
    }
}

async fn next_pass(server: &mut Server) -> PassAhead {
    for _ in 0..1000 {
        let status = server.ready.engine.status();
        let sky = status.satellites.first().and_then(|satellite| satellite.sky.as_ref());
        if let Some(pass) = sky.and_then(|sky| sky.passes.first()) {
            return *pass;
        }
        wall_sleep(Duration::from_millis(10)).await;
        let soon = server.clock.now().utc.0 + 10_000;
        server.until(soon).await;
    }
    panic!("the station never told passes");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_report_is_written_a_minute_after_los_and_again_when_it_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("empty.bin"), b"").unwrap();
    let config = Config::from_toml(STATION, folder.path()).unwrap();
    let options = StoreOptions {
        folder: folder.path().join("data"),
        station: Some(StationId::new("roof").unwrap()),
        simulated: true,
        max_page_count: None,
        postgres: None,
        reserve_bytes: 0,
    };
    let store = Store::open(options).await.unwrap();
    let elements = Record::Elements(ElementsRecord {
        id: ElementsId(1),
        satellite: SatelliteId::new("iss").unwrap(),
        station: StationId::new("roof").unwrap(),
        source: "test".to_owned(),
        added_at: UtcUs(MIDNIGHT_US),
        who: Principal::new("ada"),
        elements: Arc::new(iss()),
    });
    store.apply(&Batch { id: BatchId(1), records: vec![elements] }).await.unwrap();
    store.close().await.unwrap();
    drop(store);

    let mut server = Server::start(&config, UtcUs(MIDNIGHT_US)).await;
    let pass = next_pass(&mut server).await;
    let (aos, los) = (pass.aos_at.0, pass.los_at.unwrap().0);
    for minute in [1, 2] {
        server.until(aos + minute * 60 * S).await;
        server.hear().await;
    }
    let reports = folder.path().join("data/reports");
    let files = || -> Vec<PathBuf> {
        let Ok(found) = std::fs::read_dir(&reports) else { return Vec::new() };
        let mut files: Vec<_> = found.map(|file| file.unwrap().path()).collect();
        files.sort();
        files
    };
    server.until(los + 59 * S).await;
    assert!(files().is_empty(), "{:?}", files());
    // Events carry no hold on the clock, so the task may look a little late.
    for second in 61..300 {
        server.until(los + second * S).await;
        if files().len() == 2 {
            break;
        }
        wall_sleep(Duration::from_millis(10)).await;
    }
    let written = files();
    assert_eq!(written.len(), 2, "{written:?}");
    let page = std::fs::read_to_string(&written[0]).unwrap();
    assert!(page.contains("Pass 1 of iss over roof") && page.contains("SIMULATED"), "{page}");
    let text = std::fs::read_to_string(&written[1]).unwrap();
    assert!(text.contains("- Frames: 2 (480 bytes)"), "{text}");
    assert!(text.contains("| 0° to 10° |"), "elevations are known: {text}");
    let at = server.clock.now().utc;
    server.end().await;

    // What is missing is made again by the next life, and is the same.
    std::fs::remove_file(&written[0]).unwrap();
    std::fs::remove_file(&written[1]).unwrap();
    let mut server = Server::start(&config, UtcUs(at.0 + 600 * S)).await;
    for second in 600..900 {
        server.until(at.0 + second * S).await;
        if files() == written {
            break;
        }
        wall_sleep(Duration::from_millis(10)).await;
    }
    assert_eq!(files(), written);
    assert_eq!(std::fs::read_to_string(&written[0]).unwrap(), page);
    assert_eq!(std::fs::read_to_string(&written[1]).unwrap(), text);
    server.end().await;
}
