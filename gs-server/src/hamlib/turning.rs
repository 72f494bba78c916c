//! The rotator's task: in place before AOS, along the route, parked at the end, and honest about what goes wrong.

use std::sync::Arc;
use std::time::Duration;

use mission::pointing::{Mount, MountFault, Pointer, Position, Route, Start, sky_path};
use mission::{MonoUs, Now};
use tokio::sync::watch;

use super::antenna::{Follower, Goal, RotatorStatus, RouteStatus, Tracking, Trouble, Wish};
use super::connection::Patience;
use super::error::HamlibError;
use super::inbox::Inbox;
use super::rotator::RotatorClient;
use crate::clock::{Timer, within};
use crate::config::RotatorSection;

/// How often it is looked at while it has something to do, microseconds.
const POLL_US: u64 = 1_000_000;
/// How often while it has not.
const IDLE_POLL_US: u64 = 5_000_000;
/// The pauses between attempts to connect, s.
pub(super) const RECONNECT_S: (u64, u64) = (1, 30);
/// In place this much before AOS, s: rotators start and stop softly, and rates are rounded.
const SPARE_S: f64 = 15.0;
/// What stopping and parking may take at the end.
pub(super) const FAREWELL: Duration = Duration::from_millis(2_200);
/// What a connection may take at the end.
pub(super) const FAREWELL_CONNECT: Duration = Duration::from_millis(700);

enum Job {
    Idle,
    Follow { tracking: Arc<Tracking>, route: Option<Route>, is_planned_from_reading: bool },
    Park { is_accepted: bool, seconds_at_rest: u32 },
    Parked,
    Stop,
    Stopped,
}

pub(super) struct Turning {
    address: String,
    patience: Patience,
    configured: Mount,
    timer: Arc<dyn Timer>,
    inbox: Arc<Inbox<Wish>>,
    publisher: watch::Sender<Arc<RotatorStatus>>,
    status: RotatorStatus,
    client: Option<RotatorClient>,
    connect_at: MonoUs,
    pause_s: u64,
    pointer: Pointer,
    job: Job,
    /// We moved it since it last was parked or stopped: it is ours to park.
    is_moved: bool,
    is_abandoned: bool,
    /// Why the last wish could not be fulfilled; stays until the next one.
    failure: Option<String>,
}

impl Turning {
    pub(super) fn new(
        section: &RotatorSection,
        inbox: Arc<Inbox<Wish>>,
        timer: Arc<dyn Timer>,
    ) -> Result<(Self, watch::Receiver<Arc<RotatorStatus>>), MountFault> {
        let configured = section.mount()?;
        let status = RotatorStatus { address: section.address.clone(), ..RotatorStatus::default() };
        let (publisher, receiver) = watch::channel(Arc::new(status.clone()));
        let turning = Self {
            address: section.address.clone(),
            patience: Patience {
                reply: Duration::from_millis(section.reply_timeout_ms.into()),
                ..Patience::default()
            },
            configured,
            timer,
            inbox,
            publisher,
            status,
            client: None,
            connect_at: MonoUs(0),
            pause_s: RECONNECT_S.0,
            pointer: Pointer::new(configured),
            job: Job::Idle,
            is_moved: false,
            is_abandoned: false,
            failure: None,
        };
        Ok((turning, receiver))
    }

    fn accept(&mut self, wish: Wish) {
        self.status.route = None;
        self.status.goal = Goal::Idle;
        self.job = match wish {
            Wish::Track(tracking) => Job::Follow { tracking, route: None, is_planned_from_reading: false },
            Wish::Release if !self.is_moved => Job::Idle,
            Wish::Release | Wish::Park => Job::Park { is_accepted: false, seconds_at_rest: 0 },
            Wish::Stop => Job::Stop,
        };
    }

