//! The handle by which the rest of the server steers rotator and rig, their status, and the life of their tasks.

use std::future::Future;
use std::sync::Arc;

use futures_util::FutureExt as _;
use futures_util::future::BoxFuture;
use mission::pointing::{Keyhole, Position, Unwinding};
use mission::{SatelliteId, Site, UtcUs};
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use super::inbox::Inbox;
use super::tuning::Tuning;
use super::turning::Turning;
use crate::clock::Timer;
use crate::config::{RigSection, RotatorSection};

/// What is to be followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracking {
    /// Whom.
    pub satellite: SatelliteId,
    /// By these elements; newer ones are put into force by another [`AntennaHandle::track`], in the middle of a pass too.
    pub elements: Arc<tle::Elements>,
    /// From here.
    pub site: Site,
    /// From here on: the antenna stands there by then, if it is told early enough.
    pub aos: UtcUs,
    /// Up to here: afterwards it parks, whatever becomes of whoever said so.
    pub los: UtcUs,
    /// What the satellite sends on, Hz, for the rig; its configured downlink when `None`.
    pub downlink_hz: Option<f64>,
    /// What the satellite listens on, Hz, for the rig; its configured uplink when `None`.
    pub uplink_hz: Option<f64>,
}

#[derive(Debug, Clone)]
pub(super) enum Wish {
    Track(Arc<Tracking>),
    Release,
    Park,
    Stop,
}

/// What a rotator is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Goal {
    /// Nothing was asked of it.
    #[default]
    Idle,
    /// It stays where it is until it must leave for the place of the next AOS.
    Waiting {
        /// When it leaves.
        until: UtcUs,
    },
    /// It turns to where the pass begins, or stands there.
    Preparing,
    /// It follows.
    Tracking,
    /// It is on its way to where it rests.
    Parking,
    /// It rests.
    Parked,
    /// It was stopped and stays where it is.
    Stopped,
}

/// What is wrong, and since when it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trouble {
    /// A sentence with the remedy.
    pub text: String,
    /// Since when something is wrong without a break.
    pub since: UtcUs,
}

/// The way that was chosen for a pass.
#[derive(Debug, Clone, PartialEq)]
pub struct RouteStatus {
    /// Whose pass.
    pub satellite: SatelliteId,
    /// Where the antenna must stand when it begins.
    pub start: Position,
    /// AOS, or when it was told if that was later.
    pub begins: UtcUs,
    /// LOS.
    pub ends: UtcUs,
    /// When it must leave, or had to.
    pub leaves: UtcUs,
    /// Where it must turn round in the middle.
    pub unwindings: Vec<Unwinding>,
    /// Where it will not look at the satellite.
    pub keyholes: Vec<Keyhole>,
}

/// A rotator as it is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RotatorStatus {
    /// Host and port of its daemon.
    pub address: String,
    /// The daemon answers.
    pub is_connected: bool,
    /// What it calls itself.
    pub info: Option<String>,
    /// What it is doing.
    pub goal: Goal,
    /// Since when; `None` before the first look.
    pub goal_since: Option<UtcUs>,
    /// Where it stands, when that could be read.
    pub position: Option<Position>,
    /// When that was read.
    pub position_at: Option<UtcUs>,
    /// Where it was last told to be.
    pub target: Option<Position>,
    /// Its position changes.
    pub is_moving: bool,
    /// It is where it was told to be.
    pub is_on_target: bool,
    /// The way through the coming or present pass.
    pub route: Option<RouteStatus>,
    /// What is wrong.
    pub trouble: Option<Trouble>,
    /// Positions that were commanded and accepted since the start.
    pub commands: u64,
}

/// A rig as it is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RigStatus {
    /// Host and port of its daemon.
    pub address: String,
    /// The daemon answers.
    pub is_connected: bool,
    /// What it calls itself.
    pub info: Option<String>,
    /// Whose Doppler shift it follows.
    pub satellite: Option<SatelliteId>,
    /// What its receiver was read to be set to, Hz.
    pub receive_hz: Option<f64>,
    /// What its transmitter was read to be set to, Hz.
    pub transmit_hz: Option<f64>,
    /// The downlink's Doppler shift now, Hz.
    pub shift_hz: Option<f64>,
    /// What the receiver is off by, Hz.
    pub residual_hz: Option<f64>,
    /// What is wrong.
    pub trouble: Option<Trouble>,
    /// Frequencies that were set and read back since the start.
    pub commands: u64,
}

/// Rotator and rig, as far as there are any.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AntennaStatus {
    /// The rotator.
    pub rotator: Option<Arc<RotatorStatus>>,
    /// The rig.
    pub rig: Option<Arc<RigStatus>>,
}

/// Steers rotator and rig. Without either it does nothing, so nobody has to ask whether there is one.
///
/// The last wish counts. When the last handle is dropped the antenna parks.
#[derive(Clone)]
pub struct AntennaHandle {
    doors: Arc<Doors>,
}

struct Doors {
    inboxes: Vec<Arc<Inbox<Wish>>>,
    rotator: Option<watch::Receiver<Arc<RotatorStatus>>>,
    rig: Option<watch::Receiver<Arc<RigStatus>>>,
}

