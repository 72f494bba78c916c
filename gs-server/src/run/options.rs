//! What a caller brings along, and what it gets.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

use mission::{Entropy, LinkId};
use tokio::sync::{mpsc, oneshot};

use crate::clock::{Timer, Wire};
use crate::config::Config;
use crate::engine::{EngineHandle, EngineInbox};
use crate::hub::Hub;
use crate::people::People;
use crate::storage::Store;

/// Puts a new log filter into force.
pub type SetLogFilter = Box<dyn Fn(&str) + Send + Sync>;

/// What a caller may bring along. [`RunOptions::new`] brings what `serve` needs.
pub struct RunOptions {
    /// The configuration; checked by [`run_with`](super::run_with).
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
    /// Changed configurations (SIGHUP): what can be applied is, what needs a restart is named in the log.
    pub reload: Option<mpsc::Receiver<Config>>,
    /// Called with the new log filter when a reload brings one.
    pub set_log_filter: Option<SetLogFilter>,
    /// Facts of a demo for the page and the API.
    pub demo: Option<serde_json::Value>,
    /// Where the configuration was read from; it goes into backups.
    pub config_file: Option<PathBuf>,
}

impl RunOptions {
    /// Everything from the configuration and the machine.
    pub fn new(config: Config) -> Self {
        Self {
            config,
            timer: None,
            store: None,
            entropy: None,
            wires: BTreeMap::new(),
            ready: None,
            reload: None,
            set_log_filter: None,
            demo: None,
            config_file: None,
        }
    }
}

/// A server that is ready.
#[derive(Clone)]
pub struct Ready {
    /// Where the API listens.
    pub address: SocketAddr,
    /// Where it listens with TLS, if it does.
    pub secure: Option<SocketAddr>,
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
    /// Who may come in.
    pub people: People,
}

/// How a run ended well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Report {
    /// Tasks that did not end in time and were left behind.
    pub abandoned_tasks: usize,
}
