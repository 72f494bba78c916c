//! What a pass brought, gathered from the archive.

use api::{
    AlarmReported, ChunkRun, CommandReported, HadPass, ImageReported, PacketCount, PassReport, PlannedPass,
    RunReported, SignalPoint, SilentStretch, Spread, Time, UplinkReported,
};
use mission::{Stage, UtcUs};
use protocol::{Downlink, down_type};
use tle::Elements;

use super::next_steps::next_steps;
use super::orbit::{Orbit, next_pass, numbered, passes_ahead, rounded};
use super::runs::{run_view, step_report};
use crate::http::{Identity, SatelliteIdentity};
use crate::storage::{
    ChunkCame, CommandThen, EventRow, Heard, ImageRow, PassRow, RunRow, Span, Store, StoreError,
};

/// A report is made so long after LOS, and counts what came until then.
pub const AFTER_LOS_US: i64 = 60_000_000;
/// What was heard so long before AOS and after LOS is the pass's: elements are a little off.
pub(super) const MARGIN_US: i64 = 60_000_000;
/// Commands, alarms and frames that are listed; beyond, they are counted.
const COMMANDS_MAX: u32 = 200;
const ALARMS_MAX: u32 = 200;
const SIGNAL_MAX: usize = 5000;
/// Stretches of missing chunks that are listed.
const MISSING_MAX: usize = 20;
/// Element sets that the next pass is sought with.
const SETS_MAX: u32 = 64;
const DAY_US: i64 = 86_400_000_000;
/// Bytes of a frame that is radiated.
const UPLINK_BYTES: usize = radio::airtime::MAX_FRAME_BYTES;

/// The report of a pass, as of a minute after its LOS, or as of `now` while it lasts. `None`: there is no such pass.
///
/// # Errors
/// [`StoreError`] when the archive cannot be read.
pub async fn pass_report(
    store: &Store,
    identity: &Identity,
    pass: i64,
    now: UtcUs,
) -> Result<Option<PassReport>, StoreError> {
    let Some(row) = store.pass(pass).await? else { return Ok(None) };
    let known = identity.satellites.iter().find(|known| known.id.as_str() == row.satellite);
    let end_us = row.los_at_us.or(row.ended_at_us);
    let due_us = end_us.map(|end| end.saturating_add(AFTER_LOS_US));
    let as_of_us = due_us.map_or(now.0, |due| due.min(now.0));
    let until_us = end_us.map_or(as_of_us, |end| end.min(as_of_us));
    let span = Span {
        satellite: &row.satellite,
        station: &row.station,
        from_us: row.aos_at_us.saturating_sub(MARGIN_US),
        to_us: as_of_us,
    };

    let heard = store.frames_in(&span).await?;
    let used = elements_used(store, &row).await?;
    let orbit = identity.site.as_ref().and_then(|site| {
        let sets: Vec<_> = used.iter().map(|(_, from_us, set)| (*from_us, set.clone())).collect();
        Orbit::new(site, &sets)
    });
    let commands = store.commands_in(&span, COMMANDS_MAX).await?;
    let commands_all = store.commands_counted(&span).await?;
    let alarms = store.alarms_in(&span, ALARMS_MAX).await?;
    let alarms_all = store.alarms_counted(&span).await?;
    let mut runs = Vec::new();
    // Those of this pass, not of its neighbours: without the margin.
    let own = Span { from_us: row.aos_at_us, to_us: until_us.max(row.aos_at_us), ..span };
    for run in store.runs_in(&own).await? {
        runs.push(reported(store, &run).await?);
    }
    let images = store.images_in(&span).await?;

    let mut report = PassReport {
        pass: number(row.id),
        satellite: row.satellite.clone(),
        station: row.station.clone(),
        simulated: identity.simulated,
        as_of: time(as_of_us),
        is_final: row.ended_at_us.is_some() && due_us.is_some_and(|due| due <= now.0),
        planned: planned(&row, used.last()),
        had: had(&row, &heard, until_us, known),
        gaps: known.map_or_else(Vec::new, |known| {
            gaps(&heard, (row.aos_at_us, until_us), row.los_at_us, known.heartbeat_period_us)
        }),
        runs,
        commands_left_out: number(commands_all).saturating_sub(commands.len() as u64),
        uplink: uplink(&commands, span.from_us, known),
        commands: commands.iter().filter_map(|then| command(then, span.from_us)).collect(),
        images: images.iter().map(|(row, chunks)| image(row, chunks, &span)).collect(),
        alarms_left_out: number(alarms_all).saturating_sub(alarms.len() as u64),
        alarms: alarms.into_iter().map(alarm).collect(),
        signal_left_out: heard.len().saturating_sub(SIGNAL_MAX) as u64,
        signal: heard.iter().take(SIGNAL_MAX).map(|heard| signal(heard, orbit.as_ref())).collect(),
        path: match (&orbit, end_us) {
            (Some(orbit), Some(end_us)) => orbit.path((row.aos_at_us, end_us)),
            _ => Vec::new(),
        },
        next_pass: None,
        next_steps: Vec::new(),
    };
    if let Some(site) = &identity.site {
        let window = (as_of_us, as_of_us.saturating_add(DAY_US));
        let rows = store.elements_between(&row.satellite, window, SETS_MAX).await?;
        let mut sets = Vec::new();
        for set in rows.iter().filter(|set| set.added_at_us <= as_of_us) {
            sets.push(numbered(number(set.id), set.elements()?));
        }
        report.next_pass = passes_ahead(site, &sets, as_of_us).first().map(next_pass);
    }
    report.next_steps = next_steps(&report, used.last().map(|(_, _, set)| set));
    Ok(Some(report))
}

