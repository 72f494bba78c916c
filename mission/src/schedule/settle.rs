//! From the choice back to the passes as they are now: contacts, reasons, and what to remember.

use std::collections::BTreeMap;

use super::answer::{Contact, Cut, Reason, Refused, Remembered, Rival, Role, Schedule, Worth};
use super::lay::{Layout, ceil_s, floor_s};
use super::problem::{Problem, Window};
use super::{PassKey, Taken};
use crate::clock::UtcUs;

const fn utc(seconds: i64) -> UtcUs {
    UtcUs(seconds.saturating_mul(1_000_000))
}

struct Settling<'a> {
    problem: &'a Problem,
    layout: &'a Layout,
    memory: &'a BTreeMap<&'a PassKey, &'a Remembered>,
    taken: Vec<Taken>,
    /// What was taken, by antenna, in order of begin.
    by_antenna: Vec<Vec<usize>>,
    /// Which candidate leads a passage.
    lead_of: BTreeMap<usize, usize>,
    contacts: Vec<Contact>,
}

/// Writes the choice down. `taken` names those who may lead before those who listen along.
pub(super) fn settle(
    problem: &Problem,
    layout: &Layout,
    memory: &BTreeMap<&PassKey, &Remembered>,
    mut taken: Vec<Taken>,
    questions: &BTreeMap<usize, u64>,
    bound: i64,
) -> Schedule {
    let mut lead_of: BTreeMap<usize, usize> = BTreeMap::new();
    for (index, t) in taken.iter_mut().enumerate() {
        if let Some(job) = layout.laid[t.candidate].job {
            let lead = *lead_of.entry(job).or_insert(index);
            t.lead = (lead != index).then_some(lead);
        }
    }
    let mut by_antenna = vec![Vec::new(); problem.antennas.len()];
    for (index, t) in taken.iter().enumerate() {
        by_antenna[t.antenna].push(index);
    }
    for there in &mut by_antenna {
        there.sort_by_key(|&t: &usize| taken[t].start_s);
    }
    let mut settling = Settling { problem, layout, memory, taken, by_antenna, lead_of, contacts: Vec::new() };
    settling.contacts = (0..settling.taken.len()).map(|t| settling.contact(t)).collect();
    settling.refuse(questions, bound)
}

