//! From an open port to a module that is proved to be what the configuration asks for.
//!
//! Registers first, in one block; AT commands only for what registers cannot say (the carrier's offset and AUX). Order:
//! settle, wait until idle, enter configuration mode, read the block, ask for the identity, set the carrier if it
//! differs (with the reset that needs), set AUX, write the block if it differs, read it back, leave.

use super::event::{DriverOutput, DriverState};
use super::exchange::{Exchange, Progress};
use super::facts::Generation;
use super::transmit::QUIET_US;
use super::{AuxWiring, Diagnostic, Driver, ModePins};
use crate::command::{self, Mode};
use crate::registers::{BLOCK_BYTES, COMPARED_BYTES, Registers, grid_frequency_hz};
use crate::reply::{AtReply, Expected, Verdict, parse_ufreq};

/// Configuration mode is at this rate whatever is stored.
const CONFIGURATION_BAUD: u32 = 9600;
const SETTLE_US: u64 = 100_000;
/// After plugging in, the slow firmware boots for half a second.
const FIRST_SETTLE_US: u64 = 600_000;
const IDLE_LIMIT_US: u64 = 6_000_000;
/// AUX is not low at once after a mode change.
const AUX_BLIND_SPOT_US: u64 = 5_000;
const AFTER_AUX_HIGH_US: u64 = 20_000;
/// Mode change without a trusted AUX: the maker's own sample waits as long.
const BLIND_MODE_CHANGE_US: u64 = 50_000;
const MODE_CHANGE_LIMIT_US: u64 = 1_000_000;
const FAST_BOOT_US: u64 = 60_000;
const SLOW_BOOT_US: u64 = 600_000;
/// Entries into configuration mode, and tries of a binary command.
const TRIES: u8 = 3;
/// An AT command is tried with and without CR LF.
const AT_TRIES: u8 = 2;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Question {
    SwitchToConfiguration,
    Block,
    Firmware,
    DeviceType,
    Frequency,
    SetFrequency,
    Reset,
    Aux,
    SetAux,
    CheckAux,
    Write,
    ReadBack,
    SwitchToNormal,
}

impl Question {
    fn is_at(self) -> bool {
        use Question::*;
        matches!(self, Firmware | DeviceType | Frequency | SetFrequency | Reset | Aux | SetAux | CheckAux)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Then {
    Configuration,
    Normal,
    /// Normal mode was visited to wake a silent module; try configuration again.
    TryAgain,
    Rebooted,
}

#[derive(Debug)]
enum Step {
    Settle { until_us: u64 },
    Quiet { limit_us: u64 },
    Pins { since_us: u64, then: Then },
    Pause { until_us: u64, then: Then },
    Ask { question: Question, exchange: Exchange, tries_left: u8 },
}

/// What the module said about its carrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Grid {
    /// No AT commands, or `UFREQ` refused: the module's own grid.
    #[default]
    Own,
    /// Start and step of an own grid that is switched on.
    Set { start_hz: u32, step_hz: u32 },
    /// No sense in the answer.
    Unknown,
}

impl Grid {
    fn frequency_hz(self, channel: u8) -> Option<u32> {
        match self {
            Self::Own => Some(grid_frequency_hz(channel)),
            Self::Set { start_hz, step_hz } => step_hz.checked_mul(u32::from(channel))?.checked_add(start_hz),
            Self::Unknown => None,
        }
    }
}

/// Progress of one bring-up.
#[derive(Debug, Default)]
pub(super) struct BringUp {
    step: Option<Step>,
    /// The module is in configuration mode as far as we know: what it sends answers us.
    configuring: bool,
    attempts: u8,
    /// AT commands end in CR LF.
    crlf: bool,
    /// The line end above has been answered.
    crlf_proved: bool,
    at_works: bool,
    identified: bool,
    /// Registers are silent; the identity is asked only to say what is wrong.
    post_mortem: bool,
    reset_done: bool,
    frequency_set: bool,
    written: u8,
    grid: Grid,
    garbage: usize,
    echo_only: bool,
}

impl Driver {
    pub(super) fn begin_bring_up(&mut self) {
        let slow = !self.opened_before && matches!(self.config.mode_pins, ModePins::Lines { .. });
        let until_us = self.now_us + if slow { FIRST_SETTLE_US } else { SETTLE_US };
        self.bring_up = BringUp { step: Some(Step::Settle { until_us }), ..BringUp::default() };
        self.set_state(DriverState::Opening);
        self.set_pins(Mode::Normal);
    }

