//! The one place that reads the environment.

use std::net::SocketAddr;
use std::path::PathBuf;

/// What the environment may say instead of the file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Environment {
    /// `GS_LISTEN`, over `http.listen`.
    pub listen: Option<SocketAddr>,
    /// `GS_DATA`, over `storage.folder`.
    pub data: Option<PathBuf>,
    /// `GS_LOG`, over `log.filter`.
    pub log: Option<String>,
}

impl Environment {
    /// Reads the environment of this process. An address that is none is left out, with a warning.
    pub fn read() -> Self {
        let text = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
        let listen = text("GS_LISTEN").and_then(|value| {
            value
                .parse()
                .inspect_err(
                    |_| tracing::warn!(%value, "GS_LISTEN={value} is no address and port; it is ignored"),
                )
                .ok()
        });
        Self { listen, data: text("GS_DATA").map(PathBuf::from), log: text("GS_LOG") }
    }
}

/// A secret that the configuration says stands in the environment; `None` when it is not there, or empty.
pub(crate) fn secret(name: &str) -> Option<zeroize::Zeroizing<String>> {
    std::env::var(name).ok().filter(|value| !value.trim().is_empty()).map(zeroize::Zeroizing::new)
}
