//! The one writer: a batch is a transaction, and a commit is on the disk when it returns.

use std::collections::HashMap;

use mission::record::{
    AuditRecord, CounterFloorRecord, DownloadRecord, EventRecord, ImageRecord, LimitRecord, PassRecord,
    ReceptionRssi, Record, Route, StageRecord, TelemetryRecord,
};
use mission::{Batch, Stage, StationId};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{AssertSqlSafe, Connection as _, Row as _, SqliteConnection};

use super::audit_chain::{self, AuditHead};
use super::convert::{int, route};
use super::row::{Row, select, upsert};
use super::rows::{
    AuditLinkRow, AuditRow, ChunkRow, CommandRow, ConditionRow, CounterFloorRow, DownloadRow, ElementsRow,
    EventRow, FrameRow, ImageRow, IntentRow, LimitRow, ParameterRow, PassElementsRow, PassRow, PlanRow,
    ReceptionRow, RouteRow, RunRow, SealedRow, StageRow, TelemetryRow,
};
use super::{StoreError, StoredEvent};

/// Rows in one statement: far below SQLite's limit on parameters.
const ROWS_PER_STATEMENT: usize = 500;

/// The writing connection, and what it remembers of the tables.
pub(super) struct Writer {
    connection: Option<SqliteConnection>,
    options: SqliteConnectOptions,
    /// Whose memory this is: for rows whose record does not say it.
    station: StationId,
    memory: Memory,
    /// A transaction was begun and its end is not known, e.g. because whoever waited for it went away.
    unsettled: bool,
    closed: bool,
}

/// What would cost a query each time. Read again whenever a transaction did not end well.
#[derive(Default)]
struct Memory {
    last_event: i64,
    last_audit: i64,
    /// The hash of that row.
    audit_hash: [u8; 32],
    /// Numbers of parameters by satellite and name.
    parameters: HashMap<String, HashMap<String, i64>>,
    last_parameter: i64,
    /// Numbers of routes by satellite, station and link.
    routes: HashMap<[String; 3], i64>,
    last_route: i64,
}

impl Memory {
    async fn read(connection: &mut SqliteConnection) -> Result<Self, StoreError> {
        let mut memory = Self {
            last_event: sqlx::query_scalar("select coalesce(max(seq), 0) from events")
                .fetch_one(&mut *connection)
                .await?,
            last_audit: sqlx::query_scalar("select coalesce(max(id), 0) from audit")
                .fetch_one(&mut *connection)
                .await?,
            audit_hash: audit_chain::newest(connection).await?,
            ..Self::default()
        };
        for row in sqlx::query(select::<RouteRow>("order by id")).fetch_all(&mut *connection).await? {
            let row = RouteRow::read(&row)?;
            memory.last_route = row.id;
            memory.routes.insert([row.satellite, row.station, row.link], row.id);
        }
        for row in sqlx::query(select::<ParameterRow>("order by id")).fetch_all(connection).await? {
            let row = ParameterRow::read(&row)?;
            memory.last_parameter = row.id;
            memory.parameters.entry(row.satellite).or_default().insert(row.name, row.id);
        }
        Ok(memory)
    }
}

impl Writer {
    pub(super) async fn new(
        mut connection: SqliteConnection,
        options: SqliteConnectOptions,
        station: StationId,
    ) -> Result<Self, StoreError> {
        let memory = Memory::read(&mut connection).await?;
        Ok(Self { connection: Some(connection), options, station, memory, unsettled: false, closed: false })
    }

    /// Stores a batch; also where the audit ends then, when the batch added to it.
    pub(super) async fn apply(
        &mut self,
        batch: &Batch,
    ) -> Result<(Vec<StoredEvent>, Option<AuditHead>), StoreError> {
        let before = self.memory.last_audit;
        let mut connection = self.begin().await?;
        let result = self.within(&mut connection).batch(batch).await;
        let events = self.end(connection, result).await?;
        let head = self.audit_head().filter(|head| head.row != before);
        Ok((events, head))
    }

    /// Where the audit ends; `None` when it is empty.
    pub(super) fn audit_head(&self) -> Option<AuditHead> {
        let head = AuditHead { row: self.memory.last_audit, hash: self.memory.audit_hash };
        (head.row > 0).then_some(head)
    }

    /// Begins a transaction on the connection that is handed out. A future that is dropped before [`Self::end`] drops
    /// the connection, and with it the transaction.
    pub(super) async fn begin(&mut self) -> Result<SqliteConnection, StoreError> {
        if self.unsettled {
            self.settle().await;
        }
        let mut connection = match self.connection.take() {
            Some(connection) => connection,
            None => self.reopen().await?,
        };
        self.unsettled = true;
        sqlx::query("begin immediate").execute(&mut connection).await?;
        Ok(connection)
    }

