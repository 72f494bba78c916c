//! What the next shift must know.

use api::{AuditView, CommandReported, HandoverReport, LimitView, PassBrief, StationView};
use mission::Stage;

use super::pass::{MARGIN_US, alarm, command, number, time};
use super::runs::run_view;
use crate::storage::{Store, StoreError};

/// Rows of each kind that are listed.
const ROWS_MAX: u32 = 200;

/// What happened since an instant, beside how the station is now.
///
/// # Errors
/// [`StoreError`] when the archive cannot be read.
pub async fn handover_report(
    store: &Store,
    now: StationView,
    since_us: i64,
) -> Result<HandoverReport, StoreError> {
    let (at_us, station) = (now.at.unix_us(), now.station.clone());
    let (mut in_flight, mut unknown): (Vec<CommandReported>, Vec<CommandReported>) = Default::default();
    for then in store.commands_unsettled(&station, since_us, ROWS_MAX).await?.iter().rev() {
        let Some(command) = command(then, since_us) else { continue };
        if command.stage == Stage::Unknown.name() { &mut unknown } else { &mut in_flight }.push(command);
    }
    let (mut ahead, mut runs) = (Vec::new(), Vec::new());
    for row in store.runs_since(&station, since_us, ROWS_MAX).await?.iter().rev() {
        let plan = store.plan(row.plan).await?;
        let missing = || StoreError::damaged(format!("plan {} of a run is not in the archive", row.plan));
        let view = run_view(&row.record()?, plan.ok_or_else(missing)?.name);
        let is_ahead = matches!(view.state.as_str(), "planned" | "waiting" | "running" | "held");
        if is_ahead { &mut ahead } else { &mut runs }.push(view);
    }
    let mut passes = Vec::new();
    // One that began before and lasted into the time belongs to it.
    let from_us = since_us.saturating_sub(LONG_PASS_US);
    for row in store.passes_between(&station, (from_us, at_us)).await? {
        let los_us = row.los_at_us.or(row.ended_at_us).unwrap_or(at_us);
        if los_us < since_us {
            continue;
        }
        let (start, stop) = (row.aos_at_us.saturating_sub(MARGIN_US), los_us.saturating_add(MARGIN_US));
        let heard = store.heard_between(&row.satellite, &row.station, start, stop).await?;
        passes.push(PassBrief {
            pass: number(row.id),
            satellite: row.satellite,
            station: row.station,
            aos: time(row.aos_at_us),
            los: row.los_at_us.map(time),
            max_elevation_deg: row.max_elevation_deg,
            frames: number(heard.frames),
            chunks: number(heard.chunks),
        });
    }
    let limits =
        store.limits().await?.into_iter().filter(|row| row.station == station && row.level != "normal");
    let alarms = store.alarms_since(&station, since_us, ROWS_MAX + 1).await?;
    let all = store.alarms_counted_since(&station, since_us).await?;
    let actions = store.actions_since(&station, since_us, ROWS_MAX + 1).await?;
    let listed = ROWS_MAX as usize;
    Ok(HandoverReport {
        since: time(since_us),
        at: now.at,
        alerts: store.open_alerts().await?.0.iter().map(crate::alerts::view).collect(),
        limits: limits
            .map(|row| LimitView {
                satellite: row.satellite,
                station: row.station,
                parameter: row.parameter,
                level: row.level,
                since: time(row.since_us),
                value: row.value,
            })
            .collect(),
        now,
        passes,
        in_flight,
        unknown,
        ahead,
        runs,
        alarms_left_out: number(all).saturating_sub(alarms.len().min(listed) as u64),
        alarms: alarms.into_iter().take(listed).rev().map(alarm).collect(),
        actions_cut: actions.len() > listed,
        actions: actions
            .into_iter()
            .take(listed)
            .rev()
            .map(|row| AuditView {
                id: number(row.id),
                station: row.station,
                at: time(row.at_us),
                who: row.who,
                action: row.action,
                detail: row.detail,
            })
            .collect(),
    })
}

/// No pass of a low satellite lasts longer.
const LONG_PASS_US: i64 = 3_600_000_000;
