//! Runs: an armed plan in its pass, from the checks before it to the report after it.
//!
//! A run wishes, and the station does: commands and downloads of a plan go the same way as those of an operator, through the
//! same gates. What a run has come to is stored in the same batch as what it asked for, so that a life that ends at any
//! point is gone on with, and nothing is asked for twice.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::outcome::mono_of;
use super::wanted::BY_PLAN;
use super::{About, Station};
use crate::clock::{Now, UtcUs};
use crate::id::{CommandId, DownloadId, PlanName, Principal, SatelliteId};
use crate::intent::{Accepted, CommandIntent};
use crate::level::Level;
use crate::plan::{
    AskState, AtLos, ContactWindow, DownloadView, Ordinal, Plan, PlanRun, Progress, RunEnd, RunView, StepEnd,
    Ticket, Wish,
};
use crate::port::LinkState;
use crate::record::{DownloadState, EventKind, Record};
use crate::run::{RunRecord, RunState};
use crate::sky::{ElementsAge, clock_time};
use crate::stage::Stage;

/// What is needed is looked at this long before a pass, microseconds.
const CHECK_BEFORE_US: i64 = 300_000_000;
/// A run that waits for something that is missing looks again after this, microseconds.
const WAIT_LOOK_US: u64 = 1_000_000;
/// A clock that is set back by no more than this was right before, as far as passes go, microseconds.
const CLOCK_STEP_US: i64 = 60_000_000;
/// Rounds of asking within one step of the engine.
const ROUNDS: usize = 64;

/// Of a run that the station, running, never came to begin or to check.
const PASSED_OVER: &str =
    "the clock went past the whole pass at once: it was set forward, or the machine slept";

/// A run with its machine.
pub(super) struct Run {
    pub(super) record: RunRecord,
    pub(super) name: PlanName,
    /// The record has changed and is not stored yet.
    pub(super) is_dirty: bool,
    plan: Arc<Plan>,
    machine: PlanRun,
    asked: BTreeMap<Ordinal, AskState>,
    stored_revision: u64,
    checked: bool,
}

/// A run that came to its end: its pass has had its run.
#[derive(Debug, Clone)]
pub(super) struct LastEnd {
    pub(super) satellite: SatelliteId,
    aos: UtcUs,
    los: UtcUs,
    at: UtcUs,
}

impl LastEnd {
    pub(super) fn of(run: &RunRecord) -> Self {
        Self { satellite: run.satellite.clone(), aos: run.aos_at, los: run.los_at, at: run.at }
    }

    /// It was the run of the contact between these. A run that ended in what is still to come ended by a clock that was
    /// wrong: the contact comes yet, and is owed its run.
    pub(super) fn was_in(&self, start: UtcUs, stop: UtcUs, now: UtcUs) -> bool {
        start < self.los && self.aos < stop && self.at <= now.plus(CLOCK_STEP_US)
    }
}

impl Run {
    pub(super) fn new(record: RunRecord, plan: Arc<Plan>) -> Self {
        let window = ContactWindow { aos: record.aos_at, los: record.los_at };
        let name = plan.name.clone();
        let asked =
            record.progress.asked.iter().map(|(ordinal, ask)| (*ordinal, ask_state(ask.ticket, ask.stage)));
        Self {
            asked: asked.collect(),
            machine: PlanRun::resume(Arc::clone(&plan), window, record.progress.clone()),
            plan,
            stored_revision: 0,
            is_dirty: false,
            checked: false,
            name,
            record,
        }
    }

    /// Its pass lasts, and it has its hands on the satellite.
    pub(super) fn is_on(&self) -> bool {
        matches!(self.record.state, RunState::Running | RunState::Held)
    }

    /// It asked for this command.
    pub(super) fn asks_for(&self, id: CommandId) -> bool {
        self.asked.values().any(|state| matches!(state, AskState::Command(command, _) if *command == id))
    }

    /// Begins where the pass before ended.
    fn take_up(&mut self, progress: Progress) {
        let window = self.machine.window();
        self.machine = PlanRun::resume(Arc::clone(&self.plan), window, progress);
        self.asked.clear();
        self.is_dirty = true;
    }

    /// New elements, or another division of the antenna.
    pub(super) fn moves_to(&mut self, aos: UtcUs, los: UtcUs) {
        (self.record.aos_at, self.record.los_at) = (aos, los);
    }

