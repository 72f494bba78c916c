//! The actor that joins the radio driver, a port and the engine.
//!
//! The driver decides everything about the module; this loop carries its outputs to the port, the port's events to the
//! driver, and what was heard to the engine. It opens the port, notices when it goes, and looks for it again.

use std::sync::Arc;
use std::time::Duration;

use mission::{LinkState, MaybeRadiated, MonoUs, Now, Source, TxId};
use radio::driver::{AuxWiring, Driver, DriverInput, DriverOutput, DriverState, ModePins, Radiated};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::LinkParts;
use super::port::{AuxWatch, Connector, EVENTS, Events, Port, PortContext, PortEvent};
use crate::clock::{BusyToken, Timer, Wire, wall_sleep};
use crate::config::driver_config;
use crate::engine::{EngineInbox, EngineMessage, LinkCommand};

/// Between two looks for a port that is not there.
const LOOK_US: u64 = 500_000;
/// How long a frame that is being sent may take to finish when the link is told to stop.
const LAST_FRAME: Duration = Duration::from_millis(2_500);
/// Between two looks at the threads behind the port.
const WATCH: Duration = Duration::from_secs(1);

struct OpenPort {
    port: Box<dyn Port>,
    events: Events,
}

type Opening = JoinHandle<(Result<OpenPort, String>, BusyToken)>;

struct Link<C> {
    name: String,
    id: mission::LinkId,
    driver: Driver,
    connector: C,
    engine: EngineInbox,
    timer: Arc<dyn Timer>,
    wire: Option<Wire>,
    open: Option<OpenPort>,
    opening: Option<Opening>,
    reopen_at: Option<MonoUs>,
    shown: Option<LinkState>,
    /// What the driver found last: why it does not work.
    finding: Option<String>,
    /// Bytes from the far end that were taken from the queue, and how many of them to throw away.
    taken: u64,
    discard_until: u64,
    aux_watch: AuxWatch,
    stopping: bool,
}

/// Runs the link until `stop`.
pub(crate) async fn run<C: Connector>(parts: LinkParts, connector: C, stop: CancellationToken) {
    let LinkParts { id, section, engine, mut commands, timer, wire } = parts;
    let mut link = Link {
        name: id.to_string(),
        driver: Driver::new(driver_config(&section)),
        id,
        connector,
        engine,
        wire,
        open: None,
        opening: None,
        reopen_at: Some(timer.now().mono),
        shown: None,
        finding: None,
        taken: 0,
        discard_until: 0,
        aux_watch: AuxWatch::Off,
        stopping: false,
        timer,
    };
    let mut awake = link.timer.busy("link");
    let mut last_frame = None;
    loop {
        awake = link.step(awake, &mut commands, &stop, &mut last_frame).await;
        if link.stopping && link.open.is_none() && link.opening.is_none() {
            break;
        }
    }
    link.show(LinkState::Disabled).await;
    while let Ok((LinkCommand::Transmit(transmit), _)) = commands.try_recv() {
        link.refuse(transmit.tx, "the link is stopping").await;
    }
}

impl<C: Connector> Link<C> {
    /// Waits for one thing and handles it.
    async fn step(
        &mut self,
        awake: BusyToken,
        commands: &mut mpsc::Receiver<(LinkCommand, BusyToken)>,
        stop: &CancellationToken,
        last_frame: &mut Option<std::pin::Pin<Box<dyn Future<Output = ()> + Send>>>,
    ) -> BusyToken {
        let driver_at = self.driver.next_wakeup_us().map(MonoUs);
        let sleep =
            [driver_at, self.reopen_at].into_iter().flatten().min().map(|at| self.timer.sleep_until(at));
        drop(awake);
        let timer = Arc::clone(&self.timer);
        tokio::select! {
            biased;
            (event, busy) = next_event(&mut self.open) => {
                self.take_event(event).await;
                busy
            }
            Some((command, busy)) = commands.recv() => {
                self.take_command(command).await;
                busy
            }
            (opened, busy) = opened(&mut self.opening) => {
                self.opening = None;
                self.take_opened(opened).await;
                busy
            }
            busy = async { match sleep { Some(sleep) => sleep.await, None => std::future::pending().await } } => {
                self.take_time().await;
                busy
            }
            () = stop.cancelled(), if !self.stopping => {
                let busy = timer.busy("link");
                self.stopping = true;
                self.reopen_at = None;
                if self.driver.state() == DriverState::Sending {
                    *last_frame = Some(Box::pin(wall_sleep(LAST_FRAME)));
                } else {
                    self.close_down().await;
                }
                busy
            }
            () = async { match last_frame { Some(sleep) => sleep.await, None => std::future::pending().await } } => {
                let busy = timer.busy("link");
                *last_frame = None;
                self.close_down().await;
                busy
            }
            () = wall_sleep(WATCH), if self.open.is_some() => {
                let busy = timer.busy("link");
                if let Some(reason) = self.open.as_mut().and_then(|open| open.port.hangs()) {
                    self.lose(&reason).await;
                }
                busy
            }
        }
    }