    /// Goes through configuration again on an open port.
    pub(super) fn begin_recovery(&mut self) {
        self.bring_up = BringUp::default();
        self.set_state(DriverState::Opening);
        self.await_quiet();
    }

    pub(super) fn bring_up_wakeup_us(&self) -> u64 {
        match &self.bring_up.step {
            None => self.now_us,
            Some(Step::Settle { until_us } | Step::Pause { until_us, .. }) => *until_us,
            Some(Step::Quiet { limit_us }) if self.aux.busy() => *limit_us,
            Some(Step::Quiet { limit_us }) => self.quiet_us().min(*limit_us),
            Some(Step::Pins { since_us, .. }) => self.pins_done_us(*since_us),
            Some(Step::Ask { exchange, .. }) => exchange.wakeup_us(),
        }
    }

    pub(super) fn bring_up_bytes(&mut self, bytes: &[u8]) {
        match &mut self.bring_up.step {
            Some(Step::Ask { question, exchange, .. }) => {
                let data_mode = *question == Question::SwitchToConfiguration;
                let surplus = exchange.push(self.now_us, bytes);
                if data_mode {
                    self.deliver(&surplus);
                } else {
                    self.discard(surplus.len());
                }
            }
            _ if self.bring_up.configuring => self.discard(bytes.len()),
            _ => self.deliver(bytes),
        }
    }

    /// One transition, if it is due.
    pub(super) fn advance_bring_up(&mut self) -> bool {
        let now_us = self.now_us;
        match &mut self.bring_up.step {
            None => false,
            Some(Step::Settle { until_us }) => {
                let due = now_us >= *until_us;
                if due {
                    if self.config.mode_pins == ModePins::Strapped {
                        self.become_ready();
                    } else {
                        self.await_quiet();
                    }
                }
                due
            }
            Some(Step::Quiet { limit_us }) => {
                let expired = now_us >= *limit_us;
                if expired && self.aux.busy() {
                    self.aux_stuck_low();
                }
                let due = expired || (!self.aux.busy() && now_us >= self.quiet_us());
                if due {
                    self.enter_configuration();
                }
                due
            }
            Some(Step::Pins { since_us, then }) => {
                let (since_us, then) = (*since_us, *then);
                let due = now_us >= self.pins_done_us(since_us);
                if due {
                    if self.aux.busy() {
                        self.aux_stuck_low();
                    }
                    self.mode_reached(then);
                }
                due
            }
            Some(Step::Pause { until_us, then }) => {
                let (due, then) = (now_us >= *until_us, *then);
                if due {
                    self.mode_reached(then);
                }
                due
            }
            Some(Step::Ask { exchange, .. }) => match exchange.progress(now_us) {
                Progress::Waiting => false,
                Progress::Answered(verdict) => {
                    self.answered(verdict);
                    true
                }
                Progress::Unanswered => {
                    self.unanswered(None);
                    true
                }
            },
        }
    }

    fn await_quiet(&mut self) {
        let limit_us = (self.now_us + IDLE_LIMIT_US).max(self.air_until_us);
        self.bring_up.step = Some(Step::Quiet { limit_us });
    }

    /// When the receive side is silent and nothing of ours is on the air.
    fn quiet_us(&self) -> u64 {
        self.last_rx_us.map_or(0, |at| at + QUIET_US).max(self.air_until_us)
    }

    /// When a mode change by pins counts as done.
    fn pins_done_us(&self, since_us: u64) -> u64 {
        let limit_us = since_us + MODE_CHANGE_LIMIT_US;
        if self.aux.busy() {
            limit_us
        } else if self.aux.trusted() {
            (since_us + AUX_BLIND_SPOT_US).max(self.aux.changed_us()) + AFTER_AUX_HIGH_US
        } else {
            (since_us + BLIND_MODE_CHANGE_US).max(self.aux.changed_us() + AFTER_AUX_HIGH_US)
        }
        .min(limit_us)
    }