    pub(super) fn end(&mut self, at: UtcUs, state: RunState) {
        self.record.state = state;
        self.record.at = at;
        self.is_dirty = false;
    }

    /// A command of ours reached a stage.
    pub(super) fn note_stage(&mut self, id: CommandId, stage: Stage) {
        for state in self.asked.values_mut() {
            if let AskState::Command(command, at) = state
                && *command == id
            {
                *at = stage;
            }
        }
    }

    /// A download ended.
    pub(super) fn note_download(&mut self, id: DownloadId, state: DownloadState) {
        for asked in self.asked.values_mut() {
            if let AskState::Download(download, view) = asked
                && *download == id
            {
                *view = match state {
                    DownloadState::Active => DownloadView::Active,
                    DownloadState::Complete => DownloadView::Complete,
                    DownloadState::Cancelled | DownloadState::Failed => DownloadView::Ended,
                };
            }
        }
    }
}

/// What was asked for in an earlier life. A download that is not under way any more is set right by
/// [`Station::take_up_runs`].
fn ask_state(ticket: Ticket, stage: Option<Stage>) -> AskState {
    match ticket {
        Ticket::Command(id) => AskState::Command(id, stage.unwrap_or(Stage::Queued)),
        Ticket::Download(id) => AskState::Download(id, DownloadView::Active),
    }
}

impl Station {
    /// Goes on with the runs of the last life, and says which passes it slept through.
    pub(super) fn take_up_runs(&mut self, now: Now) {
        for at in 0..self.runs.len() {
            let run = &mut self.runs[at];
            let s = self.satellites.iter().position(|sat| sat.id == run.record.satellite);
            for (ordinal, ask) in run.record.progress.asked.clone() {
                let state = match (ask.ticket, s.map(|s| &self.satellites[s])) {
                    (Ticket::Command(id), Some(sat)) => {
                        let stage = sat.commands.get(&id).map(|command| command.stage).or(ask.stage);
                        AskState::Command(id, stage.unwrap_or(Stage::Queued))
                    }
                    (Ticket::Download(id), Some(sat)) => {
                        let whole =
                            sat.image.as_ref().is_some_and(|image| image.record.completed_at.is_some());
                        let view = match &sat.download {
                            Some(download) if download.record.id == id => DownloadView::Active,
                            _ if whole => DownloadView::Complete,
                            _ => DownloadView::Ended,
                        };
                        AskState::Download(id, view)
                    }
                    (ticket, None) => ask_state(ticket, ask.stage),
                };
                run.asked.insert(ordinal, state);
            }
            let planned = matches!(run.record.state, RunState::Planned | RunState::Waiting(_));
            if planned && run.record.los_at <= now.utc {
                self.miss(now, at, "the station was not running".to_owned());
            }
        }
        self.forget_runs();
    }

    /// Goes on with whatever pass lasts, and looks after those to come.
    pub(super) fn runs_step(&mut self, now: Now) {
        for at in 0..self.runs.len() {
            let Some(s) = self.satellite_index(&self.runs[at].record.satellite.clone()) else { continue };
            match self.runs[at].record.state {
                RunState::Planned | RunState::Waiting(_) => self.wait_for_pass(now, s, at),
                RunState::Running | RunState::Held => {}
                _ => continue,
            }
            if self.runs[at].is_on() {
                self.go_on_with(now, s, at);
            }
        }
        self.forget_runs();
    }

