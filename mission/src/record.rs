//! What the engine wants to be durable: plain values, one variant per kind of row.
//!
//! A [`Batch`] is stored whole or not at all, in the order of its records. Storage decides nothing; it assigns the
//! one durable sequence of events when it commits.

use std::sync::Arc;

use protocol::{Counter, FrameForm, KeyId, Nonce, RequestTag};

use crate::clock::UtcUs;
use crate::id::{
    BatchId, CommandId, DownloadId, ElementsId, FrameId, ImageId, LinkId, PassId, Principal, SatelliteId,
    StationId,
};
use crate::intent::IntentReceipt;
use crate::level::Level;
use crate::plan::Condition;
use crate::reception::Reception;
use crate::run::{PlanRecord, RunRecord};
use crate::stage::Stage;

/// Version of the rules by which values are derived from raw frames; derived rows carry it.
pub const DECODER_VERSION: u32 = 1;

/// Records that are stored together or not at all.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// Answered by `PersistDone` or `PersistFailed`.
    pub id: BatchId,
    /// In the order in which they must take effect.
    pub records: Vec<Record>,
}

/// Where something was heard or is to be sent.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Route {
    /// The satellite.
    pub satellite: SatelliteId,
    /// Our station.
    pub station: StationId,
    /// The link of that station.
    pub link: LinkId,
}

/// One row to be.
#[expect(clippy::large_enum_variant, reason = "a batch holds a few dozen for a few milliseconds")]
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// A raw frame, for ever. The same id again changes `nested` alone: what lay inside a candidate that turned out
    /// to be no frame counts after all.
    Frame(FrameRecord),
    /// Somebody heard a frame.
    Reception(ReceptionRecord),
    /// Somebody else heard something; again, it changes nothing.
    Outside(Box<OutsideRecord>),
    /// The level of a reception, which arrives after the frame.
    ReceptionRssi(ReceptionRssi),
    /// Values derived from a frame.
    Telemetry(TelemetryRecord),
    /// A telecommand, new.
    Command(CommandRecord),
    /// A telecommand reached a stage.
    Stage(StageRecord),
    /// A sealed frame: counter and nonce are spent.
    Sealed(SealedRecord),
    /// The counter of a key will not be used at or below this any more.
    CounterFloor(CounterFloorRecord),
    /// An image, inserted or brought up to date.
    Image(ImageRecord),
    /// A chunk of an image, or another version of a chunk that is already held.
    Chunk(ChunkRecord),
    /// A standing order for an image, inserted or brought up to date.
    Download(DownloadRecord),
    /// The state of a limit, inserted or brought up to date.
    Limit(LimitRecord),
    /// A set of mean elements, new.
    Elements(ElementsRecord),
    /// A pass that began, got new elements or ended: inserted or brought up to date.
    Pass(PassRecord),
    /// A plan, inserted or brought up to date.
    Plan(PlanRecord),
    /// A run of a plan, inserted or brought up to date. In the same batch as what it caused.
    Run(Box<RunRecord>),
    /// Something to tell. Gets its place in the one durable sequence at the commit.
    Event(EventRecord),
    /// Who did what.
    Audit(AuditRecord),
    /// An intent was accepted or refused under an idempotency key.
    Intent(IntentReceipt),
}

/// A raw frame as it was received.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRecord {
    /// New id.
    pub id: FrameId,
    /// Heard from, by, over (the first reception).
    pub route: Route,
    /// The whole frame, magic included: 16 to 240 bytes.
    pub bytes: Box<[u8]>,
    /// Full or short.
    pub form: FrameForm,
    /// Packet type byte; `None` when the header makes no sense.
    pub packet_type: Option<u8>,
    /// Request tag; `None` for 0 and without a header.
    pub tag: Option<RequestTag>,
    /// It lay inside another valid frame, and changed nothing.
    pub nested: bool,
    /// When its last byte was received.
    pub heard_at: UtcUs,
}

/// One station heard one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceptionRecord {
    /// What was heard.
    pub frame: FrameId,
    /// By whom.
    pub route: Route,
    /// How it came in.
    pub source: Source,
    /// When its last byte was received.
    pub received_at: UtcUs,
    /// Received power in dBm, when known already.
    pub rssi_dbm: Option<i16>,
}

