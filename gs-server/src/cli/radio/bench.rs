//! Driver and port on a bench: what the server's link does, without an engine and without ever coming back.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;

use mission::{MonoUs, Now};
use radio::command::{self, Mode};
use radio::driver::{
    AuxWiring, Diagnostic, Driver, DriverConfig, DriverInput, DriverOutput, DriverState, ModePins,
};
use tokio::sync::mpsc;

use super::Failure;
use crate::clock::{SystemClock, Timer};
use crate::config::LinkSection;
use crate::links::port::{AuxWatch, Connector as _, EVENTS, Events, Port, PortContext, PortEvent};
use crate::links::serial::Serial;

/// What the module needs to confirm a software switch, with room to spare; frames are longer on the air.
const SWITCH_BACK_US: u64 = 150_000;

/// What happened.
#[derive(Debug)]
pub(super) enum Notice {
    /// The driver stands elsewhere.
    State(DriverState),
    /// Something to read.
    Finding(Diagnostic),
    /// The driver would write this to change the module, and was not let: the module is in normal mode again.
    WouldChange(Vec<u8>),
    /// Bytes in data mode.
    Heard(Vec<u8>),
    /// The port is gone.
    Lost(String),
}

/// A module on the bench.
pub(super) struct Bench {
    pub(super) driver: Driver,
    pub(super) timer: Arc<dyn Timer>,
    port: Box<dyn Port>,
    events: Events,
    /// Nothing in the module may change.
    dry: bool,
    /// The driver was stopped before a change; bytes go past it.
    stopped: bool,
    /// Until then the module only confirms that it is back in normal mode.
    deaf_until: MonoUs,
    notices: VecDeque<Notice>,
    log: Option<RawLog>,
}

impl Bench {
    /// Opens the port and starts the driver.
    pub(super) async fn open(
        section: &LinkSection,
        config: DriverConfig,
        dry: bool,
        raw_log: Option<&Path>,
    ) -> Result<Self, Failure> {
        let log = raw_log.map(RawLog::create).transpose()?;
        let timer: Arc<dyn Timer> = Arc::new(SystemClock::new());
        let (sender, events) = mpsc::channel(EVENTS);
        let context = PortContext { timer: Arc::clone(&timer), events: sender, wire: None };
        let port = Serial::new(section).connect(context).await.map_err(Failure::failed)?;
        let mut bench = Self {
            driver: Driver::new(config),
            timer,
            port,
            events,
            dry,
            stopped: false,
            deaf_until: MonoUs(0),
            notices: VecDeque::new(),
            log,
        };
        if bench.driver.config().aux == AuxWiring::Present {
            bench.port.watch_aux(AuxWatch::Close);
        }
        bench.drive(DriverInput::Opened);
        Ok(bench)
    }

    /// Waits for the next thing that happens. Nothing is lost when the wait is dropped.
    pub(super) async fn next(&mut self) -> Notice {
        loop {
            if let Some(notice) = self.notices.pop_front() {
                return notice;
            }
            let wake = self.driver.next_wakeup_us().filter(|_| !self.stopped);
            let sleep = wake.map(|at_us| self.timer.sleep_until(MonoUs(at_us)));
            tokio::select! {
                event = self.events.recv() => match event {
                    Some((event, _)) => self.take(event),
                    None => return Notice::Lost("the port's threads ended".to_owned()),
                },
                _ = async { match sleep { Some(sleep) => sleep.await, None => std::future::pending().await } } => {
                    self.drive(DriverInput::Wake);
                }
            }
        }
    }

    fn take(&mut self, event: PortEvent) {
        match event {
            PortEvent::Bytes { bytes, received } => {
                self.log('<', &bytes, received);
                if self.stopped {
                    if received.mono > self.deaf_until {
                        self.notices.push_back(Notice::Heard(bytes));
                    }
                } else {
                    self.drive(DriverInput::Bytes(&bytes));
                }
            }
            PortEvent::Drained => self.drive(DriverInput::Drained),
            PortEvent::Aux { idle } => {
                if let Some(log) = &mut self.log {
                    log.aux = Some(idle);
                }
                self.drive(DriverInput::Aux { idle });
            }
            PortEvent::Lost { reason } => self.notices.push_back(Notice::Lost(reason)),
        }
    }

    fn drive(&mut self, input: DriverInput<'_>) {
        if self.stopped {
            return;
        }
        let now = self.timer.now();
        self.driver.handle(now.mono.0, input);
        while let Some(output) = self.driver.next_output() {
            if let Err(reason) = self.carry_out(output, now) {
                let reason = self.reason_of_loss().unwrap_or(reason);
                self.notices.push_back(Notice::Lost(reason));
                return;
            }
            if self.stopped {
                return;
            }
        }
    }

