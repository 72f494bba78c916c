//! Sets the stage: the data folder, the twin on its thread, the server in its task.

use std::os::unix::fs::DirBuilderExt as _;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use mission::{Entropy as _, Intent, LinkId, Principal, SatelliteId, UtcUs};
use radio::model::ModelConfig;
use satellite::{Device, DeviceConfig, Orbit, PassProfile, Sky, TwinConfig};
use sha2::{Digest as _, Sha256};
use tle::UtcInstant;
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot};
use tokio::task;
use tokio_util::sync::{CancellationToken, DropGuard};
use zeroize::Zeroizing;

use super::{DemoError, DemoOptions, Stage};
use crate::clock::{BusyToken, SteppedClock, SteppedOptions, Timer, Wire};
use crate::config::Config;
use crate::engine::SeededEntropy;
use crate::http::Token;
use crate::keys::{self, KeyFile};
use crate::run::{Ready, Report, RunError, RunOptions, run_with};
use crate::twin::{Ask, End, JournalFile, Player, Pty, TwinError, View};

/// Where a satellite's time begins: 2027-03-20T12:00:00Z, in microseconds since 1970.
const BIRTH_US: i64 = 1_805_544_000_000_000;
/// A demo that goes on with an older folder begins this long after the last thing that happened in it.
const PAUSE_US: u64 = 120_000_000;
/// A new satellite culminates this long after its time began: its first pass begins some twenty seconds after it.
const FIRST_CULMINATION_US: i64 = 350_000_000;

const CONFIG: &str = r#"
[station]
name = "demo"

[[satellites]]
name = "pixelsat-1"
key_file = "twin.key"

[[satellites.limits]]
parameter = "heartbeat.temp"
below = { warning = -15.0, critical = -25.0 }
above = { warning = 45.0, critical = 60.0 }
deadband = 1.0

[[links]]
name = "e22"
satellite = "pixelsat-1"
kind = "serial"
port = "radio"
mode_pins = "software"
aux = "absent"
rssi = true
simulated = true
armed = true

[storage]
folder = "ground"
"#;

/// Everything that a showing needs.
pub(super) struct Scene {
    pub(super) stage: Stage,
    pub(super) clock: SteppedClock,
    pub(super) timer: Arc<dyn Timer>,
    pub(super) ready: Ready,
    pub(super) asks: mpsc::Sender<Ask>,
    /// What the satellite's scale showed when the clock showed 0.
    pub(super) start_us: u64,
    /// The satellite in the station's sky, on its own scale.
    pub(super) sky: Sky,
    /// Wall time at the beginning.
    pub(super) wall: crate::clock::SystemClock,
    /// The server or the twin has ended.
    pub(super) ended: CancellationToken,
    starting: Mutex<Option<BusyToken>>,
    stop: CancellationToken,
    twin_stop: DropGuard,
    server: task::JoinHandle<Result<Report, RunError>>,
    twin: JoinHandle<Result<View, TwinError>>,
}

