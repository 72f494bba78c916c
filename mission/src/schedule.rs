//! Which pass is taken by which antenna: the most valuable schedule, explained, and calm.
//!
//! [`plan`] is a pure function of the passes, the antennas, what stands in the way ([`Problem`]) and what was promised
//! before ([`Remembered`]). It answers with [`Contact`]s, a [`Reason`] for everything refused, what the whole is worth, and
//! a bound that no schedule exceeds.
//!
//! # Rules
//! - A contact is one piece of one pass on one antenna, in whole seconds, at most from AOS to LOS. A part of a pass is
//!   worth as much of the value as of the time is kept, or nothing ([`Partial`]).
//! - Between two contacts of an antenna lies its switch-over time. Blackouts, unfit stations and, for contacts that
//!   transmit, the time outside the licence are not used.
//! - *A passage counts once.* Passes of a satellite over several stations that overlap the first of them are one
//!   passage; one station takes it and may transmit. So two stations spread over two satellites rather than both
//!   follow the better one. Afterwards idle antennas listen along ([`Role::Ear`]): several ears help reception,
//!   count nothing and never transmit.
//!
//! # How good
//! The question falls into clusters of passes that can stand in each other's way; each is answered by itself. A
//! Lagrangian bound often proves the first answer; otherwise a forward search over states, whose cut points
//! are argued where they are made (`search.rs`), finds the best. The search is exact until it would have to
//! keep more states than [`Policy::max_states`] allows; what it gives up then raises [`Schedule::bound`], and
//! [`Schedule::gap`] says by how much.
//!
//! # Calm
//! Elements change several times a day and move every AOS a little. Three rules keep that from moving contacts:
//! - the choice is made on remembered times until a pass has moved by more than [`Policy::drift_s`];
//! - every choice has that much in hand (twice in each switch-over and each cut piece's minimum, once at each
//!   blackout), so it still fits when all passes have moved; contacts that end with their pass follow it;
//! - where something larger has changed, a promised contact gives way only to what is better by
//!   [`Policy::keep_permille`] of its worth, and ties go to what was promised.

mod answer;
mod cluster;
mod key;
mod lay;
mod problem;
mod relax;
mod search;
mod settle;
mod task;

use std::collections::{BTreeMap, BTreeSet};

pub use answer::{Contact, Cut, Reason, Refused, Remembered, Rival, Role, Schedule, Worth};
pub use key::{Foretold, PassKey, identify};
pub use problem::{
    Antenna, Blackout, Candidate, Health, Partial, Policy, Problem, Scope, Site, Window, points,
};

use lay::{Closed, Layout, gaps, lay};
use task::{Choice, Piece, Task};

/// The schedule for `problem`, after one of which `memory` was kept ([`Schedule::memory`]; empty for a fresh start).
///
/// The same question gets the same answer. The time it takes is bounded by the policy, not by a clock.
pub fn plan(problem: &Problem, memory: &[Remembered]) -> Schedule {
    let memory: BTreeMap<&PassKey, &Remembered> = memory.iter().map(|r| (&r.key, r)).collect();
    let layout = lay(problem, &memory);
    let leads = choose(problem, &layout, &layout.choices, &memory, Round::Leads);
    let mut taken = leads.taken;
    // What a search that was cut off left lying, then those who only listen.
    for round in [Round::Rest, Round::Ears] {
        let left = left_over(problem, &layout, &taken, round);
        taken.extend(choose(problem, &layout, &left, &memory, round).taken);
    }
    settle::settle(problem, &layout, &memory, taken, &leads.questions, leads.bound)
}

/// What is being chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Round {
    /// The contacts that count.
    Leads,
    /// More of them, in the time that was left.
    Rest,
    /// Contacts that listen along.
    Ears,
}

/// A choice that was taken, for good.
#[derive(Debug, Clone)]
struct Taken {
    candidate: usize,
    antenna: usize,
    start_s: i64,
    stop_s: i64,
    /// The candidate that leads the passage, when this one only listens along.
    lead: Option<usize>,
}

#[derive(Debug, Clone, Default)]
struct Chosen {
    taken: Vec<Taken>,
    /// Which question each candidate was part of.
    questions: BTreeMap<usize, u64>,
    bound: i64,
}

