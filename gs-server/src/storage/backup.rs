//! Copies of the database for backups: made beside a server that writes, and looked at afterwards.

use std::path::Path;
use std::time::Duration;

use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous};
use sqlx::{Connection as _, SqliteConnection};

use super::db::{Connection, sql};
use super::forwards::{ForwardRow, ForwardTargetRow, newest};
use super::row::{Row as _, select, upsert};
use super::rows::MetaRow;
use super::{DATABASE, StoreError, lite, pg};

/// What a database says of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DatabaseFacts {
    /// Whose it is; of a database that stations share, who made it.
    pub station: String,
    /// What it holds is made up.
    pub simulated: bool,
    /// The newest step of the schema.
    pub schema: i64,
    /// The place of the newest event; 0 when there is none.
    pub last_event: i64,
    /// The number of the newest raw frame; 0 when there is none.
    pub last_frame: i64,
}

/// Writes the database of this data folder as it is at one moment to `to`, which must not exist or be empty. Waits for
/// nobody, and whoever writes does not wait either. Not synced.
///
/// # Errors
/// [`StoreError`] when the database cannot be read or the copy cannot be written.
pub async fn copy_database(folder: &Path, to: &Path) -> Result<(), StoreError> {
    // Not `read_only`: a reader of a write-ahead log must be able to write its index.
    let options = SqliteConnectOptions::new()
        .filename(folder.join(DATABASE))
        .create_if_missing(false)
        .busy_timeout(Duration::from_secs(10));
    let mut connection = SqliteConnection::connect_with(&options).await?;
    let target = to.to_str().ok_or_else(|| StoreError::Permission { path: to.to_path_buf() })?;
    sqlx::query("vacuum into ?").bind(target).persistent(false).execute(&mut connection).await?;
    Ok(connection.close().await?)
}

/// What waited to be passed on when the backup was taken may have gone out since: it is as if the server had died while it
/// was on its way. The file must be nobody's.
///
/// # Errors
/// [`StoreError`] when it cannot be read or written.
pub async fn doubt_forwards(file: &Path) -> Result<(), StoreError> {
    let options = SqliteConnectOptions::new()
        .filename(file)
        .journal_mode(SqliteJournalMode::Delete)
        .synchronous(SqliteSynchronous::Full);
    let mut connection = Connection::Lite(SqliteConnection::connect_with(&options).await?);
    let known = "select count(*) from sqlite_schema where type = 'table' and name = 'forwards'";
    let known: i64 = sql(known).scalar(&mut connection).await?;
    if known > 0 {
        sql("begin immediate").execute(&mut connection).await?;
        let waiting = sql(select::<ForwardRow>("where state = 'waiting'")).fetch_all(&mut connection).await?;
        for row in &waiting {
            let row = ForwardRow { state: "sending".to_owned(), ..ForwardRow::read(row)? };
            row.bind(sql(upsert::<ForwardRow>("id"))).execute(&mut connection).await?;
        }
        // What was heard and not taken up yet, by a target that looks every few seconds, may have gone out as well.
        let targets = sql(select::<ForwardTargetRow>("order by id")).fetch_all(&mut connection).await?;
        for row in &targets {
            let row = ForwardTargetRow::read(row)?;
            let radio_through = newest(&mut connection, "receptions", &row.station).await?;
            let outside_through = newest(&mut connection, "outside_receptions", &row.station).await?;
            let row = ForwardTargetRow { radio_through, outside_through, ..row };
            row.bind(sql(upsert::<ForwardTargetRow>("id"))).execute(&mut connection).await?;
        }
        sql("commit").execute(&mut connection).await?;
    }
    connection.close().await
}

/// Looks at a database that nobody writes: are its pages whole, its tables ours, and what does it say of itself.
///
/// # Errors
/// [`StoreError::Damaged`] when anything is not as this program makes it.
pub async fn examine_database(file: &Path) -> Result<DatabaseFacts, StoreError> {
    let options = SqliteConnectOptions::new().filename(file).read_only(true).immutable(true);
    let mut connection = Connection::Lite(SqliteConnection::connect_with(&options).await?);
    let facts = facts(&mut connection).await?;
    let finding: String = sql("pragma quick_check(1)").scalar(&mut connection).await?;
    if finding != "ok" {
        return Err(StoreError::damaged(finding.trim().replace('\n', "; ")));
    }
    connection.close().await?;
    Ok(facts)
}

pub(super) async fn facts(connection: &mut Connection) -> Result<DatabaseFacts, StoreError> {
    let meta = sql(select::<MetaRow>("where id = 1")).fetch_one(&mut *connection).await?;
    let meta = MetaRow::read(&meta)?;
    let schema_crc = match connection {
        Connection::Lite(connection) => lite::schema_crc(connection).await?,
        Connection::Pg(connection) => pg::schema_crc(connection).await?,
    };
    if meta.schema_crc != schema_crc {
        return Err(StoreError::damaged("its tables are not those that this program made"));
    }
    let schema = sql("select max(version) from _sqlx_migrations").scalar(&mut *connection).await?;
    let last_event = sql("select coalesce(max(seq), 0) from events").scalar(&mut *connection).await?;
    let last_frame = sql("select coalesce(max(id), 0) from frames").scalar(&mut *connection).await?;
    Ok(DatabaseFacts { station: meta.station, simulated: meta.simulated, schema, last_event, last_frame })
}
