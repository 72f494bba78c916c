//! Records on their way into rows, within one transaction.

use std::collections::HashSet;

use mission::reception::ELSEWHERE;
use mission::record::{
    AuditRecord, CounterFloorRecord, DownloadRecord, EventRecord, ImageRecord, LimitRecord, PassRecord,
    ReceptionRssi, Record, Route, StageRecord, TelemetryRecord,
};
use mission::{Batch, Stage, StationId};
use sqlx::AssertSqlSafe;

use super::Memory;
use crate::storage::convert::{int, route};
use crate::storage::db::{Connection, insert_rows, sql};
use crate::storage::pg::Fence;
use crate::storage::row::{Row, select, upsert};
use crate::storage::rows::{
    AuditLinkRow, AuditRow, ChunkRow, CommandRow, ConditionRow, CounterFloorRow, DownloadRow, ElementsRow,
    EventRow, FrameRow, ImageRow, IntentRow, LimitRow, ParameterRow, PassElementsRow, PassRow, PlanRow,
    ReceptionRow, RouteRow, RunRow, SealedRow, StageRow, TelemetryRow,
};
use crate::storage::{StoreError, StoredEvent};
use crate::storage::{audit_chain, ears};

/// A transaction that is open.
pub(in crate::storage) struct Transaction<'a> {
    pub(in crate::storage) connection: &'a mut Connection,
    pub(in crate::storage) station: &'a StationId,
    pub(super) memory: &'a mut Memory,
    /// Which server this is, when several share the database.
    pub(super) fence: Option<&'a Fence>,
}

