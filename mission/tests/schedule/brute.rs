//! Every set, every order, every second: the best worth by exhaustion, for small questions.

use mission::UtcUs;
use mission::schedule::{Antenna, Candidate, Partial, Problem, Scope};

use crate::cases::at;

/// Ticks that are looked at.
const END: usize = 80;

fn second(at_us: UtcUs) -> i64 {
    assert_eq!(at_us.0 % 1_000_000, 0, "the small cases lie on whole seconds");
    (at_us.0 - at(0).0) / 1_000_000
}

/// Whether the antenna may serve this candidate in this second.
fn is_open(problem: &Problem, antenna: &Antenna, candidate: &Candidate, tick: i64) -> bool {
    let drift_s = i64::from(problem.policy.drift_s);
    let shut = problem.blackouts.iter().any(|b| {
        let covers = match &b.scope {
            Scope::Station(s) => *s == candidate.station,
            Scope::Antenna(a) => *a == antenna.id,
            Scope::Satellite(s) => *s == candidate.satellite,
        };
        covers && (second(b.window.start) - drift_s..second(b.window.stop) + drift_s).contains(&tick)
    });
    let licence = problem
        .sites
        .iter()
        .find(|s| s.station == candidate.station)
        .and_then(|s| s.licence.as_ref())
        .filter(|_| candidate.transmit);
    let legal = licence.is_none_or(|windows| {
        windows.iter().any(|w| (second(w.start) + drift_s..second(w.stop) - drift_s).contains(&tick))
    });
    legal && !shut
}

fn serves(antenna: &Antenna, candidate: &Candidate) -> bool {
    antenna.station == candidate.station
        && (candidate.antennas.is_empty() || candidate.antennas.contains(&antenna.id))
}

/// Which ends a contact may have that begins at `tick`.
fn ends(problem: &Problem, antenna: &Antenna, candidate: &Candidate, tick: i64) -> Vec<i64> {
    let (aos_s, los_s) = (second(candidate.aos), second(candidate.los));
    let (least_s, slack_s) = (i64::from(candidate.min_duration_s), 2 * i64::from(problem.policy.drift_s));
    let mut out = Vec::new();
    for stop_s in tick + 1..=los_s {
        if tick < aos_s || !is_open(problem, antenna, candidate, stop_s - 1) {
            break;
        }
        let whole = tick == aos_s && stop_s == los_s && los_s - aos_s >= least_s;
        let part = candidate.partial == Partial::Proportional && stop_s - tick >= least_s + slack_s;
        if whole || part {
            out.push(stop_s);
        }
    }
    out
}

/// Which passage each candidate belongs to: those of a satellite that overlap the first of them are one. A candidate too
/// short or shut out is in none.
fn passages(problem: &Problem) -> Vec<Option<usize>> {
    let usable = |c: &&Candidate| {
        problem
            .antennas
            .iter()
            .any(|a| serves(a, c) && (0..END as i64).any(|tick| !ends(problem, a, c, tick).is_empty()))
    };
    let mut of = vec![None; problem.candidates.len()];
    let mut passages = 0;
    loop {
        let open = problem.candidates.iter().enumerate().filter(|(i, c)| of[*i].is_none() && usable(c));
        let Some((_, first)) = open.min_by_key(|(_, c)| (c.aos, c.key.clone())) else { return of };
        let first = first.clone();
        for (i, c) in problem.candidates.iter().enumerate() {
            if of[i].is_none()
                && usable(&c)
                && c.satellite == first.satellite
                && c.aos >= first.aos
                && (c.aos < first.los)
            {
                of[i] = Some(passages);
            }
        }
        passages += 1;
    }
}

/// The most that any schedule is worth, in millionths of a point.
pub(crate) fn best(problem: &Problem) -> i64 {
    let of = passages(problem);
    let count = of.iter().flatten().max().map_or(0, |m| m + 1);
    let sets = 1usize << count;
    let mut together = vec![0i64; sets];
    for antenna in &problem.antennas {
        let gap_s = i64::from(antenna.switch_over_s) + 2 * i64::from(problem.policy.drift_s);
        // worth[tick][set]: the best with these passages served and the antenna free at this tick.
        let mut worth = vec![vec![i64::MIN; sets]; END + 1];
        worth[0][0] = 0;
        for tick in 0..END {
            let (now, next) = worth.split_at_mut(tick + 1);
            for (next, now) in next[0].iter_mut().zip(&now[tick]) {
                *next = (*next).max(*now);
            }
            for (i, c) in problem.candidates.iter().enumerate() {
                let Some(passage) = of[i] else { continue };
                if !serves(antenna, c) {
                    continue;
                }
                let length_s = second(c.los) - second(c.aos);
                let rate = (i64::from(c.value) * 1_000_000 + length_s / 2) / length_s;
                for stop_s in ends(problem, antenna, c, tick as i64) {
                    let free = usize::try_from(stop_s + gap_s).expect("after the begin").min(END);
                    for set in (0..sets).filter(|set| set & (1 << passage) == 0) {
                        if worth[tick][set] != i64::MIN {
                            let with = worth[tick][set] + rate * (stop_s - tick as i64);
                            let place = &mut worth[free][set | (1 << passage)];
                            *place = (*place).max(with);
                        }
                    }
                }
            }
        }
        let alone = &worth[END];
        let mut joined = vec![0i64; sets];
        for (set, place) in joined.iter_mut().enumerate() {
            let mut part = set;
            loop {
                if alone[part] != i64::MIN {
                    *place = (*place).max(alone[part] + together[set & !part]);
                }
                if part == 0 {
                    break;
                }
                part = (part - 1) & set;
            }
        }
        together = joined;
    }
    together[sets - 1]
}
