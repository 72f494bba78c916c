//! `gs-server demo`: a satellite pass with everything real but the satellite.
//!
//! The twin lives behind a pseudo-terminal in this process; the server opens it with its real serial link, keeps what
//! it hears in its real store and shows it on its real page, on loopback. All of it runs on one
//! [`crate::clock::SteppedClock`]: time stands still while bytes are unread or a persist is unconfirmed, and jumps over
//! what nobody wants to watch.
//!
//! | file | what |
//! | --- | --- |
//! | `scene` | the data folder, the twin on its thread, the server |
//! | `operator` | what an operator would send, through the same door |
//! | `sky` | when the satellite is in view; skips the time between passes |
//! | `summary` | what it came to: the one JSON object |
//!
//! Nothing of it may touch a real satellite: key, folder and clock are marked as simulated, and real links refuse them.

mod operator;
mod scene;
mod sky;
mod summary;

pub use summary::{Airtime, Chunks, Frames, Hashes, Summary};

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use mission::{MonoUs, Status};
use satellite::{ChannelConfig, PassProfile};
use tle::Station;
use tle::station::StationError;
use tokio_util::sync::CancellationToken;

use crate::clock::within;
use crate::keys::KeyError;
use crate::run::RunError;
use crate::storage::StoreError;
use crate::twin::TwinError;

/// What to show.
#[derive(Debug, Clone)]
pub struct DemoOptions {
    /// Everything is kept here; a folder of an earlier demo is gone on with.
    pub data: PathBuf,
    /// Simulated seconds per second at most; `None` as fast as the machine can.
    pub speed: Option<f64>,
    /// Satellite, picture, noise and nonces follow from this.
    pub seed: u64,
    /// The air, passes included.
    pub channel: ChannelConfig,
    /// Where the page is.
    pub listen: SocketAddr,
    /// End when the image is home.
    pub until_image: bool,
    /// Then end in vain after so many simulated microseconds.
    pub limit_us: u64,
    /// Send by itself what an operator would; otherwise only you do.
    pub operates: bool,
}

impl DemoOptions {
    /// To be watched, or flown by hand: passes over a northern station, an air that loses little, no end.
    ///
    /// # Errors
    /// As [`passes`].
    pub fn to_watch(data: PathBuf, speed: Option<f64>, listen: SocketAddr) -> Result<Self, StationError> {
        let seed = 1;
        let channel =
            ChannelConfig { seed, passes: passes()?, elevation_loss: true, ..ChannelConfig::default() };
        Ok(Self {
            data,
            speed,
            seed,
            channel,
            listen,
            until_image: false,
            limit_us: u64::MAX,
            operates: true,
        })
    }
}

/// The demo's sky: true passes over a station so far north (Svalbard) that the satellite comes by in each revolution.
///
/// # Errors
/// None with these coordinates; whoever changes them is told.
pub fn passes() -> Result<PassProfile, StationError> {
    Ok(PassProfile::seen_from(Station::new(78.23, 15.41, 450.0)?))
}

/// The demo is set up: where to look.
#[derive(Debug, Clone)]
pub struct Stage {
    /// The page with the token that lets its reader send, for its owner's eyes.
    pub url: String,
    /// The page without it.
    pub address: SocketAddr,
    /// The pseudo-terminal.
    pub port: PathBuf,
    /// The data folder.
    pub data: PathBuf,
}

/// How far it is.
#[derive(Debug, Clone)]
pub struct Progress {
    /// Simulated seconds since the beginning.
    pub simulated_s: f64,
    /// Whether the satellite is above the horizon.
    pub in_view: bool,
    /// How the station is.
    pub status: Arc<Status>,
}

