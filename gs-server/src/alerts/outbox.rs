//! One outbox for each target, so that one that hangs holds up nobody else.
//!
//! Its queue is the archive: what waits there is sent, oldest due first, and what became of it is written down. A far
//! end that is not reached is left alone until the message that failed is due again.

use std::collections::BTreeSet;
use std::sync::{Arc, PoisonError};

use mission::alert::{AlertKind, Condition, Policy, retry_at};
use mission::{Level, MonoUs, Now, UtcUs};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use super::handle::AlertsHandle;
use super::message;
use super::target::{SendError, Target};
use crate::clock::{BusyToken, Timer};
use crate::storage::{DeliveryRow, DeliveryState, Store, StoreError};

/// It looks at least so often, for the end of the quiet hours and a clock that was set.
const LOOK_US: i64 = 60_000_000;
/// After so many failures in a row the failure is an alert itself.
const FAILURES_TOLD: u32 = 3;

pub(super) struct Outbox {
    pub(super) target: Arc<Target>,
    pub(super) policy: Arc<Policy>,
    pub(super) store: Store,
    pub(super) timer: Arc<dyn Timer>,
    pub(super) handle: AlertsHandle,
    /// There is something new to send; the token holds a stepped clock until it is looked at.
    pub(super) news: mpsc::Receiver<BusyToken>,
    pub(super) failures: u32,
    /// Messages that went out before the archive took them.
    pub(super) sent_unkept: BTreeSet<String>,
}

impl Outbox {
    /// Sends until `stop`. An attempt under way is broken off then, and made again by the next life.
    pub(super) async fn run(mut self, mut awake: BusyToken, stop: CancellationToken) {
        loop {
            let next = tokio::select! {
                next = self.round() => next,
                () = stop.cancelled() => return,
            };
            let now = self.timer.now();
            let wait = next.0.saturating_sub(now.utc.0).clamp(0, LOOK_US).unsigned_abs();
            let sleep = self.timer.sleep_until(MonoUs(now.mono.0.saturating_add(wait)));
            drop(awake);
            awake = tokio::select! {
                () = stop.cancelled() => return,
                Some(busy) = self.news.recv() => busy,
                busy = sleep => busy,
            };
        }
    }

    /// Sends what is due; when to look again.
    async fn round(&mut self) -> UtcUs {
        let later = |now: Now| now.utc.plus(LOOK_US);
        match self.try_round().await {
            Ok(next) => next.unwrap_or_else(|| later(self.timer.now())),
            Err(error) => {
                tracing::warn!(target = %self.target.name, %error, "the messages to {} cannot be read or kept: {error}", self.target.name);
                later(self.timer.now())
            }
        }
    }

    /// What is grave goes out even while the archive takes nothing; it may be that of which there is to tell.
    async fn urgent(&mut self) {
        let urgent = self.handle.urgent.lock().unwrap_or_else(PoisonError::into_inner).clone();
        for delivery in urgent {
            if delivery.target != self.target.name || self.sent_unkept.contains(&delivery.message_id) {
                continue;
            }
            let letter = message::unkept(&delivery, &self.handle.station, self.handle.simulated);
            let result = self.target.send(&letter).await;
            self.handle.note(&self.target.name, result.as_ref().err());
            if result.is_ok() {
                self.sent_unkept.insert(delivery.message_id);
            }
        }
    }

    async fn try_round(&mut self) -> Result<Option<UtcUs>, StoreError> {
        self.urgent().await;
        let now = self.timer.now().utc;
        let heeds = self.policy.target(&self.target.name).is_none_or(|target| target.quiet);
        if !(heeds && self.policy.is_quiet(now)) && self.store.has_held_deliveries(&self.target.name).await? {
            let of = (self.handle.station.as_str(), self.handle.simulated);
            let id = uuid::Uuid::new_v4().to_string();
            self.store
                .digest_deliveries(&self.target.name, &id, now, |held| message::digest(of, held))
                .await?;
        }
        let rows = self.store.waiting_deliveries(&self.target.name).await?;
        let mut next: Option<UtcUs> = None;
        for row in rows {
            let now = self.timer.now().utc;
            if row.next_at_us > now.0 {
                next = Some(UtcUs(row.next_at_us));
                break;
            }
            let (row, go_on) = self.attempt(row).await?;
            if row.state == DeliveryState::Waiting.name() {
                next = Some(UtcUs(row.next_at_us));
            }
            if !go_on {
                return Ok(next);
            }
        }
        Ok(next)
    }

    /// One attempt, and what became of it; whether the next message may be tried.
    async fn attempt(&mut self, row: DeliveryRow) -> Result<(DeliveryRow, bool), StoreError> {
        let alert = match row.alert {
            Some(id) => self.store.alert(id).await?,
            None => None,
        };
        let letter = message::letter(&row, alert.as_ref(), self.handle.simulated);
        let result = match self.sent_unkept.remove(&row.message_id) {
            true => Ok(()),
            false => self.target.send(&letter).await,
        };
        let now = self.timer.now().utc;
        let attempts = row.attempts.saturating_add(1);
        let name = &self.target.name;
        let row = match &result {
            Ok(()) => DeliveryRow {
                state: DeliveryState::Sent.name().to_owned(),
                sent_at_us: Some(now.0),
                error: None,
                attempts,
                ..row
            },
            Err(error) => {
                tracing::warn!(target = %name, attempts, %error, "a message to {name} did not go through: {error}");
                let made = UtcUs(row.made_at_us);
                let next = retry_at(made, u32::try_from(attempts).unwrap_or(u32::MAX), now);
                let state = if next.is_some() { DeliveryState::Waiting } else { DeliveryState::GivenUp };
                DeliveryRow {
                    state: state.name().to_owned(),
                    next_at_us: next.unwrap_or(now).0,
                    error: Some(error.to_string()),
                    attempts,
                    ..row
                }
            }
        };
        self.store.keep_delivery(&row).await?;
        self.note(result.as_ref().err());
        Ok((row, !matches!(result, Err(SendError::Unreached(_) | SendError::Secret(_)))))
    }

    /// A target that takes nothing is an alert itself.
    fn note(&mut self, error: Option<&SendError>) {
        let name = &self.target.name;
        self.handle.note(name, error);
        self.failures = if error.is_some() { self.failures.saturating_add(1) } else { 0 };
        let told = error.filter(|_| self.failures >= FAILURES_TOLD).map(|error| {
            let message = format!("messages to {name} do not go through: {error}");
            Condition::new(AlertKind::Delivery, name, Level::Warning, message)
        });
        if told.is_some() || error.is_none() {
            self.handle.report(&format!("delivery {name}"), told);
        }
    }
}
