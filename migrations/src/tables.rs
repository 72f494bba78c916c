//! The tables of an archive's file as whoever compares two archives sees them: every table there is, every row, every column.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;

use sqlx::migrate::Migrator;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{AssertSqlSafe, Connection as _, SqliteConnection};

/// The rows of each table by its name, as text that differs where any value does.
///
/// # Errors
/// When the file cannot be read.
pub fn all(file: &Path) -> io::Result<BTreeMap<String, BTreeSet<String>>> {
    run(read(file))
}

/// Puts this many rows into the archive's largest table, beside all rules: they stand for years of values. Some 40 bytes each.
///
/// # Errors
/// When the file cannot be written.
pub fn grow(file: &Path, rows: i64) -> io::Result<()> {
    run(async {
        let options = SqliteConnectOptions::new().filename(file).foreign_keys(false);
        let mut database = SqliteConnection::connect_with(&options).await?;
        sqlx::query(
            "with recursive numbers (n) as (select 1 union all select n + 1 from numbers where n < ?)
             insert into telemetry (parameter, at_us, frame, route, value, decoder_version, crc)
             select 1000000, n * 1000003, n, 1, n / 7.0, 1, n * 2654435761 % 4294967296 from numbers",
        )
        .bind(rows)
        .execute(&mut database)
        .await?;
        database.close().await
    })
}

/// Makes the archive one of an older program: with the first `steps` of the schema, and the rows that their tables have. Its
/// mark goes, and the next opening sets it anew.
///
/// # Errors
/// When it cannot be read or written.
pub fn age(file: &Path, steps: usize) -> io::Result<()> {
    let aged = file.with_extension("aged");
    run(async {
        let migrations = crate::SQLITE.iter().take(steps).cloned().collect();
        let options = SqliteConnectOptions::new().filename(&aged).create_if_missing(true).foreign_keys(false);
        let mut database = SqliteConnection::connect_with(&options).await?;
        Migrator { migrations: Cow::Owned(migrations), ..Migrator::DEFAULT }.run(&mut database).await?;
        let attach = format!("attach '{}' as newer", file.display());
        sqlx::query(AssertSqlSafe(attach)).execute(&mut database).await?;
        let tables: Vec<String> = sqlx::query_scalar(
            "select name from main.sqlite_schema where type = 'table' and name not like 'sqlite~_%' escape '~'
               and name not in ('_sqlx_migrations', 'meta')",
        )
        .fetch_all(&mut database)
        .await?;
        for table in tables {
            let copy = format!("insert or replace into main.{table} select * from newer.{table}");
            sqlx::query(AssertSqlSafe(copy)).execute(&mut database).await?;
        }
        database.close().await
    })?;
    std::fs::set_permissions(&aged, file.metadata()?.permissions())?;
    std::fs::rename(&aged, file)
}

/// The newest step of the archive's schema.
///
/// # Errors
/// When it cannot be read.
pub fn schema(file: &Path) -> io::Result<i64> {
    run(async {
        let options = SqliteConnectOptions::new().filename(file).pragma("query_only", "on");
        let mut database = SqliteConnection::connect_with(&options).await?;
        let newest =
            sqlx::query_scalar("select max(version) from _sqlx_migrations").fetch_one(&mut database).await?;
        database.close().await?;
        Ok(newest)
    })
}

async fn read(file: &Path) -> Result<BTreeMap<String, BTreeSet<String>>, sqlx::Error> {
    let options = SqliteConnectOptions::new().filename(file).pragma("query_only", "on");
    let mut database = SqliteConnection::connect_with(&options).await?;
    let names: Vec<String> = sqlx::query_scalar(
        "select name from sqlite_schema where type = 'table' and name not like 'sqlite~_%' escape '~'",
    )
    .fetch_all(&mut database)
    .await?;
    let mut tables = BTreeMap::new();
    for name in names {
        let columns: Vec<String> = sqlx::query_scalar("select name from pragma_table_info(?) order by cid")
            .bind(&name)
            .fetch_all(&mut database)
            .await?;
        let values: Vec<String> = columns.iter().map(|column| format!("quote({column})")).collect();
        let statement = format!("select {} from {name}", values.join(" || ', ' || "));
        let rows: Vec<String> = sqlx::query_scalar(AssertSqlSafe(statement)).fetch_all(&mut database).await?;
        tables.insert(name, rows.into_iter().collect());
    }
    database.close().await?;
    Ok(tables)
}

fn run<T>(work: impl Future<Output = Result<T, sqlx::Error>>) -> io::Result<T> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(work).map_err(io::Error::other)
}
