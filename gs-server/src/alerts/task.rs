//! The task: looks, keeps, tells the outboxes, answers operators.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use mission::alert::{AlertKind, Alerts, Changes, Condition, Policy};
use mission::record::{AuditRecord, EventKind, EventRecord, Record, Subject};
use mission::{Accepted, IntentReceipt, Level, MonoUs, Now, SatelliteId, StationId, UtcUs};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use super::gather::{Gatherer, Watched};
use super::handle::{Acted, Action, ActionFailure, AlertsHandle, Request};
use super::message;
use super::outbox::Outbox;
use super::target::Target;
use crate::clock::{BusyToken, Timer};
use crate::config::{Config, ConfigError};
use crate::engine::EngineHandle;
use crate::hub::Hub;
use crate::lifecycle::Lifecycle;
use crate::storage::{AlertBatch, EventQuery, FinalRun, Page, Scope, Store, StoreError, StoredEvent};

/// Looks are at least this far apart, and this far in a pass, microseconds of the station's clock.
const LOOK_US: u64 = 2_000_000;
/// It looks at least so often, whatever is told or due.
const LOOK_ANYHOW_US: u64 = 60_000_000;
/// Batches that wait for the archive; while they do, nothing new is looked at.
const UNKEPT: usize = 16;
/// Events read from the archive at once.
const EVENTS_PAGE: u32 = 500;
/// After so many events it is written down how far they were looked at, whatever they said.
const EVENTS_UNKEPT: i64 = 5_000;

/// Whom the task asks.
pub(crate) struct AlertsParts<'a> {
    pub(crate) config: &'a Config,
    pub(crate) watched: Watched,
    pub(crate) store: Store,
    pub(crate) engine: EngineHandle,
    pub(crate) hub: Hub,
    pub(crate) timer: Arc<dyn Timer>,
}

/// The task itself.
pub(crate) struct AlertsTask {
    policy: Arc<Policy>,
    station: StationId,
    store: Store,
    engine: EngineHandle,
    hub: Hub,
    timer: Arc<dyn Timer>,
    inbox: mpsc::Receiver<Request>,
    /// Something has changed.
    bell: mpsc::Receiver<BusyToken>,
    gatherer: Gatherer,
    handle: AlertsHandle,
    /// One for each outbox; a word that nobody has taken yet is enough.
    news: Vec<mpsc::Sender<BusyToken>>,
}

/// What it knows once the archive has told it.
struct Mind {
    alerts: Alerts,
    /// The last event that was looked at.
    events_through: i64,
    /// The last of which that was written down, or will be.
    events_kept: i64,
    /// The end of the last run that was looked at.
    runs_through: UtcUs,
    runs_stale: bool,
    /// There are events that could not be looked at yet.
    is_behind: bool,
    unkept: VecDeque<AlertBatch>,
}

impl AlertsTask {
    /// The task and its door.
    ///
    /// # Errors
    /// [`ConfigError`] that names the key.
    pub(crate) fn new(parts: AlertsParts<'_>) -> Result<(Self, AlertsHandle), ConfigError> {
        let AlertsParts { config, watched, store, engine, hub, timer } = parts;
        let policy = Arc::new(config.alerts.policy()?);
        let target = |(at, section)| {
            Target::new(section, &format!("alerts.targets[{at}]"), watched.station.as_str()).map(Arc::new)
        };
        let targets = config.alerts.targets.iter().enumerate().map(target).collect::<Result<Vec<_>, _>>()?;
        let (requests, inbox) = mpsc::channel(super::handle::REQUESTS);
        let handle = AlertsHandle {
            requests,
            targets: targets.into(),
            reported: Arc::default(),
            failing: Arc::default(),
            urgent: Arc::default(),
            tests: AlertsHandle::test_places(),
            timer: Arc::clone(&timer),
            station: watched.station.to_string(),
            simulated: config.is_simulated(),
            hub: hub.clone(),
        };
        let bell = hub.bell(Arc::clone(&timer), "alerts");
        let gatherer = Gatherer::new(config, &watched, store.folder(), Arc::clone(&handle.reported));
        let task = Self {
            policy,
            station: watched.station,
            store,
            engine,
            hub,
            timer,
            inbox,
            bell,
            gatherer,
            handle: handle.clone(),
            news: Vec::new(),
        };
        Ok((task, handle))
    }