    async fn take_event(&mut self, event: PortEvent) {
        match event {
            PortEvent::Bytes { bytes, received } => {
                let length = bytes.len() as u64;
                let skip = self.discard_until.saturating_sub(self.taken).min(length);
                self.taken += length;
                let kept = bytes.get(usize::try_from(skip).unwrap_or(usize::MAX)..).unwrap_or_default();
                if !kept.is_empty() {
                    self.drive(DriverInput::Bytes(kept), Some(received)).await;
                }
            }
            PortEvent::Drained => self.drive(DriverInput::Drained, None).await,
            PortEvent::Aux { idle } => self.drive(DriverInput::Aux { idle }, None).await,
            PortEvent::Lost { reason } => self.lose(&reason).await,
        }
        self.close_down_when_sent().await;
    }

    async fn take_command(&mut self, command: LinkCommand) {
        let LinkCommand::Transmit(transmit) = command;
        if self.stopping {
            self.refuse(transmit.tx, "the link is stopping").await;
            return;
        }
        let input = DriverInput::Transmit {
            id: transmit.tx.0,
            target: transmit.target_address,
            frame: &transmit.frame[..],
        };
        self.drive(input, None).await;
    }

    async fn take_time(&mut self) {
        let now = self.timer.now().mono;
        if self.reopen_at.is_some_and(|at| at <= now) {
            self.reopen_at = None;
            self.begin_opening();
        }
        if self.driver.next_wakeup_us().is_some_and(|at| at <= now.0) {
            self.drive(DriverInput::Wake, None).await;
        }
        self.close_down_when_sent().await;
    }

    fn begin_opening(&mut self) {
        // Closed first: a port is exclusive, also against ourselves.
        self.drop_port();
        let (events, receiver) = mpsc::channel(EVENTS);
        let context = PortContext { timer: Arc::clone(&self.timer), events, wire: self.wire.clone() };
        let busy = self.timer.busy("opening a port");
        let attempt = self.connector.connect(context);
        self.opening = Some(tokio::spawn(async move {
            let result = attempt.await;
            (result.map(|port| OpenPort { port, events: receiver }), busy)
        }));
    }

    async fn take_opened(&mut self, result: Result<OpenPort, String>) {
        match result {
            Ok(_) if self.stopping => {}
            Ok(open) => {
                tracing::info!(link = %self.name, "link {}: the port is open", self.name);
                self.open = Some(open);
                self.discard();
                self.drive(DriverInput::Opened, None).await;
            }
            Err(reason) => {
                if !self.stopping {
                    self.reopen_at = Some(self.timer.now().mono.plus(LOOK_US));
                }
                self.show(LinkState::Unavailable { reason }).await;
            }
        }
    }

    /// The port is gone: it is looked for at once.
    async fn lose(&mut self, reason: &str) {
        tracing::warn!(link = %self.name, "link {}: the port is gone: {reason}", self.name);
        self.drop_port();
        self.finding = None;
        self.drive(DriverInput::Closed, None).await;
        if !self.stopping {
            let soon = self.timer.now().mono.plus(LOOK_US);
            self.reopen_at = Some(self.reopen_at.map_or(soon, |at| at.min(soon)));
        }
        self.show(LinkState::Unavailable { reason: reason.to_owned() }).await;
    }

    fn drop_port(&mut self) {
        self.open = None;
        self.aux_watch = AuxWatch::Off;
        if let Some(wire) = &self.wire {
            wire.from_host.abandon();
            wire.to_host.abandon();
        }
    }

    async fn close_down_when_sent(&mut self) {
        if self.stopping && self.open.is_some() && self.driver.state() != DriverState::Sending {
            self.close_down().await;
        }
    }

    async fn close_down(&mut self) {
        self.drive(DriverInput::Stop, None).await;
        self.reopen_at = None;
        self.drop_port();
    }

    /// Everything that is under way from the far end is thrown away.
    fn discard(&mut self) {
        let Some(open) = &mut self.open else { return };
        match &self.wire {
            // Counted to the byte: nothing that is written after this is lost.
            Some(wire) => self.discard_until = wire.to_host.written_total(),
            None => {
                while let Ok((event, _)) = open.events.try_recv() {
                    if let PortEvent::Lost { reason } = event {
                        // Heard again from the next command that the port refuses.
                        tracing::debug!(%reason, "the port went while it was being purged");
                        break;
                    }
                }
            }
        }
    }

    /// Gives the driver an input and does what follows from it.
    async fn drive(&mut self, input: DriverInput<'_>, received: Option<Now>) {
        let now = self.timer.now();
        self.driver.handle(now.mono.0, input);
        let mut lost = None;
        while let Some(output) = self.driver.next_output() {
            if let Err(reason) = self.carry_out(output, received.unwrap_or(now)).await {
                lost = Some(reason);
            }
        }
        self.follow_aux();
        if let Some(reason) = lost {
            Box::pin(self.lose(&reason)).await;
        }
    }