    /// What stands in the way of a run, gravest first; then what only deserves a word.
    fn checks(&self, now: Now, s: usize, transmit: bool) -> (Vec<String>, Vec<String>) {
        let (mut hard, mut soft) = (Vec::new(), Vec::new());
        let sat = &self.satellites[s];
        let mut links =
            self.links.iter().filter(|link| link.satellite == s && !link.config.receive_only).peekable();
        if let Some(why) = self.journal.failing() {
            hard.push(format!("storage fails: {why}"));
        }
        if transmit {
            if links.peek().is_none() {
                hard.push("no link transmits to this satellite".to_owned());
            } else if !links.clone().any(|link| link.state == LinkState::Ok) {
                let states: Vec<String> = links
                    .clone()
                    .map(|link| match link.state.why() {
                        Some(why) => format!("link {} is {}: {why}", link.config.id, link.state.name()),
                        None => format!("link {} is {}", link.config.id, link.state.name()),
                    })
                    .collect();
                hard.push(states.join(", "));
            } else if !links.clone().any(|link| link.may_transmit()) {
                hard.push("no transmitter is armed".to_owned());
            }
            match &sat.sealer {
                None => hard.push("this satellite has no key".to_owned()),
                Some(sealer) => {
                    if let Some(lock) = sealer.lock(self.is_vouched()) {
                        hard.push(lock.to_string());
                    }
                }
            }
        }
        if !self.is_vouched() {
            soft.push("nobody says that this machine's clock is right".to_owned());
        }
        if let Some(status) = sat.sky.status(now.utc) {
            let age = ElementsAge::at(&status.elements.elements, now.utc);
            if age.level >= Level::Watch {
                soft.push(format!(
                    "the elements are {:.0} days old, expect {:.0} s of error",
                    age.age_days, age.timing_error_s
                ));
            }
        }
        if let Some(why) = self.antenna_fault.as_ref().and_then(|fault| fault.as_ref()) {
            soft.push(format!("the rotator: {why}"));
        }
        (hard, soft)
    }

    fn wait_for_pass(&mut self, now: Now, s: usize, at: usize) {
        let run = &self.runs[at];
        let (aos, los, plan) = (run.record.aos_at, run.record.los_at, run.name.clone());
        let transmit = run.machine.plan().transmit;
        if now.utc >= los {
            let why = run.record.state.why().unwrap_or(PASSED_OVER).to_owned();
            self.miss(now, at, why);
            return;
        }
        let check_at = aos.plus(-CHECK_BEFORE_US);
        if now.utc < check_at {
            let wake = mono_of(now, check_at);
            self.satellites[s].wake_at(wake);
            return;
        }
        let (hard, soft) = self.checks(now, s, transmit);
        if !self.runs[at].checked {
            self.runs[at].checked = true;
            let all: Vec<&str> = hard.iter().chain(&soft).map(String::as_str).collect();
            let (level, message) = if all.is_empty() {
                (Level::Normal, format!("plan {plan} is ready for the pass at {}", clock_time(aos, now.utc)))
            } else {
                let level = if hard.is_empty() { Level::Watch } else { Level::Warning };
                (
                    level,
                    format!(
                        "before the pass of plan {plan} at {}: {}",
                        clock_time(aos, now.utc),
                        all.join("; ")
                    ),
                )
            };
            self.plan_event(now.utc, s, level, message);
        }
        if now.utc < aos {
            let wake = mono_of(now, aos);
            self.satellites[s].wake_at(wake);
            return;
        }
        if hard.is_empty() {
            // What the last pass left undone comes first.
            let left = self.unfinished.iter().position(|other| other.plan == self.runs[at].record.plan);
            let left = left.map(|left| self.unfinished.remove(left));
            let run = &mut self.runs[at];
            if let Some(left) = left
                && run.machine.plan().at_los == AtLos::FinishLater
            {
                run.take_up(left.progress.for_next_pass());
            }
            run.record.state = RunState::Running;
            run.record.pass = self.satellites[s].sky.open_pass();
            run.is_dirty = true;
            return;
        }
        let why = hard.join("; ");
        let run = &mut self.runs[at];
        if run.record.state.why() != Some(&why) {
            run.record.state = RunState::Waiting(why.clone());
            run.record.at = now.utc;
            self.journal.push(Record::Run(Box::new(run.record.clone())));
            let message = format!("plan {plan} cannot begin: {why}. It begins when that is over, until LOS");
            self.plan_event(now.utc, s, Level::Warning, message);
        }
        let wake = now.mono.plus(WAIT_LOOK_US);
        self.satellites[s].wake_at(wake);
    }

    fn go_on_with(&mut self, now: Now, s: usize, at: usize) {
        let readings = self.readings(now, s, at);
        let window = self.window(now, s, at);
        let heard_ago_us = self.satellites[s].contact.heard_ago_us(now.mono);
        let elevation_deg =
            self.site.as_ref().and_then(|site| self.satellites[s].sky.elevation_deg(site, now.utc));
        let disarmed = self.plans.iter().all(|held| held.id != self.runs[at].record.plan || !held.armed);
        for _ in 0..ROUNDS {
            let run = &mut self.runs[at];
            let asked = std::mem::take(&mut run.asked);
            let view = RunView {
                now,
                window,
                elevation_deg,
                heard_ago_us,
                telemetry: &readings,
                asked: &asked,
                held: run.record.state == RunState::Held,
            };
            let wishes = if disarmed {
                run.machine.stop(&view, "the plan was disarmed or withdrawn")
            } else {
                run.machine.advance(&view)
            };
            run.asked = asked;
            let mut asked_more = false;
            for wish in wishes {
                asked_more |= self.grant(now, s, at, wish);
            }
            if !asked_more {
                break;
            }
        }
        self.store_run(now, at);
        if let Some(wake) = self.runs[at].machine.next_wakeup() {
            self.satellites[s].wake_at(wake);
        }
    }