    /// The transaction that [`Self::begin`] opened.
    pub(super) fn within<'a>(&'a mut self, connection: &'a mut SqliteConnection) -> Transaction<'a> {
        Transaction { connection, station: &self.station, memory: &mut self.memory }
    }

    /// Commits what succeeded. When it did not, or the commit fails, nothing of it remains.
    pub(super) async fn end<T>(
        &mut self,
        mut connection: SqliteConnection,
        result: Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        let result = match result {
            Ok(value) => match sqlx::query("commit").execute(&mut connection).await {
                Ok(_) => {
                    self.unsettled = false;
                    self.connection = Some(connection);
                    return Ok(value);
                }
                Err(error) => Err(error.into()),
            },
            Err(error) => Err(error),
        };
        // SQLite may have rolled back by itself; then this fails, and the next transaction opens anew.
        let rolled_back = sqlx::query("rollback").execute(&mut connection).await.is_ok();
        if rolled_back && !matches!(result, Err(StoreError::Io { .. })) {
            self.connection = Some(connection);
        }
        result
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

    async fn reopen(&mut self) -> Result<SqliteConnection, StoreError> {
        if self.closed {
            return Err(StoreError::Database(sqlx::Error::PoolClosed));
        }
        let mut connection = SqliteConnection::connect_with(&self.options).await?;
        self.memory = Memory::read(&mut connection).await?;
        Ok(connection)
    }

    pub(super) async fn set_max_page_count(&mut self, pages: u32) -> Result<(), StoreError> {
        let text = pages.to_string();
        if let Some(connection) = &mut self.connection {
            sqlx::query(AssertSqlSafe(format!("pragma max_page_count = {pages}")))
                .persistent(false)
                .execute(connection)
                .await?;
        }
        self.options = self.options.clone().pragma("max_page_count", text);
        Ok(())
    }

    pub(super) async fn close(&mut self) -> Result<(), StoreError> {
        self.closed = true;
        match self.connection.take() {
            Some(connection) => Ok(connection.close().await?),
            None => Ok(()),
        }
    }
}

/// A transaction that is open.
pub(super) struct Transaction<'a> {
    pub(super) connection: &'a mut SqliteConnection,
    station: &'a StationId,
    memory: &'a mut Memory,
}