    fn enter_configuration(&mut self) {
        match self.config.mode_pins {
            ModePins::Lines { .. } => {
                self.set_pins(Mode::Configuration);
                self.bring_up.step = Some(Step::Pins { since_us: self.now_us, then: Then::Configuration });
            }
            // The only mode in which a command travels among data; the line is quiet.
            ModePins::Software => self.ask(Question::SwitchToConfiguration),
            ModePins::Strapped => self.become_ready(),
        }
    }

    fn leave_configuration(&mut self) {
        self.push(DriverOutput::PurgeInput);
        match self.config.mode_pins {
            ModePins::Lines { .. } => {
                self.bring_up.configuring = false;
                self.set_pins(Mode::Normal);
                self.bring_up.step = Some(Step::Pins { since_us: self.now_us, then: Then::Normal });
            }
            ModePins::Software => self.ask(Question::SwitchToNormal),
            ModePins::Strapped => self.become_ready(),
        }
    }

    fn mode_reached(&mut self, then: Then) {
        match then {
            Then::Configuration => {
                self.bring_up.configuring = true;
                self.set_state(DriverState::Identify);
                self.ask(Question::Block);
            }
            Then::Normal => self.become_ready(),
            Then::TryAgain => self.enter_configuration(),
            Then::Rebooted => {
                self.bring_up.configuring = false;
                self.await_quiet();
            }
        }
    }

    fn ask(&mut self, question: Question) {
        let tries = match question {
            Question::Reset => 1,
            // With mode lines the way into configuration is tried again as a whole.
            Question::Block if matches!(self.config.mode_pins, ModePins::Lines { .. }) => 1,
            _ if question.is_at() => AT_TRIES,
            _ => TRIES,
        };
        self.ask_once(question, tries - 1);
    }

    fn ask_once(&mut self, question: Question, tries_left: u8) {
        let (request, expected) = self.request(question);
        if question != Question::SwitchToConfiguration {
            // Stale bytes before a reply are the commonest trouble with these modules.
            self.push(DriverOutput::PurgeInput);
        }
        self.push(DriverOutput::Write(request.clone()));
        let exchange = Exchange::new(self.now_us, CONFIGURATION_BAUD, request, expected);
        self.bring_up.step = Some(Step::Ask { question, exchange, tries_left });
    }

    fn request(&self, question: Question) -> (Vec<u8>, Expected) {
        let crlf = self.bring_up.crlf;
        let block = Expected::Registers { address: 0, len: BLOCK_BYTES as u8 };
        let at = |body: &str, name| (command::at(body, crlf), Expected::At { name });
        match question {
            Question::SwitchToConfiguration => (
                command::switch(Mode::Configuration).to_vec(),
                Expected::Switched { mode: Mode::Configuration.code() },
            ),
            Question::SwitchToNormal => {
                (command::switch(Mode::Normal).to_vec(), Expected::Switched { mode: Mode::Normal.code() })
            }
            Question::Block | Question::ReadBack => (command::read(0, BLOCK_BYTES as u8).to_vec(), block),
            Question::Write => {
                let mut data = [0; BLOCK_BYTES];
                data[..COMPARED_BYTES].copy_from_slice(&self.wanted_registers().0);
                (command::write(self.config.save_to_flash, 0, &data), block)
            }
            Question::Firmware => at("FWCODE=?", "FWCODE"),
            Question::DeviceType => at("DEVTYPE=?", "DEVTYPE"),
            Question::Frequency => at("UFREQ=?", "UFREQ"),
            Question::SetFrequency => {
                // Channel 0 of the grid is chosen so that our channel number keeps its meaning in the header.
                let start_hz =
                    self.config.frequency_hz.saturating_sub(u32::from(self.config.channel) * 1_000_000);
                at(&format!("UFREQ=1,{start_hz},1000000,83"), "UFREQ")
            }
            Question::Reset => at("RESET", "RESET"),
            Question::Aux | Question::CheckAux => at("UAUX=?", "UAUX"),
            Question::SetAux => at("UAUX=1", "UAUX"),
        }
    }

