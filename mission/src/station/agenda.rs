//! Which plan gets which pass: candidates for the scheduler, and what its answer means for runs.

use std::sync::Arc;

use super::Station;
use super::health::Fitness;
use super::runner::Run;
use crate::clock::{Now, UtcUs};
use crate::id::{AntennaId, RunId, SatelliteId};
use crate::level::Level;
use crate::plan::{Plan, Progress, RunEnd};
use crate::record::Record;
use crate::run::{PlanRecord, RunRecord, RunState};
use crate::schedule::{
    self, Antenna, Blackout, Candidate, Contact, Foretold, Partial, PassKey, Policy, Problem, Remembered,
    Schedule, Scope, identify,
};
use crate::sky::{PassAhead, clock_time};

/// Passes keep their names while they are this old, microseconds.
const NAMES_KEPT_US: i64 = 6 * 3_600_000_000;

/// What is planned.
#[derive(Debug, Default)]
pub(super) struct Agenda {
    /// Plans or passes have changed.
    pub(super) is_stale: bool,
    pub(super) schedule: Arc<Schedule>,
    names: Vec<Foretold>,
    memory: Vec<Remembered>,
    pub(super) fitness: Fitness,
    /// Nothing was scheduled in this life yet.
    is_first: bool,
    /// Revisions of all skies together, as scheduled last.
    skies: u64,
}

/// How a plan stands among those that want one pass: chosen by an operator, armed, priority, worth.
type Rank = (bool, bool, i16, f64);

/// A plan for a pass.
struct Match {
    plan: Arc<Plan>,
    record: crate::id::PlanId,
    armed: bool,
}

impl Station {
    /// Schedules anew when plans or passes have changed, and brings the planned runs in line.
    pub(super) fn agenda_step(&mut self, now: Now) {
        let changed = self.fitness_step(now);
        self.agenda.is_stale |= changed;
        let skies = self.satellites.iter().fold(0_u64, |sum, sat| sum.wrapping_add(sat.sky.revision()));
        if self.site.is_none() || (!self.agenda.is_stale && skies == self.agenda.skies) {
            return;
        }
        self.agenda.is_stale = false;
        self.agenda.skies = skies;
        if self.plans.is_empty() && self.agenda.schedule.contacts.is_empty() && self.runs.is_empty() {
            self.agenda.schedule = Arc::default();
            return;
        }
        self.lose_picks(now);
        let mut candidates = Vec::new();
        let mut matches = Vec::new();
        for s in 0..self.satellites.len() {
            self.candidates_of(now, s, &mut candidates, &mut matches);
        }
        let antenna = Antenna {
            id: self.antenna.clone(),
            station: self.station.clone(),
            switch_over_s: self.times.switch_over_s,
        };
        let site = schedule::Site {
            station: self.station.clone(),
            health: self.agenda.fitness.health(),
            licence: self.times.licence.clone(),
        };
        let blackout = |(window, reason): &(schedule::Window, String)| Blackout {
            scope: Scope::Station(self.station.clone()),
            window: *window,
            reason: reason.clone(),
        };
        let dead = self.satellites.iter().enumerate();
        let dead = dead.filter_map(|(s, sat)| self.agenda.fitness.blackout(s, &sat.id, now));
        let problem = Problem {
            candidates,
            antennas: vec![antenna],
            sites: vec![site],
            blackouts: self.times.blackouts.iter().map(blackout).chain(dead).collect(),
            policy: Policy::default(),
        };
        if std::mem::take(&mut self.agenda.is_first) {
            self.agenda.memory = self.recalled(&problem.candidates);
        }
        let answer = schedule::plan(&problem, &self.agenda.memory);
        self.agenda.memory.clone_from(&answer.memory);
        self.plan_runs(now, &answer, &matches);
        self.agenda.schedule = Arc::new(answer);
    }

