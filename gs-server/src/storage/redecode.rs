//! Derived rows, made again from the raw frames: after the rules have changed, or to see that nothing has.

use std::collections::BTreeMap;

use futures_util::TryStreamExt as _;
use mission::record::DECODER_VERSION;
use protocol::DownFrame;

use super::db::sql;
use super::row::{Row, select};
use super::rows::{
    AuditLinkRow, AuditRow, ChunkRow, CommandRow, ConditionRow, CounterFloorRow, DownloadRow, ElementsRow,
    EventRow, FrameRow, ImageRow, IntentRow, LimitRow, ParameterRow, PassElementsRow, PassRow, PlanRow,
    ReceptionRow, RouteRow, RunRow, SealedRow, StageRow, TelemetryRow,
};
use super::write::Transaction;
use super::{AlertRow, DeliveryRow, OutsideRow, Store, StoreError};
use mission::reception::{ELSEWHERE, UNDATED};

/// Frames in one transaction: some thousand rows, some ten milliseconds.
const FRAMES_PER_STEP: i64 = 200;

/// Findings that are told one by one.
const FINDINGS_TOLD: usize = 100;

/// How far it has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RedecodeProgress {
    /// The last frame that was done.
    pub frame: i64,
    /// The last frame there is.
    pub last_frame: i64,
}

/// What was found and done.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RedecodeReport {
    /// Frames read in this call.
    pub frames: u64,
    /// Frames that give no packet (header or payload makes no sense, or they lie inside another frame).
    pub without_packet: u64,
    /// Values that stood there already as they should.
    pub unchanged: u64,
    /// Values that were not there.
    pub added: u64,
    /// Values that were different, of another decoder version, or damaged.
    pub changed: u64,
    /// Values that no frame gives (any more).
    pub removed: u64,
    /// Rows that are not what was written, over all tables; damaged values among them were made again.
    pub damaged: u64,
    /// What they are, at most 100.
    pub findings: Vec<String>,
}

impl RedecodeReport {
    fn found(&mut self, finding: &StoreError) {
        self.damaged += 1;
        if self.findings.len() < FINDINGS_TOLD {
            self.findings.push(finding.to_string());
        }
    }
}

pub(super) async fn redecode(
    store: &Store,
    mut progress: impl FnMut(RedecodeProgress) + Send,
) -> Result<RedecodeReport, StoreError> {
    let mut report = RedecodeReport::default();
    let last_frame: i64 = sql("select coalesce(max(id), 0) from frames").scalar(&store.0.readers).await?;
    loop {
        let mut writer = store.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let result = step(&mut writer.within(&mut connection), &mut report).await;
        let done = writer.end(connection, result).await?;
        drop(writer);
        match done {
            Some(frame) => progress(RedecodeProgress { frame, last_frame }),
            None => break,
        }
    }
    verify_the_rest(store, &mut report).await?;
    Ok(report)
}