    /// Starts it with its outboxes.
    pub(crate) fn spawn(mut self, life: &Lifecycle) {
        for target in self.handle.targets.iter() {
            let (told, news) = mpsc::channel(1);
            self.news.push(told);
            let outbox = Outbox {
                target: Arc::clone(target),
                policy: Arc::clone(&self.policy),
                store: self.store.clone(),
                timer: Arc::clone(&self.timer),
                handle: self.handle.clone(),
                news,
                failures: 0,
                sent_unkept: BTreeSet::new(),
            };
            // Before anybody else can let a stepped clock go.
            let (awake, stop) = (self.timer.busy("outbox"), life.soft.clone());
            life.spawn(format!("alerts to {}", target.name), async move {
                outbox.run(awake, stop).await;
                Ok(())
            });
        }
        let (awake, stop) = (self.timer.busy("alerts"), life.soft.clone());
        life.spawn("alerts", async move {
            self.run(awake, stop).await;
            Ok(())
        });
    }

    async fn run(mut self, mut awake: BusyToken, stop: CancellationToken) {
        let mut mind: Option<Mind> = None;
        loop {
            if mind.is_none() {
                match self.remember().await {
                    Ok(read) => mind = Some(read),
                    Err(error) => {
                        tracing::warn!(%error, "alerts cannot be read from the archive; trying again: {error}");
                    }
                }
            }
            if let Some(mind) = &mut mind {
                self.look(mind).await;
            }
            let due = self.next_look(mind.as_ref());
            let request;
            match self.wait(awake, due, &stop).await {
                Some(told) => (awake, request) = told,
                None => return,
            }
            if let Some(request) = request {
                self.answer(mind.as_mut(), request).await;
            }
        }
    }

    /// When to look again if nothing is told before.
    fn next_look(&self, mind: Option<&Mind>) -> MonoUs {
        let now = self.timer.now();
        let Some(mind) = mind.filter(|mind| mind.unkept.is_empty() && !mind.is_behind && !mind.runs_stale)
        else {
            return now.mono.plus(LOOK_US);
        };
        if self.gatherer.stale.any() {
            return now.mono.plus(LOOK_US);
        }
        let judged = mission::alert::next_judgement(&self.engine.status(), now.utc);
        let due = [mind.alerts.next_due(now), judged].into_iter().flatten().min();
        let wait_us =
            due.map_or(LOOK_ANYHOW_US, |due| u64::try_from(due.0.saturating_sub(now.utc.0)).unwrap_or(0));
        now.mono.plus(wait_us.clamp(LOOK_US, LOOK_ANYHOW_US))
    }

    /// Waits until `due`, until shortly after the bell, or for a request. `None`: the server stops.
    async fn wait(
        &mut self,
        awake: BusyToken,
        due: MonoUs,
        stop: &CancellationToken,
    ) -> Option<(BusyToken, Option<Request>)> {
        let soon = self.timer.now().mono.plus(LOOK_US);
        let mut is_soon = due <= soon;
        let mut sleep = self.timer.sleep_until(due);
        drop(awake);
        loop {
            tokio::select! {
                () = stop.cancelled() => return None,
                busy = &mut sleep => return Some((busy, None)),
                request = self.inbox.recv() => return Some((self.timer.busy("alerts"), request)),
                Some(busy) = self.bell.recv() => {
                    if !is_soon {
                        is_soon = true;
                        sleep = self.timer.sleep_until(soon);
                    }
                    drop(busy);
                }
            }
        }
    }

