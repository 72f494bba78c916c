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

use super::convert::{exactly, int, narrow, parse};
use super::db::{Reading, sql};
use super::row::{Row as _, select};
use super::rows::{
    ChunkRow, CommandRow, ConditionRow, DownloadRow, ElementsRow, FrameRow, ImageRow, LimitRow,
    PassElementsRow, PassRow, PlanRow, RunRow, SealedRow, StageRow,
};
use super::{Store, StoreError, off_the_loop};

/// Bits of an id below the number of its station: with 13 bits above, ids stay whole in JSON (2^53).
const STATION_SHIFT: u32 = 40;

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
    let connection = &mut transaction;
    let own = Own::of(store.0.number);
    let mut snapshot = Snapshot { last_ids: last_ids(connection, own).await?, ..Snapshot::default() };
    for satellite in satellites {
        let left = of_satellite(connection, satellite, own).await?;
        if !is_empty(&left) {
            snapshot.satellites.push(left);
        }
    }
    snapshot.recent = super::ears::recent(connection, satellites).await?;
    snapshot.plans = plans(connection, own).await?;
    snapshot.runs = runs(connection, own).await?;
    let folder = store.0.witness.clone();
    let mut asked = Vec::with_capacity(keys.len());
    for key in keys {
        asked.push((*key, used_by_others(connection, store, *key).await?));
    }
    let witnesses: Vec<Witness> = off_the_loop(move || {
        let read = |(key, used): (KeyId, Option<Counter>)| match (folder.read(key), used) {
            (Witness::Missing, Some(used)) => match folder.raise(key, used) {
                Ok(()) => folder.read(key),
                Err(_) => Witness::Missing,
            },
            (found, _) => found,
        };
        asked.into_iter().map(read).collect()
    })
    .await?;
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

/// The ids that this station gives: an id holds the station's number in its upper bits, so that stations which share a
/// database never give the same. What another station is doing is its own affair: a restart goes on with ours.
#[derive(Debug, Clone, Copy)]
pub(super) struct Own {
    /// Below the first.
    pub(super) after: i64,
    /// Above the last.
    pub(super) before: i64,
}

impl Own {
    pub(super) const fn of(number: i64) -> Self {
        Self { after: number << STATION_SHIFT, before: (number + 1) << STATION_SHIFT }
    }
}

/// The counter of a key that other stations used and this one never did: there is nothing yet that a witness of ours
/// could have seen and lost, so it begins here.
async fn used_by_others(
    connection: &mut Reading,
    store: &Store,
    key: KeyId,
) -> Result<Option<Counter>, StoreError> {
    if !store.is_shared() {
        return Ok(None);
    }
    let own = Own::of(store.0.number);
    let sealed_here: i64 =
        sql("select count(*) from sealed_frames where key = ? and command > ? and command < ?")
            .bind(key.to_string())
            .bind(own.after)
            .bind(own.before)
            .scalar(&mut *connection)
            .await?;
    if sealed_here > 0 { Ok(None) } else { counter(connection, key).await }
}

