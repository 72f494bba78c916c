//! The state machine between the mission and one E22 module.
//!
//! Closed → Opening → Identify → Configure → Verify → Ready ↔ Sending; from anywhere → Fault → Opening.

mod config;
mod diagnostic;
mod event;
mod facts;

pub use config::{AuxWiring, ConfigError, DriverConfig, ModePins};
pub use diagnostic::Diagnostic;
pub use event::{DriverInput, DriverOutput, DriverState, Radiated, TxFailure};
pub use facts::{DriverCounters, Generation, ModuleFacts};

use std::collections::VecDeque;

/// The driver. See the [module documentation](self).
#[derive(Debug)]
pub struct Driver {
    config: DriverConfig,
    state: DriverState,
    facts: ModuleFacts,
    counters: DriverCounters,
    outputs: VecDeque<DriverOutput>,
}

impl Driver {
    /// A driver without a port.
    #[must_use]
    pub fn new(config: DriverConfig) -> Self {
        Self {
            config,
            state: DriverState::Closed,
            facts: ModuleFacts::default(),
            counters: DriverCounters::default(),
            outputs: VecDeque::new(),
        }
    }

    /// Takes one event. Never panics; drain [`Driver::next_output`] afterwards.
    pub fn handle(&mut self, _now_us: u64, _input: DriverInput<'_>) {}

    /// The next thing to do, in order.
    pub fn next_output(&mut self) -> Option<DriverOutput> {
        self.outputs.pop_front()
    }

    /// When [`DriverInput::Wake`] is due, if nothing else happens.
    #[must_use]
    pub fn next_wakeup_us(&self) -> Option<u64> {
        None
    }

    /// Where the driver stands.
    #[must_use]
    pub fn state(&self) -> DriverState {
        self.state
    }

    /// What is known about the module.
    #[must_use]
    pub fn facts(&self) -> &ModuleFacts {
        &self.facts
    }

    /// What was counted.
    #[must_use]
    pub fn counters(&self) -> &DriverCounters {
        &self.counters
    }

    /// The settings it was made with.
    #[must_use]
    pub fn config(&self) -> &DriverConfig {
        &self.config
    }
}
