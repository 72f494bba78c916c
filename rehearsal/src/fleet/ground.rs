//! One station of the fleet: its engine, its radios and ears, its clock, its disk.

use std::collections::{HashSet, VecDeque};
use std::sync::Arc;

use mission::config::Times;
use mission::{
    Batch, BatchId, CounterRule, Entropy, Input, Intent, IntentEnvelope, IntentId, LinkConfig, LinkId,
    LinkState, MonoUs, Now, Principal, Profile, SatelliteConfig, Site, Station, StationConfig, UtcUs,
};
use protocol::{Counter, Key, KeyId};
use radio::airtime::LinkTiming;
use radio::driver::Driver;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satellite::Channel;
use tle::Elements;

use super::scene::{COMMANDED_FROM, SATELLITES, link_name, satellite_name, station_name, utc_at};
use super::store::Stores;
use crate::parts::driver_config;

/// Seeded bytes for the engine.
pub(super) struct Seeded(pub(super) ChaCha8Rng);

impl Entropy for Seeded {
    fn fill(&mut self, bytes: &mut [u8]) {
        self.0.fill_bytes(bytes);
    }
}

/// What the engine waits for at this very moment.
pub(super) enum Due {
    Persist(Arc<Batch>),
    Confirm(BatchId, bool),
    Witness(KeyId, Counter),
}

/// A radio that can command one satellite.
pub(super) struct Radio {
    pub(super) s: usize,
    pub(super) link: LinkId,
    pub(super) driver: Driver,
    pub(super) is_ok: bool,
    /// It may transmit, as the engine was told last.
    pub(super) armed: bool,
    pub(super) reopen_at: Option<u64>,
    pub(super) drained_at: Option<u64>,
}

/// A frame on its way into an ear.
pub(super) struct Heard {
    pub(super) start_us: u64,
    pub(super) end_us: u64,
    pub(super) deliver_at: u64,
    pub(super) bytes: Vec<u8>,
}

/// A receiver for a satellite that another station commands.
pub(super) struct Ear {
    pub(super) s: usize,
    pub(super) link: LinkId,
    pub(super) channel: Channel,
    pub(super) air: VecDeque<Heard>,
}

/// Somebody wants something, and goes on wanting it until there is an answer.
#[derive(Clone)]
pub(super) struct Wanted {
    pub(super) number: u64,
    pub(super) intent: Intent,
}

/// Bytes that the engine handed to a radio.
pub(super) struct HandOver {
    pub(super) at_us: u64,
    pub(super) s: usize,
    pub(super) frame: Arc<[u8; 240]>,
}

/// A station.
pub(super) struct Ground {
    pub(super) g: usize,
    pub(super) site: Site,
    pub(super) times: Times,
    pub(super) keys: [Option<Key>; SATELLITES],
    pub(super) station: Option<Station>,
    pub(super) radios: Vec<Radio>,
    pub(super) ears: Vec<Ear>,
    pub(super) stores: Stores,
    pub(super) due: VecDeque<Due>,
    /// The station's clock less the true time.
    pub(super) offset_us: i64,
    pub(super) synchronised: bool,
    pub(super) rotator_fault: Option<&'static str>,
    pub(super) disk_until: u64,
    pub(super) restart_at: Option<u64>,
    pub(super) down_since: u64,
    pub(super) check_at: u64,
    pub(super) lives: u64,
    pub(super) rng: ChaCha8Rng,
    pub(super) outbox: VecDeque<Wanted>,
    pub(super) asked: Vec<Wanted>,
    pub(super) retry_at: Option<u64>,
    pub(super) receipts: HashSet<String>,
    pub(super) numbers: u64,
    /// The last two times that something of the station was on the air.
    pub(super) on_air: [(u64, u64); 2],
    /// The elements that the engine has of each satellite, in the order in which they came.
    pub(super) sets: [Vec<Arc<Elements>>; SATELLITES],
    pub(super) handed: VecDeque<HandOver>,
}

/// What differs between satellites: nothing but whether a module appends a level.
fn profile(is_commanded: bool) -> Profile {
    Profile { tags: true, ranges: true, counter: CounterRule::Time, rssi: is_commanded, ..Profile::default() }
}

impl Ground {
    pub(super) fn new(
        g: usize,
        keys: &[Key; SATELLITES],
        site: Site,
        times: Times,
        ears: Vec<Ear>,
        rng: ChaCha8Rng,
    ) -> Self {
        let mine = |s: &usize| COMMANDED_FROM[*s] == g;
        let radio = |s: usize| Radio {
            s,
            link: link_name(s),
            driver: Driver::new(driver_config()),
            is_ok: false,
            armed: true,
            reopen_at: None,
            drained_at: None,
        };
        let key = |s: usize| mine(&s).then(|| keys[s].clone());
        let of_key = |s: usize| key(s).map(|key| key.id());
        Self {
            g,
            site,
            times,
            keys: std::array::from_fn(key),
            station: None,
            radios: (0..SATELLITES).filter(mine).map(radio).collect(),
            ears,
            stores: Stores::new((0..SATELLITES).map(|s| (satellite_name(s), of_key(s)))),
            due: VecDeque::new(),
            offset_us: 0,
            synchronised: true,
            rotator_fault: None,
            disk_until: 0,
            restart_at: Some(0),
            down_since: 0,
            check_at: 0,
            lives: 0,
            rng,
            outbox: VecDeque::new(),
            asked: Vec::new(),
            retry_at: None,
            receipts: HashSet::new(),
            numbers: 0,
            on_air: [(0, 0); 2],
            sets: std::array::from_fn(|_| Vec::new()),
            handed: VecDeque::new(),
        }
    }

