//! Plans that were handed over: taken, armed, attached, withdrawn.

use std::sync::Arc;

use super::{About, Station};
use crate::clock::{Now, UtcUs};
use crate::id::{PlanId, PlanName, Principal, SatelliteId};
use crate::intent::{Accepted, Refusal};
use crate::level::Level;
use crate::plan::{CheckContext, Plan, Severity, check};
use crate::record::{EventKind, Record, Route};
use crate::run::{PICKS_MAX, PLANS_MAX, PlanRecord, RunState};
use crate::sky::clock_time;

impl Station {
    pub(super) fn add_plan(
        &mut self,
        now: Now,
        who: &Principal,
        plan: Arc<Plan>,
        text: Arc<str>,
    ) -> Result<Accepted, Refusal> {
        let s = self
            .satellite_index(&plan.satellite)
            .ok_or_else(|| Refusal::UnknownSatellite(plan.satellite.to_string()))?;
        let timing = self.links.iter().find(|link| link.satellite == s).map(|link| link.config.timing);
        let context = CheckContext {
            timing: timing.unwrap_or_default(),
            profile: Some(self.satellites[s].profile),
            pass: None,
            now: Some(now.utc),
        };
        let wrong: Vec<String> = check(&plan, &context)
            .iter()
            .filter(|finding| finding.severity == Severity::Error)
            .map(ToString::to_string)
            .collect();
        if !wrong.is_empty() {
            return Err(Refusal::Plan(wrong.join("; ")));
        }
        if self.plans.iter().any(|held| held.plan.name == plan.name && held.text == text) {
            return Ok(Accepted::Done);
        }
        let others = self.plans.iter().filter(|held| held.plan.name != plan.name).count();
        if others >= PLANS_MAX {
            return Err(Refusal::PlansFull(others));
        }
        let name = plan.name.clone();
        if self.plans.iter().any(|held| held.plan.name == name) {
            self.remove_plan(now, &name, "another plan took its name");
        }
        self.ids.plan += 1;
        let id = PlanId(self.ids.plan);
        let record = PlanRecord {
            id,
            station: self.station.clone(),
            plan,
            text,
            added_at: now.utc,
            who: who.clone(),
            armed: false,
            picks: Vec::new(),
            withdrawn_at: None,
        };
        self.audit(now.utc, who, "plan.add", format!("plan {name}"));
        let message = format!("{who} handed plan {name} over; it is not armed");
        self.plan_event(now.utc, s, Level::Normal, message);
        self.journal.push(Record::Plan(record.clone()));
        self.plans.push(record);
        self.agenda.is_stale = true;
        Ok(Accepted::Done)
    }

    pub(super) fn withdraw_plan(
        &mut self,
        now: Now,
        who: &Principal,
        name: &PlanName,
    ) -> Result<Accepted, Refusal> {
        let s = self.plan_satellite(name)?;
        self.audit(now.utc, who, "plan.withdraw", format!("plan {name}"));
        self.remove_plan(now, name, &format!("{who} withdrew it"));
        self.plan_event(now.utc, s, Level::Normal, format!("{who} withdrew plan {name}"));
        Ok(Accepted::Done)
    }

    pub(super) fn arm_plan(
        &mut self,
        now: Now,
        who: &Principal,
        name: &PlanName,
        armed: bool,
    ) -> Result<Accepted, Refusal> {
        let s = self.plan_satellite(name)?;
        let verb = if armed { "armed" } else { "disarmed" };
        self.audit(now.utc, who, if armed { "plan.arm" } else { "plan.disarm" }, format!("plan {name}"));
        if let Some(held) = self.plans.iter_mut().find(|held| held.plan.name == *name)
            && held.armed != armed
        {
            held.armed = armed;
            let record = held.clone();
            self.journal.push(Record::Plan(record));
            self.plan_event(now.utc, s, Level::Normal, format!("{who} {verb} plan {name}"));
            self.agenda.is_stale = true;
        }
        Ok(Accepted::Done)
    }

