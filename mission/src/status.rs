//! How the station is right now: a view for watchers, never a record.

use std::sync::Arc;

use protocol::KeyId;

use crate::clock::{Now, UtcUs};
use crate::id::{CommandId, DownloadId, ImageId, LinkId, PlanId, Principal, SatelliteId, StationId};
use crate::plan::Plan;
use crate::port::LinkState;
use crate::run::RunRecord;
use crate::schedule::Schedule;
use crate::sky::{ElementSet, ElementsAge, PassAhead};

/// The station now.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// Which station.
    pub station: StationId,
    /// When this was true.
    pub at: Now,
    /// Each link.
    pub links: Vec<LinkStatus>,
    /// Each satellite.
    pub satellites: Vec<SatelliteStatus>,
    /// Each key.
    pub sealing: Vec<SealingStatus>,
    /// Storage.
    pub storage: StorageStatus,
    /// Each plan in use.
    pub plans: Vec<PlanStatus>,
    /// What is scheduled for the coming two days, what was refused and why.
    pub schedule: Arc<Schedule>,
    /// Runs that are not over.
    pub runs: Vec<RunRecord>,
    /// What the rotator says; `None` when there is none.
    pub antenna: Option<AntennaStatus>,
}

/// A plan now.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanStatus {
    /// Its number in the archive.
    pub id: PlanId,
    /// The plan.
    pub plan: Arc<Plan>,
    /// It may run.
    pub armed: bool,
    /// Passes that an operator chose.
    pub picks: Vec<UtcUs>,
    /// Who handed it over.
    pub who: Principal,
    /// When.
    pub added_at: UtcUs,
}

/// The rotator now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AntennaStatus {
    /// What is wrong with it, as a sentence; `None` when all is well.
    pub fault: Option<String>,
}

/// One link now.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkStatus {
    /// Which.
    pub link: LinkId,
    /// Whom it serves.
    pub satellite: SatelliteId,
    /// How it is.
    pub state: LinkState,
    /// May it transmit.
    pub armed: bool,
    /// Is it transmitting.
    pub on_air: bool,
    /// Whole frames heard since the start.
    pub frames: u64,
    /// Bytes that belonged to no frame since the start.
    pub skipped_bytes: u64,
    /// Candidates for a frame that failed.
    pub bad: u64,
    /// Uplink frames radiated since the start.
    pub radiated: u64,
    /// Their time on the air in microseconds.
    pub airtime_us: u64,
    /// The level of the newest frame in dBm.
    pub rssi_dbm: Option<i16>,
}

/// One satellite now.
#[derive(Debug, Clone, PartialEq)]
pub struct SatelliteStatus {
    /// Which.
    pub satellite: SatelliteId,
    /// When it was last heard.
    pub heard_at: Option<UtcUs>,
    /// When its last heartbeat was heard.
    pub heartbeat_at: Option<UtcUs>,
    /// When its next heartbeat is due, if that can be told.
    pub next_heartbeat_at: Option<UtcUs>,
    /// It is in contact: heard within two and a half heartbeat periods.
    pub in_contact: bool,
    /// What a profile or orbit says: in view.
    pub in_view: Option<bool>,
    /// Loss of signal, when known.
    pub los_at: Option<UtcUs>,
    /// What may be expected of it now, as a short sentence: `no contact expected until 14:32Z`.
    pub expectation: String,
    /// What its elements say; `None` without elements or without the station's place.
    pub sky: Option<SkyStatus>,
    /// What the uplink is doing, as a short sentence: why nothing is sent, or what is awaited until when.
    pub uplink: String,
    /// Something could be sent now but for the lease of its key, which another server may hold.
    pub wants_lease: bool,
    /// The command that is on its way or awaits its answer.
    pub outstanding: Option<CommandId>,
    /// Commands that wait.
    pub queued: usize,
    /// The newest image.
    pub image: Option<ImageStatus>,
    /// The active download.
    pub download: Option<DownloadId>,
}

/// A satellite in the sky of the station.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyStatus {
    /// The elements in use.
    pub elements: ElementSet,
    /// How old they are and what that costs.
    pub age: ElementsAge,
    /// Why they tell nothing at present, as a sentence.
    pub fault: Option<String>,
    /// The pass that lasts (first, if one does) and those to come, in order of time; at most [`crate::sky::PASSES_TOLD`].
    pub passes: Vec<PassAhead>,
}

/// The newest image.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageStatus {
    /// Which.
    pub image: ImageId,
    /// Chunks held.
    pub held: u32,
    /// Chunks in all.
    pub chunks: u32,
    /// Chunks with conflicting versions.
    pub conflicts: u32,
}

/// Sealing with one key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SealingStatus {
    /// Which key.
    pub key: KeyId,
    /// Whose key.
    pub satellite: SatelliteId,
    /// Why nothing is sealed, as a sentence with its remedy; `None` when all is well.
    pub locked: Option<String>,
}

/// Storage now.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StorageStatus {
    /// Why nothing is stored, as a sentence; `None` when all is well.
    pub failing: Option<String>,
    /// Records that wait to be stored.
    pub waiting: usize,
    /// Raw frames handed to the reserve since storage failed.
    pub reserved: u64,
    /// Raw frames that the reserve had no place for since storage failed: they are in memory only.
    pub unreserved: u64,
    /// Derived records dropped since the start (redecode makes them again).
    pub derived_dropped: u64,
    /// Raw frames that found no place at all since the start.
    pub frames_lost: u64,
}
