//! The rig's task: receiver and transmitter follow the Doppler shift, in steps that the rig can show.

use std::sync::Arc;
use std::time::Duration;

use mission::pointing::{Tuner, look_at};
use mission::{MonoUs, Now};
use tle::{Propagator, doppler};
use tokio::sync::watch;

use super::antenna::{Follower, RigStatus, Tracking, Wish};
use super::connection::Patience;
use super::error::HamlibError;
use super::inbox::Inbox;
use super::rig::RigClient;
use super::turning::{FAREWELL, FAREWELL_CONNECT, RECONNECT_S, continued};
use crate::clock::{Timer, within};
use crate::config::RigSection;

/// How often the shift is looked at during a pass, microseconds; 156 Hz/s is the most that 435 MHz shows.
const POLL_US: u64 = 1_000_000;
/// How often between passes.
const IDLE_POLL_US: u64 = 5_000_000;
/// Tuned this much before AOS, microseconds.
const EARLY_US: i64 = 30_000_000;

enum Job {
    Idle,
    Follow {
        tracking: Arc<Tracking>,
        propagator: Option<Box<Propagator>>,
    },
    /// Back to what the satellite's transmitter is nominally on.
    Restore,
}

pub(super) struct Tuning {
    section: RigSection,
    patience: Patience,
    timer: Arc<dyn Timer>,
    inbox: Arc<Inbox<Wish>>,
    publisher: watch::Sender<Arc<RigStatus>>,
    status: RigStatus,
    client: Option<RigClient>,
    connect_at: MonoUs,
    pause_s: u64,
    receiver: Tuner,
    transmitter: Tuner,
    job: Job,
    is_tuned: bool,
    is_abandoned: bool,
    /// Why the last wish could not be fulfilled; stays until the next one.
    failure: Option<String>,
}

impl Tuning {
    pub(super) fn new(
        section: &RigSection,
        inbox: Arc<Inbox<Wish>>,
        timer: Arc<dyn Timer>,
    ) -> (Self, watch::Receiver<Arc<RigStatus>>) {
        let status = RigStatus { address: section.address.clone(), ..RigStatus::default() };
        let (publisher, receiver) = watch::channel(Arc::new(status.clone()));
        let tuning = Self {
            patience: Patience {
                reply: Duration::from_millis(section.reply_timeout_ms.into()),
                ..Patience::default()
            },
            timer,
            inbox,
            publisher,
            status,
            client: None,
            connect_at: MonoUs(0),
            pause_s: RECONNECT_S.0,
            receiver: Tuner::new(section.steps()),
            transmitter: Tuner::new(section.steps()),
            section: section.clone(),
            job: Job::Idle,
            is_tuned: false,
            is_abandoned: false,
            failure: None,
        };
        (tuning, receiver)
    }

    fn accept(&mut self, wish: Wish) {
        self.job = match wish {
            Wish::Track(tracking) => Job::Follow { tracking, propagator: None },
            Wish::Release | Wish::Park | Wish::Stop if self.is_tuned => Job::Restore,
            Wish::Release | Wish::Park | Wish::Stop => Job::Idle,
        };
        self.receiver.forget();
        self.transmitter.forget();
    }

    #[expect(clippy::cast_precision_loss, reason = "frequencies are far below 2^53 Hz")]
    fn nominal_hz(&self, tracking: Option<&Tracking>) -> (f64, Option<f64>) {
        (
            tracking.and_then(|t| t.downlink_hz).unwrap_or(self.section.downlink_hz as f64),
            tracking.and_then(|t| t.uplink_hz).or(self.section.uplink_hz.map(|hz| hz as f64)),
        )
    }

    async fn work(&mut self, now: Now) -> Result<Option<String>, HamlibError> {
        if self.client.is_none() {
            if now.mono < self.connect_at {
                return Ok(self.status.trouble.take().map(|trouble| trouble.text));
            }
            self.connect(now).await?;
        }
        if matches!(&self.job, Job::Follow { tracking, .. } if tracking.los < now.utc) {
            self.accept(Wish::Release);
        }
        let (nominal, shift) = match &mut self.job {
            Job::Idle => {
                (self.status.satellite, self.status.shift_hz, self.status.residual_hz) = (None, None, None);
                return Ok(None);
            }
            Job::Restore => {
                (self.status.satellite, self.status.shift_hz, self.status.residual_hz) = (None, None, None);
                (self.nominal_hz(None), 0.0)
            }
            Job::Follow { tracking, .. } if now.utc < tracking.aos.plus(-EARLY_US) => return Ok(None),
            Job::Follow { tracking, propagator } => {
                let range_rate_km_s = match range_rate(tracking, propagator, now) {
                    Ok(rate) => rate,
                    Err(reason) => {
                        let told = format!(
                            "{} cannot be followed: {reason}; give newer elements",
                            tracking.satellite
                        );
                        self.accept(Wish::Release);
                        self.failure = Some(told);
                        return Ok(None);
                    }
                };
                let tracking = Arc::clone(tracking);
                self.status.satellite = Some(tracking.satellite.clone());
                let nominal = self.nominal_hz(Some(&tracking));
                self.status.shift_hz = Some(doppler::downlink_shift_hz(nominal.0, range_rate_km_s));
                (nominal, range_rate_km_s)
            }
        };
        let is_end = matches!(self.job, Job::Restore);
        let receive_hz = doppler::received_hz(nominal.0, shift);
        let transmit_hz = nominal.1.map(|hz| doppler::uplink_hz(hz, shift));
        match self.tune(now.mono, receive_hz, transmit_hz).await {
            Ok(()) => {}
            Err(error) if error.breaks_connection() => return Err(error),
            Err(error) => {
                self.receiver.forget();
                self.transmitter.forget();
                return Ok(Some(error.told()));
            }
        }
        if is_end {
            self.job = Job::Idle;
            self.is_tuned = false;
        } else {
            self.status.residual_hz = self.receiver.residual_hz(receive_hz);
        }
        Ok(None)
    }

