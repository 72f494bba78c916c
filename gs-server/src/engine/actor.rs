//! The loop around the station.

use std::collections::HashMap;
use std::sync::Arc;

use mission::port::ReservedFrame;
use mission::reception::{NotTaken, Taken};
use mission::{
    Effect, Entropy, FrameId, Input, Lease, MaybeRadiated, MonoUs, Now, Snapshot, Station, StationConfig,
    TxId,
};
use tokio::sync::{mpsc, oneshot};
use tokio_util::sync::CancellationToken;

use super::background::{Background, Outcome, ReserveWork};
use super::handle::{EngineHandle, INTENTS, PROBES, Probe, Request};
use super::intents::Intents;
use super::log;
use super::message::{EngineInbox, EngineMessage, INBOX, LinkCommand, LinkPort};
use super::retry::Retry;
use super::watch::StatusView;
use crate::clock::{BusyToken, Timer, kernel_says_synchronised};
use crate::config::ClockSetting;
use crate::hub::Hub;
use crate::ops::metrics::Metrics;
use crate::storage::{Store, StoreError};

/// How often the kernel is asked about its clock.
const CLOCK_CHECK_US: u64 = 30_000_000;

/// What the engine is made of.
pub struct EngineParts {
    /// The station, its satellites and links.
    pub station: StationConfig,
    /// What was stored; see [`Store::snapshot`].
    pub snapshot: Snapshot,
    /// What the reserve kept; see [`Store::reserve_read`].
    pub recovered: Vec<ReservedFrame>,
    /// What other stations heard meanwhile; see [`Store::images_elsewhere`].
    pub elsewhere: Vec<(FrameId, ReservedFrame)>,
    /// Where records go.
    pub store: Store,
    /// The clock.
    pub timer: Arc<dyn Timer>,
    /// Who says that it is right.
    pub clock: ClockSetting,
    /// Randomness for nonces and padding.
    pub entropy: Box<dyn Entropy>,
    /// Where committed events go.
    pub hub: Hub,
    /// The links' inboxes.
    pub links: Vec<LinkPort>,
}

/// Why the engine ended before it was told to.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// A task of storage ended without an answer.
    #[error("storage died in the middle of its work")]
    Storage(#[source] tokio::task::JoinError),
    /// Another server works as this station, or one took what this one had under way.
    #[error(
        "the database knows this server no longer; what it heard since is in the reserve, start it again"
    )]
    Replaced,
}

/// The actor.
pub(crate) struct Engine {
    station: Station,
    store: Store,
    timer: Arc<dyn Timer>,
    next_clock_check: Option<MonoUs>,
    hub: Hub,
    links: Vec<LinkPort>,
    inbox: mpsc::Receiver<(EngineMessage, BusyToken)>,
    requests: mpsc::Receiver<Request>,
    probes: mpsc::Receiver<Probe>,
    metrics: Metrics,
    intents: Intents,
    status: StatusView,
    background: Background,
    retry: Retry,
    replaced: bool,
    deliveries: Deliveries,
}

/// Who waits for the answer to a delivery; as many as the inbox holds and the archive is busy with.
#[derive(Default)]
struct Deliveries {
    last: u64,
    answers: HashMap<u64, oneshot::Sender<Result<Taken, NotTaken>>>,
}

impl Engine {
    /// The actor, the way in for links, and the handle for operators.
    pub(crate) fn new(parts: EngineParts) -> (Self, EngineInbox, EngineHandle) {
        let EngineParts { station, snapshot, recovered, elsewhere, store, timer, clock, entropy, hub, links } =
            parts;
        let now = timer.now();
        let mut station = Station::new(station, snapshot, entropy, now);
        let ours = recovered.iter().map(|frame| (frame.received_at, Input::Recovered(frame)));
        let theirs =
            elsewhere.iter().map(|(id, frame)| (frame.received_at, Input::Elsewhere { id: *id, frame }));
        let mut late: Vec<_> = ours.chain(theirs).collect();
        late.sort_by_key(|(at, _)| *at);
        for (_, input) in late {
            station.handle(now, input);
        }
        if store.is_shared() {
            for sealing in station.status(now).sealing {
                let lease = Lease::NotOurs { why: crate::leases::waiting(sealing.key) };
                station.handle(now, Input::Lease { key: sealing.key, lease });
            }
        }
        let vouched = timer.is_simulated() || clock == ClockSetting::Trust;
        station.handle(now, Input::Clock { synchronised: vouched });
        let (status, shown) = StatusView::new(&station, now);
        let (sender, inbox) = mpsc::channel(INBOX);
        let (requests_in, requests) = mpsc::channel(INTENTS);
        let (probes_in, probes) = mpsc::channel(PROBES);
        let metrics = Metrics::default();
        metrics.clock(vouched);
        let engine = Self {
            station,
            store,
            next_clock_check: (!vouched && clock == ClockSetting::Kernel).then_some(now.mono),
            hub,
            links,
            inbox,
            requests,
            probes,
            metrics: metrics.clone(),
            intents: Intents::default(),
            status,
            background: Background::default(),
            retry: Retry::default(),
            replaced: false,
            deliveries: Deliveries::default(),
            timer: Arc::clone(&timer),
        };
        let inbox = EngineInbox { sender, timer: Arc::clone(&timer) };
        let handle = EngineHandle { requests: requests_in, probes: probes_in, metrics, status: shown, timer };
        (engine, inbox, handle)
    }

