//! One task for each target: takes up what was received, sends it one by one, writes down what became of each.

use std::sync::Arc;
use std::time::Duration;

use mission::alert::{AlertKind, Condition};
use mission::{Level, MonoUs, SatelliteId, UtcUs};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use super::form::{Form, Place, Sender};
use super::handle::ForwardsHandle;
use super::target::{Fate, Target};
use crate::alerts::AlertsHandle;
use crate::clock::{BusyToken, Timer};
use crate::config::{Config, ForwardSection};
use crate::lifecycle::Lifecycle;
use crate::storage::{ForwardRow, ForwardState, ForwardWish, Store, StoreError};

/// It looks at least so often.
const LOOK_US: i64 = 15_000_000;
/// After so many failures in a row the failure is an alert.
const FAILURES_TOLD: u32 = 3;
/// The first pause after a failure, and the longest, seconds.
const PAUSE_S: (u64, u64) = (10, 3_600);
/// What is under way when the server ends may take so long.
const LAST: Duration = Duration::from_secs(3);

/// What it needs.
pub(crate) struct ForwardParts<'a> {
    pub(crate) config: &'a Config,
    pub(crate) store: &'a Store,
    pub(crate) timer: &'a Arc<dyn Timer>,
    pub(crate) alerts: Option<&'a AlertsHandle>,
}

/// Starts a task for each target of a configuration that was checked.
pub(crate) fn spawn(parts: &ForwardParts<'_>, life: &Lifecycle) -> ForwardsHandle {
    let config = parts.config;
    let of = |section: &ForwardSection| (section.clone(), sender(config, section));
    let targets: Vec<_> = config.forward.iter().map(of).collect();
    let (handle, news) = ForwardsHandle::new(parts.store.clone(), Arc::clone(parts.timer), targets.clone());
    for ((section, sender), news) in targets.into_iter().zip(news) {
        // Checked before.
        let Ok(url) = section.parsed() else { continue };
        let forwarder = Forwarder {
            wish: wish(config, &section),
            target: Target::new(&section, url, sender),
            store: parts.store.clone(),
            timer: Arc::clone(parts.timer),
            handle: handle.clone(),
            alerts: parts.alerts.cloned(),
            news,
            pace_us: 60_000_000 / i64::from(section.per_minute.max(1)),
            not_before: UtcUs(i64::MIN),
            failures: 0,
            settled: false,
            unkept: None,
        };
        let (stop, awake) = (life.soft.clone(), parts.timer.busy("forward"));
        life.spawn(format!("frames to {}", section.name), async move {
            forwarder.run(awake, stop).await;
            Ok(())
        });
    }
    handle
}

fn sender(config: &Config, section: &ForwardSection) -> Sender {
    let number = |satellite: &crate::config::SatelliteSection| {
        Some((SatelliteId::new(&satellite.name).ok()?, satellite.norad_cat_id?))
    };
    Sender {
        kind: section.kind,
        place: config
            .station
            .latitude_deg
            .zip(config.station.longitude_deg)
            .map(|(latitude_deg, longitude_deg)| Place { latitude_deg, longitude_deg }),
        numbers: config.satellites.iter().filter_map(number).collect(),
        simulated: config.is_simulated(),
    }
}

fn wish(config: &Config, section: &ForwardSection) -> ForwardWish {
    let own = [&config.station.call_sign, &config.station.name];
    let receiver = section.receiver.clone();
    let receiver = receiver.or_else(|| own.into_iter().find(|name| !name.trim().is_empty()).cloned());
    ForwardWish {
        target: section.name.clone(),
        satellites: section.satellites.clone(),
        own_boards: section.own_boards,
        receiver: receiver.unwrap_or_default(),
        since_us: section.since().map(|since| since.0),
        dry: !section.live,
    }
}

struct Forwarder {
    wish: ForwardWish,
    target: Target,
    store: Store,
    timer: Arc<dyn Timer>,
    handle: ForwardsHandle,
    alerts: Option<AlertsHandle>,
    /// Somebody wants it to look now; the token holds a stepped clock until it has.
    news: mpsc::Receiver<BusyToken>,
    pace_us: i64,
    /// Nothing is sent before this.
    not_before: UtcUs,
    failures: u32,
    /// What an earlier life left under way was looked at.
    settled: bool,
    /// What became of one that the archive would not take yet.
    unkept: Option<ForwardRow>,
}

