//! What a restart goes on from, read in one transaction.

use std::sync::Arc;

use mission::record::{CommandRecord, PassRecord};
use mission::run::{PlanRecord, RunRecord};
use mission::sky::SETS_KEPT;
use mission::snapshot::{
    CommandSnapshot, ImageSnapshot, KeySnapshot, LastIds, SatelliteSnapshot, SealedSnapshot, Snapshot,
    Witness,
};
use mission::{ElementSet, FrameId, SatelliteId, Stage, UtcUs};
use protocol::{Counter, DownFrame, Downlink, KeyId, RequestTag, down_type};
use sqlx::{Row as _, SqliteConnection};

use super::convert::{exactly, int, narrow, parse};
use super::row::{Row as _, select};
use super::rows::{
    ChunkRow, CommandRow, ConditionRow, DownloadRow, ElementsRow, FrameRow, ImageRow, LimitRow,
    PassElementsRow, PassRow, PlanRow, RunRow, SealedRow, StageRow,
};
use super::{Store, StoreError, off_the_loop};

/// A command that is `unknown` may still be settled by telemetry for so long.
const UNKNOWN_KEPT_US: i64 = 24 * 3600 * 1_000_000;

/// So many heartbeats are tried, newest first, until one makes sense.
const HEARTBEATS_TRIED: i64 = 16;

pub(super) async fn snapshot(
    store: &Store,
    satellites: &[SatelliteId],
    keys: &[KeyId],
) -> Result<Snapshot, StoreError> {
    let mut transaction = store.0.readers.begin().await?;
    let connection = &mut *transaction;
    let mut snapshot = Snapshot { last_ids: last_ids(connection).await?, ..Snapshot::default() };
    for satellite in satellites {
        let left = of_satellite(connection, satellite).await?;
        if !is_empty(&left) {
            snapshot.satellites.push(left);
        }
    }
    snapshot.plans = plans(connection).await?;
    snapshot.runs = runs(connection).await?;
    let folder = store.0.witness.clone();
    let asked = keys.to_vec();
    let witnesses: Vec<Witness> =
        off_the_loop(move || asked.into_iter().map(|key| folder.read(key)).collect()).await?;
    for (key, witness) in keys.iter().zip(witnesses) {
        snapshot.keys.push(KeySnapshot { key: *key, counter: counter(connection, *key).await?, witness });
    }
    Ok(snapshot)
}

fn is_empty(left: &SatelliteSnapshot) -> bool {
    left.last_tag.is_none()
        && left.commands.is_empty()
        && left.image.is_none()
        && left.downloads.is_empty()
        && left.limits.is_empty()
        && left.heartbeat.is_none()
        && left.elements.is_empty()
        && left.pass.is_none()
}

async fn last_ids(connection: &mut SqliteConnection) -> Result<LastIds, StoreError> {
    let row = sqlx::query(
        "select (select coalesce(max(id), 0) from frames) as frame,
                (select coalesce(max(id), 0) from commands) as command,
                (select coalesce(max(id), 0) from images) as image,
                (select coalesce(max(id), 0) from downloads) as download,
                (select coalesce(max(id), 0) from elements) as elements,
                (select coalesce(max(id), 0) from passes) as pass,
                (select coalesce(max(id), 0) from plans) as plan,
                (select coalesce(max(id), 0) from plan_runs) as run",
    )
    .fetch_one(connection)
    .await?;
    Ok(LastIds {
        frame: narrow("frames.id", row.try_get("frame")?)?,
        command: narrow("commands.id", row.try_get("command")?)?,
        image: narrow("images.id", row.try_get("image")?)?,
        download: narrow("downloads.id", row.try_get("download")?)?,
        elements: narrow("elements.id", row.try_get("elements")?)?,
        pass: narrow("passes.id", row.try_get("pass")?)?,
        plan: narrow("plans.id", row.try_get("plan")?)?,
        run: narrow("plan_runs.id", row.try_get("run")?)?,
    })
}

async fn of_satellite(
    connection: &mut SqliteConnection,
    satellite: &SatelliteId,
) -> Result<SatelliteSnapshot, StoreError> {
    Ok(SatelliteSnapshot {
        satellite: satellite.clone(),
        last_tag: last_tag(connection, satellite).await?,
        commands: commands(connection, satellite).await?,
        image: image(connection, satellite).await?,
        downloads: {
            let rows =
                sqlx::query(select::<DownloadRow>("where satellite = ? and state = 'active' order by id"))
                    .bind(satellite.as_str())
                    .fetch_all(&mut *connection)
                    .await?;
            rows.iter().map(|row| DownloadRow::read(row)?.record()).collect::<Result<_, _>>()?
        },
        limits: {
            let rows = sqlx::query(select::<LimitRow>(
                "where satellite = ? and level <> 'normal' order by parameter",
            ))
            .bind(satellite.as_str())
            .fetch_all(&mut *connection)
            .await?;
            rows.iter().map(|row| LimitRow::read(row)?.record()).collect::<Result<_, _>>()?
        },
        heartbeat: heartbeat(connection, satellite).await?,
        elements: elements(connection, satellite).await?,
        pass: pass(connection, satellite).await?,
    })
}

