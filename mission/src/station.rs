//! The station engine: inputs in, effects out. Its parts:
//!
//! | part | idea |
//! | --- | --- |
//! | `journal` | what is to be made durable, in order, and what waits for it |
//! | `sealing` | which counter a frame may be sealed with |
//! | `contact` | when the satellite was heard, and when it transmits by itself |
//! | `plans` | plans that were handed over |
//! | `agenda` | which plan gets which pass |
//! | `health` | with what nothing is planned, because it does not work |
//! | `runner` | a plan in its pass |
//! | `conditions` | what else must hold before a command leaves |
//! | `sky` | elements and passes: whether the satellite is in view |
//! | `link`, `satellite` | what is known of each |
//! | `intake` | bytes to frames, frames to records |
//! | `outside` | what others heard |
//! | `recent` | frames of a moment ago: the same bytes again are no second frame |
//! | `packets` | what a packet changes |
//! | `gate` | whether the uplink may be used now, and if not, when |
//! | `wanted` | whether a command that waits may still go on |
//! | `uplink` | one exchange at a time: seal, witness, mark, transmit |
//! | `witness` | the counter outside the database |
//! | `answer` | after the hand-over: the radio's word, the satellite's answer |
//! | `outcome` | stages: how commands end |
//! | `download` | what to ask for next |
//! | `intents` | what operators want |
//! | `restore` | how a new life begins |

mod agenda;
mod answer;
mod conditions;
mod contact;
mod download;
mod gate;
mod health;
mod image;
mod intake;
mod intents;
mod journal;
mod link;
mod outcome;
mod outside;
mod packets;
mod plans;
mod recent;
mod restore;
mod runner;
mod satellite;
mod sealing;
mod sky;
mod uplink;
mod view;
mod wanted;
mod witness;

use std::collections::VecDeque;

use protocol::KeyId;

use crate::clock::{MonoUs, Now, UtcUs};
use crate::config::{StationConfig, Times};
use crate::id::{AntennaId, LinkId, Principal, SatelliteId, StationId};
use crate::level::Level;
use crate::port::{Effect, Input, LinkState};
use crate::record::{AuditRecord, EventKind, EventRecord, Record, Route, Subject};
use crate::run::{PlanRecord, RunRecord};
use crate::sky::Site;
use crate::snapshot::{LastIds, Snapshot};
use crate::status::Status;

use agenda::Agenda;
use journal::Journal;
use link::Link;
use recent::Recents;
use runner::{LastEnd, Run};
use satellite::Satellite;

/// Where the engine's random bytes come from: the operating system, or a seed.
pub trait Entropy: Send {
    /// Fills the buffer.
    fn fill(&mut self, bytes: &mut [u8]);
}

/// The station: a plain state machine.
pub struct Station {
    station: StationId,
    me: Principal,
    entropy: Box<dyn Entropy>,
    journal: Journal,
    effects: VecDeque<Effect>,
    satellites: Vec<Satellite>,
    links: Vec<Link>,
    site: Option<Site>,
    times: Times,
    antenna: AntennaId,
    /// What is wrong with the rotator; `None`: there is none.
    antenna_fault: Option<Option<String>>,
    plans: Vec<PlanRecord>,
    agenda: Agenda,
    /// Runs that are not over.
    runs: Vec<Run>,
    /// Of each plan the run that is to be finished in the next pass.
    unfinished: Vec<RunRecord>,
    /// The last run of each satellite that came to its end.
    last_ends: Vec<LastEnd>,
    ids: LastIds,
    last_tx: u64,
    recent: Recents,
    /// Frames of the delivery at hand that nothing was told of alone.
    kept_raw: u64,
    synchronised: bool,
    vouched: bool,
    stopping: bool,
    wake: Option<MonoUs>,
}

impl Station {
    /// A station that goes on from what was stored.
    pub fn new(config: StationConfig, snapshot: Snapshot, entropy: Box<dyn Entropy>, now: Now) -> Self {
        restore::station(config, snapshot, entropy, now)
    }

    /// Takes an input. Effects that follow from it wait in [`Station::next_effect`].
    pub fn handle(&mut self, now: Now, input: Input<'_>) {
        match input {
            Input::Bytes { link, bytes, source, received } => self.take_bytes(link, bytes, source, received),
            Input::Recovered(frame) => self.take_recovered(frame),
            Input::Elsewhere { id, frame } => self.take_elsewhere(now, id, frame),
            Input::Outside { delivery, receptions } => self.take_outside(now, delivery, receptions),
            Input::Link { link, state } => self.link_state(now, link, state),
            Input::TxStarted(tx) => self.tx_started(tx),
            Input::TxDone { tx, airtime_us, .. } => self.tx_done(now, tx, airtime_us),
            Input::TxFailed { tx, radiated, reason } => self.tx_failed(now, tx, radiated, reason),
            Input::PersistDone(batch) => {
                if let Some(why) = self.journal.done(batch) {
                    let message = format!("storage takes records again (it had failed: {why})");
                    self.event(now.utc, EventKind::Storage, Level::Normal, About::default(), message);
                }
            }
            Input::PersistFailed { batch, reason, again_us } => {
                if self.journal.failed(now.mono.plus(again_us), batch, reason) {
                    let message = format!(
                        "storage fails: {reason}. Nothing is transmitted; raw frames go to the reserve until it recovers"
                    );
                    self.event(now.utc, EventKind::Storage, Level::Critical, About::default(), message);
                }
            }
            Input::ReserveFailed { reason } => {
                if self.journal.unreserved() {
                    let message = format!(
                        "the reserve takes no raw frame: {reason}. What is heard now is in memory only until storage recovers"
                    );
                    self.event(now.utc, EventKind::Storage, Level::Severe, About::default(), message);
                }
            }
            Input::WitnessDone { key, counter } => self.witness_done(now, key, counter),
            Input::WitnessFailed { key, reason } => self.witness_failed(now, key, reason),
            Input::Lease { key, lease } => self.lease(key, &lease),
            Input::Clock { synchronised } => self.synchronised = synchronised,
            Input::View { satellite, in_view } => {
                if let Some(satellite) = self.satellites.iter_mut().find(|s| s.id == *satellite) {
                    satellite.contact.set_view(in_view);
                }
            }
            Input::Antenna { fault } => self.antenna_fault = Some(fault.map(str::to_owned)),
            Input::Notice { kind, level, message } => {
                self.event(now.utc, kind, level, About::default(), message.to_owned());
            }
            Input::Intent(envelope) => self.intent(now, envelope),
            Input::Wake => {}
            Input::Stop => self.stopping = true,
        }
        self.go_on(now);
    }