impl Scene {
    pub(super) async fn set(options: &DemoOptions) -> Result<Self, DemoError> {
        let wall = crate::clock::SystemClock::new();
        make_folder(&options.data)?;
        let data = std::fs::canonicalize(&options.data)
            .map_err(|source| DemoError::Folder { path: options.data.clone(), source })?;
        let (journal, replayed) = JournalFile::open(&data.join("twin.journal"))?;
        let zero_us = replayed.utc_at_zero_us.unwrap_or(BIRTH_US);
        let start_us = if replayed.utc_at_zero_us.is_none() { 0 } else { replayed.last_us + PAUSE_US };
        let key = key(&data, options.seed)?;

        let clock = SteppedClock::new(SteppedOptions {
            utc_at_origin: UtcUs(zero_us).plus(start_us.cast_signed()),
            speed: options.speed,
        })
        .map_err(DemoError::Thread)?;
        let timer: Arc<dyn Timer> = Arc::new(clock.clone());
        let starting = timer.busy("start of the demo");
        let wire = Wire::new(&timer);

        let twin = TwinConfig {
            start_us,
            utc_at_zero_ms: (zero_us / 1000).cast_unsigned(),
            ..TwinConfig::new(options.seed, key.key.clone())
        };
        let utc_at_zero = twin.utc_at_zero();
        let orbit = orbit(options, utc_at_zero);
        let sky = Sky::new(&options.channel.passes, &orbit, utc_at_zero);
        let twin = TwinConfig { orbit: Some(orbit.clone()), ..twin };
        let device = Device::new(DeviceConfig {
            state: replayed.state,
            ..DeviceConfig::new(twin, options.channel.clone(), ModelConfig::prepared(true))
        });
        let player = Player::new(device, Some(journal), Arc::clone(&timer), start_us, Some(wire.clone()));
        // Not the caller's token: the server goes first, so that its last frame is heard.
        let (twin_stop, ended) = (CancellationToken::new(), CancellationToken::new());
        let port = data.join("radio");
        let (asks, twin) = play(player, &port, starting.clone(), twin_stop.clone(), ended.clone()).await?;

        let listener = TcpListener::bind(options.listen)
            .await
            .map_err(|source| DemoError::Listen { address: options.listen, source })?;
        let mut config = Config::from_toml(CONFIG, &data)?;
        config.links.iter_mut().for_each(|link| link.port = Some(port.display().to_string()));
        if let PassProfile::Orbit { station, .. } = &options.channel.passes {
            config.station.latitude_deg = Some(station.latitude_deg());
            config.station.longitude_deg = Some(station.longitude_deg());
            config.station.height_m = station.height_m();
        }
        // The log shows the configuration: the address in it must be the one that answers.
        config.http.listen = listener.local_addr().unwrap_or(options.listen);
        let token_file = config.token_file();
        let (tell_ready, is_ready) = oneshot::channel();
        let link = LinkId::new("e22").map_err(|error| crate::config::ConfigError::Value {
            key: "links.name".into(),
            problem: error.to_string(),
            remedy: String::new(),
        })?;
        let run_options = RunOptions {
            timer: Some(Arc::clone(&timer)),
            entropy: Some(Box::new(SeededEntropy::new(options.seed ^ start_us))),
            wires: [(link, wire)].into(),
            ready: Some(tell_ready),
            demo: Some(serde_json::json!({
                "seed": options.seed,
                "speed": options.speed,
                "loss": options.channel.loss,
                "flips": options.channel.flips,
            })),
            ..RunOptions::new(config)
        };
        let server_stop = CancellationToken::new();
        let server = spawn_server(run_options, listener, server_stop.clone(), ended.clone());
        let Ok(ready) = is_ready.await else {
            twin_stop.cancel();
            return Err(match server.await {
                Ok(Err(error)) => error.into(),
                _ => DemoError::RunDied,
            });
        };
        if let PassProfile::Orbit { .. } = options.channel.passes {
            add_elements(&ready, &orbit, start_us).await;
        }
        let token = Token::load_or_create(&token_file)?;
        let stage = Stage {
            url: format!("http://{}/#token={}", ready.address, token.reveal()),
            address: ready.address,
            port,
            data,
        };
        let starting = Mutex::new(Some(starting));
        let (stop, twin_stop) = (server_stop, twin_stop.drop_guard());
        Ok(Self {
            stage,
            clock,
            timer,
            ready,
            asks,
            start_us,
            sky,
            wall,
            ended,
            starting,
            stop,
            twin_stop,
            server,
            twin,
        })
    }

    /// The token that has held the clock since the beginning.
    pub(super) fn take_start_token(&self) -> BusyToken {
        let mut starting = self.starting.lock().unwrap_or_else(PoisonError::into_inner);
        starting.take().unwrap_or_else(|| self.timer.busy("demo"))
    }

    /// Holds the clock to the end.
    pub(super) fn keep(&self, token: BusyToken) {
        *self.starting.lock().unwrap_or_else(PoisonError::into_inner) = Some(token);
    }

    /// How the twin is now.
    pub(super) async fn twin_view(&self) -> Result<View, DemoError> {
        let (reply, view) = oneshot::channel();
        let died = |()| DemoError::TwinDied;
        self.asks.send(Ask::View(reply)).await.map_err(|_| died(()))?;
        view.await.map_err(|_| died(()))
    }

