//! The engine without links and API, for a moment: elements are added to a station whose server does not run by the very
//! same road.

use std::sync::Arc;
use std::time::Duration;

use mission::StationId;
use tokio_util::sync::CancellationToken;

use super::door::Door;
use crate::clock::Timer;
use crate::config::{Config, station_config};
use crate::engine::{Engine, EngineInbox, EngineParts, OsEntropy};
use crate::hub::Hub;
use crate::lifecycle::Lifecycle;
use crate::run::{self, RunError};
use crate::storage::Store;

/// What the last records may take to become durable.
const END: Duration = Duration::from_secs(5);

/// A station whose server does not run. The data folder is locked while this lives.
pub struct Offline {
    /// The way in.
    pub door: Door,
    /// The engine's inbox, for what others heard.
    pub inbox: EngineInbox,
    /// The clock.
    pub timer: Arc<dyn Timer>,
    life: Lifecycle,
}

impl Offline {
    /// Opens the archive of a configuration that was checked, and starts the engine on it.
    ///
    /// # Errors
    /// As `serve` would fail; [`crate::storage::StoreError::Locked`] inside when a server runs.
    pub async fn open(config: &Config) -> Result<Self, RunError> {
        let keys = run::load_keys(config)?;
        let station = station_config(config, &keys)?;
        drop(keys);
        let store = archive(config, &station.station).await?;
        let timer = run::clock_for(config, run::newest_event(&store).await?);
        let snapshot = run::snapshot(&store, &station).await?;
        let recovered = run::not_yet_stored(&store, store.reserve_read().await?).await?;
        let entropy = OsEntropy::new().map_err(|source| RunError::Io { what: "no randomness", source })?;
        let (engine, inbox, handle) = Engine::new(EngineParts {
            station,
            snapshot,
            recovered,
            elsewhere: Vec::new(),
            store: store.clone(),
            timer: Arc::clone(&timer),
            clock: config.station.clock,
            entropy: Box::new(entropy),
            hub: Hub::new(),
            // Nothing can be radiated: there is nobody to hand it to.
            links: Vec::new(),
        });
        let life = Lifecycle::new(&CancellationToken::new());
        let stop = life.soft.clone();
        life.spawn("engine", async move { engine.run(stop.clone(), stop).await.map_err(Into::into) });
        Ok(Self { door: Door { engine: handle, store }, inbox, timer, life })
    }

    /// Ends it in order.
    ///
    /// # Errors
    /// When a part of it died, or the archive cannot be closed.
    pub async fn close(self) -> Result<(), RunError> {
        self.life.soft.cancel();
        let _left = self.life.finish(END).await;
        if let Some(failure) = self.life.failure() {
            return Err(failure.into());
        }
        self.door.store.close().await.map_err(RunError::Store)
    }
}

/// The archive alone, for looking at it.
///
/// # Errors
/// As [`Offline::open`].
pub async fn archive(config: &Config, station: &StationId) -> Result<Store, RunError> {
    run::open_store(config, station, None).await
}