/// Number, from when, and the set itself, in order of time.
async fn elements_used(store: &Store, row: &PassRow) -> Result<Vec<(i64, i64, Elements)>, StoreError> {
    let mut used = Vec::new();
    for link in store.pass_elements(row.id).await? {
        let set = store.element_set(link.elements).await?;
        let missing = || StoreError::damaged(format!("pass {}: its elements are gone", row.id));
        used.push((link.elements, link.from_us, set.ok_or_else(missing)?.elements()?));
    }
    Ok(used)
}

fn planned(row: &PassRow, used: Option<&(i64, i64, Elements)>) -> PlannedPass {
    PlannedPass {
        aos: time(row.aos_at_us),
        tca: time(row.tca_at_us),
        los: row.los_at_us.map(time),
        duration_s: row.los_at_us.map(|los| seconds(los.saturating_sub(row.aos_at_us))),
        max_elevation_deg: rounded(row.max_elevation_deg, 100.0),
        elements: used.map(|(id, _, _)| number(*id)),
        elements_age_days: used
            .map(|(_, _, set)| set.age_days(tle::UtcInstant::from_unix_us(row.tca_at_us)))
            .map(|days| rounded(days, 1000.0)),
    }
}

fn had(row: &PassRow, heard: &[Heard], until_us: i64, known: Option<&SatelliteIdentity>) -> HadPass {
    let mut packets: Vec<PacketCount> = Vec::new();
    for heard in heard {
        let packet_type = heard.frame.packet_type.and_then(|code| u8::try_from(code).ok());
        match packets.iter_mut().find(|count| count.packet_type == packet_type) {
            Some(count) => count.frames += 1,
            None => packets.push(PacketCount {
                packet_type,
                packet_name: packet_type.and_then(Downlink::name_of).map(str::to_owned),
                frames: 1,
            }),
        }
    }
    packets.sort_by_key(|count| (std::cmp::Reverse(count.frames), count.packet_type));
    let is_beat = |heard: &&Heard| heard.frame.packet_type == Some(i64::from(down_type::HEARTBEAT));
    let inside = row.aos_at_us..=until_us;
    let heartbeats = heard.iter().filter(is_beat).filter(|beat| inside.contains(&beat.frame.heard_at_us));
    let airtime_us = |known: &SatelliteIdentity| {
        heard.iter().map(|h| known.timing.frame_us(h.frame.bytes.len())).sum::<u64>()
    };
    let rssi: Vec<f64> = heard.iter().filter_map(strongest).map(f64::from).collect();
    HadPass {
        ended_at: row.ended_at_us.map(time),
        frames: heard.len() as u64,
        bytes: heard.iter().map(|heard| heard.frame.bytes.len() as u64).sum(),
        packets,
        airtime_s: known.map(airtime_us).map(seconds_of),
        first_frame: heard.first().map(|heard| time(heard.frame.heard_at_us)),
        last_frame: heard.last().map(|heard| time(heard.frame.heard_at_us)),
        heartbeats: heartbeats.count() as u64,
        heartbeats_expected: row.los_at_us.and(known).map(|known| {
            let lasted_us = until_us.saturating_sub(row.aos_at_us).max(0);
            number(lasted_us / known.heartbeat_period_us.max(1))
        }),
        rssi_dbm: spread(rssi),
        // No receiver of ours tells it.
        snr_db: None,
    }
}

fn strongest(heard: &Heard) -> Option<i32> {
    let told = heard.receptions.iter().filter_map(|reception| reception.rssi_dbm).max()?;
    i32::try_from(told).ok()
}

fn spread(mut values: Vec<f64>) -> Option<Spread> {
    values.sort_by(f64::total_cmp);
    let middle = |half: usize| values.get(half).copied();
    Some(Spread {
        min: *values.first()?,
        median: f64::midpoint(middle((values.len() - 1) / 2)?, middle(values.len() / 2)?),
        max: *values.last()?,
    })
}

/// Silence of more than one and a half periods: a heartbeat was due in it, wherever in its period the silence began.
fn gaps(
    heard: &[Heard],
    (aos_us, until_us): (i64, i64),
    los_us: Option<i64>,
    period_us: i64,
) -> Vec<SilentStretch> {
    let inside =
        heard.iter().map(|heard| heard.frame.heard_at_us).filter(|at| (aos_us..=until_us).contains(at));
    let ends: Vec<i64> = std::iter::once(aos_us).chain(inside).chain([until_us]).collect();
    let last = ends.len().saturating_sub(2);
    let stretches = ends.iter().zip(ends.iter().skip(1)).enumerate();
    stretches
        .filter(|(_, (start, stop))| {
            stop.saturating_sub(**start).saturating_mul(2) > period_us.saturating_mul(3)
        })
        .map(|(index, (start, stop))| SilentStretch {
            start: time(*start),
            stop: time(*stop),
            duration_s: seconds(stop.saturating_sub(*start)),
            from_aos: index == 0,
            to_los: index == last && los_us == Some(*stop),
        })
        .collect()
}

