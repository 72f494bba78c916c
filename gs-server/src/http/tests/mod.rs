//! A real store in a temporary folder and a real engine, heard by a satellite made of bytes.

mod alerts;
mod client;
mod doors;
mod elements;
mod forwards;
mod hostile;
mod lists;
mod openapi;
mod operations;
mod page;
mod people;
mod plans;
mod reads;
mod rehearsals;
mod reports;
mod security;
mod silent;
mod sky;
mod stream;
mod two_persons;
mod writes;

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::{Method, Request, StatusCode, header};
use migrations::cluster::Database;
use mission::{
    Clock, LinkConfig, LinkId, MonoUs, Now, Profile, SatelliteConfig, SatelliteId, Source, StationConfig,
    StationId, UtcUs,
};
use protocol::{ChunkIndex, Downlink, FrameForm, Heartbeat, ImageChunk, ImageInfo, Key, encode_down};
use radio::airtime::{LinkTiming, LoraPhy};
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;
use tower::ServiceExt as _;

use super::{AllowedHosts, HttpState, Identity, Token, router, serve};
use crate::alerts::{AlertsHandle, AlertsParts, AlertsTask, Watched};
use crate::clock::{SystemClock, Timer, wall_sleep};
use crate::config::ClockSetting;
use crate::elements::{ElementsHandle, Wanted};
use crate::engine::{Engine, EngineInbox, EngineMessage, EngineParts, LinkPort, OsEntropy};
use crate::hub::Hub;
use crate::people::{People, PeopleSettings, SessionRules};
use crate::storage::{Postgres, Store, StoreOptions};

const HOST: &str = "127.0.0.1:8700";
const TOKEN: &str = "0123456789abcdef0123456789abcdef";

/// A whole server but for its links.
struct Bench {
    router: Router,
    store: Store,
    hub: Hub,
    inbox: EngineInbox,
    stop: CancellationToken,
    timer: Arc<dyn Timer>,
    people: People,
    /// The clock of people.
    hands: Arc<Hands>,
    alerts: AlertsHandle,
    /// Until it is started.
    alerts_task: Option<AlertsTask>,
    folder: TempDir,
    /// Goes away with the bench.
    _database: Option<Database>,
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.stop.cancel();
    }
}

impl Bench {
    async fn new() -> Self {
        Self::of(station()).await
    }

    async fn of(station: StationConfig) -> Self {
        Self::listening(station, "127.0.0.1:8700".parse().unwrap()).await
    }

    /// With other rules about people.
    async fn with_people(rules: impl FnOnce(&mut PeopleSettings)) -> Self {
        let mut settings = people_settings();
        rules(&mut settings);
        Self::built(station(), HOST.parse().unwrap(), settings, "").await
    }

    /// A bench that watches itself, with these targets (TOML).
    async fn watching(targets: &str) -> Self {
        let mut bench = Self::built(station(), HOST.parse().unwrap(), people_settings(), targets).await;
        let task = bench.alerts_task.take().unwrap();
        task.spawn(&crate::lifecycle::Lifecycle::new(&bench.stop));
        bench
    }

    async fn listening(station: StationConfig, address: std::net::SocketAddr) -> Self {
        Self::built(station, address, people_settings(), "").await
    }

    async fn built(
        station: StationConfig,
        address: std::net::SocketAddr,
        settings: PeopleSettings,
        targets: &str,
    ) -> Self {
        Self::built_on(None, station, address, settings, targets).await
    }

    /// A bench that watches itself, whose archive is a PostgreSQL.
    async fn watching_a_postgres() -> Self {
        let database = Some(Database::fresh().unwrap());
        let address = HOST.parse().unwrap();
        let mut bench = Self::built_on(database, station(), address, people_settings(), "").await;
        let task = bench.alerts_task.take().unwrap();
        task.spawn(&crate::lifecycle::Lifecycle::new(&bench.stop));
        bench
    }