    /// What the last life had promised to armed plans: their planned runs were stored.
    fn recalled(&self, candidates: &[Candidate]) -> Vec<Remembered> {
        let ceil_s = |us: i64| us.div_euclid(1_000_000) + i64::from(us.rem_euclid(1_000_000) > 0);
        let floor_s = |us: i64| us.div_euclid(1_000_000);
        let planned = self.runs.iter().map(|run| &run.record).filter(|run| run.state == RunState::Planned);
        let of_run = |run: &RunRecord| {
            let pass = candidates.iter().find(|pass| {
                pass.satellite == run.satellite && pass.aos < run.los_at && run.aos_at < pass.los
            })?;
            Some(Remembered {
                key: pass.key.clone(),
                aos_s: ceil_s(pass.aos.0),
                los_s: floor_s(pass.los.0),
                question: 0,
                chosen: Some((self.antenna.clone(), ceil_s(run.aos_at.0), floor_s(run.los_at.0))),
                ear: false,
            })
        };
        planned.filter_map(of_run).collect()
    }

    /// The passes of one satellite that plans want.
    fn candidates_of(
        &mut self,
        now: Now,
        s: usize,
        candidates: &mut Vec<Candidate>,
        matches: &mut Vec<(PassKey, Match)>,
    ) {
        let sat = &self.satellites[s];
        // Elements that are too old to tell presence tell no pass to plan for either.
        if sat.contact.in_view().is_none() {
            return;
        }
        let passes: Vec<PassAhead> =
            sat.sky.passes_ahead().filter(|pass| pass.los_at.is_some()).copied().collect();
        let found: Vec<(UtcUs, UtcUs)> =
            passes.iter().map(|pass| (pass.aos_at, pass.los_at.unwrap_or(pass.tca_at))).collect();
        let keys = identify(&sat.id, &self.station, &self.agenda.names, &found);
        self.agenda.names.retain(|known| {
            known.key.satellite != sat.id && known.los.0 > now.utc.0.saturating_sub(NAMES_KEPT_US)
        });
        let names = keys.iter().zip(&found).map(|(key, (aos, los))| Foretold {
            key: key.clone(),
            aos: *aos,
            los: *los,
        });
        self.agenda.names.extend(names);
        for (key, pass) in keys.into_iter().zip(&passes) {
            let Some(best) = self.plan_for(&sat.id, s, pass) else { continue };
            let los = pass.los_at.unwrap_or(pass.tca_at);
            let duration_s =
                u32::try_from(los.0.saturating_sub(pass.aos_at.0) / 1_000_000).unwrap_or(u32::MAX);
            let priority = u8::try_from(i32::from(best.plan.priority).clamp(-4, 5) + 5).unwrap_or(5);
            let whole = f64::from(schedule::points(priority, duration_s, pass.max_elevation_deg));
            let value = (whole * best.plan.worth.clamp(0.0, 1e6)).clamp(1.0, f64::from(Candidate::MAX_VALUE));
            candidates.push(Candidate {
                key: key.clone(),
                satellite: sat.id.clone(),
                station: self.station.clone(),
                antennas: Vec::new(),
                aos: pass.aos_at,
                los,
                max_elevation_deg: pass.max_elevation_deg,
                value: value as u32,
                min_duration_s: u32::try_from(best.plan.min_pass.duration_us / 1_000_000)
                    .unwrap_or(u32::MAX)
                    .max(1),
                partial: Partial::Proportional,
                transmit: best.plan.transmit,
                plan: Some(Arc::from(best.plan.name.as_str())),
            });
            matches.push((key, best));
        }
    }