    /// The next effect, in the order in which they must be carried out.
    pub fn next_effect(&mut self) -> Option<Effect> {
        self.effects.pop_front()
    }

    /// When [`Input::Wake`] is wanted at the latest.
    pub fn next_wakeup(&self) -> Option<MonoUs> {
        self.wake
    }

    /// Everything that was taken in is durable: what [`Station::status`] tells may be shown.
    pub fn is_settled(&self) -> bool {
        self.journal.is_settled()
    }

    /// How the station is now.
    pub fn status(&self, now: Now) -> Status {
        self.view(now)
    }

    /// Does what has become possible, lets effects out, and notes when to look again.
    fn go_on(&mut self, now: Now) {
        self.end_silence(now);
        for s in 0..self.satellites.len() {
            self.satellites[s].wake = None;
            self.unlock_step(s);
            self.sky_step(now, s);
            self.note_contact(now, s);
            self.expire(now, s);
            self.settle_overdue(now, s);
        }
        if !self.stopping {
            self.agenda_step(now);
            self.runs_step(now);
        }
        for s in 0..self.satellites.len() {
            self.uplink_step(now, s);
        }
        self.journal.flush(now.mono, &mut self.effects);
        if self.journal.take_reserve_clear() {
            self.effects.push_back(Effect::ReserveClear);
        }
        let wakes = self.satellites.iter().filter_map(|s| s.wake);
        let receiving = self.links.iter().filter(|l| l.decoder.in_frame()).map(|l| l.receiving_until());
        // Never "at once" again and again: what is due now was done now.
        let soonest = now.mono.plus(1_000);
        self.wake = wakes.chain(receiving).chain(self.journal.retry_at()).min().map(|at| at.max(soonest));
    }

    /// Somebody vouches for the clock.
    fn is_vouched(&self) -> bool {
        self.synchronised || self.vouched
    }

    fn link_index(&self, link: &LinkId) -> Option<usize> {
        self.links.iter().position(|l| l.config.id == *link)
    }

    fn satellite_index(&self, satellite: &SatelliteId) -> Option<usize> {
        self.satellites.iter().position(|s| s.id == *satellite)
    }

    /// Where things on this link go to and come from.
    fn route(&self, link: usize) -> Route {
        let link = &self.links[link];
        Route {
            satellite: self.satellites[link.satellite].id.clone(),
            station: self.station.clone(),
            link: link.config.id.clone(),
        }
    }

    fn link_state(&mut self, now: Now, id: &LinkId, state: LinkState) {
        let Some(l) = self.link_index(id) else { return };
        let link = &mut self.links[l];
        if link.state == state {
            return;
        }
        link.up_since = (state == LinkState::Ok).then_some(now.mono);
        let (level, message) = match &state {
            LinkState::Ok => (Level::Normal, format!("link {id} is up")),
            LinkState::Disabled => (Level::Normal, format!("link {id} is switched off")),
            LinkState::Unavailable { reason } => {
                (Level::Warning, format!("link {id} is not there: {reason}"))
            }
            LinkState::Failed { reason } => (Level::Distress, format!("link {id} does not work: {reason}")),
        };
        link.state = state;
        let about = About { route: Some(self.route(l)), ..About::default() };
        self.event(now.utc, EventKind::Link, level, about, message);
    }

    fn event(&mut self, at: UtcUs, kind: EventKind, level: Level, about: About, message: String) {
        let (satellite, link) = match about.route {
            Some(route) => (Some(route.satellite), Some(route.link)),
            None => (None, None),
        };
        let station = self.station.clone();
        let (key, subject) = (about.key, about.subject);
        self.journal.push(Record::Event(EventRecord {
            at,
            kind,
            level,
            satellite,
            station,
            link,
            key,
            subject,
            message,
        }));
    }

    fn audit(&mut self, at: UtcUs, who: &Principal, action: &'static str, detail: String) {
        self.journal.push(Record::Audit(AuditRecord { at, who: who.clone(), action, detail }));
    }
}

/// What an event is about.
#[derive(Debug, Clone, Default)]
struct About {
    route: Option<Route>,
    key: Option<KeyId>,
    subject: Subject,
}