    /// Works until `finish` and everything is durable. After `stop` nothing new is radiated and no intent is taken.
    ///
    /// # Errors
    /// [`EngineError`] when a part of it died.
    pub(crate) async fn run(
        mut self,
        stop: CancellationToken,
        finish: CancellationToken,
    ) -> Result<(), EngineError> {
        let mut awake = self.timer.busy("engine");
        let mut stopped = false;
        loop {
            let now = self.timer.now();
            self.carry_out(now);
            let finishing = finish.is_cancelled();
            if self.status.look(&self.station, now, finishing) {
                self.hub.ring();
            }
            if finishing && self.is_drained() {
                return Ok(());
            }
            if self.replaced && self.background.is_idle() {
                return Err(EngineError::Replaced);
            }
            let due = [
                self.station.next_wakeup(),
                self.status.due(self.station.is_settled()),
                self.next_clock_check,
            ];
            let sleep = due.into_iter().flatten().min().map(|at| self.timer.sleep_until(at));
            drop(awake);
            awake = tokio::select! {
                biased;
                done = self.background.next() => {
                    let (outcome, busy) = done.map_err(EngineError::Storage)?;
                    self.take_outcome(outcome);
                    busy
                }
                Some((message, busy)) = self.inbox.recv() => {
                    self.take_message(message);
                    busy
                }
                Some(request) = self.requests.recv(), if !stopped => {
                    let busy = request.busy.clone();
                    self.take_request(request);
                    busy
                }
                Some(Probe { answer, busy }) = self.probes.recv() => {
                    let _ = answer.send(busy.clone());
                    busy
                }
                busy = async { match sleep { Some(sleep) => sleep.await, None => std::future::pending().await } } => {
                    self.take_time();
                    busy
                }
                () = stop.cancelled(), if !stopped => {
                    stopped = true;
                    // Whoever waits in the queue sees its answer dropped: that means stopping.
                    self.requests.close();
                    while self.requests.try_recv().is_ok() {}
                    self.handle(Input::Stop);
                    self.timer.busy("engine")
                }
                () = finish.cancelled(), if !finishing => self.timer.busy("engine"),
            };
        }
    }

    fn is_drained(&self) -> bool {
        self.inbox.is_empty()
            && self.background.is_idle()
            && (self.station.is_settled() || self.station.status(self.timer.now()).storage.failing.is_some())
    }

    fn handle(&mut self, input: Input<'_>) {
        self.station.handle(self.timer.now(), input);
        self.status.note();
    }

    fn take_message(&mut self, message: EngineMessage) {
        match message {
            EngineMessage::Bytes { link, bytes, source, received } => {
                self.metrics.engine_input(self.timer.now().mono.since(received.mono));
                self.handle(Input::Bytes { link: &link, bytes: &bytes, source, received });
            }
            EngineMessage::Elsewhere { id, frame } => self.handle(Input::Elsewhere { id, frame: &frame }),
            EngineMessage::Outside { receptions, answer } => {
                self.deliveries.last += 1;
                let delivery = self.deliveries.last;
                self.deliveries.answers.insert(delivery, answer);
                self.handle(Input::Outside { delivery, receptions: &receptions });
            }
            EngineMessage::Link { link, state } => self.handle(Input::Link { link: &link, state }),
            EngineMessage::TxStarted(tx) => self.handle(Input::TxStarted(tx)),
            EngineMessage::TxDone { tx, airtime_us, measured } => {
                self.handle(Input::TxDone { tx, airtime_us, measured });
            }
            EngineMessage::TxFailed { tx, radiated, reason } => {
                self.handle(Input::TxFailed { tx, radiated, reason: &reason });
            }
            EngineMessage::View { satellite, in_view } => {
                self.handle(Input::View { satellite: &satellite, in_view });
            }
            EngineMessage::Notice { kind, level, message } => {
                self.handle(Input::Notice { kind, level, message: &message });
            }
            EngineMessage::Lease { key, lease } => self.handle(Input::Lease { key, lease }),
            EngineMessage::Antenna { fault } => self.handle(Input::Antenna { fault: fault.as_deref() }),
        }
    }

    fn take_request(&mut self, request: Request) {
        if let Some((intent, principal, key)) = self.intents.take(request) {
            let store = self.store.clone();
            self.background.start(self.timer.busy("looking an intent up"), async move {
                Outcome::LookedUp { intent, result: store.find_or_claim_intent(&principal, &key).await }
            });
        }
    }

