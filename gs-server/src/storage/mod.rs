//! The station's memory: one SQLite file in the data folder, or a PostgreSQL that several stations share, and what stands
//! beside it.
//!
//! [`Store`] takes the engine's batches ([`Store::apply`]: whole or not at all, durable when it returns), gives back
//! what a restart needs ([`Store::snapshot`]) and answers questions (`frames`, `telemetry`, `commands`, `images`,
//! `events` …). Times come in with the records; storage reads no clock and decides nothing.
//!
//! The folder holds
//! - `ground.sqlite3` with its `-wal` and `-shm`: the database, unless it is a PostgreSQL elsewhere;
//! - `lock`: held while a server works here;
//! - `reserve.bin`: raw frames while the database takes nothing, see [`reserve`];
//! - `audit-head`: where the chain of the audit ends, see [`verify_audit`];
//! - `witness/`: the highest counter of each key, outside the database, see [`crate::witness`].
//!
//! What it does **not** do: keep keys, know HTTP, delete anything that was heard or sent.

mod alerts;
mod audit_chain;
mod backup;
mod beside;
mod convert;
mod convert_plan;
mod convert_sky;
mod db;
mod ears;
mod error;
mod export;
mod forwards;
mod inspect;
mod lite;
mod lock;
mod open;
mod people;
mod pg;
mod progress;
mod read;
mod receivers;
mod redecode;
pub mod reserve;
mod retention;
mod row;
mod rows;
mod snapshot;
mod write;

#[cfg(test)]
mod tests;

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use mission::port::ReservedFrame;
use mission::{Batch, Principal, SatelliteId, Snapshot, StationId};
use protocol::{Counter, KeyId};

use crate::witness::WitnessFolder;

pub use alerts::{
    AlertBatch, AlertProgress, AlertQuery, AlertRow, Delivery, DeliveryRow, DeliveryState, FinalRun,
};
pub use audit_chain::{AuditHead, AuditVerdict, read_audit, verify_audit};
pub use backup::{DatabaseFacts, copy_database, doubt_forwards, examine_database};
pub use beside::Archive;
pub use ears::{OutsideQuery, OutsideRow};
pub use error::StoreError;
pub(crate) use error::utc;
pub use export::{Export, Exported};
pub use forwards::{
    ForwardCounts, ForwardQuery, ForwardRow, ForwardState, ForwardSubject, ForwardTargetRow, ForwardWish,
};
pub use inspect::{Inspection, inspect_database};
pub(crate) use people::PeopleChange;
pub use people::{ApprovalRow, LinkRow, SessionRow, StationLicenceRow, TokenRow, TransmissionRow, UserRow};
pub use pg::{Leased, Others, Postgres, ServerFacts, look_at_server};
pub use read::{
    Bucket, ChunkCame, ChunkState, CommandLife, CommandNow, CommandQuery, CommandThen, Counts, During,
    EventCount, EventQuery, FrameCount, FrameQuery, Heard, HeardCounts, ImageBytes, ImageMap, LatestValue,
    Page, Sample, Samples, Scope, Series, Span, TelemetryQuery,
};
pub use receivers::{Receiver, ReceiversQuery};
pub use redecode::{RedecodeProgress, RedecodeReport};
pub use rows::{
    AuditLinkRow, AuditRow, ChunkRow, CommandRow, ConditionRow, CounterFloorRow, DownloadRow, ElementsRow,
    EventRow, FrameRow, ImageRow, IntentRow, LimitRow, MetaRow, ParameterRow, PassElementsRow, PassRow,
    PlanRow, ReceptionRow, RouteRow, RunRow, SealedRow, StageRow, TelemetryRow,
};

use reserve::{Reserve, ReserveError};

/// Name of the database in the data folder.
pub const DATABASE: &str = "ground.sqlite3";

/// Where the station's memory is, and how much of the disk it may take.
#[derive(Debug, Clone)]
pub struct StoreOptions {
    /// The data folder; made with mode 0700 when it does not exist.
    pub folder: PathBuf,
    /// Whose memory it is; stands in the rows of records that do not name their station (audit, intents, counter
    /// floors, limits). `None` for the name that the folder was last opened under.
    pub station: Option<StationId>,
    /// Whether what is stored here is made up. The folder is marked at its birth; a mismatch is refused.
    pub simulated: bool,
    /// A PostgreSQL instead of the file in the folder.
    pub postgres: Option<Postgres>,
    /// The largest size of the file in pages of 4096 bytes; `None` for SQLite's own limit.
    pub max_page_count: Option<u32>,
    /// Size of the reserve for raw frames in bytes, allocated at once; 0 for none.
    pub reserve_bytes: u64,
}

