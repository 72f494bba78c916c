//! A world for one station, moved by hand.

use std::collections::VecDeque;

use mission::reception::{NotTaken, Taken};
use mission::record::{DownloadState, EventKind, ImageRecord, StageRecord};
use mission::snapshot::Witness;
use mission::{
    Accepted, BatchId, CommandId, CommandIntent, CounterRule, DownloadId, Effect, Entropy, Gate, Input,
    Intent, IntentEnvelope, IntentId, LinkConfig, LinkId, LinkState, MaybeRadiated, MonoUs, Now, Principal,
    Profile, Record, Refusal, ReservedFrame, SatelliteConfig, SatelliteId, Snapshot, Source, Stage, Station,
    StationConfig, StationId, Transmit, TxId, UtcUs,
};
use protocol::{Key, KeyId, RequestTag, SealedUplink, Telecommand};
use radio::airtime::LinkTiming;

use crate::frames::{frame, heartbeat_frame};

pub(crate) const S: u64 = 1_000_000;
/// 2026-10-01, as microseconds since 1970.
pub(crate) const UTC0: i64 = 1_790_812_800_000_000;

/// Something that happened, in order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Seen {
    Stored(Vec<String>),
    Witness(u64),
    Transmit(u64),
}

struct Counting(u8);

impl Entropy for Counting {
    fn fill(&mut self, bytes: &mut [u8]) {
        for byte in bytes {
            self.0 = self.0.wrapping_mul(5).wrapping_add(113);
            *byte = self.0;
        }
    }
}

/// How the world is made.
#[derive(Clone)]
pub(crate) struct Setup {
    pub(crate) profile: Profile,
    pub(crate) limits: Vec<mission::LimitRule>,
    pub(crate) second_satellite: bool,
    pub(crate) key: [u8; 16],
    pub(crate) site: Option<mission::Site>,
    pub(crate) times: mission::config::Times,
}

impl Default for Setup {
    fn default() -> Self {
        let profile = Profile { rssi: false, ..Profile::default() };
        Self {
            profile,
            limits: Vec::new(),
            second_satellite: false,
            key: [7; 16],
            site: None,
            times: mission::config::Times::default(),
        }
    }
}

pub(crate) struct World {
    pub(crate) setup: Setup,
    pub(crate) station: Station,
    pub(crate) now: Now,
    pub(crate) link: LinkId,
    pub(crate) satellite: SatelliteId,
    /// Persists and witnesses are confirmed at once.
    pub(crate) confirms: bool,
    pub(crate) waiting: VecDeque<Effect>,
    pub(crate) seen: Vec<Seen>,
    pub(crate) stored: Vec<Record>,
    pub(crate) transmits: Vec<Transmit>,
    pub(crate) replies: Vec<(IntentId, Result<Accepted, Refusal>)>,
    pub(crate) reserve: Vec<ReservedFrame>,
    pub(crate) taken: Vec<(u64, Result<Taken, NotTaken>)>,
    pub(crate) reserve_clears: usize,
    pub(crate) witness: Witness,
    pub(crate) synchronised: bool,
    intents: u64,
    uptime_ms: u32,
}

fn config(setup: &Setup) -> StationConfig {
    let satellite = |name: &str| SatelliteConfig {
        id: SatelliteId::new(name).unwrap(),
        profile: setup.profile,
        key: Some(Key::from_bytes(setup.key)),
        limits: setup.limits.clone(),
    };
    let link = |name: &str, satellite: &str, receive_only| LinkConfig {
        id: LinkId::new(name).unwrap(),
        satellite: SatelliteId::new(satellite).unwrap(),
        timing: LinkTiming::default(),
        armed: true,
        receive_only,
    };
    let mut satellites = vec![satellite("pixelsat-1")];
    let mut links = vec![link("radio", "pixelsat-1", false), link("file", "pixelsat-1", true)];
    if setup.second_satellite {
        satellites.push(satellite("pixelsat-2"));
        links.push(link("radio-2", "pixelsat-2", false));
    }
    StationConfig {
        station: StationId::new("home").unwrap(),
        satellites,
        links,
        site: setup.site.clone(),
        times: setup.times.clone(),
    }
}

impl World {
    /// A station at its first start, its link down, its clock vouched for.
    pub(crate) fn new(setup: Setup) -> Self {
        Self::from_snapshot(setup, Snapshot::default())
    }