    async fn built_on(
        database: Option<Database>,
        station: StationConfig,
        address: std::net::SocketAddr,
        settings: PeopleSettings,
        targets: &str,
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(StoreOptions {
            folder: folder.path().join("data"),
            station: Some(station.station.clone()),
            simulated: true,
            max_page_count: None,
            postgres: database.as_ref().map(|database| Postgres::new(&database.address().unwrap()).unwrap()),
            reserve_bytes: 1 << 16,
        });
        let store = store.await.unwrap();
        let timer: Arc<dyn Timer> = Arc::new(SystemClock::new());
        let hub = Hub::new();
        let satellites: Vec<SatelliteId> = station.satellites.iter().map(|s| s.id.clone()).collect();
        let keys: Vec<_> = station.satellites.iter().filter_map(|s| s.key.as_ref().map(Key::id)).collect();
        let snapshot = store.snapshot(&satellites, &keys).await.unwrap();
        let (port, mut link) = LinkPort::new(LinkId::new("e22").unwrap());
        let identity = Identity::of(&station, true);
        let watched = Watched::of(&station);
        let config = configuration(folder.path(), targets);
        let (engine, inbox, handle) = Engine::new(EngineParts {
            station,
            snapshot,
            recovered: Vec::new(),
            elsewhere: Vec::new(),
            store: store.clone(),
            timer: Arc::clone(&timer),
            clock: ClockSetting::Trust,
            entropy: Box::new(OsEntropy),
            hub: hub.clone(),
            links: vec![port],
        });
        let hands = Arc::new(Hands::default());
        let clock: Arc<dyn Clock> = Arc::clone(&hands) as Arc<dyn Clock>;
        let station_clock: Arc<dyn Clock> = Arc::clone(&timer) as Arc<dyn Clock>;
        let people = People::open(store.clone(), settings, clock, station_clock).await.unwrap();
        let stop = CancellationToken::new();
        tokio::spawn(engine.run(stop.clone(), stop.clone()));
        // A radio that takes everything and never answers.
        tokio::spawn(async move { while link.recv().await.is_some() {} });
        let wanted = vec![Wanted {
            satellite: SatelliteId::new("pixelsat-1").unwrap(),
            norad_cat_id: Some(25_544),
            object_name: None,
        }];
        let (alerts_task, alerts) = AlertsTask::new(AlertsParts {
            config: &config,
            watched,
            store: store.clone(),
            engine: handle.clone(),
            hub: hub.clone(),
            timer: Arc::clone(&timer),
        })
        .unwrap();
        let state = HttpState {
            ears: crate::ingest::Ears::new(store.clone(), inbox.clone(), Arc::clone(&timer)),
            ways: crate::ways::WaysHandle::none(Arc::clone(&timer)),
            aliases: crate::ingest::Aliases::default(),
            alerts: alerts.clone(),
            forwards: crate::forward::spawn(
                &crate::forward::ForwardParts {
                    config: &config,
                    store: &store,
                    timer: &timer,
                    alerts: Some(&alerts),
                },
                &crate::lifecycle::Lifecycle::new(&stop),
            ),
            elements: ElementsHandle::without_sources(wanted, Arc::clone(&timer)),
            store: store.clone(),
            engine: handle,
            hub: hub.clone(),
            antenna: crate::hamlib::antenna(None, None, &timer).unwrap().0,
            radios: vec![super::RadioOnAir {
                link: LinkId::new("e22").unwrap(),
                satellite: SatelliteId::new("pixelsat-1").unwrap(),
                phy: LoraPhy::LIKELY_2K4,
                frequency_hz: 435_000_000.0,
            }],
            timer: Arc::clone(&timer),
            token: Token::new(TOKEN).unwrap(),
            people: people.clone(),
            identity,
            demo: Some(json!({"speed": 1.0})),
            streams_max: 64,
            stop: stop.clone(),
        };
        let router = router(state, AllowedHosts::new(address, &[HOST.to_owned()]));
        let alerts_task = Some(alerts_task);
        let bench = Self {
            router,
            store,
            hub,
            inbox,
            stop,
            timer,
            people,
            hands,
            alerts,
            alerts_task,
            folder,
            _database: database,
        };
        // The engine tells that it began; tests count from there.
        for _ in 0..500 {
            if bench.store.last_event_seq().await.unwrap() == 1 {
                break;
            }
            wall_sleep(Duration::from_millis(10)).await;
        }
        if bench.people.is_reading_open().await.unwrap() {
            bench.until("/api/v1/station", "/last_sequence", &json!(1)).await;
        }
        bench
    }