    pub(super) fn attach_plan(
        &mut self,
        now: Now,
        who: &Principal,
        name: &PlanName,
        at: UtcUs,
        attach: bool,
    ) -> Result<Accepted, Refusal> {
        let s = self.plan_satellite(name)?;
        let Some(held) = self.plans.iter_mut().find(|held| held.plan.name == *name) else {
            return Err(Refusal::UnknownPlan(name.to_string()));
        };
        let sky = &self.satellites[s].sky;
        let Some(pass) = sky.passes_ahead().find(|pass| pass.lasts_at(at)).copied() else {
            let id = &self.satellites[s].id;
            let next = sky.passes_ahead().next().map_or_else(
                || "no pass is known: add elements and the station's place".to_owned(),
                |pass| format!("the next one begins at {}", clock_time(pass.aos_at, now.utc)),
            );
            return Err(Refusal::Pass(format!(
                "{id} is not in view at {} (within the next two days); {next}",
                crate::sky::instant(at)
            )));
        };
        let in_pass = |pick: &UtcUs| pass.lasts_at(*pick);
        if attach {
            if let Some(facts) = sky.facts(&self.satellites[s].id, &pass)
                && let Err(why) = held.plan.takes(&facts)
            {
                return Err(Refusal::Pass(format!("plan {name} does not take this pass: {why}")));
            }
            if held.picks.iter().any(in_pass) {
                return Ok(Accepted::Done);
            }
            if held.picks.len() >= PICKS_MAX {
                return Err(Refusal::Pass(format!("{PICKS_MAX} passes are chosen already: take some back")));
            }
            held.picks.push(pass.tca_at);
        } else {
            if !held.picks.iter().any(in_pass) {
                return Err(Refusal::Pass(format!("plan {name} was not attached to this pass")));
            }
            held.picks.retain(|pick| !pass.lasts_at(*pick));
        }
        let record = held.clone();
        self.journal.push(Record::Plan(record));
        let verb = if attach { "attached" } else { "detached" };
        let aos = clock_time(pass.aos_at, now.utc);
        self.audit(
            now.utc,
            who,
            if attach { "plan.attach" } else { "plan.detach" },
            format!("plan {name}, {aos}"),
        );
        self.plan_event(now.utc, s, Level::Normal, format!("{who} {verb} plan {name}: the pass at {aos}"));
        self.agenda.is_stale = true;
        Ok(Accepted::Done)
    }

    pub(super) fn take_over(
        &mut self,
        now: Now,
        who: &Principal,
        satellite: &SatelliteId,
        held: bool,
    ) -> Result<Accepted, Refusal> {
        let s = self
            .satellite_index(satellite)
            .ok_or_else(|| Refusal::UnknownSatellite(satellite.to_string()))?;
        let Some(run) = self.runs.iter_mut().find(|run| run.record.satellite == *satellite && run.is_on())
        else {
            return Err(Refusal::NothingRuns(satellite.clone()));
        };
        run.record.state = if held { RunState::Held } else { RunState::Running };
        run.is_dirty = true;
        let verb = if held { "took over from" } else { "gave back to" };
        let plan = run.name.clone();
        self.audit(now.utc, who, if held { "plan.hold" } else { "plan.release" }, format!("plan {plan}"));
        self.plan_event(now.utc, s, Level::Normal, format!("{who} {verb} plan {plan}"));
        Ok(Accepted::Done)
    }

    fn plan_satellite(&self, name: &PlanName) -> Result<usize, Refusal> {
        let plan = self.plans.iter().find(|held| held.plan.name == *name);
        let plan = plan.ok_or_else(|| Refusal::UnknownPlan(name.to_string()))?;
        self.satellite_index(&plan.plan.satellite)
            .ok_or_else(|| Refusal::UnknownSatellite(plan.plan.satellite.to_string()))
    }

    fn remove_plan(&mut self, now: Now, name: &PlanName, why: &str) {
        let Some(at) = self.plans.iter().position(|held| held.plan.name == *name) else { return };
        let mut record = self.plans.remove(at);
        record.withdrawn_at = Some(now.utc);
        record.armed = false;
        let id = record.id;
        self.journal.push(Record::Plan(record));
        self.end_runs_of(now, id, why);
        self.agenda.is_stale = true;
    }

    pub(super) fn plan_event(&mut self, at: UtcUs, s: usize, level: Level, message: String) {
        let satellite = self.satellites[s].id.clone();
        let station = self.station.clone();
        let link = self.links.iter().find(|link| link.satellite == s).map(|link| link.config.id.clone());
        let route = link.map(|link| Route { satellite, station, link });
        self.event(at, EventKind::Plan, level, About { route, ..About::default() }, message);
    }
}
