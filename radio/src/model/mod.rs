//! The module itself, in virtual time.
//!
//! Bytes written by the host travel at the port's rate, form bursts, become radio packets or commands, and answers
//! travel back in pieces, as an adapter would hand them on. Where the data sheet is silent the model takes the reading
//! that hurts more: bytes that arrive during a mode change or a boot are lost, an AUX that does not follow the radio
//! rises as soon as the radio has the bytes.
//!
//! The model costs a handful of events per frame and allocates per packet, not per byte.
//!
//! Not modelled: WOR timing, LBT, repeater, over-the-air configuration, the key (it is kept, not applied), parity.

mod aux_pin;
mod config;
mod configuration;
mod data;
mod timeline;

pub use config::{Firmware, ModelConfig, Quirks, Ufreq};

use std::collections::VecDeque;

use crate::airtime::uart_us;
use crate::command::Mode;
use crate::registers::Registers;
use aux_pin::AuxLine;
use data::{Burst, RadioPacket};
use timeline::{Event, Timeline};

/// The module's buffer, each way.
pub const BUFFER_BYTES: usize = 1000;
/// A mode change takes this long, AUX low after the first [`MODE_CHANGE_LEAD_US`].
const MODE_CHANGE_US: u64 = 10_000;
const MODE_CHANGE_LEAD_US: u64 = 2_000;
/// AUX goes low this long before the first byte of output.
const OUTPUT_LEAD_US: u64 = 2_500;
/// Bytes handed over at once: 25 ms at 9600 baud, somewhat coarser than an adapter's latency timer of 16 ms makes them.
const PIECE_BYTES: usize = 24;
const SPLIT_OUTPUT_US: u64 = 30_000;
const SPLIT_WRITE_US: u64 = 20_000;

/// What the module does, in order of time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ModelOutput {
    /// Bytes that have reached the host.
    HostBytes {
        /// When the last of them arrived.
        at_us: u64,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// AUX changed.
    Aux {
        /// When.
        at_us: u64,
        /// True for the high level.
        idle: bool,
    },
    /// A radio packet begins to leave the antenna.
    AirSent {
        /// First symbol.
        start_us: u64,
        /// After the last symbol.
        end_us: u64,
        /// Address it is meant for; 0xFFFF is everyone.
        target: u16,
        /// Channel it is sent on.
        channel: u8,
        /// Carrier frequency.
        frequency_hz: u32,
        /// Payload, without the fixed-point header.
        packet: Vec<u8>,
    },
}

impl ModelOutput {
    /// When it happens.
    #[must_use]
    pub const fn at_us(&self) -> u64 {
        match self {
            Self::HostBytes { at_us, .. } | Self::Aux { at_us, .. } => *at_us,
            Self::AirSent { start_us, .. } => *start_us,
        }
    }
}

/// What the model has counted; for tests and for the twin's report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ModelCounters {
    /// Bytes lost because the buffer was full, the module booted, slept or changed its mode, or the baud differed.
    pub lost_input_bytes: u64,
    /// Radio packets sent.
    pub sent_packets: u64,
    /// Radio packets given to the host.
    pub received_packets: u64,
    /// Radio packets not heard: sending, asleep, configuring, other channel or address, or no room.
    pub missed_packets: u64,
    /// Writes to flash.
    pub flash_writes: u64,
    /// Resets by command.
    pub resets: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Power {
    Booting,
    Running,
    /// Hangs until reset (a quirk).
    Hung,
}

/// Settings that AT commands hold apart from the registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Extras {
    ufreq: Option<Ufreq>,
    uaux: bool,
    crypt: [u8; 2],
}

/// The module. See the [module documentation](self).
#[derive(Debug)]
pub struct Module {
    config: ModelConfig,
    now_us: u64,
    timeline: Timeline,
    ready: VecDeque<ModelOutput>,
    counters: ModelCounters,

