//! Events, limits, the audit, accepted intents and a count of everything.

use mission::record::EventKind;
use mission::{Level, Principal};

use super::super::convert::exactly;
use super::super::db::sql;
use super::super::row::{Row as _, select};
use super::super::{AuditRow, EventRow, IntentRow, LimitRow, Store, StoreError, StoredEvent, StoredIntent};
use super::{During, List, Page, Scope};

/// Which events.
#[derive(Debug, Clone, Default)]
pub struct EventQuery {
    /// Whose.
    pub scope: Scope,
    /// Only those about this key, by its id.
    pub key: Option<String>,
    /// Only of these kinds; empty for all.
    pub kinds: Vec<EventKind>,
    /// Only at least this grave.
    pub level: Level,
    /// Which part, by sequence number.
    pub page: Page,
}

/// How much there is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Raw frames.
    pub frames: i64,
    /// Receptions.
    pub receptions: i64,
    /// Telecommands.
    pub commands: i64,
    /// Sealed frames.
    pub sealed_frames: i64,
    /// Images.
    pub images: i64,
    /// Chunks, other versions included.
    pub chunks: i64,
    /// Downloads.
    pub downloads: i64,
    /// Events.
    pub events: i64,
}

impl Store {
    /// Events in the one durable sequence.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn events(&self, query: &EventQuery) -> Result<Vec<StoredEvent>, StoreError> {
        let kinds = (!query.kinds.is_empty()).then(|| query.kinds.iter().map(|kind| kind.name()).collect());
        let levels = (query.level > Level::Normal).then(|| {
            Level::ALL.iter().filter(|level| **level >= query.level).map(|level| level.name()).collect()
        });
        let rows: Vec<EventRow> = List::of::<EventRow>()
            .scope("at_us", &query.scope)
            .equal("key", query.key.as_deref())
            .any_of("kind", kinds)
            .any_of("level", levels)
            .page(self, "seq", &query.page)
            .await?;
        rows.iter().map(|row| Ok(StoredEvent { sequence: row.seq, record: row.record()? })).collect()
    }

    /// The place of the newest event; 0 when there is none.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn last_event_seq(&self) -> Result<i64, StoreError> {
        sql("select coalesce(max(seq), 0) from events").scalar(&self.0.readers).await
    }

    /// The state of every limit that was ever left, by satellite and parameter.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn limits(&self) -> Result<Vec<LimitRow>, StoreError> {
        let rows =
            sql(select::<LimitRow>("order by satellite, parameter")).fetch_all(&self.0.readers).await?;
        rows.iter().map(LimitRow::read).collect()
    }

    /// Who did what.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn audit(&self, during: &During, page: &Page) -> Result<Vec<AuditRow>, StoreError> {
        List::of::<AuditRow>().during("at_us", during).page(self, "id", page).await
    }

    /// How much there is of everything but telemetry, which would have to be read to be counted.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn counts(&self) -> Result<Counts, StoreError> {
        let row = sql(
            "select (select count(*) from frames) as frames, (select count(*) from receptions) as receptions,
               (select count(*) from commands) as commands, (select count(*) from sealed_frames) as sealed_frames,
               (select count(*) from images) as images, (select count(*) from chunks) as chunks,
               (select count(*) from downloads) as downloads, (select count(*) from events) as events",
        )
        .fetch_one(&self.0.readers)
        .await?;
        Ok(Counts {
            frames: row.try_get("frames")?,
            receptions: row.try_get("receptions")?,
            commands: row.try_get("commands")?,
            sealed_frames: row.try_get("sealed_frames")?,
            images: row.try_get("images")?,
            chunks: row.try_get("chunks")?,
            downloads: row.try_get("downloads")?,
            events: row.try_get("events")?,
        })
    }
}

pub(in crate::storage) async fn find_intent(
    store: &Store,
    principal: &Principal,
    idempotency_key: &str,
) -> Result<Option<StoredIntent>, StoreError> {
    let found = sql(select::<IntentRow>("where principal = ? and idempotency_key = ?"))
        .bind(principal.as_str())
        .bind(idempotency_key)
        .fetch_optional(&store.0.readers)
        .await?;
    let Some(found) = found else { return Ok(None) };
    let row = IntentRow::read(&found)?;
    Ok(Some(StoredIntent { digest: exactly("intents.digest", &row.digest)?, accepted: row.accepted()? }))
}
