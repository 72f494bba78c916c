//! The twin, its channel and the ground's E22 module: what the far end of a serial port is, event by event.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, VecDeque},
};

use radio::{
    airtime::LinkTiming,
    model::{ModelConfig, ModelOutput, Module},
};
use tle::{PropagationError, doppler::downlink_shift_hz};

use crate::{
    Channel, ChannelConfig, ChannelStats, Fault, JournalEntry, Orbit, Transit, Twin, TwinConfig, TwinState,
    TwinStats,
};

/// Pause between two frames that the satellite's module holds already.
const NEXT_FRAME_GAP_US: u64 = 5_000;
/// A frame that follows within this time was written to the module while it sent the one before.
const NEXT_FRAME_WINDOW_US: u64 = 1_000;
/// How long before a frame its noise ends.
const NOISE_LEAD_US: u64 = 40_000;
/// Strength the module reports for noise, dBm.
const NOISE_DBM: i16 = -125;
/// Address of everyone.
const BROADCAST: u16 = 0xFFFF;
/// A receiver hears a carrier this far from its own: a quarter of 500 kHz, the wider of the two bandwidths that
/// the module may have (docs/twin.md).
const TUNING_MAX_HZ: f64 = 125_000.0;
/// The Doppler shift that the module takes in any case, Hz: a quarter of 125 kHz, the narrower of the two bandwidths that it
/// may have. At 435 MHz no orbit above 200 km shifts more than 11 kHz, so nothing is lost to it; what is left is the
/// margin for the oscillators.
pub const DOPPLER_TOLERANCE_HZ: u32 = 31_250;

/// What is joined.
#[derive(Clone, Debug)]
pub struct DeviceConfig {
    /// The satellite.
    pub twin: TwinConfig,
    /// Its permanent memory: new, or rebuilt from a journal.
    pub state: TwinState,
    /// The air.
    pub channel: ChannelConfig,
    /// The ground's module.
    pub model: ModelConfig,
    /// Modem and UART at the satellite's end.
    pub timing: LinkTiming,
    /// Address of the satellite's module.
    pub satellite_address: u16,
    /// Channel number of the satellite's module.
    pub channel_number: u8,
    /// Carrier of the satellite's module, Hz.
    pub frequency_hz: u32,
}

impl DeviceConfig {
    /// A new satellite with PixelSat I's radio settings.
    #[must_use]
    pub fn new(twin: TwinConfig, channel: ChannelConfig, model: ModelConfig) -> Self {
        Self {
            twin,
            state: TwinState::default(),
            channel,
            model,
            timing: LinkTiming::default(),
            satellite_address: 0xDE69,
            channel_number: 0x19,
            frequency_hz: 435_000_000,
        }
    }
}

/// What comes out, in order of time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceOutput {
    /// Bytes for the host's serial port.
    HostBytes(Vec<u8>),
    /// The module's AUX line.
    Aux {
        /// True for the high level.
        idle: bool,
    },
    /// Something for the journal. A [`JournalEntry::Stored`] must be durable before the next output is taken.
    Journal(JournalEntry),
}

/// What was done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceStats {
    /// The flight software.
    pub twin: TwinStats,
    /// The air.
    pub channel: ChannelStats,
    /// Packets the ground's module radiated.
    pub ground_packets: u64,
    /// Time the ground's module radiated, µs.
    pub airtime_up_us: u64,
    /// Time the satellite radiated, µs.
    pub airtime_down_us: u64,
    /// Ground's packets lost because the satellite was sending.
    pub up_half_duplex: u64,
    /// Ground's packets for another address, channel or frequency.
    pub up_not_for_us: u64,
    /// Frames that ground's module did not hear because a transmitter beside it was on the air.
    pub down_deafened: u64,
    /// The largest Doppler shift that a frame had, either way, while the satellite was above the horizon, Hz. To be held
    /// against [`DOPPLER_TOLERANCE_HZ`]. 0 in a stored profile, which knows of no Doppler.
    pub doppler_max_hz: u32,
}