    power: Power,
    /// Counts boots and mode changes, so that events of an earlier life are recognised.
    life: u32,
    pins: (bool, bool),
    mode: Mode,
    mode_since_us: u64,
    /// A mode asked for and not yet begun.
    mode_wanted: Option<Mode>,
    /// A mode change that is under way.
    mode_coming: Option<Mode>,

    flash: Registers,
    ram: Registers,
    flash_extras: Extras,
    extras: Extras,

    host_line_free_us: u64,
    /// Pieces on their way from the host: first byte's start, bytes.
    incoming: VecDeque<(u64, Vec<u8>)>,
    burst: Burst,
    queue: VecDeque<RadioPacket>,
    sending_until_us: Option<u64>,
    last_sent_us: (u64, u64),
    transmissions: u32,

    output_free_us: u64,
    /// End of each output under way, with its length; AUX is low until the last.
    outputs: VecDeque<(u64, usize)>,
    aux: AuxLine,
}

impl Module {
    /// A module that is powered up at time 0.
    #[must_use]
    pub fn new(config: ModelConfig) -> Self {
        let extras = Extras { ufreq: config.ufreq, ..Extras::default() };
        let mut module = Self {
            now_us: 0,
            timeline: Timeline::default(),
            ready: VecDeque::new(),
            counters: ModelCounters::default(),
            power: Power::Booting,
            life: 0,
            pins: config.pins,
            mode: Mode::from_pins(config.pins.0, config.pins.1),
            mode_since_us: 0,
            mode_wanted: None,
            mode_coming: None,
            flash: config.registers,
            ram: config.registers,
            flash_extras: extras,
            extras,
            host_line_free_us: 0,
            incoming: VecDeque::new(),
            burst: Burst::default(),
            queue: VecDeque::new(),
            sending_until_us: None,
            last_sent_us: (0, 0),
            transmissions: 0,
            output_free_us: 0,
            outputs: VecDeque::new(),
            aux: AuxLine::default(),
            config,
        };
        if let Some(period_us) = module.config.quirks.aux_chatter_us {
            module.timeline.push(period_us.max(1), Event::Chatter);
        }
        module.boot();
        module
    }

    /// The host's port begins to send these bytes, after whatever it is still sending.
    pub fn host_write(&mut self, now_us: u64, bytes: &[u8]) {
        self.advance(now_us);
        let split = self.config.quirks.split_writes_after.unwrap_or(bytes.len()).min(bytes.len());
        let (head, tail) = bytes.split_at(split);
        self.incoming_bytes(0, head);
        self.incoming_bytes(SPLIT_WRITE_US, tail);
    }

    /// The host drives the mode pins.
    pub fn set_pins(&mut self, now_us: u64, m0: bool, m1: bool) {
        self.advance(now_us);
        if self.pins != (m0, m1) {
            self.pins = (m0, m1);
            self.want_mode(Mode::from_pins(m0, m1));
            self.settle();
        }
    }

    /// A packet for everyone on channel 0x19 was on the air from `start_us` to `now_us`. Lost when the module was
    /// sending, asleep, configuring, or is on another channel.
    pub fn air_receive(&mut self, now_us: u64, start_us: u64, packet: &[u8], rssi_dbm: i16) {
        self.air_receive_for(now_us, start_us, 0xFFFF, 0x19, packet, rssi_dbm);
    }

    /// [`Module::air_receive`] of a packet for one address on one channel.
    pub fn air_receive_for(
        &mut self,
        now_us: u64,
        start_us: u64,
        target: u16,
        channel: u8,
        packet: &[u8],
        rssi_dbm: i16,
    ) {
        self.advance(now_us);
        self.hear(start_us, target, channel, packet, rssi_dbm);
        self.settle();
    }

    /// When [`Module::poll`] has something next. It may then still be None: not every step inside is an output.
    #[must_use]
    pub fn next_event_us(&self) -> Option<u64> {
        self.ready.front().map(ModelOutput::at_us).or_else(|| self.timeline.next_us())
    }