    /// How things stood when the last life ended.
    async fn remember(&self) -> Result<Mind, StoreError> {
        let (open, last_id) = self.store.open_alerts().await?;
        let now = self.timer.now();
        let (events_through, runs_through) = match self.store.alert_progress().await? {
            Some(progress) => (progress.events_through, UtcUs(progress.runs_through_us)),
            // What an archive holds before alerts were kept is history.
            None => (self.store.last_event_seq().await?, now.utc),
        };
        let mut mind = Mind {
            alerts: Alerts::new(Policy::clone(&self.policy), open, last_id, now),
            events_through,
            events_kept: events_through,
            runs_through,
            runs_stale: true,
            is_behind: true,
            unkept: VecDeque::new(),
        };
        mind.keep_progress();
        Ok(mind)
    }

    /// One look at everything.
    async fn look(&mut self, mind: &mut Mind) {
        self.keep(mind).await;
        if mind.unkept.len() >= UNKEPT {
            return;
        }
        mind.is_behind = !self.take_events(mind).await;
        if mind.runs_stale {
            self.take_runs(mind).await;
        }
        let trouble = self.engine.metrics().what_upkeep_saw().backup_trouble;
        let trouble =
            trouble.map(|text| Condition::new(AlertKind::Backup, &self.handle.station, Level::Warning, text));
        self.handle.report("upkeep", trouble);
        let around = self.gatherer.look(&self.store, &self.timer).await;
        let now = self.timer.now();
        let status = self.engine.status();
        let conditions = mission::alert::judge(&status, around, &self.policy.thresholds, now.utc);
        let changes = mind.alerts.observe(now, &conditions);
        self.put(mind, now, changes);
        self.keep(mind).await;
    }

    /// Events since the last look; whether there are no more.
    async fn take_events(&mut self, mind: &mut Mind) -> bool {
        loop {
            let page = Page { after: Some(mind.events_through), before: None, limit: EVENTS_PAGE };
            // Of several stations on one archive each tells of its own.
            let scope = Scope { station: Some(self.station.to_string()), ..Scope::default() };
            let query = EventQuery { page, scope, ..EventQuery::default() };
            let Ok(found) = self.store.events(&query).await else { return false };
            for event in &found {
                self.take_event(mind, event);
            }
            if mind.events_through.saturating_sub(mind.events_kept) >= EVENTS_UNKEPT {
                mind.keep_progress();
            }
            if found.len() < EVENTS_PAGE as usize {
                return true;
            }
            if mind.unkept.len() >= UNKEPT {
                return false;
            }
        }
    }

    fn take_event(&mut self, mind: &mut Mind, event: &StoredEvent) {
        mind.events_through = event.sequence;
        let record = &event.record;
        match record.kind {
            EventKind::Limit => self.gatherer.stale.limits = true,
            EventKind::Pass => self.gatherer.stale.passes = true,
            EventKind::Plan => mind.runs_stale = true,
            _ => {}
        }
        if record.level == Level::Normal || record.kind == EventKind::Alert {
            return;
        }
        let whom = record
            .satellite
            .as_ref()
            .map(ToString::to_string)
            .or_else(|| record.link.as_ref().map(ToString::to_string))
            .unwrap_or_else(|| record.station.to_string());
        let condition = Condition {
            kind: AlertKind::Event,
            subject: format!("{} {whom}", record.kind.name()),
            satellite: record.satellite.clone(),
            level: record.level,
            message: record.message.clone(),
        };
        let now = self.timer.now();
        let changes = mind.alerts.event(now, record.kind, &condition);
        self.put(mind, now, changes);
    }

