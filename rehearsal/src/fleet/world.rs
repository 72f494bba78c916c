//! The fleet: every part on one scale of time, one event at a time.

use mission::{
    Batch, Effect, Input, Intent, LinkState, MaybeRadiated, Refusal, Source, Station, Transmit, TxId,
};
use protocol::Key;
use radio::airtime::{LinkTiming, uart_us};
use radio::driver::{DriverInput, DriverOutput, DriverState, Radiated};
use radio::model::ModelConfig;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satellite::{
    Camera, Channel, ChannelConfig, ClockSetting, Device, DeviceConfig, DeviceOutput, ImageSource,
    JournalEntry, Orbit, PassProfile, Transit, TwinConfig, TwinState,
};
use sha2::{Digest, Sha256};

use super::chaos::{Happening, TruePasses, happenings};
use super::ground::{Due, Ear, Ground, HandOver, Heard};
use super::ledger::Ledger;
use super::plans::{Planned, plans};
use super::report::FleetReport;
use super::scene::{
    COMMANDED_FROM, DAY_US, HOUR_US, MINUTE_US, SATELLITES, STATIONS, ZERO, link_name, orbits,
    satellite_name, site, times, utc_at,
};
use super::watch::true_passes;
use crate::checks::{Air, Invariant, Violation};

/// The kernel is asked for its clock this often, as the server does it.
const CLOCK_CHECK_US: u64 = 30_000_000;
/// A refused intent is tried again after this.
const RETRY_US: u64 = 5_000_000;
/// The stations are looked over this often.
const SAMPLE_US: u64 = 10 * MINUTE_US;

/// Three satellites, two stations, and everything that goes wrong in a fortnight.
pub struct Fleet {
    pub(super) seed: u64,
    pub(super) days: u64,
    pub(super) calm: bool,
    pub(super) now_us: u64,
    pub(super) orbits: [Orbit; SATELLITES],
    pub(super) passes: TruePasses,
    pub(super) space: Vec<Device>,
    pub(super) airs: Vec<Air>,
    pub(super) grounds: Vec<Ground>,
    pub(super) plans: [[Vec<Planned>; SATELLITES]; STATIONS],
    pub(super) happenings: std::collections::VecDeque<Happening>,
    pub(super) ledger: Ledger,
    pub(super) report: FleetReport,
    /// What was told last, for whoever looks into a violation.
    pub(super) story: std::collections::VecDeque<String>,
    sample_at: u64,
    forget_at: u64,
    idle_steps: u32,
    hash: Sha256,
}