    /// Does what a run wishes. True when it asked for something, and should hear what became of it.
    fn grant(&mut self, now: Now, s: usize, at: usize, wish: Wish) -> bool {
        let plan = self.runs[at].name.clone();
        let who = Principal::new(&format!("{BY_PLAN}{plan}"));
        let satellite = self.satellites[s].id.clone();
        match wish {
            Wish::Command {
                ordinal, telecommand, priority, attempts, gate, expires_at, approved_by, ..
            } => {
                let confirmation = approved_by.map(|_| telecommand.name().to_owned());
                let intent = CommandIntent {
                    satellite,
                    link: None,
                    attempts_allowed: attempts.filter(|_| telecommand.is_idempotent()),
                    telecommand,
                    priority,
                    gate,
                    expires_at: Some(expires_at),
                    when: None,
                    confirmation,
                };
                let state = match self.command_intent(now, &who, intent) {
                    Ok(id) => {
                        let link = self.satellites[s].commands.get(&id).map(|c| c.record.route.link.clone());
                        self.runs[at].record.link = link;
                        AskState::Command(id, Stage::Queued)
                    }
                    Err(refusal) => AskState::Refused(refusal.to_string()),
                };
                self.runs[at].asked.insert(ordinal, state);
                true
            }
            Wish::Download { ordinal, .. } => {
                let state = match self.download_intent(now, &who, &satellite, None) {
                    Ok(Accepted::Download(id)) => AskState::Download(id, DownloadView::Active),
                    Ok(_) => AskState::Refused("the station gave no download".to_owned()),
                    Err(refusal) => AskState::Refused(refusal.to_string()),
                };
                self.runs[at].asked.insert(ordinal, state);
                true
            }
            Wish::Cancel { ordinal, why } => {
                match self.runs[at].asked.get(&ordinal) {
                    Some(AskState::Command(id, _)) => {
                        let id = *id;
                        // What is on its way ends by itself.
                        let _ = self.cancel_because(now, &who, id, &why);
                    }
                    Some(AskState::Download(id, DownloadView::Active)) => {
                        let id = *id;
                        let _ = self.cancel_download(now, &who, id);
                    }
                    _ => {}
                }
                false
            }
            Wish::Note { level, text } => {
                self.plan_event(now.utc, s, level, text);
                false
            }
            Wish::Done(end) => {
                self.run_ended(now, s, at, &end);
                false
            }
        }
    }

    fn run_ended(&mut self, now: Now, s: usize, at: usize, end: &RunEnd) {
        let run = &mut self.runs[at];
        run.record.state = RunState::Ended;
        run.is_dirty = true;
        let (plan, satellite) = (run.name.clone(), run.record.satellite.clone());
        let progress = run.machine.progress().clone();
        let level = match end {
            RunEnd::Completed { failures: 0 } => Level::Normal,
            RunEnd::Completed { .. } | RunEnd::Later => Level::Watch,
            RunEnd::Aborted { .. } | RunEnd::OutOfTime | RunEnd::Unfinished | RunEnd::Stopped(_) => {
                Level::Warning
            }
        };
        let message = format!("plan {plan} for {satellite}: {}", summary(end, &progress));
        self.plan_event(now.utc, s, level, message);
    }

    /// Stores a run that has changed, with what it caused.
    fn store_run(&mut self, now: Now, at: usize) {
        let run = &mut self.runs[at];
        if !run.is_dirty && run.machine.revision() == run.stored_revision {
            return;
        }
        run.is_dirty = false;
        run.stored_revision = run.machine.revision();
        run.record.progress = run.machine.progress().clone();
        let window = run.machine.window();
        (run.record.aos_at, run.record.los_at, run.record.at) = (window.aos, window.los, now.utc);
        self.journal.push(Record::Run(Box::new(run.record.clone())));
    }

