//! Others who hear the satellite: some of what it sends, reported later.

use std::collections::VecDeque;
use std::sync::Arc;

use mission::reception::{Admission, Delivered, Ear, Said, Times, admit};
use mission::{SatelliteId, UtcUs};
use protocol::{DownFrame, Downlink};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::config::Strangers;

/// What is to be reported, in the order in which it was heard.
pub(crate) struct Reports {
    who: Option<Strangers>,
    rng: ChaCha8Rng,
    heard: VecDeque<Heard>,
    /// When the satellite is to be told what to send for those abroad.
    schedule_at: Option<u64>,
}

/// So long after the satellite came into view, microseconds: ground knows the image, and some of its gaps.
const SCHEDULE_US: u64 = 240_000_000;

/// A frame that somebody heard.
pub(crate) struct Heard {
    due_us: u64,
    /// When its last byte was received, microseconds of the world.
    pub(crate) end_us: u64,
    bytes: Vec<u8>,
}

impl Reports {
    pub(crate) fn new(who: Option<Strangers>, seed: u64) -> Self {
        // Randomness of its own: a world without strangers stays what it is.
        Self {
            who,
            rng: ChaCha8Rng::seed_from_u64(seed ^ 0x5742_4e47),
            heard: VecDeque::new(),
            schedule_at: None,
        }
    }

    /// The satellite came or went.
    pub(crate) fn view(&mut self, in_view: bool, now_us: u64) {
        let abroad = self.who.is_some_and(|who| who.abroad);
        self.schedule_at = (in_view && abroad).then_some(now_us + SCHEDULE_US);
    }

    /// Once in each pass.
    pub(crate) fn is_time_to_schedule(&mut self, now_us: u64) -> bool {
        self.schedule_at.take_if(|at| *at <= now_us).is_some()
    }

    /// The satellite has sent this, in our view or not.
    pub(crate) fn sent(&mut self, end_us: u64, frame: &[u8], in_view: bool) {
        let Some(who) = self.who.filter(|who| !(who.abroad && in_view)) else { return };
        if self.rng.random_bool(who.hear) {
            let due_us = end_us + (who.delay_s * 1e6) as u64;
            self.heard.push_back(Heard { due_us, end_us, bytes: frame.to_vec() });
        }
    }

    pub(crate) fn next_us(&self) -> Option<u64> {
        self.heard.front().map(|heard| heard.due_us).into_iter().chain(self.schedule_at).min()
    }

    /// Those whose time has come.
    pub(crate) fn due(&mut self, now_us: u64) -> Vec<Heard> {
        let mut due = Vec::new();
        while let Some(heard) = self.heard.pop_front_if(|heard| heard.due_us <= now_us) {
            due.push(heard);
        }
        due
    }
}

impl Heard {
    pub(crate) fn is_chunk(&self) -> bool {
        let frame = DownFrame::parse(&self.bytes).ok();
        matches!(frame.and_then(|frame| frame.packet().ok()), Some(Downlink::ImageChunk(_)))
    }

    /// As a network would report it; `None` when the bytes are no frame.
    pub(crate) fn delivered(&self, satellite: &SatelliteId, at: UtcUs, now: UtcUs) -> Option<Delivered> {
        let said = Said {
            bytes: Some(self.bytes.clone()),
            times: Times { server: Some(at), ..Times::default() },
            ..Said::new(Ear::TinygsApi, self.end_us.to_string())
        };
        let reception = Arc::new(admit(said, &Admission::at(now)).ok()?);
        Some(Delivered { satellite: satellite.clone(), reception, known: Box::default() })
    }
}
