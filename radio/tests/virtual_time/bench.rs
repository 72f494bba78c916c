//! Driver and model joined in virtual time: what the shell does between a port and the driver, without a port.

use std::collections::VecDeque;

use radio::airtime::uart_us;
use radio::driver::{
    Diagnostic, Driver, DriverConfig, DriverInput, DriverOutput, DriverState, Radiated, TxFailure,
};
use radio::model::{ModelConfig, ModelOutput, Module};

/// A packet that left the antenna.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Sent {
    pub(crate) start_us: u64,
    pub(crate) end_us: u64,
    pub(crate) target: u16,
    pub(crate) channel: u8,
    pub(crate) frequency_hz: u32,
    pub(crate) packet: Vec<u8>,
}

#[derive(Debug)]
enum Late {
    Bytes(Vec<u8>),
    Aux(bool),
    Drained,
}

/// The bench: one driver, one module, a wire between them.
#[derive(Debug)]
pub(crate) struct Bench {
    pub(crate) now_us: u64,
    pub(crate) driver: Driver,
    pub(crate) module: Module,
    /// Everything the driver said, with its time.
    pub(crate) log: Vec<(u64, DriverOutput)>,
    pub(crate) delivered: Vec<u8>,
    pub(crate) sent: Vec<Sent>,
    /// The port exists.
    pub(crate) port_present: bool,
    pub(crate) port_open: bool,
    /// The inverter between the lines and the pins.
    pub(crate) inverted_lines: bool,
    /// AUX is wired through to the driver.
    pub(crate) aux_wired: bool,
    /// Delay of an adapter for bytes and AUX.
    pub(crate) latency_us: u64,
    late: VecDeque<(u64, Late)>,
    host_line_free_us: u64,
    reopen_us: Option<u64>,
}

impl Bench {
    pub(crate) fn new(driver: DriverConfig, model: ModelConfig) -> Self {
        let inverted_lines = driver.mode_pins == (radio::driver::ModePins::Lines { inverted: true });
        let aux_wired = driver.aux == radio::driver::AuxWiring::Present;
        Self {
            now_us: 0,
            driver: Driver::new(driver),
            module: Module::new(model),
            log: Vec::new(),
            delivered: Vec::new(),
            sent: Vec::new(),
            port_present: true,
            port_open: false,
            inverted_lines,
            aux_wired,
            latency_us: 0,
            late: VecDeque::new(),
            host_line_free_us: 0,
            reopen_us: None,
        }
    }

    /// Opens the port now, as the shell does at its start.
    pub(crate) fn open(&mut self) {
        self.reopen_us = None;
        if self.port_present {
            self.port_open = true;
            self.input(DriverInput::Opened);
            if self.aux_wired {
                let idle = self.module.aux_idle();
                self.input(DriverInput::Aux { idle });
            }
        } else {
            self.input(DriverInput::Closed);
        }
    }

    /// Pulls the adapter out.
    pub(crate) fn unplug(&mut self) {
        self.port_present = false;
        if std::mem::take(&mut self.port_open) {
            self.input(DriverInput::Closed);
        }
    }

    pub(crate) fn input(&mut self, input: DriverInput<'_>) {
        self.driver.handle(self.now_us, input);
        self.drain();
    }

    pub(crate) fn transmit(&mut self, id: u64, frame: &[u8]) {
        self.input(DriverInput::Transmit { id, target: 0xDE69, frame });
    }

    fn drain(&mut self) {
        while let Some(output) = self.driver.next_output() {
            match &output {
                DriverOutput::Write(bytes) => {
                    assert!(self.port_open, "write to a closed port");
                    // A transparent module sends header and frame as two packets; nothing can be promised for it.
                    assert!(
                        self.module.transmitting_until_us().is_none()
                            || !self.module.registers().fixed_point(),
                        "write while the module is sending, at {}",
                        self.now_us
                    );
                    self.module.host_write(self.now_us, bytes);
                    let done_us = self.host_line_free_us.max(self.now_us)
                        + uart_us(bytes.len(), self.module.config().host_baud);
                    self.host_line_free_us = done_us;
                    self.late.push_back((done_us, Late::Drained));
                }
                DriverOutput::SetPins { m0, m1 } => {
                    let (m0, m1) = (m0 ^ self.inverted_lines, m1 ^ self.inverted_lines);
                    self.module.set_pins(self.now_us, m0, m1);
                }
                DriverOutput::PurgeInput => self.late.retain(|(_, late)| !matches!(late, Late::Bytes(_))),
                DriverOutput::Deliver(bytes) => self.delivered.extend_from_slice(bytes),
                DriverOutput::Reopen { after_us } => {
                    self.port_open = false;
                    self.late.clear();
                    self.reopen_us = Some(self.now_us + after_us);
                }
                _ => {}
            }
            self.log.push((self.now_us, output));
        }
    }

    fn next_us(&self) -> Option<u64> {
        let late_us = self.late.iter().map(|(at, _)| *at).min();
        [self.driver.next_wakeup_us(), self.module.next_event_us(), late_us, self.reopen_us]
            .into_iter()
            .flatten()
            .min()
    }