    /// Runs of plans that are over since the last look.
    async fn take_runs(&mut self, mind: &mut Mind) {
        let Ok(runs) = self.store.runs_over_since(mind.runs_through).await else { return };
        mind.runs_stale = runs.len() >= 100;
        for run in runs {
            mind.runs_through = run.at;
            let now = self.timer.now();
            let changes = match plan_condition(&run) {
                Some(condition) => mind.alerts.happened(now, &condition),
                None => Changes::default(),
            };
            self.put(mind, now, changes);
        }
    }

    /// Puts changes into the queue to the archive.
    fn put(&self, mind: &mut Mind, now: Now, changes: Changes) {
        if !changes.is_empty() {
            let batch = self.batch(mind, now, changes);
            mind.events_kept = mind.events_through;
            mind.unkept.push_back(batch);
        }
    }

    fn batch(&self, mind: &Mind, now: Now, changes: Changes) -> AlertBatch {
        let of = (self.handle.station.as_str(), self.handle.simulated);
        let Changes { alerts, notices, events } = changes;
        let delivery = |notice: &mission::alert::Notice| {
            let alert = alerts.iter().find(|alert| alert.id == notice.alert)?;
            Some(message::delivery(of, alert, notice, now.utc))
        };
        let deliveries = notices.iter().filter_map(delivery).collect();
        let event = |(satellite, level, message): (Option<SatelliteId>, Level, String)| {
            Record::Event(EventRecord {
                at: now.utc,
                kind: EventKind::Alert,
                level,
                satellite,
                station: self.station.clone(),
                link: None,
                key: None,
                subject: Subject::default(),
                message,
            })
        };
        AlertBatch {
            alerts,
            deliveries,
            records: events.into_iter().map(event).collect(),
            progress: Some((mind.events_through, mind.runs_through.0)),
        }
    }

    /// Keeps what waits, in order; whether nothing waits any more.
    async fn keep(&self, mind: &mut Mind) -> bool {
        while let Some(batch) = mind.unkept.front() {
            match self.store.keep_alerts(batch).await {
                Ok(events) => {
                    let has_messages = !batch.deliveries.is_empty();
                    mind.unkept.pop_front();
                    events.into_iter().for_each(|event| self.hub.publish(event));
                    if has_messages {
                        self.tell_outboxes();
                    }
                }
                Err(error) => {
                    if !error.is_temporary() {
                        // It would be refused for ever, and everything behind it would wait.
                        tracing::error!(%error, "alerts cannot be kept: {error}");
                        mind.unkept.pop_front();
                        return false;
                    }
                    tracing::warn!(%error, "alerts cannot be kept at present; they wait: {error}");
                    if self.handle.set_urgent(&mind.unkept) {
                        self.tell_outboxes();
                    }
                    return false;
                }
            }
        }
        self.handle.set_urgent(&mind.unkept);
        true
    }

    fn tell_outboxes(&self) {
        for outbox in &self.news {
            // Full: it will look anyhow.
            let _ = outbox.try_send(self.timer.busy("outbox"));
        }
    }

    async fn answer(&self, mind: Option<&mut Mind>, request: Request) {
        let Request { answer, busy, .. } = request;
        let result = match mind {
            Some(mind) => {
                self.act(
                    mind,
                    request.id,
                    &request.action,
                    request.note.as_deref(),
                    (&request.who, &request.key, request.digest),
                )
                .await
            }
            None => Err(ActionFailure::Storage),
        };
        // Whoever asked may have hung up; what was done is done.
        let _ = answer.send((result, busy));
    }