    /// The pass by the newest elements. When they say that it is over, it is.
    fn window(&self, now: Now, s: usize, at: usize) -> ContactWindow {
        let record = &self.runs[at].record;
        let sky = &self.satellites[s].sky;
        let sat = &self.satellites[s];
        match sat.believed_pass(now.utc) {
            // The antenna may be wanted elsewhere before LOS, or come later than AOS.
            Some(pass) => ContactWindow {
                aos: record.aos_at.max(pass.aos_at),
                los: pass.los_at.map_or(record.los_at, |los| los.min(self.planned_stop(at).unwrap_or(los))),
            },
            None if sky.is_blind() || sat.contact.in_view().is_none() => {
                ContactWindow { aos: record.aos_at, los: record.los_at }
            }
            None => ContactWindow { aos: record.aos_at, los: record.los_at.min(now.utc) },
        }
    }

    /// Where the scheduler cuts this run's contact before LOS.
    fn planned_stop(&self, at: usize) -> Option<UtcUs> {
        let record = &self.runs[at].record;
        let contact = self.agenda.schedule.contacts.iter().find(|contact| {
            contact.satellite == record.satellite
                && contact.start < record.los_at
                && record.aos_at < contact.stop
        })?;
        contact.cut_stop.as_ref().map(|_| contact.stop)
    }

    fn miss(&mut self, now: Now, at: usize, why: String) {
        let run = &mut self.runs[at];
        run.end(now.utc, RunState::Missed(why.clone()));
        let (plan, aos, satellite) = (run.name.clone(), run.record.aos_at, run.record.satellite.clone());
        self.journal.push(Record::Run(Box::new(run.record.clone())));
        let message = format!("plan {plan} missed its pass at {}: {why}", clock_time(aos, now.utc));
        match self.satellite_index(&satellite) {
            Some(s) => self.plan_event(now.utc, s, Level::Warning, message),
            None => self.event(now.utc, EventKind::Plan, Level::Warning, About::default(), message),
        }
    }

    /// The plan of these is gone.
    pub(super) fn end_runs_of(&mut self, now: Now, plan: crate::id::PlanId, why: &str) {
        for at in 0..self.runs.len() {
            let run = &mut self.runs[at];
            if run.record.plan == plan && matches!(run.record.state, RunState::Planned | RunState::Waiting(_))
            {
                run.end(now.utc, RunState::Dropped(why.to_owned()));
                self.journal.push(Record::Run(Box::new(run.record.clone())));
            }
        }
    }

    fn forget_runs(&mut self) {
        let mut gone = Vec::new();
        self.runs.retain(|run| {
            let is_over = run.record.state.is_final();
            if is_over {
                gone.push(run.record.clone());
            }
            !is_over
        });
        // Whatever contact it stood in the way of (by another clock, by other elements) may have its run now.
        self.agenda.is_stale |= !gone.is_empty();
        for record in gone {
            if matches!(record.state, RunState::Ended) {
                self.last_ends.retain(|last| last.satellite != record.satellite);
                self.last_ends.push(LastEnd::of(&record));
                // A pass that was missed or given away finishes nothing.
                self.unfinished.retain(|other| other.plan != record.plan);
            }
            if super::agenda::is_unfinished(&record.progress) {
                self.unfinished.push(record);
            }
        }
    }
}

/// What came of a run, as a sentence.
fn summary(end: &RunEnd, progress: &Progress) -> String {
    let done = progress.results.iter().filter(|result| result.end == StepEnd::Done).count();
    let word = match end {
        RunEnd::Completed { failures: 0 } => "everything was done".to_owned(),
        RunEnd::Completed { failures } => format!("gone through, {failures} steps failed"),
        RunEnd::Aborted { step, why } => format!("ended at {step}: {why}"),
        RunEnd::OutOfTime => "its time limit was over".to_owned(),
        RunEnd::Unfinished => "LOS came before the end".to_owned(),
        RunEnd::Later => "LOS came before the end; the rest is done in the next pass".to_owned(),
        RunEnd::Stopped(why) => format!("stopped: {why}"),
    };
    let asked = progress.asked.len();
    format!("{word} ({done} steps done, {asked} things asked for)")
}

/// The parameters that a run looks at.
pub(super) fn parameters(run: &Run) -> std::collections::BTreeSet<String> {
    run.machine.parameters()
}
