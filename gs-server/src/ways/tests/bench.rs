//! A whole server, on a clock that moves only when a test says so, and programs beside it.

use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use mission::reception::SAME_FRAME_US;
use mission::{Clock as _, UtcUs};
use serde_json::Value;
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use crate::clock::{BusyToken, SteppedClock, SteppedOptions, Timer as _, wall_sleep};
use crate::config::Config;
use crate::run::{Ready, Report, RunError, RunOptions, run_with};
use crate::storage::FrameQuery;

/// 2026-09-21T14:13:20Z.
pub(super) const START: UtcUs = UtcUs(1_790_000_000_000_000);

/// The data folder with its configuration; outlives the servers on it.
pub(super) struct Home {
    pub(super) folder: TempDir,
    config: Config,
}

impl Home {
    pub(super) fn new(ears: &str) -> Self {
        Self::within(tempfile::tempdir().unwrap(), ears)
    }

    pub(super) fn within(folder: TempDir, ears: &str) -> Self {
        std::fs::write(folder.path().join("empty.bin"), b"").unwrap();
        let text = format!(
            "[station]\nname = \"roof\"\nclock = \"trust\"\nlatitude_deg = 46.5\nlongitude_deg = 6.6\n\
             [[satellites]]\nname = \"pixelsat-1\"\nnorad_cat_id = 98765\naliases = [\"PixelSat-I\"]\n\
             [[links]]\nname = \"radio\"\nsatellite = \"pixelsat-1\"\nkind = \"replay\"\nfile = \"empty.bin\"\nsimulated = true\n\
             [storage]\nfolder = \"data\"\nreserve_bytes = 65536\n{ears}"
        );
        let config = Config::from_toml(&text, folder.path()).unwrap();
        config.check().unwrap();
        Self { folder, config }
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
        let Ok(ready) = is_ready.await else { panic!("it did not begin: {:?}", task.await) };
        let token = std::fs::read_to_string(self.folder.path().join("data/token")).unwrap();
        Bench { clock, awake, ready, stop, task, token: token.trim().to_owned() }
    }

    pub(super) fn write(&self, name: &str, text: &str) {
        private(self.folder.path(), name, text);
    }
}

/// A file that only its owner reads.
pub(super) fn private(folder: &Path, name: &str, text: &str) {
    use std::os::unix::fs::PermissionsExt as _;
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
}

pub(super) struct Bench {
    pub(super) clock: SteppedClock,
    awake: BusyToken,
    pub(super) ready: Ready,
    stop: CancellationToken,
    task: JoinHandle<Result<Report, RunError>>,
    token: String,
}

impl Bench {
    /// Lets the clock go on for so long.
    pub(super) async fn pass(&mut self, us: u64) {
        let sleep = self.clock.sleep_until(self.clock.now().mono.plus(us));
        self.awake = BusyToken::idle();
        self.awake = sleep.await;
    }

    pub(super) async fn stop(self) {
        self.stop.cancel();
        drop(self.awake);
        self.task.await.unwrap().unwrap();
    }

    pub(super) async fn get(&self, path: &str) -> Value {
        let url = format!("http://{}/api/v1/{path}", self.ready.address).parse().unwrap();
        let client = crate::elements::http_client(&url, Duration::from_secs(10)).unwrap();
        let answer = client.get(url).bearer_auth(&self.token).send().await.unwrap();
        serde_json::from_slice(&answer.bytes().await.unwrap()).unwrap()
    }

    pub(super) async fn post(&self, path: &str, body: &Value) -> Value {
        let url = format!("http://{}/api/v1/{path}", self.ready.address).parse().unwrap();
        let client = crate::elements::http_client(&url, Duration::from_secs(10)).unwrap();
        let request = client.post(url).bearer_auth(&self.token).body(serde_json::to_vec(body).unwrap());
        let request = request.header("content-type", "application/json");
        let request = request.header("idempotency-key", uuid::Uuid::new_v4().to_string());
        serde_json::from_slice(&request.send().await.unwrap().bytes().await.unwrap()).unwrap()
    }

    /// The way of this name, once it is as wanted.
    pub(super) async fn way(&self, name: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let mut last = Value::Null;
        for _ in 0..1_500 {
            let ways = self.get("ears/ways").await;
            last = ways["items"].as_array().unwrap().iter().find(|way| way["name"] == name).cloned().unwrap();
            if wanted(&last) {
                return last;
            }
            wall_sleep(Duration::from_millis(10)).await;
        }
        panic!("it stayed {last}");
    }

    /// Frames, and of the newest how many of ours and how many others heard it.
    pub(super) async fn heard(&self) -> (usize, usize, usize) {
        let store = &self.ready.store;
        let heard = store.frames(&FrameQuery::default()).await.unwrap();
        let Some(newest) = heard.first() else { return (0, 0, 0) };
        let others = store.outside_of(&[newest.frame.id]).await.unwrap();
        (heard.len(), newest.receptions.len(), others.get(&newest.frame.id).map_or(0, Vec::len))
    }

