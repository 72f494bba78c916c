//! A whole server on a clock that moves only when a test says so.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use api::ElementsSource;
use mission::{Clock as _, MonoUs, UtcUs};
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use crate::clock::{BusyToken, SteppedClock, SteppedOptions, Timer as _, wall_sleep};
use crate::config::Config;
use crate::run::{Ready, Report, RunError, RunOptions, run_with};

pub(super) const HOUR_US: i64 = 3_600_000_000;
/// A day after the epoch of [`iss`].
pub(super) const START: UtcUs = UtcUs(1_594_675_000_000_000);

/// Elements of object 25544 with this epoch, in days of 2020.
pub(super) fn iss(day: f64) -> String {
    let epoch = tle::UtcInstant::from_unix_us(1_577_836_800_000_000).plus_seconds((day - 1.0) * 86_400.0);
    format!(
        r#"{{"OBJECT_NAME":"ISS (ZARYA)","OBJECT_ID":"1998-067A","EPOCH":"{}","MEAN_MOTION":15.49507896,
        "ECCENTRICITY":0.0001413,"INCLINATION":51.6461,"RA_OF_ASC_NODE":221.2784,"ARG_OF_PERICENTER":89.1723,
        "MEAN_ANOMALY":280.4612,"EPHEMERIS_TYPE":0,"CLASSIFICATION_TYPE":"U","NORAD_CAT_ID":25544,
        "ELEMENT_SET_NO":999,"REV_AT_EPOCH":23600,"BSTAR":-0.000031515,"MEAN_MOTION_DOT":-0.00002218,"MEAN_MOTION_DDOT":0}}"#,
        epoch.to_string().trim_end_matches('Z')
    )
}

/// A group: ours with this epoch, and a stranger.
pub(super) fn group(day: f64) -> String {
    let stranger = iss(day).replace("25544", "43550").replace("ISS (ZARYA)", "OTHER");
    format!("[{stranger},{}]", iss(day))
}

/// The data folder with its configuration; outlives the servers on it.
pub(super) struct Home {
    pub(super) folder: TempDir,
    config: Config,
}

impl Home {
    pub(super) fn new(fetch: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("empty.bin"), b"").unwrap();
        let text = format!(
            "[station]\nname = \"roof\"\nclock = \"trust\"\nlatitude_deg = 46.5\nlongitude_deg = 6.6\n\
             [[satellites]]\nname = \"iss\"\nnorad_cat_id = 25544\n[[links]]\nname = \"file\"\nsatellite = \"iss\"\n\
             kind = \"replay\"\nfile = \"empty.bin\"\nsimulated = true\n[storage]\nfolder = \"data\"\nreserve_bytes = 65536\n\
             [elements]\nfetch = [{fetch}]\n"
        );
        let config = Config::from_toml(&text, folder.path()).unwrap();
        config.check().unwrap();
        Self { folder, config }
    }

    pub(super) fn data(&self) -> std::path::PathBuf {
        self.folder.path().join("data")
    }

    /// A server whose clock shows this.
    pub(super) async fn serve(&self, at: UtcUs) -> Bench {
        let clock = SteppedClock::new(SteppedOptions { utc_at_origin: at, speed: None }).unwrap();
        let awake = clock.busy("test");
        let (ready, is_ready) = tokio::sync::oneshot::channel();
        let options = RunOptions {
            timer: Some(Arc::new(clock.clone())),
            ready: Some(ready),
            ..RunOptions::new(self.config.clone())
        };
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let stop = CancellationToken::new();
        let task = tokio::spawn(run_with(options, listener, stop.clone()));
        let ready = is_ready.await.unwrap();
        Bench { clock, awake, ready, stop, task }
    }
}

pub(super) struct Bench {
    clock: SteppedClock,
    awake: BusyToken,
    pub(super) ready: Ready,
    stop: CancellationToken,
    task: JoinHandle<Result<Report, RunError>>,
}

impl Bench {
    pub(super) fn now(&self) -> UtcUs {
        self.clock.now().utc
    }

    /// Time passes; everything that is due meanwhile happens.
    pub(super) async fn advance(&mut self, us: i64) {
        let at = MonoUs(self.clock.now().mono.0 + us.unsigned_abs());
        let sleep = self.clock.sleep_until(at);
        self.awake = BusyToken::idle();
        self.awake = sleep.await;
    }

    pub(super) async fn end(self) -> UtcUs {
        let at = self.now();
        self.stop.cancel();
        drop(self.awake);
        self.task.await.unwrap().unwrap();
        at
    }

    /// Waits in wall time; the clock moves by 10 ms at each look, for what is due at once.
    pub(super) async fn until<T>(&mut self, what: &str, mut look: impl FnMut(&Ready) -> Option<T>) -> T {
        for _ in 0..3000 {
            if let Some(found) = look(&self.ready) {
                return found;
            }
            self.advance(10_000).await;
            wall_sleep(Duration::from_millis(10)).await;
        }
        panic!("never: {what}");
    }

    /// Waits until the elements in use have this epoch (day of 2020).
    pub(super) async fn until_epoch(&mut self, day: f64) {
        let wanted = 1_577_836_800_000_000 + ((day - 1.0) * 86_400e6) as i64;
        self.until("the new elements are in use", |ready| {
            let status = ready.engine.status();
            let sky = status.satellites[0].sky.as_ref()?;
            (sky.elements.elements.epoch.unix_us() == wanted).then_some(())
        })
        .await;
    }

    /// What the API says of the only source, once it stands as wanted.
    pub(super) async fn source(&mut self, wanted: impl Fn(&ElementsSource) -> bool) -> ElementsSource {
        let mut last = String::new();
        for _ in 0..1000 {
            last = self.ask("GET", "elements/sources", "").await;
            let page: api::Page<ElementsSource> = serde_json::from_str(&last).unwrap();
            if let Some(source) = page.items.into_iter().next().filter(&wanted) {
                return source;
            }
            self.advance(10_000).await;
            wall_sleep(Duration::from_millis(10)).await;
        }
        panic!("the source never stood as wanted: {last}");
    }

    pub(super) async fn fetch(&self) -> api::FetchReport {
        serde_json::from_str(&self.ask("POST", "elements/fetch", "{}").await).unwrap()
    }

    pub(super) async fn ask(&self, method: &str, path: &str, body: &str) -> String {
        let token = std::fs::read_to_string(self.ready.store.folder().join("token")).unwrap();
        let url = format!("http://{}/api/v1/{path}", self.ready.address);
        let url = reqwest::Url::parse(&url).unwrap();
        let client = super::super::client::http_client(&url, Duration::from_secs(30)).unwrap();
        let request = client
            .request(method.parse().unwrap(), url)
            .header("authorization", format!("Bearer {}", token.trim()))
            .header("idempotency-key", uuid::Uuid::new_v4().to_string())
            .header("content-type", "application/json")
            .body(body.to_owned());
        request.send().await.unwrap().text().await.unwrap()
    }
}

/// Everything that lies in a folder, as text.
pub(super) fn everything_in(folder: &Path) -> String {
    let mut text = String::new();
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            text += &everything_in(&path);
        } else {
            text += &String::from_utf8_lossy(&std::fs::read(path).unwrap());
        }
    }
    text
}
