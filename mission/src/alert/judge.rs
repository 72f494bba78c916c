//! What holds now and should not: the station's status, and what the shell knows besides, as conditions.
//!
//! Outside a pass silence is normal. In one the beacon is due, from AOS on and as far as the elements can tell.

use std::collections::BTreeMap;

use super::condition::{AlertKind, Condition};
use super::policy::Thresholds;
use crate::clock::UtcUs;
use crate::id::SatelliteId;
use crate::level::Level;
use crate::port::LinkState;
use crate::sky::clock_time;
use crate::status::{SatelliteStatus, Status};

/// What the status does not tell.
#[derive(Debug, Clone, Default)]
pub struct Surroundings {
    /// Microseconds between two heartbeats of each satellite.
    pub heartbeat_period_us: BTreeMap<SatelliteId, u64>,
    /// The station knows where it stands, so passes could be known.
    pub has_site: bool,
    /// Limits that are left.
    pub limits: Vec<LimitSeen>,
    /// The passes that ended last, of all satellites, in any order.
    pub passes: Vec<PassSeen>,
    /// Free space of the disk with the data folder, percent; `None`: not known.
    pub disk_free_percent: Option<f64>,
    /// Somebody says that the machine's clock is right; `None`: nobody was asked.
    pub clock_is_right: Option<bool>,
    /// What others found: backups, deliveries.
    pub reported: Vec<Condition>,
}

/// A value beyond a limit.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitSeen {
    /// Whose.
    pub satellite: SatelliteId,
    /// Which value.
    pub parameter: String,
    /// Its level.
    pub level: Level,
    /// The value that decided it.
    pub value: Option<f64>,
}

/// A pass that is over.
#[derive(Debug, Clone, PartialEq)]
pub struct PassSeen {
    /// Who passed.
    pub satellite: SatelliteId,
    /// Its begin.
    pub aos_at: UtcUs,
    /// Its end.
    pub los_at: UtcUs,
    /// How high it came, degrees.
    pub max_elevation_deg: f64,
}

/// All that holds now.
#[must_use]
pub fn judge(status: &Status, around: &Surroundings, thresholds: &Thresholds, now: UtcUs) -> Vec<Condition> {
    let mut found = Vec::new();
    for satellite in &status.satellites {
        found.extend(beacon(satellite, around, thresholds, now));
        found.extend(silence(satellite, around, thresholds, now));
        found.extend(elements(satellite, around, now));
    }
    found.extend(limits(around));
    found.extend(links(status));
    found.extend(machine(status, around, thresholds));
    found.extend(around.reported.iter().cloned());
    found
}

/// When time alone may change what [`judge`] finds: now in a pass, else when the next one begins. What takes days, as the
/// age of elements, is left out.
#[must_use]
pub fn next_judgement(status: &Status, now: UtcUs) -> Option<UtcUs> {
    let passes =
        status.satellites.iter().filter_map(|satellite| satellite.sky.as_ref()).flat_map(|sky| &sky.passes);
    let ahead = passes.filter(|pass| pass.los_at.is_none_or(|los| now < los));
    ahead.map(|pass| pass.aos_at.max(now)).min()
}

/// In view, and no frame for so many periods.
fn beacon(
    satellite: &SatelliteStatus,
    around: &Surroundings,
    thresholds: &Thresholds,
    now: UtcUs,
) -> Option<Condition> {
    let sky = satellite.sky.as_ref().filter(|sky| sky.fault.is_none() && sky.age.is_useful())?;
    let pass =
        sky.passes.iter().find(|pass| pass.aos_at <= now && pass.los_at.is_none_or(|los| now < los))?;
    if pass.max_elevation_deg < thresholds.min_elevation_deg {
        return None;
    }
    // As long as the elements may be wrong about AOS and LOS, silence there says nothing.
    let slack_us = (sky.age.timing_error_s.clamp(0.0, 120.0) * 1e6) as i64;
    if pass.los_at.is_some_and(|los| now.plus(slack_us) >= los) {
        return None;
    }
    let id = &satellite.satellite;
    let period_us = i64::try_from(*around.heartbeat_period_us.get(id)?).ok()?;
    let from = pass.aos_at.plus(slack_us);
    let from = satellite.heard_at.map_or(from, |heard| heard.max(from));
    let due = from.plus(period_us.saturating_mul(i64::from(thresholds.beacon_intervals.max(1))));
    if now < due {
        return None;
    }
    let overdue_s = now.0.saturating_sub(from.0).saturating_sub(period_us) / 1_000_000;
    let until = pass.los_at.map(|los| format!(" until {}", clock_time(los, now))).unwrap_or_default();
    let message = format!("{id} is in view{until}, and its beacon is overdue by {overdue_s} s");
    Some(Condition::new(AlertKind::Beacon, id.as_str(), Level::Warning, message).of(id))
}