/// The highest ids that this station gave.
async fn last_ids(connection: &mut Reading, own: Own) -> Result<LastIds, StoreError> {
    let row = sql("select
           (select coalesce(max(id), ?1) from frames where id > ?1 and id < ?2) as frame,
           (select coalesce(max(id), ?1) from commands where id > ?1 and id < ?2) as command,
           (select coalesce(max(id), ?1) from images where id > ?1 and id < ?2) as image,
           (select coalesce(max(id), ?1) from downloads where id > ?1 and id < ?2) as download,
           (select coalesce(max(id), ?1) from elements where id > ?1 and id < ?2) as elements,
           (select coalesce(max(id), ?1) from passes where id > ?1 and id < ?2) as pass,
           (select coalesce(max(id), ?1) from plans where id > ?1 and id < ?2) as plan,
           (select coalesce(max(id), ?1) from plan_runs where id > ?1 and id < ?2) as run")
    .bind(own.after)
    .bind(own.before)
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
    connection: &mut Reading,
    satellite: &SatelliteId,
    own: Own,
) -> Result<SatelliteSnapshot, StoreError> {
    Ok(SatelliteSnapshot {
        satellite: satellite.clone(),
        last_tag: last_tag(connection, satellite).await?,
        commands: commands(connection, satellite, own).await?,
        image: image(connection, satellite, own).await?,
        downloads: {
            let rows = sql(select::<DownloadRow>(
                "where satellite = ? and state = 'active' and id > ? and id < ? order by id",
            ))
            .bind(satellite.as_str())
            .bind(own.after)
            .bind(own.before)
            .fetch_all(&mut *connection)
            .await?;
            rows.iter().map(|row| DownloadRow::read(row)?.record()).collect::<Result<_, _>>()?
        },
        limits: {
            let rows =
                sql(select::<LimitRow>("where satellite = ? and level <> 'normal' order by parameter"))
                    .bind(satellite.as_str())
                    .fetch_all(&mut *connection)
                    .await?;
            rows.iter().map(|row| LimitRow::read(row)?.record()).collect::<Result<_, _>>()?
        },
        heartbeat: heartbeat(connection, satellite, own).await?,
        elements: elements(connection, satellite).await?,
        pass: pass(connection, satellite, own).await?,
    })
}

async fn plans(connection: &mut Reading, own: Own) -> Result<Vec<PlanRecord>, StoreError> {
    let rows = sql(select::<PlanRow>("where withdrawn_at_us is null and id > ? and id < ? order by id"))
        .bind(own.after)
        .bind(own.before)
        .fetch_all(connection)
        .await?;
    rows.iter().map(|row| PlanRow::read(row)?.record()).collect()
}

/// What is not over, of each plan the newest if the next pass is to finish it, and of each satellite the newest that ended.
async fn runs(connection: &mut Reading, own: Own) -> Result<Vec<RunRecord>, StoreError> {
    let rows = sql(select::<RunRow>(
        "where id > ?1 and id < ?2 and (state in ('planned', 'waiting', 'running', 'held')
            or id in (select max(id) from plan_runs where state = 'ended' and id > ?1 and id < ?2 group by satellite)
            or (outcome = 'later'
                and id in (select max(id) from plan_runs where state = 'ended' and id > ?1 and id < ?2 group by plan)))
         order by id",
    ))
    .bind(own.after)
    .bind(own.before)
    .fetch_all(connection)
    .await?;
    rows.iter().map(|row| RunRow::read(row)?.record()).collect()
}

/// The newest sets by epoch.
async fn elements(connection: &mut Reading, satellite: &SatelliteId) -> Result<Vec<ElementSet>, StoreError> {
    let rows = sql(select::<ElementsRow>("where satellite = ? order by epoch_us desc, id desc limit ?"))
        .bind(satellite.as_str())
        .bind(int("limit", SETS_KEPT as u64)?)
        .fetch_all(connection)
        .await?;
    rows.iter().map(|row| ElementsRow::read(row)?.set()).collect()
}

/// The newest pass, if it has not ended.
async fn pass(
    connection: &mut Reading,
    satellite: &SatelliteId,
    own: Own,
) -> Result<Option<PassRecord>, StoreError> {
    let open = "where satellite = ? and ended_at_us is null and id > ? and id < ? order by id desc limit 1";
    let row = sql(select::<PassRow>(open))
        .bind(satellite.as_str())
        .bind(own.after)
        .bind(own.before)
        .fetch_optional(&mut *connection)
        .await?;
    let Some(row) = row else { return Ok(None) };
    let pass = PassRow::read(&row)?;
    let used = sql(select::<PassElementsRow>("where pass = ? order by id"))
        .bind(pass.id)
        .fetch_all(connection)
        .await?;
    let used: Vec<_> = used.iter().map(PassElementsRow::read).collect::<Result<_, _>>()?;
    pass.record(&used).map(Some)
}

