//! What the twin did so far, counted.

use crate::Refusal;

/// Counters of the flight software.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TwinStats {
    /// Frames handed to the transmitter, all kinds.
    pub frames: u64,
    /// Heartbeats by the clock among them.
    pub heartbeats: u64,
    /// Image chunks among them.
    pub chunks: u64,
    /// Requests accepted and carried out.
    pub accepted: u64,
    /// Accepted requests whose counter was below the highest.
    pub accepted_late: u64,
    /// Frames that were not obeyed, by [`Refusal`].
    pub refused: RefusalCounts,
    /// Answers and heartbeats made while the transmitter was forbidden or mute, and so not sent.
    pub unsent: u64,
    /// Packets that came while the satellite was booting.
    pub deaf: u64,
    /// Scheduled transmissions begun.
    pub scheduled: u64,
}

/// Refused frames by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefusalCounts {
    /// The GCM tag was wrong.
    pub authentication: u64,
    /// The counter was not acceptable.
    pub counter: u64,
    /// The nonce had been accepted before: a duplicate.
    pub replayed: u64,
    /// The checksum was wrong.
    pub crc: u64,
    /// The request did not follow the ICD.
    pub malformed: u64,
    /// Too many requests were waiting.
    pub busy: u64,
}

impl RefusalCounts {
    /// How many frames were refused for this reason.
    #[must_use]
    pub const fn of(&self, reason: Refusal) -> u64 {
        match reason {
            Refusal::Authentication => self.authentication,
            Refusal::Counter => self.counter,
            Refusal::Replayed => self.replayed,
            Refusal::Crc => self.crc,
            Refusal::Malformed => self.malformed,
            Refusal::Busy => self.busy,
        }
    }

    /// How many frames were refused.
    #[must_use]
    pub fn total(&self) -> u64 {
        Refusal::ALL.into_iter().map(|reason| self.of(reason)).sum()
    }

    pub(crate) fn add(&mut self, reason: Refusal) {
        let count = match reason {
            Refusal::Authentication => &mut self.authentication,
            Refusal::Counter => &mut self.counter,
            Refusal::Replayed => &mut self.replayed,
            Refusal::Crc => &mut self.crc,
            Refusal::Malformed => &mut self.malformed,
            Refusal::Busy => &mut self.busy,
        };
        *count += 1;
    }
}
