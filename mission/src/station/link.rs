//! One link as the engine sees it: its decoder, its state, what it has learnt about the air.

use protocol::{DownDecoder, FRAME_LEN};

use crate::clock::{MonoUs, UtcUs};
use crate::config::LinkConfig;
use crate::id::{FrameId, TxId};
use crate::port::LinkState;
use crate::record::Route;

/// So many measured chunk periods make the airtime count as measured.
const SAMPLES_ENOUGH: u32 = 8;
/// The gap between two frames of an answer before it was measured.
const GAP_US: u64 = 60_000;
/// While the airtime is unmeasured, an answer may be at least this much later than expected.
const UNMEASURED_MARGIN_US: u64 = 5_000_000;

/// The newest frame of a link, whose level may still arrive.
#[derive(Debug, Clone)]
pub(super) struct LastFrame {
    pub(super) offset: u64,
    pub(super) frame: FrameId,
    pub(super) route: Route,
    pub(super) received_at: UtcUs,
}

/// A link and what the engine knows of it.
pub(super) struct Link {
    pub(super) config: LinkConfig,
    /// Index of the satellite that it serves.
    pub(super) satellite: usize,
    pub(super) decoder: DownDecoder,
    pub(super) state: LinkState,
    pub(super) armed: bool,
    pub(super) on_air: Option<TxId>,
    pub(super) radiated: u64,
    pub(super) airtime_us: u64,
    pub(super) rssi_dbm: Option<i16>,
    pub(super) last_frame: Option<LastFrame>,
    pub(super) last_bytes: MonoUs,
    pub(super) up_since: Option<MonoUs>,
    last_chunk: Option<(u16, MonoUs)>,
    chunk_period_us: u64,
    samples: u32,
}

impl Link {
    pub(super) fn new(config: LinkConfig, satellite: usize, rssi: bool) -> Self {
        let chunk_period_us = config.timing.frame_us(FRAME_LEN) + GAP_US;
        Self {
            armed: config.armed && !config.receive_only,
            config,
            satellite,
            decoder: DownDecoder::new(rssi),
            state: LinkState::Unavailable { reason: "not opened yet".to_owned() },
            on_air: None,
            radiated: 0,
            airtime_us: 0,
            rssi_dbm: None,
            last_frame: None,
            last_bytes: MonoUs(0),
            up_since: None,
            last_chunk: None,
            chunk_period_us,
            samples: 0,
        }
    }

    /// From one chunk of an answer to the next, in microseconds: measured if it can be, else computed.
    pub(super) fn chunk_period_us(&self) -> u64 {
        self.chunk_period_us
    }

    /// How much later than expected an answer may be: two turn-rounds, and more while nothing was measured.
    pub(super) fn margin_us(&self) -> u64 {
        let two = 2 * self.config.timing.turn_round_us;
        if self.samples >= SAMPLES_ENOUGH { two } else { two.max(UNMEASURED_MARGIN_US) }
    }

    /// A chunk of the current answer was received; two neighbours without a heartbeat between give a period.
    pub(super) fn chunk_received(&mut self, index: u16, at: MonoUs) {
        if let Some((before, then)) = self.last_chunk
            && before.checked_add(1) == Some(index)
        {
            let nominal = self.config.timing.frame_us(FRAME_LEN);
            let sample = at.since(then);
            // A frame that was lost or a heartbeat between would double it; a burst of read-ahead would shrink it.
            if sample > nominal / 2 && sample < nominal * 3 / 2 {
                let (old, new) = (self.chunk_period_us, sample);
                self.chunk_period_us = if self.samples == 0 { new } else { (old * 7 + new) / 8 };
                self.samples = self.samples.saturating_add(1);
            }
        }
        self.last_chunk = Some((index, at));
    }

    /// Something else stood between two chunks.
    pub(super) fn chunk_row_broken(&mut self) {
        self.last_chunk = None;
    }

    /// Up, armed, and no mere ear.
    pub(super) fn may_transmit(&self) -> bool {
        self.armed && self.state == LinkState::Ok && !self.config.receive_only
    }

    /// A frame is being received: a candidate is open, and bytes came just now.
    pub(super) fn is_receiving(&self, now: MonoUs) -> bool {
        self.decoder.in_frame() && now < self.receiving_until()
    }

    /// Without another byte, an open candidate is dead by then.
    pub(super) fn receiving_until(&self) -> MonoUs {
        self.last_bytes.plus(100_000)
    }
}