    async fn connect(&mut self, now: Now) -> Result<(), HamlibError> {
        self.connect_at = now.mono.plus(self.pause_s * 1_000_000);
        let client = RigClient::connect(&self.section.address, self.patience, &self.timer).await?;
        let info = client.info().map(str::to_owned);
        let address = &self.section.address;
        tracing::info!(%address, "rig {} at {address}", info.as_deref().unwrap_or("without a name"));
        self.status.info = info;
        self.status.is_connected = true;
        self.pause_s = RECONNECT_S.0;
        self.client = Some(client);
        Ok(())
    }

    async fn tune(
        &mut self,
        now: MonoUs,
        receive_hz: f64,
        transmit_hz: Option<f64>,
    ) -> Result<(), HamlibError> {
        let Some(client) = &mut self.client else { return Ok(()) };
        if let Some(hz) = self.receiver.next(now, receive_hz) {
            self.is_tuned = true;
            self.status.receive_hz = Some(client.tune(hz, self.section.resolution_hz).await?);
            self.status.commands += 1;
        }
        if let Some(hz) = transmit_hz.and_then(|hz| self.transmitter.next(now, hz)) {
            self.is_tuned = true;
            self.status.transmit_hz = Some(client.tune_transmitter(hz, self.section.resolution_hz).await?);
            self.status.commands += 1;
        }
        Ok(())
    }

    fn tell(&mut self, now: Now, trouble: Option<String>) {
        self.status.trouble = continued(&self.publisher.borrow().trouble, trouble, now, "rig");
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
        let resolution_hz = self.section.resolution_hz;
        let downlink_hz = self.section.downlink_hz;
        if let Some(client) = &mut self.client {
            match client.tune(downlink_hz, resolution_hz).await {
                Err(error) if error.breaks_connection() => {}
                result => return result.map(drop),
            }
        }
        let mut client = RigClient::connect(&self.section.address, patience, &self.timer).await?;
        client.tune(downlink_hz, resolution_hz).await.map(drop)
    }
}

/// How fast the satellite goes away, km/s.
fn range_rate(
    tracking: &Tracking,
    propagator: &mut Option<Box<Propagator>>,
    now: Now,
) -> Result<f64, String> {
    if propagator.is_none() {
        let made = Propagator::new(&tracking.elements).map_err(|error| error.to_string())?;
        *propagator = Some(Box::new(made));
    }
    let Some(propagator) = propagator else { return Ok(0.0) };
    let look = look_at(propagator, &tracking.site, now.utc).map_err(|error| error.to_string())?;
    Ok(look.range_rate_km_s)
}

impl Follower for Tuning {
    fn inbox(&self) -> &Arc<Inbox<Wish>> {
        &self.inbox
    }

    async fn tick(&mut self) {
        let now = self.timer.now();
        if let Some(wish) = self.inbox.take() {
            self.failure = None;
            self.accept(wish);
        } else if self.inbox.is_closed() && !std::mem::replace(&mut self.is_abandoned, true) {
            self.accept(Wish::Release);
        }
        let trouble = match self.work(now).await {
            Ok(trouble) => trouble.or_else(|| self.failure.clone()),
            Err(error) => {
                self.client = None;
                self.receiver.forget();
                self.transmitter.forget();
                self.status.is_connected = false;
                (self.status.receive_hz, self.status.transmit_hz) = (None, None);
                self.status.residual_hz = None;
                self.connect_at = now.mono.plus(self.pause_s * 1_000_000);
                self.pause_s = (self.pause_s * 2).min(RECONNECT_S.1);
                Some(error.told())
            }
        };
        self.tell(now, trouble);
    }

    fn pause_us(&self) -> u64 {
        match self.job {
            Job::Idle if self.status.is_connected => IDLE_POLL_US,
            _ => POLL_US,
        }
    }

    async fn farewell(&mut self) {
        if !self.is_tuned {
            return;
        }
        match within(FAREWELL, self.leave()).await {
            Some(Ok(())) => tracing::info!("the rig has its nominal frequency back"),
            Some(Err(error)) => tracing::error!("the rig keeps its frequency: {}", error.told()),
            None => tracing::error!("the rig keeps its frequency: its daemon does not answer in time"),
        }
    }
}
