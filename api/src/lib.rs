//! What the server and its clients say to each other: the types of API v1, and its problems.
//!
//! | module | what |
//! | --- | --- |
//! | [`Time`] | RFC 3339 in UTC with milliseconds, the form of a time on the wire (orbits: [`FineTime`]) |
//! | [`Version`], [`Health`] | the handshake: who is there, what it can, whether it is well |
//! | [`StationView`] | how the station is right now |
//! | [`AntennaView`] | rotator and rig, and what the radio bears of the Doppler shift |
//! | [`FrameView`], [`TelemetryPage`], [`EventView`], [`AuditView`] | what was heard, the values in it, what happened, who did what |
//! | [`CommandRequest`], [`CommandView`] | telecommands: asked for, and on their way |
//! | [`telecommand`] | every telecommand of the ICD to JSON and back, with errors that name the field |
//! | [`ImageView`], [`ChunkMap`], [`DownloadView`] | pictures and the orders to bring them home |
//! | [`PassList`], [`LookList`], [`PassKept`], [`ElementsView`] | what is in the sky, with [`FineTime`] to the microsecond |
//! | [`ElementsRequest`], [`HeldElements`], [`FetchReport`] | elements: given, held, fetched |
//! | [`PlanText`], [`PlanView`], [`ScheduleView`], [`RunReport`] | plans, which pass gets which, and what came of it |
//! | [`AlertView`], [`TargetView`] | what should not be, who knows of it, who is told |
//! | [`SessionView`], [`UserView`], [`TokenView`] | who may come in |
//! | [`ApprovalView`], [`TransmissionView`] | what a second person has to approve; who answered for a radiation |
//! | [`PassReport`], [`HandoverReport`], [`MonthReport`] | what a pass brought, what the next shift must know, what a month came to |
//! | [`StreamMessage`], [`StreamRequest`] | what the WebSocket says, and what may be said to it |
//! | [`Problem`] | what went wrong (RFC 9457), each kind with a stable `type` |
//!
//! Rules of the wire: unknown is `null`, never 0; units stand in the names; requests refuse fields they do not know,
//! answers may grow fields, so a client ignores those it does not know.
//!
//! The feature `client` brings a typed client with a stream that comes back by itself (`api::client`), the feature `openapi`
//! schemas of the types.
//!
//! What this crate does **not** do: without these features it has no HTTP, no clock and no SQL, and it knows `protocol` only. The server
//! converts its own types into these.

mod alert;
mod antenna;
#[cfg(feature = "client")]
pub mod client;
mod command;
mod download;
mod ears;
mod elements;
mod event;
mod forward;
mod frame;
mod image;
#[cfg(feature = "openapi")]
mod openapi;
mod page;
mod people;
mod plan;
mod problem;
mod reception;
mod rehearsal;
mod report;
mod run;
mod sky;
mod station;
mod stream;
mod summary;
pub mod telecommand;
mod telemetry;
mod time;
mod version;

pub use alert::{AlertNote, AlertView, AssignRequest, ShelveRequest, TargetTested, TargetView};
pub use antenna::{AntennaView, AxesView, DopplerView, RigView, RotatorPass, RotatorView};
pub use command::{CommandRequest, CommandView, GateWord, Outcome, OutcomeWord, StageView};
pub use download::{DownloadRequest, DownloadView};
pub use ears::{BoardView, ReceiverView, WayState, WayView};
pub use elements::{
    ElementsAdded, ElementsRequest, ElementsSource, FetchReport, FetchWord, HeldElements, SourceFetched,
    SourceWord,
};
pub use event::{AuditView, EventView, LimitView};
pub use forward::{ForwardRequest, ForwardTargetView, ForwardView, ForwardWhole};
pub use frame::{FieldView, FrameView, PacketView, ReceptionView};
pub use image::{ChunkMap, ImageView};
pub use page::{Nothing, Page};
pub use people::{
    ApprovalView, ApproveRequest, LinkMade, LoginRequest, PasswordRequest, RefuseRequest, SessionView,
    TokenMade, TokenRequest, TokenView, TransmissionView, UserChange, UserRequest, UserView, WelcomeRequest,
};
pub use plan::{
    ApprovalText, AtLosWord, AttachText, ConditionText, GuardText, MinPassText, OnFailureWord, PlanFinding,
    PlanText, StepText,
};
pub use problem::{FieldError, Problem, ProblemKind};
pub use reception::{EarView, ImportItem, ImportReport, ImportRequest, OutsideView};
pub use rehearsal::{
    Percentiles, RehearsalAnswer, RehearsalRequest, RehearsalView, RehearsedEnd, RehearsedFigures,
    RehearsedPass, RehearsedRun, RehearsedStep,
};
pub use report::{
    AlarmReported, ChunkRun, CommandReported, HadPass, ImageReported, PacketCount, PassReport, PathPoint,
    PlannedPass, RunReported, SignalPoint, SilentStretch, Spread, UplinkReported,
};
pub use run::{
    AttachRequest, ClosedView, ContactView, OpenView, PlanView, RefusedView, RivalView, RunReport, RunView,
    ScheduleView, StepReport,
};
pub use sky::{
    ElementsUsed, ElementsView, FineTime, LookList, LookView, PassEndWord, PassKept, PassList, PassView,
    PlaceView, RefusedElements, SkyGapView,
};
pub use station::{
    CounterConfirmation, ElementsInUse, ImageProgress, LinkView, NextPass, SatelliteView, SealingView,
    StationView, StorageView,
};
pub use stream::{StreamMessage, StreamRequest, StreamValue, Topic, UnknownTopic};
pub use summary::{
    DayCount, HandoverReport, IncidentCount, MonthOfSatellite, MonthReport, PassBrief, WordCount,
};
pub use telecommand::ArgumentError;
pub use telemetry::{Bucket, LatestValue, ParameterView, Sample, TelemetryPage};
pub use time::{Time, TimeError};
pub use version::{Health, Version};

/// The version of this API; the first part of every path.
pub const API_VERSION: u32 = 1;

/// What this version can do; a client asks for a capability by name, never by version number.
pub const CAPABILITIES: [&str; 17] = [
    "alerts",
    "antenna",
    "approvals",
    "archive",
    "commands",
    "downloads",
    "forwards",
    "images",
    "idempotency",
    "limits",
    "people",
    "plans",
    "receptions",
    "rehearsals",
    "reports",
    "stream-resume",
    "stream-topics",
];