    /// The plan that a pass gets: chosen by an operator before a rule, armed before not armed, then by priority and worth.
    fn plan_for(&self, id: &SatelliteId, s: usize, pass: &PassAhead) -> Option<Match> {
        let site = self.site.as_ref()?;
        let sky = &self.satellites[s].sky;
        let mut best: Option<(Rank, &PlanRecord)> = None;
        for held in self.plans.iter().filter(|held| held.plan.satellite == *id) {
            let picked = held.picks.iter().any(|pick| pass.lasts_at(*pick));
            let matches = || {
                sky.facts_for(id, pass, &held.plan, site)
                    .is_some_and(|facts| held.plan.attaches_to(&facts).is_ok())
            };
            if !picked && !matches() {
                continue;
            }
            let rank = (picked, held.armed, held.plan.priority, held.plan.worth);
            if best.as_ref().is_none_or(|(found, _)| rank > *found) {
                best = Some((rank, held));
            }
        }
        best.map(|(_, held)| Match { plan: Arc::clone(&held.plan), record: held.id, armed: held.armed })
    }

    /// Passes that an operator chose and that are gone: said, and forgotten.
    fn lose_picks(&mut self, now: Now) {
        let mut told = Vec::new();
        for held in &mut self.plans {
            let Some(sat) = self.satellites.iter().find(|sat| sat.id == held.plan.satellite) else {
                continue;
            };
            if sat.sky.is_blind() {
                continue;
            }
            let before = held.picks.clone();
            let sky = &sat.sky;
            held.picks.retain(|pick| sky.covers(*pick) || (*pick > now.utc && !sky.knows(*pick)));
            for gone in before.iter().filter(|pick| !held.picks.contains(pick) && **pick > now.utc) {
                told.push((held.plan.satellite.clone(), held.plan.name.clone(), *gone));
            }
            if held.picks != before {
                self.journal.push(Record::Plan(held.clone()));
            }
        }
        for (satellite, plan, at) in told {
            let Some(s) = self.satellite_index(&satellite) else { continue };
            let at = clock_time(at, now.utc);
            let message = format!(
                "plan {plan} was attached to a pass at {at}, and by the newest elements there is none: attach it anew"
            );
            self.plan_event(now.utc, s, Level::Warning, message);
        }
    }

    /// A planned run for each contact of an armed plan; what was planned and is no more is dropped, and why.
    fn plan_runs(&mut self, now: Now, answer: &Schedule, matches: &[(PassKey, Match)]) {
        let wanted: Vec<(&Contact, &Match)> = answer
            .contacts
            .iter()
            .filter_map(|contact| {
                let (_, plan) = matches.iter().find(|(key, _)| *key == contact.key)?;
                plan.armed.then_some((contact, plan))
            })
            .collect();
        for at in 0..self.runs.len() {
            let run = &self.runs[at];
            if !matches!(run.record.state, RunState::Planned) {
                continue;
            }
            let same = wanted.iter().find(|(contact, plan)| {
                plan.record == run.record.plan
                    && contact.start < run.record.los_at
                    && run.record.aos_at < contact.stop
            });
            match same {
                Some((contact, _)) => self.runs[at].moves_to(contact.start, contact.stop),
                None if now.utc < run.record.los_at => {
                    let why = self.why_not(answer, run);
                    self.drop_run(now, at, why);
                }
                None => {}
            }
        }
        self.runs.retain(|run| !run.record.state.is_final());
        // Contacts end at whole seconds: one may be over while its pass still lasts.
        for (contact, plan) in wanted.into_iter().filter(|(contact, _)| contact.stop > now.utc) {
            let taken = self.runs.iter().any(|run| {
                run.record.satellite == contact.satellite
                    && contact.start < run.record.los_at
                    && run.record.aos_at < contact.stop
            });
            // A run that ended in this pass was its run.
            let had = self.last_ends.iter().any(|last| {
                last.satellite == contact.satellite && last.was_in(contact.start, contact.stop, now.utc)
            });
            if !taken && !had {
                self.new_run(now, contact, plan);
            }
        }
    }