async fn reported(store: &Store, row: &RunRow) -> Result<RunReported, StoreError> {
    let plan = store.plan(row.plan).await?;
    let plan =
        plan.ok_or_else(|| StoreError::damaged(format!("plan {} of a run is not in the archive", row.plan)))?;
    let (text, record) = (plan.text()?, row.record()?);
    Ok(RunReported {
        steps_planned: text.steps.len() as u64,
        steps: record.progress.results.iter().map(|result| step_report(result, &text)).collect(),
        steps_dropped: record.progress.results_dropped,
        run: run_view(&record, plan.name),
    })
}

fn radiated(then: &CommandThen, from_us: i64) -> u64 {
    let stages = then.stages.iter().filter(|stage| stage.at_us >= from_us);
    stages.filter(|stage| stage.stage == Stage::Radiated.name()).count() as u64
}

fn uplink(commands: &[CommandThen], from_us: i64, known: Option<&SatelliteIdentity>) -> UplinkReported {
    let frames = commands.iter().map(|then| radiated(then, from_us)).sum();
    UplinkReported {
        frames,
        airtime_s: known.map(|known| seconds_of(known.timing.frame_us(UPLINK_BYTES).saturating_mul(frames))),
    }
}

pub(super) fn command(then: &CommandThen, from_us: i64) -> Option<CommandReported> {
    let last = then.stages.last()?;
    let sent = then.stages.iter().rfind(|stage| stage.stage == Stage::Radiated.name());
    let answered = then.stages.iter().rfind(|stage| stage.stage == Stage::Answered.name());
    Some(CommandReported {
        id: number(then.command.id),
        command: then.command.name.clone(),
        principal: then.command.principal.clone(),
        created_at: time(then.command.created_at_us),
        stage: last.stage.clone(),
        stage_at: time(last.at_us),
        why: last.why.clone(),
        radiated: radiated(then, from_us),
        answered_after_s: sent
            .zip(answered)
            .map(|(sent, answered)| seconds(answered.at_us.saturating_sub(sent.at_us))),
        frame: last.frame.map(number),
    })
}

fn image(row: &ImageRow, chunks: &[ChunkCame], span: &Span<'_>) -> ImageReported {
    let held: Vec<&ChunkCame> = chunks.iter().filter(|chunk| !chunk.conflict).collect();
    let came_before = held.iter().filter(|chunk| chunk.at_us < span.from_us).count();
    let mut missing = Vec::new();
    let mut next = 0;
    let all = row.chunks.clamp(0, 1 << 16);
    for index in held.iter().map(|chunk| chunk.index).chain([all]) {
        if index > next {
            missing.push(ChunkRun { first: small(next), count: small(index - next) });
        }
        next = next.max(index + 1);
    }
    ImageReported {
        image: number(row.id),
        is_new: row.declared_at_us >= span.from_us && row.declared_at_us <= span.to_us,
        chunks: small(all),
        held_before: came_before.try_into().unwrap_or(u32::MAX),
        held: held.len().try_into().unwrap_or(u32::MAX),
        conflicts: chunks
            .iter()
            .filter(|chunk| chunk.conflict && chunk.at_us >= span.from_us)
            .count()
            .try_into()
            .unwrap_or(u32::MAX),
        missing_runs: missing.len().try_into().unwrap_or(u32::MAX),
        missing: missing.into_iter().take(MISSING_MAX).collect(),
    }
}

pub(super) fn alarm(row: EventRow) -> AlarmReported {
    AlarmReported {
        sequence: row.seq,
        at: time(row.at_us),
        kind: row.kind,
        level: row.level,
        satellite: row.satellite,
        message: row.message,
    }
}

fn signal(heard: &Heard, orbit: Option<&Orbit<'_>>) -> SignalPoint {
    SignalPoint {
        at: time(heard.frame.heard_at_us),
        frame: number(heard.frame.id),
        elevation_deg: orbit.and_then(|orbit| orbit.elevation_deg(heard.frame.heard_at_us)),
        rssi_dbm: strongest(heard),
        snr_db: None,
    }
}

pub(super) fn time(us: i64) -> Time {
    Time::from_unix_us(us)
}

pub(super) fn number(value: i64) -> u64 {
    u64::try_from(value).unwrap_or(0)
}

fn small(value: i64) -> u32 {
    u32::try_from(value).unwrap_or(0)
}

/// To a millisecond.
pub(super) fn seconds(us: i64) -> f64 {
    rounded(us as f64 / 1e6, 1000.0)
}

pub(super) fn seconds_of(us: u64) -> f64 {
    rounded(us as f64 / 1e6, 1000.0)
}