/// Something on its way. The variants' order does not matter: equal times are kept in order of creation.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Event {
    /// The end of a ground packet reaches the satellite's antenna.
    UpHeard { start_us: u64, packet: Vec<u8> },
    /// The satellite's module has handed a packet to the computer.
    UpDelivered { packet: Vec<u8> },
    /// The satellite's antenna begins to radiate.
    DownStarts { end_us: u64, frame: Vec<u8> },
    /// It ends.
    DownEnds,
    /// The end of a packet reaches the ground's antenna.
    DownHeard { start_us: u64, bytes: Vec<u8>, rssi_dbm: i16 },
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Scheduled {
    at_us: u64,
    number: u64,
    event: Event,
}

impl Ord for Scheduled {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.at_us, self.number).cmp(&(other.at_us, other.number))
    }
}

impl PartialOrd for Scheduled {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// The far end of a serial port. Times are microseconds on one monotonic scale and never go back.
///
/// Call [`Device::poll`] until `None` before [`Device::host_write`] and [`Device::set_pins`].
#[derive(Debug)]
pub struct Device {
    twin: Twin,
    channel: Channel,
    module: Module,
    timing: LinkTiming,
    satellite_address: u16,
    channel_number: u8,
    frequency_hz: u32,
    events: BinaryHeap<Reverse<Scheduled>>,
    scheduled: u64,
    outbox: VecDeque<DeviceOutput>,
    /// When the satellite's radiation that was begun last began and ends.
    radiating_us: (u64, u64),
    /// Time of the last step or input; nothing happens before it any more.
    now_us: u64,
    /// When a transmitter beside the ground's module was on the air, the last two times.
    deaf_us: [(u64, u64); 2],
    /// A moment at which the module claimed an event and had none.
    module_idle_us: Option<u64>,
    stats: DeviceStats,
}

impl Device {
    /// Joins them; everything begins at `config.twin.start_us`.
    #[must_use]
    pub fn new(config: DeviceConfig) -> Self {
        let DeviceConfig {
            twin,
            state,
            channel,
            model,
            timing,
            satellite_address,
            channel_number,
            frequency_hz,
        } = config;
        let (now_us, utc_at_zero) = (twin.start_us, twin.utc_at_zero());
        let twin = Twin::new(twin, state);
        let mut device = Self {
            now_us,
            channel: Channel::new(channel, twin.orbit(), utc_at_zero),
            twin,
            module: Module::new(model),
            timing,
            satellite_address,
            channel_number,
            frequency_hz,
            events: BinaryHeap::new(),
            scheduled: 0,
            outbox: VecDeque::new(),
            radiating_us: (0, 0),
            deaf_us: [(0, 0); 2],
            module_idle_us: None,
            stats: DeviceStats::default(),
        };
        device.drain_journal();
        device
    }

    /// The host's port begins to send these bytes.
    pub fn host_write(&mut self, now_us: u64, bytes: &[u8]) {
        self.module_idle_us = None;
        self.now_us = self.now_us.max(now_us);
        self.module.host_write(now_us, bytes);
    }

    /// The host drives the mode pins (levels at the module).
    pub fn set_pins(&mut self, now_us: u64, m0: bool, m1: bool) {
        self.module_idle_us = None;
        self.now_us = self.now_us.max(now_us);
        self.module.set_pins(now_us, m0, m1);
    }

    /// The next output that is due; call until `None`.
    pub fn poll(&mut self, now_us: u64) -> Option<DeviceOutput> {
        loop {
            if let Some(output) = self.outbox.pop_front() {
                return Some(output);
            }
            let at_us = self.next_inner_us().filter(|at_us| *at_us <= now_us)?;
            self.step(at_us);
            self.drain_journal();
        }
    }

    /// When [`Device::poll`] may have something next; a moment in the past if it has now.
    #[must_use]
    pub fn next_event_us(&self) -> Option<u64> {
        if self.outbox.is_empty() { self.next_inner_us() } else { Some(self.now_us) }
    }

    /// Whether the satellite is above the horizon.
    pub fn in_view(&mut self, now_us: u64) -> bool {
        self.channel.sky_mut().in_view(now_us)
    }

    /// The next moment at which [`Device::in_view`] changes; `None` if it never does.
    pub fn next_view_change_us(&mut self, now_us: u64) -> Option<u64> {
        self.channel.sky_mut().next_change_us(now_us)
    }