    fn new_run(&mut self, now: Now, contact: &Contact, plan: &Match) {
        self.ids.run += 1;
        let record = RunRecord {
            id: RunId(self.ids.run),
            plan: plan.record,
            satellite: contact.satellite.clone(),
            station: self.station.clone(),
            link: None,
            pass: None,
            aos_at: contact.start,
            los_at: contact.stop,
            state: RunState::Planned,
            progress: Progress::default(),
            at: now.utc,
        };
        self.journal.push(Record::Run(Box::new(record.clone())));
        self.runs.push(Run::new(record, Arc::clone(&plan.plan)));
    }

    fn why_not(&self, answer: &Schedule, run: &Run) -> String {
        let plan = self.plans.iter().find(|held| held.id == run.record.plan);
        match plan {
            None => return "the plan was withdrawn".to_owned(),
            Some(held) if !held.armed => return "the plan was disarmed".to_owned(),
            Some(_) => {}
        }
        let refused = answer.refused.iter().find(|refused| {
            refused.satellite == run.record.satellite
                && refused.aos < run.record.los_at
                && run.record.aos_at < refused.los
        });
        match refused {
            Some(refused) => refused.to_string(),
            None if self.is_unbelieved(&run.record.satellite) => {
                "the elements tell no passes any more: add newer ones".to_owned()
            }
            None => self.why_changed(answer, run),
        }
    }

    /// Of a contact that nothing refused: another plan has it, or the pass has changed.
    fn why_changed(&self, answer: &Schedule, run: &Run) -> String {
        let (aos, los) = (run.record.aos_at, run.record.los_at);
        let mut contacts = answer.contacts.iter().filter(|contact| {
            contact.satellite == run.record.satellite && contact.start < los && aos < contact.stop
        });
        if let Some(plan) = contacts.find_map(|contact| contact.plan.as_deref()) {
            return if plan == run.name.as_str() {
                "the antenna comes to it at another time of the pass".to_owned()
            } else {
                format!("plan {plan} gets this pass")
            };
        }
        let sat = self.satellites.iter().find(|sat| sat.id == run.record.satellite);
        let still = sat.and_then(|sat| sat.sky.passes_ahead().find(|pass| pass.is_same_as(aos, Some(los))));
        match still {
            Some(_) => "by the newest elements it is not a pass that this plan asks for".to_owned(),
            None => "by the newest elements there is no such pass".to_owned(),
        }
    }

    fn is_unbelieved(&self, satellite: &SatelliteId) -> bool {
        self.satellites.iter().any(|sat| sat.id == *satellite && sat.contact.in_view().is_none())
    }

    fn drop_run(&mut self, now: Now, at: usize, why: String) {
        let run = &mut self.runs[at];
        let (plan, aos) = (run.name.clone(), run.record.aos_at);
        let satellite = run.record.satellite.clone();
        run.end(now.utc, RunState::Dropped(why.clone()));
        self.journal.push(Record::Run(Box::new(run.record.clone())));
        let disarmed = why.ends_with("disarmed") || why.ends_with("withdrawn");
        let level = if disarmed { Level::Normal } else { Level::Warning };
        if let Some(s) = self.satellite_index(&satellite) {
            let message = format!("plan {plan} does not get the pass at {}: {why}", clock_time(aos, now.utc));
            self.plan_event(now.utc, s, level, message);
        }
    }
}

impl Agenda {
    /// To be drawn up for the first time in this life.
    pub(super) fn at_start() -> Self {
        Self { is_stale: true, is_first: true, ..Self::default() }
    }

    /// A station has one antenna, and it has the station's name.
    #[expect(clippy::expect_used, reason = "both kinds of names obey the same rule")]
    pub(super) fn antenna(station: &crate::id::StationId) -> AntennaId {
        AntennaId::new(station.as_str()).expect("a station's name is a name")
    }
}

/// Of a run that ended to be finished later.
pub(super) fn is_unfinished(progress: &Progress) -> bool {
    progress.end == Some(RunEnd::Later)
}
