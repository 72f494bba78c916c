//! The planner of blind downlinks: against its upper bound, against sending in turn, and its rules.

#![expect(clippy::unwrap_used, reason = "what is made up here is valid")]

mod bound;
mod history;
mod rules;
mod world;