    /// The satellite flies another orbit from now on: its telemetry and its passes follow the new elements.
    pub fn set_orbit(&mut self, orbit: Orbit) {
        self.channel.sky_mut().exchange(&orbit);
        self.twin.set_orbit(orbit);
    }

    /// Another transmitter of the same station is on the air from here to there: ground's module hears nothing meanwhile.
    pub fn deafen(&mut self, from_us: u64, until_us: u64) {
        self.deaf_us = [self.deaf_us[1], (from_us, until_us)];
    }

    /// Why the elements have no state any more, told once: from then on the satellite is below the horizon.
    pub fn take_orbit_fault(&mut self) -> Option<PropagationError> {
        self.channel.sky_mut().take_fault()
    }

    /// What was done so far.
    #[must_use]
    pub fn stats(&self) -> DeviceStats {
        DeviceStats { twin: *self.twin.stats(), channel: *self.channel.stats(), ..self.stats }
    }

    /// Something goes wrong with the satellite, or right again, now. Poll afterwards.
    pub fn inject(&mut self, now_us: u64, fault: Fault) {
        self.now_us = self.now_us.max(now_us);
        self.twin.inject(now_us, fault);
        self.drain_journal();
    }

    /// The satellite.
    #[must_use]
    pub fn twin(&self) -> &Twin {
        &self.twin
    }

    /// The air; its losses may be changed while it runs.
    pub fn channel_mut(&mut self) -> &mut Channel {
        &mut self.channel
    }

    /// The ground's module.
    #[must_use]
    pub fn module(&self) -> &Module {
        &self.module
    }

    fn next_inner_us(&self) -> Option<u64> {
        let first_us = [self.module_due_us(), self.event_due_us(), self.twin.next_event_us()];
        first_us.into_iter().flatten().min().map(|at_us| at_us.max(self.now_us))
    }

    fn module_due_us(&self) -> Option<u64> {
        self.module.next_event_us().filter(|at_us| self.module_idle_us != Some(*at_us))
    }

    fn event_due_us(&self) -> Option<u64> {
        self.events.peek().map(|Reverse(scheduled)| scheduled.at_us)
    }

    fn step(&mut self, at_us: u64) {
        self.now_us = at_us;
        if self.event_due_us().is_some_and(|due_us| due_us <= at_us) {
            if let Some(Reverse(scheduled)) = self.events.pop() {
                self.happen(at_us, scheduled.event);
            }
        } else if self.module_due_us().is_some_and(|due_us| due_us <= at_us) {
            self.step_module(at_us);
        } else if let Some(frame) = self.twin.poll(at_us) {
            self.start_frame(at_us, frame);
        }
    }

    fn step_module(&mut self, at_us: u64) {
        let claimed_us = self.module.next_event_us();
        match self.module.poll(at_us) {
            None if self.module.next_event_us() == claimed_us => self.module_idle_us = claimed_us,
            None => {}
            Some(ModelOutput::HostBytes { bytes, .. }) => {
                self.outbox.push_back(DeviceOutput::HostBytes(bytes))
            }
            Some(ModelOutput::Aux { idle, .. }) => self.outbox.push_back(DeviceOutput::Aux { idle }),
            Some(ModelOutput::AirSent { start_us, end_us, target, channel, frequency_hz, packet }) => {
                self.stats.ground_packets += 1;
                self.stats.airtime_up_us += end_us.saturating_sub(start_us);
                let (delay_us, shift_hz) = self.across(start_us, frequency_hz);
                let off_hz = f64::from(frequency_hz) + shift_hz - f64::from(self.frequency_hz);
                let is_for_us = (target == self.satellite_address || target == BROADCAST)
                    && channel == self.channel_number
                    && off_hz.abs() <= TUNING_MAX_HZ;
                self.outbox.push_back(DeviceOutput::Journal(JournalEntry::GroundRadiated {
                    at_us: start_us,
                    end_us,
                    target,
                    channel,
                    packet: packet.clone(),
                }));
                if is_for_us {
                    let heard = Event::UpHeard { start_us: start_us + delay_us, packet };
                    self.schedule(end_us + delay_us, heard);
                } else {
                    self.stats.up_not_for_us += 1;
                }
            }
        }
    }

