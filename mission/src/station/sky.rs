//! Elements and passes: whether a satellite is in view, and until when.
//!
//! Passes are sought two days ahead, and again when half of that is over, when the clock went back, or when other elements
//! are the best for the moment. Elements whose timing error is beyond use say nothing: then hearing alone decides, as
//! it does without elements.

use std::collections::VecDeque;
use std::sync::Arc;

use super::outcome::mono_of;
use super::satellite::Satellite;
use super::{About, Station};
use crate::clock::{Now, UtcUs};
use crate::id::{ElementsId, PassId, Principal, SatelliteId};
use crate::intent::{Accepted, Refusal};
use crate::level::Level;
use crate::plan::{NoMatch, PassFacts, Plan};
use crate::record::{ElementsRecord, EventKind, PASS_ELEMENTS_MAX, PassRecord, Record, Route};
use crate::sky::{
    AHEAD_US, ElementSet, ElementsAge, PASSES_TOLD, PassAhead, SETS_AT_ONCE, SETS_KEPT, Site, best_set,
    clock_time, instant, passes_of, sunlit_at,
};
use crate::snapshot::SatelliteSnapshot;
use crate::status::SkyStatus;

/// A heartbeat is overdue after so many periods in view without one.
const OVERDUE_PERIODS: i64 = 2;
/// Nobody is surprised to hear nothing in a pass that stays lower, degrees.
const HEARD_FROM_DEG: f64 = 10.0;
/// Microseconds in a day.
const DAY_US: i64 = 86_400_000_000;
/// The age of elements is looked at this often.
const AGE_LOOK_US: i64 = 3_600_000_000;

/// What is known of a satellite's place.
#[derive(Debug, Default)]
pub(super) struct Sky {
    sets: Vec<ElementSet>,
    /// The set that the passes below were computed from.
    used: Option<ElementsId>,
    /// What is in view or to come; what is over is taken out.
    passes: VecDeque<PassAhead>,
    /// Passes are known from here to there; `None`: they are to be sought.
    known: Option<(UtcUs, UtcUs)>,
    /// Rises with each search.
    revision: u64,
    propagator: Option<tle::Propagator>,
    fault: Option<String>,
    level: Level,
    /// Whose age was looked at last, and when.
    aged: Option<(ElementsId, UtcUs)>,
    /// The pass that lasts, as it is stored.
    open: Option<PassRecord>,
    overdue_told: bool,
}

impl Sky {
    pub(super) fn restore(left: Option<&SatelliteSnapshot>) -> Self {
        let mut sky = Self::default();
        if let Some(left) = left {
            sky.sets.clone_from(&left.elements);
            sky.open.clone_from(&left.pass);
            sky.trim();
        }
        sky
    }

    /// The pass that lasts.
    pub(super) fn pass(&self, at: UtcUs) -> Option<&PassAhead> {
        self.passes.front().filter(|pass| pass.lasts_at(at))
    }

    /// When the next pass begins; `None` when one lasts or none is known.
    pub(super) fn next_aos(&self, at: UtcUs) -> Option<UtcUs> {
        self.passes.front().filter(|pass| !pass.lasts_at(at)).map(|pass| pass.aos_at)
    }

    /// The pass that lasts, and those to come.
    pub(super) fn passes_ahead(&self) -> impl Iterator<Item = &PassAhead> {
        self.passes.iter()
    }

    /// The number of the pass that lasts.
    pub(super) fn open_pass(&self) -> Option<PassId> {
        self.open.as_ref().map(|pass| pass.id)
    }

    /// Rises whenever passes were sought anew.
    pub(super) fn revision(&self) -> u64 {
        self.revision
    }

    /// Nothing is known of passes.
    pub(super) fn is_blind(&self) -> bool {
        self.used.is_none() || self.fault.is_some()
    }

    /// Passes around this instant are known, if there are any.
    pub(super) fn knows(&self, at: UtcUs) -> bool {
        self.known.is_some_and(|(from, until)| from <= at && at < until)
    }

    /// It is in view at this instant.
    pub(super) fn covers(&self, at: UtcUs) -> bool {
        self.passes.iter().any(|pass| pass.lasts_at(at))
    }

