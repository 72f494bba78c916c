//! The state machine between the mission and one E22 module.
//!
//! Closed → Opening → Identify → Configure → Verify → Ready ↔ Sending; from anywhere → Fault → Opening.
//!
//! Rules that hold in every state:
//! - every wait has a limit, so that any sequence of inputs ends in Ready, Fault or Closed, and the latter two ask for
//!   a reopening;
//! - flash is written only where it reads otherwise than wanted;
//! - one frame at a time, header and frame in one [`DriverOutput::Write`], after [`DriverOutput::TxStarted`]; never a
//!   frame while one may still be on the air, even across a reopening; never a frame twice;
//! - what is heard in normal mode is delivered at once and without loss; what is dropped while configuring is counted;
//! - AUX is believed only after it was seen to move, and no longer once it is stuck or chatters.

mod aux_pin;
mod bring_up;
mod config;
mod diagnostic;
mod event;
mod exchange;
mod facts;
mod transmit;

pub use config::{AuxWiring, ConfigError, DriverConfig, ModePins};
pub use diagnostic::Diagnostic;
pub use event::{DriverInput, DriverOutput, DriverState, Radiated, TxFailure};
pub use facts::{DriverCounters, Generation, ModuleFacts};

use std::collections::VecDeque;

use crate::command::Mode;
use aux_pin::AuxPin;
use bring_up::BringUp;
use transmit::Sending;

/// Pauses before reopening a port that closed or could not be opened; the last one repeats. Short, since a port that
/// returns shall be in use within two seconds, and an attempt costs little.
const CLOSED_BACK_OFF_US: [u64; 3] = [100_000, 250_000, 500_000];
/// Pauses before reopening a port whose module does not work; the last one repeats.
const FAULT_BACK_OFF_US: [u64; 4] = [500_000, 1_000_000, 2_000_000, 5_000_000];
/// Pauses between looks at a module that left questions unanswered when it was brought up; the last one repeats. Each look begins with
/// a frame that was refused: only then may something be radiated, which a command to a module without the switch is.
/// While it is looked at it does not hear.
const LOOK_AGAIN_US: [u64; 4] = [5_000_000, 15_000_000, 60_000_000, 300_000_000];
/// After so many looks a module that answers everything but AT commands is one that has none.
const LOOKS_WITHOUT_AT: usize = 2;
/// Received bytes held for a shell that does not drain; beyond, the oldest output is not touched and new bytes are
/// counted as discarded.
const UNDRAINED_BYTES: usize = 1 << 20;
/// State changes one input may cause; far above any real chain, it only guards against a loop.
const STEPS_PER_INPUT: usize = 64;

/// The driver. See the [module documentation](self).
#[derive(Debug)]
pub struct Driver {
    config: DriverConfig,
    state: DriverState,
    now_us: u64,
    facts: ModuleFacts,
    counters: DriverCounters,
    outputs: VecDeque<DriverOutput>,
    aux: AuxPin,
    bring_up: BringUp,
    sending: Option<Sending>,
    /// Own bytes that an echoing adapter is about to return.
    echo_expected: VecDeque<u8>,
    /// Something of ours may be on the air until then.
    air_until_us: u64,
    last_rx_us: Option<u64>,
    opened_before: bool,
    stopped: bool,
    reset_wanted: bool,
    reopen_at_us: u64,
    closed_tries: usize,
    fault_tries: usize,
    look_again_at_us: u64,
    looks: usize,
}

impl Driver {
    /// A driver without a port.
    #[must_use]
    pub fn new(config: DriverConfig) -> Self {
        Self {
            aux: AuxPin::new(config.aux == AuxWiring::Present),
            config,
            state: DriverState::Closed,
            now_us: 0,
            facts: ModuleFacts::default(),
            counters: DriverCounters::default(),
            outputs: VecDeque::new(),
            bring_up: BringUp::default(),
            sending: None,
            echo_expected: VecDeque::new(),
            air_until_us: 0,
            last_rx_us: None,
            opened_before: false,
            stopped: false,
            reset_wanted: false,
            reopen_at_us: 0,
            closed_tries: 0,
            fault_tries: 0,
            look_again_at_us: 0,
            looks: 0,
        }
    }