    /// Ends server and twin, in this order.
    pub(super) async fn strike(self) -> Result<(), DemoError> {
        let Self { stop, server, twin, twin_stop, starting, .. } = self;
        // A server that stops may wait for simulated time.
        drop(starting);
        stop.cancel();
        let server = server.await.map_err(|_| DemoError::RunDied)?;
        drop(twin_stop);
        let twin = task::spawn_blocking(move || twin.join()).await.ok().and_then(Result::ok);
        server?;
        twin.ok_or(DemoError::TwinDied)??;
        Ok(())
    }
}

/// What the satellite flies: where the station follows an orbit, one that passes over it soon after the satellite's time
/// began. The same for all runs in one folder.
fn orbit(options: &DemoOptions, utc_at_zero: UtcInstant) -> Orbit {
    match &options.channel.passes {
        PassProfile::Orbit { station, .. } => {
            Orbit::passing_over(station, utc_at_zero.plus_us(FIRST_CULMINATION_US)).named("PIXELSAT-1 (DEMO)")
        }
        PassProfile::Always { .. } | PassProfile::Repeating { .. } => {
            Orbit::fictional(options.seed, utc_at_zero)
        }
    }
}

/// Gives the server the elements that the satellite flies, as an operator would. Those of an earlier run it has.
async fn add_elements(ready: &Ready, orbit: &Orbit, start_us: u64) {
    let Ok(satellite) = SatelliteId::new("pixelsat-1") else { return };
    let (elements, source) = (vec![orbit.elements().clone()], "made up by the demo".to_owned());
    let intent = Intent::AddElements { satellite, elements, source };
    let key = format!("demo-{start_us}-elements");
    let digest = Sha256::digest(&key).into();
    if let Err(error) = ready.engine.intent(Principal::new("demo"), key, digest, intent).await {
        tracing::warn!("the demo's elements were refused: {error}");
    }
}

fn spawn_server(
    options: RunOptions,
    listener: TcpListener,
    stop: CancellationToken,
    ended: CancellationToken,
) -> task::JoinHandle<Result<Report, RunError>> {
    tokio::spawn(async move {
        let _ended = ended.drop_guard();
        run_with(options, listener, stop).await
    })
}

/// The twin on a thread of its own: it waits for its disk.
async fn play(
    player: Player,
    port: &Path,
    awake: BusyToken,
    stop: CancellationToken,
    ended: CancellationToken,
) -> Result<(mpsc::Sender<Ask>, JoinHandle<Result<View, TwinError>>), DemoError> {
    let (asks, inbox) = mpsc::channel(4);
    let (tell, opened) = oneshot::channel();
    let port = port.to_owned();
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(DemoError::Thread)?;
    let thread = std::thread::Builder::new()
        .name("twin".into())
        .spawn(move || {
            let _ended = ended.drop_guard();
            runtime.block_on(async move {
                let pty = Pty::open(&port)?;
                // Nobody waits any more: then there is nobody to play for either.
                let _ = tell.send(());
                player.run(End::Pty(pty), inbox, stop, awake).await
            })
        })
        .map_err(DemoError::Thread)?;
    if opened.await.is_err() {
        return Err(match thread.join() {
            Ok(Err(error)) => error.into(),
            _ => DemoError::TwinDied,
        });
    }
    Ok((asks, thread))
}

fn make_folder(path: &Path) -> Result<(), DemoError> {
    std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(path)
        .map_err(|source| DemoError::Folder { path: path.into(), source })
}

/// The key of the demo's satellite: the folder's, or a new one from the seed. It is worth nothing, and marked so.
fn key(data: &Path, seed: u64) -> Result<KeyFile, DemoError> {
    let path = data.join("twin.key");
    if !path.exists() {
        let mut bytes = Zeroizing::new([0; 16]);
        SeededEntropy::new(seed).fill(bytes.as_mut_slice());
        keys::create(&path, &mut bytes, true)?;
    }
    let key = keys::load(&path)?;
    if key.simulated { Ok(key) } else { Err(DemoError::RealKey(path)) }
}
