//! `GET /api/v1/antenna`: where the antenna looks, what the rig is tuned to, what the radio bears.

use api::{AntennaView, AxesView, DopplerView, RigView, RotatorPass, RotatorView};
use axum::Json;
use axum::extract::State;
use mission::pointing::{Position, doppler_margin, look_at};
use mission::{LinkId, PassAhead, SatelliteId, Site, StationConfig, Status, UtcUs};
use radio::airtime::{LoraPhy, MAX_FRAME_BYTES};
use tle::{Propagator, doppler};

use super::App;
use super::extract::time;
use crate::config::Config;
use crate::hamlib::{Goal, RigStatus, RotatorStatus, RouteStatus, Trouble};

/// What both ends' oscillators may be off by together, Hz.
const OSCILLATORS_HZ: f64 = 1_000.0;
/// Between two looks for the rate of the shift, microseconds.
const APART_US: i64 = 1_000_000;

/// A radio that stays on one frequency within a pass.
#[derive(Debug, Clone, PartialEq)]
pub struct RadioOnAir {
    /// The link.
    pub link: LinkId,
    /// Whom it hears.
    pub satellite: SatelliteId,
    /// What is on the air.
    pub phy: LoraPhy,
    /// Its carrier, Hz.
    pub frequency_hz: f64,
}

impl RadioOnAir {
    /// The radios of a station: what only replays a file has none.
    #[must_use]
    pub fn of(station: &StationConfig, config: &Config) -> Vec<Self> {
        let radio = |link: &mission::LinkConfig| {
            let section = config.links.iter().find(|section| section.name == link.id.as_str())?;
            Some(Self {
                link: link.id.clone(),
                satellite: link.satellite.clone(),
                phy: link.timing.phy,
                frequency_hz: f64::from(section.frequency_hz),
            })
        };
        station.links.iter().filter(|link| !link.receive_only).filter_map(radio).collect()
    }
}

pub(super) async fn get(State(app): State<App>) -> Json<AntennaView> {
    Json(view(&app, &app.state.engine.status()))
}

/// For the station's view: nothing when there is neither rotator nor rig.
pub(super) fn of_station(app: &App, status: &Status) -> Option<Box<AntennaView>> {
    let found = app.state.antenna.status();
    (found.rotator.is_some() || found.rig.is_some()).then(|| Box::new(view(app, status)))
}

fn view(app: &App, status: &Status) -> AntennaView {
    let found = app.state.antenna.status();
    let now = app.state.timer.now().utc;
    let site = app.state.identity.site.as_ref();
    let radios = app.state.radios.iter();
    AntennaView {
        rotator: found.rotator.as_deref().map(rotator_view),
        rig: found.rig.as_deref().map(rig_view),
        doppler: radios.filter_map(|radio| doppler_view(radio, status, site?, now)).collect(),
    }
}

const fn axes(position: Position) -> AxesView {
    AxesView { azimuth_deg: position.azimuth_deg, elevation_deg: position.elevation_deg }
}

fn at(utc: Option<UtcUs>) -> Option<api::Time> {
    utc.map(|utc| time(utc.0))
}

fn fault(trouble: Option<&Trouble>) -> (Option<String>, Option<api::Time>) {
    (trouble.map(|trouble| trouble.text.clone()), at(trouble.map(|trouble| trouble.since)))
}

fn rotator_view(status: &RotatorStatus) -> RotatorView {
    let state = match status.goal {
        Goal::Idle => "idle",
        Goal::Waiting { .. } => "waiting",
        Goal::Preparing => "preparing",
        Goal::Tracking => "tracking",
        Goal::Parking => "parking",
        Goal::Parked => "parked",
        Goal::Stopped => "stopped",
    };
    let (fault, fault_since) = fault(status.trouble.as_ref());
    RotatorView {
        address: status.address.clone(),
        connected: status.is_connected,
        info: status.info.clone(),
        state: state.to_owned(),
        state_since: at(status.goal_since),
        parked_since: at(status.goal_since.filter(|_| status.goal == Goal::Parked)),
        position: status.position.map(axes),
        position_at: at(status.position_at),
        target: status.target.map(axes),
        moving: status.is_moving,
        on_target: status.is_on_target,
        pass: status.route.as_ref().map(pass_view),
        fault,
        fault_since,
        commands: status.commands,
    }
}

fn pass_view(route: &RouteStatus) -> RotatorPass {
    RotatorPass {
        satellite: route.satellite.to_string(),
        aos: time(route.begins.0),
        los: time(route.ends.0),
        leaves_at: time(route.leaves.0),
        start: axes(route.start),
        unwindings: route.unwindings.len() as u64,
        keyholes: route.keyholes.len() as u64,
    }
}

fn rig_view(status: &RigStatus) -> RigView {
    let (fault, fault_since) = fault(status.trouble.as_ref());
    RigView {
        address: status.address.clone(),
        connected: status.is_connected,
        info: status.info.clone(),
        satellite: status.satellite.as_ref().map(ToString::to_string),
        receive_hz: status.receive_hz,
        transmit_hz: status.transmit_hz,
        shift_hz: status.shift_hz,
        residual_hz: status.residual_hz,
        fault,
        fault_since,
        commands: status.commands,
    }
}

/// The shift is greatest at the ends of a pass and changes fastest in its middle.
fn doppler_view(radio: &RadioOnAir, status: &Status, site: &Site, now: UtcUs) -> Option<DopplerView> {
    let satellite = status.satellites.iter().find(|satellite| satellite.satellite == radio.satellite)?;
    let sky = satellite.sky.as_ref()?;
    let pass: &PassAhead = sky.passes.iter().find(|pass| !pass.is_over_at(now))?;
    let propagator = Propagator::new(&sky.elements.elements).ok()?;
    let shift = |at: UtcUs| {
        let rate_km_s = look_at(&propagator, site, at).ok()?.range_rate_km_s;
        Some(doppler::downlink_shift_hz(radio.frequency_hz, rate_km_s))
    };
    let (first, last) = (shift(pass.aos_at)?, shift(pass.los_at.unwrap_or(pass.tca_at))?);
    let (before, after) =
        (shift(pass.tca_at.plus(-APART_US / 2))?, shift(pass.tca_at.plus(APART_US - APART_US / 2))?);
    let margin = doppler_margin(
        &radio.phy,
        first.abs().max(last.abs()),
        (after - before) * 1e6 / APART_US as f64,
        radio.phy.time_on_air_us(MAX_FRAME_BYTES) as f64 / 1e6,
        OSCILLATORS_HZ,
    );
    // What is no number has no place on the wire.
    (margin.offset_share + margin.drift_share).is_finite().then(|| DopplerView {
        link: radio.link.to_string(),
        satellite: radio.satellite.to_string(),
        frequency_hz: radio.frequency_hz,
        aos: time(pass.aos_at.0),
        los: at(pass.los_at),
        shift_hz: shift(now).filter(|hz| hz.is_finite() && pass.lasts_at(now)),
        offset_hz: margin.offset_hz,
        allowed_offset_hz: margin.allowed_offset_hz,
        offset_share: margin.offset_share,
        drift_hz: margin.drift_hz,
        allowed_drift_hz: margin.allowed_drift_hz,
        drift_share: margin.drift_share,
    })
}
