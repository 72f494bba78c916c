//! How the line to the server is.

use std::time::Instant;

/// How the line to the server is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Connection {
    /// It was never there.
    Connecting,
    /// It is there; what was missed comes first.
    CatchingUp {
        /// Version of the server.
        version: String,
    },
    /// What comes is live.
    Live {
        /// Since when.
        since: Instant,
    },
    /// It is away; the next attempt comes by itself.
    Lost {
        /// Since when.
        since: Instant,
        /// Why.
        why: String,
        /// When it is tried again.
        again_at: Instant,
    },
}

impl Connection {
    /// Whether what is shown is what is.
    #[must_use]
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Live { .. })
    }
}