    /// Takes one event. Never panics; drain [`Driver::next_output`] afterwards. A time before the last one counts as
    /// the last one.
    pub fn handle(&mut self, now_us: u64, input: DriverInput<'_>) {
        self.now_us = self.now_us.max(now_us);
        match input {
            DriverInput::Opened => self.opened(),
            DriverInput::Closed => self.closed(),
            DriverInput::Bytes(bytes) => self.bytes(bytes),
            DriverInput::Aux { idle } => self.aux_level(idle),
            DriverInput::Drained => self.drained(),
            DriverInput::Transmit { id, target, frame } => self.transmit(id, target, frame),
            DriverInput::Wake => {}
            DriverInput::Stop => self.stop(),
        }
        for _ in 0..STEPS_PER_INPUT {
            let moved = match self.state {
                DriverState::Closed | DriverState::Fault | DriverState::Ready => false,
                DriverState::Sending => self.advance_sending(),
                DriverState::Opening
                | DriverState::Identify
                | DriverState::Configure
                | DriverState::Verify => self.advance_bring_up(),
            };
            if !moved {
                break;
            }
        }
    }

    /// The next thing to do, in order.
    pub fn next_output(&mut self) -> Option<DriverOutput> {
        self.outputs.pop_front()
    }

    /// When [`DriverInput::Wake`] is due, if nothing else happens.
    #[must_use]
    pub fn next_wakeup_us(&self) -> Option<u64> {
        match self.state {
            DriverState::Closed | DriverState::Fault | DriverState::Ready => None,
            DriverState::Sending => self.sending_wakeup_us(),
            DriverState::Opening | DriverState::Identify | DriverState::Configure | DriverState::Verify => {
                Some(self.bring_up_wakeup_us())
            }
        }
    }

    /// Where the driver stands.
    #[must_use]
    pub fn state(&self) -> DriverState {
        self.state
    }

    /// What is known about the module.
    #[must_use]
    pub fn facts(&self) -> &ModuleFacts {
        &self.facts
    }

    /// What was counted.
    #[must_use]
    pub fn counters(&self) -> &DriverCounters {
        &self.counters
    }

    /// The settings it was made with.
    #[must_use]
    pub fn config(&self) -> &DriverConfig {
        &self.config
    }

    /// Why a frame would be refused now, if it would.
    #[must_use]
    pub fn transmit_refusal(&self) -> Option<TxFailure> {
        match self.state {
            DriverState::Sending => Some(TxFailure::Busy),
            DriverState::Ready if self.config.transmit_unverified => None,
            DriverState::Ready if !self.facts.frequency_verified => Some(TxFailure::FrequencyUnverified),
            DriverState::Ready if !self.facts.configuration_verified => {
                Some(TxFailure::ConfigurationUnverified)
            }
            DriverState::Ready => None,
            _ => Some(TxFailure::NotReady),
        }
    }

    fn opened(&mut self) {
        self.abandon_transmission(TxFailure::PortClosed);
        self.stopped = false;
        self.facts = ModuleFacts::default();
        self.aux = AuxPin::new(self.config.aux == AuxWiring::Present);
        self.echo_expected.clear();
        self.last_rx_us = None;
        (self.look_again_at_us, self.looks) = (0, 0);
        if let Err(error) = self.config.check() {
            self.fault(Diagnostic::Configuration(error));
            return;
        }
        self.begin_bring_up();
        self.opened_before = true;
    }

    fn closed(&mut self) {
        self.abandon_transmission(TxFailure::PortClosed);
        self.set_state(DriverState::Closed);
        if self.stopped {
            return;
        }
        if self.reopen_at_us <= self.now_us {
            self.reopen_at_us = self.now_us + back_off(&CLOSED_BACK_OFF_US, &mut self.closed_tries);
        }
        self.push_reopen();
    }

