//! PostgreSQL: one database for several servers, each with a station of its own.
//!
//! Every transaction that writes locks the one row of `heads` first. So numbers (events, audit) are given in the order in
//! which they become visible, and what one server reads there is not changed by another before its commit. In the same
//! transaction it looks whether it still is its station: a server that was replaced while it slept writes nothing.
//!
//! What was acknowledged is on the database's disk (`synchronous_commit = on`). A commit whose answer was lost is
//! recognised when the engine sends the batch again.

mod lease;
mod listen;
mod look;
mod password;
mod schema;

use std::fmt;
use std::path::Path;
use std::str::FromStr as _;
use std::time::Duration;

use mission::{BatchId, StationId};
use sqlx::postgres::{PgConnectOptions, PgPoolOptions};
use sqlx::{Connection as _, PgConnection};
use zeroize::Zeroizing;

use super::audit_chain;
use super::db::{Connection, Pool, sql};
use super::write::{Heads, Target, Writer};
use super::{StoreError, StoreOptions};
use crate::clock::within;
pub(super) use lease::Fence;
pub use lease::Leased;
pub use listen::Others;
pub use look::{ServerFacts, look_at_server};
pub(super) use schema::schema_crc;

/// Until a connection stands.
const CONNECT: Duration = Duration::from_secs(5);
/// Until a batch is stored. The session's own limits are below it, so that the database lets go first.
pub(super) const APPLY: Duration = Duration::from_secs(20);

/// Of `pg_advisory_lock`: nobody else opens or migrates.
const OPENING: i64 = 0x5047_0000_0000;
/// What the session of a reader asks for.
const READING: [(&str, &str); 2] = [("default_transaction_read_only", "on"), ("statement_timeout", "60s")];
/// What the session of a writer asks for.
const WRITING: [(&str, &str); 1] = [("synchronous_commit", "on")];

/// The station with this number (added) is at work.
const AT_WORK: i64 = 0x5047_0001_0000;

/// Where the database is.
#[derive(Clone)]
pub struct Postgres {
    url: String,
    password: Option<Zeroizing<String>>,
}

impl fmt::Debug for Postgres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Postgres").field("url", &self.url).finish_non_exhaustive()
    }
}

impl Postgres {
    /// A database by its address, e.g. `postgres://ground@db.example/ground`. Without a password here it is looked up
    /// as PostgreSQL's own programs do: `PGPASSWORD`, then the file `PGPASSFILE` or `~/.pgpass`.
    ///
    /// # Errors
    /// What is wrong with the address, as a sentence. It holds no password: that would stand in logs.
    pub fn new(url: &str) -> Result<Self, String> {
        let rest = url
            .strip_prefix("postgres://")
            .or_else(|| url.strip_prefix("postgresql://"))
            .ok_or("it does not begin with postgres://")?;
        let authority = rest.split(['/', '?']).next().unwrap_or_default();
        let user = authority.rsplit_once('@').map_or("", |(user, _)| user);
        if user.contains(':') || rest.split('?').nth(1).is_some_and(|query| query.contains("password=")) {
            return Err("it holds a password, which would stand in logs".into());
        }
        // The parser's own errors may repeat what it was given; there is no secret in it.
        PgConnectOptions::from_str(url).map_err(|error| error.to_string())?;
        Ok(Self { url: url.to_owned(), password: None })
    }

    /// With the password that stands in the first line of this file, which nobody else may read.
    ///
    /// # Errors
    /// [`StoreError`] when it cannot be read, or others may.
    pub fn with_password_file(self, file: &Path) -> Result<Self, StoreError> {
        Ok(Self { password: Some(password::read(file)?), ..self })
    }

    /// The address.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// A connection for whoever looks at the archive beside its servers, and writes nothing.
    pub(super) async fn connect_to_read(&self) -> Result<PgConnection, StoreError> {
        connect(&self.options("gs-server look", &READING)?).await
    }

