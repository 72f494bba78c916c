//! The leases of our keys, where several servers share a database: taken when there is something to say that could be
//! sent now, renewed meanwhile, given back after.
//!
//! The engine is told how long a lease holds by its own clock, counted from before the question: it never believes longer
//! than the database does. Without an answer it believes nothing new, and the lease ends by itself; it is asked for again
//! each second until there is one.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use mission::{Lease, Status};
use protocol::KeyId;
use tokio_util::sync::CancellationToken;

use crate::clock::{Timer, wall_sleep};
use crate::engine::{EngineHandle, EngineInbox, EngineMessage};
use crate::storage::{Leased, Store, utc};

/// How often is looked at least.
const TICK: Duration = Duration::from_secs(1);
/// A lease that we hold is renewed after so many ticks: a third of its life.
const RENEW_TICKS: u32 = 10;
/// A lease that nobody wants any more is given back after so many ticks: the next command often follows.
const IDLE_TICKS: u32 = 5;

/// Keeps the leases.
pub(crate) struct Leases {
    pub(crate) store: Store,
    pub(crate) engine: EngineHandle,
    pub(crate) inbox: EngineInbox,
    pub(crate) timer: Arc<dyn Timer>,
    /// Simulated seconds per second.
    pub(crate) speed: f64,
}

#[derive(Debug, Default)]
struct Held {
    ours: bool,
    /// Ticks since it was renewed, or since it was asked for in vain.
    age: u32,
    /// Ticks since somebody wanted it.
    idle: u32,
    /// The database did not answer when it was asked last.
    failing: bool,
    told: String,
}

impl Leases {
    /// Works until `stop`, and gives back what it holds.
    pub(crate) async fn run(self, stop: CancellationToken) {
        let mut held: BTreeMap<KeyId, Held> = BTreeMap::new();
        let mut changes = self.engine.status_changes();
        // Not begun anew at each change: where the status changes several times in a tick there would never be one.
        let mut tick = Box::pin(wall_sleep(TICK));
        loop {
            let ticked = tokio::select! {
                () = stop.cancelled() => break,
                () = &mut tick => {
                    tick = Box::pin(wall_sleep(TICK));
                    true
                }
                changed = changes.changed() => {
                    if changed.is_err() {
                        break;
                    }
                    false
                }
            };
            let status = self.engine.status();
            for sealing in &status.sealing {
                let wanted = is_wanted(&status, sealing.key);
                self.look(sealing.key, wanted, ticked, held.entry(sealing.key).or_default()).await;
            }
        }
        for (key, _) in held.iter().filter(|(_, held)| held.ours) {
            // What is not given back ends by itself.
            let _ = self.store.lease(*key, false).await;
        }
    }

    async fn look(&self, key: KeyId, wanted: bool, ticked: bool, held: &mut Held) {
        held.age = held.age.saturating_add(u32::from(ticked));
        held.idle = if wanted { 0 } else { held.idle.saturating_add(u32::from(ticked)) };
        let keep = wanted || (held.ours && held.idle < IDLE_TICKS);
        let due = match (held.ours, keep) {
            // Not at every change of the status.
            _ if held.failing => ticked && (keep || held.ours),
            (true, true) => held.age >= RENEW_TICKS,
            (true, false) => true,
            // Somebody else's: not at every change of the status.
            (false, true) => held.told.is_empty() || ticked,
            (false, false) => false,
        };
        if !due {
            return;
        }
        let asked = self.timer.now().mono;
        let (ours, lease) = match self.store.lease(key, keep).await {
            Ok(Some(Leased::Ours { remaining, spent })) => {
                let until =
                    asked.plus(remaining.mul_f64(self.speed).as_micros().try_into().unwrap_or(u64::MAX));
                (true, Lease::Ours { until, spent })
            }
            Ok(Some(Leased::Other { station, until_us })) => {
                let why = format!("key {key} is used by station {station} until {}", utc(until_us));
                (false, Lease::NotOurs { why })
            }
            Ok(Some(Leased::Free)) => (false, Lease::NotOurs { why: waiting(key) }),
            Ok(None) => return,
            Err(error) => {
                if std::mem::replace(&mut held.failing, true) {
                    tracing::debug!(%key, "the lease of key {key} still cannot be asked for: {error}");
                } else {
                    tracing::warn!(%key, "the lease of key {key} cannot be asked for: {error}; trying again");
                }
                return;
            }
        };
        if std::mem::take(&mut held.failing) {
            let now = if ours { "is ours again" } else { "is not ours" };
            tracing::info!(%key, "the lease of key {key} {now}: the database answers again");
        }
        held.ours = ours;
        held.age = 0;
        let told = format!("{lease:?}");
        if held.told != told {
            held.told = told;
            self.inbox.send(EngineMessage::Lease { key, lease }).await;
        }
        if !keep {
            held.told.clear();
        }
    }
}

/// What a server knows of a key before it has asked.
pub(crate) fn waiting(key: KeyId) -> String {
    format!("waiting for the lease of key {key}")
}

/// Something could be said with this key now, or is on its way.
fn is_wanted(status: &Status, key: KeyId) -> bool {
    let of_key =
        |satellite| status.sealing.iter().any(|sealing| sealing.key == key && sealing.satellite == satellite);
    let mut ours = status.satellites.iter().filter(|sat| of_key(sat.satellite.clone()));
    ours.any(|sat| sat.wants_lease || sat.outstanding.is_some())
}
