//! What the engine needs to go on after a restart; read from storage before the first input.

use std::sync::Arc;

use protocol::{Counter, KeyId, RequestTag};

use crate::clock::UtcUs;
use crate::id::{FrameId, SatelliteId};
use crate::record::{CommandRecord, DownloadRecord, ImageRecord, LimitRecord, PassRecord};
use crate::run::{PlanRecord, RunRecord};
use crate::sky::ElementSet;
use crate::stage::Stage;

/// Everything at once.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// The highest ids in use.
    pub last_ids: LastIds,
    /// Each satellite of the configuration that has left something.
    pub satellites: Vec<SatelliteSnapshot>,
    /// Each key of the configuration.
    pub keys: Vec<KeySnapshot>,
    /// The plans in use, by id.
    pub plans: Vec<PlanRecord>,
    /// By id: the runs that are not over, of each plan the newest that ended to be finished later, and of each satellite
    /// the newest that ended.
    pub runs: Vec<RunRecord>,
    /// The newest frames: the same bytes a moment later are the same frame.
    pub recent: Vec<RecentFrame>,
}

/// A frame that was heard shortly before the restart.
#[derive(Debug, Clone)]
pub struct RecentFrame {
    /// Which.
    pub id: FrameId,
    /// Whose.
    pub satellite: SatelliteId,
    /// When it was heard.
    pub at: UtcUs,
    /// Its bytes.
    pub bytes: Box<[u8]>,
    /// No station of ours had heard it.
    pub elsewhere: bool,
    /// Its time is known.
    pub dated: bool,
}

/// The highest ids in use; 0 when there are none.
#[derive(Debug, Clone, Copy, Default)]
pub struct LastIds {
    /// Of frames.
    pub frame: u64,
    /// Of commands.
    pub command: u64,
    /// Of images.
    pub image: u64,
    /// Of downloads.
    pub download: u64,
    /// Of element sets.
    pub elements: u64,
    /// Of passes.
    pub pass: u64,
    /// Of plans.
    pub plan: u64,
    /// Of runs.
    pub run: u64,
}

/// What one satellite left.
#[derive(Debug, Clone)]
pub struct SatelliteSnapshot {
    /// Which.
    pub satellite: SatelliteId,
    /// The tag of the newest sealed frame.
    pub last_tag: Option<RequestTag>,
    /// Commands that are not final, and those of the last 24 h that are `unknown`, by id.
    pub commands: Vec<CommandSnapshot>,
    /// The newest image with the chunks that are held (first versions, not conflicts).
    pub image: Option<ImageSnapshot>,
    /// Downloads that are active.
    pub downloads: Vec<DownloadRecord>,
    /// Limits that are not normal.
    pub limits: Vec<LimitRecord>,
    /// The newest heartbeat: frame, when heard, uptime in ms.
    pub heartbeat: Option<(FrameId, UtcUs, u32)>,
    /// Its element sets: the newest [`crate::sky::SETS_KEPT`] by epoch, in any order.
    pub elements: Vec<ElementSet>,
    /// The newest pass over this station that has not ended.
    pub pass: Option<PassRecord>,
}

/// A command that is not over.
#[derive(Debug, Clone)]
pub struct CommandSnapshot {
    /// As it was accepted.
    pub record: CommandRecord,
    /// Its last stage.
    pub stage: Stage,
    /// When it reached that.
    pub stage_at: UtcUs,
    /// The last attempt.
    pub attempt: u16,
    /// When it last reached `radiating` or `radiated`; `None` if it never did.
    pub on_air_at: Option<UtcUs>,
    /// The newest sealed frame of it: counter, tag, the 240 bytes.
    pub sealed: Option<SealedSnapshot>,
}

/// A sealed frame of a command that is not over.
#[derive(Debug, Clone)]
pub struct SealedSnapshot {
    /// With which key.
    pub key: KeyId,
    /// Its counter.
    pub counter: Counter,
    /// The tag inside.
    pub tag: RequestTag,
    /// The 240 bytes.
    pub bytes: Arc<[u8; 240]>,
}

/// An image and the chunks of it that are held.
#[derive(Debug, Clone)]
pub struct ImageSnapshot {
    /// The row.
    pub record: ImageRecord,
    /// Index and bytes.
    pub chunks: Vec<(u16, Box<[u8; 222]>)>,
    /// Indices of chunks that have conflicting versions.
    pub conflicts: Vec<u16>,
}

/// What is known of a key.
#[derive(Debug, Clone)]
pub struct KeySnapshot {
    /// Which.
    pub key: KeyId,
    /// The highest counter in the database: sealed frames and floors.
    pub counter: Option<Counter>,
    /// What the witness file says.
    pub witness: Witness,
}

/// What the witness file says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Witness {
    /// There is none.
    Missing,
    /// There is one, and it cannot be read; why, as a sentence.
    Damaged(String),
    /// It stands here.
    At(Counter),
    /// The folder was put back from a backup: counters that nobody remembers may have been radiated since. With the
    /// highest one that the backup knew outside its database.
    Restored(Option<Counter>),
}
