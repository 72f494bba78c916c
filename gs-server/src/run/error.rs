//! Why a run did not begin, or ended before it was told to.

use protocol::KeyId;

use crate::config::ConfigError;
use crate::http::{TlsError, TokenError};
use crate::keys::KeyError;
use crate::lifecycle::TaskFailure;
use crate::storage::StoreError;
use crate::storage::reserve::ReserveError;

/// Why a run did not begin, or ended before it was told to.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A key file.
    #[error(transparent)]
    Key(#[from] KeyError),
    /// A simulated key with real links, or a real key with simulated ones.
    #[error(
        "key file {file} is {}, the links are {}: {}",
        if *.simulated { "simulated" } else { "real" },
        if *.simulated { "real" } else { "simulated" },
        if *.simulated { "a real satellite needs a key of its own (gs-server key new)" }
        else { "a real key never goes to a twin; make one with gs-server key new --simulated" },
    )]
    KeyKind {
        /// The file.
        file: String,
        /// What the key is.
        simulated: bool,
    },
    /// Two satellites with one key: what one is told the other would obey, and both would count its nonces.
    #[error("satellites {first} and {second} have the same key {key}: give each a key of its own")]
    KeyShared {
        /// Whose key it is.
        first: String,
        /// Who has it, too.
        second: String,
        /// The key.
        key: KeyId,
    },
    /// A simulated clock with real links, or the other way round.
    #[error("the clock is simulated and the links are real: real links refuse it")]
    ClockKind,
    /// A store that was brought along is simulated and the links are real, or the other way round.
    #[error("the data folder is {}, the links are not", if *.simulated { "simulated" } else { "real" })]
    StoreKind {
        /// What the folder is.
        simulated: bool,
    },
    /// The archive.
    #[error("the archive cannot be opened")]
    Store(#[from] StoreError),
    /// A way in for what others heard.
    #[error("ear {name}: {words}")]
    Ear {
        /// Its name.
        name: String,
        /// What is wrong with it, and the remedy.
        words: String,
    },
    /// The reserve.
    #[error("the reserve cannot be read")]
    Reserve(#[from] ReserveError),
    /// The rotator.
    #[error("the rotator of the configuration cannot be")]
    Rotator(#[from] mission::pointing::MountFault),
    /// The token file.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// Certificate or key.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// The listener or the machine.
    #[error("{what}")]
    Io {
        /// What was tried.
        what: &'static str,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A task died.
    #[error(transparent)]
    Task(#[from] TaskFailure),
}