    /// How high it stands over the station, degrees.
    pub(super) fn elevation_deg(&self, site: &Site, at: UtcUs) -> Option<f64> {
        let at = instant(at);
        let state = self.propagator.as_ref()?.at(at).ok()?;
        let object = tle::ecef_from_teme(&state, tle::gmst_rad(at, site.orientation));
        Some(site.place.look(&object).elevation_deg)
    }

    /// What a plan's least pass looks at.
    pub(super) fn facts(&self, id: &SatelliteId, pass: &PassAhead) -> Option<PassFacts> {
        let los = pass.los_at?;
        Some(PassFacts {
            satellite: id.clone(),
            tca: pass.tca_at,
            max_elevation_deg: pass.max_elevation_deg,
            duration_us: u64::try_from(los.0.saturating_sub(pass.aos_at.0)).unwrap_or(0),
            sunlit: self.propagator.as_ref().and_then(|orbit| sunlit_at(orbit, pass.tca_at)),
            matched_before: 0,
        })
    }

    /// What a plan's rule looks at. Where only every so many-th pass is wanted, the passes of a UTC day are counted from
    /// its midnight.
    pub(super) fn facts_for(
        &self,
        id: &SatelliteId,
        pass: &PassAhead,
        plan: &Plan,
        site: &Site,
    ) -> Option<PassFacts> {
        let facts = self.facts(id, pass)?;
        if plan.attach.as_ref().is_none_or(|rule| rule.every <= 1) {
            return Some(facts);
        }
        let set = self.sets.iter().find(|set| Some(set.id) == self.used)?;
        let midnight = UtcUs(pass.tca_at.0 - pass.tca_at.0.rem_euclid(DAY_US));
        let earlier = passes_of(set, site, midnight, pass.tca_at).ok()?;
        let before = earlier.iter().filter(|other| other.tca_at >= midnight && other.tca_at < pass.tca_at);
        let matched = before.filter_map(|other| self.facts(id, other)).filter(|facts| {
            !matches!(plan.attaches_to(facts), Err(found) if !matches!(found, NoMatch::NotItsTurn { .. }))
        });
        Some(PassFacts { matched_before: matched.count() as u64, ..facts })
    }

    pub(super) fn status(&self, now: UtcUs) -> Option<SkyStatus> {
        let set = self.used.and_then(|id| self.sets.iter().find(|set| set.id == id))?;
        Some(SkyStatus {
            elements: set.clone(),
            age: ElementsAge::at(&set.elements, now),
            fault: self.fault.clone(),
            passes: self.passes.iter().take(PASSES_TOLD).copied().collect(),
        })
    }

    /// Keeps the newest by epoch.
    fn trim(&mut self) {
        self.sets.sort_by_key(|set| (set.elements.epoch, set.id));
        let surplus = self.sets.len().saturating_sub(SETS_KEPT);
        self.sets.drain(..surplus);
    }

    /// When something changes next.
    fn next_change(&self, now: UtcUs) -> UtcUs {
        let renew = self.known.map_or(now, |(_, until)| until.plus(-AHEAD_US / 2));
        let edge = match self.passes.front() {
            Some(pass) if pass.lasts_at(now) => pass.los_at,
            Some(pass) => Some(pass.aos_at),
            None => None,
        };
        let better =
            self.sets.iter().map(|set| crate::sky::utc(set.elements.epoch)).filter(|at| *at > now).min();
        [edge, better].into_iter().flatten().fold(renew, Ord::min).min(now.plus(AGE_LOOK_US))
    }
}

impl Satellite {
    /// The pass that lasts, as far as the elements can be believed.
    pub(super) fn believed_pass(&self, at: UtcUs) -> Option<&PassAhead> {
        self.contact.in_view()?;
        self.sky.pass(at)
    }

    /// When the next pass begins, as far as the elements can be believed.
    pub(super) fn believed_aos(&self, at: UtcUs) -> Option<UtcUs> {
        self.contact.in_view()?;
        self.sky.next_aos(at)
    }

