//! The one writer of this server: a batch is a transaction, and a commit is on the disk when it returns.

mod transaction;

use std::collections::HashMap;

use mission::record::Record;
use mission::{Batch, StationId};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{AssertSqlSafe, Connection as _, SqliteConnection};

use super::audit_chain::{self, AuditHead};
use super::db::{Connection, sql};
use super::pg::{Fence, Shared};
use super::row::{Row as _, select};
use super::rows::{EventRow, ParameterRow, RouteRow};
use super::{StoreError, StoredEvent};

pub(super) use transaction::Transaction;

/// Which database, and how to get to it again.
pub(super) enum Target {
    Lite(SqliteConnectOptions),
    Pg(Shared),
}

/// The writing connection, and what it remembers of the tables.
pub(super) struct Writer {
    connection: Option<Connection>,
    target: Target,
    /// Whose memory this is: for rows whose record does not say it.
    station: StationId,
    memory: Memory,
    /// The last numbers when the transaction began.
    began: Heads,
    /// A transaction was begun and its end is not known, e.g. because whoever waited for it went away.
    unsettled: bool,
    closed: bool,
}

/// The last numbers given in tables that number over all stations.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Heads {
    pub(super) event: i64,
    pub(super) audit: i64,
    pub(super) parameter: i64,
    pub(super) route: i64,
}

/// What would cost a query each time. Read again whenever a transaction did not end well, or another server wrote.
#[derive(Default)]
pub(super) struct Memory {
    heads: Heads,
    /// The hash of the last row of the audit.
    audit_hash: [u8; 32],
    /// Numbers of parameters by satellite and name.
    parameters: HashMap<String, HashMap<String, i64>>,
    /// Numbers of routes by satellite, station and link.
    routes: HashMap<[String; 3], i64>,
}

impl Memory {
    async fn read(connection: &mut Connection) -> Result<Self, StoreError> {
        let row = sql("select (select coalesce(max(seq), 0) from events) as event,
                              (select coalesce(max(id), 0) from audit) as audit")
        .fetch_one(&mut *connection)
        .await?;
        let heads = Heads { event: row.try_get("event")?, audit: row.try_get("audit")?, ..Heads::default() };
        let audit_hash = audit_chain::newest(connection).await?;
        let mut memory = Self { heads, audit_hash, ..Self::default() };
        memory.read_numbers(connection).await?;
        Ok(memory)
    }

    async fn read_numbers(&mut self, connection: &mut Connection) -> Result<(), StoreError> {
        self.routes.clear();
        self.parameters.clear();
        (self.heads.route, self.heads.parameter) = (0, 0);
        for row in sql(select::<RouteRow>("order by id")).fetch_all(&mut *connection).await? {
            let row = RouteRow::read(&row)?;
            self.heads.route = row.id;
            self.routes.insert([row.satellite, row.station, row.link], row.id);
        }
        for row in sql(select::<ParameterRow>("order by id")).fetch_all(connection).await? {
            let row = ParameterRow::read(&row)?;
            self.heads.parameter = row.id;
            self.parameters.entry(row.satellite).or_default().insert(row.name, row.id);
        }
        Ok(())
    }
}

impl Writer {
    pub(super) async fn new(
        mut connection: Connection,
        target: Target,
        station: StationId,
    ) -> Result<Self, StoreError> {
        let memory = Memory::read(&mut connection).await?;
        Ok(Self {
            connection: Some(connection),
            target,
            station,
            began: memory.heads,
            memory,
            unsettled: false,
            closed: false,
        })
    }

    /// Whether the database is elsewhere, and an answer may never come.
    pub(super) fn is_shared(&self) -> bool {
        matches!(self.target, Target::Pg(_))
    }

    /// Which server this is, among those that share the database.
    pub(super) fn fence(&self) -> Option<Fence> {
        match &self.target {
            Target::Lite(_) => None,
            Target::Pg(shared) => Some(shared.fence().clone()),
        }
    }

    /// What is known of the database that several servers share; `None` when it is ours alone.
    pub(super) fn shared(&mut self) -> Option<&mut Shared> {
        match &mut self.target {
            Target::Lite(_) => None,
            Target::Pg(shared) => Some(shared),
        }
    }

    /// Stores a batch; also where the audit ends then, when the batch added to it.
    pub(super) async fn apply(
        &mut self,
        batch: &Batch,
    ) -> Result<(Vec<StoredEvent>, Option<AuditHead>), StoreError> {
        let mut connection = self.begin().await?;
        let before = self.memory.heads.audit;
        let result = self.batch(&mut connection, batch).await;
        let events = self.end(connection, result).await?;
        let head = self.audit_head().filter(|head| head.row != before);
        Ok((events, head))
    }

    /// Where the audit ends; `None` when it is empty.
    pub(super) fn audit_head(&self) -> Option<AuditHead> {
        let head = AuditHead { row: self.memory.heads.audit, hash: self.memory.audit_hash };
        (head.row > 0).then_some(head)
    }

    async fn batch(
        &mut self,
        connection: &mut Connection,
        batch: &Batch,
    ) -> Result<Vec<StoredEvent>, StoreError> {
        let Target::Pg(shared) = &mut self.target else {
            return self.within(connection).batch(batch).await;
        };
        if let Some(first) = shared.stored_before(batch.id) {
            return stored_events(connection, batch, first).await;
        }
        let first = self.memory.heads.event + 1;
        let events = self.within(connection).batch(batch).await?;
        if let Target::Pg(shared) = &mut self.target {
            shared.note(connection, batch.id, first, events.len()).await?;
        }
        Ok(events)
    }

