//! From passes to choices: whole seconds, blackouts cut out, slack in hand, passes of one passage together.

use std::collections::{BTreeMap, BTreeSet};

use super::answer::{Reason, Remembered};
use super::problem::{Blackout, Candidate, Health, Partial, Problem, Scope, Window};
use super::task::Choice;
use super::{PassKey, Worth};

/// A day: no drift is longer.
const DAY_S: u32 = 86_400;

/// A closed time and why.
#[derive(Debug, Clone)]
pub(super) struct Closed {
    pub(super) from_s: i64,
    pub(super) until_s: i64,
    pub(super) why: String,
}

/// A candidate on the times that the choice is made with.
#[derive(Debug, Clone)]
pub(super) struct Laid {
    pub(super) aos_s: i64,
    pub(super) los_s: i64,
    /// The passage it belongs to, when anything of it can be had.
    pub(super) job: Option<usize>,
    /// Why nothing of it can be had.
    pub(super) refused: Option<Reason>,
    /// What closes it, by antenna.
    pub(super) closed: Vec<(usize, Vec<Closed>)>,
    pub(super) rate: i64,
}

/// The whole question in seconds.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub(super) laid: Vec<Laid>,
    pub(super) choices: Vec<Choice>,
    /// By antenna, slack included.
    pub(super) gap_s: Vec<i64>,
    pub(super) drift_s: i64,
}

/// The first whole second at or after.
pub(super) const fn ceil_s(us: i64) -> i64 {
    us.div_euclid(1_000_000) + (us.rem_euclid(1_000_000) != 0) as i64
}

/// The last whole second at or before.
pub(super) const fn floor_s(us: i64) -> i64 {
    us.div_euclid(1_000_000)
}

/// Lays out the question, on the remembered times where they still do.
pub(super) fn lay(problem: &Problem, memory: &BTreeMap<&PassKey, &Remembered>) -> Layout {
    let drift_s = i64::from(problem.policy.drift_s.min(DAY_S));
    let gap_s = problem.antennas.iter().map(|a| i64::from(a.switch_over_s) + 2 * drift_s).collect::<Vec<_>>();
    let mut seen = BTreeSet::new();
    let sane = |c: &&Candidate| nonsense(c, ceil_s(c.aos.0), floor_s(c.los.0)).is_none();
    let first_s = problem.candidates.iter().filter(sane).map(|c| ceil_s(c.aos.0)).min().unwrap_or(0);
    let mut layout = Layout { laid: Vec::new(), choices: Vec::new(), gap_s, drift_s };
    for (index, candidate) in problem.candidates.iter().enumerate() {
        let (mut aos_s, mut los_s) = (ceil_s(candidate.aos.0), floor_s(candidate.los.0));
        if let Some(then) = memory.get(&candidate.key)
            && aos_s.saturating_sub(then.aos_s).saturating_abs() <= drift_s
            && los_s.saturating_sub(then.los_s).saturating_abs() <= drift_s
            && (los_s - aos_s).min(then.los_s - then.aos_s) >= i64::from(candidate.min_duration_s)
        {
            (aos_s, los_s) = (then.aos_s, then.los_s);
        }
        let mut laid = Laid {
            aos_s,
            los_s,
            job: None,
            refused: None,
            closed: Vec::new(),
            rate: rate(candidate, los_s - aos_s),
        };
        let repeated = !seen.insert(&candidate.key);
        laid.refused = match nonsense(candidate, aos_s, los_s).or(repeated.then_some(REPEATED)) {
            Some(what) => Some(Reason::Invalid(what)),
            None if aos_s - first_s > Candidate::MAX_HORIZON_S => Some(Reason::Invalid(FAR)),
            None => open(problem, candidate, index, &mut laid, &mut layout),
        };
        layout.laid.push(laid);
    }
    group(problem, &mut layout);
    layout.choices.retain(|c| layout.laid[c.candidate].refused.is_none());
    layout
}

const REPEATED: &str = "key is used by an earlier candidate; every pass needs its own";
const FAR: &str = "AOS is more than 31 days after the first one; plan it when it is nearer";

fn nonsense(candidate: &Candidate, aos_s: i64, los_s: i64) -> Option<&'static str> {
    if los_s <= aos_s {
        Some("LOS must be at least a second after AOS")
    } else if los_s - aos_s > Candidate::MAX_DURATION_S {
        Some("LOS is more than a day after AOS; cut it into contacts")
    } else if candidate.value == 0 {
        Some("value is 0; give it at least 1 point")
    } else if candidate.value > Candidate::MAX_VALUE {
        Some("value is above 1,000,000 points; scale the values down")
    } else {
        None
    }
}

/// Millionths of a point per second, rounded; the sum over the pass is the value within a thousandth.
fn rate(candidate: &Candidate, length_s: i64) -> i64 {
    let length_s = length_s.max(1);
    (i64::from(candidate.value) * Worth::SCALE + length_s / 2) / length_s
}