impl Forwarder {
    async fn run(mut self, mut awake: BusyToken, stop: CancellationToken) {
        while !stop.is_cancelled() {
            let next = match self.round(&stop).await {
                Ok(next) => next,
                Err(error) => {
                    let name = &self.target.name;
                    tracing::warn!(target = %name, %error, "what goes to {name} cannot be read or kept: {error}");
                    self.settled = false;
                    self.note(&Fate::NotNow(format!("the archive: {error}"), None));
                    self.later()
                }
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

    fn later(&self) -> UtcUs {
        self.timer.now().utc.plus(LOOK_US)
    }

    /// Takes up what is new and sends what is due; when to look again.
    async fn round(&mut self, stop: &CancellationToken) -> Result<UtcUs, StoreError> {
        if let Some(row) = self.unkept.clone() {
            self.store.keep_forward(&row).await?;
            self.unkept = None;
        }
        let mut place = self.store.forward_target(&self.target.name, self.wish.since_us.is_some()).await?;
        if !self.settled {
            self.settle().await?;
            self.settled = true;
        }
        let now = self.timer.now().utc;
        while self.store.take_up_forwards(&mut place, &self.wish, now).await? > 0 {
            if stop.is_cancelled() {
                return Ok(now);
            }
        }
        if place.paused_by.is_some() || self.wish.dry {
            return Ok(self.later());
        }
        let waiting = self.store.forwards_in(&self.target.name, ForwardState::Waiting).await?;
        for row in waiting {
            let now = self.timer.now().utc;
            if self.not_before > now || stop.is_cancelled() {
                return Ok(self.not_before);
            }
            // Somebody may have paused it meanwhile, and waits for nothing more to leave.
            let place = self.store.find_forward_target(&self.target.name).await?;
            if place.is_none_or(|place| place.paused_by.is_some()) {
                return Ok(self.later());
            }
            self.not_before = now.plus(self.pace_us);
            self.one(row, stop).await?;
        }
        Ok(if self.not_before > now { self.not_before } else { self.later() })
    }

    /// The server died while these were under way.
    async fn settle(&self) -> Result<(), StoreError> {
        loop {
            let left = self.store.forwards_in(&self.target.name, ForwardState::Sending).await?;
            for row in &left {
                let state = if self.target.knows_repetition() {
                    ForwardState::Waiting
                } else {
                    ForwardState::Unknown
                };
                let error = Some("the server ended while it was on its way".to_owned());
                let row = ForwardRow { state: state.name().to_owned(), error, ..row.clone() };
                self.store.keep_forward(&row).await?;
            }
            if left.is_empty() {
                return Ok(());
            }
        }
    }

    /// Sends one: marked as under way before, and what became of it after.
    async fn one(&mut self, row: ForwardRow, stop: &CancellationToken) -> Result<(), StoreError> {
        let form = match self.store.forward_subject(&row).await {
            Ok(subject) => self.target.sender.form(&row, &subject),
            // The others are not to wait for it.
            Err(error @ StoreError::Damaged { .. }) => Err(format!("it cannot be read: {error}")),
            Err(error) => return Err(error),
        };
        let form = match form {
            Ok(form) => form,
            Err(why) => return self.keep(row, &Fate::Unwanted(why)).await,
        };
        let row = ForwardRow {
            state: ForwardState::Sending.name().to_owned(),
            attempts: row.attempts.saturating_add(1),
            ..row
        };
        self.store.keep_forward(&row).await?;
        let fate = self.attempt(&row, &form, stop).await;
        let fate = match fate {
            Fate::Unsure(why) if self.target.knows_repetition() => Fate::NotNow(why, None),
            fate => fate,
        };
        self.note(&fate);
        self.keep(row, &fate).await
    }

    /// Waits for the answer, but not for long when the server ends.
    async fn attempt(&self, row: &ForwardRow, form: &Form, stop: &CancellationToken) -> Fate {
        let sending = self.target.send(row, form, self.timer.now().utc);
        tokio::pin!(sending);
        tokio::select! {
            fate = &mut sending => fate,
            () = stop.cancelled() => {
                let ended = || Fate::Unsure("the server ended before the answer came".into());
                crate::clock::within(LAST, sending).await.unwrap_or_else(ended)
            }
        }
    }

    async fn keep(&mut self, row: ForwardRow, fate: &Fate) -> Result<(), StoreError> {
        let (state, error) = match fate {
            Fate::Taken => (ForwardState::Sent, None),
            Fate::Unwanted(why) => (ForwardState::Refused, Some(why)),
            Fate::NotNow(why, _) => (ForwardState::Waiting, Some(why)),
            Fate::Unsure(why) => (ForwardState::Unknown, Some(why)),
        };
        let name = &self.target.name;
        if let Some(why) = error {
            tracing::warn!(target = %name, frame = row.frame, state = state.name(), "frame {} to {name}: {}: {why}", row.frame, state.name());
        }
        let sent_at_us = (state == ForwardState::Sent).then(|| self.timer.now().utc.0);
        let row = ForwardRow { state: state.name().to_owned(), error: error.cloned(), sent_at_us, ..row };
        let kept = self.store.keep_forward(&row).await;
        if kept.is_err() {
            self.unkept = Some(row);
        }
        kept
    }

    /// Failures make pauses, and alerts when there are many.
    fn note(&mut self, fate: &Fate) {
        let name = &self.target.name;
        let (why, pause_s) = match fate {
            Fate::Taken | Fate::Unwanted(_) => {
                self.failures = 0;
                self.handle.note(name, None);
                self.report(None);
                return;
            }
            Fate::NotNow(why, pause_s) => (why, *pause_s),
            Fate::Unsure(why) => (why, None),
        };
        self.failures = self.failures.saturating_add(1);
        let own = PAUSE_S.0.saturating_mul(1 << (self.failures - 1).min(20)).min(PAUSE_S.1);
        let pause_us = i64::try_from(pause_s.unwrap_or(0).max(own)).unwrap_or(0).saturating_mul(1_000_000);
        self.not_before = self.timer.now().utc.plus(pause_us);
        self.handle.note(name, Some(why));
        if self.failures >= FAILURES_TOLD {
            let message = format!("frames to {name} do not go through: {why}");
            let condition = Condition::new(AlertKind::Delivery, name, Level::Warning, message);
            self.report(Some(condition));
        }
    }

    fn report(&self, found: Option<Condition>) {
        if let Some(alerts) = &self.alerts {
            alerts.report(&format!("forward {}", self.target.name), found);
        }
    }
}