/// What an ear other than our radio reported.
#[derive(Debug, Clone, PartialEq)]
pub struct OutsideRecord {
    /// Whose frame it is.
    pub satellite: SatelliteId,
    /// The station that took the report in.
    pub station: StationId,
    /// The frame; `None` for a detection and for bytes that are none.
    pub frame: Option<FrameId>,
    /// What was reported.
    pub reception: Arc<Reception>,
    /// When it was taken in.
    pub taken_at: UtcUs,
}

/// How a reception came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Source {
    /// Our own radio.
    Radio,
    /// A file that was replayed.
    File,
}

impl Source {
    /// The word in the database and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Radio => "radio",
            Self::File => "file",
        }
    }
}

/// The level of a reception that is already stored (or in the same batch).
#[derive(Debug, Clone, PartialEq)]
pub struct ReceptionRssi {
    /// Which frame.
    pub frame: FrameId,
    /// Which reception: the station and link, and its time.
    pub route: Route,
    /// The time that the reception carries.
    pub received_at: UtcUs,
    /// Received power in dBm.
    pub rssi_dbm: i16,
}

/// Values of one packet.
#[derive(Debug, Clone, PartialEq)]
pub struct TelemetryRecord {
    /// The frame they stand in.
    pub frame: FrameId,
    /// Where it was heard.
    pub route: Route,
    /// When it was heard.
    pub at: UtcUs,
    /// [`DECODER_VERSION`].
    pub decoder_version: u32,
    /// The values.
    pub points: Vec<Point>,
}

/// One scalar value.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// `packet.field`, e.g. `heartbeat.temp` or `heartbeat.r_teme.x`.
    pub parameter: String,
    /// The unit, empty when it has none or nobody knows.
    pub unit: &'static str,
    /// The value; `None` for NaN and infinities (a failed sensor): invalid, but there.
    pub value: Option<f64>,
}

/// A telecommand as it was accepted.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandRecord {
    /// New id.
    pub id: CommandId,
    /// To whom, from where, over what.
    pub route: Route,
    /// The key that will seal it.
    pub key: KeyId,
    /// Who wants it.
    pub principal: Principal,
    /// The standing order that made it, when the machine did.
    pub download: Option<DownloadId>,
    /// What is to be sent.
    pub telecommand: protocol::Telecommand,
    /// Higher goes first; equal ones go in the order of their ids.
    pub priority: i16,
    /// When it may be radiated.
    pub gate: Gate,
    /// How often it may be radiated: 1 for what is not idempotent.
    pub attempts_allowed: u16,
    /// When it was accepted.
    pub created_at: UtcUs,
    /// After this it is not radiated any more.
    pub expires_at: Option<UtcUs>,
    /// What else must hold before it is radiated; `None`: nothing.
    pub when: Option<Box<Condition>>,
}

/// What must hold before a command is radiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Gate {
    /// The satellite was heard lately (two and a half heartbeat periods).
    Heard,
    /// Nothing: for a satellite that may be silent. The link must still be quiet.
    Blind,
}

impl Gate {
    /// The word in the database and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Heard => "heard",
            Self::Blind => "blind",
        }
    }
}

/// A step in the life of a telecommand.
#[derive(Debug, Clone, PartialEq)]
pub struct StageRecord {
    /// Which command.
    pub command: CommandId,
    /// Attempt number, from 1; 0 before the first.
    pub attempt: u16,
    /// What was reached.
    pub stage: Stage,
    /// When.
    pub at: UtcUs,
    /// Who caused it.
    pub who: Principal,
    /// Why, as a sentence.
    pub why: String,
    /// The frame that proves it.
    pub frame: Option<FrameId>,
}

/// A sealed uplink frame. Durable before the first byte of it reaches a radio.
#[derive(Debug, Clone, PartialEq)]
pub struct SealedRecord {
    /// Which key.
    pub key: KeyId,
    /// Its counter.
    pub counter: Counter,
    /// Its nonce: with the key, unique for ever.
    pub nonce: Nonce,
    /// What it carries.
    pub command: CommandId,
    /// Which attempt of that.
    pub attempt: u16,
    /// The request tag inside.
    pub tag: RequestTag,
    /// Where it goes.
    pub route: Route,
    /// The 240 bytes.
    pub bytes: Box<[u8; 240]>,
    /// When it was sealed.
    pub sealed_at: UtcUs,
}