impl Fleet {
    /// A fleet for so many days, drawn from the seed. `calm`: nothing goes wrong but frames on the air.
    pub fn new(seed: u64, days: u64, calm: bool) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let orbits = orbits(seed);
        let passes = true_passes(&orbits, days);
        let keys: [Key; SATELLITES] = std::array::from_fn(|_| {
            let mut bytes = [0; 16];
            rng.fill_bytes(&mut bytes);
            Key::from_bytes(bytes)
        });
        let space = (0..SATELLITES).map(|s| device(s, &orbits[s], &keys[s], &mut rng)).collect();
        let grounds = (0..STATIONS).map(|g| {
            let mine: Vec<(u64, u64)> = (0..SATELLITES)
                .filter(|s| COMMANDED_FROM[*s] == g)
                .flat_map(|s| passes[g][s].iter().map(|pass| (pass.aos_us, pass.los_us)))
                .collect();
            let times = times(g, days, if calm { &[] } else { &mine }, &mut rng);
            let ears = (0..SATELLITES).filter(|s| COMMANDED_FROM[*s] != g).map(|s| Ear {
                s,
                link: link_name(s),
                channel: Channel::new(air(g, rng.random()), &orbits[s], ZERO),
                air: std::collections::VecDeque::new(),
            });
            let ears = ears.collect();
            Ground::new(g, &keys, site(g), times, ears, ChaCha8Rng::from_rng(&mut rng))
        });
        let grounds: Vec<Ground> = grounds.collect();
        let plans = std::array::from_fn(|g| std::array::from_fn(|s| plans(s, COMMANDED_FROM[s] == g)));
        let mut fleet = Self {
            seed,
            days,
            calm,
            now_us: 0,
            happenings: happenings(seed, days, &passes, calm).into(),
            orbits,
            passes,
            space,
            airs: (0..SATELLITES).map(|_| Air::default()).collect(),
            grounds,
            plans,
            ledger: Ledger::default(),
            report: FleetReport { seed, ..FleetReport::default() },
            story: std::collections::VecDeque::new(),
            sample_at: MINUTE_US,
            forget_at: HOUR_US,
            idle_steps: 0,
            hash: Sha256::new(),
        };
        fleet.hand_over_plans();
        fleet
    }

    /// Runs to the end.
    ///
    /// # Errors
    /// The first invariant that did not hold.
    pub fn run(&mut self) -> Result<FleetReport, Violation> {
        while self.now_us < self.days * DAY_US {
            self.step()?;
        }
        self.account()?;
        Ok(self.report())
    }

    /// What came of it so far.
    pub fn report(&self) -> FleetReport {
        let hash = self.hash.clone().finalize();
        let mut report = FleetReport {
            simulated_s: self.now_us as f64 / 1e6,
            log_hash: hash.iter().map(|byte| format!("{byte:02x}")).collect(),
            ..self.report.clone()
        };
        self.ledger.count(&mut report);
        for ground in &self.grounds {
            for (_, store) in ground.stores.all() {
                for (stage, count) in &store.finals {
                    *report.commands.entry(stage).or_default() += count;
                }
                for command in store.commands.values() {
                    *report.commands.entry(command.stage.name()).or_default() += 1;
                }
                report.frames_heard += store.frames;
                report.images += store.images_complete;
            }
        }
        report
    }

    /// What the stations told last, oldest first: how a violation came about.
    pub fn story(&self) -> impl Iterator<Item = &str> {
        self.story.iter().map(String::as_str)
    }

    fn hand_over_plans(&mut self) {
        for g in 0..STATIONS {
            for planned in self.plans[g].iter().flatten() {
                let plan = planned.plan.name.clone();
                let add = Intent::AddPlan { plan: planned.plan.clone(), text: planned.text.clone() };
                self.grounds[g].want(add);
                self.grounds[g].want(Intent::ArmPlan { plan, armed: true });
            }
        }
    }

    pub(super) fn violation(&self, invariant: Invariant, detail: String) -> Violation {
        Violation { invariant, seed: self.seed, at_us: self.now_us, detail }
    }

    pub(super) fn note(&mut self, what: &[u8]) {
        self.hash.update(self.now_us.to_be_bytes());
        self.hash.update(what);
    }

    /// One event, and everything that follows from it at once.
    ///
    /// # Errors
    /// The first invariant that did not hold.
    pub fn step(&mut self) -> Result<(), Violation> {
        let devices = self.space.iter().map(Device::next_event_us);
        let grounds = self.grounds.iter().map(Ground::next_us);
        let own = [self.happenings.front().map(|next| next.at_us), Some(self.sample_at)];
        let next = devices.chain(grounds).chain(own).flatten().min().unwrap_or(self.now_us + 1_000_000);
        self.idle_steps = if next > self.now_us { 0 } else { self.idle_steps + 1 };
        if self.idle_steps > 10_000 {
            return Err(self.violation(Invariant::Bounded, "time stands still".to_owned()));
        }
        self.now_us = self.now_us.max(next);
        for s in 0..SATELLITES {
            self.satellite_step(s)?;
        }
        while let Some(next) = self.happenings.pop_front_if(|next| next.at_us <= self.now_us) {
            self.happen(next.station, next.what);
        }
        for g in 0..STATIONS {
            self.ground_step(g);
            self.settle(g)?;
        }
        if self.now_us >= self.sample_at {
            self.sample_at = self.now_us + SAMPLE_US;
            for g in 0..STATIONS {
                self.look_over(g)?;
            }
        }
        if self.now_us >= self.forget_at {
            self.forget_at = self.now_us + HOUR_US;
            for ground in &mut self.grounds {
                ground.stores.forget(utc_at(self.now_us));
            }
            self.airs.iter_mut().for_each(Air::forget);
        }
        Ok(())
    }

    fn satellite_step(&mut self, s: usize) -> Result<(), Violation> {
        let g = COMMANDED_FROM[s];
        while let Some(output) = self.space[s].poll(self.now_us) {
            match output {
                DeviceOutput::HostBytes(bytes) => {
                    if self.grounds[g].station.is_some() {
                        let r = self.radio_of(s);
                        self.grounds[g].radios[r].driver.handle(self.now_us, DriverInput::Bytes(&bytes));
                        self.driver_out(g, r);
                    }
                }
                DeviceOutput::Aux { .. } => {}
                DeviceOutput::Journal(entry) => self.journal(s, &entry)?,
            }
        }
        Ok(())
    }

    fn radio_of(&self, s: usize) -> usize {
        self.grounds[COMMANDED_FROM[s]].radios.iter().position(|radio| radio.s == s).unwrap_or_default()
    }

    fn journal(&mut self, s: usize, entry: &JournalEntry) -> Result<(), Violation> {
        let g = COMMANDED_FROM[s];
        match entry {
            JournalEntry::GroundRadiated { at_us, end_us, packet, .. } => {
                self.note(packet);
                self.report.radiations += 1;
                self.check_radiation(g, s, packet, (*at_us, *end_us))?;
                let on_air = &mut self.grounds[g].on_air;
                *on_air = [on_air[1], (*at_us, *end_us)];
                for other in (0..SATELLITES).filter(|other| *other != s && COMMANDED_FROM[*other] == g) {
                    self.space[other].deafen(*at_us, *end_us);
                }
            }
            JournalEntry::Accepted { nonce, .. } => {
                self.note(nonce.as_bytes());
                self.airs[s].obeyed(*nonce);
            }
            JournalEntry::SatelliteSent { at_us, end_us, frame } => {
                self.hear_along(s, *at_us, *end_us, frame)
            }
            JournalEntry::Refused { .. } | JournalEntry::Stored { .. } => {}
        }
        Ok(())
    }

    /// The station that does not command it may hear it, too.
    fn hear_along(&mut self, s: usize, start_us: u64, end_us: u64, frame: &[u8]) {
        for ground in &mut self.grounds {
            for ear in ground.ears.iter_mut().filter(|ear| ear.s == s) {
                let delay_us = ear.channel.sky_mut().look(end_us).delay_us();
                if let Transit::Received(reception) = ear.channel.down(end_us, frame) {
                    let (start_us, end_us) = (start_us + delay_us, end_us + delay_us);
                    let deliver_at = end_us + uart_us(reception.bytes.len(), 9_600);
                    ear.air.push_back(Heard { start_us, end_us, deliver_at, bytes: reception.bytes });
                }
            }
        }
    }

    /// The ground's own timers.
    fn ground_step(&mut self, g: usize) {
        let now_us = self.now_us;
        if self.grounds[g].restart_at.take_if(|at| *at <= now_us).is_some() {
            let down_since = self.grounds[g].down_since;
            self.ledger.down(g, down_since, now_us);
            self.grounds[g].start(now_us);
            for r in 0..self.grounds[g].radios.len() {
                self.driver_out(g, r);
            }
        }
        let is_alive = self.grounds[g].station.is_some();
        for ear in 0..self.grounds[g].ears.len() {
            while let Some(heard) = self.grounds[g].ears[ear].air.pop_front_if(|h| h.deliver_at <= now_us) {
                let deaf = |(from, until): &(u64, u64)| heard.start_us < *until && *from < heard.end_us;
                if is_alive && !self.grounds[g].on_air.iter().any(deaf) {
                    self.report.heard_along += 1;
                    let (link, received) =
                        (self.grounds[g].ears[ear].link.clone(), self.grounds[g].now(now_us));
                    let input =
                        Input::Bytes { link: &link, bytes: &heard.bytes, source: Source::Radio, received };
                    self.grounds[g].tell(now_us, input);
                }
            }
        }
        if !is_alive {
            return;
        }
        for r in 0..self.grounds[g].radios.len() {
            let radio = &mut self.grounds[g].radios[r];
            let is_due = |at: &mut Option<u64>| at.take_if(|at| *at <= now_us).is_some();
            if is_due(&mut radio.reopen_at) {
                radio.driver.handle(now_us, DriverInput::Opened);
            }
            if is_due(&mut radio.drained_at) {
                radio.driver.handle(now_us, DriverInput::Drained);
            }
            if radio.driver.next_wakeup_us().is_some_and(|at| at <= now_us) {
                radio.driver.handle(now_us, DriverInput::Wake);
            }
            self.driver_out(g, r);
        }
        let ground = &mut self.grounds[g];
        if ground.check_at <= now_us {
            ground.check_at = now_us + CLOCK_CHECK_US;
            let synchronised = ground.synchronised;
            ground.tell(now_us, Input::Clock { synchronised });
        }
        if ground.station.as_ref().and_then(Station::next_wakeup).is_some_and(|at| at.0 <= now_us) {
            ground.tell(now_us, Input::Wake);
        }
        ground.send_wanted(now_us);
    }

    pub(super) fn driver_out(&mut self, g: usize, r: usize) {
        let now_us = self.now_us;
        let s = self.grounds[g].radios[r].s;
        while let Some(output) = self.grounds[g].radios[r].driver.next_output() {
            let ground = &mut self.grounds[g];
            match output {
                DriverOutput::Write(bytes) => {
                    ground.radios[r].drained_at = Some(now_us + uart_us(bytes.len(), 9_600));
                    self.space[s].host_write(now_us, &bytes);
                }
                DriverOutput::SetPins { m0, m1 } => self.space[s].set_pins(now_us, m0, m1),
                DriverOutput::PurgeInput | DriverOutput::Diagnostic(_) => {}
                DriverOutput::Deliver(bytes) => {
                    let (link, received) = (ground.radios[r].link.clone(), ground.now(now_us));
                    let input = Input::Bytes { link: &link, bytes: &bytes, source: Source::Radio, received };
                    ground.tell(now_us, input);
                }
                DriverOutput::TxStarted { id } => ground.tell(now_us, Input::TxStarted(TxId(id))),
                DriverOutput::TxDone { id, airtime_us, measured } => {
                    ground.tell(now_us, Input::TxDone { tx: TxId(id), airtime_us, measured });
                }
                DriverOutput::TxFailed { id, radiated, reason } => {
                    let radiated = match radiated {
                        Radiated::No => MaybeRadiated::No,
                        Radiated::Maybe => MaybeRadiated::Maybe,
                    };
                    let reason = reason.to_string();
                    ground.tell(now_us, Input::TxFailed { tx: TxId(id), radiated, reason: &reason });
                }
                DriverOutput::State(state) => self.driver_state(g, r, state),
                DriverOutput::Reopen { after_us } => ground.radios[r].reopen_at = Some(now_us + after_us),
            }
        }
    }

    fn driver_state(&mut self, g: usize, r: usize, state: DriverState) {
        let is_ok = matches!(state, DriverState::Ready | DriverState::Sending);
        let ground = &mut self.grounds[g];
        if std::mem::replace(&mut ground.radios[r].is_ok, is_ok) == is_ok {
            return;
        }
        let link = ground.radios[r].link.clone();
        let state = if is_ok {
            LinkState::Ok
        } else {
            LinkState::Unavailable { reason: format!("radio is {state:?}") }
        };
        ground.tell(self.now_us, Input::Link { link: &link, state });
    }

    /// Carries out effects until nothing is left to do at this moment. A kill may come between any two of them.
    fn settle(&mut self, g: usize) -> Result<(), Violation> {
        for _ in 0..100_000 {
            while let Some(effect) = self.grounds[g].station.as_mut().and_then(Station::next_effect) {
                self.effect(g, effect)?;
            }
            let Some(due) = self.grounds[g].due.pop_front() else {
                return Ok(());
            };
            self.come_due(g, due)?;
        }
        Err(self.violation(Invariant::Bounded, "the engine does not come to rest".into()))
    }

    fn effect(&mut self, g: usize, effect: Effect) -> Result<(), Violation> {
        match effect {
            Effect::Persist(batch) => self.grounds[g].due.push_back(Due::Persist(batch)),
            Effect::Witness { key, counter } => self.grounds[g].due.push_back(Due::Witness(key, counter)),
            Effect::Transmit(transmit) => self.transmit(g, &transmit)?,
            Effect::Reply { intent, result } => self.answered(g, intent.0, result.err()),
            Effect::Taken { .. } => {}
            Effect::Reserve(frame) => self.grounds[g].stores.reserve.push(frame),
            Effect::ReserveClear => self.grounds[g].stores.reserve.clear(),
        }
        Ok(())
    }

    fn answered(&mut self, g: usize, number: u64, refusal: Option<Refusal>) {
        let ground = &mut self.grounds[g];
        let Some(at) = ground.asked.iter().position(|wanted| wanted.number == number) else { return };
        let wanted = ground.asked.remove(at);
        let Some(refusal) = refusal else { return };
        ground.forget_wanted(&wanted.intent);
        if matches!(refusal, Refusal::Storage(_)) {
            ground.outbox.push_back(wanted);
            ground.retry_at = Some(self.now_us + RETRY_US);
        } else {
            *self.report.refusals.entry(super::report::shape(&refusal.to_string())).or_default() += 1;
        }
    }

    fn transmit(&mut self, g: usize, transmit: &Transmit) -> Result<(), Violation> {
        let Some(r) = self.grounds[g].radios.iter().position(|radio| radio.link == transmit.link) else {
            let detail = format!("bytes for link {}, which does not transmit", transmit.link);
            return Err(self.violation(Invariant::InWindow, detail));
        };
        self.check_hand_over(g, r, transmit)?;
        let handed =
            HandOver { at_us: self.now_us, s: self.grounds[g].radios[r].s, frame: transmit.frame.clone() };
        self.grounds[g].handed.push_back(handed);
        if self.grounds[g].handed.len() > 8 {
            self.grounds[g].handed.pop_front();
        }
        let input = DriverInput::Transmit {
            id: transmit.tx.0,
            target: transmit.target_address,
            frame: &transmit.frame[..],
        };
        self.grounds[g].radios[r].driver.handle(self.now_us, input);
        self.driver_out(g, r);
        Ok(())
    }

    fn come_due(&mut self, g: usize, due: Due) -> Result<(), Violation> {
        let now_us = self.now_us;
        let in_pass =
            !self.calm && (0..SATELLITES).any(|s| COMMANDED_FROM[s] == g && self.space[s].in_view(now_us));
        let ground = &mut self.grounds[g];
        let dies = in_pass && ground.rng.random_bool(0.000_5);
        match due {
            Due::Persist(batch) => {
                if now_us < ground.disk_until {
                    ground.due.push_back(Due::Confirm(batch.id, false));
                } else if dies && ground.rng.random() {
                    self.kill(g, 2_000_000);
                } else {
                    self.persist(g, &batch)?;
                    if dies {
                        self.kill(g, 2_000_000);
                    } else {
                        self.grounds[g].due.push_back(Due::Confirm(batch.id, true));
                    }
                }
            }
            Due::Confirm(batch, true) => ground.tell(now_us, Input::PersistDone(batch)),
            Due::Confirm(batch, false) => {
                ground.tell(now_us, Input::PersistFailed { batch, reason: "disk full", again_us: 1_000_000 });
            }
            Due::Witness(key, _) if now_us < ground.disk_until => {
                ground.tell(now_us, Input::WitnessFailed { key, reason: "no space" });
            }
            Due::Witness(key, counter) => {
                ground.stores.raise_witness(key, counter);
                if dies {
                    self.kill(g, 2_000_000);
                } else {
                    ground.tell(now_us, Input::WitnessDone { key, counter });
                }
            }
        }
        Ok(())
    }

    fn persist(&mut self, g: usize, batch: &Batch) -> Result<(), Violation> {
        self.check_runs(g, batch)?;
        let reached = self.grounds[g].stores.apply(batch);
        let reached = reached.map_err(|detail| self.violation(Invariant::StageOrder, detail))?;
        for (satellite, reached) in reached {
            self.note(reached.stage.name().as_bytes());
            let Some(s) = (0..SATELLITES).find(|s| satellite_name(*s) == satellite) else { continue };
            let store = self.grounds[g].stores.get(&satellite);
            let command = store.and_then(|store| store.commands.get(&reached.command));
            let what = command.map_or("", |command| command.record.telecommand.name());
            let verdict = self.airs[s].verdict(reached.command, reached.stage, what);
            verdict.map_err(|(invariant, detail)| self.violation(invariant, detail))?;
        }
        Ok(())
    }

    /// kill -9: what was not committed is gone, what the radio has is radiated.
    pub(super) fn kill(&mut self, g: usize, down_us: u64) {
        let ground = &mut self.grounds[g];
        if ground.station.take().is_none() {
            return;
        }
        ground.due.clear();
        for radio in &mut ground.radios {
            (radio.reopen_at, radio.drained_at) = (None, None);
        }
        ground.down_since = self.now_us;
        ground.restart_at = Some(self.now_us + down_us);
        self.report.kills += 1;
        self.note(b"kill");
    }
}

