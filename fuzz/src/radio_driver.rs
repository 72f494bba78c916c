//! The driver of the radio module between an honest module and forged bytes, in every state it can be brought to.

use std::collections::BTreeMap;

use radio::driver::{AuxWiring, Driver, DriverConfig, DriverInput, DriverOutput, DriverState, ModePins};
use radio::model::{Firmware, ModelConfig, ModelOutput, Module, Quirks};

/// Events that one input may cost.
const EVENTS: u32 = 600;
/// Outputs of one input to the driver; the longest real chain is a transmission that fails into a reopening.
const OUTPUTS: usize = 256;
/// Longest request or frame that is ever written: header and frame.
const WRITE_BYTES: usize = 243;
/// Longest way to rest with nothing but wakes (see the driver's own tests).
const SETTLED_WITHIN_US: u64 = 60_000_000;
/// Longest pause that the driver may ask for before a reopening.
const REOPEN_US: u64 = 5_000_000;

/// Answers that the protocol knows, where noise alone would seldom form one.
const ANSWERS: [&[u8]; 16] = [
    &[0xC1, 0, 9, 0xDE, 0x70, 0, 0x62, 0, 0x19, 0xC3, 0, 0],
    &[0xC1, 0, 9, 0, 0, 0, 0x62, 0, 0x17, 3, 0, 0],
    &[0xC1, 0, 9],
    &[0xC1, 0, 9, 0xC1, 0, 9, 0xC1, 0, 9, 0xC1, 0, 9],
    &[0xC1, 0xC2, 0xC3, 2, 2],
    &[0xC1, 0xC2, 0xC3, 2, 0],
    &[0xFF, 0xFF, 0xFF],
    b"AT+FWCODE=7453-0-21\r\n",
    b"FWCODE=7364-0-10",
    b"AT+DEVTYPE=E22-400T30D\r\n",
    b"AT+UFREQ=0,1,1,1\r\n",
    b"AT+UFREQ=1,410000000,1000000,83\r\n",
    b"AT+UFREQ=1,4294967295,4294967295,83\r\n",
    b"=OK\r\n",
    b"=ERR\r\n",
    b"AT+UAUX=0\r\n",
];

/// First byte the wiring, second the module, then steps: what happens, and how much of it.
pub fn radio_driver(data: &[u8]) {
    let [wiring, module, steps @ ..] = data else { return };
    let mut desk = Desk::new(*wiring, *module);
    let mut steps = steps.iter();
    while let Some(step) = steps.next() {
        let mut amount = || steps.next().copied().unwrap_or(0);
        match step & 0x0F {
            0..=2 => {
                for _ in 0..=amount() {
                    desk.run();
                }
            }
            3 | 4 => {
                let len = usize::from(amount()).min(steps.len());
                let (bytes, rest) = steps.as_slice().split_at(len);
                steps = rest.iter();
                desk.forged(bytes);
            }
            5 => desk.forged(ANSWERS[usize::from(step >> 4)]),
            6 => desk.input(DriverInput::Opened),
            7 => desk.input(DriverInput::Closed),
            8 => desk.input(DriverInput::Aux { idle: step & 0x10 == 0 }),
            9 | 10 => {
                let len = usize::from(amount());
                desk.transmit(&[step ^ 0x5A; 255][..len]);
            }
            11 => desk.input(DriverInput::Drained),
            12 => {
                desk.now_us = desk.driver.next_wakeup_us().unwrap_or(0).max(desk.now_us);
                desk.input(DriverInput::Wake);
            }
            13 => desk.now_us += u64::from(amount()) << (step >> 4),
            14 => {
                let packet = [amount(); 240];
                desk.module.air_receive(desk.now_us, desk.now_us.saturating_sub(1_000), &packet, -90);
            }
            _ => desk.input(DriverInput::Stop),
        }
    }
    desk.comes_to_rest();
}

/// Driver and module on one desk, and somebody who writes between them.
struct Desk {
    driver: Driver,
    module: Module,
    inverted: bool,
    now_us: u64,
    events_left: u32,
    asked: u64,
    /// Frames by how often they were answered.
    answered: BTreeMap<u64, u32>,
    started: bool,
    air_until_us: u64,
    fed_bytes: u64,
    delivered_bytes: u64,
    /// What the last input delivered.
    delivered: Vec<u8>,
    reopen_at_us: Option<u64>,
    touched: bool,
    stopped: bool,
}

impl Desk {
    fn new(wiring: u8, module: u8) -> Self {
        let bit = |byte: u8, n: u8| byte >> n & 1 == 1;
        let mode_pins = match wiring & 3 {
            0 => ModePins::Lines { inverted: false },
            1 => ModePins::Lines { inverted: true },
            2 => ModePins::Software,
            _ => ModePins::Strapped,
        };
        let config = DriverConfig {
            mode_pins,
            aux: if bit(wiring, 2) { AuxWiring::Present } else { AuxWiring::Absent },
            transmit_unverified: bit(wiring, 3),
            save_to_flash: bit(wiring, 4),
            always_write: bit(wiring, 5),
            rssi_byte: bit(wiring, 6).then_some(bit(wiring, 7)),
            ..DriverConfig::default()
        };
        let quirks = Quirks {
            echo: bit(module, 3),
            no_newline: bit(module, 4),
            rejects_crlf: bit(module, 5),
            no_ufreq: bit(module, 6),
            split_frames: bit(module, 7),
            ..Quirks::default()
        };
        let firmware = [Firmware::V2_2, Firmware::V2_1, Firmware::V1, Firmware::V2_2];
        let base = if bit(module, 2) { ModelConfig::default() } else { ModelConfig::prepared(true) };
        Self {
            driver: Driver::new(config),
            module: Module::new(ModelConfig { firmware: firmware[usize::from(module & 3)], quirks, ..base }),
            inverted: wiring & 3 == 1,
            now_us: 1,
            events_left: EVENTS,
            asked: 0,
            answered: BTreeMap::new(),
            started: false,
            air_until_us: 0,
            fed_bytes: 0,
            delivered_bytes: 0,
            delivered: Vec::new(),
            reopen_at_us: None,
            touched: false,
            stopped: false,
        }
    }

