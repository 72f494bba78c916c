//! Every run ends in one record, with a reason where it did not go through; and every pass that a plan wanted has one.

use std::collections::BTreeMap;

use mission::plan::RunEnd;
use mission::record::{EventKind, Record};
use mission::run::{RunRecord, RunState};
use mission::{Batch, RunId, SatelliteId, UtcUs};

use super::plans::{WANTED_FROM_DEG, WANTED_FROM_S};
use super::report::{FleetReport, shape};
use super::scene::{
    HOUR_US, MINUTE_US, SATELLITES, SECOND_US, STATIONS, satellite_name, station_name, utc_at,
};
use super::world::Fleet;
use crate::checks::{Invariant, Violation};

/// A run that is not over may lie so far in the past, microseconds: the engine looks once in this time at the latest, because the
/// kernel's clock is asked every 30 s.
const LATE_US: i64 = 31_000_000;
/// A clock that is further off than this tells other passes.
const CLOCK_OFF_US: i64 = 5_000_000;

/// A station that was dead at LOS and lives again has said by then what became of the run.
const HALF_AN_HOUR_US: i64 = 1_800_000_000;
/// So many of the newest events are kept for whoever looks into a violation.
const STORY_LINES: usize = 60;

/// A stretch of time.
type Span = (u64, u64);

/// What became of all runs.
#[derive(Debug, Default)]
pub(super) struct Ledger {
    runs: BTreeMap<(usize, RunId), RunRecord>,
    /// Passes that the scheduler refused: station, satellite, AOS and LOS, and why.
    refused: BTreeMap<(usize, String), (SatelliteId, UtcUs, UtcUs, String)>,
    down: [Vec<Span>; STATIONS],
    clock_off: [Vec<Span>; STATIONS],
    off_since: [Option<u64>; STATIONS],
    /// Times at which a satellite's elements told nothing, or were wrong by half a minute and more.
    blind: [[Vec<u64>; SATELLITES]; STATIONS],
    sentences: BTreeMap<String, u64>,
    wanted: u64,
    excused: u64,
    given_away: u64,
}

impl Ledger {
    /// The process did not run meanwhile.
    pub(super) fn down(&mut self, g: usize, from_us: u64, until_us: u64) {
        self.down[g].push((from_us, until_us));
    }

    /// The clock stands so far off now.
    pub(super) fn clock(&mut self, g: usize, now_us: u64, offset_us: i64) {
        if let Some(since) = self.off_since[g].take() {
            self.clock_off[g].push((since, now_us));
        }
        if offset_us.abs() > CLOCK_OFF_US {
            self.off_since[g] = Some(now_us);
        }
    }

    /// Into the report.
    pub(super) fn count(&self, report: &mut FleetReport) {
        for run in self.runs.values() {
            let name = match (&run.state, &run.progress.end) {
                (RunState::Ended, Some(end)) => end.name(),
                (state, _) => state.name(),
            };
            *report.runs.entry(name).or_default() += 1;
            if let Some(why) = reason(run) {
                *report.reasons.entry(format!("{name}: {}", shape(&why))).or_default() += 1;
            }
        }
        (report.wanted, report.excused, report.given_away) = (self.wanted, self.excused, self.given_away);
        report.sentences.clone_from(&self.sentences);
    }
}

/// What a run that did not go through has to say; `None`: it went through.
fn reason(run: &RunRecord) -> Option<String> {
    match (&run.state, &run.progress.end) {
        (RunState::Ended, Some(RunEnd::Aborted { step, why })) => Some(format!("{step}: {why}")),
        (RunState::Ended, Some(RunEnd::Stopped(why))) => Some(why.clone()),
        (RunState::Missed(why) | RunState::Dropped(why), _) => Some(why.clone()),
        _ => None,
    }
}

fn overlap<T: Ord>(a: (T, T), b: (T, T)) -> bool {
    a.0 < b.1 && b.0 < a.1
}