impl Settling<'_> {
    /// The times of what was taken, on the pass as it is now: an end that was the pass's end follows it, others stay.
    fn times_s(&self, taken: &Taken) -> (i64, i64) {
        let (laid, candidate) =
            (&self.layout.laid[taken.candidate], &self.problem.candidates[taken.candidate]);
        let (aos_s, los_s) = (ceil_s(candidate.aos.0), floor_s(candidate.los.0));
        let start_s = if taken.start_s == laid.aos_s { aos_s } else { taken.start_s.max(aos_s) };
        let stop_s = if taken.stop_s == laid.los_s { los_s } else { taken.stop_s.min(los_s) };
        (start_s, stop_s)
    }

    fn worth(&self, taken: &Taken) -> Worth {
        Worth(self.layout.laid[taken.candidate].rate * (taken.stop_s - taken.start_s))
    }

    fn is_kept(&self, taken: &Taken) -> bool {
        let key = &self.problem.candidates[taken.candidate].key;
        let chosen = self.memory.get(key).and_then(|then| then.chosen.as_ref());
        chosen.is_some_and(|(antenna, ..)| *antenna == self.problem.antennas[taken.antenna].id)
    }

    fn contact(&self, index: usize) -> Contact {
        let taken = &self.taken[index];
        let (laid, candidate) =
            (&self.layout.laid[taken.candidate], &self.problem.candidates[taken.candidate]);
        let (start_s, stop_s) = self.times_s(taken);
        let there = &self.by_antenna[taken.antenna];
        let place = there.partition_point(|&t| self.taken[t].start_s < taken.start_s);
        let key_of = |t: usize| self.problem.candidates[self.taken[t].candidate].key.clone();
        let before = place.checked_sub(1).map(|p| there[p]);
        let after = there.get(place + 1).copied();
        let closed = |hits: &dyn Fn(i64, i64) -> bool| {
            let (_, closed) = laid.closed.iter().find(|(antenna, _)| *antenna == taken.antenna)?;
            closed.iter().find(|c| hits(c.from_s, c.until_s)).map(|c| Cut::Closed(c.why.clone()))
        };
        let (late, early) = (start_s > ceil_s(candidate.aos.0), stop_s < floor_s(candidate.los.0));
        let cut_start = late.then(|| {
            closed(&|_, until_s| until_s == taken.start_s).or_else(|| before.map(|t| Cut::Contact(key_of(t))))
        });
        let cut_stop = early.then(|| {
            closed(&|from_s, _| from_s == taken.stop_s).or_else(|| after.map(|t| Cut::Contact(key_of(t))))
        });
        Contact {
            key: candidate.key.clone(),
            satellite: candidate.satellite.clone(),
            station: candidate.station.clone(),
            antenna: self.problem.antennas[taken.antenna].id.clone(),
            start: utc(start_s),
            stop: utc(stop_s),
            whole: !late && !early,
            worth: if taken.lead.is_none() { self.worth(taken) } else { Worth::default() },
            role: taken.lead.map_or(Role::Lead, |lead| Role::Ear(key_of(lead))),
            transmit: None,
            kept: self.is_kept(taken),
            cut_start: cut_start.flatten(),
            cut_stop: cut_stop.flatten(),
            over: Vec::new(),
            plan: candidate.plan.clone(),
        }
    }

    fn rival(&self, index: usize) -> Rival {
        let taken = &self.taken[index];
        let (start_s, stop_s) = self.times_s(taken);
        Rival {
            key: self.problem.candidates[taken.candidate].key.clone(),
            antenna: self.problem.antennas[taken.antenna].id.clone(),
            start: utc(start_s),
            stop: utc(stop_s),
            worth: if taken.lead.is_none() { self.worth(taken) } else { Worth::default() },
            kept: self.is_kept(taken),
        }
    }

    /// Who keeps a candidate from the antenna that would have been the cheapest.
    fn rivals(&self, candidate: usize) -> Vec<usize> {
        let choices = &self.layout.choices;
        let first = choices.partition_point(|c| c.candidate < candidate);
        let mut cheapest: Option<(i64, Vec<usize>)> = None;
        for c in choices[first..].iter().take_while(|c| c.candidate == candidate) {
            let (there, gap_s) = (&self.by_antenna[c.antenna], self.layout.gap_s[c.antenna]);
            let from = there.partition_point(|&t| self.taken[t].stop_s + gap_s <= c.from_s);
            let in_way: Vec<usize> = there[from..]
                .iter()
                .copied()
                .take_while(|&t| self.taken[t].start_s < c.until_s + gap_s)
                .filter(|&t| self.taken[t].lead.is_none())
                .collect();
            let cost = in_way.iter().map(|&t| self.worth(&self.taken[t]).0).sum();
            if !in_way.is_empty() && cheapest.as_ref().is_none_or(|(least, _)| cost < *least) {
                cheapest = Some((cost, in_way));
            }
        }
        cheapest.map(|(_, in_way)| in_way).unwrap_or_default()
    }

    fn refuse(mut self, questions: &BTreeMap<usize, u64>, bound: i64) -> Schedule {
        let mut out = Schedule::default();
        let chosen: BTreeMap<usize, usize> =
            self.taken.iter().enumerate().map(|(index, t)| (t.candidate, index)).collect();
        let mut over: Vec<(usize, usize)> = Vec::new();
        for (index, candidate) in self.problem.candidates.iter().enumerate() {
            let laid = &self.layout.laid[index];
            if !matches!(laid.refused, Some(Reason::Invalid(_))) {
                let taken = chosen.get(&index).map(|&t| &self.taken[t]);
                out.memory.push(Remembered {
                    key: candidate.key.clone(),
                    aos_s: laid.aos_s,
                    los_s: laid.los_s,
                    question: questions.get(&index).copied().unwrap_or(0),
                    chosen: taken.map(|t| (self.problem.antennas[t.antenna].id.clone(), t.start_s, t.stop_s)),
                    ear: taken.is_some_and(|t| t.lead.is_some()),
                });
            }
            if chosen.contains_key(&index) {
                continue;
            }
            let lead = laid.job.and_then(|job| self.lead_of.get(&job));
            let reason = match (&laid.refused, lead) {
                (Some(reason), _) => reason.clone(),
                (None, Some(&lead)) => Reason::HeardElsewhere(self.rival(lead)),
                (None, None) => {
                    let in_way = self.rivals(index);
                    over.extend(in_way.iter().map(|&t| (t, index)));
                    Reason::Loses { to: in_way.iter().map(|&t| self.rival(t)).collect() }
                }
            };
            out.refused.push(Refused {
                key: candidate.key.clone(),
                satellite: candidate.satellite.clone(),
                station: candidate.station.clone(),
                aos: candidate.aos,
                los: candidate.los,
                worth: Worth(i64::from(candidate.value) * Worth::SCALE),
                reason,
                plan: candidate.plan.clone(),
            });
        }
        for (winner, loser) in over {
            self.contacts[winner].over.push(self.problem.candidates[loser].key.clone());
        }
        self.permit();
        out.worth = Worth(self.contacts.iter().map(|c| c.worth.0).sum());
        out.bound = Worth(bound.max(out.worth.0));
        out.contacts = self.contacts;
        out.contacts.sort_by(|a, b| (a.start, &a.key).cmp(&(b.start, &b.key)));
        out.refused.sort_by(|a, b| (a.aos, &a.key).cmp(&(b.aos, &b.key)));
        out
    }

    /// Gives leave to transmit: to leads that want it, one at a time for each satellite, the earlier one first.
    fn permit(&mut self) {
        let mut order: Vec<usize> = (0..self.contacts.len())
            .filter(|&c| {
                let candidate = &self.problem.candidates[self.taken[c].candidate];
                candidate.transmit && self.contacts[c].role == Role::Lead
            })
            .collect();
        order.sort_by_key(|&c| (self.contacts[c].start, c));
        let mut until: BTreeMap<crate::SatelliteId, UtcUs> = BTreeMap::new();
        for c in order {
            let contact = &mut self.contacts[c];
            let busy = until.entry(contact.satellite.clone()).or_insert(contact.start);
            let window = Window { start: contact.start.max(*busy), stop: contact.stop };
            contact.transmit = (window.start < window.stop).then_some(window);
            *busy = (*busy).max(contact.stop);
        }
    }
}