impl Transaction<'_> {
    pub(in crate::storage) async fn batch(&mut self, batch: &Batch) -> Result<Vec<StoredEvent>, StoreError> {
        let mut events = Vec::new();
        // What others heard comes by the thousand: in few statements, at the end (references are checked at the commit).
        let (mut frames, mut reports, mut values) = (Vec::new(), Vec::new(), Vec::new());
        // Values of one frame twice may not stand in one statement.
        let mut valued = HashSet::new();
        for record in &batch.records {
            match record {
                Record::Outside(report) => reports.push(report.as_ref()),
                Record::Frame(frame) if frame.route.station.as_str() == ELSEWHERE => frames.push(frame),
                Record::Telemetry(telemetry)
                    if telemetry.route.station.as_str() == ELSEWHERE && valued.insert(telemetry.frame) =>
                {
                    values.extend(self.values(telemetry).await?);
                }
                _ => events.extend(self.write(record, batch).await?),
            }
        }
        ears::insert(self.connection, &frames, &reports).await?;
        self.insert_telemetry(values).await?;
        Ok(events)
    }

    async fn write(&mut self, record: &Record, batch: &Batch) -> Result<Option<StoredEvent>, StoreError> {
        match record {
            Record::Frame(frame) => self.frame(&FrameRow::of(frame)?).await?,
            Record::Outside(report) => ears::insert(self.connection, &[], &[report]).await?,
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
            Record::Sealed(sealed) => {
                let row = SealedRow::of(sealed)?;
                self.hold(&row.key).await?;
                self.insert(&row).await?;
            }
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
            Record::Intent(receipt) => {
                let row = IntentRow::of(receipt, self.station)?;
                self.insert(&row).await?;
                self.unclaim(&row).await?;
            }
        }
        Ok(None)
    }

    /// Only the server that holds the lease of the key goes on.
    async fn hold(&mut self, key: &str) -> Result<(), StoreError> {
        if let Some(fence) = self.fence {
            fence.hold(self.connection, key).await?;
        }
        Ok(())
    }

    /// The intent is stored: its claim has done its work.
    async fn unclaim(&mut self, row: &IntentRow) -> Result<(), StoreError> {
        if self.fence.is_some() {
            sql("delete from claims where principal = ? and idempotency_key = ?")
                .bind(&row.principal)
                .bind(&row.idempotency_key)
                .execute(&mut *self.connection)
                .await?;
        }
        Ok(())
    }

    pub(in crate::storage) async fn insert<R: Row>(&mut self, row: &R) -> Result<(), StoreError> {
        row.bind(sql(R::INSERT)).execute(&mut *self.connection).await?;
        Ok(())
    }

    pub(in crate::storage) async fn upsert<R: Row>(
        &mut self,
        key: &'static str,
        row: &R,
    ) -> Result<(), StoreError> {
        row.bind(sql(upsert::<R>(key))).execute(&mut *self.connection).await?;
        Ok(())
    }

    /// A new frame; or one that is there, of which `nested` alone may change.
    async fn frame(&mut self, row: &FrameRow) -> Result<(), StoreError> {
        let insert = AssertSqlSafe(format!("{} on conflict (id) do nothing", FrameRow::INSERT));
        let inserted = row.bind(sql(insert)).execute(&mut *self.connection).await?;
        if inserted > 0 {
            return Ok(());
        }
        let found =
            sql(select::<FrameRow>("where id = ?")).bind(row.id).fetch_one(&mut *self.connection).await?;
        let found = FrameRow::read(&found)?;
        if found.bytes != row.bytes {
            return Err(StoreError::Conflict(format!("frame {} is there already, with other bytes", row.id)));
        }
        let found = FrameRow { nested: row.nested, ..found };
        sql("update frames set nested = ?, crc = ? where id = ?")
            .bind(found.nested)
            .bind(found.crc())
            .bind(found.id)
            .execute(&mut *self.connection)
            .await?;
        Ok(())
    }

    async fn set_rssi(&mut self, rssi: &ReceptionRssi) -> Result<(), StoreError> {
        let found = sql(
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
        sql("update receptions set rssi_dbm = ?, crc = ? where id = ?")
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
                let found = sql("select satellite, station, link, key from commands where id = ?")
                    .bind(int("command", record.command.0)?)
                    .fetch_optional(&mut *self.connection)
                    .await?;
                let Some(found) = found else {
                    return Err(StoreError::Conflict(format!("there is no command {}", record.command)));
                };
                let text = |column| found.try_get::<String>(column);
                let route = route(&text("satellite")?, &text("station")?, &text("link")?)?;
                StageRow::of(record, &route, &text("key")?)?
            }
        };
        // What is marked `radiating` goes on the air as soon as this is committed.
        if record.stage == Stage::Radiating {
            self.hold(&row.key).await?;
        }
        self.insert(&row).await?;
        if record.stage == Stage::Radiating {
            self.responsible(&row).await?;
        }
        Ok(())
    }

    async fn telemetry(&mut self, record: &TelemetryRecord) -> Result<(), StoreError> {
        let rows = self.values(record).await?;
        self.insert_telemetry(rows).await
    }

    async fn values(&mut self, record: &TelemetryRecord) -> Result<Vec<TelemetryRow>, StoreError> {
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
        Ok(rows)
    }

    /// Inserts values; one that is there already is brought up to date.
    pub(in crate::storage) async fn insert_telemetry(
        &mut self,
        rows: Vec<TelemetryRow>,
    ) -> Result<(), StoreError> {
        let tail = " on conflict (parameter, at_us, frame) do update set route = excluded.route,
             value = excluded.value, decoder_version = excluded.decoder_version, crc = excluded.crc";
        insert_rows(self.connection, rows.into_iter().map(Ok), tail).await
    }

    /// The number of a satellite, station and link; a new one gets the next.
    pub(in crate::storage) async fn route(&mut self, names: [&str; 3]) -> Result<i64, StoreError> {
        let names = names.map(str::to_owned);
        if let Some(id) = self.memory.routes.get(&names) {
            return Ok(*id);
        }
        let id = self.memory.heads.route + 1;
        let [satellite, station, link] = names.clone();
        self.insert(&RouteRow { id, satellite, station, link }).await?;
        self.memory.heads.route = id;
        self.memory.routes.insert(names, id);
        Ok(id)
    }

    /// The number of a parameter; a new one gets the next.
    pub(in crate::storage) async fn parameter(
        &mut self,
        satellite: &str,
        name: &str,
        unit: &str,
    ) -> Result<i64, StoreError> {
        if let Some(id) = self.memory.parameters.get(satellite).and_then(|names| names.get(name)) {
            return Ok(*id);
        }
        let id = self.memory.heads.parameter + 1;
        let row = ParameterRow { id, satellite: satellite.into(), name: name.into(), unit: unit.into() };
        self.insert(&row).await?;
        self.memory.heads.parameter = id;
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
            row.bind(sql(insert)).execute(&mut *self.connection).await?;
        }
        Ok(())
    }

    async fn event(&mut self, record: &EventRecord) -> Result<StoredEvent, StoreError> {
        let sequence = self.memory.heads.event + 1;
        self.insert(&EventRow::of(sequence, record)?).await?;
        self.memory.heads.event = sequence;
        Ok(StoredEvent { sequence, record: record.clone() })
    }

    pub(in crate::storage) async fn audit(&mut self, record: &AuditRecord) -> Result<(), StoreError> {
        let row = AuditRow {
            id: self.memory.heads.audit + 1,
            station: self.station.to_string(),
            at_us: record.at.0,
            who: record.who.to_string(),
            action: record.action.into(),
            detail: record.detail.clone(),
        };
        let hash = audit_chain::link(&self.memory.audit_hash, &row);
        self.insert(&row).await?;
        self.insert(&AuditLinkRow { audit: row.id, hash: hash.to_vec() }).await?;
        self.memory.heads.audit = row.id;
        self.memory.audit_hash = hash;
        Ok(())
    }
}