    /// Waits until a path shows a value at a JSON pointer: the status follows what was stored a little later.
    async fn until(&self, path: &str, pointer: &str, wanted: &Value) {
        for _ in 0..500 {
            if self.get(path).await.ok().pointer(pointer) == Some(wanted) {
                return;
            }
            wall_sleep(Duration::from_millis(10)).await;
        }
        panic!("{path} never showed {wanted} at {pointer}");
    }

    async fn send(&self, request: Request<Body>) -> Answer {
        let response = self.router.clone().oneshot(request).await.unwrap();
        let (parts, body) = response.into_parts();
        let bytes = to_bytes(body, 1 << 20).await.unwrap();
        Answer { parts, bytes: bytes.to_vec() }
    }

    async fn get(&self, path: &str) -> Answer {
        self.send(request(Method::GET, path).body(Body::empty()).unwrap()).await
    }

    async fn post(&self, path: &str, key: &str, body: &Value) -> Answer {
        self.send(write(path, key).body(Body::from(body.to_string())).unwrap()).await
    }

    async fn delete(&self, path: &str, key: &str) -> Answer {
        let mut request = write(path, key).body(Body::empty()).unwrap();
        *request.method_mut() = Method::DELETE;
        self.send(request).await
    }

    /// An event as the engine stores one.
    async fn hub_event(&self, level: mission::Level) {
        use mission::record::{EventKind, EventRecord, Record, Subject};
        let record = Record::Event(EventRecord {
            at: self.timer.now().utc,
            kind: EventKind::Link,
            level,
            satellite: None,
            station: StationId::new("bench").unwrap(),
            link: Some(LinkId::new("e22").unwrap()),
            key: None,
            subject: Subject::default(),
            message: "link e22 is strange".to_owned(),
        });
        let batch = mission::Batch { id: mission::BatchId(1), records: vec![record] };
        for event in self.store.apply(&batch).await.unwrap() {
            self.hub.publish(event);
        }
    }

    /// Bytes as a radio hands them over.
    async fn hear(&self, packet: &Downlink) {
        let mut frame = [0; 240];
        let length = encode_down(packet, None, FrameForm::Full, &mut frame);
        let mut bytes = frame[..length].to_vec();
        bytes.push(170);
        let link = LinkId::new("e22").unwrap();
        let received = self.timer.now();
        self.inbox.send(EngineMessage::Bytes { link, bytes, source: Source::Radio, received }).await;
    }

    /// Waits until the archive has so many frames.
    async fn frames(&self, count: i64) {
        for _ in 0..500 {
            if self.store.counts().await.unwrap().frames >= count {
                return;
            }
            wall_sleep(Duration::from_millis(10)).await;
        }
        panic!("the archive never had {count} frames");
    }

    /// A bench on a real socket.
    async fn on_a_socket() -> (Self, std::net::SocketAddr) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let bench = Self::listening(station(), address).await;
        tokio::spawn(serve(listener, bench.router.clone(), bench.stop.clone()));
        (bench, address)
    }
}

fn people_settings() -> PeopleSettings {
    // Long, so that other tests may let hours pass; those of sessions take the rules that a server has.
    let session = SessionRules { idle_us: 12 * 3_600_000_000, max_us: 7 * 24 * 3_600_000_000 };
    PeopleSettings { on_loopback: true, station: "bench".to_owned(), session, ..PeopleSettings::default() }
}

/// A clock that goes when it is told to.
#[derive(Default)]
struct Hands(AtomicI64);

impl Hands {
    fn pass_h(&self, hours: f64) {
        self.0.fetch_add((hours * 3.6e9) as i64, Ordering::Relaxed);
    }
}

impl Clock for Hands {
    fn now(&self) -> Now {
        let us = self.0.load(Ordering::Relaxed);
        Now { mono: MonoUs(us.cast_unsigned()), utc: UtcUs(1_795_000_000_000_000 + us) }
    }

    fn is_simulated(&self) -> bool {
        true
    }
}

struct Answer {
    parts: axum::http::response::Parts,
    bytes: Vec<u8>,
}

impl Answer {
    fn status(&self) -> StatusCode {
        self.parts.status
    }

    fn header(&self, name: &str) -> &str {
        self.parts.headers.get(name).map_or("", |value| value.to_str().unwrap())
    }