/// Why a demo could not be shown.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// The data folder.
    #[error("data folder {path}", path = .path.display())]
    Folder {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Its key.
    #[error(transparent)]
    Key(#[from] KeyError),
    /// Its key is none for a twin.
    #[error("{path} is a real key: this folder is not a demo's, give another --data", path = .0.display())]
    RealKey(PathBuf),
    /// The twin.
    #[error("the twin")]
    Twin(#[from] TwinError),
    /// The twin's thread ended without a word.
    #[error("the twin's thread died")]
    TwinDied,
    /// The server.
    #[error("the server")]
    Run(#[from] RunError),
    /// The server's task ended without a word.
    #[error("the server's task died")]
    RunDied,
    /// The archive.
    #[error("the archive")]
    Store(#[from] StoreError),
    /// The configuration that the demo makes.
    #[error("the demo's own configuration")]
    Config(#[from] crate::config::ConfigError),
    /// The listener.
    #[error("{address} cannot be listened on; choose another --port, or 0 for any")]
    Listen {
        /// Where.
        address: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
    /// The token file.
    #[error(transparent)]
    Token(#[from] crate::http::TokenError),
    /// No thread, no runtime.
    #[error("the operating system gives no thread")]
    Thread(#[source] std::io::Error),
    /// Simulated time does not go on.
    #[error("simulated time has stood still for {} s; it is held by {holders}", .wall.as_secs())]
    Stalled {
        /// How long.
        wall: Duration,
        /// Who holds the clock.
        holders: String,
    },
}

/// How often the director looks, in simulated microseconds.
const LOOK_US: u64 = 1_000_000;
/// Longer than this no step of a demo takes in wall time.
const STALLED: Duration = Duration::from_secs(60);

/// Shows it until `stop`, or until the image is home. `ready` is told once, `progress` about once a simulated second.
///
/// # Errors
/// [`DemoError`]. An image that did not come home is no error: the summary says so.
pub async fn run(
    options: DemoOptions,
    stop: CancellationToken,
    ready: impl FnOnce(&Stage),
    mut progress: impl FnMut(&Progress),
) -> Result<Summary, DemoError> {
    let scene = scene::Scene::set(&options).await?;
    ready(&scene.stage);
    let outcome = direct(&options, &scene, &stop, &mut progress).await;
    let summary = match outcome {
        // What it died of is known when it is struck.
        Ok(Ending::PartEnded) => Err(DemoError::RunDied),
        Ok(ending) => summary::Summary::gather(&options, &scene, &ending).await,
        Err(error) => Err(error),
    };
    scene.strike().await?;
    summary
}

/// How the showing ended.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Ending {
    /// The image is whole on the ground.
    Home,
    /// Somebody stopped it.
    Stopped,
    /// The simulated time was up.
    TimeUp,
    /// A part of it ended by itself; what it said comes from [`scene::Scene::strike`].
    PartEnded,
}

async fn direct(
    options: &DemoOptions,
    scene: &scene::Scene,
    stop: &CancellationToken,
    progress: &mut impl FnMut(&Progress),
) -> Result<Ending, DemoError> {
    let timer = Arc::clone(&scene.timer);
    let mut operator = operator::Operator::new(scene, options.until_image);
    let mut sky = sky::Sky::new(scene);
    let patience = STALLED.max(Duration::from_secs_f64(10.0 / options.speed.unwrap_or(1.0).min(1.0)));
    // From here on the clock is held by us, or it runs until our next look.
    let mut awake = scene.take_start_token();
    loop {
        let now = timer.now();
        let in_view = sky.look(now, !options.until_image);
        let status = scene.ready.engine.status();
        progress(&Progress { simulated_s: now.mono.0 as f64 / 1e6, in_view, status: Arc::clone(&status) });
        if options.operates {
            operator.act(&status, now).await;
        }
        let image = status.satellites.first().and_then(|satellite| satellite.image.as_ref());
        if options.until_image && image.is_some_and(|image| image.chunks > 0 && image.held == image.chunks) {
            scene.keep(awake);
            return Ok(Ending::Home);
        }
        if options.until_image && now.mono.0 >= options.limit_us {
            scene.keep(awake);
            return Ok(Ending::TimeUp);
        }
        let next = sky.next_us().map_or(u64::MAX, |us| us.max(now.mono.0 + 1)).min(now.mono.0 + LOOK_US);
        let sleep = timer.sleep_until(MonoUs(next));
        drop(awake);
        awake = tokio::select! {
            biased;
            () = stop.cancelled() => return Ok(Ending::Stopped),
            () = scene.ended.cancelled() => return Ok(Ending::PartEnded),
            woken = within(patience, sleep) => match woken {
                Some(token) => token,
                None => return Err(stalled(scene, patience)),
            },
        };
    }
}

fn stalled(scene: &scene::Scene, wall: Duration) -> DemoError {
    let holders: Vec<String> =
        scene.clock.holders().into_iter().map(|(who, count)| format!("{who} ({count})")).collect();
    let holders = if holders.is_empty() { "nobody".to_owned() } else { holders.join(", ") };
    DemoError::Stalled { wall, holders }
}