    fn happen(&mut self, now_us: u64, event: Event) {
        match event {
            Event::UpHeard { start_us, packet } => {
                // half duplex: any radiation that overlaps the packet makes it unheard
                let (down_start_us, down_end_us) = self.radiating_us;
                if down_start_us < now_us && down_end_us > start_us {
                    self.stats.up_half_duplex += 1;
                } else if let Transit::Received(reception) = self.channel.up(now_us, &packet) {
                    let delivered_us = now_us + self.timing.delivery_us(reception.bytes.len());
                    self.schedule(delivered_us, Event::UpDelivered { packet: reception.bytes });
                }
            }
            Event::UpDelivered { packet } => self.twin.receive(now_us, &packet),
            Event::DownStarts { end_us, frame } => {
                self.radiating_us = (now_us, end_us);
                self.stats.airtime_down_us += end_us.saturating_sub(now_us);
                self.radiate(now_us, end_us, &frame);
                let entry = JournalEntry::SatelliteSent { at_us: now_us, end_us, frame };
                self.outbox.push_back(DeviceOutput::Journal(entry));
                self.schedule(end_us, Event::DownEnds);
            }
            Event::DownEnds => self.twin.sent(now_us),
            Event::DownHeard { start_us, .. }
                if self
                    .deaf_us
                    .iter()
                    .any(|(from_us, until_us)| start_us < *until_us && *from_us < now_us) =>
            {
                self.stats.down_deafened += 1;
            }
            Event::DownHeard { start_us, bytes, rssi_dbm } => {
                self.module_idle_us = None;
                self.module.air_receive_for(
                    now_us,
                    start_us,
                    BROADCAST,
                    self.channel_number,
                    &bytes,
                    rssi_dbm,
                );
            }
        }
    }

    /// The computer hands a frame to its module, which begins to send when it has all of it.
    fn start_frame(&mut self, now_us: u64, frame: Vec<u8>) {
        let since_last_us = now_us.saturating_sub(self.radiating_us.1);
        let lead_us = if self.radiating_us.1 > 0 && since_last_us <= NEXT_FRAME_WINDOW_US {
            NEXT_FRAME_GAP_US
        } else {
            self.timing.lead_in_us(frame.len())
        };
        let start_us = now_us + lead_us;
        let end_us = start_us + self.timing.frame_us(frame.len());
        self.schedule(start_us, Event::DownStarts { end_us, frame });
    }

    fn radiate(&mut self, start_us: u64, end_us: u64, frame: &[u8]) {
        let (delay_us, _) = self.across(start_us, self.frequency_hz);
        let (start_us, end_us) = (start_us + delay_us, end_us + delay_us);
        let Transit::Received(reception) = self.channel.down(end_us, frame) else { return };
        if let Some(noise) = reception.noise_before {
            let noise_us = start_us.saturating_sub(NOISE_LEAD_US);
            let heard = Event::DownHeard { start_us: noise_us, bytes: noise, rssi_dbm: NOISE_DBM };
            self.schedule(start_us, heard);
        }
        let heard = Event::DownHeard { start_us, bytes: reception.bytes, rssi_dbm: reception.rssi_dbm };
        self.schedule(end_us, heard);
    }

    /// What the way between satellite and ground does to a carrier now: how long light takes, µs, and the shift, Hz.
    fn across(&mut self, now_us: u64, frequency_hz: u32) -> (u64, f64) {
        let look = self.channel.sky_mut().look(now_us);
        let shift_hz = downlink_shift_hz(frequency_hz.into(), look.range_rate_km_s);
        if look.elevation_deg >= 0.0 {
            self.stats.doppler_max_hz = self.stats.doppler_max_hz.max(shift_hz.abs().round() as u32);
        }
        (look.delay_us(), shift_hz)
    }

    fn schedule(&mut self, at_us: u64, event: Event) {
        self.scheduled += 1;
        self.events.push(Reverse(Scheduled { at_us, number: self.scheduled, event }));
    }

    fn drain_journal(&mut self) {
        while let Some(entry) = self.twin.next_journal() {
            self.outbox.push_back(DeviceOutput::Journal(entry));
        }
    }
}