    /// What may be expected of it now.
    pub(super) fn expectation(&self, now: Now) -> String {
        let due = self.overdue_us(now);
        match (self.believed_pass(now.utc), self.contact.is_open(now.mono)) {
            (Some(_), _) if due.is_some() => {
                format!("beacon overdue {} s", due.unwrap_or_default() / 1_000_000)
            }
            (Some(pass), true) => match pass.los_at {
                Some(los) => format!("in contact until {}", clock_time(los, now.utc)),
                None => "in contact".to_owned(),
            },
            (Some(_), false) => "in view, beacon expected".to_owned(),
            (None, true) => "in contact".to_owned(),
            (None, false) => match self.believed_aos(now.utc) {
                Some(aos) => format!("no contact expected until {}", clock_time(aos, now.utc)),
                None if self.sky.used.is_some() && self.contact.in_view() == Some(false) => {
                    "no contact expected in the next two days".to_owned()
                }
                None => "nobody knows when it comes: add elements".to_owned(),
            },
        }
    }

    /// For how long a heartbeat has been due, when it is overdue in view.
    fn overdue_us(&self, now: Now) -> Option<i64> {
        let silent_since = self.silent_since(now)?;
        let period = i64::try_from(self.contact.period_us()).unwrap_or(i64::MAX);
        let silent = now.utc.0.saturating_sub(silent_since.0);
        (silent > period.saturating_mul(OVERDUE_PERIODS)).then(|| silent.saturating_sub(period))
    }

    /// Since when heartbeats should have been heard and were not; `None` when none is expected: not in view, or a pass so
    /// low that hearing nothing is no surprise.
    fn silent_since(&self, now: Now) -> Option<UtcUs> {
        let pass = self.believed_pass(now.utc).filter(|pass| pass.max_elevation_deg >= HEARD_FROM_DEG)?;
        // A third of the way up a usual pass has climbed above the trees.
        let up = pass.aos_at.plus(pass.tca_at.0.saturating_sub(pass.aos_at.0) / 3);
        Some(self.contact.heartbeat_at().map_or(up, |at| at.max(up)))
    }
}

impl Station {
    /// Takes new elements: they are in force at once, for the pass that lasts as well.
    pub(super) fn add_elements(
        &mut self,
        now: Now,
        who: &Principal,
        satellite: &SatelliteId,
        elements: Vec<tle::Elements>,
        source: &str,
    ) -> Result<Accepted, Refusal> {
        let s = self
            .satellite_index(satellite)
            .ok_or_else(|| Refusal::UnknownSatellite(satellite.to_string()))?;
        if elements.is_empty() || elements.len() > SETS_AT_ONCE {
            let found = elements.len();
            return Err(Refusal::Argument(format!("{found} element sets: give 1 to {SETS_AT_ONCE} at once")));
        }
        for set in &elements {
            tle::Propagator::new(set)
                .map_err(|fault| Refusal::Argument(format!("elements of {}: {fault}", set.label())))?;
        }
        let mut added = 0_usize;
        for set in elements {
            if self.satellites[s].sky.sets.iter().any(|held| *held.elements == set) {
                continue;
            }
            self.ids.elements += 1;
            let record = ElementsRecord {
                id: ElementsId(self.ids.elements),
                satellite: satellite.clone(),
                station: self.station.clone(),
                source: source.chars().take(200).collect(),
                added_at: now.utc,
                who: who.clone(),
                elements: Arc::new(set),
            };
            let sky = &mut self.satellites[s].sky;
            sky.sets.push(ElementSet { id: record.id, elements: Arc::clone(&record.elements) });
            sky.known = None;
            self.journal.push(Record::Elements(record));
            added += 1;
        }
        if added > 0 {
            self.satellites[s].sky.trim();
            self.audit(now.utc, who, "elements.add", format!("{satellite}: {added} from {source}"));
            let sets = if added == 1 { "a set".to_owned() } else { format!("{added} sets") };
            let message = format!("{who} added {sets} of elements for {satellite} from {source}");
            self.sky_event(now.utc, s, EventKind::Elements, Level::Normal, message);
        }
        Ok(Accepted::Done)
    }