/// The station's memory. Cheap to clone; all clones are one store.
#[derive(Clone)]
pub struct Store(Arc<Inner>);

struct Inner {
    folder: PathBuf,
    simulated: bool,
    /// The station's number in a database that several share; 0 in a file of its own.
    number: i64,
    writer: tokio::sync::Mutex<write::Writer>,
    readers: db::Pool,
    witness: WitnessFolder,
    reserve: Mutex<Option<Reserve>>,
    audit_head: Arc<audit_chain::HeadFile>,
    // Last: the folder is free only when everything above is closed.
    _lock: lock::FolderLock,
}

impl fmt::Debug for Store {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Store").field("folder", &self.0.folder).finish_non_exhaustive()
    }
}

/// An event with its place in the one durable sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredEvent {
    /// Its place; later events have higher numbers, and no number is ever given twice.
    pub sequence: i64,
    /// What happened.
    pub record: mission::record::EventRecord,
}

/// What became of an intent that came under this key before.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredIntent {
    /// SHA-256 of the request.
    pub digest: [u8; 32],
    /// What was answered.
    pub accepted: mission::Accepted,
}

impl Store {
    /// Opens the memory in this folder, and makes it when there is none.
    ///
    /// # Errors
    /// [`StoreError`]: in use by another server, damaged, made by a newer program, simulated instead of real or the
    /// other way round, no permission, disk full. The text says what to do.
    pub async fn open(options: StoreOptions) -> Result<Self, StoreError> {
        open::open(options).await
    }

    /// Stores a batch, whole or not at all. What it returns is durable: events with their places, in order.
    ///
    /// # Errors
    /// [`StoreError::Full`] and [`StoreError::Io`] may pass: the next batch is tried afresh. [`StoreError::Conflict`]
    /// when the records contradict what is stored. Nothing of the batch is stored then.
    pub async fn apply(&self, batch: &Batch) -> Result<Vec<StoredEvent>, StoreError> {
        let mut writer = self.0.writer.lock().await;
        let stored = if writer.is_shared() {
            // A database elsewhere may never answer; the same batch is recognised when it comes again.
            let apply = crate::clock::within(pg::APPLY, writer.apply(batch));
            apply.await.unwrap_or_else(|| Err(StoreError::away("no answer within 20 s")))
        } else {
            writer.apply(batch).await
        };
        let (events, head) = stored?;
        self.tell_audit_head(head);
        Ok(events)
    }

    /// Writes down elsewhere where the audit ends, when it has grown.
    fn tell_audit_head(&self, head: Option<AuditHead>) {
        if let Some(head) = head {
            // Nobody waits for it: the chain itself is in the database.
            let file = Arc::clone(&self.0.audit_head);
            tokio::task::spawn_blocking(move || file.raise(head));
        }
    }

    /// What the engine needs to go on: of these satellites and keys, and the highest ids of everything.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read or holds what nobody wrote.
    pub async fn snapshot(&self, satellites: &[SatelliteId], keys: &[KeyId]) -> Result<Snapshot, StoreError> {
        snapshot::snapshot(self, satellites, keys).await
    }

