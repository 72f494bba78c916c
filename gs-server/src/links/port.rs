//! An open port, whatever it is made of: commands go in without waiting, events come out of a bounded queue.

use mission::Now;
use std::future::Future;
use std::sync::Arc;

use tokio::sync::mpsc;

use crate::clock::{BusyToken, ByteGauge, Timer, Wire};

/// Events that may wait for the link's actor; then the reader waits, and the operating system keeps the bytes.
pub(crate) const EVENTS: usize = 64;

/// What happens on a port.
#[derive(Debug)]
pub(crate) enum PortEvent {
    /// Bytes were read.
    Bytes { bytes: Vec<u8>, received: Now },
    /// The last write has left the host.
    Drained,
    /// The level of AUX, first and at each change.
    Aux { idle: bool },
    /// The port is gone; nothing follows.
    Lost { reason: String },
}

pub(crate) type Events = mpsc::Receiver<(PortEvent, BusyToken)>;
pub(crate) type EventSender = mpsc::Sender<(PortEvent, BusyToken)>;

/// The commands of an open port. None of them waits; `Err` says that the port is gone, as a sentence.
pub(crate) trait Port: Send + Sync {
    /// Writes all of it, without a gap.
    fn write(&mut self, bytes: Vec<u8>) -> Result<(), String>;
    /// Levels of the module's M0 and M1 (true = high).
    fn set_pins(&mut self, m0: bool, m1: bool) -> Result<(), String>;
    /// Throws away what the operating system holds unread.
    fn purge(&mut self) -> Result<(), String>;
    /// How closely AUX is watched.
    fn watch_aux(&mut self, watch: AuxWatch);
    /// Called about once a second of wall time: `Some(reason)` when a thread behind the port hangs.
    fn hangs(&mut self) -> Option<String>;
}

/// How closely AUX is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AuxWatch {
    /// Not at all.
    Off,
    /// Now and then: nothing depends on it.
    Idle,
    /// Every few milliseconds: the driver waits for it.
    Close,
}

/// What a reader and a writer need, whatever the port is.
#[derive(Clone)]
pub(crate) struct PortContext {
    pub(crate) timer: Arc<dyn Timer>,
    pub(crate) events: EventSender,
    pub(crate) wire: Option<Wire>,
}

impl PortContext {
    /// An event with the token that holds the clock until it was handled. For bytes of a counted wire the token is
    /// taken before they are counted as read.
    pub(crate) fn parcel(&self, event: PortEvent) -> (PortEvent, BusyToken) {
        let busy = self.timer.busy("bytes on their way to the link");
        if let (PortEvent::Bytes { bytes, .. }, Some(gauge)) = (&event, self.gauge_to_host()) {
            gauge.read(bytes.len());
        }
        (event, busy)
    }

    pub(crate) fn gauge_to_host(&self) -> Option<&ByteGauge> {
        self.wire.as_ref().map(|wire| &wire.to_host)
    }

    pub(crate) fn gauge_from_host(&self) -> Option<&ByteGauge> {
        self.wire.as_ref().map(|wire| &wire.from_host)
    }
}

/// Opens a port again and again.
pub(crate) trait Connector: Send + 'static {
    /// Tries once.
    ///
    /// `Err` is a sentence for the operator: what is not there, and what is.
    fn connect(
        &self,
        context: PortContext,
    ) -> impl Future<Output = Result<Box<dyn Port>, String>> + Send + 'static;
    /// Modem lines can be set.
    fn has_lines(&self) -> bool;
}