    fn take_outcome(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::Persisted { batch, result: Ok(events) } => {
                self.retry.done();
                for event in events {
                    log::event(&event);
                    self.hub.publish(event);
                }
                self.handle(Input::PersistDone(batch));
            }
            Outcome::Persisted { batch, result: Err(error) } => {
                let reason = whole(&error);
                self.metrics.not_stored();
                self.replaced |= matches!(error, StoreError::Replaced);
                let again_us = self.retry.failed(batch, &reason, self.timer.pace());
                self.handle(Input::PersistFailed { batch, reason: &reason, again_us });
            }
            Outcome::Witness { key, counter, result: Ok(()) } => {
                self.handle(Input::WitnessDone { key, counter })
            }
            Outcome::Witness { key, result: Err(error), .. } => {
                let reason = whole(&error);
                tracing::error!(%key, "the witness of key {key} cannot be raised: {reason}");
                self.handle(Input::WitnessFailed { key, reason: &reason });
            }
            Outcome::LookedUp { intent, result } => {
                let found = result.map_err(|error| match error {
                    StoreError::Claimed => tracing::debug!("{error}"),
                    error => tracing::error!("an intent cannot be looked up: {}", whole(&error)),
                });
                if let Some(envelope) = self.intents.looked_up(intent, found) {
                    self.handle(Input::Intent(envelope));
                }
            }
            Outcome::Reserve { refused: Some(reason) } => {
                self.handle(Input::ReserveFailed { reason: &reason })
            }
            Outcome::Reserve { refused: None } => {}
            Outcome::Clock { synchronised } => {
                self.metrics.clock(synchronised);
                self.handle(Input::Clock { synchronised });
            }
        }
    }

    fn take_time(&mut self) {
        let now = self.timer.now().mono;
        if self.next_clock_check.is_some_and(|at| at <= now) {
            self.next_clock_check = Some(now.plus(CLOCK_CHECK_US));
            self.background.start(self.timer.busy("asking the kernel for its clock"), async {
                Outcome::Clock { synchronised: kernel_says_synchronised().await }
            });
        }
        if self.station.next_wakeup().is_some_and(|at| at <= now) {
            self.handle(Input::Wake);
        }
    }

    fn carry_out(&mut self, now: Now) {
        while let Some(effect) = self.station.next_effect() {
            match effect {
                Effect::Persist(batch) => {
                    let (store, metrics) = (self.store.clone(), self.metrics.clone());
                    let timer = Arc::clone(&self.timer);
                    self.background.start(self.timer.busy("storing a batch"), async move {
                        let began = timer.now().mono;
                        let result = store.apply(&batch).await;
                        if result.is_ok() {
                            metrics.stored(&batch, timer.now().mono.since(began));
                        }
                        Outcome::Persisted { batch: batch.id, result }
                    });
                }
                Effect::Witness { key, counter } => {
                    let store = self.store.clone();
                    self.background.start(self.timer.busy("raising the witness"), async move {
                        Outcome::Witness { key, counter, result: store.raise_witness(key, counter).await }
                    });
                }
                Effect::Transmit(transmit) => {
                    let tx = transmit.tx;
                    let busy = self.timer.busy("frame on its way to the link");
                    let sent = match self.links.iter().find(|port| port.link == transmit.link) {
                        Some(port) => port.sender.try_send((LinkCommand::Transmit(transmit), busy)).is_ok(),
                        None => false,
                    };
                    if !sent {
                        self.transmit_failed(now, tx);
                    }
                }
                Effect::Reply { intent, result } => self.intents.reply(intent, result),
                Effect::Taken { delivery, result } => {
                    if let Some(answer) = self.deliveries.answers.remove(&delivery) {
                        // Whoever delivered may have gone away; what was taken is durable all the same.
                        let _ = answer.send(result);
                    }
                }
                Effect::Reserve(frame) => {
                    if !self.background.queue_reserve(ReserveWork::Push(Box::new(frame))) {
                        self.handle(Input::ReserveFailed { reason: "the disk is too slow" });
                    }
                }
                Effect::ReserveClear => {
                    let _ = self.background.queue_reserve(ReserveWork::Clear);
                }
            }
        }
        let timer = Arc::clone(&self.timer);
        self.background.reserve_step(&self.store, || timer.busy("reserve"));
    }

    fn transmit_failed(&mut self, now: Now, tx: TxId) {
        let reason = "the link has ended";
        self.station.handle(now, Input::TxFailed { tx, radiated: MaybeRadiated::No, reason });
        self.status.note();
    }
}

/// An error with all its causes, as one line.
fn whole(error: &dyn std::error::Error) -> String {
    let mut line = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        line.push_str(": ");
        line.push_str(&cause.to_string());
        source = cause.source();
    }
    line
}