    /// Keeps passes ahead, tells AOS and LOS, and what the elements are worth.
    pub(super) fn sky_step(&mut self, now: Now, s: usize) {
        let Some(site) = &self.site else { return };
        let sky = &mut self.satellites[s].sky;
        let Some(best) = best_set(&sky.sets, now.utc).cloned() else { return };
        let holds = sky.known.is_some_and(|(from, until)| {
            from <= now.utc && until.0.saturating_sub(now.utc.0) >= AHEAD_US / 2
        });
        if !holds || sky.used != Some(best.id) {
            let until = now.utc.plus(AHEAD_US);
            sky.used = Some(best.id);
            sky.known = Some((now.utc, until));
            sky.passes.clear();
            sky.revision += 1;
            sky.propagator = tle::Propagator::new(&best.elements).ok();
            let before = sky.fault.take();
            match passes_of(&best, site, now.utc, until) {
                Ok(passes) => sky.passes = passes.into(),
                Err(fault) => sky.fault = Some(fault.to_string()),
            }
            if let Some(fault) = sky.fault.clone().filter(|fault| before.as_ref() != Some(fault)) {
                let id = self.satellites[s].id.clone();
                let message = format!("the elements of {id} tell no passes: {fault}. Add newer ones");
                self.sky_event(now.utc, s, EventKind::Elements, Level::Warning, message);
            }
        }
        let sky = &mut self.satellites[s].sky;
        while sky.passes.front().is_some_and(|pass| pass.is_over_at(now.utc)) {
            sky.passes.pop_front();
            sky.revision += 1;
        }
        let age = ElementsAge::at(&best.elements, now.utc);
        self.note_age(now, s, best.id, age);
        self.note_view(now, s, age);
        self.note_pass(now, s);
        self.note_overdue(now, s);
        let sat = &mut self.satellites[s];
        let at = mono_of(now, sat.sky.next_change(now.utc));
        sat.wake_at(at);
    }

    fn note_view(&mut self, now: Now, s: usize, age: ElementsAge) {
        let sat = &mut self.satellites[s];
        if age.is_useful() && sat.sky.fault.is_none() {
            let in_view = sat.sky.pass(now.utc).map(|pass| pass.los_at);
            sat.contact.set_view(in_view);
        } else {
            if sat.contact.in_view().is_some() {
                // What was planned by them is planned no more.
                sat.sky.revision += 1;
            }
            sat.contact.forget_view();
        }
    }

    fn note_age(&mut self, now: Now, s: usize, used: ElementsId, age: ElementsAge) {
        let sky = &mut self.satellites[s].sky;
        let is_fresh = sky
            .aged
            .is_some_and(|(id, at)| id == used && (0..AGE_LOOK_US).contains(&now.utc.0.saturating_sub(at.0)));
        if is_fresh {
            return;
        }
        sky.aged = Some((used, now.utc));
        let before = std::mem::replace(&mut sky.level, age.level);
        if age.level <= before {
            return;
        }
        let id = self.satellites[s].id.clone();
        let mut message = format!(
            "the elements of {id} are {:.0} days old: expect AOS and LOS to be wrong by {:.0} s. Add newer ones",
            age.age_days, age.timing_error_s
        );
        if !age.is_useful() {
            message.push_str("; until then nothing but hearing it tells whether it is in view");
        }
        self.sky_event(now.utc, s, EventKind::Elements, age.level, message);
    }

    /// Stores the pass that lasts, and says when one begins and ends.
    fn note_pass(&mut self, now: Now, s: usize) {
        let sat = &self.satellites[s];
        let current = sat.believed_pass(now.utc).copied();
        let open = sat.sky.open.clone();
        match (open, current) {
            (Some(open), Some(pass)) if pass.is_same_as(open.aos_at, open.los_at) => {
                self.renew_pass(now, s, open, &pass);
            }
            (Some(open), current) => {
                self.end_pass(now, s, open);
                if let Some(pass) = current {
                    self.begin_pass(now, s, &pass);
                }
            }
            (None, Some(pass)) => self.begin_pass(now, s, &pass),
            (None, None) => {}
        }
    }

