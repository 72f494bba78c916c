//! The engine's only doors: [`Input`] in, [`Effect`] out.

use std::sync::Arc;

use protocol::{Counter, KeyId};

use crate::clock::{MonoUs, Now, UtcUs};
use crate::id::{BatchId, CommandId, FrameId, IntentId, LinkId, SatelliteId, TxId};
use crate::intent::{Accepted, IntentEnvelope, Refusal};
use crate::level::Level;
use crate::reception::{Delivered, NotTaken, Taken};
use crate::record::{Batch, EventKind, Route, Source};

/// What the world tells the engine.
#[expect(clippy::large_enum_variant, reason = "an input lives for one call")]
#[derive(Debug)]
pub enum Input<'a> {
    /// Bytes that a radio delivered, in any pieces.
    Bytes {
        /// Over which link.
        link: &'a LinkId,
        /// The bytes.
        bytes: &'a [u8],
        /// How they came in.
        source: Source,
        /// When the last of them was received.
        received: Now,
    },
    /// A frame that the reserve kept while storage failed, brought back at start.
    Recovered(&'a ReservedFrame),
    /// A frame of a satellite of ours that another station heard and stored: what it says of an image fills ours.
    Elsewhere {
        /// Its id, as that station gave it.
        id: FrameId,
        /// The frame.
        frame: &'a ReservedFrame,
    },
    /// What ears other than our radio report; answered by [`Effect::Taken`].
    Outside {
        /// A number of the shell's own.
        delivery: u64,
        /// The reports. Those that the archive has already are left out.
        receptions: &'a [Delivered],
    },
    /// A link came up, went down, or learnt something.
    Link {
        /// Which.
        link: &'a LinkId,
        /// How it is now.
        state: LinkState,
    },
    /// The radio has taken the bytes: they may be on the air from now on.
    TxStarted(TxId),
    /// The bytes have left the antenna.
    TxDone {
        /// Which hand-over.
        tx: TxId,
        /// Time on air in microseconds, measured or computed.
        airtime_us: u64,
        /// Whether it was measured.
        measured: bool,
    },
    /// The bytes did not go out as they should.
    TxFailed {
        /// Which hand-over.
        tx: TxId,
        /// Whether something may have been radiated all the same.
        radiated: MaybeRadiated,
        /// Why, as a sentence.
        reason: &'a str,
    },
    /// The batch is durable.
    PersistDone(BatchId),
    /// The batch is not durable, and none of it is.
    PersistFailed {
        /// Which.
        batch: BatchId,
        /// Why, as a sentence.
        reason: &'a str,
        /// After so many microseconds it is to be tried again.
        again_us: u64,
    },
    /// The reserve could not keep a raw frame that was handed to it: it is in memory only.
    ReserveFailed {
        /// Why, as a sentence.
        reason: &'a str,
    },
    /// The witness of this key stands at this counter, durably.
    WitnessDone {
        /// Which key.
        key: KeyId,
        /// Where it stands.
        counter: Counter,
    },
    /// The witness could not be raised.
    WitnessFailed {
        /// Which key.
        key: KeyId,
        /// Why, as a sentence.
        reason: &'a str,
    },
    /// Several servers share this key: who may seal with it now. A key of which this is never told is ours alone.
    Lease {
        /// Which key.
        key: KeyId,
        /// Who may.
        lease: Lease,
    },
    /// Whether the kernel says that its clock is synchronised.
    Clock {
        /// Synchronised.
        synchronised: bool,
    },
    /// What the orbit (or a stored profile) says: is the satellite in view, and until when.
    View {
        /// Which satellite.
        satellite: &'a SatelliteId,
        /// `None`: not in view. `Some(los)`: in view until then; `los` is `None` when nobody knows.
        in_view: Option<Option<UtcUs>>,
    },
    /// How the rotator is.
    Antenna {
        /// What is wrong with it, as a sentence; `None`: nothing.
        fault: Option<&'a str>,
    },
    /// Something about the machine that is worth writing down: its disk, its backups.
    Notice {
        /// What it is about.
        kind: EventKind,
        /// How much anybody should care.
        level: Level,
        /// What it is, as a sentence.
        message: &'a str,
    },
    /// Somebody wants something.
    Intent(IntentEnvelope),
    /// The time of `next_wakeup` has come.
    Wake,
    /// Finish: nothing new is radiated.
    Stop,
}

/// Who may seal with a key that several servers share, and radiate what is sealed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lease {
    /// We may.
    Ours {
        /// Until then.
        until: MonoUs,
        /// The highest counter that any server has spent.
        spent: Option<Counter>,
    },
    /// We may not.
    NotOurs {
        /// Why, as a sentence.
        why: String,
    },
}

/// Whether something may have been radiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MaybeRadiated {
    /// Certainly nothing left the antenna.
    No,
    /// It may have.
    Maybe,
}

/// How a link is (the words are those of Yamcs).
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkState {
    /// Works, hears and may transmit.
    Ok,
    /// Not there at present; it is being looked for.
    Unavailable {
        /// Why, as a sentence.
        reason: String,
    },
    /// Switched off by configuration or an operator.
    Disabled,
    /// There, but it does not work.
    Failed {
        /// Why, as a sentence.
        reason: String,
    },
}

impl LinkState {
    /// The word in the database and on the wire.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Unavailable { .. } => "unavailable",
            Self::Disabled => "disabled",
            Self::Failed { .. } => "failed",
        }
    }

    /// Why, where there is a why.
    pub fn why(&self) -> Option<&str> {
        match self {
            Self::Unavailable { reason } | Self::Failed { reason } => Some(reason),
            Self::Ok | Self::Disabled => None,
        }
    }
}

/// What the engine asks of the world.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Make this durable, whole; answer with `PersistDone` or `PersistFailed`. At most one batch is out at a time.
    Persist(Arc<Batch>),
    /// Raise the witness of this key durably (temporary file, fsync, rename, fsync of the folder); answer.
    Witness {
        /// Which key.
        key: KeyId,
        /// To this.
        counter: Counter,
    },
    /// Hand these bytes to the radio. Exists only after what it needs was confirmed durable.
    Transmit(Transmit),
    /// Tell whoever asked. What it tells is durable.
    Reply {
        /// Which intent.
        intent: IntentId,
        /// What became of it.
        result: Result<Accepted, Refusal>,
    },
    /// Tell whoever delivered what became of it. What it tells is durable.
    Taken {
        /// Which delivery.
        delivery: u64,
        /// What became of it.
        result: Result<Taken, NotTaken>,
    },
    /// Storage fails: keep this raw frame in the preallocated reserve.
    Reserve(ReservedFrame),
    /// Everything in the reserve is durable in the database now.
    ReserveClear,
}

/// A hand-over to the radio.
#[derive(Debug, Clone, PartialEq)]
pub struct Transmit {
    /// Answered by `TxStarted`, then `TxDone` or `TxFailed`.
    pub tx: TxId,
    /// Over which link.
    pub link: LinkId,
    /// For which command.
    pub command: CommandId,
    /// Address of the receiving module.
    pub target_address: u16,
    /// The 240 bytes of the sealed frame.
    pub frame: Arc<[u8; 240]>,
}

/// A raw frame that waits for the database to recover.
#[derive(Debug, Clone, PartialEq)]
pub struct ReservedFrame {
    /// Where it was heard.
    pub route: Route,
    /// How it came in.
    pub source: Source,
    /// When.
    pub received_at: UtcUs,
    /// Received power in dBm, when known.
    pub rssi_dbm: Option<i16>,
    /// The frame.
    pub bytes: Box<[u8]>,
}
