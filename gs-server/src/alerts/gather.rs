//! What the station's status does not tell: disk, clock, limits, passes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};

use mission::alert::{LimitSeen, PassSeen, Surroundings};
use mission::{MonoUs, SatelliteId, StationConfig, StationId, UtcUs};

use super::handle::Reported;
use crate::clock::{Timer, kernel_says_synchronised};
use crate::config::{ClockSetting, Config};
use crate::storage::{Page, Scope, Store, StoreError};

/// The disk and the clock are looked at so often.
const MACHINE_US: u64 = 60_000_000;
/// Passes that are looked back at, of all satellites.
const PASSES: u32 = 200;

/// What there is to know of a station, without its keys.
#[derive(Debug, Clone)]
pub(crate) struct Watched {
    pub(super) station: StationId,
    heartbeat_period_us: BTreeMap<SatelliteId, u64>,
    has_site: bool,
}

impl Watched {
    pub(crate) fn of(config: &StationConfig) -> Self {
        let period = |satellite: &mission::SatelliteConfig| {
            (satellite.id.clone(), satellite.profile.heartbeat_period_us)
        };
        Self {
            station: config.station.clone(),
            heartbeat_period_us: config.satellites.iter().map(period).collect(),
            has_site: config.site.is_some(),
        }
    }
}

/// What is read again after an event of its kind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stale {
    pub(super) limits: bool,
    pub(super) passes: bool,
}

impl Stale {
    pub(super) fn any(self) -> bool {
        self.limits || self.passes
    }
}

/// Gathers. Keeps what it knew when something cannot be read.
pub(super) struct Gatherer {
    pub(super) around: Surroundings,
    pub(super) stale: Stale,
    station: StationId,
    reported: Reported,
    folder: PathBuf,
    ask_kernel: bool,
    looked: Option<MonoUs>,
}

impl Gatherer {
    pub(super) fn new(config: &Config, watched: &Watched, folder: &Path, reported: Reported) -> Self {
        let around = Surroundings {
            heartbeat_period_us: watched.heartbeat_period_us.clone(),
            has_site: watched.has_site,
            ..Surroundings::default()
        };
        Self {
            around,
            stale: Stale { limits: true, passes: true },
            station: watched.station.clone(),
            reported,
            folder: folder.to_owned(),
            // A simulated clock is nobody's; one that an operator vouches for shows in the lock of sealing.
            ask_kernel: config.station.clock == ClockSetting::Kernel && !config.is_simulated(),
            looked: None,
        }
    }

    /// Looks at what may have changed.
    pub(super) async fn look(&mut self, store: &Store, timer: &Arc<dyn Timer>) -> &Surroundings {
        let now = timer.now();
        if self.looked.is_none_or(|looked| now.mono.since(looked) >= MACHINE_US) {
            self.looked = Some(now.mono);
            self.around.disk_free_percent = free_percent(self.folder.clone()).await;
            if self.ask_kernel {
                self.around.clock_is_right = Some(kernel_says_synchronised().await);
            }
        }
        if self.stale.limits {
            match limits(store, &self.station).await {
                Ok(limits) => (self.around.limits, self.stale.limits) = (limits, false),
                Err(error) => tracing::debug!(%error, "limits cannot be read for the alerts: {error}"),
            }
        }
        if self.stale.passes {
            match passes(store, &self.station).await {
                Ok(passes) => (self.around.passes, self.stale.passes) = (passes, false),
                Err(error) => tracing::debug!(%error, "passes cannot be read for the alerts: {error}"),
            }
        }
        let reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
        self.around.reported = reported.values().cloned().collect();
        drop(reported);
        &self.around
    }
}

/// Free space for who is not the administrator, percent of all.
async fn free_percent(folder: PathBuf) -> Option<f64> {
    let told = tokio::task::spawn_blocking(move || rustix::fs::statvfs(&folder)).await.ok()?.ok()?;
    (told.f_blocks > 0).then(|| told.f_bavail as f64 / told.f_blocks as f64 * 100.0)
}

async fn limits(store: &Store, station: &StationId) -> Result<Vec<LimitSeen>, StoreError> {
    let rows = store.limits().await?;
    // Of several stations on one archive each tells of its own.
    let mine = rows.into_iter().filter(|row| row.station == station.as_str());
    let seen = mine.filter_map(|row| {
        Some(LimitSeen {
            satellite: SatelliteId::new(&row.satellite).ok()?,
            parameter: row.parameter,
            level: row.level.parse().ok()?,
            value: row.value,
        })
    });
    Ok(seen.collect())
}

async fn passes(store: &Store, station: &StationId) -> Result<Vec<PassSeen>, StoreError> {
    let scope = Scope { station: Some(station.to_string()), ..Scope::default() };
    let page = Page { before: Some(i64::MAX), limit: PASSES, ..Page::default() };
    let rows = store.passes(&scope, &page).await?;
    let seen = rows.into_iter().filter_map(|row| {
        Some(PassSeen {
            satellite: SatelliteId::new(&row.satellite).ok()?,
            aos_at: UtcUs(row.aos_at_us),
            los_at: UtcUs(row.ended_at_us?),
            max_elevation_deg: row.max_elevation_deg,
        })
    });
    Ok(seen.collect())
}