    /// The next output that is due at `now_us`; call until None.
    pub fn poll(&mut self, now_us: u64) -> Option<ModelOutput> {
        while self.ready.is_empty() && self.timeline.next_us().is_some_and(|at| at <= now_us) {
            self.step(now_us);
        }
        if self.ready.is_empty() {
            self.now_us = self.now_us.max(now_us);
        }
        self.ready.pop_front()
    }

    /// End of the transmission that is going on, if one is.
    #[must_use]
    pub fn transmitting_until_us(&self) -> Option<u64> {
        self.sending_until_us
    }

    /// What the module was made as.
    #[must_use]
    pub fn config(&self) -> &ModelConfig {
        &self.config
    }

    /// What is wrong with the module, to be changed in the middle of a test.
    pub fn quirks_mut(&mut self) -> &mut Quirks {
        &mut self.config.quirks
    }

    /// What was counted.
    #[must_use]
    pub fn counters(&self) -> &ModelCounters {
        &self.counters
    }

    /// Registers in use.
    #[must_use]
    pub fn registers(&self) -> Registers {
        self.ram
    }

    /// The mode in effect.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Carrier frequency in use.
    #[must_use]
    pub fn frequency_hz(&self) -> u32 {
        let channel = u32::from(self.ram.channel());
        match self.extras.ufreq {
            Some(grid) => grid.start_hz.saturating_add(grid.step_hz.saturating_mul(channel)),
            None => crate::registers::grid_frequency_hz(self.ram.channel()),
        }
    }

    /// Level of AUX.
    #[must_use]
    pub fn aux_idle(&self) -> bool {
        self.aux.level()
    }

    /// Takes the power away and gives it back: RAM settings are lost, what was on its way is lost.
    pub fn power_cycle(&mut self, now_us: u64) {
        self.advance(now_us);
        self.boot();
    }

    /// The rate of the module's UART: 9600 in configuration mode.
    fn baud(&self) -> u32 {
        if self.mode == Mode::Configuration { 9600 } else { self.ram.baud() }
    }

    fn baud_matches(&self) -> bool {
        self.baud() == self.config.host_baud
    }

    fn boot(&mut self) {
        let boot_us = self.config.quirks.slow_boot_us.unwrap_or(match self.config.firmware {
            Firmware::V1 => 30_000,
            Firmware::V2_1 => 500_000,
            Firmware::V2_2 => 16_000,
        });
        self.life += 1;
        self.power = Power::Booting;
        self.ram = self.flash;
        self.extras = self.flash_extras;
        self.mode_wanted = None;
        self.mode_coming = None;
        self.mode = Mode::from_pins(self.pins.0, self.pins.1);
        self.mode_since_us = self.now_us + boot_us;
        self.burst = Burst::default();
        self.queue.clear();
        self.outputs.clear();
        self.timeline.forget_output();
        self.output_free_us = self.now_us;
        self.sending_until_us = None;
        self.timeline.push(self.now_us + boot_us, Event::Booted { life: self.life });
        self.settle();
    }

    /// Handles everything due before an input at `now_us`.
    fn advance(&mut self, now_us: u64) {
        while self.timeline.next_us().is_some_and(|at| at <= now_us) {
            self.step(now_us);
        }
        self.now_us = self.now_us.max(now_us);
    }

    fn step(&mut self, now_us: u64) {
        let Some((at_us, event)) = self.timeline.pop(now_us) else { return };
        self.now_us = self.now_us.max(at_us);
        match event {
            Event::Booted { life } if life == self.life => {
                self.power = Power::Running;
                self.mode_since_us = self.now_us;
            }
            Event::ModeLow { life } if life == self.life => {
                if self.mode_coming.is_some() {
                    self.aux.mode_change = true;
                }
            }
            Event::Reset { life } if life == self.life => self.boot(),
            Event::ModeDone { life } if life == self.life => self.mode_done(),
            Event::Arrived => self.arrived(),
            Event::BurstEnd { burst } => self.burst_end(burst),
            Event::RadioDone { life } if life == self.life => self.radio_done(),
            Event::Output { bytes } => {
                self.ready.push_back(ModelOutput::HostBytes { at_us: self.now_us, bytes });
            }
            Event::OutputDone { life } if life == self.life => {
                self.outputs.pop_front();
            }
            Event::Chatter => {
                self.aux.flipped = !self.aux.flipped;
                if let Some(period_us) = self.config.quirks.aux_chatter_us {
                    self.timeline.push(self.now_us + period_us.max(1), Event::Chatter);
                } else {
                    self.aux.flipped = false;
                }
            }
            Event::Booted { .. }
            | Event::Reset { .. }
            | Event::ModeLow { .. }
            | Event::ModeDone { .. }
            | Event::RadioDone { .. }
            | Event::OutputDone { .. } => {}
        }
        self.settle();
    }