    /// The next thing that happens when nobody interferes.
    fn run(&mut self) {
        let next = [self.driver.next_wakeup_us(), self.module.next_event_us(), self.reopen_at_us];
        let Some(next_us) = next.into_iter().flatten().min() else { return };
        let Some(left) = self.events_left.checked_sub(1) else { return };
        self.events_left = left;
        self.now_us = self.now_us.max(next_us);
        while let Some(output) = self.module.poll(self.now_us) {
            match output {
                // A closed port delivers nothing.
                ModelOutput::HostBytes { bytes, .. } if self.reopen_at_us.is_none() => self.forged(&bytes),
                ModelOutput::Aux { idle, .. } if self.driver.config().aux == AuxWiring::Present => {
                    self.input(DriverInput::Aux { idle });
                }
                _ => {}
            }
        }
        if self.reopen_at_us.is_some_and(|at| at <= self.now_us) {
            self.input(DriverInput::Opened);
        }
        self.input(DriverInput::Wake);
    }

    /// Bytes at the port, whoever sent them.
    fn forged(&mut self, bytes: &[u8]) {
        let received = self.driver.state().receives();
        self.fed_bytes += bytes.len() as u64;
        self.input(DriverInput::Bytes(bytes));
        if received {
            // All of it, but for the echo of our own frame in front.
            assert!(bytes.ends_with(&self.delivered), "bytes heard are delivered as they are");
        }
    }

    fn transmit(&mut self, frame: &[u8]) {
        self.asked += 1;
        let refused = self.driver.transmit_refusal().is_some() || !(1..=240).contains(&frame.len());
        self.input(DriverInput::Transmit { id: self.asked, target: 0xDE69, frame });
        let answered = self.answered.contains_key(&self.asked);
        assert!(answered || !refused, "a refusal comes at once");
    }

    fn input(&mut self, input: DriverInput<'_>) {
        match input {
            DriverInput::Opened => (self.reopen_at_us, self.stopped, self.touched) = (None, false, true),
            DriverInput::Closed => self.touched = true,
            DriverInput::Stop => {
                (self.reopen_at_us, self.stopped, self.touched) = (None, true, true);
            }
            _ => {}
        }
        self.driver.handle(self.now_us, input);
        self.delivered.clear();
        let mut outputs = 0;
        while let Some(output) = self.driver.next_output() {
            outputs += 1;
            assert!(outputs <= OUTPUTS, "one input, outputs without end");
            self.output(output);
        }
        let counters = self.driver.counters();
        assert_eq!(counters.delivered_bytes, self.delivered_bytes);
        let accounted = counters.delivered_bytes + counters.discarded_bytes + counters.echo_bytes;
        assert!(accounted <= self.fed_bytes, "more bytes are counted than came");
    }

    fn output(&mut self, output: DriverOutput) {
        match output {
            DriverOutput::Write(bytes) => {
                assert!(!bytes.is_empty() && bytes.len() <= WRITE_BYTES);
                if std::mem::take(&mut self.started) {
                    assert!(self.now_us >= self.air_until_us, "frame over frame");
                    self.air_until_us = self.now_us + self.driver.config().timing.send_us(bytes.len() - 3);
                }
                self.module.host_write(self.now_us, &bytes);
            }
            DriverOutput::SetPins { m0, m1 } => {
                self.module.set_pins(self.now_us, m0 ^ self.inverted, m1 ^ self.inverted);
            }
            DriverOutput::Deliver(bytes) => {
                self.delivered_bytes += bytes.len() as u64;
                self.delivered.extend(bytes);
            }
            DriverOutput::TxStarted { id } => {
                assert!(id == self.asked || !self.answered.contains_key(&id), "an answered frame is sent");
                self.started = true;
            }
            DriverOutput::TxDone { id, .. } => {
                assert!(self.now_us >= self.air_until_us, "done before the end");
                *self.answered.entry(id).or_default() += 1;
            }
            DriverOutput::TxFailed { id, .. } => *self.answered.entry(id).or_default() += 1,
            DriverOutput::Reopen { after_us } => {
                assert!(after_us <= REOPEN_US);
                self.reopen_at_us = Some(self.now_us + after_us);
            }
            DriverOutput::PurgeInput | DriverOutput::State(_) | DriverOutput::Diagnostic(_) => {}
        }
    }

    /// Nobody says anything more: it ends, soon, and every frame has had its one answer.
    fn comes_to_rest(&mut self) {
        let since_us = self.now_us;
        let mut wakes = 0;
        while let Some(at_us) = self.driver.next_wakeup_us() {
            wakes += 1;
            assert!(wakes < 1_000, "wakes without end in {:?}", self.driver.state());
            self.now_us = self.now_us.max(at_us);
            self.input(DriverInput::Wake);
        }
        assert!(self.now_us - since_us <= SETTLED_WITHIN_US, "took {} us", self.now_us - since_us);
        match self.driver.state() {
            DriverState::Ready => {}
            DriverState::Fault => assert!(self.reopen_at_us.is_some()),
            DriverState::Closed => {
                assert!(self.reopen_at_us.is_some() || self.stopped || !self.touched);
            }
            other => unreachable!("rests in {other:?}"),
        }
        for id in 1..=self.asked {
            assert_eq!(self.answered.get(&id), Some(&1), "frame {id}");
        }
    }
}