async fn plans(connection: &mut SqliteConnection) -> Result<Vec<PlanRecord>, StoreError> {
    let rows = sqlx::query(select::<PlanRow>("where withdrawn_at_us is null order by id"))
        .fetch_all(connection)
        .await?;
    rows.iter().map(|row| PlanRow::read(row)?.record()).collect()
}

/// What is not over, of each plan the newest if the next pass is to finish it, and of each satellite the newest that ended.
async fn runs(connection: &mut SqliteConnection) -> Result<Vec<RunRecord>, StoreError> {
    let rows = sqlx::query(select::<RunRow>(
        "where state in ('planned', 'waiting', 'running', 'held')
            or id in (select max(id) from plan_runs where state = 'ended' group by satellite)
            or (outcome = 'later'
                and id in (select max(id) from plan_runs where state = 'ended' group by plan))
         order by id",
    ))
    .fetch_all(connection)
    .await?;
    rows.iter().map(|row| RunRow::read(row)?.record()).collect()
}

/// The newest sets by epoch.
async fn elements(
    connection: &mut SqliteConnection,
    satellite: &SatelliteId,
) -> Result<Vec<ElementSet>, StoreError> {
    let rows =
        sqlx::query(select::<ElementsRow>("where satellite = ? order by epoch_us desc, id desc limit ?"))
            .bind(satellite.as_str())
            .bind(int("limit", SETS_KEPT as u64)?)
            .fetch_all(connection)
            .await?;
    rows.iter().map(|row| ElementsRow::read(row)?.set()).collect()
}

/// The newest pass, if it has not ended.
async fn pass(
    connection: &mut SqliteConnection,
    satellite: &SatelliteId,
) -> Result<Option<PassRecord>, StoreError> {
    let row = sqlx::query(select::<PassRow>(
        "where satellite = ? and ended_at_us is null order by id desc limit 1",
    ))
    .bind(satellite.as_str())
    .fetch_optional(&mut *connection)
    .await?;
    let Some(row) = row else { return Ok(None) };
    let pass = PassRow::read(&row)?;
    let used = sqlx::query(select::<PassElementsRow>("where pass = ? order by id"))
        .bind(pass.id)
        .fetch_all(connection)
        .await?;
    let used: Vec<_> = used.iter().map(PassElementsRow::read).collect::<Result<_, _>>()?;
    pass.record(&used).map(Some)
}

async fn last_tag(
    connection: &mut SqliteConnection,
    satellite: &SatelliteId,
) -> Result<Option<RequestTag>, StoreError> {
    let row = sqlx::query(select::<SealedRow>("where satellite = ? order by id desc limit 1"))
        .bind(satellite.as_str())
        .fetch_optional(connection)
        .await?;
    row.map(|row| SealedRow::read(&row)?.tag()).transpose()
}

/// Commands whose last stage is not final, and fresh ones that are `unknown`.
async fn commands(
    connection: &mut SqliteConnection,
    satellite: &SatelliteId,
) -> Result<Vec<CommandSnapshot>, StoreError> {
    let newest_us: i64 = sqlx::query_scalar(
        "select max(coalesce((select at_us from events order by seq desc limit 1), 0),
                    coalesce((select at_us from command_stages order by id desc limit 1), 0))",
    )
    .fetch_one(&mut *connection)
    .await?;
    let rows = sqlx::query(select::<CommandRow>(
        "where satellite = ?1 and not exists (
           select 1 from command_stages as last
           where last.id = (select max(id) from command_stages where command = commands.id)
             and last.stage not in ('queued', 'sealed', 'radiating', 'radiated')
             and not (last.stage = 'unknown' and last.at_us >= ?2))
         order by id",
    ))
    .bind(satellite.as_str())
    .bind(newest_us.saturating_sub(UNKNOWN_KEPT_US))
    .fetch_all(&mut *connection)
    .await?;
    let mut commands = Vec::with_capacity(rows.len());
    for row in &rows {
        commands.push(command(connection, &CommandRow::read(row)?).await?);
    }
    Ok(commands)
}