    /// What is wrong without the connection being broken, if anything.
    async fn work(&mut self, now: Now) -> Result<Option<String>, HamlibError> {
        if self.client.is_none() {
            if now.mono < self.connect_at {
                return Ok(self.status.trouble.take().map(|trouble| trouble.text));
            }
            self.connect(now).await?;
        }
        let Some(client) = &mut self.client else { return Ok(None) };
        let mut trouble = None;
        if matches!(self.job, Job::Stop) {
            // Before anything is read: somebody stands under the antenna.
            client.stop().await?;
            self.pointer.forget();
            self.job = Job::Stopped;
            self.is_moved = false;
        }
        let reading = match client.position().await {
            Ok(position) => Some(position),
            Err(error) if error.breaks_connection() => return Err(error),
            Err(error) => {
                trouble = Some(error.told());
                None
            }
        };
        if let Some(position) = reading {
            trouble = self.observe(now, position);
        } else {
            (self.status.is_moving, self.status.is_on_target) = (false, false);
        }
        match self.step(now, reading).await {
            Ok(told) => Ok(told.or(trouble)),
            // Told again at the next look: nothing of it was taken.
            Err(error) if !error.breaks_connection() => {
                self.pointer.forget();
                Ok(Some(error.told()))
            }
            Err(error) => Err(error),
        }
    }

    async fn connect(&mut self, now: Now) -> Result<(), HamlibError> {
        // Should this be dropped in the middle, it is not tried again at once.
        self.connect_at = now.mono.plus(self.pause_s * 1_000_000);
        let client = RotatorClient::connect(&self.address, self.patience, &self.timer).await?;
        let mut mount = self.configured;
        if let Some(limits) = client.limits() {
            match mount.held_to(limits.azimuth_deg, limits.elevation_deg) {
                Ok(held) => mount = held,
                Err(fault) => {
                    tracing::warn!("the rotator's own limits do not go with the configuration: {fault}")
                }
            }
        }
        let info = client.info().map(str::to_owned);
        tracing::info!(address = %self.address, "rotator {} at {}", info.as_deref().unwrap_or("without a name"), self.address);
        if mount != *self.pointer.mount()
            && let Job::Follow { route, .. } = &mut self.job
        {
            *route = None;
        }
        self.pointer = Pointer::new(mount);
        self.status.info = info;
        self.status.is_connected = true;
        self.pause_s = RECONNECT_S.0;
        self.client = Some(client);
        if let Job::Park { is_accepted, .. } = &mut self.job {
            *is_accepted = false;
        }
        Ok(())
    }

    fn observe(&mut self, now: Now, position: Position) -> Option<String> {
        let before = self.status.position.replace(position);
        self.status.position_at = Some(now.utc);
        let seen = self.pointer.observe(now.mono, position);
        self.status.is_moving = seen.is_moving;
        self.status.is_on_target = seen.is_on_target;
        let stands = format!("azimuth {:.1}, elevation {:.1}", position.azimuth_deg, position.elevation_deg);
        if seen.has_jumped {
            let from = before.map_or(0.0, |before| before.azimuth_deg);
            return Some(format!(
                "the rotator's position jumped from azimuth {from:.1} to {stands}: check its sensor and its cable"
            ));
        }
        if seen.is_stuck {
            let target = self.pointer.target().map_or(0.0, |target| target.azimuth_deg);
            return Some(format!(
                "the rotator stands at {stands} and does not turn to azimuth {target:.1}: check its power, its brake and \
                 its end stops"
            ));
        }
        let mount = self.pointer.mount();
        let outside = mount
            .clamp(position)
            .is_none_or(|inside| inside.way_deg(position) > mount.settings().dead_band_deg.max(1.0));
        outside.then(|| {
            format!("the rotator stands at {stands}, outside its configured range: calibrate it, or correct the range")
        })
    }