/// No frame in the last passes.
fn silence(
    satellite: &SatelliteStatus,
    around: &Surroundings,
    thresholds: &Thresholds,
    now: UtcUs,
) -> Option<Condition> {
    let id = &satellite.satellite;
    let high =
        |pass: &&PassSeen| pass.satellite == *id && pass.max_elevation_deg >= thresholds.min_elevation_deg;
    let since = satellite.heard_at;
    let unheard = |pass: &&PassSeen| since.is_none_or(|heard| heard < pass.aos_at);
    let passes = around.passes.iter().filter(high).filter(unheard).count();
    let needed = thresholds.silent_passes.max(1) as usize;
    if passes < needed {
        return None;
    }
    let level = if passes >= 2 * needed { Level::Critical } else { Level::Distress };
    let last = since.map_or_else(
        || "it was never heard".to_owned(),
        |heard| format!("it was last heard {}", clock_time(heard, now)),
    );
    let message =
        format!("no frame of {id} in {passes} passes in a row; {last}. Look at antenna, radio and elements");
    Some(Condition::new(AlertKind::Silent, id.as_str(), level, message).of(id))
}

/// Elements that are old, tell nothing, or are not there.
fn elements(satellite: &SatelliteStatus, around: &Surroundings, now: UtcUs) -> Option<Condition> {
    let id = &satellite.satellite;
    let told = |level, message| Some(Condition::new(AlertKind::Elements, id.as_str(), level, message).of(id));
    let Some(sky) = &satellite.sky else {
        let remedy = "its passes are not known. Add some with `gs-server elements add`";
        return around
            .has_site
            .then(|| told(Level::Watch, format!("there are no elements of {id}: {remedy}")))
            .flatten();
    };
    if let Some(fault) = &sky.fault {
        return told(
            Level::Distress,
            format!("the elements of {id} tell no passes: {fault}. Add newer ones"),
        );
    }
    // The status is as old as its last change; the age goes on.
    let age = crate::sky::ElementsAge::at(&sky.elements.elements, now);
    if age.level == Level::Normal {
        return None;
    }
    let message = format!(
        "the elements of {id} are {:.0} days old: expect passes to be off by {:.0} s. Add newer ones",
        age.age_days, age.timing_error_s
    );
    told(age.level, message)
}

fn limits(around: &Surroundings) -> impl Iterator<Item = Condition> {
    around.limits.iter().filter(|limit| limit.level > Level::Normal).map(|limit| {
        let value = limit.value.map_or_else(|| "invalid".to_owned(), |value| format!("{value}"));
        let LimitSeen { satellite, parameter, level, .. } = limit;
        let message = format!("{parameter} of {satellite} is {value}, beyond its limit for {level}");
        Condition::new(AlertKind::Limit, format!("{satellite} {parameter}"), *level, message).of(satellite)
    })
}

fn links(status: &Status) -> impl Iterator<Item = Condition> {
    status.links.iter().filter_map(|link| {
        let (LinkState::Unavailable { reason } | LinkState::Failed { reason }) = &link.state else {
            return None;
        };
        let message = format!("link {} is {}: {reason}", link.link, link.state.name());
        let condition = Condition::new(AlertKind::Link, link.link.as_str(), Level::Warning, message);
        Some(condition.of(&link.satellite))
    })
}

fn machine(status: &Status, around: &Surroundings, thresholds: &Thresholds) -> Vec<Condition> {
    let station = status.station.as_str();
    let mut found = Vec::new();
    if let Some(fault) = status.antenna.as_ref().and_then(|antenna| antenna.fault.as_ref()) {
        let message = format!("the rotator: {fault}");
        found.push(Condition::new(AlertKind::Rotator, station, Level::Warning, message));
    }
    for sealing in &status.sealing {
        if let Some(locked) = &sealing.locked {
            let message = format!("nothing is sealed for {}: {locked}", sealing.satellite);
            let condition =
                Condition::new(AlertKind::Sealing, sealing.key.to_string(), Level::Distress, message);
            found.push(condition.of(&sealing.satellite));
        }
    }
    if let Some(failing) = &status.storage.failing {
        let message = format!("the archive takes nothing: {failing}");
        found.push(Condition::new(AlertKind::Storage, "archive", Level::Critical, message));
    }
    if around.clock_is_right == Some(false) {
        let message = "nobody says that this machine's clock is right: look at its time service (timedatectl), or vouch for it";
        found.push(Condition::new(AlertKind::Clock, station, Level::Warning, message));
    }
    if let Some(free) = around.disk_free_percent {
        let [watch, warning, critical] = thresholds.disk_free_percent;
        let level = match free {
            free if free < critical => Level::Critical,
            free if free < warning => Level::Warning,
            free if free < watch => Level::Watch,
            _ => Level::Normal,
        };
        if level > Level::Normal {
            let message =
                format!("the disk with the data folder is {free:.1} % free: make room, or move the folder");
            found.push(Condition::new(AlertKind::Disk, "data", level, message));
        }
    }
    found
}