/// Counters at or below this are gone.
#[derive(Debug, Clone, PartialEq)]
pub struct CounterFloorRecord {
    /// Which key.
    pub key: KeyId,
    /// The highest counter that counts as used.
    pub counter: Counter,
    /// When.
    pub at: UtcUs,
    /// Who confirmed it.
    pub who: Principal,
}

/// An image that the satellite declared.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageRecord {
    /// Id, kept over updates.
    pub id: ImageId,
    /// Where it was declared.
    pub route: Route,
    /// The ImageInfo that declared it.
    pub declared_by: FrameId,
    /// When.
    pub declared_at: UtcUs,
    /// Bytes of the file.
    pub size_bytes: u32,
    /// Number of chunks: `ceil(size / 222)`.
    pub chunks: u32,
    /// Width in pixels.
    pub width_px: u16,
    /// Height in pixels.
    pub height_px: u16,
    /// Chunks held.
    pub held: u32,
    /// Chunks of which we hold versions that differ.
    pub conflicts: u32,
    /// When the last chunk arrived.
    pub completed_at: Option<UtcUs>,
    /// SHA-256 of the whole file, once complete.
    pub sha256: Option<[u8; 32]>,
}

/// A chunk of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct ChunkRecord {
    /// Of which image.
    pub image: ImageId,
    /// Which chunk, from 0.
    pub index: u16,
    /// The frame that brought it.
    pub frame: FrameId,
    /// Where it was heard.
    pub route: Route,
    /// When.
    pub at: UtcUs,
    /// Its bytes differ from those held: kept beside them, used for nothing.
    pub conflict: bool,
    /// The 222 bytes, padding included.
    pub data: Box<[u8; 222]>,
}

/// A standing order to bring the current image home.
#[derive(Debug, Clone, PartialEq)]
pub struct DownloadRecord {
    /// Id, kept over updates.
    pub id: DownloadId,
    /// From whom, over what.
    pub route: Route,
    /// The image, once it is known.
    pub image: Option<ImageId>,
    /// Who wants it.
    pub principal: Principal,
    /// How it stands.
    pub state: DownloadState,
    /// When it was ordered.
    pub created_at: UtcUs,
    /// Requests for chunks radiated so far.
    pub requests: u32,
    /// Chunks asked for in all requests together.
    pub chunks_requested: u32,
    /// Chunks asked for although held, because that cost less airtime than another request.
    pub chunks_bridged: u32,
}

/// How a download stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DownloadState {
    /// Goes on whenever the satellite is in view.
    Active,
    /// The image is whole.
    Complete,
    /// Withdrawn.
    Cancelled,
    /// Ended without an image; the last event says why.
    Failed,
}

impl DownloadState {
    /// The word in the database and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Active => "active",
            Self::Complete => "complete",
            Self::Cancelled => "cancelled",
            Self::Failed => "failed",
        }
    }
}

/// The state of one limit.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitRecord {
    /// Whose value.
    pub satellite: SatelliteId,
    /// Which value.
    pub parameter: String,
    /// The level now.
    pub level: Level,
    /// Since when.
    pub since: UtcUs,
    /// The value that decided it; `None` when invalid.
    pub value: Option<f64>,
}

/// A set of mean elements of one satellite. Kept for ever: what a pass used can be looked up.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementsRecord {
    /// New id.
    pub id: ElementsId,
    /// Whose.
    pub satellite: SatelliteId,
    /// The station that keeps them.
    pub station: StationId,
    /// Where they came from: a file's name, a source's name, `prelaunch`. No secrets.
    pub source: String,
    /// When they were added.
    pub added_at: UtcUs,
    /// Who added them.
    pub who: Principal,
    /// The elements, with every field of their message.
    pub elements: Arc<tle::Elements>,
}

/// A pass of a satellite over our station, as the elements told it when it was near.
#[derive(Debug, Clone, PartialEq)]
pub struct PassRecord {
    /// Id, kept over updates.
    pub id: PassId,
    /// Who passes.
    pub satellite: SatelliteId,
    /// Over which station.
    pub station: StationId,
    /// Acquisition of signal: above the station's horizon from here on.
    pub aos_at: UtcUs,
    /// Greatest elevation.
    pub tca_at: UtcUs,
    /// Loss of signal; `None` for an object that does not set.
    pub los_at: Option<UtcUs>,
    /// Elevation at TCA, degrees.
    pub max_elevation_deg: f64,
    /// The elements it was computed from and since when they were in use, oldest first: more than one when new ones
    /// arrived in mid-pass. At most [`PASS_ELEMENTS_MAX`], then the first and the newest ones.
    pub elements: Vec<(ElementsId, UtcUs)>,
    /// When it ended; `None` while it lasts.
    pub ended_at: Option<UtcUs>,
}