    pub(crate) fn from_snapshot(setup: Setup, snapshot: Snapshot) -> Self {
        let now = Now { mono: MonoUs(100 * S), utc: UtcUs(UTC0) };
        let station = Station::new(config(&setup), snapshot, Box::new(Counting(1)), now);
        let mut world = Self {
            setup,
            station,
            now,
            link: LinkId::new("radio").unwrap(),
            satellite: SatelliteId::new("pixelsat-1").unwrap(),
            confirms: true,
            waiting: VecDeque::new(),
            seen: Vec::new(),
            stored: Vec::new(),
            transmits: Vec::new(),
            replies: Vec::new(),
            reserve: Vec::new(),
            taken: Vec::new(),
            reserve_clears: 0,
            witness: Witness::Missing,
            synchronised: true,
            intents: 0,
            uptime_ms: 10_000_000,
        };
        world.handle(Input::Clock { synchronised: true });
        world
    }

    /// A station that hears its satellite and may send to it now.
    pub(crate) fn in_contact() -> Self {
        Self::in_contact_with(Setup::default())
    }

    pub(crate) fn in_contact_with(setup: Setup) -> Self {
        let mut world = Self::new(setup);
        world.come_into_contact();
        world
    }

    /// The same, after a first exchange: counter and witness exist.
    pub(crate) fn after_an_exchange() -> Self {
        let mut world = Self::in_contact();
        world.command(Telecommand::Ping);
        world.radiate();
        world.hear(&frame(0, world.last_request().0, &[]));
        world.pass(S / 10);
        world.transmits.clear();
        world
    }

    pub(crate) fn come_into_contact(&mut self) {
        self.link_state(LinkState::Ok);
        self.heartbeat();
        self.pass(5 * S);
    }

    /// What a restart of this station begins from: everything that is stored, nothing else.
    pub(crate) fn restart(&mut self) {
        let snapshot = self.snapshot();
        self.restart_from(snapshot);
    }

    pub(crate) fn restart_from(&mut self, snapshot: Snapshot) {
        self.waiting.clear();
        self.confirms = true;
        self.station = Station::new(config(&self.setup), snapshot, Box::new(Counting(77)), self.now);
        self.handle(Input::Clock { synchronised: self.synchronised });
    }

    pub(crate) fn key(&self) -> KeyId {
        Key::from_bytes(self.setup.key).id()
    }

    pub(crate) fn handle(&mut self, input: Input<'_>) {
        self.station.handle(self.now, input);
        self.settle();
    }

    /// Takes effects; confirms them if this world does.
    pub(crate) fn settle(&mut self) {
        for _ in 0..10_000 {
            while let Some(effect) = self.station.next_effect() {
                self.take(effect);
            }
            if let Some(wake) = self.station.next_wakeup() {
                assert!(wake > self.now.mono, "a wake-up in the past: {wake:?} at {:?}", self.now.mono);
            }
            if !self.confirms || self.waiting.is_empty() {
                return;
            }
            self.confirm();
        }
        panic!("the engine does not come to rest");
    }

    fn take(&mut self, effect: Effect) {
        match effect {
            Effect::Persist(_) | Effect::Witness { .. } => self.waiting.push_back(effect),
            Effect::Transmit(transmit) => {
                self.seen.push(Seen::Transmit(counter_of(&transmit)));
                self.transmits.push(transmit);
            }
            Effect::Reply { intent, result } => self.replies.push((intent, result)),
            Effect::Taken { delivery, result } => self.taken.push((delivery, result)),
            Effect::Reserve(frame) => self.reserve.push(frame),
            Effect::ReserveClear => {
                self.reserve_clears += 1;
                self.reserve.clear();
            }
        }
    }

    /// Confirms what waits longest.
    pub(crate) fn confirm(&mut self) {
        match self.waiting.pop_front().expect("something to confirm") {
            Effect::Persist(batch) => {
                self.seen.push(Seen::Stored(batch.records.iter().map(kind).collect()));
                self.stored.extend(batch.records.iter().cloned());
                self.station.handle(self.now, Input::PersistDone(batch.id));
            }
            Effect::Witness { key, counter } => {
                self.seen.push(Seen::Witness(counter.0));
                self.witness = Witness::At(counter);
                self.station.handle(self.now, Input::WitnessDone { key, counter });
            }
            _ => unreachable!(),
        }
        while let Some(effect) = self.station.next_effect() {
            self.take(effect);
        }
    }

