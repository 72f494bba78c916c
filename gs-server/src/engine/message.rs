//! What arrives in the engine's inbox, and what a link is told.

use std::sync::Arc;

use mission::port::ReservedFrame;
use mission::reception::{Delivered, NotTaken, Taken};
use mission::record::EventKind;
use mission::{
    FrameId, Lease, Level, LinkId, LinkState, MaybeRadiated, Now, SatelliteId, Source, Transmit, TxId, UtcUs,
};
use protocol::KeyId;
use tokio::sync::{mpsc, oneshot};

use crate::clock::{BusyToken, Timer};

/// Messages that may wait for the engine; whoever sends more waits.
pub(crate) const INBOX: usize = 256;
/// Commands that may wait for a link; the engine hands over one frame at a time, so this is never reached.
pub(crate) const LINK_INBOX: usize = 8;

/// What links and other sources tell the engine: [`mission::Input`] with owned contents.
#[derive(Debug)]
pub enum EngineMessage {
    /// Bytes that were heard.
    Bytes {
        /// Over which link.
        link: LinkId,
        /// The bytes.
        bytes: Vec<u8>,
        /// How they came in.
        source: Source,
        /// When the last of them was received.
        received: Now,
    },
    /// Another station heard this, and stored it under this id.
    Elsewhere {
        /// Its id.
        id: FrameId,
        /// The frame.
        frame: Box<ReservedFrame>,
    },
    /// A link changed its state.
    Link {
        /// Which.
        link: LinkId,
        /// How it is now.
        state: LinkState,
    },
    /// The radio has taken the bytes.
    TxStarted(TxId),
    /// The bytes have left the antenna.
    TxDone {
        /// Which hand-over.
        tx: TxId,
        /// Time on air, microseconds.
        airtime_us: u64,
        /// Whether it was measured.
        measured: bool,
    },
    /// The bytes did not go out as they should.
    TxFailed {
        /// Which hand-over.
        tx: TxId,
        /// Whether something may have been radiated.
        radiated: MaybeRadiated,
        /// Why.
        reason: String,
    },
    /// What ears other than our radio report.
    Outside {
        /// The reports.
        receptions: Vec<Delivered>,
        /// Where the answer goes, once it is durable.
        answer: oneshot::Sender<Result<Taken, NotTaken>>,
    },
    /// What an orbit or a stored profile says.
    View {
        /// Which satellite.
        satellite: SatelliteId,
        /// As in [`mission::Input::View`].
        in_view: Option<Option<UtcUs>>,
    },
    /// Who may seal with a key that several servers share.
    Lease {
        /// Which key.
        key: KeyId,
        /// Who may.
        lease: Lease,
    },
    /// How the rotator is.
    Antenna {
        /// What is wrong with it, as a sentence; `None`: nothing.
        fault: Option<String>,
    },
    /// Something about the machine that is worth an event.
    Notice {
        /// What it is about.
        kind: EventKind,
        /// How much anybody should care.
        level: Level,
        /// What it is, as a sentence.
        message: String,
    },
}

/// A way into the engine. Cheap to clone; the engine's work is done when all are gone.
#[derive(Clone)]
pub struct EngineInbox {
    pub(crate) sender: mpsc::Sender<(EngineMessage, BusyToken)>,
    pub(crate) timer: Arc<dyn Timer>,
}

impl EngineInbox {
    /// Waits for a place, and puts the message there. Messages to an engine that has ended are dropped.
    pub async fn send(&self, message: EngineMessage) {
        let busy = self.timer.busy("message to the engine");
        // The engine ends last; what still comes then has nobody to go to.
        let _ = self.sender.send((message, busy)).await;
    }
}

/// What the engine tells a link.
#[derive(Debug)]
pub enum LinkCommand {
    /// Radiate this; answered by `TxStarted`, then `TxDone` or `TxFailed`.
    Transmit(Transmit),
}

/// The engine's end of a link.
#[derive(Clone)]
pub struct LinkPort {
    /// Which link.
    pub link: LinkId,
    pub(crate) sender: mpsc::Sender<(LinkCommand, BusyToken)>,
}

impl LinkPort {
    /// The engine's end, and the link's.
    pub fn new(link: LinkId) -> (Self, mpsc::Receiver<(LinkCommand, BusyToken)>) {
        let (sender, receiver) = mpsc::channel(LINK_INBOX);
        (Self { link, sender }, receiver)
    }
}