    /// Runs until a time.
    pub(crate) fn run_until(&mut self, until_us: u64) {
        self.run(until_us, |_| false);
    }

    pub(crate) fn run_for(&mut self, duration_us: u64) {
        self.run_until(self.now_us + duration_us);
    }

    /// Runs until a state, or a time; returns whether the state was reached.
    pub(crate) fn run_to_state(&mut self, state: DriverState, within_us: u64) -> bool {
        self.run(self.now_us + within_us, |bench| bench.driver.state() == state)
    }

    /// Opens and runs to Ready; panics if that takes longer.
    pub(crate) fn bring_up(&mut self, within_us: u64) {
        self.open();
        assert!(self.run_to_state(DriverState::Ready, within_us), "not ready: {:#?}", self.log);
    }

    pub(crate) fn run(&mut self, until_us: u64, mut stop: impl FnMut(&Self) -> bool) -> bool {
        let mut idle_steps = 0;
        loop {
            if stop(self) {
                return true;
            }
            let Some(next_us) = self.next_us().filter(|at| *at <= until_us) else {
                self.now_us = self.now_us.max(until_us);
                return stop(self);
            };
            idle_steps = if next_us > self.now_us { 0 } else { idle_steps + 1 };
            assert!(idle_steps < 10_000, "time stands still at {}: {:?}", self.now_us, self.driver);
            self.now_us = self.now_us.max(next_us);
            self.step();
        }
    }

    fn step(&mut self) {
        while let Some(output) = self.module.poll(self.now_us) {
            match output {
                ModelOutput::HostBytes { bytes, .. } if self.port_open => {
                    self.late.push_back((self.now_us + self.latency_us, Late::Bytes(bytes)));
                }
                ModelOutput::Aux { idle, .. } if self.port_open && self.aux_wired => {
                    self.late.push_back((self.now_us + self.latency_us, Late::Aux(idle)));
                }
                ModelOutput::AirSent { start_us, end_us, target, channel, frequency_hz, packet } => {
                    if let Some(last) = self.sent.last() {
                        assert!(start_us >= last.end_us, "two packets on the air");
                    }
                    self.sent.push(Sent { start_us, end_us, target, channel, frequency_hz, packet });
                }
                ModelOutput::HostBytes { .. } | ModelOutput::Aux { .. } => {}
            }
        }
        while let Some(at) = self.late.iter().position(|(at, _)| *at <= self.now_us) {
            match self.late.remove(at) {
                Some((_, Late::Bytes(bytes))) => self.input(DriverInput::Bytes(&bytes)),
                Some((_, Late::Aux(idle))) => self.input(DriverInput::Aux { idle }),
                Some((_, Late::Drained)) => self.input(DriverInput::Drained),
                None => {}
            }
        }
        if self.reopen_us.is_some_and(|at| at <= self.now_us) {
            self.open();
        }
        self.input(DriverInput::Wake);
    }

    /// A packet that ends now arrives from the satellite.
    pub(crate) fn hear(&mut self, packet: &[u8], rssi_dbm: i16) {
        let start_us = self.now_us.saturating_sub(self.module.config().phy.time_on_air_us(packet.len()));
        self.module.air_receive(self.now_us, start_us, packet, rssi_dbm);
    }

    /// Lets a packet begin and end, and be delivered.
    pub(crate) fn hear_whole(&mut self, packet: &[u8], rssi_dbm: i16) {
        self.run_for(self.module.config().phy.time_on_air_us(packet.len()) + 1);
        self.hear(packet, rssi_dbm);
        self.run_for(400_000);
    }

    pub(crate) fn diagnostics(&self) -> Vec<&Diagnostic> {
        self.log
            .iter()
            .filter_map(|(_, output)| match output {
                DriverOutput::Diagnostic(diagnostic) => Some(diagnostic),
                _ => None,
            })
            .collect()
    }

    /// How a transmission ended: (radiated and reason of a failure, or None), with airtime and measured of a success.
    pub(crate) fn outcome(&self, wanted: u64) -> Option<Result<(u64, bool), (Radiated, TxFailure)>> {
        self.log.iter().find_map(|(_, output)| match output {
            DriverOutput::TxDone { id, airtime_us, measured } if *id == wanted => {
                Some(Ok((*airtime_us, *measured)))
            }
            DriverOutput::TxFailed { id, radiated, reason } if *id == wanted => {
                Some(Err((*radiated, *reason)))
            }
            _ => None,
        })
    }

    /// Sends a frame and waits for its outcome.
    pub(crate) fn send(&mut self, id: u64, frame: &[u8]) -> Result<(u64, bool), (Radiated, TxFailure)> {
        self.transmit(id, frame);
        self.run(self.now_us + 30_000_000, |bench| bench.outcome(id).is_some());
        self.outcome(id).expect("every transmission ends")
    }
}

/// A frame whose bytes are all different from their neighbours.
pub(crate) fn frame(len: usize, seed: u8) -> Vec<u8> {
    (0..len).map(|n| (n as u8).wrapping_mul(37).wrapping_add(seed)).collect()
}
