//! A server in a test: its folder, its pseudo-terminal, its start and its end.
#![expect(dead_code, reason = "each test file takes what it needs")]

use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use gs_server::config::Config;
use gs_server::run::{Ready, Report, RunError, RunOptions, run_with};
use mission::{LinkState, Status};
use protocol::{Downlink, FRAME_LEN, FrameForm, Heartbeat};
use serialport::TTYPort;
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

#[expect(clippy::disallowed_methods, reason = "these tests watch a real server from outside")]
pub async fn pause(duration: Duration) {
    tokio::time::sleep(duration).await;
}

#[expect(clippy::disallowed_methods, reason = "these tests watch a real server from outside")]
pub fn wall() -> Instant {
    Instant::now()
}

/// Waits until something holds; fails after `limit`. How long it took.
pub async fn until(what: &str, limit: Duration, mut holds: impl AsyncFnMut() -> bool) -> Duration {
    let began = wall();
    while !holds().await {
        assert!(began.elapsed() < limit, "after {limit:?} still not: {what}");
        pause(Duration::from_millis(5)).await;
    }
    began.elapsed()
}

/// A pseudo-terminal behind a path that stays the same when the terminal is another.
pub struct Pty {
    pub master: TTYPort,
    _slave: TTYPort,
}

impl Pty {
    pub fn at(link: &Path) -> Self {
        use serialport::SerialPort as _;
        let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        master.set_timeout(Duration::from_millis(20)).expect("a time-out");
        let name = slave.name().expect("a name");
        let _ = std::fs::remove_file(link);
        std::os::unix::fs::symlink(name, link).expect("a link");
        Self { master, _slave: slave }
    }

    /// What arrived within the time-out.
    pub fn read(&mut self) -> Vec<u8> {
        let mut buffer = [0; 1024];
        self.master.read(&mut buffer).map(|count| buffer[..count].to_vec()).unwrap_or_default()
    }

    pub fn write(&mut self, bytes: &[u8]) {
        self.master.write_all(bytes).expect("the terminal takes bytes");
    }
}

/// A heartbeat with this uptime, as it stands on the wire.
pub fn heartbeat(uptime_ms: u32) -> Vec<u8> {
    let beat = Heartbeat {
        r_teme_km: [6_800.0, 0.0, 0.0],
        v_teme_km_s: [0.0, 7.6, 0.0],
        mag_t: [0.0; 3],
        omega_rad_s: [0.0; 3],
        accel_m_s2: [0.0; 3],
        css: [0.0; 6],
        att_mrp: [0.0; 3],
        rad: 0.0,
        temp_c: 20.0,
        uptime_ms,
        timestamp_ms: 0,
        cam: false,
    };
    let mut frame = [0; FRAME_LEN];
    let length = protocol::encode_down(&Downlink::Heartbeat(beat), None, FrameForm::Full, &mut frame);
    frame[..length].to_vec()
}

/// A configuration of one strapped pseudo-terminal with a simulated key, in a folder of its own.
pub struct Folder {
    pub dir: TempDir,
}

impl Folder {
    pub fn new() -> Self {
        let dir = tempfile::tempdir().expect("a folder");
        let mut key = *b"0123456789abcdef";
        gs_server::keys::create(&dir.path().join("test.key"), &mut key, true).expect("a key");
        Self { dir }
    }

    pub fn port(&self) -> PathBuf {
        self.dir.path().join("port")
    }

    pub fn config(&self, link_extra: &str) -> Config {
        let text = format!(
            r#"
            [station]
            name = "test"
            [[satellites]]
            name = "sat"
            key_file = "test.key"
            [[links]]
            name = "pty"
            satellite = "sat"
            kind = "serial"
            port = "{}"
            simulated = true
            rssi = false
            armed = true
            aux = "absent"
            {link_extra}
            [storage]
            folder = "data"
            reserve_bytes = 65536
            "#,
            self.port().display()
        );
        Config::from_toml(&text, self.dir.path()).expect("a configuration")
    }

    pub fn strapped(&self) -> Config {
        self.config("mode_pins = \"strapped\"\ntransmit_unverified = true")
    }
}

/// A server that runs.
pub struct Server {
    pub ready: Ready,
    pub stop: CancellationToken,
    pub task: JoinHandle<Result<Report, RunError>>,
}

impl Server {
    pub async fn start(mut options: RunOptions) -> Result<Self, RunError> {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let (told, ready) = oneshot::channel();
        options.ready = Some(told);
        let stop = CancellationToken::new();
        let mut task = tokio::spawn(run_with(options, listener, stop.clone()));
        tokio::select! {
            Ok(ready) = ready => Ok(Self { ready, stop, task }),
            ended = &mut task => Err(ended.expect("no panic").expect_err("it was not ready")),
        }
    }

    pub fn status(&self) -> std::sync::Arc<Status> {
        self.ready.engine.status()
    }

    pub fn link(&self) -> LinkState {
        self.status().links[0].state.clone()
    }

    pub async fn until_link(&self, what: &str, limit: Duration, holds: impl Fn(&LinkState) -> bool) -> Duration {
        until(what, limit, async || holds(&self.link())).await
    }

    pub async fn stop(self) -> (Duration, Report) {
        let began = wall();
        self.stop.cancel();
        let report = self.task.await.expect("no panic").expect("a clean end");
        (began.elapsed(), report)
    }
}