impl Transaction<'_> {
    async fn batch(&mut self, batch: &Batch) -> Result<Vec<StoredEvent>, StoreError> {
        let mut events = Vec::new();
        for record in &batch.records {
            events.extend(self.write(record, batch).await?);
        }
        Ok(events)
    }

    async fn write(&mut self, record: &Record, batch: &Batch) -> Result<Option<StoredEvent>, StoreError> {
        match record {
            Record::Frame(frame) => self.frame(&FrameRow::of(frame)?).await?,
            Record::Reception(reception) => self.insert(&ReceptionRow::of(reception)?).await?,
            Record::ReceptionRssi(rssi) => self.set_rssi(rssi).await?,
            Record::Telemetry(telemetry) => self.telemetry(telemetry).await?,
            Record::Command(command) => {
                self.insert(&CommandRow::of(command)?).await?;
                if let Some(condition) = ConditionRow::of(command)? {
                    self.insert(&condition).await?;
                }
            }
            Record::Stage(stage) => self.stage(stage, batch).await?,
            Record::Sealed(sealed) => self.insert(&SealedRow::of(sealed)?).await?,
            Record::CounterFloor(floor) => self.counter_floor(floor).await?,
            Record::Image(image) => self.image(image).await?,
            Record::Chunk(chunk) => self.insert(&ChunkRow::of(chunk)?).await?,
            Record::Download(download) => self.download(download).await?,
            Record::Limit(limit) => self.limit(limit).await?,
            Record::Elements(set) => self.insert(&ElementsRow::of(set)?).await?,
            Record::Pass(pass) => self.pass(pass).await?,
            Record::Plan(plan) => self.upsert("id", &PlanRow::of(plan)?).await?,
            Record::Run(run) => self.upsert("id", &RunRow::of(run)?).await?,
            Record::Event(event) => return self.event(event).await.map(Some),
            Record::Audit(audit) => self.audit(audit).await?,
            Record::Intent(receipt) => self.insert(&IntentRow::of(receipt, self.station)?).await?,
        }
        Ok(None)
    }

    pub(super) async fn insert<R: Row>(&mut self, row: &R) -> Result<(), StoreError> {
        row.bind(sqlx::query(R::INSERT)).execute(&mut *self.connection).await?;
        Ok(())
    }

    pub(super) async fn upsert<R: Row>(&mut self, key: &'static str, row: &R) -> Result<(), StoreError> {
        row.bind(sqlx::query(upsert::<R>(key))).execute(&mut *self.connection).await?;
        Ok(())
    }

    /// A new frame; or one that is there, of which `nested` alone may change.
    async fn frame(&mut self, row: &FrameRow) -> Result<(), StoreError> {
        let insert = AssertSqlSafe(format!("{} on conflict (id) do nothing", FrameRow::INSERT));
        let inserted = row.bind(sqlx::query(insert)).execute(&mut *self.connection).await?;
        if inserted.rows_affected() > 0 {
            return Ok(());
        }
        let found = sqlx::query(select::<FrameRow>("where id = ?"))
            .bind(row.id)
            .fetch_one(&mut *self.connection)
            .await?;
        let found = FrameRow::read(&found)?;
        if found.bytes != row.bytes {
            return Err(StoreError::Conflict(format!("frame {} is there already, with other bytes", row.id)));
        }
        let found = FrameRow { nested: row.nested, ..found };
        sqlx::query("update frames set nested = ?, crc = ? where id = ?")
            .bind(found.nested)
            .bind(found.crc())
            .bind(found.id)
            .execute(&mut *self.connection)
            .await?;
        Ok(())
    }

    async fn set_rssi(&mut self, rssi: &ReceptionRssi) -> Result<(), StoreError> {
        let found = sqlx::query(
            "select id, frame, satellite, station, link, source, received_at_us, rssi_dbm, crc from receptions
             where frame = ? and satellite = ? and station = ? and link = ? and received_at_us = ?
             order by id desc limit 1",
        )
        .bind(int("frame", rssi.frame.0)?)
        .bind(rssi.route.satellite.as_str())
        .bind(rssi.route.station.as_str())
        .bind(rssi.route.link.as_str())
        .bind(rssi.received_at.0)
        .fetch_optional(&mut *self.connection)
        .await?;
        let Some(found) = found else {
            return Err(StoreError::Conflict(format!("frame {} has no such reception", rssi.frame)));
        };
        let id: i64 = found.try_get("id")?;
        let row = ReceptionRow { rssi_dbm: Some(i64::from(rssi.rssi_dbm)), ..ReceptionRow::read(&found)? };
        sqlx::query("update receptions set rssi_dbm = ?, crc = ? where id = ?")
            .bind(row.rssi_dbm)
            .bind(row.crc())
            .bind(id)
            .execute(&mut *self.connection)
            .await?;
        Ok(())
    }

    /// A stage, with the route and the key of its command: out of the same batch, or as it was stored.
    async fn stage(&mut self, record: &StageRecord, batch: &Batch) -> Result<(), StoreError> {
        let beside = batch.records.iter().find_map(|other| match other {
            Record::Command(command) if command.id == record.command => Some(command),
            _ => None,
        });
        let row = match beside {
            Some(command) => StageRow::of(record, &command.route, &command.key.to_string())?,
            None => {
                let found = sqlx::query("select satellite, station, link, key from commands where id = ?")
                    .bind(int("command", record.command.0)?)
                    .fetch_optional(&mut *self.connection)
                    .await?;
                let Some(found) = found else {
                    return Err(StoreError::Conflict(format!("there is no command {}", record.command)));
                };
                let text = |column| found.try_get::<String, _>(column);
                let route = route(&text("satellite")?, &text("station")?, &text("link")?)?;
                StageRow::of(record, &route, &text("key")?)?
            }
        };
        self.insert(&row).await?;
        if record.stage == Stage::Radiating {
            self.responsible(&row).await?;
        }
        Ok(())
    }

    async fn telemetry(&mut self, record: &TelemetryRecord) -> Result<(), StoreError> {
        let Route { satellite, station, link } = &record.route;
        let route = self.route([satellite.as_str(), station.as_str(), link.as_str()]).await?;
        let mut rows = Vec::with_capacity(record.points.len());
        for point in &record.points {
            let parameter =
                self.parameter(record.route.satellite.as_str(), &point.parameter, point.unit).await?;
            rows.push(TelemetryRow {
                parameter,
                at_us: record.at.0,
                frame: int("frame", record.frame.0)?,
                route,
                value: point.value.filter(|value| value.is_finite()),
                decoder_version: i64::from(record.decoder_version),
            });
        }
        self.insert_telemetry(&rows).await
    }

    /// Inserts values; one that is there already is brought up to date.
    pub(super) async fn insert_telemetry(&mut self, rows: &[TelemetryRow]) -> Result<(), StoreError> {
        for rows in rows.chunks(ROWS_PER_STATEMENT) {
            let mut statement = sqlx::QueryBuilder::<sqlx::Sqlite>::new(
                "insert into telemetry (parameter, at_us, frame, route, value, decoder_version, crc) ",
            );
            statement.push_values(rows, |mut values, row| {
                values
                    .push_bind(row.parameter)
                    .push_bind(row.at_us)
                    .push_bind(row.frame)
                    .push_bind(row.route)
                    .push_bind(row.value)
                    .push_bind(row.decoder_version)
                    .push_bind(row.crc());
            });
            statement.push(
                " on conflict (parameter, at_us, frame) do update set route = excluded.route,
                 value = excluded.value, decoder_version = excluded.decoder_version, crc = excluded.crc",
            );
            statement.build().execute(&mut *self.connection).await?;
        }
        Ok(())
    }

    /// The number of a satellite, station and link; a new one gets the next.
    pub(super) async fn route(&mut self, names: [&str; 3]) -> Result<i64, StoreError> {
        let names = names.map(str::to_owned);
        if let Some(id) = self.memory.routes.get(&names) {
            return Ok(*id);
        }
        let id = self.memory.last_route + 1;
        let [satellite, station, link] = names.clone();
        self.insert(&RouteRow { id, satellite, station, link }).await?;
        self.memory.last_route = id;
        self.memory.routes.insert(names, id);
        Ok(id)
    }

    /// The number of a parameter; a new one gets the next.
    pub(super) async fn parameter(
        &mut self,
        satellite: &str,
        name: &str,
        unit: &str,
    ) -> Result<i64, StoreError> {
        if let Some(id) = self.memory.parameters.get(satellite).and_then(|names| names.get(name)) {
            return Ok(*id);
        }
        let id = self.memory.last_parameter + 1;
        let row = ParameterRow { id, satellite: satellite.into(), name: name.into(), unit: unit.into() };
        self.insert(&row).await?;
        self.memory.last_parameter = id;
        self.memory.parameters.entry(row.satellite).or_default().insert(row.name, id);
        Ok(id)
    }

    async fn counter_floor(&mut self, record: &CounterFloorRecord) -> Result<(), StoreError> {
        let row = CounterFloorRow {
            station: self.station.to_string(),
            key: record.key.to_string(),
            counter: int("counter", record.counter.0)?,
            at_us: record.at.0,
            who: record.who.to_string(),
        };
        self.insert(&row).await
    }

    async fn image(&mut self, record: &ImageRecord) -> Result<(), StoreError> {
        self.upsert("id", &ImageRow::of(record)?).await
    }

    async fn download(&mut self, record: &DownloadRecord) -> Result<(), StoreError> {
        self.upsert("id", &DownloadRow::of(record)?).await
    }

    async fn limit(&mut self, record: &LimitRecord) -> Result<(), StoreError> {
        self.upsert("satellite, parameter", &LimitRow::of(record, self.station)).await
    }

    async fn pass(&mut self, record: &PassRecord) -> Result<(), StoreError> {
        self.upsert("id", &PassRow::of(record)?).await?;
        for row in PassElementsRow::of(record)? {
            let insert = AssertSqlSafe(format!("{} on conflict do nothing", PassElementsRow::INSERT));
            row.bind(sqlx::query(insert)).execute(&mut *self.connection).await?;
        }
        Ok(())
    }

    async fn event(&mut self, record: &EventRecord) -> Result<StoredEvent, StoreError> {
        let sequence = self.memory.last_event + 1;
        self.insert(&EventRow::of(sequence, record)?).await?;
        self.memory.last_event = sequence;
        Ok(StoredEvent { sequence, record: record.clone() })
    }

    pub(super) async fn audit(&mut self, record: &AuditRecord) -> Result<(), StoreError> {
        let row = AuditRow {
            id: self.memory.last_audit + 1,
            station: self.station.to_string(),
            at_us: record.at.0,
            who: record.who.to_string(),
            action: record.action.into(),
            detail: record.detail.clone(),
        };
        let hash = audit_chain::link(&self.memory.audit_hash, &row);
        self.insert(&row).await?;
        self.insert(&AuditLinkRow { audit: row.id, hash: hash.to_vec() }).await?;
        self.memory.last_audit = row.id;
        self.memory.audit_hash = hash;
        Ok(())
    }
}
