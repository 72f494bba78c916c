//! The antenna follows the schedule.
//!
//! [`target()`] says whom to follow, and knows nothing but the engine's status; [`Steering`] tells rotator and rig, and tells
//! the engine how the rotator is, so that it is said before a pass and not after it.
//!
//! It does **not** know how to turn an antenna (`hamlib` does) or when to transmit (the engine does).

mod target;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use mission::schedule::Window;
use mission::{Site, StationConfig, UtcUs};
use tokio_util::sync::CancellationToken;

use crate::clock::Timer;
use crate::config::RotatorSection;
use crate::engine::{EngineHandle, EngineInbox, EngineMessage};
use crate::hamlib::{AntennaHandle, Tracking};
use target::{Rules, Target, target};

/// How often it is looked at, besides at every change of the engine's status, microseconds.
const LOOK_US: u64 = 1_000_000;
/// An antenna that must turn all the way round is told this much earlier than that takes, s.
const SPARE_S: f64 = 60.0;
/// A rig alone is told this much before AOS, s.
const RIG_LEAD_S: f64 = 60.0;

/// What steers the antenna for the server's whole life.
pub(crate) struct Steering {
    site: Option<Site>,
    rules: Rules,
    engine: EngineHandle,
    inbox: EngineInbox,
    antenna: AntennaHandle,
    timer: Arc<dyn Timer>,
    told: Option<Target>,
    /// What the engine was told of the rotator: nothing yet, or what is wrong with it.
    reported: Option<Option<String>>,
}

/// Where the station stands and when it is closed, of its configuration.
pub(crate) struct Place {
    site: Option<Site>,
    blackouts: Vec<Window>,
}

impl Place {
    /// Of the station.
    pub(crate) fn of(station: &StationConfig) -> Self {
        let blackouts = station.times.blackouts.iter().map(|(window, _)| *window).collect();
        Self { site: station.site.clone(), blackouts }
    }
}

impl Steering {
    /// Steers this antenna by this engine's status.
    pub(crate) fn new(
        place: Place,
        rotator: Option<&RotatorSection>,
        engine: EngineHandle,
        inbox: EngineInbox,
        antenna: AntennaHandle,
    ) -> Self {
        let Place { site, blackouts } = place;
        if site.is_none() {
            tracing::warn!(
                "there is an antenna to steer and nobody said where it stands: it stays where it is; give \
                 station.latitude_deg and station.longitude_deg"
            );
        }
        let rules = Rules { blackouts, lead_us: lead_us(rotator) };
        let timer = Arc::clone(&engine.timer);
        Self { site, rules, engine, inbox, antenna, timer, told: None, reported: None }
    }

    /// Until `stop`, or until the engine ends; then nobody is followed any more, and the antenna parks.
    pub(crate) async fn run(mut self, stop: CancellationToken) {
        let mut status = self.engine.status_changes();
        let mut awake = self.timer.busy("steering");
        loop {
            let now = self.timer.now();
            let news = Arc::clone(&status.borrow_and_update());
            self.follow(&news, now.utc);
            self.report().await;
            let sleep = self.timer.sleep_until(now.mono.plus(LOOK_US));
            drop(awake);
            awake = tokio::select! {
                biased;
                () = stop.cancelled() => break,
                changed = status.changed() => match changed {
                    Ok(()) => self.timer.busy("steering"),
                    Err(_) => break,
                },
                token = sleep => token,
            };
        }
        self.antenna.release();
        // Who ends before being told to counts as dead.
        stop.cancelled().await;
    }

    fn follow(&mut self, status: &mission::Status, now: UtcUs) {
        let Some(site) = &self.site else { return };
        let Some(wanted) = target(status, &self.rules, now, self.told.as_ref()) else {
            if self.told.take().is_some() {
                self.antenna.release();
            }
            return;
        };
        if let Some(told) = self.told.as_mut().filter(|told| told.is_as(&wanted, now)) {
            // The times stay as they were told, so that small steps do not add up unseen.
            told.gives_way = wanted.gives_way;
            return;
        }
        let (satellite, elements) = (&wanted.satellite, wanted.set.id.0);
        let until = mission::sky::clock_time(wanted.los, now);
        tracing::info!(%satellite, elements, "the antenna follows {satellite} until {until}, by elements {elements}");
        self.antenna.track(Tracking {
            satellite: wanted.satellite.clone(),
            elements: Arc::clone(&wanted.set.elements),
            site: site.clone(),
            aos: wanted.aos,
            los: wanted.los,
            downlink_hz: None,
            uplink_hz: None,
        });
        self.told = Some(wanted);
    }

    /// Tells the engine what is wrong with the rotator, when that begins, changes and ends.
    async fn report(&mut self) {
        let Some(rotator) = self.antenna.status().rotator else { return };
        if !rotator.is_connected && rotator.trouble.is_none() {
            return;
        }
        let fault = rotator.trouble.as_ref().map(|trouble| trouble.text.clone());
        if self.reported.as_ref() != Some(&fault) {
            self.reported = Some(fault.clone());
            self.inbox.send(EngineMessage::Antenna { fault }).await;
        }
    }
}

/// How long before AOS an antenna must know: what turning all the way round takes, and some more.
#[expect(
    clippy::cast_possible_truncation,
    reason = "rates are above 0, as the configuration's check sees to"
)]
fn lead_us(rotator: Option<&RotatorSection>) -> i64 {
    let takes_s = |(first, last): (f64, f64), rate_deg_s: f64| (last - first).abs() / rate_deg_s;
    let lead_s = rotator.map_or(RIG_LEAD_S, |section| {
        takes_s(section.azimuth_range, section.azimuth_rate_deg_s)
            .max(takes_s(section.elevation_range, section.elevation_rate_deg_s))
            + SPARE_S
    });
    (lead_s * 1e6) as i64
}