impl Fleet {
    /// What a batch says of runs, before it is stored.
    pub(super) fn check_runs(&mut self, g: usize, batch: &Batch) -> Result<(), Violation> {
        for record in &batch.records {
            match record {
                Record::Run(run) => self.check_run(g, run, batch)?,
                Record::Intent(receipt) => {
                    self.grounds[g].receipts.insert(receipt.idempotency_key.clone());
                }
                Record::Event(event) => {
                    self.note(event.message.as_bytes());
                    if !matches!(event.kind, EventKind::FrameHeard | EventKind::ChunkReceived) {
                        self.tell(g, event.at, &event.message);
                    }
                    if event.kind == EventKind::Plan {
                        *self.ledger.sentences.entry(shape(&event.message)).or_default() += 1;
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn tell(&mut self, g: usize, at: UtcUs, message: &str) {
        let true_time = mission::sky::instant(utc_at(self.now_us));
        let line =
            format!("{true_time} {} (its clock {}): {message}", station_name(g), mission::sky::instant(at));
        if self.story.len() >= STORY_LINES {
            self.story.pop_front();
        }
        self.story.push_back(line);
    }

    fn check_run(&mut self, g: usize, run: &RunRecord, batch: &Batch) -> Result<(), Violation> {
        let station = station_name(g);
        let fail = |what: &str| {
            Err(self.violation(Invariant::RunTold, format!("run {} of {station}: {what} ({run:?})", run.id)))
        };
        if let Some(before) = self.ledger.runs.get(&(g, run.id))
            && before.state.is_final()
        {
            return fail("it was over already");
        }
        if run.state == RunState::Ended && run.progress.end.is_none() {
            return fail("it is over, and nobody knows how");
        }
        if run.state.is_final() {
            if reason(run).is_some_and(|why| why.trim().is_empty()) {
                return fail("it has no reason");
            }
            let name = self.plan_name(g, run);
            let told = batch.records.iter().any(|record| {
                matches!(record, Record::Event(e) if e.kind == EventKind::Plan && e.message.contains(&name))
            });
            if !told {
                return fail("nobody is told");
            }
        }
        self.ledger.runs.insert((g, run.id), run.clone());
        Ok(())
    }

    fn plan_name(&self, g: usize, run: &RunRecord) -> String {
        let store = self.grounds[g].stores.get(&run.satellite);
        let plan = store.and_then(|store| store.plans.get(&run.plan));
        plan.map_or_else(String::new, |plan| plan.plan.name.to_string())
    }

    /// A station at rest: nothing is left behind, nothing is missing, nothing grows.
    pub(super) fn look_over(&mut self, g: usize) -> Result<(), Violation> {
        let now_us = self.now_us;
        let ground = &self.grounds[g];
        let now = ground.now(now_us);
        let Some(station) = ground.station.as_ref().filter(|station| station.is_settled()) else {
            return Ok(());
        };
        // The kernel's clock was not asked since it moved: the engine does not know yet.
        let just_began = now_us < ground.disk_until + MINUTE_US;
        let status = station.status(now);
        let (id, bounded) = (station_name(g), Invariant::Bounded);
        if status.storage.waiting > 1_000 || status.runs.len() > 500 || ground.outbox.len() > 50 {
            let (waiting, runs) = (status.storage.waiting, status.runs.len());
            return Err(self.violation(bounded, format!("{id}: {waiting} records wait, {runs} runs")));
        }
        for (s, sat) in status.satellites.iter().enumerate() {
            if sat.in_view.is_none() || self.is_misled(g, s, now.utc) {
                self.ledger.blind[g][s].push(now_us);
            }
        }
        for refused in &status.schedule.refused {
            let told = (refused.satellite.clone(), refused.aos, refused.los, refused.to_string());
            self.ledger.refused.insert((g, refused.key.to_string()), told);
        }
        if just_began {
            return Ok(());
        }
        let ground = &self.grounds[g];
        for (satellite, store) in ground.stores.all() {
            for run in store.runs.values().filter(|run| !run.state.is_final()) {
                if !status.runs.iter().any(|held| held.id == run.id) {
                    let detail = format!("{id}: the engine has forgotten run {} ({:?})", run.id, run.state);
                    return Err(self.violation(Invariant::NothingLeftBehind, detail));
                }
            }
            for command in store.commands.values().filter(|command| !command.stage.is_final()) {
                let late = |at: UtcUs| at.plus(LATE_US) < now.utc;
                if command.stage == mission::Stage::Queued && command.record.expires_at.is_some_and(late) {
                    let detail = format!(
                        "{id}: a {} for {satellite} has expired, and waits",
                        command.record.telecommand
                    );
                    return Err(self.violation(Invariant::NothingLeftBehind, detail));
                }
            }
        }
        if let Some(run) = status.runs.iter().find(|run| run.los_at.plus(LATE_US) < now.utc) {
            let detail =
                format!("{id}: run {} of {} is {:?}, its contact is over", run.id, run.satellite, run.state);
            return Err(self.violation(Invariant::NothingLeftBehind, detail));
        }
        for contact in status.schedule.contacts.iter().filter(|contact| contact.stop > now.utc) {
            let plan = contact.plan.as_deref();
            let armed = status.plans.iter().any(|held| held.armed && Some(held.plan.name.as_str()) == plan);
            let times = (contact.start, contact.stop);
            let has = |run: &RunRecord| {
                run.satellite == contact.satellite && overlap((run.aos_at, run.los_at), times)
            };
            let ended = self.grounds[g]
                .stores
                .get(&contact.satellite)
                .into_iter()
                .flat_map(|store| store.runs.values());
            if armed && !status.runs.iter().chain(ended).any(has) {
                let detail =
                    format!("{id}: the contact {} {:?} of an armed plan has no run", contact.key, times);
                return Err(self.violation(Invariant::NothingLeftBehind, detail));
            }
        }
        Ok(())
    }

    /// At the end: every pass that an armed plan wanted has a run, or was given away with a reason, or nobody could know.
    pub(super) fn account(&mut self) -> Result<(), Violation> {
        for g in 0..STATIONS {
            if let Some(since) = self.ledger.off_since[g].take() {
                self.ledger.clock_off[g].push((since, self.now_us));
            }
            if self.grounds[g].station.is_none() {
                self.ledger.down[g].push((self.grounds[g].down_since, self.now_us));
            }
            let now = self.grounds[g].now(self.now_us).utc;
            let over = |run: &&RunRecord| run.los_at.plus(HALF_AN_HOUR_US) < now && !run.state.is_final();
            let mut runs = self.ledger.runs.iter().filter(|((of, _), _)| *of == g).map(|(_, run)| run);
            if self.grounds[g].station.is_some()
                && let Some(run) = runs.find(over)
            {
                let detail = format!("{}: run {} is {:?} for ever", station_name(g), run.id, run.state);
                return Err(self.violation(Invariant::NothingLeftBehind, detail));
            }
            for s in 0..SATELLITES {
                for at in 0..self.passes[g][s].len() {
                    self.account_for(g, s, at)?;
                }
            }
        }
        Ok(())
    }

    fn account_for(&mut self, g: usize, s: usize, at: usize) -> Result<(), Violation> {
        let pass = self.passes[g][s][at];
        let wanted = pass.max_elevation_deg > WANTED_FROM_DEG + 0.5
            && pass.los_us - pass.aos_us > (WANTED_FROM_S + 10) * SECOND_US
            && pass.aos_us > 10 * MINUTE_US
            && pass.los_us + 10 * MINUTE_US < self.now_us;
        if !wanted {
            return Ok(());
        }
        let satellite = satellite_name(s);
        let times = (utc_at(pass.aos_us), utc_at(pass.los_us));
        let ended_us = self.now_us;
        let ledger = &mut self.ledger;
        ledger.wanted += 1;
        let of_station = |(key, _): &(&(usize, RunId), &RunRecord)| key.0 == g;
        let mut runs = ledger.runs.iter().filter(of_station).map(|(_, run)| run);
        let is_of = |run: &RunRecord| run.satellite == satellite && overlap((run.aos_at, run.los_at), times);
        if runs.any(|run| is_of(run) && run.state.is_final()) {
            return Ok(());
        }
        let mut refused =
            ledger.refused.iter().filter(|((station, _), _)| *station == g).map(|(_, told)| told);
        if refused
            .any(|(of, aos, los, why)| *of == satellite && overlap((*aos, *los), times) && !why.is_empty())
        {
            ledger.given_away += 1;
            return Ok(());
        }
        let around = (pass.aos_us.saturating_sub(5 * MINUTE_US), pass.los_us + MINUTE_US);
        let excuse = ledger.clock_off[g].iter().any(|span| overlap(*span, around))
            || ledger.down[g].iter().any(|span| {
                // Dead for all of it, or still dead: what was planned is accounted for at the next start.
                span.1 + MINUTE_US > pass.los_us && (span.0 < pass.aos_us || span.1 >= ended_us)
            })
            || ledger.blind[g][s]
                .iter()
                .any(|at| (around.0.saturating_sub(20 * MINUTE_US)..around.1 + 20 * MINUTE_US).contains(at));
        if excuse {
            ledger.excused += 1;
            return Ok(());
        }
        let near =
            |run: &&RunRecord| run.satellite == satellite && run.aos_at.0.abs_diff(times.0.0) < HOUR_US;
        let of_station = ledger.runs.iter().filter(|((of, _), _)| *of == g).map(|(_, run)| run);
        let near: Vec<String> = of_station
            .filter(near)
            .map(|run| format!("{} {:?} from {}", run.id, run.state, mission::sky::instant(run.aos_at)))
            .collect();
        let detail = format!(
            "{}: nothing is known of the pass of {satellite} from {} to {} (up to {:.1}°); runs near it: {near:?}",
            station_name(g),
            mission::sky::instant(times.0),
            mission::sky::instant(times.1),
            pass.max_elevation_deg
        );
        Err(self.violation(Invariant::NothingLeftBehind, detail))
    }
}