    async fn act(
        &self,
        mind: &mut Mind,
        id: mission::AlertId,
        action: &Action,
        note: Option<&str>,
        (who, key, digest): (&mission::Principal, &str, [u8; 32]),
    ) -> Result<Acted, ActionFailure> {
        if !self.keep(mind).await {
            return Err(ActionFailure::Storage);
        }
        let row = i64::try_from(id.0).unwrap_or(i64::MAX);
        let found = self.store.find_intent(who, key).await.map_err(|_| ActionFailure::Storage)?;
        if let Some(found) = found {
            if found.digest != digest {
                return Err(ActionFailure::KeyReused);
            }
            let alert = self.store.alert(row).await.map_err(|_| ActionFailure::Storage)?;
            let gone = mission::alert::ActionError::NotOpen(id);
            return alert.map(|alert| Acted { alert, replayed: true }).ok_or(ActionFailure::Refused(gone));
        }
        let before = mind.alerts.clone();
        let now = self.timer.now();
        let changes = match action {
            Action::Acknowledge => mind.alerts.acknowledge(now, id, who, note),
            Action::Shelve { until } => mind.alerts.shelve(now, id, who, *until, note),
            Action::Unshelve => mind.alerts.unshelve(now, id, who),
            Action::Assign { to } => mind.alerts.assign(now, id, who, to.as_deref(), note),
        }?;
        let changed = changes.alerts.iter().find(|alert| alert.id == id).cloned();
        let mut batch = self.batch(mind, now, changes);
        batch.records.push(Record::Audit(AuditRecord {
            at: now.utc,
            who: who.clone(),
            action: action.verb(),
            detail: detail(id, action, note),
        }));
        batch.records.push(Record::Intent(IntentReceipt {
            principal: who.clone(),
            idempotency_key: key.to_owned(),
            digest,
            accepted: Accepted::Done,
            at: now.utc,
        }));
        mind.unkept.push_back(batch);
        if !self.keep(mind).await {
            // As if it had never been asked for.
            mind.unkept.pop_back();
            mind.alerts = before;
            return Err(ActionFailure::Storage);
        }
        let held = mind.alerts.open().find(|alert| alert.id == id).cloned();
        let gone = mission::alert::ActionError::NotOpen(id);
        let alert = changed.or(held).ok_or(ActionFailure::Refused(gone))?;
        Ok(Acted { alert, replayed: false })
    }
}

impl Mind {
    /// Writes down how far events and runs were looked at, with nothing besides.
    fn keep_progress(&mut self) {
        let progress = Some((self.events_through, self.runs_through.0));
        self.unkept.push_back(AlertBatch { progress, ..AlertBatch::default() });
        self.events_kept = self.events_through;
    }
}

fn detail(id: mission::AlertId, action: &Action, note: Option<&str>) -> String {
    let mut text = format!("alert {id}");
    match action {
        Action::Shelve { until } => text.push_str(&format!(" until {}", api::Time::from_unix_us(until.0))),
        Action::Assign { to: Some(to) } => text.push_str(&format!(" to {to}")),
        Action::Assign { to: None } => text.push_str(" to nobody"),
        Action::Acknowledge | Action::Unshelve => {}
    }
    if let Some(note) = note {
        text.push_str(&format!(": {note}"));
    }
    text
}

/// A run that did not come to its end, as a condition.
fn plan_condition(run: &FinalRun) -> Option<Condition> {
    let why = run.why.as_deref().map(|why| format!(": {why}")).unwrap_or_default();
    let aos = api::Time::from_unix_us(run.aos_at.0);
    let (level, what) = match (run.state.as_str(), run.outcome.as_deref()) {
        ("missed", _) => (Level::Warning, format!("missed its pass at {aos}{why}")),
        ("dropped", _) => (Level::Watch, format!("lost its pass at {aos}{why}")),
        (_, Some("aborted")) => (Level::Warning, format!("was broken off in the pass at {aos}{why}")),
        (_, Some("unfinished")) => (Level::Warning, format!("was not finished in the pass at {aos}")),
        (_, Some("out-of-time")) => (Level::Watch, format!("ran out of its time in the pass at {aos}")),
        _ => return None,
    };
    let message = format!("plan {} for {} {what}", run.plan, run.satellite);
    let condition = Condition::new(AlertKind::Plan, &run.plan, level, message);
    Some(match SatelliteId::new(&run.satellite) {
        Ok(satellite) => condition.of(&satellite),
        Err(_) => condition,
    })
}