    /// Refuses what waits longest.
    pub(crate) fn refuse(&mut self) {
        match self.waiting.pop_front().expect("something to refuse") {
            Effect::Persist(batch) => {
                self.station.handle(
                    self.now,
                    Input::PersistFailed { batch: batch.id, reason: "disk full", again_us: 1_000_000 },
                );
            }
            Effect::Witness { key, .. } => {
                self.station.handle(self.now, Input::WitnessFailed { key, reason: "disk full" });
            }
            _ => unreachable!(),
        }
        self.settle();
    }

    /// Confirms until something else than persisting is wanted, or nothing.
    pub(crate) fn confirm_persists(&mut self) {
        while matches!(self.waiting.front(), Some(Effect::Persist(_))) {
            self.confirm();
        }
    }

    pub(crate) fn unknown_batch(&mut self) {
        self.handle(Input::PersistDone(BatchId(u64::MAX)));
    }

    /// Time passes; the engine is woken when it wants.
    pub(crate) fn pass(&mut self, us: u64) {
        let end = self.now.mono.plus(us);
        for _ in 0..1_000_000 {
            match self.station.next_wakeup() {
                Some(wake) if wake <= end => self.step_to(wake),
                _ => {
                    self.step_to(end);
                    return;
                }
            }
        }
        panic!("the engine wakes without end");
    }

    fn step_to(&mut self, at: MonoUs) {
        let us = at.since(self.now.mono);
        self.now.mono = at;
        self.now.utc = self.now.utc.plus(i64::try_from(us).unwrap());
        self.handle(Input::Wake);
    }

    /// The clock on the wall is moved.
    pub(crate) fn step_utc(&mut self, us: i64) {
        self.now.utc = self.now.utc.plus(us);
    }

    pub(crate) fn link_state(&mut self, state: LinkState) {
        let link = self.link.clone();
        self.handle(Input::Link { link: &link, state });
    }

    pub(crate) fn hear(&mut self, bytes: &[u8]) {
        let link = self.link.clone();
        let received = self.now;
        self.handle(Input::Bytes { link: &link, bytes, source: Source::Radio, received });
    }

    pub(crate) fn hear_from_file(&mut self, bytes: &[u8]) {
        let link = LinkId::new("file").unwrap();
        let received = self.now;
        self.handle(Input::Bytes { link: &link, bytes, source: Source::File, received });
    }

    /// A heartbeat of a satellite that has run since long ago.
    pub(crate) fn heartbeat(&mut self) {
        let since_ms = u32::try_from(self.now.mono.0 / 1_000).unwrap();
        self.heartbeat_with_uptime(self.uptime_ms + since_ms);
    }

    pub(crate) fn heartbeat_with_uptime(&mut self, uptime_ms: u32) {
        let timestamp_ms = self.now.mono.0;
        self.hear(&heartbeat_frame(0, uptime_ms, timestamp_ms));
    }

    pub(crate) fn view(&mut self, in_view: Option<Option<UtcUs>>) {
        let satellite = self.satellite.clone();
        self.handle(Input::View { satellite: &satellite, in_view });
    }

    pub(crate) fn want(&mut self, intent: Intent) -> IntentId {
        self.intents += 1;
        let id = IntentId(self.intents);
        self.handle(Input::Intent(IntentEnvelope {
            id,
            principal: Principal::new("ann"),
            idempotency_key: self.intents.to_string(),
            digest: [0; 32],
            intent,
        }));
        id
    }

    pub(crate) fn reply(&self, id: IntentId) -> Option<&Result<Accepted, Refusal>> {
        self.replies.iter().find(|(intent, _)| *intent == id).map(|(_, result)| result)
    }

    pub(crate) fn intent_of(&self, telecommand: Telecommand) -> CommandIntent {
        let confirmation = telecommand.is_critical().then(|| telecommand.name().to_owned());
        CommandIntent {
            satellite: self.satellite.clone(),
            link: None,
            telecommand,
            priority: 0,
            gate: Gate::Heard,
            expires_at: None,
            when: None,
            attempts_allowed: None,
            confirmation,
        }
    }

    /// Wants a command; its id, once it is accepted and confirmed.
    pub(crate) fn command(&mut self, telecommand: Telecommand) -> CommandId {
        let intent = self.intent_of(telecommand);
        self.command_with(intent)
    }

    pub(crate) fn command_with(&mut self, intent: CommandIntent) -> CommandId {
        let id = self.want(Intent::Command(intent));
        match self.reply(id) {
            Some(Ok(Accepted::Command(command))) => *command,
            other => panic!("not accepted: {other:?}"),
        }
    }

