//! The server as a function: it takes its configuration, its listener and its stop from outside, and returns.
//!
//! [`run`] is what `serve` calls; [`run_with`] takes in addition a clock, a store, randomness and wires of the caller's
//! own, as `demo` and tests do. Neither exits the process, sets a global logger or installs a signal handler.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use mission::{Entropy, LinkId};
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot};
use tokio_util::sync::CancellationToken;

use crate::clock::{Timer, Wire};
use crate::config::Config;
use crate::engine::{EngineHandle, EngineInbox};
use crate::hub::Hub;
use crate::storage::Store;

/// What a caller may bring along. [`RunOptions::new`] brings what `serve` needs.
pub struct RunOptions {
    /// The configuration, checked again by [`run_with`].
    pub config: Config,
    /// The clock; made from the configuration when `None`.
    pub timer: Option<Arc<dyn Timer>>,
    /// The store, opened; opened from the configuration when `None`.
    pub store: Option<Store>,
    /// The engine's randomness; the operating system's when `None`.
    pub entropy: Option<Box<dyn Entropy>>,
    /// For links whose far end lives in this process, on a stepped clock: how the bytes between are counted.
    pub wires: BTreeMap<LinkId, Wire>,
    /// Told once, when the archive is open, the links run and the API listens.
    pub ready: Option<oneshot::Sender<Ready>>,
    /// Changed configurations (SIGHUP).
    pub reload: Option<mpsc::Receiver<Config>>,
    /// Called with a new log filter when a reload brings one.
    pub set_log_filter: Option<Box<dyn Fn(&str) + Send + Sync>>,
    /// Facts of a demo for the page and the API; see [`crate::http`].
    pub demo: Option<serde_json::Value>,
}

/// A server that is ready.
#[derive(Clone)]
pub struct Ready {
    /// Where the API listens.
    pub address: SocketAddr,
    /// The engine.
    pub engine: EngineHandle,
    /// For sources of the caller's own, such as what is in view.
    pub inbox: EngineInbox,
    /// Committed events.
    pub hub: Hub,
    /// The store.
    pub store: Store,
    /// The clock.
    pub timer: Arc<dyn Timer>,
}

/// How a run ended well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Report {
    /// Every record that the engine made is durable.
    pub drained: bool,
    /// Tasks that did not end in time and were left behind.
    pub abandoned_tasks: usize,
}