    fn carry_out(&mut self, output: DriverOutput, now: Now) -> Result<(), String> {
        match output {
            DriverOutput::Write(bytes) if self.dry && changes_the_module(&bytes) => {
                self.stopped = true;
                self.deaf_until = now.mono.plus(SWITCH_BACK_US);
                self.notices.push_back(Notice::WouldChange(bytes));
                self.back_to_normal()
            }
            DriverOutput::Write(bytes) => {
                self.log('>', &bytes, now);
                self.port.write(bytes)
            }
            DriverOutput::SetPins { m0, m1 }
                if matches!(self.driver.config().mode_pins, ModePins::Lines { .. }) =>
            {
                self.port.set_pins(m0, m1)
            }
            DriverOutput::PurgeInput => self.port.purge(),
            DriverOutput::Deliver(bytes) => {
                self.notices.push_back(Notice::Heard(bytes));
                Ok(())
            }
            DriverOutput::State(state) => {
                self.notices.push_back(Notice::State(state));
                Ok(())
            }
            DriverOutput::Diagnostic(diagnostic) => {
                self.notices.push_back(Notice::Finding(diagnostic));
                Ok(())
            }
            // The bench transmits nothing, and a person decides whether it is tried again.
            DriverOutput::SetPins { .. }
            | DriverOutput::TxStarted { .. }
            | DriverOutput::TxDone { .. }
            | DriverOutput::TxFailed { .. }
            | DriverOutput::Reopen { .. } => Ok(()),
        }
    }

    /// A port that takes nothing any more has said why.
    fn reason_of_loss(&mut self) -> Option<String> {
        while let Ok((event, _)) = self.events.try_recv() {
            if let PortEvent::Lost { reason } = event {
                return Some(reason);
            }
        }
        None
    }

    fn back_to_normal(&mut self) -> Result<(), String> {
        match self.driver.config().mode_pins {
            ModePins::Lines { inverted } => self.port.set_pins(inverted, inverted),
            ModePins::Software => self.port.write(command::switch(Mode::Normal).to_vec()),
            ModePins::Strapped => Ok(()),
        }
    }

    fn log(&mut self, direction: char, bytes: &[u8], at: Now) {
        if let Some(log) = &mut self.log
            && let Err(error) = log.write(direction, bytes, at)
        {
            tracing::warn!(%error, "the raw log ends: {error}");
            self.log = None;
        }
    }
}

/// A register write, or an AT command that is no question.
fn changes_the_module(bytes: &[u8]) -> bool {
    let is_switch = bytes.starts_with(&command::SWITCH_PREFIX);
    let is_write = matches!(bytes.first(), Some(&(command::WRITE_SAVED | command::WRITE_VOLATILE)));
    let is_order = bytes.starts_with(b"AT+") && !bytes.windows(2).any(|pair| pair == b"=?");
    (is_write && !is_switch) || is_order
}

/// Every byte with its time.
struct RawLog {
    file: File,
    aux: Option<bool>,
}

impl RawLog {
    fn create(path: &Path) -> Result<Self, Failure> {
        let file =
            File::options().append(true).create(true).open(path).map_err(|error| {
                Failure::doing(format!("raw log {} cannot be opened", path.display()), error)
            })?;
        Ok(Self { file, aux: None })
    }

    fn write(&mut self, direction: char, bytes: &[u8], at: Now) -> std::io::Result<()> {
        let aux = match self.aux {
            Some(true) => "idle",
            Some(false) => "busy",
            None => "-",
        };
        writeln!(self.file, "{} {direction} {aux} {}", utc_text(at), hex::encode(bytes))
    }
}

/// RFC 3339 with milliseconds.
pub(super) fn utc_text(at: Now) -> String {
    match jiff::Timestamp::from_microsecond(at.utc.0) {
        Ok(timestamp) => format!("{timestamp:.3}"),
        Err(_) => format!("{} us", at.utc.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_are_told_from_orders() {
        for question in [
            &command::read(0, 9)[..],
            &command::switch(Mode::Configuration)[..],
            &command::switch(Mode::Normal)[..],
            b"AT+FWCODE=?",
            b"AT+UFREQ=?\r\n",
        ] {
            assert!(!changes_the_module(question), "{question:?}");
        }
        for order in [
            &command::write(true, 0, &[0; 9])[..],
            &command::write(false, 0, &[0; 9])[..],
            b"AT+UFREQ=1,410000000,1000000,83",
            b"AT+UAUX=1",
            b"AT+RESET",
        ] {
            assert!(changes_the_module(order), "{order:?}");
        }
    }
}