    fn wanted_registers(&self) -> Registers {
        let held = self.facts.registers.unwrap_or(Registers::FACTORY);
        let rssi_byte = self.config.rssi_byte.unwrap_or(held.rssi_byte());
        let needs_switch = self.config.mode_pins == ModePins::Software;
        // Reserved bits stay; sub-packet 240, no ambient RSSI, no repeater, no LBT; the WOR period matters to nobody.
        let mut wanted = Registers(held.0);
        wanted.0[4] &= 0x18;
        wanted.0[6] &= 0x07;
        wanted
            .with_address(self.config.address)
            .with_net_id(self.config.net_id)
            .with_baud_code(3)
            .with_air_rate(self.config.air_rate)
            .with_software_switch(self.config.software_switch.unwrap_or(needs_switch))
            .with_power(self.config.power)
            .with_channel(self.config.channel)
            .with_rssi_byte(rssi_byte)
            .with_fixed_point(true)
    }

    /// The exchange ended with an answer.
    fn answered(&mut self, verdict: Verdict) {
        let Some(Step::Ask { question, exchange, .. }) = &self.bring_up.step else { return };
        let question = *question;
        let received = exchange.received().to_vec();
        let echoed = matches!(
            verdict,
            Verdict::Registers { echo: true, .. }
                | Verdict::Switched { echo: true, .. }
                | Verdict::At { echo: true, .. }
        );
        if echoed && !self.facts.echo {
            self.facts.echo = true;
            self.push(DriverOutput::Diagnostic(Diagnostic::Echo));
        }
        match verdict {
            Verdict::Registers { data, before, .. } => {
                self.discard(before);
                self.registers_answered(question, &data);
            }
            Verdict::Switched { before, after, echo } => {
                if question == Question::SwitchToConfiguration {
                    let own = if echo { command::SWITCH_PREFIX.len() + 1 } else { 0 };
                    self.deliver(&received[..before.saturating_sub(own)]);
                    // The module is on its way; what it still says are not frames.
                    self.pause(BLIND_MODE_CHANGE_US, Then::Configuration);
                } else {
                    self.discard(before);
                    self.bring_up.configuring = false;
                    self.pause(BLIND_MODE_CHANGE_US, Then::Normal);
                    self.deliver(&received[after.min(received.len())..]);
                }
            }
            Verdict::At { reply: AtReply::Error, .. } if !self.bring_up.crlf_proved => {
                self.unanswered(Some(AtReply::Error));
            }
            Verdict::At { reply, .. } => {
                if reply != AtReply::Error {
                    self.bring_up.crlf_proved = true;
                }
                self.at_answered(question, Some(reply));
            }
            Verdict::Refused | Verdict::Wait => self.unanswered(None),
        }
    }

    /// The exchange ended without an answer, or with an error that another line end may cure.
    fn unanswered(&mut self, error: Option<AtReply>) {
        let Some(Step::Ask { question, exchange, tries_left }) = &self.bring_up.step else { return };
        let (question, tries_left) = (*question, *tries_left);
        let received = exchange.received().to_vec();
        let only_echo = exchange.only_echo();
        if question == Question::SwitchToConfiguration {
            // It may have been a frame; if it was our echo, the stream decoder skips it.
            if !only_echo {
                self.deliver(&received);
            }
        } else {
            self.discard(received.len());
            self.bring_up.garbage += received.len();
            self.bring_up.echo_only |= only_echo;
        }
        if question.is_at() && !self.bring_up.crlf_proved {
            self.bring_up.crlf = !self.bring_up.crlf;
        }
        if tries_left > 0 {
            self.counters.command_retries += 1;
            self.ask_once(question, tries_left - 1);
            return;
        }
        match question {
            Question::SwitchToConfiguration => {
                self.push(DriverOutput::Diagnostic(Diagnostic::SoftwareSwitchSilent));
                // A module without the switch has radiated it.
                let timing = self.config.timing;
                self.air_until_us = self.air_until_us.max(self.now_us + timing.send_us(6));
                self.become_ready();
            }
            Question::SwitchToNormal => self.fault(Diagnostic::StuckInConfiguration),
            Question::Block => self.block_unanswered(),
            Question::Write => {
                self.push(DriverOutput::Diagnostic(Diagnostic::WriteUnanswered));
                self.read_back();
            }
            Question::ReadBack => {
                self.push(DriverOutput::Diagnostic(Diagnostic::ReadBackFailed));
                self.facts.registers = None;
                self.facts.rssi_byte = None;
                self.leave_configuration();
            }
            _ => self.at_answered(question, error),
        }
    }

