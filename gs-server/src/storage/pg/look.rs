//! Looking at the database's server before anything is opened: for `gs-server doctor`.

use mission::{Clock, UtcUs};

use super::{Postgres, WRITING, connect};
use crate::storage::StoreError;
use crate::storage::db::sql;

/// What was seen of a database's server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServerFacts {
    /// Its version, as a number: 150004 is 15.4.
    pub version_number: i64,
    /// `synchronous_commit` as a session has it that asks for `on`, as a station does.
    pub synchronous_commit: String,
    /// `fsync`.
    pub fsync: String,
    /// `full_page_writes`.
    pub full_page_writes: String,
    /// It takes no writes: a standby.
    pub is_standby: bool,
    /// Whether there are tables of ours.
    pub has_archive: bool,
    /// The newest step of the schema; 0 when there is none.
    pub schema: i64,
    /// Whether this user may make tables.
    pub may_make_tables: bool,
    /// The stations that have worked on it.
    pub stations: Vec<String>,
    /// How far the server's clock is ahead of ours, microseconds.
    pub clock_ahead_us: i64,
}

/// Connects as a station does, and looks; writes nothing.
///
/// # Errors
/// [`StoreError`] when the server is not there, does not let us in, or does not answer.
pub async fn look_at_server(postgres: &Postgres, clock: &impl Clock) -> Result<ServerFacts, StoreError> {
    let mut own = WRITING.to_vec();
    own.push(("default_transaction_read_only", "on"));
    let mut connection = connect(&postgres.options("gs-server doctor", &own)?).await?;
    let row = sql("select current_setting('server_version_num')::bigint as version_number,
           current_setting('synchronous_commit') as synchronous_commit, current_setting('fsync') as fsync,
           current_setting('full_page_writes') as full_page_writes,
           (case when pg_is_in_recovery() then 1 else 0 end)::bigint as is_standby,
           (case when to_regclass('meta') is null then 0 else 1 end)::bigint as has_archive,
           (case when to_regclass('_sqlx_migrations') is null then 0 else 1 end)::bigint as has_schema,
           (case when has_schema_privilege(current_schema(), 'create') then 1 else 0 end)::bigint as may_make_tables")
    .fetch_one(&mut connection)
    .await?;
    let has_archive: bool = row.try_get("has_archive")?;
    let schema = match row.try_get("has_schema")? {
        true => sql("select coalesce(max(version), 0) from _sqlx_migrations").scalar(&mut connection).await?,
        false => 0,
    };
    let stations = match has_archive {
        true => sql("select name from stations order by number").scalars(&mut connection).await?,
        false => Vec::new(),
    };
    let before = clock.now().utc;
    let there: i64 = sql("select (extract(epoch from clock_timestamp()) * 1000000)::bigint")
        .scalar(&mut connection)
        .await?;
    let UtcUs(after) = clock.now().utc;
    Ok(ServerFacts {
        version_number: row.try_get("version_number")?,
        synchronous_commit: row.try_get("synchronous_commit")?,
        fsync: row.try_get("fsync")?,
        full_page_writes: row.try_get("full_page_writes")?,
        is_standby: row.try_get("is_standby")?,
        has_archive,
        schema,
        may_make_tables: row.try_get("may_make_tables")?,
        stations,
        // It was read somewhere between question and answer.
        clock_ahead_us: there - before.0.midpoint(after),
    })
}