    pub(crate) fn download(&mut self) -> DownloadId {
        let id = self.want(Intent::Download { satellite: self.satellite.clone(), link: None });
        match self.reply(id) {
            Some(Ok(Accepted::Download(download))) => *download,
            other => panic!("not accepted: {other:?}"),
        }
    }

    pub(crate) fn cancel(&mut self, command: CommandId) -> Result<Accepted, Refusal> {
        let id = self.want(Intent::Cancel(command));
        self.reply(id).expect("an answer at once").clone()
    }

    /// The newest hand-over.
    pub(crate) fn last_tx(&self) -> &Transmit {
        self.transmits.last().expect("something was handed over")
    }

    /// Time on the air passes, and the radio says that it is done.
    pub(crate) fn radiate(&mut self) {
        let tx = self.last_tx().tx;
        self.handle(Input::TxStarted(tx));
        self.pass(LinkTiming::default().uplink_us());
        self.handle(Input::TxDone { tx, airtime_us: 1_229_824, measured: false });
    }

    pub(crate) fn tx_failed(&mut self, radiated: MaybeRadiated) {
        let tx = self.last_tx().tx;
        self.handle(Input::TxFailed { tx, radiated, reason: "the module is busy" });
    }

    pub(crate) fn tx_done(&mut self, tx: TxId) {
        self.handle(Input::TxDone { tx, airtime_us: 1_229_824, measured: false });
    }

    /// What the newest hand-over says, and under which tag.
    pub(crate) fn last_request(&self) -> (u8, Telecommand) {
        opened(&Key::from_bytes(self.setup.key), self.last_tx())
    }

    pub(crate) fn stages(&self, command: CommandId) -> Vec<Stage> {
        self.stage_rows(command).map(|row| row.stage).collect()
    }

    pub(crate) fn stage_rows(&self, command: CommandId) -> impl Iterator<Item = &StageRecord> {
        self.stored.iter().filter_map(move |record| match record {
            Record::Stage(row) if row.command == command => Some(row),
            _ => None,
        })
    }

    /// The stage that a command has reached, as stored.
    pub(crate) fn stage(&self, command: CommandId) -> Stage {
        self.stages(command).last().copied().expect("a command that is stored")
    }

    pub(crate) fn images(&self) -> Vec<&ImageRecord> {
        let mut images: Vec<&ImageRecord> = Vec::new();
        for record in &self.stored {
            if let Record::Image(image) = record {
                images.retain(|found| found.id != image.id);
                images.push(image);
            }
        }
        images
    }

    pub(crate) fn download_state(&self, id: DownloadId) -> DownloadState {
        let rows = self.stored.iter().rev();
        let mut states = rows.filter_map(|record| match record {
            Record::Download(row) if row.id == id => Some(row.state),
            _ => None,
        });
        states.next().expect("a download that is stored")
    }

    pub(crate) fn events(&self, kind: EventKind) -> Vec<&str> {
        let events = self.stored.iter().filter_map(|record| match record {
            Record::Event(event) if event.kind == kind => Some(event.message.as_str()),
            _ => None,
        });
        events.collect()
    }

    pub(crate) fn note(&self) -> String {
        self.station.status(self.now).satellites[0].uplink.clone()
    }

    pub(crate) fn locked(&self) -> Option<String> {
        self.station.status(self.now).sealing[0].locked.clone()
    }
}

fn kind(record: &Record) -> String {
    match record {
        Record::Stage(row) => row.stage.name().to_owned(),
        Record::Sealed(row) => format!("sealed bytes {}", row.counter),
        other => {
            let text = format!("{other:?}");
            text.split('(').next().unwrap_or_default().to_ascii_lowercase()
        }
    }
}

pub(crate) fn counter_of(transmit: &Transmit) -> u64 {
    SealedUplink::from_bytes(*transmit.frame).unwrap().nonce().counter().0
}

pub(crate) fn opened(key: &Key, transmit: &Transmit) -> (u8, Telecommand) {
    let sealed = SealedUplink::from_bytes(*transmit.frame).unwrap();
    let contents = protocol::open(key, &sealed).unwrap();
    (contents.tag().map_or(0, RequestTag::get), contents.telecommand().unwrap())
}

pub(crate) fn sequence_profile() -> Profile {
    Profile { counter: CounterRule::Sequence, rssi: false, ..Profile::default() }
}