    /// The same as a pool, which connects when it is asked for something, and no more than once.
    pub(super) fn pool_to_read(&self) -> Result<Pool, StoreError> {
        let pool = PgPoolOptions::new().max_connections(1).acquire_timeout(Duration::from_secs(10));
        Ok(Pool::Pg(pool.connect_lazy_with(self.options("gs-server look", &READING)?)))
    }

    fn options(&self, name: &str, own: &[(&str, &str)]) -> Result<PgConnectOptions, StoreError> {
        let mut options = PgConnectOptions::from_str(&self.url)?.application_name(name);
        if let Some(password) = &self.password {
            options = options.password(password);
        }
        let common = [
            ("statement_timeout", "10s"),
            ("lock_timeout", "5s"),
            ("idle_in_transaction_session_timeout", "15s"),
            // A server whose cable was pulled must not hold its locks for hours.
            ("tcp_keepalives_idle", "10"),
            ("tcp_keepalives_interval", "5"),
            ("tcp_keepalives_count", "3"),
        ];
        Ok(options.options(common).options(own.iter().copied()))
    }
}

/// What the writer knows of the database that it shares.
pub(super) struct Shared {
    options: PgConnectOptions,
    number: i64,
    fence: Fence,
    away: lease::Away,
    /// The last batch of this life that is stored, and the place of its first event.
    last: (i64, i64),
}

impl Shared {
    /// Which server this is.
    pub(super) const fn fence(&self) -> &Fence {
        &self.fence
    }

    /// A new connection, which works as this station alone.
    pub(super) async fn connect(&mut self) -> Result<Connection, StoreError> {
        let mut connection = connect(&self.options).await?;
        be_alone(&mut connection, self.number).await?;
        Ok(Connection::Pg(Box::new(connection)))
    }

    /// Begins a transaction, and waits until nobody else writes. The last numbers given.
    pub(super) async fn begin(&mut self, connection: &mut Connection) -> Result<Heads, StoreError> {
        sql("begin").execute(&mut *connection).await?;
        let row = sql("select event, audit, parameter, route from heads where id = 1 for update")
            .fetch_one(&mut *connection)
            .await?;
        let heads = Heads {
            event: row.try_get("event")?,
            audit: row.try_get("audit")?,
            parameter: row.try_get("parameter")?,
            route: row.try_get("route")?,
        };
        let row = sql("select life, batch, first_event from stations where number = ?")
            .bind(self.number)
            .fetch_one(connection)
            .await?;
        if row.try_get::<String>("life")? != self.fence.life {
            return Err(StoreError::Replaced);
        }
        self.last = (row.try_get("batch")?, row.try_get("first_event")?);
        Ok(heads)
    }

    /// The place of its first event, when this batch is stored already.
    pub(super) fn stored_before(&self, batch: BatchId) -> Option<i64> {
        (u64::try_from(self.last.0) == Ok(batch.0)).then_some(self.last.1)
    }

    /// Notes in the transaction of a batch that it is stored, and tells the other servers at its commit.
    pub(super) async fn note(
        &mut self,
        connection: &mut Connection,
        batch: BatchId,
        first_event: i64,
        events: usize,
    ) -> Result<(), StoreError> {
        sql("update stations set batch = ?, first_event = ? where number = ?")
            .bind(super::convert::int("batch", batch.0)?)
            .bind(first_event)
            .bind(self.number)
            .execute(&mut *connection)
            .await?;
        if events > 0 {
            sql("select 1::bigint from (select pg_notify(?, ?)) as told")
                .bind(listen::CHANNEL)
                .bind(format!("{} {first_event} {events}", self.number))
                .execute(connection)
                .await?;
        }
        Ok(())
    }
}

async fn connect(options: &PgConnectOptions) -> Result<PgConnection, StoreError> {
    match within(CONNECT, PgConnection::connect_with(options)).await {
        Some(connection) => Ok(connection?),
        None => Err(StoreError::away("no connection within 5 s")),
    }
}