    /// What became of the intent that this principal sent under this key, if any.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn find_intent(
        &self,
        principal: &Principal,
        idempotency_key: &str,
    ) -> Result<Option<StoredIntent>, StoreError> {
        read::find_intent(self, principal, idempotency_key).await
    }

    /// As [`Store::find_intent`]; where there is none, this server takes the intent for itself before others that share
    /// the database can.
    ///
    /// # Errors
    /// [`StoreError::Claimed`] when another server works on it.
    pub async fn find_or_claim_intent(
        &self,
        principal: &Principal,
        idempotency_key: &str,
    ) -> Result<Option<StoredIntent>, StoreError> {
        let found = read::find_intent(self, principal, idempotency_key).await?;
        if found.is_some() || !self.is_shared() {
            return Ok(found);
        }
        match crate::clock::within(pg::APPLY, self.claim(principal, idempotency_key)).await {
            // What was not there before the claim may have come before it.
            Some(Ok(())) => read::find_intent(self, principal, idempotency_key).await,
            Some(Err(error)) => Err(error),
            None => Err(StoreError::away("no answer within 20 s")),
        }
    }

    async fn claim(&self, principal: &Principal, idempotency_key: &str) -> Result<(), StoreError> {
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let claimed = match writer.shared() {
            Some(shared) => shared.claim(&mut connection, principal.as_str(), idempotency_key).await,
            None => Ok(true),
        };
        if writer.end(connection, claimed).await? { Ok(()) } else { Err(StoreError::Claimed) }
    }

    /// Makes the derived rows again from the raw frames, and compares everything on the way.
    ///
    /// One transaction for some hundred frames; when it is broken off, the next call goes on where this one was.
    /// `progress` is told after each transaction.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read or written.
    pub async fn redecode(
        &self,
        progress: impl FnMut(RedecodeProgress) + Send,
    ) -> Result<RedecodeReport, StoreError> {
        redecode::redecode(self, progress).await
    }

    /// The data folder.
    pub fn folder(&self) -> &Path {
        &self.0.folder
    }

    /// Whether the database is one that several servers share.
    pub fn is_shared(&self) -> bool {
        matches!(self.0.readers, db::Pool::Pg(_))
    }

    /// Whether what is stored here is made up.
    pub fn is_simulated(&self) -> bool {
        self.0.simulated
    }

    /// Another limit on the size of the database, in pages of 4096 bytes, from the next batch on.
    ///
    /// # Errors
    /// [`StoreError`] when the database does not take it.
    pub async fn set_max_page_count(&self, pages: u32) -> Result<(), StoreError> {
        self.0.writer.lock().await.set_max_page_count(pages).await
    }

    /// Gives the writer more memory and a longer log, for an import beside which nothing else is done. As durable as
    /// before. A database elsewhere has memory of its own.
    ///
    /// # Errors
    /// [`StoreError`] when the database does not take it.
    pub async fn make_room(&self) -> Result<(), StoreError> {
        self.0.writer.lock().await.make_room().await
    }

    /// The witness of each key.
    pub fn witness(&self) -> &WitnessFolder {
        &self.0.witness
    }

    /// Raises the witness of this key durably; a lower counter changes nothing. Waits for the disk elsewhere.
    ///
    /// # Errors
    /// [`StoreError`] when the file could not be written; the old one stands then.
    pub async fn raise_witness(&self, key: KeyId, counter: Counter) -> Result<(), StoreError> {
        let folder = self.0.witness.clone();
        let path = folder.path().to_path_buf();
        off_the_loop(move || folder.raise(key, counter))
            .await?
            .map_err(|error| StoreError::from_io(&path, error))
    }

    /// Keeps a raw frame in the reserve, durably, while the database takes nothing.
    ///
    /// # Errors
    /// [`ReserveError`] when the reserve is full or absent, or the disk fails.
    pub async fn reserve_push(&self, frame: ReservedFrame) -> Result<(), ReserveError> {
        self.with_reserve(move |reserve| reserve.push(&frame)).await
    }

    /// All frames in the reserve, oldest first.
    ///
    /// # Errors
    /// [`ReserveError::Io`] when the disk fails. Slots that were torn are skipped.
    pub async fn reserve_read(&self) -> Result<Vec<ReservedFrame>, ReserveError> {
        match self.with_reserve(|reserve| reserve.read_all()).await {
            Err(ReserveError::Absent) => Ok(Vec::new()),
            result => result,
        }
    }

    /// Empties the reserve: what it held is in the database now.
    ///
    /// # Errors
    /// [`ReserveError::Io`] when the disk fails; the frames come back at the next start then.
    pub async fn reserve_clear(&self) -> Result<(), ReserveError> {
        match self.with_reserve(Reserve::clear).await {
            Err(ReserveError::Absent) => Ok(()),
            result => result,
        }
    }

    async fn with_reserve<T: Send + 'static>(
        &self,
        act: impl FnOnce(&mut Reserve) -> Result<T, ReserveError> + Send + 'static,
    ) -> Result<T, ReserveError> {
        let inner = Arc::clone(&self.0);
        let act = move || {
            let mut reserve = inner.reserve.lock().unwrap_or_else(PoisonError::into_inner);
            reserve.as_mut().map_or(Err(ReserveError::Absent), act)
        };
        off_the_loop(act).await.map_err(|error| ReserveError::Io(std::io::Error::other(error)))?
    }

    /// Moves everything into the one file `ground.sqlite3` and closes it. Calls after this fail.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be closed in order; nothing that was acknowledged is lost by that.
    pub async fn close(&self) -> Result<(), StoreError> {
        self.0.readers.close().await;
        let mut writer = self.0.writer.lock().await;
        if let Some(head) = writer.audit_head() {
            let file = Arc::clone(&self.0.audit_head);
            off_the_loop(move || file.raise(head)).await?;
        }
        writer.close().await
    }
}

/// Runs what waits for a disk on a thread that may wait.
async fn off_the_loop<T: Send + 'static>(act: impl FnOnce() -> T + Send + 'static) -> Result<T, StoreError> {
    tokio::task::spawn_blocking(act).await.map_err(|error| StoreError::Io {
        what: "the data folder".into(),
        source: std::io::Error::other(error),
    })
}