async fn command(connection: &mut SqliteConnection, row: &CommandRow) -> Result<CommandSnapshot, StoreError> {
    let last = sqlx::query(select::<StageRow>("where command = ? order by id desc limit 1"))
        .bind(row.id)
        .fetch_optional(&mut *connection)
        .await?;
    let last = last.as_ref().map(StageRow::read).transpose()?;
    let sealed = sqlx::query(select::<SealedRow>("where command = ? order by id desc limit 1"))
        .bind(row.id)
        .fetch_optional(&mut *connection)
        .await?;
    let sealed = sealed.as_ref().map(SealedRow::read).transpose()?;
    let (stage, stage_at, attempt) = match last {
        Some(last) => (
            parse("command_stages.stage", &last.stage)?,
            UtcUs(last.at_us),
            narrow("command_stages.attempt", last.attempt)?,
        ),
        None => (Stage::Queued, UtcUs(row.created_at_us), 0),
    };
    let on_air_us: Option<i64> = sqlx::query_scalar(
        "select max(at_us) from command_stages where command = ? and stage in ('radiating', 'radiated')",
    )
    .bind(row.id)
    .fetch_one(&mut *connection)
    .await?;
    let condition = sqlx::query(select::<ConditionRow>("where command = ?"))
        .bind(row.id)
        .fetch_optional(&mut *connection)
        .await?;
    let when = condition.as_ref().map(|row| ConditionRow::read(row)?.condition()).transpose()?;
    Ok(CommandSnapshot {
        record: CommandRecord { when: when.map(Box::new), ..row.record()? },
        stage,
        stage_at,
        attempt,
        on_air_at: on_air_us.map(UtcUs),
        sealed: sealed.as_ref().map(sealed_snapshot).transpose()?,
    })
}

fn sealed_snapshot(row: &SealedRow) -> Result<SealedSnapshot, StoreError> {
    Ok(SealedSnapshot {
        key: parse("sealed_frames.key", &row.key)?,
        counter: Counter(narrow("sealed_frames.counter", row.counter)?),
        tag: row.tag()?,
        bytes: Arc::new(exactly("sealed_frames.bytes", &row.bytes)?),
    })
}

/// The newest image and the first version of each chunk that is held.
async fn image(
    connection: &mut SqliteConnection,
    satellite: &SatelliteId,
) -> Result<Option<ImageSnapshot>, StoreError> {
    let found = sqlx::query(select::<ImageRow>("where satellite = ? order by id desc limit 1"))
        .bind(satellite.as_str())
        .fetch_optional(&mut *connection)
        .await?;
    let Some(found) = found else { return Ok(None) };
    let image = ImageRow::read(&found)?;
    let rows = sqlx::query(select::<ChunkRow>("where image = ? order by chunk_index, id"))
        .bind(image.id)
        .fetch_all(&mut *connection)
        .await?;
    let mut snapshot = ImageSnapshot { record: image.record()?, chunks: Vec::new(), conflicts: Vec::new() };
    for row in &rows {
        let row = ChunkRow::read(row)?;
        let index = narrow("chunks.chunk_index", row.chunk_index)?;
        if row.conflict {
            if snapshot.conflicts.last() != Some(&index) {
                snapshot.conflicts.push(index);
            }
        } else {
            snapshot.chunks.push((index, Box::new(exactly("chunks.data", &row.data)?)));
        }
    }
    Ok(Some(snapshot))
}

/// The newest heartbeat that makes sense: frame, when heard, uptime in ms.
async fn heartbeat(
    connection: &mut SqliteConnection,
    satellite: &SatelliteId,
) -> Result<Option<(FrameId, UtcUs, u32)>, StoreError> {
    let rows = sqlx::query(select::<FrameRow>(
        "where satellite = ? and packet_type = ? and nested = 0 order by id desc limit ?",
    ))
    .bind(satellite.as_str())
    .bind(i64::from(down_type::HEARTBEAT))
    .bind(HEARTBEATS_TRIED)
    .fetch_all(connection)
    .await?;
    for row in &rows {
        let row = FrameRow::read(row)?;
        if let Ok(frame) = DownFrame::parse(&row.bytes)
            && let Ok(Downlink::Heartbeat(heartbeat)) = frame.packet()
        {
            let id = FrameId(narrow("frames.id", row.id)?);
            return Ok(Some((id, UtcUs(row.heard_at_us), heartbeat.uptime_ms)));
        }
    }
    Ok(None)
}

/// The highest counter that is spent: by a sealed frame, or by a floor that somebody confirmed.
async fn counter(connection: &mut SqliteConnection, key: KeyId) -> Result<Option<Counter>, StoreError> {
    let highest: Option<i64> = sqlx::query_scalar(
        "select max(counter) from (
           select max(counter) as counter from sealed_frames where key = ?1
           union all select max(counter) from counter_floors where key = ?1)",
    )
    .bind(key.to_string())
    .fetch_one(connection)
    .await?;
    highest.map(|counter| narrow("counter", counter).map(Counter)).transpose()
}
