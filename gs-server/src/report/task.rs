//! Writes the report of each pass a minute after its LOS, whether anybody asks for it or not.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use api::Time;
use mission::record::EventKind;
use mission::{MonoUs, UtcUs};
use tokio::sync::broadcast;
use tokio::sync::broadcast::error::RecvError;
use tokio_util::sync::CancellationToken;

use super::file::{file_name, is_written, write_pass};
use super::{AFTER_LOS_US, pass_report};
use crate::clock::Timer;
use crate::http::Identity;
use crate::hub::Hub;
use crate::storage::{Store, StoredEvent};

/// Passes back from the newest one whose report is written when it is missing: two days of a polar station.
const PASSES: u32 = 50;
/// What could not be written is tried again after this.
const AGAIN_US: i64 = 600_000_000;

/// What the task works with.
pub struct ReportTask {
    /// The archive.
    pub store: Store,
    /// Who we are.
    pub identity: Identity,
    /// The station's time.
    pub timer: Arc<dyn Timer>,
    /// Where passes end.
    pub hub: Hub,
    /// Where the files go.
    pub folder: PathBuf,
}

impl ReportTask {
    /// Works until `stop`.
    pub async fn run(self, stop: CancellationToken) {
        let mut events = self.hub.subscribe();
        let mut awake = self.timer.busy("reports");
        let mut written = BTreeSet::new();
        loop {
            let due = self.write(&mut written).await;
            let now = self.timer.now();
            let sleep = due.map(|due| {
                let wait_us = due.saturating_sub(now.utc.0).max(1_000_000);
                self.timer.sleep_until(MonoUs(now.mono.0.saturating_add(wait_us.unsigned_abs())))
            });
            drop(awake);
            let slept = async {
                match sleep {
                    Some(sleep) => sleep.await,
                    None => std::future::pending().await,
                }
            };
            awake = tokio::select! {
                () = stop.cancelled() => return,
                token = slept => token,
                is_over = pass_event(&mut events) => match is_over {
                    true => self.timer.busy("reports"),
                    // The hub is gone: the server ends.
                    false => return stop.cancelled().await,
                },
            };
        }
    }

    /// Writes what is due. When to look again, if anything is known to come.
    async fn write(&self, written: &mut BTreeSet<i64>) -> Option<i64> {
        let now = self.timer.now().utc;
        let passes = match self.store.passes_ended(PASSES).await {
            Ok(passes) => passes,
            Err(error) => {
                tracing::warn!(
                    error = &error as &dyn std::error::Error,
                    "Reports wait: the archive cannot be read."
                );
                return Some(now.0.saturating_add(AGAIN_US));
            }
        };
        // Nothing older comes back.
        if let Some(oldest) = passes.last() {
            *written = written.split_off(&oldest.id);
        }
        let mut next: Option<i64> = None;
        for pass in passes.iter().rev().filter(|pass| pass.station == self.identity.station.as_str()) {
            if written.contains(&pass.id) {
                continue;
            }
            let end_us = pass.los_at_us.or(pass.ended_at_us).unwrap_or(pass.aos_at_us);
            let due = end_us.saturating_add(AFTER_LOS_US);
            let again = if due > now.0 {
                Some(due)
            } else {
                let name = file_name(pass.id, &pass.satellite, Time::from_unix_us(pass.aos_at_us));
                match self.write_one(pass.id, name, now).await {
                    Ok(()) => {
                        written.insert(pass.id);
                        None
                    }
                    Err(error) => {
                        let id = pass.id;
                        tracing::warn!(pass = id, %error, "The report of pass {id} could not be written: {error}");
                        Some(now.0.saturating_add(AGAIN_US))
                    }
                }
            };
            next = next.into_iter().chain(again).min();
        }
        next
    }

    async fn write_one(&self, pass: i64, name: String, now: UtcUs) -> Result<(), String> {
        let folder = self.folder.clone();
        if is_written(&folder, &name) {
            return Ok(());
        }
        let report = pass_report(&self.store, &self.identity, pass, now).await;
        let Some(report) = report.map_err(|error| error.to_string())? else { return Ok(()) };
        let done = tokio::task::spawn_blocking(move || write_pass(&folder, &name, &report)).await;
        let done = done.map_err(|error| error.to_string())?;
        done.map_err(|error| format!("{}: {error}", self.folder.display()))
    }
}

/// Waits for news of a pass; `false` when there will be none any more.
async fn pass_event(events: &mut broadcast::Receiver<Arc<StoredEvent>>) -> bool {
    loop {
        match events.recv().await {
            Ok(event) if event.record.kind == EventKind::Pass => return true,
            Ok(_) => {}
            // What was missed may have been a pass.
            Err(RecvError::Lagged(_)) => return true,
            Err(RecvError::Closed) => return false,
        }
    }
}