    async fn carry_out(&mut self, output: DriverOutput, received: Now) -> Result<(), String> {
        match output {
            DriverOutput::Write(bytes) => {
                let open = self.open.as_mut().ok_or("the port is closed")?;
                return open.port.write(bytes);
            }
            DriverOutput::SetPins { m0, m1 } => {
                if let Some(open) = self.open.as_mut().filter(|_| self.connector.has_lines()) {
                    return open.port.set_pins(m0, m1);
                }
            }
            DriverOutput::PurgeInput => {
                self.discard();
                if let Some(open) = self.open.as_mut().filter(|_| self.wire.is_none()) {
                    return open.port.purge();
                }
            }
            DriverOutput::Deliver(bytes) => {
                let link = self.id.clone();
                self.engine.send(EngineMessage::Bytes { link, bytes, source: Source::Radio, received }).await;
            }
            DriverOutput::TxStarted { id } => self.engine.send(EngineMessage::TxStarted(TxId(id))).await,
            DriverOutput::TxDone { id, airtime_us, measured } => {
                self.engine.send(EngineMessage::TxDone { tx: TxId(id), airtime_us, measured }).await;
            }
            DriverOutput::TxFailed { id, radiated, reason } => {
                let radiated = match radiated {
                    Radiated::No => MaybeRadiated::No,
                    Radiated::Maybe => MaybeRadiated::Maybe,
                };
                let reason = reason.to_string();
                tracing::warn!(link = %self.name, tx = id, "link {}: a frame was not sent as it should: {reason}", self.name);
                self.engine.send(EngineMessage::TxFailed { tx: TxId(id), radiated, reason }).await;
            }
            DriverOutput::State(state) => self.take_state(state).await,
            DriverOutput::Diagnostic(diagnostic) => {
                tracing::warn!(link = %self.name, "link {}: {diagnostic}", self.name);
                self.finding = Some(diagnostic.to_string());
            }
            DriverOutput::Reopen { after_us } => {
                if !self.stopping {
                    self.reopen_at = Some(self.timer.now().mono.plus(after_us));
                }
            }
        }
        Ok(())
    }

    async fn take_state(&mut self, state: DriverState) {
        tracing::debug!(link = %self.name, ?state, "link {}: {state:?}", self.name);
        match state {
            DriverState::Ready | DriverState::Sending => self.show(LinkState::Ok).await,
            DriverState::Fault => {
                let reason = self.finding.clone().unwrap_or_else(|| "the module does not answer".to_owned());
                self.show(LinkState::Failed { reason }).await;
            }
            DriverState::Opening if self.shown.is_none() => {
                self.show(LinkState::Unavailable { reason: "the module is being brought up".to_owned() })
                    .await;
            }
            _ => {}
        }
    }

    async fn show(&mut self, state: LinkState) {
        if self.shown.as_ref() != Some(&state) {
            self.shown = Some(state.clone());
            self.engine.send(EngineMessage::Link { link: self.id.clone(), state }).await;
        }
    }

    async fn refuse(&self, tx: TxId, reason: &str) {
        let reason = reason.to_owned();
        self.engine.send(EngineMessage::TxFailed { tx, radiated: MaybeRadiated::No, reason }).await;
    }

    /// AUX is watched closely only while the driver waits for it.
    fn follow_aux(&mut self) {
        let watch = match (self.driver.config().aux, self.driver.state()) {
            (AuxWiring::Absent, _) | (_, DriverState::Closed | DriverState::Fault) => AuxWatch::Off,
            (AuxWiring::Present, DriverState::Ready) => AuxWatch::Idle,
            (AuxWiring::Present, _) => AuxWatch::Close,
        };
        if watch != self.aux_watch {
            self.aux_watch = watch;
            if let Some(open) = &mut self.open {
                open.port.watch_aux(watch);
            }
        }
    }
}

async fn next_event(open: &mut Option<OpenPort>) -> (PortEvent, BusyToken) {
    match open {
        Some(open) => match open.events.recv().await {
            Some(event) => event,
            None => (PortEvent::Lost { reason: "the port's threads ended".to_owned() }, BusyToken::idle()),
        },
        None => std::future::pending().await,
    }
}

async fn opened(opening: &mut Option<Opening>) -> (Result<OpenPort, String>, BusyToken) {
    match opening {
        Some(task) => match task.await {
            Ok(result) => result,
            Err(error) => (Err(format!("opening the port failed: {error}")), BusyToken::idle()),
        },
        None => std::future::pending().await,
    }
}

/// Whether the driver will set modem lines.
pub(crate) fn drives_lines(pins: ModePins) -> bool {
    matches!(pins, ModePins::Lines { .. })
}