async fn last_tag(
    connection: &mut Reading,
    satellite: &SatelliteId,
) -> Result<Option<RequestTag>, StoreError> {
    let row = sql(select::<SealedRow>("where satellite = ? order by id desc limit 1"))
        .bind(satellite.as_str())
        .fetch_optional(connection)
        .await?;
    row.map(|row| SealedRow::read(&row)?.tag()).transpose()
}

/// Commands whose last stage is not final, and fresh ones that are `unknown`.
async fn commands(
    connection: &mut Reading,
    satellite: &SatelliteId,
    own: Own,
) -> Result<Vec<CommandSnapshot>, StoreError> {
    let newest_us: i64 = sql(
        "select max(at_us) from (
           select coalesce((select at_us from events order by seq desc limit 1), 0) as at_us
           union all select coalesce((select at_us from command_stages order by id desc limit 1), 0)) as newest",
    )
    .scalar(&mut *connection)
    .await?;
    let rows = sql(select::<CommandRow>(
        "where satellite = ?1 and id > ?3 and id < ?4 and not exists (
           select 1 from command_stages as last
           where last.id = (select max(id) from command_stages where command = commands.id)
             and last.stage not in ('queued', 'sealed', 'radiating', 'radiated')
             and not (last.stage = 'unknown' and last.at_us >= ?2))
         order by id",
    ))
    .bind(satellite.as_str())
    .bind(newest_us.saturating_sub(UNKNOWN_KEPT_US))
    .bind(own.after)
    .bind(own.before)
    .fetch_all(&mut *connection)
    .await?;
    let mut commands = Vec::with_capacity(rows.len());
    for row in &rows {
        commands.push(command(connection, &CommandRow::read(row)?).await?);
    }
    Ok(commands)
}

async fn command(connection: &mut Reading, row: &CommandRow) -> Result<CommandSnapshot, StoreError> {
    let last = sql(select::<StageRow>("where command = ? order by id desc limit 1"))
        .bind(row.id)
        .fetch_optional(&mut *connection)
        .await?;
    let last = last.as_ref().map(StageRow::read).transpose()?;
    let sealed = sql(select::<SealedRow>("where command = ? order by id desc limit 1"))
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
    let on_air_us: Option<i64> =
        sql("select max(at_us) from command_stages where command = ? and stage in ('radiating', 'radiated')")
            .bind(row.id)
            .scalar(&mut *connection)
            .await?;
    let condition = sql(select::<ConditionRow>("where command = ?"))
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
    connection: &mut Reading,
    satellite: &SatelliteId,
    own: Own,
) -> Result<Option<ImageSnapshot>, StoreError> {
    let found = sql(select::<ImageRow>("where satellite = ? and id > ? and id < ? order by id desc limit 1"))
        .bind(satellite.as_str())
        .bind(own.after)
        .bind(own.before)
        .fetch_optional(&mut *connection)
        .await?;
    let Some(found) = found else { return Ok(None) };
    let image = ImageRow::read(&found)?;
    let rows = sql(select::<ChunkRow>("where image = ? order by chunk_index, id"))
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
    connection: &mut Reading,
    satellite: &SatelliteId,
    own: Own,
) -> Result<Option<(FrameId, UtcUs, u32)>, StoreError> {
    let rows = sql(select::<FrameRow>(
        "where satellite = ? and packet_type = ? and nested = 0 and id > ? and id < ? and station <> 'elsewhere'
         order by id desc limit ?",
    ))
    .bind(satellite.as_str())
    .bind(i64::from(down_type::HEARTBEAT))
    .bind(own.after)
    .bind(own.before)
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
async fn counter(connection: &mut Reading, key: KeyId) -> Result<Option<Counter>, StoreError> {
    let highest: Option<i64> = sql("select max(counter) from (
           select max(counter) as counter from sealed_frames where key = ?1
           union all select max(counter) from counter_floors where key = ?1) as spent")
    .bind(key.to_string())
    .scalar(connection)
    .await?;
    highest.map(|counter| narrow("counter", counter).map(Counter)).transpose()
}