    /// Begins a transaction on the connection that is handed out. A future that is dropped before [`Self::end`] drops
    /// the connection, and with it the transaction.
    pub(super) async fn begin(&mut self) -> Result<Connection, StoreError> {
        if self.unsettled {
            self.settle().await;
        }
        let mut connection = match self.connection.take() {
            Some(connection) => connection,
            None => self.reopen().await?,
        };
        self.unsettled = true;
        if let Target::Pg(shared) = &mut self.target {
            let heads = shared.begin(&mut connection).await?;
            let known = self.memory.heads;
            if (heads.parameter, heads.route) != (known.parameter, known.route) {
                self.memory.read_numbers(&mut connection).await?;
            }
            if heads.audit != known.audit {
                self.memory.audit_hash = audit_chain::newest(&mut connection).await?;
            }
            self.memory.heads = heads;
        } else {
            sql("begin immediate").execute(&mut connection).await?;
        }
        self.began = self.memory.heads;
        Ok(connection)
    }

    /// The transaction that [`Self::begin`] opened.
    pub(super) fn within<'a>(&'a mut self, connection: &'a mut Connection) -> Transaction<'a> {
        let fence = match &self.target {
            Target::Lite(_) => None,
            Target::Pg(shared) => Some(shared.fence()),
        };
        Transaction { connection, station: &self.station, memory: &mut self.memory, fence }
    }

    /// Commits what succeeded. When it did not, or the commit fails, nothing of it remains; with a database that went
    /// away in the middle nobody knows, and the same batch is recognised when it comes again.
    pub(super) async fn end<T>(
        &mut self,
        mut connection: Connection,
        result: Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        let result = match result {
            Ok(value) => match self.commit(&mut connection).await {
                Ok(()) => {
                    self.unsettled = false;
                    self.connection = Some(connection);
                    return Ok(value);
                }
                Err(error) => Err(error),
            },
            Err(error) => Err(error),
        };
        // The database may have rolled back by itself; then this fails, and the next transaction opens anew.
        let rolled_back = sql("rollback").execute(&mut connection).await.is_ok();
        if rolled_back && !matches!(result, Err(StoreError::Io { .. } | StoreError::Away { .. })) {
            self.connection = Some(connection);
        }
        result
    }

    async fn commit(&mut self, connection: &mut Connection) -> Result<(), StoreError> {
        if self.is_shared() && self.memory.heads != self.began {
            let Heads { event, audit, parameter, route } = self.memory.heads;
            sql("update heads set event = ?, audit = ?, parameter = ?, route = ? where id = 1")
                .bind(event)
                .bind(audit)
                .bind(parameter)
                .bind(route)
                .execute(&mut *connection)
                .await?;
        }
        sql("commit").execute(connection).await?;
        Ok(())
    }

    /// After a transaction whose end nobody saw, or which failed: what we remember may be wrong.
    async fn settle(&mut self) {
        if let Some(connection) = &mut self.connection {
            match Memory::read(connection).await {
                Ok(memory) => {
                    self.memory = memory;
                    self.unsettled = false;
                }
                Err(_) => self.connection = None,
            }
        }
    }

    async fn reopen(&mut self) -> Result<Connection, StoreError> {
        if self.closed {
            return Err(StoreError::Database(sqlx::Error::PoolClosed));
        }
        let mut connection = match &mut self.target {
            Target::Lite(options) => Connection::Lite(SqliteConnection::connect_with(options).await?),
            Target::Pg(shared) => shared.connect().await?,
        };
        self.memory = Memory::read(&mut connection).await?;
        Ok(connection)
    }

    /// Limits the size of a file; a database elsewhere has limits of its own.
    pub(super) async fn set_max_page_count(&mut self, pages: u32) -> Result<(), StoreError> {
        let Target::Lite(options) = &mut self.target else { return Ok(()) };
        if let Some(Connection::Lite(connection)) = &mut self.connection {
            sqlx::query(AssertSqlSafe(format!("pragma max_page_count = {pages}")))
                .persistent(false)
                .execute(connection)
                .await?;
        }
        *options = options.clone().pragma("max_page_count", pages.to_string());
        Ok(())
    }

    /// More memory, and a log of 256 MB before it is moved into the file: a page that was written again and again
    /// meanwhile is moved once.
    pub(super) async fn make_room(&mut self) -> Result<(), StoreError> {
        let Target::Lite(options) = &mut self.target else { return Ok(()) };
        let settings = [("cache_size", "-65536"), ("wal_autocheckpoint", "65536")];
        for (name, value) in settings {
            if let Some(Connection::Lite(connection)) = &mut self.connection {
                sqlx::query(AssertSqlSafe(format!("pragma {name} = {value}")))
                    .persistent(false)
                    .execute(connection)
                    .await?;
            }
            *options = options.clone().pragma(name, value);
        }
        Ok(())
    }

    pub(super) async fn close(&mut self) -> Result<(), StoreError> {
        self.closed = true;
        match self.connection.take() {
            Some(connection) => connection.close().await,
            None => Ok(()),
        }
    }
}

/// The events of a batch that had been stored although nobody was told.
async fn stored_events(
    connection: &mut Connection,
    batch: &Batch,
    first: i64,
) -> Result<Vec<StoredEvent>, StoreError> {
    let count = batch.records.iter().filter(|record| matches!(record, Record::Event(_))).count();
    let rows = sql(select::<EventRow>("where seq >= ? order by seq limit ?"))
        .bind(first)
        .bind(i64::try_from(count).unwrap_or(i64::MAX))
        .fetch_all(connection)
        .await?;
    rows.iter()
        .map(|row| {
            let row = EventRow::read(row)?;
            Ok(StoredEvent { sequence: row.seq, record: row.record()? })
        })
        .collect()
}
