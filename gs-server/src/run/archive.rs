//! The archive at the start: opened, and what the engine takes from it. Each owns what it reads with: a future that borrows
//! it is not `Send` enough for whoever spawns a run.

use std::sync::Arc;

use futures_util::FutureExt as _;
use futures_util::future::BoxFuture;
use mission::port::ReservedFrame;
use mission::{Clock as _, FrameId, Snapshot, StationConfig, StationId, UtcUs};
use protocol::Key;

use super::RunError;
use crate::clock::{ScaledClock, SystemClock, Timer};
use crate::config::{Config, ConfigError};
use crate::storage::{EventQuery, Page, Postgres, Store, StoreError, StoreOptions};

/// The clock of the configuration. A simulated one that ran ahead of life goes on where the last run left it: to a
/// restart, records of the future would be answers that are still to come.
pub(crate) fn clock_for(config: &Config, last: Option<UtcUs>) -> Arc<dyn Timer> {
    let Some(simulation) = config.simulation else { return Arc::new(SystemClock::new()) };
    let clock = ScaledClock::new(simulation.speed);
    match last.filter(|last| *last > clock.now().utc) {
        Some(last) => Arc::new(ScaledClock::starting_at(simulation.speed, last)),
        None => Arc::new(clock),
    }
}

/// When the newest event of the archive happened.
pub(crate) fn newest_event(store: &Store) -> BoxFuture<'static, Result<Option<UtcUs>, StoreError>> {
    let store = store.clone();
    let query = EventQuery {
        page: Page { before: Some(i64::MAX), limit: 1, ..Page::default() },
        ..EventQuery::default()
    };
    async move { Ok(store.events(&query).await?.first().map(|event| event.record.at)) }.boxed()
}

/// The archive of the configuration, or what was brought, of the right kind.
pub(crate) async fn open_store(
    config: &Config,
    station: &StationId,
    brought: Option<Store>,
) -> Result<Store, RunError> {
    let simulated = config.is_simulated();
    let store = match brought {
        Some(store) => store,
        None => {
            let options = StoreOptions {
                folder: config.storage.folder.clone(),
                station: Some(station.clone()),
                simulated,
                postgres: postgres(config)?,
                max_page_count: config.storage.max_page_count,
                reserve_bytes: config.storage.reserve_bytes,
            };
            // On a thread that may wait: migrations and the check of a large archive take their time.
            let runtime = tokio::runtime::Handle::current();
            let opened = tokio::task::spawn_blocking(move || runtime.block_on(Store::open(options))).await;
            opened.map_err(|source| RunError::Io {
                what: "the archive cannot be opened: the thread that did it died",
                source: std::io::Error::other(source),
            })??
        }
    };
    if store.is_simulated() == simulated {
        Ok(store)
    } else {
        Err(RunError::StoreKind { simulated: store.is_simulated() })
    }
}

/// What other stations of the archive hold of the satellites' images.
pub(super) fn images_elsewhere(
    store: &Store,
    station: &StationConfig,
) -> BoxFuture<'static, Result<Vec<(FrameId, ReservedFrame)>, StoreError>> {
    let store = store.clone();
    let satellites: Vec<_> = station.satellites.iter().map(|satellite| satellite.id.clone()).collect();
    async move {
        let mut frames = Vec::new();
        for satellite in &satellites {
            frames.extend(store.images_elsewhere(satellite).await?);
        }
        Ok(frames)
    }
    .boxed()
}

/// Of these reserved frames, those that the archive lacks.
pub(crate) fn not_yet_stored(
    store: &Store,
    kept: Vec<ReservedFrame>,
) -> BoxFuture<'static, Result<Vec<ReservedFrame>, StoreError>> {
    let store = store.clone();
    async move { store.not_yet_stored(kept).await }.boxed()
}

/// The shared database of the configuration, with its password.
pub(crate) fn postgres(config: &Config) -> Result<Option<Postgres>, RunError> {
    let Some(url) = &config.storage.database else { return Ok(None) };
    // The address was checked with the configuration.
    let postgres = Postgres::new(url).map_err(|problem| {
        ConfigError::value("storage.database", problem, "Write postgres://user@host/database.")
    })?;
    Ok(Some(match &config.storage.password_file {
        Some(file) => postgres.with_password_file(file)?,
        None => postgres,
    }))
}

/// What the engine knows when it starts.
pub(crate) fn snapshot(
    store: &Store,
    station: &StationConfig,
) -> BoxFuture<'static, Result<Snapshot, StoreError>> {
    let store = store.clone();
    let satellites: Vec<_> = station.satellites.iter().map(|satellite| satellite.id.clone()).collect();
    let keys: Vec<_> =
        station.satellites.iter().filter_map(|satellite| satellite.key.as_ref().map(Key::id)).collect();
    async move { store.snapshot(&satellites, &keys).await }.boxed()
}
