//! The tables: made, brought up to date, and known again.

use std::path::Path;

use mission::StationId;
use sqlx::PgConnection;
use sqlx::migrate::MigrateError;

use crate::storage::convert::parse;
use crate::storage::db::sql;
use crate::storage::open::{check_mark, meta, tell_upgrade};
use crate::storage::row::{Digest, Feed as _, Row as _, upsert};
use crate::storage::rows::MetaRow;
use crate::storage::{StoreError, StoreOptions};

/// Brings the tables up to date and marks a new database. The station: as told, or who made the database.
pub(super) async fn bring_up_to_date(
    connection: &mut PgConnection,
    options: &StoreOptions,
    place: &Path,
) -> Result<StationId, StoreError> {
    if has_table(connection, "_sqlx_migrations").await? {
        let found: Option<i64> =
            sql("select max(version) from _sqlx_migrations").scalar(&mut *connection).await?;
        let known = migrations::newest_postgres();
        if let Some(found) = found.filter(|found| *found > known) {
            return Err(StoreError::NewerSchema { found, known });
        }
        tell_upgrade(found, known);
    }
    let found = match has_table(connection, "meta").await? {
        true => meta(&mut *connection).await?,
        false => None,
    };
    if let Some(meta) = &found {
        check_mark(meta, schema_crc(connection).await?, options.simulated, place)?;
    }
    migrations::POSTGRES.run(&mut *connection).await.map_err(|error| match error {
        MigrateError::VersionMissing(found) => {
            StoreError::NewerSchema { found, known: migrations::newest_postgres() }
        }
        MigrateError::Execute(error) | MigrateError::ExecuteMigration(error, _) => error.into(),
        error => StoreError::damaged(error.to_string()),
    })?;
    let schema_crc = schema_crc(connection).await?;
    let station = match (&options.station, &found) {
        (Some(station), _) => station.clone(),
        (None, Some(row)) => parse("meta.station", &row.station)?,
        (None, None) => return Err(StoreError::damaged("it does not say whose it is")),
    };
    let row = match found {
        Some(row) if row.schema_crc == schema_crc => return Ok(station),
        Some(row) => MetaRow { schema_crc, ..row },
        None => MetaRow {
            id: 1,
            station: station.to_string(),
            simulated: options.simulated,
            created_at_us: sql("select (extract(epoch from clock_timestamp()) * 1000000)::bigint")
                .scalar(&mut *connection)
                .await?,
            schema_crc,
        },
    };
    row.bind(sql(upsert::<MetaRow>("id"))).execute(connection).await?;
    Ok(station)
}

async fn has_table(connection: &mut PgConnection, table: &str) -> Result<bool, StoreError> {
    sql("select count(*) from information_schema.tables where table_schema = current_schema() and table_name = ?")
        .bind(table)
        .scalar(connection)
        .await
}

/// A checksum of all columns, constraints and triggers that are in force: by their names and kinds, since the text
/// in which the database tells them differs from release to release.
pub(in crate::storage) async fn schema_crc(connection: &mut PgConnection) -> Result<i64, StoreError> {
    let told: Vec<String> = sql(
        "select told from (
           select 'column ' || c.table_name || '.' || c.column_name || ' ' || c.data_type || ' ' || c.is_nullable as told
             from information_schema.columns c where c.table_schema = current_schema()
           union all
           select 'trigger ' || r.relname || '.' || t.tgname || ' ' || t.tgtype::text
             from pg_trigger t join pg_class r on r.oid = t.tgrelid
             where r.relnamespace = current_schema()::regnamespace and not t.tgisinternal and t.tgenabled = 'O'
           union all
           select 'constraint ' || r.relname || '.' || k.conname || ' ' || k.contype::text
             from pg_constraint k join pg_class r on r.oid = k.conrelid
             where r.relnamespace = current_schema()::regnamespace and k.contype <> 'n'
         ) as everything where told not like '%\\_sqlx\\_migrations%' order by told collate \"C\"",
    )
    .scalars(connection)
    .await?;
    let mut digest = Digest::new("schema");
    told.iter().for_each(|text| text.feed(&mut digest));
    Ok(digest.finish())
}