/// Adds the candidate's choices; or why there are none.
fn open(
    problem: &Problem,
    candidate: &Candidate,
    index: usize,
    laid: &mut Laid,
    layout: &mut Layout,
) -> Option<Reason> {
    let site = problem.sites.iter().find(|s| s.station == candidate.station);
    if let Some(Health::Unfit(why)) = site.map(|s| &s.health) {
        return Some(Reason::Unfit(why.clone()));
    }
    let (aos_s, los_s) = (laid.aos_s, laid.los_s);
    let length_s = los_s - aos_s;
    let needed_s = i64::from(candidate.min_duration_s.max(1));
    if length_s < needed_s {
        return Some(Reason::TooShort { left_s: small(length_s), needed_s: small(needed_s) });
    }
    let serves = |a: &super::Antenna| {
        a.station == candidate.station
            && (candidate.antennas.is_empty() || candidate.antennas.contains(&a.id))
    };
    let antennas: Vec<usize> =
        (0..problem.antennas.len()).filter(|&a| serves(&problem.antennas[a])).collect();
    if antennas.is_empty() {
        return Some(Reason::NoAntenna);
    }
    let licence = site.and_then(|s| s.licence.as_deref()).filter(|_| candidate.transmit);
    // What is cut short at a blackout must still be long enough when the other end moves.
    let spare_s = needed_s + 2 * layout.drift_s;
    let (mut longest_s, mut why, mut found) = (0, Vec::new(), false);
    for antenna in antennas {
        let covers = |b: &&Blackout| match &b.scope {
            Scope::Station(station) => *station == candidate.station,
            Scope::Antenna(id) => *id == problem.antennas[antenna].id,
            Scope::Satellite(satellite) => *satellite == candidate.satellite,
        };
        let mut closed: Vec<Closed> = problem
            .blackouts
            .iter()
            .filter(covers)
            .filter(|b| b.window.start < b.window.stop)
            .map(|b| Closed {
                from_s: floor_s(b.window.start.0) - layout.drift_s,
                until_s: ceil_s(b.window.stop.0) + layout.drift_s,
                why: b.reason.clone(),
            })
            .chain(licence.map(|l| unlicensed(l, layout.drift_s)).into_iter().flatten())
            .filter(|c| c.from_s < los_s && aos_s < c.until_s)
            .collect();
        closed.sort_by_key(|c| (c.from_s, c.until_s));
        for (from_s, until_s) in gaps(aos_s, los_s, &closed) {
            let left_s = until_s - from_s;
            longest_s = longest_s.max(left_s);
            let whole = left_s == length_s;
            let min_s = match candidate.partial {
                Partial::Worthless if whole => length_s,
                Partial::Proportional if whole => spare_s.min(length_s),
                Partial::Proportional if left_s >= spare_s => spare_s,
                _ => continue,
            };
            found = true;
            layout.choices.push(Choice {
                job: 0,
                candidate: index,
                antenna,
                from_s,
                until_s,
                min_s,
                rate: laid.rate,
                promise: 0,
            });
        }
        for c in &closed {
            if !why.contains(&c.why) {
                why.push(c.why.clone());
            }
        }
        laid.closed.push((antenna, closed));
    }
    let needed_s = if candidate.partial == Partial::Worthless { length_s } else { spare_s };
    (!found).then(|| Reason::Closed { by: why, left_s: small(longest_s), needed_s: small(needed_s) })
}

fn small(seconds: i64) -> u32 {
    u32::try_from(seconds).unwrap_or(u32::MAX)
}

/// The times outside the licence's windows.
fn unlicensed(windows: &[Window], drift_s: i64) -> Vec<Closed> {
    let mut windows: Vec<(i64, i64)> =
        windows.iter().map(|w| (ceil_s(w.start.0) + drift_s, floor_s(w.stop.0) - drift_s)).collect();
    windows.retain(|(from_s, until_s)| from_s < until_s);
    windows.sort_unstable();
    let closed = |from_s, until_s| Closed { from_s, until_s, why: "outside the licence's window".to_owned() };
    let mut out = Vec::new();
    let mut at_s = i64::MIN / 2;
    for (from_s, until_s) in windows {
        if at_s < from_s {
            out.push(closed(at_s, from_s));
        }
        at_s = at_s.max(until_s);
    }
    out.push(closed(at_s, i64::MAX / 2));
    out
}

/// What is left of `[from_s, until_s)`; `closed` by begin.
pub(super) fn gaps(from_s: i64, until_s: i64, closed: &[Closed]) -> Vec<(i64, i64)> {
    let mut out = Vec::new();
    let mut at_s = from_s;
    for c in closed {
        if c.from_s > at_s {
            out.push((at_s, c.from_s.min(until_s)));
        }
        at_s = at_s.max(c.until_s);
        if at_s >= until_s {
            return out;
        }
    }
    out.push((at_s, until_s));
    out
}

/// Passes of one satellite that overlap the first of them are one passage: it counts once.
fn group(problem: &Problem, layout: &mut Layout) {
    let mut order: Vec<usize> =
        (0..layout.laid.len()).filter(|&i| layout.laid[i].refused.is_none()).collect();
    order.sort_by_key(|&i| {
        let candidate = &problem.candidates[i];
        (&candidate.satellite, layout.laid[i].aos_s, &candidate.key)
    });
    let mut jobs = 0;
    let mut first: Option<usize> = None;
    for i in order {
        let same = first.is_some_and(|f| {
            problem.candidates[f].satellite == problem.candidates[i].satellite
                && layout.laid[i].aos_s < layout.laid[f].los_s
        });
        if !same {
            first = Some(i);
            jobs += 1;
        }
        layout.laid[i].job = Some(jobs - 1);
    }
    for c in &mut layout.choices {
        c.job = layout.laid[c.candidate].job.unwrap_or(0);
    }
}
