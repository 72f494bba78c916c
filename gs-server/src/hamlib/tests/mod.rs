//! Against daemons that misbehave on purpose, in stepped time, and against the real ones, through whole passes.

mod daemon;
mod exchanges;
mod real;
mod rotator;
mod tuning;

use std::sync::Arc;
use std::time::Duration;

use mission::pointing::look_at;
use mission::{Clock as _, MonoUs, SatelliteId, Site, UtcUs};
use tle::formats::{Checksums, sets};
use tle::passes::{Pass, PassFinder, PassSearch};
use tle::{EarthOrientation, Elements, Propagator, Station, UtcInstant};
use tokio_util::sync::CancellationToken;

use super::*;
use crate::clock::{BusyToken, SteppedClock, SteppedOptions, Timer};

/// The elements of the tests, and a day on which they are good.
pub(super) fn elements() -> Elements {
    let text = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
                2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";
    sets(text, Checksums::Strict).unwrap().next().unwrap().unwrap().elements
}

pub(super) fn site() -> Site {
    Site {
        place: Station::new(46.5191, 6.5668, 410.0).unwrap(),
        min_elevation_deg: 0.0,
        orientation: EarthOrientation::UT1_IS_UTC,
    }
}

pub(super) fn passes() -> Vec<Pass> {
    let start: UtcInstant = "2020-07-13T00:00:00Z".parse().unwrap();
    let search = PassSearch::new(start, start.plus_seconds(2.0 * 86_400.0), 0.0);
    PassFinder::new(&elements()).unwrap().find(&[site().place], &search).unwrap().stations.remove(0)
}

/// A pass of this height, degrees.
pub(super) fn pass(least_deg: f64, most_deg: f64) -> Pass {
    let fits = |pass: &Pass| (least_deg..most_deg).contains(&pass.tca.look.elevation_deg);
    passes().into_iter().find(fits).expect("a pass of that height")
}

pub(super) fn tracking(pass: &Pass) -> Tracking {
    Tracking {
        satellite: SatelliteId::new("iss").unwrap(),
        elements: Arc::new(elements()),
        site: site(),
        aos: UtcUs(pass.aos.at.unix_us()),
        los: UtcUs(pass.los.at.unix_us()),
        downlink_hz: None,
        uplink_hz: None,
    }
}

/// Where the satellite is.
pub(super) fn direction(at: UtcUs) -> mission::pointing::Direction {
    let look = look_at(&Propagator::new(&elements()).unwrap(), &site(), at).unwrap();
    mission::pointing::Direction::new(look.azimuth_deg, look.elevation_deg)
}

/// A station in stepped time: a clock that stands still until everybody waits, and the tasks under test.
pub(super) struct Bench {
    pub(super) clock: SteppedClock,
    pub(super) timer: Arc<dyn Timer>,
    pub(super) handle: Option<AntennaHandle>,
    pub(super) stop: CancellationToken,
    tasks: Vec<tokio::task::JoinHandle<()>>,
    /// Time passes only in [`Bench::until`]: what a test does in between happens at one instant.
    held: std::sync::Mutex<Option<BusyToken>>,
}

impl Bench {
    /// A clock that shows this time.
    pub(super) fn clock(utc: UtcUs) -> (SteppedClock, Arc<dyn Timer>) {
        let clock = SteppedClock::new(SteppedOptions { utc_at_origin: utc, speed: None }).unwrap();
        (clock.clone(), Arc::new(clock))
    }

    pub(super) fn start(
        clock: SteppedClock,
        timer: Arc<dyn Timer>,
        rotator: Option<&crate::config::RotatorSection>,
        rig: Option<&crate::config::RigSection>,
    ) -> Self {
        let held = std::sync::Mutex::new(Some(timer.busy("test")));
        let (handle, tasks) = antenna(rotator, rig, &timer).unwrap();
        let stop = CancellationToken::new();
        let tasks = tasks.into_iter().map(|task| tokio::spawn(task.run(stop.clone()))).collect();
        Self { clock, timer, handle: Some(handle), stop, tasks, held }
    }

    pub(super) fn handle(&self) -> &AntennaHandle {
        self.handle.as_ref().unwrap()
    }

    pub(super) fn rotator(&self) -> Arc<RotatorStatus> {
        self.handle().status().rotator.unwrap()
    }

    pub(super) fn rig(&self) -> Arc<RigStatus> {
        self.handle().status().rig.unwrap()
    }

    /// Lets time pass until this instant, calling `look` every second, half a second after the tasks looked.
    pub(super) async fn until(&self, at: UtcUs, mut look: impl FnMut(&Self, UtcUs)) {
        while self.clock.now().utc < at {
            let next = MonoUs((self.clock.now().mono.0 / 1_000_000 + 1) * 1_000_000 + 500_000);
            let sleep = self.timer.sleep_until(next);
            drop(self.held.lock().unwrap().take());
            let awake = sleep.await;
            look(self, self.clock.now().utc);
            *self.held.lock().unwrap() = Some(awake);
        }
    }

    pub(super) async fn seconds(&self, seconds: i64) {
        let at = self.clock.now().utc.plus(seconds * 1_000_000);
        self.until(at, |_, _| {}).await;
    }

    /// Ends the tasks; how long that took in wall time.
    pub(super) async fn end(self) -> Duration {
        let began = wall();
        self.stop.cancel();
        for task in self.tasks {
            task.await.unwrap();
        }
        began.elapsed()
    }
}

#[expect(clippy::disallowed_methods, reason = "the end of a task is measured in wall time")]
pub(super) fn wall() -> std::time::Instant {
    std::time::Instant::now()
}
