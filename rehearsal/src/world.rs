//! The world: every part, one scale of time, one step at a time.

use std::collections::VecDeque;
use std::sync::Arc;

use mission::{
    Accepted, Batch, BatchId, CounterRule, Effect, Entropy, Input, Intent, IntentEnvelope, IntentId,
    LinkConfig, LinkId, LinkState, MaybeRadiated, MonoUs, Now, Principal, Profile, SatelliteConfig,
    SatelliteId, Site, Source, Station, StationConfig, Transmit, TxId, UtcUs,
};
use protocol::{Counter, Key, KeyId};
use radio::airtime::uart_us;
use radio::driver::{Driver, DriverInput, DriverOutput, DriverState, Radiated};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satellite::{Device, DeviceOutput, JournalEntry, PassProfile};
use sha2::{Digest, Sha256};

use crate::checks::{Air, Invariant, Violation};
use crate::config::WorldConfig;
use crate::operator::Desk;
use crate::parts::{device, driver_config, named, named_link, station_name};
use crate::report::Report;
use crate::store::Store;
use crate::strangers::Reports;

mod abroad;

/// Seeded bytes for the engine.
struct Seeded(ChaCha8Rng);

impl Entropy for Seeded {
    fn fill(&mut self, bytes: &mut [u8]) {
        self.0.fill_bytes(bytes);
    }
}

/// What the engine waits for at this very moment; time stands still until it is told.
enum Due {
    Persist(Arc<Batch>),
    Confirm(BatchId, bool),
    Witness(KeyId, Counter),
}

/// A ground station, a satellite and the air between, stepped by events.
pub struct World {
    config: WorldConfig,
    rng: ChaCha8Rng,
    now_us: u64,
    utc_at_zero_us: i64,
    key: Key,
    satellite: SatelliteId,
    link: LinkId,
    device: Device,
    driver: Driver,
    station: Option<Station>,
    driver_ok: bool,
    due: VecDeque<Due>,
    store: Store,
    air: Air,
    desk: Desk,
    reopen_at: Option<u64>,
    drained_at: Option<u64>,
    restart_at: Option<u64>,
    kill_at: Option<u64>,
    unplug_at: Option<u64>,
    in_view: bool,
    report: Report,
    hash: Sha256,
    forget_at: u64,
    lives: u64,
    idle_steps: u32,
    our_air_us: (u64, u64),
    their_air_us: (u64, u64),
    refusals: Vec<String>,
    reports: Reports,
}

