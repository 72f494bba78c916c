//! `GET /api/v1/station`: how the station is right now.

use api::{
    ElementsInUse, ImageProgress, LinkView, NextPass, SatelliteView, SealingView, StationView, StorageView,
};
use axum::Json;
use axum::extract::State;
use mission::status::{LinkStatus, SatelliteStatus, SkyStatus};
use mission::{LinkState, PassAhead, Status, UtcUs};

use super::App;
use super::extract::time;
use super::problem::Failure;

pub(super) async fn get(State(app): State<App>) -> Result<Json<StationView>, Failure> {
    let last_sequence = app.state.store.last_event_seq().await?;
    Ok(Json(view(&app, &app.state.engine.status(), last_sequence)))
}

/// The status as the wire has it.
pub(super) fn view(app: &App, status: &Status, last_sequence: i64) -> StationView {
    let storage = &status.storage;
    StationView {
        station: status.station.to_string(),
        at: time(app.state.timer.now().utc.0),
        simulated: app.state.identity.simulated,
        last_sequence,
        satellites: status.satellites.iter().map(|satellite| satellite_view(app, satellite)).collect(),
        links: status.links.iter().map(link_view).collect(),
        sealing: status
            .sealing
            .iter()
            .map(|sealing| SealingView {
                key: sealing.key.to_string(),
                satellite: sealing.satellite.to_string(),
                locked: sealing.locked.clone(),
            })
            .collect(),
        storage: StorageView {
            failing: storage.failing.clone(),
            waiting: storage.waiting as u64,
            reserved: storage.reserved,
            unreserved: storage.unreserved,
            derived_dropped: storage.derived_dropped,
            frames_lost: storage.frames_lost,
        },
        antenna: super::antenna::of_station(app, status),
        demo: app.state.demo.clone(),
    }
}

fn satellite_view(app: &App, status: &SatelliteStatus) -> SatelliteView {
    let at = |utc: Option<UtcUs>| utc.map(|utc| time(utc.0));
    let identity = app.state.identity.satellites.iter().find(|known| known.id == status.satellite);
    // The beat that was just heard is not the next one, though its slot may still be open.
    let next_heartbeat_at = status.next_heartbeat_at.map(|next| match (status.heartbeat_at, identity) {
        (Some(heard), Some(known)) if heard >= next.plus(-known.heartbeat_period_us / 2) => {
            next.plus(known.heartbeat_period_us)
        }
        _ => next,
    });
    SatelliteView {
        satellite: status.satellite.to_string(),
        key: identity.and_then(|known| known.key).map(|key| key.to_string()),
        heard_at: at(status.heard_at),
        heartbeat_at: at(status.heartbeat_at),
        next_heartbeat_at: at(next_heartbeat_at),
        in_contact: status.in_contact,
        in_view: status.in_view,
        los_at: at(status.los_at),
        expectation: status.expectation.clone(),
        elements: status.sky.as_ref().map(elements_view),
        next_passes: status.sky.iter().flat_map(|sky| &sky.passes).map(next_pass).collect(),
        uplink: status.uplink.clone(),
        outstanding: status.outstanding.map(|id| id.0),
        queued: status.queued as u64,
        image: status.image.as_ref().map(|image| ImageProgress {
            image: image.image.0,
            held: image.held,
            chunks: image.chunks,
            conflicts: image.conflicts,
        }),
        download: status.download.map(|id| id.0),
    }
}

fn elements_view(sky: &SkyStatus) -> ElementsInUse {
    ElementsInUse {
        id: sky.elements.id.0,
        epoch: time(sky.elements.elements.epoch.unix_us()),
        age_days: sky.age.age_days,
        timing_error_s: sky.age.timing_error_s,
        level: sky.age.level.name().to_owned(),
        fault: sky.fault.clone(),
    }
}

fn next_pass(pass: &PassAhead) -> NextPass {
    NextPass {
        aos: time(pass.aos_at.0),
        tca: time(pass.tca_at.0),
        los: pass.los_at.map(|los| time(los.0)),
        max_elevation_deg: pass.max_elevation_deg,
        azimuths_deg: pass.azimuths_deg,
        elements: pass.elements.0,
    }
}

fn link_view(status: &LinkStatus) -> LinkView {
    LinkView {
        link: status.link.to_string(),
        satellite: status.satellite.to_string(),
        state: status.state.name().to_owned(),
        reason: match &status.state {
            LinkState::Unavailable { reason } | LinkState::Failed { reason } => Some(reason.clone()),
            LinkState::Ok | LinkState::Disabled => None,
        },
        armed: status.armed,
        on_air: status.on_air,
        frames: status.frames,
        skipped_bytes: status.skipped_bytes,
        bad: status.bad,
        radiated: status.radiated,
        airtime_ms: status.airtime_us / 1000,
        rssi_dbm: status.rssi_dbm,
    }
}