    /// Somebody wants to send, and the module did not say what it is or where it sends: perhaps it does now.
    fn look_again(&mut self) {
        // Registers without AT commands are what the first generation says, too: that is believed soon.
        let told_all = self.facts.registers.is_some()
            && (self.facts.firmware.is_some() || self.looks >= LOOKS_WITHOUT_AT);
        let was_silent = self.state == DriverState::Ready && !told_all;
        let can_ask = self.config.mode_pins != ModePins::Strapped;
        if was_silent && can_ask && self.now_us >= self.look_again_at_us {
            self.look_again_at_us = self.now_us + back_off(&LOOK_AGAIN_US, &mut self.looks);
            self.begin_recovery();
        }
    }

    fn stop(&mut self) {
        self.abandon_transmission(TxFailure::Stopped);
        self.stopped = true;
        self.set_state(DriverState::Closed);
    }

    fn fault(&mut self, diagnostic: Diagnostic) {
        self.push(DriverOutput::Diagnostic(diagnostic));
        // A module left in normal mode still hears, and is where the next opening expects it.
        self.set_pins(Mode::Normal);
        self.set_state(DriverState::Fault);
        self.reopen_at_us = self.now_us + back_off(&FAULT_BACK_OFF_US, &mut self.fault_tries);
        self.push_reopen();
    }

    fn push_reopen(&mut self) {
        self.counters.reopens += 1;
        self.push(DriverOutput::Reopen { after_us: self.reopen_at_us - self.now_us });
    }

    fn bytes(&mut self, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.last_rx_us = Some(self.now_us);
        match self.state {
            DriverState::Closed | DriverState::Fault => self.discard(bytes.len()),
            DriverState::Ready | DriverState::Sending => self.deliver(bytes),
            _ => self.bring_up_bytes(bytes),
        }
    }

    fn aux_level(&mut self, idle: bool) {
        if !self.aux.set(self.now_us, idle) {
            return;
        }
        self.counters.aux_edges += 1;
        if self.aux.begins_to_chatter() {
            self.push(DriverOutput::Diagnostic(Diagnostic::AuxChatter));
        }
        self.facts.aux_trusted = self.aux.trusted();
        self.aux_while_sending(idle);
    }

    /// Hands data-mode bytes on, less the echo of our own.
    fn deliver(&mut self, bytes: &[u8]) {
        let mut own = 0;
        while own < bytes.len() && self.echo_expected.front() == Some(&bytes[own]) {
            self.echo_expected.pop_front();
            own += 1;
        }
        self.counters.echo_bytes += own as u64;
        let bytes = &bytes[own..];
        if bytes.is_empty() {
            return;
        }
        // Anything else than the expected echo ends it.
        self.echo_expected.clear();
        if let Some(DriverOutput::Deliver(held)) = self.outputs.back_mut() {
            if held.len() + bytes.len() <= UNDRAINED_BYTES {
                held.extend_from_slice(bytes);
                self.counters.delivered_bytes += bytes.len() as u64;
            } else {
                self.discard(bytes.len());
            }
            return;
        }
        self.counters.delivered_bytes += bytes.len() as u64;
        self.push(DriverOutput::Deliver(bytes.to_vec()));
    }

    fn discard(&mut self, count: usize) {
        self.counters.discarded_bytes += count as u64;
    }

    fn set_state(&mut self, state: DriverState) {
        if self.state != state {
            self.state = state;
            self.push(DriverOutput::State(state));
        }
    }

    fn set_pins(&mut self, mode: Mode) {
        if let ModePins::Lines { inverted } = self.config.mode_pins {
            let (m0, m1) = mode.pins();
            self.push(DriverOutput::SetPins { m0: m0 ^ inverted, m1: m1 ^ inverted });
        }
    }

    fn push(&mut self, output: DriverOutput) {
        self.outputs.push_back(output);
    }
}

fn back_off(table: &[u64], tries: &mut usize) -> u64 {
    let pause = table.get(*tries).or(table.last()).copied().unwrap_or_default();
    *tries = (*tries + 1).min(table.len());
    pause
}