    fn block_unanswered(&mut self) {
        self.bring_up.attempts += 1;
        if self.bring_up.attempts < TRIES && matches!(self.config.mode_pins, ModePins::Lines { .. }) {
            self.counters.command_retries += 1;
            self.bring_up.configuring = false;
            self.set_pins(Mode::Normal);
            self.bring_up.step = Some(Step::Pins { since_us: self.now_us, then: Then::TryAgain });
        } else {
            self.bring_up.post_mortem = true;
            self.ask(Question::Firmware);
        }
    }

    fn registers_answered(&mut self, question: Question, data: &[u8]) {
        let Some(&found) = data.first_chunk::<COMPARED_BYTES>() else { return };
        let found = Registers(found);
        match question {
            Question::Write => self.read_back(),
            Question::ReadBack => {
                let wanted = self.wanted_registers();
                self.facts.registers = Some(found);
                self.facts.rssi_byte = Some(found.rssi_byte());
                self.facts.configuration_verified = wanted == found;
                if wanted != found && self.bring_up.written < 2 {
                    self.write_registers();
                    return;
                }
                for (register, (&wanted, &found)) in (0u8..).zip(wanted.0.iter().zip(&found.0)) {
                    if wanted != found {
                        self.push(DriverOutput::Diagnostic(Diagnostic::Refused { register, wanted, found }));
                    }
                }
                self.leave_configuration();
            }
            _ => {
                self.facts.registers = Some(found);
                self.facts.rssi_byte = Some(found.rssi_byte());
                if !self.bring_up.identified {
                    self.ask(Question::Firmware);
                } else if self.bring_up.at_works {
                    self.ask(Question::Frequency);
                } else {
                    self.plan_write();
                }
            }
        }
    }

    fn at_answered(&mut self, question: Question, reply: Option<AtReply>) {
        let value = match &reply {
            Some(AtReply::Value(text)) => Some(text.clone()),
            _ => None,
        };
        match question {
            Question::Firmware => self.firmware_answered(value),
            Question::DeviceType => {
                self.bring_up.identified = true;
                if let Some(device_type) = &value
                    && ["E220", "E32"].iter().any(|other| device_type.starts_with(other))
                {
                    let device_type = device_type.clone();
                    self.fault(Diagnostic::OtherFamily { device_type });
                    return;
                }
                self.facts.device_type = value;
                if self.reset_wanted {
                    self.ask(Question::Reset);
                } else {
                    self.ask(Question::Frequency);
                }
            }
            Question::Frequency => {
                self.bring_up.grid = match (&reply, value.as_deref().map(parse_ufreq)) {
                    (_, Some(Some((true, start_hz, step_hz, _)))) => Grid::Set { start_hz, step_hz },
                    (_, Some(Some((false, ..)))) | (Some(AtReply::Error), _) => Grid::Own,
                    _ => Grid::Unknown,
                };
                let understood = matches!(value.as_deref().map(parse_ufreq), Some(Some(_)));
                let found_hz = self.bring_up.grid.frequency_hz(self.config.channel);
                if understood && found_hz != Some(self.config.frequency_hz) && !self.bring_up.frequency_set {
                    self.set_state(DriverState::Configure);
                    self.ask(Question::SetFrequency);
                } else {
                    self.plan_aux();
                }
            }
            Question::SetFrequency => {
                self.bring_up.frequency_set = true;
                if reply == Some(AtReply::Ok) {
                    // Taken into use by a reset, so the code that publishes this command says.
                    self.ask(Question::Reset);
                } else {
                    self.plan_aux();
                }
            }
            Question::Reset => {
                self.bring_up.reset_done = true;
                self.bring_up.attempts = 0;
                self.reset_wanted = false;
                let fast = self.facts.generation == Generation::V2_2;
                self.pause(if fast { FAST_BOOT_US } else { SLOW_BOOT_US }, Then::Rebooted);
            }
            Question::Aux | Question::CheckAux => {
                let on = value.as_deref() == Some("1");
                if on || question == Question::CheckAux || value.is_none() {
                    self.aux_settled(on);
                } else {
                    self.set_state(DriverState::Configure);
                    self.ask(Question::SetAux);
                }
            }
            Question::SetAux if reply == Some(AtReply::Ok) => self.ask(Question::CheckAux),
            _ => self.aux_settled(false),
        }
    }

