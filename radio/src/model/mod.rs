//! The module itself, in virtual time.

mod config;

pub use config::{Firmware, ModelConfig, Quirks, Ufreq};

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

/// The module. See the [module documentation](self).
#[derive(Debug)]
pub struct Module {
    config: ModelConfig,
}

impl Module {
    /// A module that is powered up at time 0.
    #[must_use]
    pub fn new(config: ModelConfig) -> Self {
        Self { config }
    }

    /// The host's port begins to send these bytes, after whatever it is still sending.
    pub fn host_write(&mut self, _now_us: u64, _bytes: &[u8]) {}

    /// The host drives the mode pins.
    pub fn set_pins(&mut self, _now_us: u64, _m0: bool, _m1: bool) {}

    /// A packet for everyone on channel 0x19 was on the air from `start_us` to `now_us`. Lost when the module was
    /// sending, asleep, configuring, or is on another channel.
    pub fn air_receive(&mut self, now_us: u64, start_us: u64, packet: &[u8], rssi_dbm: i16) {
        self.air_receive_for(now_us, start_us, 0xFFFF, 0x19, packet, rssi_dbm);
    }

    /// [`Module::air_receive`] of a packet for one address on one channel.
    pub fn air_receive_for(
        &mut self,
        _now_us: u64,
        _start_us: u64,
        _target: u16,
        _channel: u8,
        _packet: &[u8],
        _rssi_dbm: i16,
    ) {
    }

    /// When [`Module::poll`] has something next.
    #[must_use]
    pub fn next_event_us(&self) -> Option<u64> {
        None
    }

    /// The next output that is due at `now_us`; call until None.
    pub fn poll(&mut self, _now_us: u64) -> Option<ModelOutput> {
        None
    }

    /// End of the transmission that is going on, if one is.
    #[must_use]
    pub fn transmitting_until_us(&self) -> Option<u64> {
        None
    }

    /// What the module was made as.
    #[must_use]
    pub fn config(&self) -> &ModelConfig {
        &self.config
    }
}