/// Answers cluster by cluster.
fn choose(
    problem: &Problem,
    layout: &Layout,
    choices: &[Choice],
    memory: &BTreeMap<&PassKey, &Remembered>,
    round: Round,
) -> Chosen {
    let mut out = Chosen::default();
    let then = |c: &Choice| memory.get(&problem.candidates[c.candidate].key).copied();
    let promised = |c: &Choice| {
        let then = then(c).filter(|then| then.ear == (round == Round::Ears))?;
        let (antenna, start_s, stop_s) = then.chosen.as_ref()?;
        (*antenna == problem.antennas[c.antenna].id).then_some((*start_s, *stop_s))
    };
    for members in cluster::clusters(choices, &layout.gap_s) {
        let place = |index: usize| &choices[members[index]];
        let all = 0..members.len();
        let mut task = cluster::part(choices, &layout.gap_s, &members);
        let question = question(problem, &task, &members, choices);
        let share = problem.policy.max_states.saturating_mul(members.len()) / choices.len().max(1);
        let mut states = share.max(1_000).min(problem.policy.max_states);
        let is_old = round == Round::Leads
            && all.clone().all(|i| then(place(i)).is_some_and(|then| then.question == question));
        let before = if is_old {
            let piece = |choice: usize| {
                let (start_s, stop_s) = promised(place(choice))?;
                let fits = place(choice).from_s <= start_s && stop_s <= place(choice).until_s;
                fits.then_some(Piece { choice, start_s, stop_s })
            };
            all.clone().filter_map(piece).collect()
        } else {
            let kept: Vec<usize> = all.clone().filter(|&i| promised(place(i)).is_some()).collect();
            as_promised(&task, &kept, &mut states)
        };
        let fresh = cluster::solve(&task, before.clone(), &mut states);
        let place_of = |p: &Piece| (place(p.choice).candidate, place(p.choice).antenna);
        let keeps = before.iter().all(|p| fresh.pieces.iter().any(|q| place_of(p) == place_of(q)));
        let pieces = if is_old {
            before
        } else if keeps {
            fresh.pieces
        } else {
            for i in all.clone().filter(|&i| promised(place(i)).is_some()) {
                let value = place(i).rate
                    * (layout.laid[place(i).candidate].los_s - layout.laid[place(i).candidate].aos_s);
                task.choices[i].promise =
                    value / 1000 * i64::from(problem.policy.keep_permille.min(1_000_000));
            }
            cluster::solve(&task, before, &mut states).pieces
        };
        out.bound += fresh.bound.max(task.worth(&pieces));
        out.questions.extend(all.map(|i| (place(i).candidate, question)));
        out.taken.extend(pieces.iter().map(|p| {
            let (candidate, antenna) = place_of(p);
            Taken { candidate, antenna, start_s: p.start_s, stop_s: p.stop_s, lead: None }
        }));
    }
    out
}

/// The best that can still be made of the promised contacts alone.
fn as_promised(task: &Task, promised: &[usize], states: &mut usize) -> Vec<Piece> {
    if promised.is_empty() {
        return Vec::new();
    }
    let kept = task.restricted(promised);
    let pieces = cluster::solve(&kept, Vec::new(), states).pieces;
    pieces.into_iter().map(|p| Piece { choice: promised[p.choice], ..p }).collect()
}

/// What idle antennas could still do: the choices that were not taken, in the time that was not.
fn left_over(problem: &Problem, layout: &Layout, taken: &[Taken], round: Round) -> Vec<Choice> {
    let led: BTreeSet<usize> = taken.iter().filter_map(|t| layout.laid[t.candidate].job).collect();
    let served: BTreeSet<usize> = taken.iter().map(|t| t.candidate).collect();
    let mut busy: Vec<Vec<Closed>> = vec![Vec::new(); layout.gap_s.len()];
    for t in taken {
        let gap_s = layout.gap_s[t.antenna];
        busy[t.antenna].push(Closed {
            from_s: t.start_s - gap_s,
            until_s: t.stop_s + gap_s,
            why: String::new(),
        });
    }
    for closed in &mut busy {
        closed.sort_by_key(|c| c.from_s);
    }
    let mut out = Vec::new();
    let wanted =
        |c: &&Choice| !served.contains(&c.candidate) && led.contains(&c.job) == (round == Round::Ears);
    for c in layout.choices.iter().filter(wanted) {
        let closed = &busy[c.antenna];
        let first = closed.partition_point(|b| b.until_s <= c.from_s);
        for (from_s, until_s) in gaps(c.from_s, c.until_s, &closed[first..]) {
            let needed_s =
                i64::from(problem.candidates[c.candidate].min_duration_s.max(1)) + 2 * layout.drift_s;
            let whole = (from_s, until_s) == (c.from_s, c.until_s);
            if whole || (!c.is_rigid() && until_s - from_s >= needed_s) {
                let min_s = if whole { c.min_s } else { needed_s };
                // A passage may have many ears.
                let job = if round == Round::Ears { c.candidate } else { c.job };
                out.push(Choice { job, from_s, until_s, min_s, ..c.clone() });
            }
        }
    }
    out
}

/// A checksum over everything that the answer to a task depends on (FNV-1a).
fn question(problem: &Problem, task: &Task, members: &[usize], choices: &[Choice]) -> u64 {
    let mut sum = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat = |bytes: &[u8]| {
        for byte in bytes.iter().chain(&[0xff]) {
            sum = (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for (c, &place) in task.choices.iter().zip(members) {
        eat(problem.candidates[c.candidate].key.to_string().as_bytes());
        eat(problem.antennas[choices[place].antenna].id.as_str().as_bytes());
        for number in [c.from_s, c.until_s, c.min_s, c.rate, task.gap_s[c.antenna], c.job as i64] {
            eat(&number.to_le_bytes());
        }
    }
    sum
}
