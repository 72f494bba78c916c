//! The engine's actor: it owns the [`mission::Station`], feeds it and carries out what it asks.
//!
//! ```text
//! links ──┐                       ┌─▶ storage (one batch at a time) ─▶ hub, log
//! HTTP  ──┼─▶ inbox ─▶ Station ─▶ ┼─▶ witness and reserve (files)
//! clock ──┘                       ├─▶ links (transmit)
//!                                 └─▶ whoever asked
//! ```
//!
//! The inbox is bounded: links wait for a place (the operating system's buffer holds their bytes meanwhile), intents
//! are refused when too many are under way. Nothing is told before the batch that holds it was committed.
//!
//! It does **not** decide anything: not what is sent, not when, not what an event is.

mod actor;
mod background;
mod entropy;
mod handle;
mod intents;
mod log;
mod message;
mod retry;
mod watch;

pub use actor::{EngineError, EngineParts};
pub use entropy::{OsEntropy, SeededEntropy};
pub use handle::{Done, EngineHandle, IntentError};
pub use message::{EngineInbox, EngineMessage, LinkCommand, LinkPort};

pub(crate) use actor::Engine;
