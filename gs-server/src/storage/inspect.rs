//! Looking at an archive from outside, while servers may be writing: for `gs-server doctor`.

use std::collections::BTreeMap;

use protocol::{Counter, KeyId};

use super::backup::{DatabaseFacts, facts};
use super::convert::narrow;
use super::db::{Connection, sql};
use super::row::{Row, select};
use super::rows::{CommandRow, EventRow, FrameRow, SealedRow, StageRow};
use super::{Archive, StoreError};

/// What was seen of a database.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inspection {
    /// What it says of itself.
    pub facts: DatabaseFacts,
    /// The highest counter of each key, by the text of its id.
    pub counters: BTreeMap<String, Counter>,
    /// The newest epoch of elements of each satellite, microseconds since 1970.
    pub epochs_us: BTreeMap<String, i64>,
    /// Rows whose checksum was looked at.
    pub rows_checked: usize,
    /// Which database, and its version.
    pub engine: String,
}

/// Looks at the pages, at the newest rows of the tables that commanding rests on, and at what they say.
///
/// # Errors
/// [`StoreError::Damaged`] when anything is not as this program makes it.
pub async fn inspect_database(archive: &Archive) -> Result<Inspection, StoreError> {
    let mut connection = archive.reading().await?;
    let inspection = inspect(&mut connection).await;
    connection.close().await?;
    inspection
}

async fn inspect(connection: &mut Connection) -> Result<Inspection, StoreError> {
    let facts = facts(connection).await?;
    if let Connection::Lite(connection) = connection {
        let finding: String = sql("pragma quick_check(1)").scalar(connection).await?;
        if finding != "ok" {
            return Err(StoreError::damaged(finding.trim().replace('\n', "; ")));
        }
    }
    let rows_checked = newest::<FrameRow>(connection, "order by id desc limit 500").await?
        + newest::<SealedRow>(connection, "order by counter desc limit 500").await?
        + newest::<CommandRow>(connection, "order by id desc limit 500").await?
        + newest::<StageRow>(connection, "order by command desc limit 500").await?
        + newest::<EventRow>(connection, "order by seq desc limit 500").await?;
    let rows = sql("select key, max(counter) as counter from (
           select key, counter from sealed_frames union all select key, counter from counter_floors)
         as spent group by key");
    let mut counters = BTreeMap::new();
    for row in rows.fetch_all(&mut *connection).await? {
        let key: String = row.try_get("key")?;
        key.parse::<KeyId>().map_err(|error| StoreError::damaged(format!("a key is '{key}': {error}")))?;
        counters.insert(key, Counter(narrow("counter", row.try_get("counter")?)?));
    }
    let rows = sql("select satellite, max(epoch_us) as epoch_us from elements group by satellite");
    let mut epochs_us = BTreeMap::new();
    for row in rows.fetch_all(&mut *connection).await? {
        epochs_us.insert(row.try_get("satellite")?, row.try_get("epoch_us")?);
    }
    let (name, version) = match connection {
        Connection::Lite(_) => ("SQLite", "select sqlite_version()"),
        Connection::Pg(_) => ("PostgreSQL", "select current_setting('server_version')"),
    };
    let engine = format!("{name} {}", sql(version).scalar::<String>(connection).await?);
    Ok(Inspection { facts, counters, epochs_us, rows_checked, engine })
}

async fn newest<R: Row>(connection: &mut Connection, which: &'static str) -> Result<usize, StoreError> {
    let rows = sql(select::<R>(which)).fetch_all(connection).await?;
    rows.iter().try_for_each(|row| R::read(row).map(drop))?;
    Ok(rows.len())
}