/// The air over a station.
pub(super) fn air(g: usize, seed: u64) -> ChannelConfig {
    ChannelConfig {
        seed,
        passes: PassProfile::seen_from(site(g).place),
        loss: 0.02,
        flips: 1e-5,
        elevation_loss: true,
        ..ChannelConfig::default()
    }
}

/// A satellite in service: its clock was set, it has its elements, and a picture lies in its memory.
fn device(s: usize, orbit: &Orbit, key: &Key, rng: &mut ChaCha8Rng) -> Device {
    let mut twin = TwinConfig::new(rng.random(), key.clone());
    let size_bytes = rng.random_range(6_000..20_000);
    twin.camera = Camera::Pattern { size_bytes };
    let mut bytes = vec![0; 8_000];
    rng.fill_bytes(&mut bytes);
    twin.image = ImageSource::Bytes { bytes: bytes.into(), width_px: 408, height_px: 304 };
    twin.orbit = Some(orbit.clone());
    twin.utc_at_zero_ms = u64::try_from(ZERO.unix_us() / 1000).unwrap_or(0);
    twin.first_heartbeat_us = rng.random_range(0..twin.heartbeat_period_us);
    let utc_ms = twin.utc_at_zero_ms;
    let state = TwinState {
        clock: Some(ClockSetting { set_ms: utc_ms, at_utc_ms: utc_ms }),
        elements: true,
        ..TwinState::default()
    };
    let air = air(COMMANDED_FROM[s], rng.random());
    let made = DeviceConfig::new(twin, air, ModelConfig::prepared(true));
    Device::new(DeviceConfig { state, timing: LinkTiming::default(), ..made })
}
