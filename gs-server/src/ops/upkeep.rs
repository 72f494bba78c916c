//! The task that looks after the machine: the disk each minute, a backup when one is due, values that may go.
//!
//! It lives in the real world, whatever the simulated time is: disks fill in real time.

use std::path::{Path, PathBuf};
use std::time::Duration;

use mission::record::EventKind;
use mission::{Clock as _, Level, UtcUs};
use tokio_util::sync::CancellationToken;

use super::backup::{self, BackupError, Source};
use super::disk::DiskWatch;
use super::metrics::{Metrics, machine};
use crate::clock::{SystemClock, clock_offset_s, wall_sleep};
use crate::config::{BackupSection, Config};
use crate::engine::{EngineInbox, EngineMessage};
use crate::storage::Store;

/// Between two looks at the disk.
const LOOK_EVERY: Duration = Duration::from_secs(60);
/// Between two questions to the clock's keeper, in looks.
const CLOCK_LOOKS: u32 = 5;
/// A backup that failed is tried again after this, microseconds: an hour.
const RETRY_US: i64 = 3_600_000_000;
/// Values removed at once, and how often in a row before the next look.
const REMOVE_AT_ONCE: u32 = 2_000;
const REMOVE_STEPS: u32 = 50;

/// The task.
pub struct UpkeepTask {
    store: Store,
    engine: EngineInbox,
    metrics: Metrics,
    disk: DiskWatch,
    backup: Option<BackupSection>,
    station: String,
    config_file: Option<PathBuf>,
    telemetry_days: Option<u32>,
    clock: SystemClock,
    next_backup: Option<UtcUs>,
}

impl UpkeepTask {
    /// For this server. `config_file` goes into its backups.
    pub fn new(
        config: &Config,
        config_file: Option<PathBuf>,
        store: Store,
        engine: EngineInbox,
        metrics: Metrics,
    ) -> Self {
        Self {
            store,
            engine,
            metrics,
            disk: DiskWatch::new(config.disk),
            backup: config.backup.clone(),
            station: config.station.name.clone(),
            config_file,
            telemetry_days: config.retention.telemetry_days,
            clock: SystemClock::new(),
            next_backup: None,
        }
    }

    /// Works until `stop`. A backup that is under way then is given up; the one before it stays.
    pub async fn run(mut self, stop: CancellationToken) {
        let mut looks = 0_u32;
        loop {
            let work = async {
                self.look_at_the_disk().await;
                if looks.is_multiple_of(CLOCK_LOOKS) {
                    let offset_s = clock_offset_s().await;
                    self.metrics.upkeep(|upkeep| upkeep.clock_offset_s = offset_s);
                }
                self.back_up_when_due().await;
                self.remove_what_may_go().await;
                wall_sleep(LOOK_EVERY).await;
            };
            tokio::select! {
                () = stop.cancelled() => return,
                () = work => {}
            }
            looks = looks.wrapping_add(1);
        }
    }

    async fn look_at_the_disk(&mut self) {
        let folder = self.store.folder().to_path_buf();
        let found = tokio::task::spawn_blocking(move || machine::Folder::look(&folder)).await;
        let Some(free_bytes) = found.ok().and_then(|found| found.free_bytes) else { return };
        let at_us = i64::try_from(self.clock.now().mono.0).unwrap_or(i64::MAX);
        let (view, news) = self.disk.look(at_us, free_bytes);
        self.metrics.upkeep(|upkeep| upkeep.disk = Some(view));
        if let Some((level, message)) = news {
            self.tell(level, message).await;
        }
    }

    async fn back_up_when_due(&mut self) {
        let Some(section) = self.backup.clone() else { return };
        let now = self.clock.now().utc;
        let every_us = i64::from(section.every_h) * 3_600_000_000;
        let due = match self.next_backup {
            Some(due) => due,
            None => {
                // What an earlier life took counts.
                let newest = newest_backup(&section.folder, &self.station);
                newest.map_or(now, |newest| newest.plus(every_us))
            }
        };
        self.next_backup = Some(due);
        // A clock that went back far must not put backups off for years.
        if now < due && due.0 - now.0 <= every_us {
            return;
        }
        match self.back_up(&section, now).await {
            Ok(bytes) => {
                self.next_backup = Some(now.plus(every_us));
                let mut was_in_trouble = false;
                self.metrics.upkeep(|upkeep| {
                    was_in_trouble = upkeep.backup_trouble.take().is_some();
                    upkeep.backup_at = Some(now);
                    upkeep.backup_bytes = Some(bytes);
                });
                if was_in_trouble {
                    self.tell(Level::Normal, "backups are taken again".to_owned()).await;
                }
                prune(&section, &self.station);
            }
            Err(error) => {
                self.next_backup = Some(now.plus(RETRY_US.min(every_us)));
                let text = format!("no backup could be taken: {}", chain(&error));
                let mut is_news = false;
                self.metrics.upkeep(|upkeep| {
                    upkeep.backup_failures += 1;
                    is_news = upkeep.backup_trouble.replace(text.clone()).is_none();
                });
                if is_news {
                    self.tell(Level::Warning, text).await;
                } else {
                    tracing::warn!("{text}");
                }
            }
        }
    }