    async fn step(&mut self, now: Now, reading: Option<Position>) -> Result<Option<String>, HamlibError> {
        let ends = match &self.job {
            Job::Follow { tracking, .. } => tracking.los < now.utc,
            _ => false,
        };
        if ends {
            self.accept(Wish::Release);
        }
        let Some(client) = &mut self.client else { return Ok(None) };
        let mount = *self.pointer.mount();
        match &mut self.job {
            Job::Idle | Job::Parked | Job::Stop | Job::Stopped => {}
            Job::Follow { tracking, route, is_planned_from_reading } => {
                if route.is_none() || (reading.is_some() && !*is_planned_from_reading) {
                    *is_planned_from_reading = reading.is_some();
                    let path = match sky_path(
                        &tracking.elements,
                        &tracking.site,
                        tracking.aos.max(now.utc),
                        tracking.los,
                    ) {
                        Ok(path) => path,
                        Err(error) => {
                            let told = format!(
                                "{} cannot be followed: {error}; give newer elements",
                                tracking.satellite
                            );
                            self.accept(Wish::Release);
                            self.failure = Some(told);
                            return Ok(None);
                        }
                    };
                    let start = reading.map(|position| Start { at: now.utc, position });
                    *route = Route::plan(&mount, &path, start);
                    self.status.route = route.as_ref().map(|route| told_of(route, tracking, &mount, reading));
                }
                let Some(route) = route else { return Ok(None) };
                let leaves = route.leave_at(&mount, reading.or(self.status.position), SPARE_S);
                let at_aos = now.utc < tracking.aos;
                if now.utc < leaves && !matches!(self.status.goal, Goal::Preparing | Goal::Tracking) {
                    self.status.goal = Goal::Waiting { until: leaves };
                    return Ok(None);
                }
                self.status.goal = if at_aos { Goal::Preparing } else { Goal::Tracking };
                if let Some(position) = self.pointer.next(now.mono, route.at(now.utc)) {
                    self.is_moved = true;
                    client.set_position(position).await?;
                    self.status.commands += 1;
                }
            }
            Job::Park { is_accepted, seconds_at_rest } => {
                self.status.goal = Goal::Parking;
                if let Some(park) = mount.settings().park {
                    if let Some(position) = self.pointer.next(now.mono, park) {
                        client.set_position(position).await?;
                        self.status.commands += 1;
                    }
                    // The dead band may have swallowed the last bit of the way; that is as good as there.
                    *is_accepted = true;
                    let near = mount.settings().dead_band_deg.max(1.0) * 2.0;
                    *seconds_at_rest = if reading.is_some_and(|p| p.way_deg(park) <= near) { 2 } else { 0 };
                } else if !*is_accepted {
                    match client.park().await {
                        Ok(()) => {}
                        Err(HamlibError::Refused { .. }) => {
                            client.stop().await?;
                            self.failure =
                                Some("the rotator has no park command: give rotator.park".to_owned());
                            self.job = Job::Stopped;
                            self.is_moved = false;
                            return Ok(None);
                        }
                        Err(error) => return Err(error),
                    }
                    self.pointer.forget();
                    *is_accepted = true;
                    self.status.commands += 1;
                } else if reading.is_some() && !self.status.is_moving {
                    *seconds_at_rest += 1;
                } else {
                    *seconds_at_rest = 0;
                }
                if *seconds_at_rest >= 2 {
                    self.job = Job::Parked;
                    self.is_moved = false;
                }
            }
        }
        Ok(None)
    }

    fn tell(&mut self, now: Now, trouble: Option<String>) {
        self.status.target = self.pointer.target();
        match &self.job {
            Job::Idle => self.status.goal = Goal::Idle,
            Job::Park { .. } => self.status.goal = Goal::Parking,
            Job::Parked => self.status.goal = Goal::Parked,
            Job::Stop | Job::Stopped => self.status.goal = Goal::Stopped,
            Job::Follow { .. } => {}
        }
        let kind = std::mem::discriminant(&self.status.goal);
        if self.status.goal_since.is_none() || kind != std::mem::discriminant(&self.publisher.borrow().goal) {
            self.status.goal_since = Some(now.utc);
        }
        self.status.trouble = continued(&self.publisher.borrow().trouble, trouble, now, "rotator");
        self.publisher.send_if_modified(|told| {
            let is_new = **told != self.status;
            if is_new {
                *told = Arc::new(self.status.clone());
            }
            is_new
        });
    }

