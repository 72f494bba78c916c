//! Opening the data folder, with every doubt settled before the first row is read.

use std::fs::{DirBuilder, File, OpenOptions};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use mission::StationId;
use sqlx::migrate::MigrateError;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};
use sqlx::{AssertSqlSafe, Connection as _, SqliteConnection};

use super::audit_chain::{self, HeadFile};
use super::convert::parse;
use super::lock::FolderLock;
use super::reserve::{Reserve, ReserveError};
use super::row::{Digest, Feed as _, Row as _, select, upsert};
use super::rows::MetaRow;
use super::write::Writer;
use super::{DATABASE, Inner, Store, StoreError, StoreOptions, off_the_loop};
use crate::witness::WitnessFolder;

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

pub(super) async fn open(options: StoreOptions) -> Result<Store, StoreError> {
    endure_file_size_limits();
    let folder = options.folder.clone();
    let (lock, size_bytes) = off_the_loop(move || prepare(&folder)).await??;

    let connect = writer_options(&options);
    let mut connection = SqliteConnection::connect_with(&connect).await?;
    check_pages(&mut connection, size_bytes).await?;
    refuse_newer(&mut connection).await?;
    check_schema(&mut connection, &options).await?;
    migrate(&mut connection).await?;
    audit_chain::begin(&mut connection).await?;
    let station = mark(&mut connection, &options).await?;
    let writer = Writer::new(connection, connect, station).await?;

    let readers = SqlitePoolOptions::new()
        .max_connections(4)
        .acquire_timeout(Duration::from_secs(10))
        .connect_lazy_with(reader_of(&options.folder));

    // After the database: a witness folder beside an empty file means that the file has lost its contents.
    let witness_path = options.folder.join("witness");
    let reserve_path = options.folder.join("reserve.bin");
    let reserve_bytes = options.reserve_bytes;
    let (witness, reserve) = off_the_loop(move || {
        let witness =
            WitnessFolder::open(&witness_path).map_err(|error| StoreError::from_io(&witness_path, error))?;
        let reserve = match reserve_bytes {
            0 => None,
            bytes => Some(Reserve::open(&reserve_path, bytes).map_err(|error| match error {
                ReserveError::Io(error) => StoreError::from_io(&reserve_path, error),
                ReserveError::Full | ReserveError::Absent => StoreError::Full,
            })?),
        };
        Ok::<_, StoreError>((witness, reserve))
    })
    .await??;

    let audit_head = Arc::new(HeadFile::new(&options.folder));
    Ok(Store(Arc::new(Inner {
        folder: options.folder,
        simulated: options.simulated,
        writer: tokio::sync::Mutex::new(writer),
        readers,
        witness,
        reserve: Mutex::new(reserve),
        audit_head,
        _lock: lock,
    })))
}

/// The folder, the lock, and a file of ours; its size in bytes.
fn prepare(folder: &Path) -> Result<(FolderLock, u64), StoreError> {
    if !folder.is_dir() {
        DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(folder)
            .map_err(|error| StoreError::from_io(folder, error))?;
    }
    let lock = FolderLock::take(folder)?;
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
    Ok((lock, size_bytes))
}

/// A write beyond a limit of the shell (`ulimit -f`) must come back as an error, not end the process.
fn endure_file_size_limits() {
    let signal = rustix::process::Signal::XFSZ.as_raw();
    // The handler stays when the stream is dropped. Without it the system's default holds, which is no reason to fail.
    drop(tokio::signal::unix::signal(tokio::signal::unix::SignalKind::from_raw(signal)));
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
        _ => Ok(()),
    }
}

async fn meta(connection: &mut SqliteConnection) -> Result<Option<MetaRow>, StoreError> {
    let row = sqlx::query(select::<MetaRow>("where id = 1")).fetch_optional(connection).await?;
    row.as_ref().map(MetaRow::read).transpose()
}

/// The schema's text must be what we wrote, and the folder of the kind we want.
async fn check_schema(connection: &mut SqliteConnection, options: &StoreOptions) -> Result<(), StoreError> {
    if !has_table(connection, "meta").await? {
        return Ok(());
    }
    let Some(meta) = meta(connection).await? else { return Ok(()) };
    if meta.schema_crc != schema_crc(connection).await? {
        return Err(StoreError::damaged("its tables are not those that this program made"));
    }
    if meta.simulated != options.simulated {
        return Err(StoreError::SimulatedMark { folder: options.folder.clone(), simulated: meta.simulated });
    }
    Ok(())
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

/// Marks a new database, and notes what its tables are now and whose they are: the station's name.
async fn mark(connection: &mut SqliteConnection, options: &StoreOptions) -> Result<StationId, StoreError> {
    let schema_crc = schema_crc(connection).await?;
    let found = meta(connection).await?;
    let station = match (&options.station, &found) {
        (Some(station), _) => station.clone(),
        (None, Some(row)) => parse("meta.station", &row.station)?,
        (None, None) => return Err(StoreError::damaged("it does not say whose it is")),
    };
    let row = match found {
        Some(row) if row.schema_crc == schema_crc && row.station == station.as_str() => return Ok(station),
        Some(row) => MetaRow { schema_crc, station: station.to_string(), ..row },
        None => {
            // Told to people only, so the machine's clock will do, and a simulation need not wait for its first batch.
            let created_at_us = sqlx::query_scalar("select cast(unixepoch('subsec') * 1000000 as integer)")
                .fetch_one(&mut *connection)
                .await?;
            MetaRow {
                id: 1,
                station: station.to_string(),
                simulated: options.simulated,
                created_at_us,
                schema_crc,
            }
        }
    };
    row.bind(sqlx::query(upsert::<MetaRow>("id"))).execute(connection).await?;
    Ok(station)
}