/// Only one server works as a station; the lock goes with the connection.
async fn be_alone(connection: &mut PgConnection, number: i64) -> Result<(), StoreError> {
    let alone: bool = sql("select case when pg_try_advisory_lock(?) then 1::bigint else 0::bigint end")
        .bind(AT_WORK + number)
        .scalar(connection)
        .await?;
    if alone { Ok(()) } else { Err(StoreError::StationTaken) }
}

/// Opens the database: the writer, the readers, and the number of the station.
pub(super) async fn open(
    options: &StoreOptions,
    postgres: &Postgres,
) -> Result<(Writer, Pool, i64), StoreError> {
    let writing = postgres.options("gs-server writer", &WRITING)?;
    let mut connection = connect(&writing).await?;
    check_settings(&mut connection).await?;
    // Opening and migrating is done by one server at a time.
    sql("select 1::bigint from (select pg_advisory_lock(?)) as held")
        .bind(OPENING)
        .execute(&mut connection)
        .await?;
    let station = schema::bring_up_to_date(&mut connection, options, Path::new(&postgres.url)).await?;
    let life = uuid::Uuid::new_v4().to_string();
    let mut connection = Connection::Pg(Box::new(connection));
    audit_chain::begin(&mut connection).await?;
    let Connection::Pg(mut connection) = connection else { return Err(StoreError::Replaced) };
    let number = register(&mut connection, &station, &life).await?;
    sql("select 1::bigint from (select pg_advisory_unlock(?)) as free")
        .bind(OPENING)
        .execute(&mut *connection)
        .await?;
    let reading = postgres.options("gs-server reader", &READING)?;
    let readers = PgPoolOptions::new()
        .max_connections(4)
        .acquire_timeout(Duration::from_secs(10))
        .connect_lazy_with(reading);
    let fence = Fence { station: station.to_string(), life };
    let shared = Shared { options: writing, number, fence, away: lease::Away::default(), last: (0, 0) };
    let writer = Writer::new(Connection::Pg(connection), Target::Pg(shared), station).await?;
    Ok((writer, Pool::Pg(readers), number))
}

/// What was acknowledged must be on the disk: settings that give that up are refused or told.
async fn check_settings(connection: &mut PgConnection) -> Result<(), StoreError> {
    let setting = "select current_setting(?)";
    let commit: String = sql(setting).bind("synchronous_commit").scalar(&mut *connection).await?;
    if commit != "on" && commit != "remote_apply" {
        return Err(StoreError::Unsafe { setting: "synchronous_commit", value: commit });
    }
    let fsync: String = sql(setting).bind("fsync").scalar(&mut *connection).await?;
    if fsync != "on" {
        tracing::warn!(
            "the database runs with fsync = {fsync}: what was acknowledged does not survive a power cut"
        );
    }
    Ok(())
}

/// The number of the station: a new one gets the next. This life works as it from now on, and no older one.
async fn register(connection: &mut PgConnection, station: &StationId, life: &str) -> Result<i64, StoreError> {
    sql("begin").execute(&mut *connection).await?;
    sql("select id from heads where id = 1 for update").execute(&mut *connection).await?;
    let found: Option<i64> = sql("select number from stations where name = ?")
        .bind(station.as_str())
        .scalar_optional(&mut *connection)
        .await?;
    let number = match found {
        Some(number) => number,
        None => {
            sql("insert into stations (number, name, life, batch, first_event)
                 select coalesce(max(number), -1) + 1, ?, '', 0, 0 from stations returning number")
            .bind(station.as_str())
            .scalar(&mut *connection)
            .await?
        }
    };
    be_alone(connection, number).await?;
    // What an older life was about to do it does not do any more.
    sql("delete from claims where life = (select life from stations where number = ?)")
        .bind(number)
        .execute(&mut *connection)
        .await?;
    sql("delete from leases where life = (select life from stations where number = ?)")
        .bind(number)
        .execute(&mut *connection)
        .await?;
    sql("update stations set life = ?, batch = 0, first_event = 0 where number = ?")
        .bind(life)
        .bind(number)
        .execute(&mut *connection)
        .await?;
    sql("commit").execute(connection).await?;
    Ok(number)
}