    /// Begins what has become possible, and shows it on AUX.
    fn settle(&mut self) {
        if self.power == Power::Running {
            self.start_radio();
            self.start_mode_change();
        }
        let busy = self.power != Power::Running
            || self.aux.mode_change
            || !self.outputs.is_empty()
            || !self.burst.is_empty()
            || !self.queue.is_empty()
            || (self.sending_until_us.is_some() && self.aux_follows_radio());
        if let Some(idle) = self.aux.show(busy, self.config.quirks.aux_stuck) {
            self.ready.push_back(ModelOutput::Aux { at_us: self.now_us, idle });
        }
    }

    fn aux_follows_radio(&self) -> bool {
        self.config.firmware != Firmware::V2_2 || self.extras.uaux
    }

    fn want_mode(&mut self, mode: Mode) {
        self.mode_wanted = Some(mode);
    }

    /// A change asked for while the module is busy waits until it is idle.
    fn start_mode_change(&mut self) {
        let busy = self.sending_until_us.is_some()
            || !self.queue.is_empty()
            || !self.burst.is_empty()
            || !self.outputs.is_empty();
        if busy || self.mode_coming.is_some() {
            return;
        }
        let Some(mode) = self.mode_wanted.take() else { return };
        if mode == self.mode {
            return;
        }
        self.mode_coming = Some(mode);
        self.timeline.push(self.now_us + MODE_CHANGE_LEAD_US, Event::ModeLow { life: self.life });
        self.timeline.push(self.now_us + MODE_CHANGE_US, Event::ModeDone { life: self.life });
    }

    fn mode_done(&mut self) {
        if let Some(mode) = self.mode_coming.take() {
            self.mode = mode;
            self.mode_since_us = self.now_us;
        }
        self.aux.mode_change = false;
    }

    /// Queues bytes for the host; false if there is no room.
    fn output(&mut self, delay_us: u64, bytes: &[u8]) -> bool {
        let waiting: usize = self.outputs.iter().map(|(_, len)| len).sum();
        if bytes.is_empty() || waiting + bytes.len() > BUFFER_BYTES {
            return false;
        }
        let baud = self.baud();
        let garbled = !self.baud_matches();
        let mut at_us = (self.now_us + delay_us).max(self.output_free_us) + OUTPUT_LEAD_US;
        let pause_before = if self.config.quirks.split_frames { bytes.len() / 2 } else { usize::MAX };
        let mut from = 0;
        while from < bytes.len() {
            let mut to = (from + PIECE_BYTES).min(bytes.len());
            if from < pause_before && pause_before < to && pause_before > 0 {
                to = pause_before;
            }
            if from == pause_before && from > 0 {
                at_us += SPLIT_OUTPUT_US;
            }
            at_us += uart_us(to - from, baud);
            let mut piece = bytes[from..to].to_vec();
            if garbled {
                // Neither the values nor the number of bytes survive a wrong rate; the values are enough here.
                piece.iter_mut().for_each(|b| *b = b.wrapping_mul(0xB5) | 0x80);
            }
            if !self.config.quirks.mute {
                self.timeline.push(at_us, Event::Output { bytes: piece });
            }
            from = to;
        }
        self.output_free_us = at_us;
        self.outputs.push_back((at_us, bytes.len()));
        self.timeline.push(at_us, Event::OutputDone { life: self.life });
        true
    }
}
