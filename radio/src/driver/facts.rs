//! What the driver knows about its module, and what it has counted.

use crate::registers::Registers;

/// Firmware generation, told from `FWCODE`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Generation {
    /// Not asked or not answered at all.
    #[default]
    Unknown,
    /// Registers answer, AT commands do not.
    V1,
    /// `7364-...`: slow to boot.
    V2_1,
    /// `7453-...`.
    V2_2,
    /// Answers AT commands with another code: used like V2.2, with patience at boot.
    OtherV2,
}

/// What is known about the module since the port was opened.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ModuleFacts {
    /// Firmware generation.
    pub generation: Generation,
    /// Text after `FWCODE=`.
    pub firmware: Option<String>,
    /// Text after `DEVTYPE=`.
    pub device_type: Option<String>,
    /// Registers as last read back.
    pub registers: Option<Registers>,
    /// Whether one RSSI byte follows each received packet; None if it could not be read.
    pub rssi_byte: Option<bool>,
    /// Carrier frequency in hertz as far as the module tells.
    pub frequency_hz: Option<u32>,
    /// The module's answers prove the frequency of the configuration.
    pub frequency_verified: bool,
    /// Every register reads back as wanted.
    pub configuration_verified: bool,
    /// AUX is low for the whole airtime (`UAUX`): yes, refused, or not asked.
    pub uaux: Option<bool>,
    /// AUX has been seen low and high, without chattering.
    pub aux_trusted: bool,
    /// The adapter or the wiring echoes what is written.
    pub echo: bool,
}

/// Counters since the driver was made; all saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DriverCounters {
    /// Frames of which [`TxDone`](super::DriverOutput::TxDone) was reported.
    pub tx_done: u64,
    /// Transmissions refused or failed with nothing radiated.
    pub tx_refused: u64,
    /// Transmissions of which it is unknown whether they were radiated.
    pub tx_unknown: u64,
    /// Time on the air, microseconds: measured where possible, computed otherwise, unknown ones counted in full.
    pub airtime_us: u64,
    /// Bytes delivered.
    pub delivered_bytes: u64,
    /// Bytes dropped while configuring: junk before a reply, and whatever answered nothing.
    pub discarded_bytes: u64,
    /// Own bytes that came back and were removed.
    pub echo_bytes: u64,
    /// Commands repeated.
    pub command_retries: u64,
    /// Changes of AUX.
    pub aux_edges: u64,
    /// Waits for AUX that ran into their limit.
    pub aux_timeouts: u64,
    /// Reopenings asked for.
    pub reopens: u64,
}