    fn begin_pass(&mut self, now: Now, s: usize, pass: &PassAhead) {
        self.ids.pass += 1;
        let id = self.satellites[s].id.clone();
        let record = PassRecord {
            id: PassId(self.ids.pass),
            satellite: id.clone(),
            station: self.station.clone(),
            aos_at: pass.aos_at,
            tca_at: pass.tca_at,
            los_at: pass.los_at,
            max_elevation_deg: pass.max_elevation_deg,
            elements: vec![(pass.elements, now.utc)],
            ended_at: None,
        };
        let until = pass.los_at.map(|los| format!(" until {}", clock_time(los, now.utc))).unwrap_or_default();
        let message = format!("{id} is above the horizon{until}, up to {:.0}°", pass.max_elevation_deg);
        self.journal.push(Record::Pass(record.clone()));
        let sky = &mut self.satellites[s].sky;
        sky.open = Some(record);
        sky.overdue_told = false;
        self.sky_event(now.utc, s, EventKind::Pass, Level::Normal, message);
    }

    /// Other elements tell the pass that lasts.
    fn renew_pass(&mut self, now: Now, s: usize, mut open: PassRecord, pass: &PassAhead) {
        if open.elements.last().is_some_and(|(id, _)| *id == pass.elements) {
            return;
        }
        if open.elements.len() >= PASS_ELEMENTS_MAX {
            open.elements.remove(1);
        }
        open.elements.push((pass.elements, now.utc));
        (open.aos_at, open.tca_at, open.los_at) = (pass.aos_at, pass.tca_at, pass.los_at);
        open.max_elevation_deg = pass.max_elevation_deg;
        let id = self.satellites[s].id.clone();
        let until = pass.los_at.map(|los| format!(": it lasts until {}", clock_time(los, now.utc)));
        let message = format!("new elements tell the pass of {id}{}", until.unwrap_or_default());
        self.journal.push(Record::Pass(open.clone()));
        self.satellites[s].sky.open = Some(open);
        self.sky_event(now.utc, s, EventKind::Pass, Level::Normal, message);
    }

    fn end_pass(&mut self, now: Now, s: usize, mut open: PassRecord) {
        open.ended_at = Some(now.utc);
        self.journal.push(Record::Pass(open));
        let sat = &mut self.satellites[s];
        sat.sky.open = None;
        let id = sat.id.clone();
        let next = sat.believed_aos(now.utc);
        let next = next.map(|aos| format!("; no contact expected until {}", clock_time(aos, now.utc)));
        let message = format!("{id} is below the horizon{}", next.unwrap_or_default());
        self.sky_event(now.utc, s, EventKind::Pass, Level::Normal, message);
    }

    /// In view, and not heard for too long: says so once a pass.
    fn note_overdue(&mut self, now: Now, s: usize) {
        let sat = &mut self.satellites[s];
        if sat.sky.overdue_told {
            return;
        }
        if let Some(overdue_us) = sat.overdue_us(now) {
            sat.sky.overdue_told = true;
            let id = sat.id.clone();
            let message =
                format!("the beacon of {id} is overdue by {} s, and it is in view", overdue_us / 1_000_000);
            self.sky_event(now.utc, s, EventKind::Pass, Level::Watch, message);
        } else if let Some(since) = sat.silent_since(now) {
            let period = i64::try_from(sat.contact.period_us()).unwrap_or(i64::MAX);
            let at = mono_of(now, since.plus(period.saturating_mul(OVERDUE_PERIODS).saturating_add(1_000)));
            sat.wake_at(at);
        }
    }

    fn sky_event(&mut self, at: UtcUs, s: usize, kind: EventKind, level: Level, message: String) {
        let satellite = self.satellites[s].id.clone();
        let station = self.station.clone();
        let link = self.links.iter().find(|link| link.satellite == s).map(|link| link.config.id.clone());
        let route = link.map(|link| Route { satellite, station, link });
        self.event(at, kind, level, About { route, ..About::default() }, message);
    }
}