impl World {
    /// A world as configured, at its beginning: the satellite just switched on, the ground about to start.
    pub fn new(mut config: WorldConfig) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
        let mut key_bytes = [0; 16];
        rng.fill_bytes(&mut key_bytes);
        let key = Key::from_bytes(key_bytes);
        let mut device = device(&mut config, &mut rng, &key);
        let utc_at_zero_us = i64::try_from(config.utc_at_zero_ms).unwrap_or(0) * 1_000;
        let satellite =
            config.known.as_ref().map_or_else(|| named("pixelsat-1"), |known| known.satellite.clone());
        let link = named_link("radio");
        let desk =
            Desk::new(config.operator, ChaCha8Rng::from_rng(&mut rng), satellite.clone(), link.clone());
        let report = Report { seed: config.seed, ..Report::default() };
        let reports = Reports::new(config.strangers, config.seed);
        Self {
            in_view: device.in_view(0),
            driver: Driver::new(driver_config()),
            rng,
            now_us: 0,
            utc_at_zero_us,
            key,
            satellite,
            link,
            device,
            station: None,
            driver_ok: false,
            due: VecDeque::new(),
            store: Store::default(),
            air: Air::default(),
            desk,
            reopen_at: None,
            drained_at: None,
            restart_at: Some(0),
            kill_at: None,
            unplug_at: None,
            report,
            hash: Sha256::new(),
            // What is looked at when it is over is not forgotten before.
            forget_at: if config.known.is_some() { u64::MAX } else { 0 },
            lives: 0,
            idle_steps: 0,
            config,
            our_air_us: (0, 0),
            their_air_us: (0, 0),
            refusals: Vec::new(),
            reports,
        }
    }

    /// Runs until the image on the ground equals the satellite's, for at most so many simulated seconds.
    ///
    /// # Errors
    /// The first invariant that did not hold, or that time ran out.
    pub fn run_until_image(&mut self, limit_s: u64) -> Result<Report, Violation> {
        while !self.images_equal() {
            if self.now_us > limit_s * 1_000_000 {
                let held = self.store.chunks_held();
                return Err(self.violation(Invariant::ImageEqual, format!("{held} chunks after {limit_s} s")));
            }
            self.step()?;
        }
        Ok(self.report())
    }

    /// Runs until so many passes are over.
    ///
    /// # Errors
    /// The first invariant that did not hold.
    pub fn run_passes(&mut self, passes: u64) -> Result<Report, Violation> {
        while self.report.passes < passes {
            self.step()?;
        }
        Ok(self.report())
    }

    /// The run so far.
    pub fn report(&self) -> Report {
        let stats = self.device.stats();
        let (requests, chunks_requested, chunks_bridged) = self.store.chunks_requested();
        let mut commands = self.store.finals.clone();
        for command in self.store.commands.values() {
            *commands.entry(command.stage.name()).or_default() += 1;
        }
        let hash = self.hash.clone().finalize();
        Report {
            simulated_s: self.now_us as f64 / 1e6,
            frames_sent: stats.twin.frames,
            frames_heard: self.store.frames,
            by_elevation: stats.channel.by_elevation,
            requests,
            chunks_requested,
            chunks_bridged,
            chunks_sent: stats.twin.chunks,
            uplinks: stats.ground_packets,
            airtime_up_s: stats.airtime_up_us as f64 / 1e6,
            airtime_down_s: stats.airtime_down_us as f64 / 1e6,
            scheduled: stats.twin.scheduled,
            images_equal: self.images_equal(),
            images_complete: self.store.images_complete,
            image_chunks: self.store.image().map_or(0, |(record, _)| u64::from(record.chunks)),
            commands,
            log_hash: hash.iter().map(|byte| format!("{byte:02x}")).collect(),
            ..self.report.clone()
        }
    }

    /// The image on the ground is the satellite's, byte for byte.
    pub fn images_equal(&self) -> bool {
        matches!(self.store.image(), Some((_, Some(bytes))) if bytes == self.device.twin().image())
    }

    /// What the engine has stored.
    pub(crate) fn store(&self) -> &Store {
        &self.store
    }

    /// What the engine refused, as sentences.
    pub(crate) fn refusals(&self) -> &[String] {
        &self.refusals
    }

    /// Simulated seconds since the beginning.
    pub fn now_s(&self) -> f64 {
        self.now_us as f64 / 1e6
    }

    /// One event, and everything that follows from it at once.
    ///
    /// # Errors
    /// The first invariant that did not hold.
    pub fn step(&mut self) -> Result<(), Violation> {
        self.settle()?;
        let next = [
            self.device.next_event_us(),
            self.station.as_ref().and(self.driver.next_wakeup_us()),
            self.station.as_ref().and_then(|s| s.next_wakeup()).map(|at| at.0),
            self.station.as_ref().and(self.desk.next_us()),
            self.station.as_ref().and(self.reopen_at),
            self.station.as_ref().and(self.drained_at),
            self.device.next_view_change_us(self.now_us),
            self.restart_at,
            self.kill_at,
            self.station.as_ref().and(self.unplug_at),
            self.station.as_ref().and(self.reports.next_us()),
        ];
        let next = next.into_iter().flatten().min().unwrap_or(self.now_us + 1_000_000);
        self.idle_steps = if next > self.now_us { 0 } else { self.idle_steps + 1 };
        if self.idle_steps > 10_000 {
            return Err(self.violation(Invariant::Bounded, "time stands still".to_owned()));
        }
        self.now_us = self.now_us.max(next);
        self.device_step()?;
        self.view_step();
        self.ground_step()?;
        self.settle()?;
        if self.now_us >= self.forget_at {
            self.forget_at = self.now_us + 3_600_000_000;
            let utc = self.now().utc;
            self.store.forget(utc);
            self.air.forget();
        }
        Ok(())
    }

    fn now(&self) -> Now {
        let us = i64::try_from(self.now_us).unwrap_or(i64::MAX);
        Now { mono: MonoUs(self.now_us), utc: UtcUs(self.utc_at_zero_us + us) }
    }

    fn violation(&self, invariant: Invariant, detail: String) -> Violation {
        Violation { invariant, seed: self.config.seed, at_us: self.now_us, detail }
    }

    fn note(&mut self, what: &[u8]) {
        self.hash.update(self.now_us.to_be_bytes());
        self.hash.update(what);
    }

    fn tell(&mut self, input: Input<'_>) {
        let now = self.now();
        if let Some(station) = &mut self.station {
            station.handle(now, input);
        }
    }

    /// The satellite's end.
    fn device_step(&mut self) -> Result<(), Violation> {
        while let Some(output) = self.device.poll(self.now_us) {
            match output {
                DeviceOutput::HostBytes(bytes) => {
                    if self.station.is_some() {
                        self.driver.handle(self.now_us, DriverInput::Bytes(&bytes));
                        self.driver_out();
                    }
                }
                DeviceOutput::Aux { .. } => {}
                DeviceOutput::Journal(entry) => self.journal(&entry)?,
            }
        }
        Ok(())
    }

    fn journal(&mut self, entry: &JournalEntry) -> Result<(), Violation> {
        match entry {
            JournalEntry::GroundRadiated { at_us, end_us, packet, .. } => {
                self.note(packet);
                self.our_air_us = (*at_us, *end_us);
                self.report.collisions += u64::from(overlap(self.our_air_us, self.their_air_us));
                let check = self.air.radiated(&self.store, packet, *at_us, *end_us);
                check.map_err(|(invariant, detail)| self.violation(invariant, detail))?;
            }
            JournalEntry::Accepted { nonce, .. } => {
                self.note(nonce.as_bytes());
                self.air.obeyed(*nonce);
            }
            JournalEntry::SatelliteSent { at_us, end_us, frame } => {
                self.note(frame);
                self.their_air_us = (*at_us, *end_us);
                self.reports.sent(*end_us, frame, self.in_view);
                let heard = self.in_view && overlap(self.our_air_us, self.their_air_us);
                self.report.collisions += u64::from(heard);
            }
            JournalEntry::Refused { .. } | JournalEntry::Stored { .. } => {}
        }
        Ok(())
    }

    fn view_step(&mut self) {
        let in_view = self.device.in_view(self.now_us);
        if in_view == self.in_view {
            return;
        }
        self.in_view = in_view;
        self.report.passes += u64::from(!in_view);
        self.reports.view(in_view, self.now_us);
        self.plan_chaos();
        if self.config.view_is_known {
            self.tell_view();
        }
    }

    /// Where the station stands, where that decides the passes and ground may know them.
    fn site(&self) -> Option<Site> {
        if let Some(known) = &self.config.known {
            return Some(known.site.clone());
        }
        let PassProfile::Orbit { station, orientation } = &self.config.channel.passes else { return None };
        self.config.view_is_known.then(|| Site {
            place: (**station).clone(),
            min_elevation_deg: station.mask().range_deg().0,
            orientation: *orientation,
        })
    }

    /// The satellite comes or goes. Under a stored profile ground is told; with elements it knows.
    fn tell_view(&mut self) {
        if self.site().is_some() {
            return;
        }
        let los = self.device.next_view_change_us(self.now_us).and_then(|at| i64::try_from(at).ok());
        let los = los.map(|at| UtcUs(self.utc_at_zero_us + at));
        let satellite = self.satellite.clone();
        let in_view = self.in_view.then_some(los);
        self.tell(Input::View { satellite: &satellite, in_view });
    }

    /// When the next kill and the next unplugging come.
    fn plan_chaos(&mut self) {
        let (kill, unplug) = (self.config.chaos.kill_every_s, self.config.chaos.unplug_every_s);
        let in_view = self.in_view;
        let now_us = self.now_us;
        let mut draw = |mean_s: Option<f64>| {
            let mean_s = mean_s.filter(|_| in_view)?;
            let pause_s = -mean_s * (1.0 - self.rng.random::<f64>()).ln();
            Some(now_us + (pause_s * 1e6) as u64 + 1)
        };
        (self.kill_at, self.unplug_at) = (draw(kill), draw(unplug));
    }

    /// The ground's own timers.
    fn ground_step(&mut self) -> Result<(), Violation> {
        let now_us = self.now_us;
        let is_due = |at: &mut Option<u64>| at.take_if(|at| *at <= now_us).is_some();
        if is_due(&mut self.restart_at) {
            self.start();
        }
        if is_due(&mut self.kill_at) {
            self.kill();
            self.plan_chaos();
        }
        if self.station.is_none() {
            return Ok(());
        }
        if is_due(&mut self.unplug_at) {
            self.driver.handle(now_us, DriverInput::Closed);
            self.plan_chaos();
        }
        if is_due(&mut self.reopen_at) {
            self.driver.handle(now_us, DriverInput::Opened);
        }
        if is_due(&mut self.drained_at) {
            self.driver.handle(now_us, DriverInput::Drained);
        }
        self.strangers_step();
        if self.driver.next_wakeup_us().is_some_and(|at| at <= now_us) {
            self.driver.handle(now_us, DriverInput::Wake);
        }
        self.driver_out();
        if self.station.as_ref().and_then(|s| s.next_wakeup()).is_some_and(|at| at.0 <= now_us) {
            self.tell(Input::Wake);
        }
        if self.desk.next_us().is_some_and(|at| at <= now_us) {
            let downloading = self.store.has_active_download();
            let utc = self.now().utc;
            if let Some(envelope) = self.desk.want(now_us, utc, self.in_view, downloading) {
                self.tell(Input::Intent(envelope));
            }
        }
        Ok(())
    }

    /// A new life of the engine, from what the store holds.
    fn start(&mut self) {
        let snapshot = self.store.snapshot(&self.satellite, Some(self.key.id()));
        let now = self.now();
        let config = self.station_config();
        let entropy = Box::new(Seeded(ChaCha8Rng::from_rng(&mut self.rng)));
        self.lives += 1;
        self.station = Some(Station::new(config, snapshot, entropy, now));
        self.driver = Driver::new(driver_config());
        self.driver_ok = false;
        self.driver.handle(self.now_us, DriverInput::Opened);
        self.tell(Input::Clock { synchronised: true });
        if self.config.view_is_known {
            self.tell_elements();
            self.tell_view();
        }
        let intents = self.config.known.as_mut().map(|known| std::mem::take(&mut known.intents));
        for (number, intent) in (u64::MAX / 2..).zip(intents.unwrap_or_default()) {
            self.want(number, intent);
        }
        self.driver_out();
        if self.lives == 1 {
            self.plan_chaos();
        }
    }

    /// Ground is given the elements that the satellite flies. What it holds already it skips.
    fn tell_elements(&mut self) {
        if self.site().is_none() {
            return;
        }
        let known = self.config.known.as_ref();
        let elements = known.map_or_else(|| self.device.twin().orbit().elements(), |known| &known.elements);
        let (satellite, source) = (self.satellite.clone(), "the rehearsal".to_owned());
        let elements = vec![elements.clone()];
        self.want(u64::MAX - self.lives, Intent::AddElements { satellite, elements, source });
    }

    /// Somebody wants something; the number is told once.
    fn want(&mut self, number: u64, intent: Intent) {
        self.tell(Input::Intent(IntentEnvelope {
            id: IntentId(number),
            principal: Principal::new("rehearsal"),
            idempotency_key: number.to_string(),
            digest: [0; 32],
            intent,
        }));
    }

    /// kill -9: what was not committed is gone, what the radio has is radiated.
    fn kill(&mut self) {
        if self.station.take().is_none() {
            return;
        }
        self.note(b"kill");
        self.report.kills += 1;
        self.due.clear();
        (self.reopen_at, self.drained_at) = (None, None);
        self.restart_at = Some(self.now_us + self.rng.random_range(100_000..6_000_000));
    }

    fn driver_out(&mut self) {
        while let Some(output) = self.driver.next_output() {
            match output {
                DriverOutput::Write(bytes) => {
                    self.drained_at = Some(self.now_us + uart_us(bytes.len(), 9_600));
                    self.device.host_write(self.now_us, &bytes);
                }
                DriverOutput::SetPins { m0, m1 } => self.device.set_pins(self.now_us, m0, m1),
                DriverOutput::PurgeInput | DriverOutput::Diagnostic(_) => {}
                DriverOutput::Deliver(bytes) => {
                    let (link, received) = (self.link.clone(), self.now());
                    self.tell(Input::Bytes { link: &link, bytes: &bytes, source: Source::Radio, received });
                }
                DriverOutput::TxStarted { id } => self.tell(Input::TxStarted(TxId(id))),
                DriverOutput::TxDone { id, airtime_us, measured } => {
                    self.tell(Input::TxDone { tx: TxId(id), airtime_us, measured });
                }
                DriverOutput::TxFailed { id, radiated, reason } => {
                    let radiated = match radiated {
                        Radiated::No => MaybeRadiated::No,
                        Radiated::Maybe => MaybeRadiated::Maybe,
                    };
                    self.tell(Input::TxFailed { tx: TxId(id), radiated, reason: &reason.to_string() });
                }
                DriverOutput::State(state) => self.driver_state(state),
                DriverOutput::Reopen { after_us } => self.reopen_at = Some(self.now_us + after_us),
            }
        }
    }

    fn driver_state(&mut self, state: DriverState) {
        let ok = matches!(state, DriverState::Ready | DriverState::Sending);
        if ok == self.driver_ok {
            return;
        }
        self.driver_ok = ok;
        let link = self.link.clone();
        let state =
            if ok { LinkState::Ok } else { LinkState::Unavailable { reason: format!("radio is {state:?}") } };
        self.tell(Input::Link { link: &link, state });
    }

    /// Carries out effects until nothing is left to do at this moment. A kill may come between any two of them.
    fn settle(&mut self) -> Result<(), Violation> {
        for _ in 0..100_000 {
            while let Some(effect) = self.station.as_mut().and_then(Station::next_effect) {
                self.effect(effect)?;
            }
            let Some(due) = self.due.pop_front() else {
                return Ok(());
            };
            self.come_due(due)?;
        }
        Err(self.violation(Invariant::Bounded, "the engine does not come to rest".into()))
    }

    fn come_due(&mut self, due: Due) -> Result<(), Violation> {
        let chaos = self.config.chaos;
        let dies = chaos.kill_every_s.is_some() && self.in_view && self.rng.random_bool(0.001);
        match due {
            Due::Persist(batch) => {
                if dies && self.rng.random() {
                    self.kill();
                    return Ok(());
                }
                if chaos.persist_fails > 0.0 && self.rng.random_bool(chaos.persist_fails) {
                    self.due.push_back(Due::Confirm(batch.id, false));
                    return Ok(());
                }
                self.persist(&batch)?;
                if dies {
                    self.kill();
                } else {
                    self.due.push_back(Due::Confirm(batch.id, true));
                }
            }
            Due::Confirm(batch, true) => self.tell(Input::PersistDone(batch)),
            Due::Confirm(batch, false) => {
                self.tell(Input::PersistFailed { batch, reason: "disk full", again_us: 1_000_000 })
            }
            Due::Witness(key, counter) => {
                if chaos.witness_fails > 0.0 && self.rng.random_bool(chaos.witness_fails) {
                    self.tell(Input::WitnessFailed { key, reason: "no space" });
                    return Ok(());
                }
                self.store.witness = self.store.witness.max(Some(counter));
                if dies { self.kill() } else { self.tell(Input::WitnessDone { key, counter }) }
            }
        }
        Ok(())
    }

    fn persist(&mut self, batch: &Batch) -> Result<(), Violation> {
        self.hold_against_chunks(batch)?;
        let reached = self.store.apply(batch);
        let reached = reached.map_err(|detail| self.violation(Invariant::StageOrder, detail))?;
        for reached in reached {
            self.note(reached.stage.name().as_bytes());
            let what = self.store.commands.get(&reached.command).map_or("", |c| c.record.telecommand.name());
            let verdict = self.air.verdict(reached.command, reached.stage, what);
            verdict.map_err(|(invariant, detail)| self.violation(invariant, detail))?;
        }
        Ok(())
    }

    /// A machine's request names held chunks only with a bridge event beside it.
    fn hold_against_chunks(&mut self, batch: &Batch) -> Result<(), Violation> {
        use mission::record::{EventKind, Record};
        for record in &batch.records {
            let Record::Command(command) = record else { continue };
            if command.download.is_none() {
                continue;
            }
            // Chunks that arrive in this very batch were not held when the request was made, or are told before it.
            let asked: Vec<u16> = match &command.telecommand {
                protocol::Telecommand::GetImageChunk { first, count } => {
                    (*first..first.saturating_add(*count)).collect()
                }
                protocol::Telecommand::GetImageRanges(ranges) => {
                    ranges.ranges.iter().flat_map(|r| r.first..r.first.saturating_add(r.count)).collect()
                }
                _ => continue,
            };
            let held = asked.iter().filter(|&&index| self.store.holds(index)).count();
            let declared_here =
                batch.records.iter().any(|r| matches!(r, Record::Image(image) if image.held == 0));
            let justified = batch.records.iter().any(|r| {
                matches!(r, Record::Event(e) if e.kind == EventKind::Bridge && e.subject.command == Some(command.id))
            });
            if held > 0 && !justified && !declared_here {
                let detail = format!("{}: {held} of its chunks are held", command.telecommand);
                return Err(self.violation(Invariant::NoHeldChunk, detail));
            }
        }
        Ok(())
    }

    fn effect(&mut self, effect: Effect) -> Result<(), Violation> {
        match effect {
            Effect::Persist(batch) => self.due.push_back(Due::Persist(batch)),
            Effect::Witness { key, counter } => self.due.push_back(Due::Witness(key, counter)),
            Effect::Transmit(transmit) => self.transmit(&transmit),
            Effect::Reply { result: Ok(accepted), .. } => {
                if let Accepted::Command(command) = accepted {
                    if !self.store.commands.contains_key(&command) {
                        let detail = format!("command {command} was acknowledged and is not stored");
                        return Err(self.violation(Invariant::AcknowledgedIsStored, detail));
                    }
                    self.desk.accepted(command);
                }
            }
            Effect::Reply { result: Err(refusal), .. } if self.config.known.is_some() => {
                self.refusals.push(refusal.to_string());
            }
            Effect::Reply { result: Err(_), .. }
            | Effect::Taken { .. }
            | Effect::Reserve(_)
            | Effect::ReserveClear => {}
        }
        Ok(())
    }

    fn transmit(&mut self, transmit: &Transmit) {
        let input = DriverInput::Transmit {
            id: transmit.tx.0,
            target: transmit.target_address,
            frame: &transmit.frame[..],
        };
        self.driver.handle(self.now_us, input);
        self.driver_out();
    }

    fn profile(&self) -> Profile {
        match &self.config.known {
            Some(known) => known.profile,
            None => Profile {
                tags: self.config.tags,
                ranges: self.config.ranges,
                counter: CounterRule::Time,
                ..Profile::default()
            },
        }
    }

    fn station_config(&self) -> StationConfig {
        StationConfig {
            station: station_name(),
            site: self.site(),
            times: self.config.known.as_ref().map(|known| known.times.clone()).unwrap_or_default(),
            satellites: vec![SatelliteConfig {
                id: self.satellite.clone(),
                profile: self.profile(),
                key: Some(self.key.clone()),
                limits: Vec::new(),
            }],
            links: vec![LinkConfig {
                id: self.link.clone(),
                satellite: self.satellite.clone(),
                timing: self.config.known.as_ref().map(|known| known.timing).unwrap_or_default(),
                armed: true,
                receive_only: false,
            }],
        }
    }
}

/// Two stretches of time share a moment.
fn overlap(a: (u64, u64), b: (u64, u64)) -> bool {
    a.0 < b.1 && b.0 < a.1
}