impl Drop for Doors {
    fn drop(&mut self) {
        for inbox in &self.inboxes {
            inbox.close();
        }
    }
}

impl AntennaHandle {
    /// Follows a satellite: in place at AOS, tuned, parked after LOS. Told again with newer elements it goes on by those.
    pub fn track(&self, tracking: Tracking) {
        self.wish(&Wish::Track(Arc::new(tracking)));
    }

    /// Nobody needs it any more: what was following ends, and parks; an antenna that was not moved stays where it is.
    pub fn release(&self) {
        self.wish(&Wish::Release);
    }

    /// Parks now.
    pub fn park(&self) {
        self.wish(&Wish::Park);
    }

    /// Stops where it is, within two seconds, and stays.
    pub fn stop(&self) {
        self.wish(&Wish::Stop);
    }

    /// As it is now.
    #[must_use]
    pub fn status(&self) -> AntennaStatus {
        AntennaStatus {
            rotator: self.doors.rotator.as_ref().map(|status| Arc::clone(&status.borrow())),
            rig: self.doors.rig.as_ref().map(|status| Arc::clone(&status.borrow())),
        }
    }

    /// Tells of changes of the rotator, when there is one.
    #[must_use]
    pub fn rotator_changes(&self) -> Option<watch::Receiver<Arc<RotatorStatus>>> {
        self.doors.rotator.clone()
    }

    /// Tells of changes of the rig, when there is one.
    #[must_use]
    pub fn rig_changes(&self) -> Option<watch::Receiver<Arc<RigStatus>>> {
        self.doors.rig.clone()
    }

    fn wish(&self, wish: &Wish) {
        for inbox in &self.doors.inboxes {
            inbox.put(wish.clone());
        }
    }
}

/// A task that the server runs for its whole life.
pub struct AntennaTask {
    name: &'static str,
    run: Box<dyn FnOnce(CancellationToken) -> BoxFuture<'static, ()> + Send>,
}

impl AntennaTask {
    /// `rotator` or `rig`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Runs until `stop`; then an antenna that was moved is stopped and sent to park, and a rig that was tuned gets its
    /// nominal frequency back. That takes 2.2 s at most.
    pub async fn run(self, stop: CancellationToken) {
        (self.run)(stop).await;
    }

    fn of<F: Follower + 'static>(name: &'static str, follower: F, timer: Arc<dyn Timer>) -> Self {
        Self { name, run: Box::new(move |stop| live(follower, timer, stop).boxed()) }
    }
}

/// A handle, and the tasks behind it: one per section that is there.
///
/// # Errors
/// [`mission::pointing::MountFault`] for a rotator that cannot be; not after [`crate::config::Config::check`].
pub fn antenna(
    rotator: Option<&RotatorSection>,
    rig: Option<&RigSection>,
    timer: &Arc<dyn Timer>,
) -> Result<(AntennaHandle, Vec<AntennaTask>), mission::pointing::MountFault> {
    let mut doors = Doors { inboxes: Vec::new(), rotator: None, rig: None };
    let mut tasks = Vec::new();
    if let Some(section) = rotator {
        let inbox = Arc::new(Inbox::new(Arc::clone(timer)));
        let (turning, status) = Turning::new(section, Arc::clone(&inbox), Arc::clone(timer))?;
        doors.inboxes.push(inbox);
        doors.rotator = Some(status);
        tasks.push(AntennaTask::of("rotator", turning, Arc::clone(timer)));
    }
    if let Some(section) = rig {
        let inbox = Arc::new(Inbox::new(Arc::clone(timer)));
        let (tuning, status) = Tuning::new(section, Arc::clone(&inbox), Arc::clone(timer));
        doors.inboxes.push(inbox);
        doors.rig = Some(status);
        tasks.push(AntennaTask::of("rig", tuning, Arc::clone(timer)));
    }
    Ok((AntennaHandle { doors: Arc::new(doors) }, tasks))
}

/// What the life of a task is made of.
pub(super) trait Follower: Send {
    /// Where its wishes come in.
    fn inbox(&self) -> &Arc<Inbox<Wish>>;

    /// Looks at wishes, time and device, and does what is next. May be dropped in the middle.
    fn tick(&mut self) -> impl Future<Output = ()> + Send;

    /// When to look again, microseconds from now.
    fn pause_us(&self) -> u64;

    /// Leaves the device in a safe state, in 2.2 s of wall time at most.
    fn farewell(&mut self) -> impl Future<Output = ()> + Send;
}

async fn live<F: Follower>(mut follower: F, timer: Arc<dyn Timer>, stop: CancellationToken) {
    let inbox = Arc::clone(follower.inbox());
    let mut awake = timer.busy("start of the antenna");
    loop {
        tokio::select! {
            biased;
            () = stop.cancelled() => break,
            () = follower.tick() => {}
        }
        let sleep = timer.sleep_until(timer.now().mono.plus(follower.pause_us()));
        drop(awake);
        awake = tokio::select! {
            biased;
            () = stop.cancelled() => timer.busy("end of the antenna"),
            token = inbox.arrived() => token,
            token = sleep => token,
        };
    }
    follower.farewell().await;
    drop(awake);
}