/// The next frames; the id of the last, or `None` when all are done.
async fn step(
    transaction: &mut Transaction<'_>,
    report: &mut RedecodeReport,
) -> Result<Option<i64>, StoreError> {
    let version = i64::from(DECODER_VERSION);
    sql("delete from redecode where decoder_version <> ?")
        .bind(version)
        .execute(&mut *transaction.connection)
        .await?;
    let from: Option<i64> = sql("select last_frame from redecode where decoder_version = ?")
        .bind(version)
        .scalar_optional(&mut *transaction.connection)
        .await?;
    let rows = sql(select::<FrameRow>("where id > ? order by id limit ?"))
        .bind(from.unwrap_or(0))
        .bind(FRAMES_PER_STEP)
        .fetch_all(&mut *transaction.connection)
        .await?;
    let Some(last) = rows.last() else {
        finish(transaction, report).await?;
        return Ok(None);
    };
    let last: i64 = last.try_get("id")?;
    for row in &rows {
        report.frames += 1;
        match FrameRow::read(row) {
            Ok(frame) => remake(transaction, &frame, report).await?,
            Err(error @ StoreError::Damaged { .. }) => report.found(&error),
            Err(error) => return Err(error),
        }
    }
    sql("insert into redecode (decoder_version, last_frame) values (?, ?)
         on conflict (decoder_version) do update set last_frame = excluded.last_frame")
    .bind(version)
    .bind(last)
    .execute(&mut *transaction.connection)
    .await?;
    Ok(Some(last))
}

/// The values of one frame.
async fn remake(
    transaction: &mut Transaction<'_>,
    frame: &FrameRow,
    report: &mut RedecodeReport,
) -> Result<(), StoreError> {
    let parsed = DownFrame::parse(&frame.bytes);
    if parsed.is_err() {
        report.found(&StoreError::damaged(format!("frame {} is no frame: its checksum is wrong", frame.id)));
    }
    let at_us = time_of(transaction, frame).await?;
    let counts = !frame.nested && at_us.is_some();
    let at_us = at_us.unwrap_or(frame.heard_at_us);
    let packet = parsed.ok().filter(|_| counts).and_then(|parsed| parsed.packet().ok());
    report.without_packet += u64::from(packet.is_none());

    let mut wanted = BTreeMap::new();
    let route = match packet {
        Some(_) => transaction.route([&frame.satellite, &frame.station, &frame.link]).await?,
        None => 0,
    };
    for point in packet.iter().flat_map(mission::telemetry::points) {
        let parameter = transaction.parameter(&frame.satellite, &point.parameter, point.unit).await?;
        let row = TelemetryRow {
            parameter,
            at_us,
            frame: frame.id,
            route,
            value: point.value,
            decoder_version: i64::from(DECODER_VERSION),
        };
        wanted.insert(parameter, row);
    }

    let present = sql(select::<TelemetryRow>(
        "where parameter in (select id from parameters where satellite = ?) and at_us = ? and frame = ?",
    ))
    .bind(&frame.satellite)
    .bind(at_us)
    .bind(frame.id)
    .fetch_all(&mut *transaction.connection)
    .await?;
    let mut changed = 0;
    for row in &present {
        let parameter: i64 = row.try_get("parameter")?;
        let read = match TelemetryRow::read(row) {
            Ok(read) => Some(read),
            Err(error @ StoreError::Damaged { .. }) => {
                report.found(&error);
                None
            }
            Err(error) => return Err(error),
        };
        match wanted.get(&parameter) {
            Some(row) if Some(row) == read.as_ref() => {
                report.unchanged += 1;
                wanted.remove(&parameter);
            }
            Some(_) => changed += 1,
            None => {
                report.removed += 1;
                sql("delete from telemetry where parameter = ? and at_us = ? and frame = ?")
                    .bind(parameter)
                    .bind(at_us)
                    .bind(frame.id)
                    .execute(&mut *transaction.connection)
                    .await?;
            }
        }
    }
    report.added += wanted.len() as u64 - changed;
    report.changed += changed;
    let rows: Vec<TelemetryRow> = wanted.into_values().collect();
    transaction.insert_telemetry(rows).await
}

/// When the values of a frame were heard. A frame that came without a time has values once somebody reports it with one.
async fn time_of(transaction: &mut Transaction<'_>, frame: &FrameRow) -> Result<Option<i64>, StoreError> {
    if frame.station != ELSEWHERE || frame.link != UNDATED {
        return Ok(Some(frame.heard_at_us));
    }
    super::ears::told_us(frame.id, &mut *transaction.connection).await
}

/// Values that belong to no frame, or to another time than their frame.
async fn finish(transaction: &mut Transaction<'_>, report: &mut RedecodeReport) -> Result<(), StoreError> {
    let orphans = sql("delete from telemetry where not exists (
           select 1 from frames where frames.id = telemetry.frame
             and (frames.heard_at_us = telemetry.at_us or frames.link = 'undated'))")
    .execute(&mut *transaction.connection)
    .await?;
    report.removed += orphans;
    sql("delete from redecode").execute(&mut *transaction.connection).await?;
    Ok(())
}

/// Reads every row of the tables that cannot be made again.
async fn verify_the_rest(store: &Store, report: &mut RedecodeReport) -> Result<(), StoreError> {
    verify::<ReceptionRow>(store, report).await?;
    verify::<OutsideRow>(store, report).await?;
    verify::<ParameterRow>(store, report).await?;
    verify::<RouteRow>(store, report).await?;
    verify::<CommandRow>(store, report).await?;
    verify::<StageRow>(store, report).await?;
    verify::<SealedRow>(store, report).await?;
    verify::<CounterFloorRow>(store, report).await?;
    verify::<ImageRow>(store, report).await?;
    verify::<ChunkRow>(store, report).await?;
    verify::<DownloadRow>(store, report).await?;
    verify::<LimitRow>(store, report).await?;
    verify::<ElementsRow>(store, report).await?;
    verify::<PassRow>(store, report).await?;
    verify::<PassElementsRow>(store, report).await?;
    verify::<PlanRow>(store, report).await?;
    verify::<RunRow>(store, report).await?;
    verify::<ConditionRow>(store, report).await?;
    verify::<EventRow>(store, report).await?;
    verify::<AuditRow>(store, report).await?;
    verify::<AuditLinkRow>(store, report).await?;
    verify::<AlertRow>(store, report).await?;
    verify::<DeliveryRow>(store, report).await?;
    verify::<IntentRow>(store, report).await
}

async fn verify<R: Row>(store: &Store, report: &mut RedecodeReport) -> Result<(), StoreError> {
    let mut rows = sql(R::SELECT).fetch(&store.0.readers);
    while let Some(row) = rows.try_next().await? {
        match R::read(&row) {
            Ok(_) => {}
            Err(error @ StoreError::Damaged { .. }) => report.found(&error),
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
