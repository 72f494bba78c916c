//! A server in a test: its folder, its pseudo-terminal, its start and its end.

use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use gs_server::config::Config;
use gs_server::run::{Ready, Report, RunError, RunOptions, run_with};
use mission::{CommandIntent, Gate, Intent, LinkState, SatelliteId, Status};
use protocol::{Downlink, FRAME_LEN, FrameForm, Heartbeat, Telecommand};
use serialport::TTYPort;
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

#[expect(clippy::disallowed_methods, reason = "these tests watch a real server from outside")]
pub(crate) async fn pause(duration: Duration) {
    tokio::time::sleep(duration).await;
}

#[expect(clippy::disallowed_methods, reason = "these tests watch a real server from outside")]
pub(crate) fn wall() -> Instant {
    Instant::now()
}

/// Waits until something holds; fails after `limit`. How long it took.
pub(crate) async fn until(what: &str, limit: Duration, mut holds: impl AsyncFnMut() -> bool) -> Duration {
    let began = wall();
    while !holds().await {
        assert!(began.elapsed() < limit, "after {limit:?} still not: {what}");
        pause(Duration::from_millis(5)).await;
    }
    began.elapsed()
}

/// A pseudo-terminal behind a path that stays the same when the terminal is another.
pub(crate) struct Pty {
    pub(crate) master: TTYPort,
    _slave: TTYPort,
}

impl Pty {
    pub(crate) fn at(link: &Path) -> Self {
        use serialport::SerialPort as _;
        let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        master.set_timeout(Duration::from_millis(20)).expect("a time-out");
        let name = slave.name().expect("a name");
        let _ = std::fs::remove_file(link);
        std::os::unix::fs::symlink(name, link).expect("a link");
        Self { master, _slave: slave }
    }

    /// What arrived within the time-out.
    pub(crate) fn read(&mut self) -> Vec<u8> {
        let mut buffer = [0; 1024];
        self.master.read(&mut buffer).map(|count| buffer[..count].to_vec()).unwrap_or_default()
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) {
        self.master.write_all(bytes).expect("the terminal takes bytes");
    }
}

/// A heartbeat with this uptime, as it stands on the wire.
pub(crate) fn heartbeat(uptime_ms: u32) -> Vec<u8> {
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

/// A Ping for the satellite.
pub(crate) fn ping() -> Intent {
    Intent::Command(CommandIntent {
        satellite: SatelliteId::new("sat").expect("a name"),
        link: None,
        telecommand: Telecommand::Ping,
        priority: 0,
        when: None,
        gate: Gate::Heard,
        expires_at: None,
        attempts_allowed: None,
        confirmation: None,
    })
}

/// A configuration of one strapped pseudo-terminal with a simulated key, in a folder of its own.
pub(crate) struct Folder {
    pub(crate) dir: TempDir,
}

impl Folder {
    pub(crate) fn new() -> Self {
        let dir = tempfile::tempdir().expect("a folder");
        let mut key = *b"0123456789abcdef";
        gs_server::keys::create(&dir.path().join("test.key"), &mut key, true).expect("a key");
        Self { dir }
    }

    pub(crate) fn port(&self) -> PathBuf {
        self.dir.path().join("port")
    }

    pub(crate) fn config(&self, link_extra: &str) -> Config {
        let text = format!(
            r#"
            [station]
            name = "test"
            clock = "trust"
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

    pub(crate) fn strapped(&self) -> Config {
        self.config("mode_pins = \"strapped\"\ntransmit_unverified = true")
    }
}

/// A server that runs.
pub(crate) struct Server {
    pub(crate) ready: Ready,
    pub(crate) stop: CancellationToken,
    pub(crate) task: JoinHandle<Result<Report, RunError>>,
}

impl Server {
    pub(crate) async fn start(mut options: RunOptions) -> Result<Self, RunError> {
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

    pub(crate) fn status(&self) -> std::sync::Arc<Status> {
        self.ready.engine.status()
    }

    pub(crate) fn link(&self) -> LinkState {
        self.status().links[0].state.clone()
    }

    pub(crate) async fn until_link(
        &self,
        what: &str,
        limit: Duration,
        holds: impl Fn(&LinkState) -> bool,
    ) -> Duration {
        until(what, limit, async || holds(&self.link())).await
    }

    pub(crate) async fn stop(self) -> (Duration, Report) {
        let began = wall();
        self.stop.cancel();
        let report = self.task.await.expect("no panic").expect("a clean end");
        (began.elapsed(), report)
    }
}