    /// The station's own time.
    pub(super) fn now(&self, now_us: u64) -> Now {
        Now { mono: MonoUs(now_us), utc: UtcUs(utc_at(now_us).0.saturating_add(self.offset_us)) }
    }

    pub(super) fn tell(&mut self, now_us: u64, input: Input<'_>) {
        let now = self.now(now_us);
        if let Some(station) = &mut self.station {
            station.handle(now, input);
        }
    }

    /// Somebody wants something; it is said as soon as somebody listens.
    pub(super) fn want(&mut self, intent: Intent) {
        self.numbers += 1;
        self.outbox.push_back(Wanted { number: self.numbers, intent });
    }

    /// Says what is wanted. What was durable without an answer is not said again.
    pub(super) fn send_wanted(&mut self, now_us: u64) {
        if self.station.is_none() || self.retry_at.is_some_and(|at| at > now_us) {
            return;
        }
        self.retry_at = None;
        while let Some(wanted) = self.outbox.pop_front() {
            if self.receipts.contains(&wanted.number.to_string()) {
                continue;
            }
            self.note_wanted(&wanted.intent);
            self.tell(
                now_us,
                Input::Intent(IntentEnvelope {
                    id: IntentId(wanted.number),
                    principal: Principal::new("operator"),
                    idempotency_key: wanted.number.to_string(),
                    digest: [0; 32],
                    intent: wanted.intent.clone(),
                }),
            );
            self.asked.push(wanted);
        }
    }

    /// What the engine believes once it has taken this; taken back where it refuses.
    fn note_wanted(&mut self, intent: &Intent) {
        match intent {
            Intent::AddElements { satellite, elements, .. } => {
                for s in (0..SATELLITES).filter(|s| satellite_name(*s) == *satellite) {
                    self.sets[s].extend(elements.iter().cloned().map(Arc::new));
                }
            }
            Intent::ArmLink { link, armed } => {
                for radio in self.radios.iter_mut().filter(|radio| radio.link == *link) {
                    radio.armed = *armed;
                }
            }
            _ => {}
        }
    }

    /// It was refused.
    pub(super) fn forget_wanted(&mut self, intent: &Intent) {
        match intent {
            Intent::AddElements { satellite, elements, .. } => {
                for s in (0..SATELLITES).filter(|s| satellite_name(*s) == *satellite) {
                    self.sets[s].retain(|held| !elements.contains(held));
                }
            }
            Intent::ArmLink { link, armed } => {
                for radio in self.radios.iter_mut().filter(|radio| radio.link == *link) {
                    radio.armed = !*armed;
                }
            }
            _ => {}
        }
    }

    /// A new life of the engine, from what is durable.
    pub(super) fn start(&mut self, now_us: u64) {
        let snapshot = self.stores.snapshot();
        for s in 0..SATELLITES {
            let durable = snapshot.satellites.iter().filter(|left| left.satellite == satellite_name(s));
            self.sets[s] =
                durable.flat_map(|left| &left.elements).map(|set| Arc::clone(&set.elements)).collect();
        }
        let entropy = Box::new(Seeded(ChaCha8Rng::from_rng(&mut self.rng)));
        self.lives += 1;
        let now = self.now(now_us);
        let mut station = Station::new(self.config(), snapshot, entropy, now);
        for frame in &self.stores.reserve {
            station.handle(now, Input::Recovered(frame));
        }
        self.station = Some(station);
        self.check_at = now_us;
        self.tell(now_us, Input::Antenna { fault: self.rotator_fault });
        for radio in &mut self.radios {
            radio.driver = Driver::new(driver_config());
            (radio.is_ok, radio.armed) = (false, true);
            radio.driver.handle(now_us, radio::driver::DriverInput::Opened);
        }
        for ear in 0..self.ears.len() {
            let link = self.ears[ear].link.clone();
            self.tell(now_us, Input::Link { link: &link, state: LinkState::Ok });
        }
        let again = std::mem::take(&mut self.asked);
        self.outbox.extend(again);
        self.outbox.make_contiguous().sort_by_key(|wanted| wanted.number);
        self.retry_at = None;
    }

    fn config(&self) -> StationConfig {
        let satellites = (0..SATELLITES).map(|s| SatelliteConfig {
            id: satellite_name(s),
            profile: profile(self.keys[s].is_some()),
            key: self.keys[s].clone(),
            limits: Vec::new(),
        });
        let links = (0..SATELLITES).map(|s| LinkConfig {
            id: link_name(s),
            satellite: satellite_name(s),
            timing: LinkTiming::default(),
            armed: true,
            receive_only: self.keys[s].is_none(),
        });
        StationConfig {
            station: station_name(self.g),
            site: Some(self.site.clone()),
            times: self.times.clone(),
            satellites: satellites.collect(),
            links: links.collect(),
        }
    }

    /// When something is due next that the station itself does.
    pub(super) fn next_us(&self) -> Option<u64> {
        let Some(station) = &self.station else { return self.restart_at };
        let radios = self.radios.iter().flat_map(|r| [r.driver.next_wakeup_us(), r.reopen_at, r.drained_at]);
        let ears = self.ears.iter().map(|ear| ear.air.front().map(|heard| heard.deliver_at));
        let own = [station.next_wakeup().map(|at| at.0), Some(self.check_at), self.retry_at];
        radios.chain(ears).chain(own).flatten().min()
    }
}
