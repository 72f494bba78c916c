//! The station engine.

use crate::clock::{MonoUs, Now};
use crate::config::StationConfig;
use crate::port::{Effect, Input};
use crate::snapshot::Snapshot;
use crate::status::Status;

/// Where the engine's random bytes come from: the operating system, or a seed.
pub trait Entropy: Send {
    /// Fills the buffer.
    fn fill(&mut self, bytes: &mut [u8]);
}

/// The station: a plain state machine.
pub struct Station {
    #[expect(dead_code, reason = "signatures first")]
    config: StationConfig,
}

impl Station {
    /// A station that goes on from what was stored.
    pub fn new(config: StationConfig, _snapshot: Snapshot, _entropy: Box<dyn Entropy>, _now: Now) -> Self {
        Self { config }
    }

    /// Takes an input. Effects that follow from it wait in [`Station::next_effect`].
    pub fn handle(&mut self, _now: Now, _input: Input<'_>) {}

    /// The next effect, in the order in which they must be carried out.
    pub fn next_effect(&mut self) -> Option<Effect> {
        None
    }

    /// When [`Input::Wake`] is wanted at the latest.
    pub fn next_wakeup(&self) -> Option<MonoUs> {
        None
    }

    /// Everything that was taken in is durable: what [`Station::status`] tells may be shown.
    pub fn is_settled(&self) -> bool {
        true
    }

    /// How the station is now.
    #[expect(clippy::unimplemented, reason = "signatures first")]
    pub fn status(&self, _now: Now) -> Status {
        unimplemented!()
    }
}
