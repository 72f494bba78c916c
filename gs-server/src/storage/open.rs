//! Opening the station's memory, with every doubt settled before the first row is read.

use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::Path;
use std::sync::{Arc, Mutex};

use mission::StationId;

use super::audit_chain::HeadFile;
use super::convert::parse;
use super::db::{Connection, On, sql};
use super::lock::FolderLock;
use super::reserve::{Reserve, ReserveError};
use super::row::{Row as _, select, upsert};
use super::rows::MetaRow;
use super::{Inner, Store, StoreError, StoreOptions, lite, off_the_loop, pg};
use crate::witness::WitnessFolder;

pub(super) async fn open(options: StoreOptions) -> Result<Store, StoreError> {
    endure_file_size_limits();
    let folder = options.folder.clone();
    let is_file = options.postgres.is_none();
    let (lock, size_bytes) = off_the_loop(move || {
        let lock = prepare(&folder)?;
        let size_bytes = if is_file { lite::prepare(&folder)? } else { 0 };
        Ok::<_, StoreError>((lock, size_bytes))
    })
    .await??;
    let (writer, readers, number) = match &options.postgres {
        Some(postgres) => pg::open(&options, postgres).await?,
        None => {
            let (writer, readers) = lite::open(&options, size_bytes).await?;
            (writer, readers, 0)
        }
    };

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
        number,
        writer: tokio::sync::Mutex::new(writer),
        readers,
        witness,
        reserve: Mutex::new(reserve),
        audit_head,
        _lock: lock,
    })))
}

/// The folder and the lock.
fn prepare(folder: &Path) -> Result<FolderLock, StoreError> {
    if !folder.is_dir() {
        DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(folder)
            .map_err(|error| StoreError::from_io(folder, error))?;
    }
    FolderLock::take(folder)
}

/// A write beyond a limit of the shell (`ulimit -f`) must come back as an error, not end the process.
fn endure_file_size_limits() {
    let signal = rustix::process::Signal::XFSZ.as_raw();
    // The handler stays when the stream is dropped. Without it the system's default holds, which is no reason to fail.
    drop(tokio::signal::unix::signal(tokio::signal::unix::SignalKind::from_raw(signal)));
}

pub(super) async fn meta(on: impl Into<On<'_>>) -> Result<Option<MetaRow>, StoreError> {
    let row = sql(select::<MetaRow>("where id = 1")).fetch_optional(on).await?;
    row.as_ref().map(MetaRow::read).transpose()
}

/// Tells that an older program's archive gets the steps of the schema that it lacks.
pub(super) fn tell_upgrade(found: Option<i64>, known: i64) {
    if let Some(found) = found.filter(|found| *found < known) {
        tracing::info!(found, known, "the archive is brought from schema {found} to {known}");
    }
}

/// The tables must be what we made, and the database of the kind we want.
pub(super) fn check_mark(
    meta: &MetaRow,
    schema_crc: i64,
    simulated: bool,
    place: &Path,
) -> Result<(), StoreError> {
    if meta.schema_crc != schema_crc {
        return Err(StoreError::damaged("its tables are not those that this program made"));
    }
    if meta.simulated != simulated {
        return Err(StoreError::SimulatedMark { folder: place.to_path_buf(), simulated: meta.simulated });
    }
    Ok(())
}

/// Marks a new database, and notes what its tables are now and whose they are: the station's name. `now` asks the
/// database for the time.
pub(super) async fn mark(
    connection: &mut Connection,
    options: &StoreOptions,
    schema_crc: i64,
    now: &'static str,
) -> Result<StationId, StoreError> {
    let found = meta(&mut *connection).await?;
    let station = match (&options.station, &found) {
        (Some(station), _) => station.clone(),
        (None, Some(row)) => parse("meta.station", &row.station)?,
        (None, None) => return Err(StoreError::damaged("it does not say whose it is")),
    };
    let row = match found {
        Some(row) if row.schema_crc == schema_crc && row.station == station.as_str() => return Ok(station),
        Some(row) => MetaRow { schema_crc, station: station.to_string(), ..row },
        None => MetaRow {
            id: 1,
            station: station.to_string(),
            simulated: options.simulated,
            created_at_us: sql(now).scalar(&mut *connection).await?,
            schema_crc,
        },
    };
    row.bind(sql(upsert::<MetaRow>("id"))).execute(connection).await?;
    Ok(station)
}