    fn json(&self) -> Value {
        serde_json::from_slice(&self.bytes)
            .unwrap_or_else(|_| panic!("no JSON: {:?}", String::from_utf8_lossy(&self.bytes)))
    }

    /// The last part of the problem's type; fails when the answer is no problem.
    #[track_caller]
    fn problem(&self) -> String {
        assert_eq!(self.header("content-type"), "application/problem+json", "{:?}", self.status());
        let problem = self.json();
        assert_eq!(problem["status"], self.status().as_u16());
        for field in ["title", "detail", "instance"] {
            assert!(problem[field].as_str().is_some_and(|text| !text.is_empty()), "{field}: {problem}");
        }
        problem["type"].as_str().unwrap().strip_prefix("urn:pixelsat-ground:problem:").unwrap().to_owned()
    }

    #[track_caller]
    fn ok(&self) -> Value {
        assert!(self.status().is_success(), "{}: {}", self.status(), String::from_utf8_lossy(&self.bytes));
        self.json()
    }
}

fn request(method: Method, path: &str) -> axum::http::request::Builder {
    Request::builder().method(method).uri(path).header(header::HOST, HOST)
}

/// A write with everything that it needs.
fn write(path: &str, key: &str) -> axum::http::request::Builder {
    request(Method::POST, path)
        .header(header::AUTHORIZATION, format!("Bearer {TOKEN}"))
        .header(header::CONTENT_TYPE, "application/json")
        .header("idempotency-key", key)
}

/// A configuration for those who want one; the engine gets [`station`].
fn configuration(folder: &std::path::Path, targets: &str) -> crate::config::Config {
    let text = format!(
        "[station]\nname = \"bench\"\n[[satellites]]\nname = \"pixelsat-1\"\n[[links]]\nname = \"e22\"\n\
         satellite = \"pixelsat-1\"\nkind = \"tcp\"\nconnect = \"localhost:9\"\nsimulated = true\n\
         [storage]\nfolder = \"data\"\n{targets}\n\
         [[alerts.rules]]\nkind = \"disk\"\nenabled = false\n[[alerts.rules]]\nkind = \"link\"\nenabled = false\n"
    );
    crate::config::Config::from_toml(&text, folder).unwrap()
}

fn station() -> StationConfig {
    let satellite = SatelliteId::new("pixelsat-1").unwrap();
    StationConfig {
        station: StationId::new("bench").unwrap(),
        site: None,
        times: Default::default(),
        satellites: vec![SatelliteConfig {
            id: satellite.clone(),
            profile: Profile::default(),
            key: Some(Key::from_bytes([7; 16])),
            limits: Vec::new(),
        }],
        links: vec![LinkConfig {
            id: LinkId::new("e22").unwrap(),
            satellite,
            timing: LinkTiming { phy: LoraPhy::LIKELY_2K4, baud: 9600, turn_round_us: 100_000 },
            armed: true,
            receive_only: false,
        }],
    }
}

fn heartbeat(temp_c: f32) -> Downlink {
    Downlink::Heartbeat(Heartbeat {
        r_teme_km: [6878.0, -120.5, 33.25],
        v_teme_km_s: [0.1, 7.6, 0.02],
        mag_t: [2.1e-5, -1.4e-5, f32::NAN],
        omega_rad_s: [0.0012, -0.0034, 0.0101],
        accel_m_s2: [0.0, 0.001, -0.002],
        css: [0.91, 0.0, 0.13, 0.0, 0.0, 0.42],
        att_mrp: [0.11, -0.2, 0.31],
        rad: 3.5,
        temp_c,
        uptime_ms: 9_876_543,
        timestamp_ms: 1_795_324_765_123,
        cam: true,
    })
}

fn image_info(size_bytes: u32) -> Downlink {
    Downlink::ImageInfo(ImageInfo {
        exists: true,
        chunks: size_bytes.div_ceil(222),
        size_bytes,
        width_px: 408,
        height_px: 304,
    })
}

fn chunk(file: &[u8], index: u16) -> Downlink {
    let mut data = [0; 222];
    for (to, from) in data.iter_mut().zip(file.iter().skip(usize::from(index) * 222)) {
        *to = *from;
    }
    Downlink::ImageChunk(ImageChunk { index: ChunkIndex(index), data })
}
