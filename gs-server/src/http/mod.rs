//! API v1 and the first page, under axum.
//!
//! `routes` is the table: every path, whether it reads or writes, who may take it, and who answers. Around all of it lies
//! one guard (names under which we answer, problems, security headers), around every route its door (`admit`: origin, who
//! asks, the right), around every write another (idempotency key, JSON). One file per group of operations; `problem` is the only place that turns errors into answers.
//!
//! Looking needs nobody only on loopback and while there is no user, or where the configuration says so. Every write
//! needs a right.
//!
//! What it does **not** do: decide anything (intents go to the engine), know SQL (the store answers), read a clock.

mod accept;
mod admit;
mod alerts;
mod antenna;
mod approvals;
mod clock;
mod commands;
mod conditional;
mod downloads;
mod elements;
mod events;
mod extract;
mod forwards;
mod frames;
mod guard;
mod hosts;
mod images;
mod keys;
mod links;
mod metrics;
pub mod openapi;
mod page;
mod people;
mod plans;
mod problem;
mod receivers;
mod receptions;
mod rehearsals;
mod release;
mod reports;
mod routes;
mod runs;
mod schedule;
mod session;
mod sky;
mod station;
mod status;
mod stream;
mod telemetry;
mod tls;
mod token;
mod write;

#[cfg(test)]
mod tests;

use std::io;
use std::sync::Arc;

use axum::Router;
use axum::middleware::from_fn_with_state;
use axum::serve::ListenerExt as _;
use mission::config::Times;
use mission::{Profile, SatelliteId, Site, StationConfig, StationId};
use protocol::KeyId;
use radio::airtime::LinkTiming;
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;
use tower_http::compression::CompressionLayer;

use crate::alerts::AlertsHandle;
use crate::clock::Timer;
use crate::elements::ElementsHandle;
use crate::engine::EngineHandle;
use crate::forward::ForwardsHandle;
use crate::hamlib::AntennaHandle;
use crate::hub::Hub;
use crate::ingest::{Aliases, Ears};
use crate::people::People;
use crate::storage::Store;
use crate::ways::WaysHandle;

pub use antenna::RadioOnAir;
pub use hosts::AllowedHosts;
pub use tls::{Tls, TlsError, TlsFiles, serve_tls};
pub use token::{Token, TokenError};

/// Bytes that the kernel keeps for one connection.
const SEND_BUFFER: usize = 128 * 1024;

/// Whom the handlers ask.
#[derive(Clone)]
pub struct HttpState {
    /// The archive.
    pub store: Store,
    /// The engine: intents and status.
    pub engine: EngineHandle,
    /// Elements: how satellites are found, and the sources.
    pub elements: ElementsHandle,
    /// What is wrong, and who is told.
    pub alerts: AlertsHandle,
    /// The way of reports into the archive.
    pub ears: Ears,
    /// Ways in over the network, and the boards that speak by them.
    pub ways: WaysHandle,
    /// What our satellites are called elsewhere.
    pub aliases: Aliases,
    /// What is passed on to others.
    pub forwards: ForwardsHandle,
    /// Committed events as they come.
    pub hub: Hub,
    /// Rotator and rig, as far as there are any.
    pub antenna: AntennaHandle,
    /// The radios that are not tuned with the Doppler shift.
    pub radios: Vec<RadioOnAir>,
    /// The station's time, simulated or not.
    pub timer: Arc<dyn Timer>,
    /// The token of the server's own file: whoever can read it may do everything.
    pub token: Token,
    /// Everybody else.
    pub people: People,
    /// Who we are.
    pub identity: Identity,
    /// What a demo tells of itself; shown in the station's view.
    pub demo: Option<serde_json::Value>,
    /// Streams that may be open at once; more are refused.
    pub streams_max: usize,
    /// Cancelled when the server stops: open streams end.
    pub stop: CancellationToken,
}

