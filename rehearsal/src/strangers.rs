//! Others who hear the satellite: some of what it sends, reported later.

use std::collections::VecDeque;
use std::sync::Arc;

use mission::reception::{Admission, Delivered, Ear, Said, Times, admit};
use mission::{SatelliteId, UtcUs};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::config::Strangers;

/// What is to be reported, in the order in which it was heard.
pub(crate) struct Reports {
    who: Option<Strangers>,
    rng: ChaCha8Rng,
    heard: VecDeque<Heard>,
}

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
        Self { who, rng: ChaCha8Rng::seed_from_u64(seed ^ 0x5742_4e47), heard: VecDeque::new() }
    }

    /// The satellite has sent this.
    pub(crate) fn sent(&mut self, end_us: u64, frame: &[u8]) {
        let Some(who) = self.who else { return };
        if self.rng.random_bool(who.hear) {
            let due_us = end_us + (who.delay_s * 1e6) as u64;
            self.heard.push_back(Heard { due_us, end_us, bytes: frame.to_vec() });
        }
    }

    pub(crate) fn next_us(&self) -> Option<u64> {
        self.heard.front().map(|heard| heard.due_us)
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
    /// As a network would report it; `None` when the bytes are no frame.
    pub(crate) fn delivered(&self, satellite: &SatelliteId, at: UtcUs, now: UtcUs) -> Option<Delivered> {
        let said = Said {
            bytes: Some(self.bytes.clone()),
            times: Times { server: Some(at), ..Times::default() },
            ..Said::new(Ear::TinygsApi, self.end_us.to_string())
        };
        let reception = Arc::new(admit(said, &Admission::at(now)).ok()?);
        Some(Delivered { satellite: satellite.clone(), reception, known: None })
    }
}