    async fn leave(&mut self) -> Result<(), HamlibError> {
        let patience = Patience { connect: FAREWELL_CONNECT, ..self.patience };
        let mut client = match self.client.take() {
            Some(client) => client,
            None => RotatorClient::connect(&self.address, patience, &self.timer).await?,
        };
        // A connection that was in the middle of something takes nothing more.
        if client.stop().await.is_err_and(|error| error.breaks_connection()) {
            client = RotatorClient::connect(&self.address, patience, &self.timer).await?;
            client.stop().await?;
        }
        match self.pointer.mount().settings().park {
            Some(park) => client.set_position(park).await,
            None => client.park().await,
        }
    }
}

impl Follower for Turning {
    fn inbox(&self) -> &Arc<Inbox<Wish>> {
        &self.inbox
    }

    async fn tick(&mut self) {
        let now = self.timer.now();
        if let Some(wish) = self.inbox.take() {
            self.failure = None;
            self.accept(wish);
        } else if self.inbox.is_closed() && !std::mem::replace(&mut self.is_abandoned, true) {
            tracing::warn!("nobody steers the antenna any more: it parks");
            self.accept(Wish::Release);
        }
        let trouble = match self.work(now).await {
            Ok(trouble) => trouble.or_else(|| self.failure.clone()),
            Err(error) => {
                self.client = None;
                self.pointer.forget();
                self.status.is_connected = false;
                (self.status.is_moving, self.status.is_on_target) = (false, false);
                (self.status.position, self.status.position_at) = (None, None);
                self.connect_at = now.mono.plus(self.pause_s * 1_000_000);
                self.pause_s = (self.pause_s * 2).min(RECONNECT_S.1);
                Some(error.told())
            }
        };
        self.tell(now, trouble);
    }

    fn pause_us(&self) -> u64 {
        match self.job {
            Job::Idle | Job::Parked | Job::Stopped if self.status.is_connected => IDLE_POLL_US,
            _ => POLL_US,
        }
    }

    async fn farewell(&mut self) {
        if !self.is_moved {
            return;
        }
        match within(FAREWELL, self.leave()).await {
            Some(Ok(())) => tracing::info!("the rotator is stopped and parks"),
            Some(Err(error)) => tracing::error!("the rotator could not be parked: {}", error.told()),
            None => tracing::error!("the rotator could not be parked in time: its daemon does not answer"),
        }
    }
}

fn told_of(route: &Route, tracking: &Tracking, mount: &Mount, from: Option<Position>) -> RouteStatus {
    let (begins, ends) = route.span();
    for unwinding in route.unwindings() {
        tracing::warn!(
            "in the pass of {} the rotator must turn round by {:.0} degrees, for {:.0} s; a range with overlap or flip \
             would spare that",
            tracking.satellite,
            unwinding.turn_deg,
            unwinding.takes_s
        );
    }
    RouteStatus {
        satellite: tracking.satellite.clone(),
        start: route.at(begins),
        begins,
        ends,
        leaves: route.leave_at(mount, from, SPARE_S),
        unwindings: route.unwindings().to_vec(),
        keyholes: route.keyholes().to_vec(),
    }
}

/// What is wrong now, since when without a break; said to the log when it is new.
pub(super) fn continued(
    before: &Option<Trouble>,
    text: Option<String>,
    now: Now,
    who: &str,
) -> Option<Trouble> {
    match (&text, before) {
        (Some(text), None) => tracing::warn!("{who}: {text}"),
        (None, Some(_)) => tracing::info!("{who}: all is well again"),
        _ => {}
    }
    let since = before.as_ref().map_or(now.utc, |before| before.since);
    text.map(|text| Trouble { text, since })
}