/// Who we are, from the configuration.
#[derive(Debug, Clone)]
pub struct Identity {
    /// The station.
    pub station: StationId,
    /// Where it stands; `None`: nobody said.
    pub site: Option<Site>,
    /// When it may transmit, and when it is closed.
    pub times: Times,
    /// Its satellites.
    pub satellites: Vec<SatelliteIdentity>,
    /// Time, satellite or radio are made up.
    pub simulated: bool,
}

/// A satellite, from the configuration.
#[derive(Debug, Clone)]
pub struct SatelliteIdentity {
    /// The satellite.
    pub id: SatelliteId,
    /// The id of its key.
    pub key: Option<KeyId>,
    /// Microseconds between two of its heartbeats.
    pub heartbeat_period_us: i64,
    /// What it knows.
    pub profile: Profile,
    /// Airtime of its first link.
    pub timing: LinkTiming,
}

impl Identity {
    /// The identity of a configured station.
    #[must_use]
    pub fn of(config: &StationConfig, simulated: bool) -> Self {
        let satellites = config.satellites.iter().map(|satellite| SatelliteIdentity {
            id: satellite.id.clone(),
            key: satellite.key.as_ref().map(protocol::Key::id),
            heartbeat_period_us: i64::try_from(satellite.profile.heartbeat_period_us).unwrap_or(i64::MAX),
            profile: satellite.profile,
            timing: config
                .links
                .iter()
                .find(|link| link.satellite == satellite.id)
                .map(|link| link.timing)
                .unwrap_or_default(),
        });
        Self {
            station: config.station.clone(),
            site: config.site.clone(),
            times: config.times.clone(),
            satellites: satellites.collect(),
            simulated,
        }
    }
}

/// What every handler gets. Cheap to clone.
#[derive(Clone)]
struct App {
    state: Arc<HttpState>,
    hosts: Arc<AllowedHosts>,
    streams: Arc<Semaphore>,
    feed: stream::Feed,
    /// Turns of those who compute something long.
    computing: Arc<Semaphore>,
    /// Turns of those who hand reports in.
    reports: Arc<Semaphore>,
    rehearsals: Arc<rehearsals::Rehearsals>,
}

/// The API and the page. Within tokio: the feed of the streams runs from here on, until [`HttpState::stop`].
pub fn router(state: HttpState, allowed_hosts: AllowedHosts) -> Router {
    let (streams_max, stop) = (state.streams_max.min(Semaphore::MAX_PERMITS), state.stop.clone());
    let app = App {
        state: Arc::new(state),
        hosts: Arc::new(allowed_hosts),
        streams: Arc::new(Semaphore::new(streams_max)),
        feed: stream::Feed::new(),
        computing: Arc::new(Semaphore::new(sky::COMPUTING_MAX)),
        reports: Arc::new(Semaphore::new(receptions::AT_ONCE)),
        rehearsals: Arc::default(),
    };
    tokio::spawn(app.feed.clone().run(app.clone(), stop));
    routes::table()
        .into_iter()
        .fold(Router::new(), |router, route| route.add_to(router, &app))
        .layer(CompressionLayer::new())
        .layer(from_fn_with_state(app.clone(), guard::guard))
        .with_state(app)
}

/// Answers until `stop`; returns when every request that was under way has its answer.
///
/// # Errors
/// When the listener fails.
pub async fn serve(
    listener: tokio::net::TcpListener,
    router: Router,
    stop: CancellationToken,
) -> io::Result<()> {
    // Small messages on a live page: never wait for more to fill a packet.
    let listener = listener.tap_io(|stream| {
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "A connection keeps Nagle's algorithm.");
        }
        // Else the kernel would keep megabytes for each client that takes nothing.
        if let Err(error) = rustix::net::sockopt::set_socket_send_buffer_size(&*stream, SEND_BUFFER) {
            tracing::debug!(%error, "A connection keeps its large buffer.");
        }
    });
    let router = router.into_make_service_with_connect_info::<std::net::SocketAddr>();
    axum::serve(listener, router).with_graceful_shutdown(stop.cancelled_owned()).await
}