    /// Waits until so many frames are there.
    pub(super) async fn until_heard_count(&self, wanted: usize) {
        let mut found = 0;
        for _ in 0..1_500 {
            let query = FrameQuery {
                page: crate::storage::Page { limit: 1_000, ..Default::default() },
                ..FrameQuery::default()
            };
            found = self.ready.store.frames(&query).await.unwrap().len();
            if found == wanted {
                return;
            }
            wall_sleep(Duration::from_millis(10)).await;
        }
        panic!("{found} frames, wanted {wanted}");
    }

    pub(super) async fn until_heard(&self, wanted: (usize, usize, usize)) {
        let mut found = (0, 0, 0);
        for _ in 0..1_500 {
            found = self.heard().await;
            if found == wanted {
                return;
            }
            wall_sleep(Duration::from_millis(10)).await;
        }
        panic!("heard {found:?}, wanted {wanted:?}; the window is {SAME_FRAME_US} us");
    }
}

/// A port that nobody listens to.
pub(super) fn free_port() -> u16 {
    std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// A program that ends with the test.
pub(super) struct Program(pub(super) Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Debian's mosquitto on this port; `more` goes into its configuration.
pub(super) async fn mosquitto(folder: &Path, port: u16, more: &str) -> Program {
    let config = folder.join("mosquitto.conf");
    std::fs::write(&config, format!("listener {port} 127.0.0.1\npersistence false\n{more}\n")).unwrap();
    // Not in everybody's path.
    let program = if Path::new("/usr/sbin/mosquitto").exists() { "/usr/sbin/mosquitto" } else { "mosquitto" };
    let child = Command::new(program)
        .arg("-c")
        .arg(&config)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap_or_else(|error| panic!("mosquitto: {error}; install it (scripts/setup.sh tools)"));
    let program = Program(child);
    reachable(SocketAddr::from(([127, 0, 0, 1], port))).await;
    program
}

pub(super) async fn reachable(address: SocketAddr) {
    for _ in 0..1_000 {
        if tokio::net::TcpStream::connect(address).await.is_ok() {
            return;
        }
        wall_sleep(Duration::from_millis(10)).await;
    }
    panic!("nobody listens at {address}");
}

/// `mosquitto_pub` with these arguments; whether it was taken.
pub(super) async fn publish(port: u16, topic: &str, message: &str, more: &[&str]) -> bool {
    let mut command = tokio::process::Command::new("mosquitto_pub");
    command.args(["-h", "127.0.0.1", "-p", &port.to_string(), "-t", topic, "-m", message]).args(more);
    command.stderr(Stdio::null()).stdout(Stdio::null());
    command.status().await.unwrap().success()
}

pub(super) fn heartbeat(uptime_ms: u32) -> Vec<u8> {
    let mut payload = [0; 117];
    payload[100..104].copy_from_slice(&21.5_f32.to_be_bytes());
    payload[104..108].copy_from_slice(&uptime_ms.to_be_bytes());
    let contents = [&[6, 0, 0, 117][..], &payload].concat();
    [b"PIXELSAT", &protocol::crc32(&contents).to_be_bytes()[..], &contents].concat()
}

pub(super) fn base64(bytes: &[u8]) -> String {
    use base64::Engine as _;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// What a board says of these bytes, in the order and the form of the firmware.
pub(super) fn rx(bytes: &[u8], board_us: i64) -> String {
    let crc_error = bytes == b"Error_CRC";
    format!(
        "{{\"station_location\":[12.971,77.594],\"mode\":\"LoRa\",\"frequency\":435.0029907,\"frequency_offset\":-310.5,\
         \"satellite\":\"PixelSat-I\",\"sf\":9,\"cr\":5,\"bw\":125,\"iIQ\":false,\"rssi\":-127.5,\"snr\":-11.75,\
         \"frequency_error\":1843.2,\"unix_GS_time\":{},\"usec_time\":{board_us},\"crc_error\":{crc_error},\
         \"data\":\"{}\",\"NORAD\":99999,\"noisy\":false}}",
        board_us / 1_000_000,
        base64(bytes)
    )
}

pub(super) const WELCOME: &str = r#"{"station_location":[12.971,77.594],"tx":false,"time":1790000000,"version":2603242,"git_version":"6dcbf47",
    "sat":"PixelSat-I","ip":"192.168.1.20","modem_conf":"{}","boardTemplate":"","board":9,"mac":"A0B1C2D3E4F5","chip":"ESP32","slot":"app0",
    "idfv":"v5","MD5":"0","radioChip":6,"Mem":160000,"Size":4194304,"pSize":1048576,"seconds":12,"Vbat":1890}"#;
pub(super) const PING: &str =
    r#"{"Vbat":1880,"Mem":150000,"MinMem":120000,"MaxBlk":90000,"RSSI":-61,"radio":0,"InstRSSI":-110.5}"#;