    fn firmware_answered(&mut self, firmware: Option<String>) {
        if self.bring_up.post_mortem {
            let diagnostic = if firmware.is_some() {
                Diagnostic::RegistersSilent
            } else if self.bring_up.echo_only {
                Diagnostic::EchoOnly
            } else if self.bring_up.garbage > 0 {
                Diagnostic::Garbled { bytes: self.bring_up.garbage }
            } else {
                Diagnostic::NoAnswer
            };
            self.fault(diagnostic);
            return;
        }
        self.bring_up.at_works = firmware.is_some();
        self.facts.generation = match firmware.as_deref() {
            None => Generation::V1,
            Some(code) if code.starts_with("7364-") => Generation::V2_1,
            Some(code) if code.starts_with("7453-") => Generation::V2_2,
            Some(_) => Generation::OtherV2,
        };
        self.facts.firmware = firmware;
        if self.bring_up.at_works {
            self.ask(Question::DeviceType);
        } else {
            self.bring_up.identified = true;
            self.reset_wanted = false;
            self.plan_write();
        }
    }

    fn plan_aux(&mut self) {
        if self.config.aux == AuxWiring::Present {
            self.ask(Question::Aux);
        } else {
            self.plan_write();
        }
    }

    fn aux_settled(&mut self, on: bool) {
        self.facts.uaux = Some(on);
        if !on {
            self.push(DriverOutput::Diagnostic(Diagnostic::UauxRefused));
        }
        self.plan_write();
    }

    fn plan_write(&mut self) {
        if self.facts.registers == Some(self.wanted_registers()) && !self.config.always_write {
            // The block was read in this very session: that is the verification.
            self.facts.configuration_verified = true;
            self.set_state(DriverState::Verify);
            self.leave_configuration();
        } else {
            self.write_registers();
        }
    }

    fn write_registers(&mut self) {
        self.bring_up.written += 1;
        self.set_state(DriverState::Configure);
        self.ask(Question::Write);
    }

    fn read_back(&mut self) {
        self.set_state(DriverState::Verify);
        self.ask(Question::ReadBack);
    }

    fn pause(&mut self, pause_us: u64, then: Then) {
        let until_us = self.now_us + pause_us;
        self.bring_up.step = Some(Step::Pause { until_us, then });
    }

    fn become_ready(&mut self) {
        if let Some(registers) = self.facts.registers {
            self.facts.frequency_hz = self.bring_up.grid.frequency_hz(registers.channel());
            self.facts.frequency_verified = self.facts.frequency_hz == Some(self.config.frequency_hz);
        }
        if !self.facts.frequency_verified {
            self.push(DriverOutput::Diagnostic(Diagnostic::FrequencyUnverified {
                wanted_hz: self.config.frequency_hz,
                found_hz: self.facts.frequency_hz,
            }));
        }
        self.bring_up.step = None;
        self.closed_tries = 0;
        self.fault_tries = 0;
        self.reset_wanted = false;
        self.set_state(DriverState::Ready);
    }
}