    async fn back_up(&self, section: &BackupSection, now: UtcUs) -> Result<u64, BackupError> {
        let target = section.folder.join(name(&self.station, now));
        let folder = section.folder.clone();
        let source = Source { folder: self.store.folder().to_path_buf(), config: self.config_file.clone() };
        backup::make_folder(&folder)?;
        let manifest = backup::take(&source, &target, now).await?;
        let bytes = manifest.files.iter().map(|member| member.bytes).sum();
        tracing::info!(bytes, "backup {} is written", target.display());
        Ok(bytes)
    }

    async fn remove_what_may_go(&self) {
        let Some(days) = self.telemetry_days else { return };
        let before_us = self.clock.now().utc.0 - i64::from(days) * 86_400_000_000;
        for _ in 0..REMOVE_STEPS {
            match self.store.remove_telemetry(before_us, REMOVE_AT_ONCE).await {
                Ok(0) => return,
                Ok(removed) => self.metrics.upkeep(|upkeep| upkeep.values_removed += removed),
                Err(error) => {
                    tracing::warn!("values older than {days} days could not be removed: {}", chain(&error));
                    return;
                }
            }
            wall_sleep(Duration::from_millis(50)).await;
        }
    }

    async fn tell(&self, level: Level, message: String) {
        self.engine.send(EngineMessage::Notice { kind: EventKind::Storage, level, message }).await;
    }
}

/// When the newest backup of this station in this folder was taken.
pub(super) fn newest_backup(folder: &Path, station: &str) -> Option<UtcUs> {
    list(folder, station).into_iter().map(|(at, _)| at).max()
}

/// The name of a backup that the server takes.
fn name(station: &str, at: UtcUs) -> String {
    let stamp = jiff::Timestamp::from_microsecond(at.0)
        .map_or_else(|_| at.0.to_string(), |at| at.strftime("%Y%m%dT%H%M%SZ").to_string());
    format!("{station}-{stamp}.tar")
}

/// Backups of this station in a folder, oldest first, with the time in their names.
fn list(folder: &Path, station: &str) -> Vec<(UtcUs, PathBuf)> {
    let Ok(entries) = folder.read_dir() else { return Vec::new() };
    let mut found: Vec<_> = entries
        .flatten()
        .filter_map(|entry| {
            let file = entry.file_name();
            let stamp = file.to_str()?.strip_prefix(station)?.strip_prefix('-')?.strip_suffix(".tar")?;
            let at = jiff::civil::DateTime::strptime("%Y%m%dT%H%M%SZ", stamp).ok()?;
            let at = at.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp().as_microsecond();
            Some((UtcUs(at), entry.path()))
        })
        .collect();
    found.sort();
    found
}

/// Removes the oldest beyond those that are kept. Only files that have such a name are ever touched.
fn prune(section: &BackupSection, station: &str) {
    let all = list(&section.folder, station);
    let surplus = all.len().saturating_sub(section.keep as usize);
    for (_, path) in all.into_iter().take(surplus) {
        if let Err(error) = std::fs::remove_file(&path) {
            tracing::warn!("the old backup {} cannot be removed: {error}", path.display());
        }
    }
}

fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text.push_str(": ");
        text.push_str(&cause.to_string());
        source = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_of_our_own_go_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let day_us = 86_400_000_000;
        for day in 0..5 {
            let path = folder.path().join(name("roof", UtcUs(1_800_000_000_000_000 + day * day_us)));
            std::fs::write(path, "x").unwrap();
        }
        for other in ["roof-2020.tar", "other-20200101T000000Z.tar", "roof-20200101T000000Z.tar.gz", "notes"]
        {
            std::fs::write(folder.path().join(other), "x").unwrap();
        }
        let section = BackupSection { folder: folder.path().into(), every_h: 24, keep: 2 };
        prune(&section, "roof");
        let left: Vec<_> = list(folder.path(), "roof").into_iter().map(|(at, _)| at).collect();
        assert_eq!(left, [3, 4].map(|day| UtcUs(1_800_000_000_000_000 + day * day_us)));
        assert_eq!(folder.path().read_dir().unwrap().count(), 6, "what is not ours stays");
    }
}
