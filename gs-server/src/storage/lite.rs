//! The database in the data folder: its file, its checks, its schema.

use std::fs::{File, OpenOptions};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::time::Duration;

use sqlx::migrate::MigrateError;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};
use sqlx::{AssertSqlSafe, Connection as _, SqliteConnection};

use super::audit_chain;
use super::db::{Connection, Pool};
use super::open::{check_mark, mark, meta, tell_upgrade};
use super::row::{Digest, Feed as _};
use super::write::{Target, Writer};
use super::{DATABASE, StoreError, StoreOptions};

/// Up to this size the whole file is checked at the start (about a second); above it the tables that commanding rests
/// on are, and `gs-server redecode` reads the rest.
const FULL_CHECK_BYTES: u64 = 64 << 20;

const ESSENTIAL_TABLES: [&str; 9] = [
    "meta",
    "sealed_frames",
    "counter_floors",
    "commands",
    "command_stages",
    "intents",
    "downloads",
    "images",
    "limits",
];

/// Pages that may lie in the write-ahead log before they are moved into the file: 4 MB.
const CHECKPOINT_PAGES: &str = "1000";

/// Opens the database in this folder, of which `size_bytes` are there.
pub(super) async fn open(options: &StoreOptions, size_bytes: u64) -> Result<(Writer, Pool), StoreError> {
    let connect = writer_options(options);
    let mut connection = SqliteConnection::connect_with(&connect).await?;
    check_pages(&mut connection, size_bytes).await?;
    refuse_newer(&mut connection).await?;
    check_schema(&mut connection, options).await?;
    migrate(&mut connection).await?;
    let schema_crc = schema_crc(&mut connection).await?;
    let mut connection = Connection::Lite(connection);
    audit_chain::begin(&mut connection).await?;
    // Told to people only, so the machine's clock will do, and a simulation need not wait for its first batch.
    let now = "select cast(unixepoch('subsec') * 1000000 as integer)";
    let station = mark(&mut connection, options, schema_crc, now).await?;
    let readers = SqlitePoolOptions::new()
        .max_connections(4)
        .acquire_timeout(Duration::from_secs(10))
        .connect_lazy_with(reader_of(&options.folder));
    Ok((Writer::new(connection, Target::Lite(connect), station).await?, Pool::Lite(readers)))
}

fn writer_options(options: &StoreOptions) -> SqliteConnectOptions {
    let connect = SqliteConnectOptions::new()
        .filename(options.folder.join(DATABASE))
        .journal_mode(SqliteJournalMode::Wal)
        // What was acknowledged survives a power cut: the log is synced at each commit.
        .synchronous(SqliteSynchronous::Full)
        .foreign_keys(true)
        .busy_timeout(Duration::from_secs(5))
        .pragma("wal_autocheckpoint", CHECKPOINT_PAGES)
        .pragma("journal_size_limit", "67108864")
        .thread_name(|_| "store-writer".to_owned());
    match options.max_page_count {
        Some(pages) => connect.pragma("max_page_count", pages.to_string()),
        None => connect,
    }
}

/// How the database in this folder is read.
pub(super) fn reader_of(folder: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(folder.join(DATABASE))
        .busy_timeout(Duration::from_secs(5))
        // Not `read_only`: a reader of a write-ahead log must be able to write its index.
        .pragma("query_only", "on")
        .thread_name(|number| format!("store-reader-{number}"))
}

async fn check_pages(connection: &mut SqliteConnection, size_bytes: u64) -> Result<(), StoreError> {
    let present: Vec<String> = sqlx::query_scalar("select name from sqlite_schema where type = 'table'")
        .fetch_all(&mut *connection)
        .await?;
    let checks: Vec<String> = match size_bytes {
        ..=FULL_CHECK_BYTES => vec!["pragma integrity_check(1)".to_owned()],
        _ => ESSENTIAL_TABLES
            .iter()
            .filter(|table| present.iter().any(|name| name == *table))
            .map(|table| format!("pragma integrity_check({table})"))
            .collect(),
    };
    for check in checks {
        let findings: Vec<String> =
            sqlx::query_scalar(AssertSqlSafe(check)).persistent(false).fetch_all(&mut *connection).await?;
        if let Some(finding) = findings.into_iter().find(|finding| finding != "ok") {
            return Err(StoreError::damaged(finding.trim().replace('\n', "; ")));
        }
    }
    Ok(())
}

async fn has_table(connection: &mut SqliteConnection, table: &str) -> Result<bool, StoreError> {
    let count: i64 =
        sqlx::query_scalar("select count(*) from sqlite_schema where type = 'table' and name = ?")
            .bind(table)
            .fetch_one(connection)
            .await?;
    Ok(count > 0)
}

async fn refuse_newer(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    if !has_table(connection, "_sqlx_migrations").await? {
        return Ok(());
    }
    let found: Option<i64> =
        sqlx::query_scalar("select max(version) from _sqlx_migrations").fetch_one(&mut *connection).await?;
    let known = migrations::newest_sqlite();
    match found {
        Some(found) if found > known => Err(StoreError::NewerSchema { found, known }),
        found => {
            tell_upgrade(found, known);
            Ok(())
        }
    }
}

/// The schema's text must be what we wrote, and the folder of the kind we want.
async fn check_schema(connection: &mut SqliteConnection, options: &StoreOptions) -> Result<(), StoreError> {
    if !has_table(connection, "meta").await? {
        return Ok(());
    }
    let Some(meta) = meta(&mut *connection).await? else { return Ok(()) };
    let schema_crc = schema_crc(connection).await?;
    check_mark(&meta, schema_crc, options.simulated, &options.folder)
}

pub(super) async fn schema_crc(connection: &mut SqliteConnection) -> Result<i64, StoreError> {
    let texts: Vec<String> = sqlx::query_scalar(
        "select sql from sqlite_schema where sql is not null and name not like 'sqlite~_%' escape '~'
         order by type, name",
    )
    .fetch_all(connection)
    .await?;
    let mut digest = Digest::new("schema");
    texts.iter().for_each(|text| text.feed(&mut digest));
    Ok(digest.finish())
}

async fn migrate(connection: &mut SqliteConnection) -> Result<(), StoreError> {
    migrations::SQLITE.run(connection).await.map_err(|error| match error {
        MigrateError::VersionMissing(found) => {
            StoreError::NewerSchema { found, known: migrations::newest_sqlite() }
        }
        MigrateError::Execute(error) | MigrateError::ExecuteMigration(error, _) => error.into(),
        error => StoreError::damaged(error.to_string()),
    })
}

/// The file, of ours; its size in bytes.
pub(super) fn prepare(folder: &Path) -> Result<u64, StoreError> {
    let path = folder.join(DATABASE);
    let failed = |error| StoreError::from_io(&path, error);
    let is_new = !path.exists();
    // SQLite gives the write-ahead log the mode of this file.
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(&path)
        .map_err(failed)?;
    let size_bytes = file.metadata().map_err(failed)?.len();
    if size_bytes == 0 && !is_new && folder.join("witness").is_dir() {
        return Err(StoreError::damaged("the file is empty, though there was a database here"));
    }
    if is_new {
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(failed)?;
    }
    Ok(size_bytes)
}