/// Element sets that one pass remembers.
pub const PASS_ELEMENTS_MAX: usize = 16;

/// Something to tell.
#[derive(Debug, Clone, PartialEq)]
pub struct EventRecord {
    /// When it happened.
    pub at: UtcUs,
    /// What happened.
    pub kind: EventKind,
    /// How much somebody should care.
    pub level: Level,
    /// Satellite, when it concerns one.
    pub satellite: Option<SatelliteId>,
    /// Station.
    pub station: StationId,
    /// Link, when it concerns one.
    pub link: Option<LinkId>,
    /// Key, when it concerns one.
    pub key: Option<KeyId>,
    /// What it is about.
    pub subject: Subject,
    /// One sentence that stands alone.
    pub message: String,
}

/// What an event is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Subject {
    /// A frame.
    pub frame: Option<FrameId>,
    /// A command.
    pub command: Option<CommandId>,
    /// An image.
    pub image: Option<ImageId>,
    /// A download.
    pub download: Option<DownloadId>,
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum EventKind {
    /// A frame was heard.
    FrameHeard,
    /// A command reached a stage.
    CommandStage,
    /// An image was declared.
    ImageDeclared,
    /// A chunk came home.
    ChunkReceived,
    /// Two versions of one chunk.
    ChunkConflict,
    /// An image is whole.
    ImageComplete,
    /// A request for chunks bridges chunks that are held, and why.
    Bridge,
    /// A download began, ended or was withdrawn.
    Download,
    /// A value crossed a limit.
    Limit,
    /// The satellite reported an error of its own accord.
    SatelliteError,
    /// A link changed its state.
    Link,
    /// The satellite was heard after silence, or fell silent.
    Contact,
    /// A pass began or ended, or its beacon is overdue.
    Pass,
    /// A plan was handed over, armed, scheduled or dropped, or its run began or ended.
    Plan,
    /// Elements were added, are getting old, or tell nothing.
    Elements,
    /// Sealing was locked, unlocked, or its clock is in doubt.
    Sealing,
    /// Storage failed or recovered.
    Storage,
    /// The station started or stopped.
    Station,
    /// An alert was raised, changed, was taken note of or is over.
    Alert,
}

impl EventKind {
    /// All kinds.
    pub const ALL: [Self; 19] = [
        Self::FrameHeard,
        Self::CommandStage,
        Self::ImageDeclared,
        Self::ChunkReceived,
        Self::ChunkConflict,
        Self::ImageComplete,
        Self::Bridge,
        Self::Download,
        Self::Limit,
        Self::SatelliteError,
        Self::Link,
        Self::Contact,
        Self::Pass,
        Self::Plan,
        Self::Elements,
        Self::Sealing,
        Self::Storage,
        Self::Station,
        Self::Alert,
    ];

    /// The word in the database and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::FrameHeard => "frame-heard",
            Self::CommandStage => "command-stage",
            Self::ImageDeclared => "image-declared",
            Self::ChunkReceived => "chunk-received",
            Self::ChunkConflict => "chunk-conflict",
            Self::ImageComplete => "image-complete",
            Self::Bridge => "bridge",
            Self::Download => "download",
            Self::Limit => "limit",
            Self::SatelliteError => "satellite-error",
            Self::Link => "link",
            Self::Contact => "contact",
            Self::Pass => "pass",
            Self::Plan => "plan",
            Self::Elements => "elements",
            Self::Sealing => "sealing",
            Self::Storage => "storage",
            Self::Station => "station",
            Self::Alert => "alert",
        }
    }
}

/// Who did what.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditRecord {
    /// When.
    pub at: UtcUs,
    /// Who.
    pub who: Principal,
    /// A verb, e.g. `command.create`.
    pub action: &'static str,
    /// What it was about, without secrets.
    pub detail: String,
}
