//! Bytes on their way through a wire that no task owns, such as a pseudo-terminal's buffer.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use super::{BusyToken, Timer};

/// Counts the bytes between a writer and a reader in one process, and holds a stepped clock while there are any.
///
/// The writer calls [`ByteGauge::wrote`] *before* it writes. The reader takes its own [`BusyToken`] and then calls
/// [`ByteGauge::read`]. Cheap to clone.
#[derive(Clone)]
pub struct ByteGauge {
    inner: Arc<Mutex<Inner>>,
    timer: Arc<dyn Timer>,
    who: &'static str,
}

struct Inner {
    written: u64,
    read: u64,
    hold: Option<BusyToken>,
}

impl ByteGauge {
    /// An empty wire. `who` names it in diagnostics.
    pub fn new(timer: Arc<dyn Timer>, who: &'static str) -> Self {
        Self { inner: Arc::new(Mutex::new(Inner { written: 0, read: 0, hold: None })), timer, who }
    }

    fn change(&self, change: impl FnOnce(&mut Inner)) {
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut inner);
        let wanted = inner.written > inner.read;
        let released = match (wanted, inner.hold.is_some()) {
            (true, false) => {
                inner.hold = Some(self.timer.busy(self.who));
                None
            }
            (false, true) => inner.hold.take(),
            _ => None,
        };
        drop(inner);
        drop(released);
    }

    /// This many bytes are about to be written.
    pub fn wrote(&self, bytes: usize) {
        self.change(|inner| inner.written += bytes as u64);
    }

    /// This many bytes were read and are held by a token of the reader's own.
    pub fn read(&self, bytes: usize) {
        self.change(|inner| inner.read = (inner.read + bytes as u64).min(inner.written));
    }

    /// Nobody will read what is under way: an end was closed.
    pub fn abandon(&self) {
        self.change(|inner| inner.read = inner.written);
    }

    /// Bytes written since the beginning.
    pub fn written_total(&self) -> u64 {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner).written
    }

    /// Bytes under way.
    pub fn under_way(&self) -> u64 {
        let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        inner.written - inner.read
    }
}

impl fmt::Debug for ByteGauge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ByteGauge").field("who", &self.who).field("under_way", &self.under_way()).finish()
    }
}

/// Both directions of a wire whose far end lives in this process.
#[derive(Debug, Clone)]
pub struct Wire {
    /// From the far end (the module) to the link.
    pub to_host: ByteGauge,
    /// From the link to the far end.
    pub from_host: ByteGauge,
}

impl Wire {
    /// An empty wire.
    pub fn new(timer: &Arc<dyn Timer>) -> Self {
        Self {
            to_host: ByteGauge::new(Arc::clone(timer), "bytes unread by the link"),
            from_host: ByteGauge::new(Arc::clone(timer), "bytes unread by the module"),
        }
    }
}
