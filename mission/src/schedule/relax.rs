//! A bound from above: every antenna by itself, and a price for every job.
//!
//! Without the rule that a job is taken once and in one piece, each antenna is a dynamic programme over the seconds. The
//! rule comes back as a price per job (Lagrange): an antenna pays it for each piece, the bound gains it once. The prices
//! are found by subgradient steps. If the antennas' own answers keep the rule and no price is paid in vain, they are
//! the best answer.

use super::task::{Piece, Task};

/// The best an antenna can earn from each second on, at the given prices.
#[derive(Debug, Clone, Default)]
pub(super) struct Ahead {
    from_s: i64,
    earn: Vec<i64>,
    /// The piece that begins in this second, in the best continuation: choice and length, or [`NONE`].
    take: Vec<(u32, u32)>,
}

/// No piece begins here.
const NONE: (u32, u32) = (u32::MAX, 0);

fn small(number: impl TryInto<u32>) -> u32 {
    number.try_into().unwrap_or(u32::MAX)
}

/// A choice that can begin in the second that is looked at (going back in time).
struct Open {
    choice: usize,
    rate: i64,
    min_s: i64,
    /// Its promise less the price of its job.
    extra: i64,
    /// The earliest begin: the last one to be looked at.
    last_s: i64,
    /// The most that `rate * end` and what can be earned after it come to, over the ends within reach.
    reach: i64,
    /// The end that does.
    end_s: i64,
}

impl Ahead {
    /// What can still be earned by pieces that begin at or after `at_s`.
    pub(super) fn earn(&self, at_s: i64) -> i64 {
        let index = usize::try_from((at_s - self.from_s).max(0)).unwrap_or(usize::MAX);
        self.earn.get(index).copied().unwrap_or(0)
    }

    fn of(task: &Task, antenna: usize, prices: &[i64]) -> Self {
        let (from_s, until_s) = task.span_s();
        let length = usize::try_from(until_s - from_s).unwrap_or(0);
        let mut ahead = Self { from_s, earn: vec![0; length + 1], take: vec![NONE; length + 1] };
        let gap_s = task.gap_s[antenna];
        let mut by_latest: Vec<usize> =
            (0..task.choices.len()).filter(|&i| task.choices[i].antenna == antenna).collect();
        by_latest.sort_by_key(|&i| task.choices[i].latest_s());
        let mut open: Vec<Open> = Vec::new();
        for index in (0..length).rev() {
            let at_s = from_s + index as i64;
            while let Some(&choice) = by_latest.last().filter(|&&i| task.choices[i].latest_s() >= at_s) {
                by_latest.pop();
                let c = &task.choices[choice];
                let (extra, last_s) = (c.promise - prices[c.job], c.from_s);
                open.push(Open {
                    choice,
                    rate: c.rate,
                    min_s: c.min_s,
                    extra,
                    last_s,
                    reach: i64::MIN,
                    end_s: 0,
                });
            }
            let mut best = ahead.earn[index + 1];
            let mut take = NONE;
            let mut ends = false;
            for o in &mut open {
                let stop_s = at_s + o.min_s;
                // Counted from the begin: rate times a date would not fit into 64 bits.
                let with = o.rate * (stop_s - from_s) + ahead.earn(stop_s + gap_s);
                if with > o.reach {
                    (o.reach, o.end_s) = (with, stop_s);
                }
                let weight = o.reach - o.rate * (at_s - from_s) + o.extra;
                if weight > best {
                    best = weight;
                    take = (small(o.choice), small(o.end_s - at_s));
                }
                ends |= o.last_s == at_s;
            }
            ahead.earn[index] = best;
            ahead.take[index] = take;
            if ends {
                open.retain(|o| o.last_s < at_s);
            }
        }
        ahead
    }

    /// The pieces of the best continuation from the begin.
    fn trace(&self, gap_s: i64, pieces: &mut Vec<Piece>) {
        let mut index = 0;
        while let Some(take) = self.take.get(index) {
            if *take == NONE {
                index += 1;
                continue;
            }
            let start_s = self.from_s + index as i64;
            let stop_s = start_s + i64::from(take.1);
            pieces.push(Piece { choice: take.0 as usize, start_s, stop_s });
            index = usize::try_from(stop_s + gap_s - self.from_s).unwrap_or(usize::MAX);
        }
    }
}

/// The best bound that was found, and what it was made of.
#[derive(Debug, Clone)]
pub(super) struct Relaxed {
    pub(super) ahead: Vec<Ahead>,
    pub(super) prices: Vec<i64>,
    pub(super) bound: i64,
    /// An answer that keeps the rules.
    pub(super) pieces: Vec<Piece>,
}

/// How many steps the prices get.
const STEPS: usize = 40;

/// Looks for prices with a low bound.
pub(super) fn relax(task: &Task) -> Relaxed {
    let mut prices = vec![0i64; task.jobs];
    let mut best: Option<Relaxed> = None;
    let mut held: (i64, Vec<Piece>) = (i64::MIN, Vec::new());
    let mut pace = 1.0;
    let mut since_better = 0;
    for _ in 0..STEPS {
        let ahead: Vec<Ahead> = (0..task.gap_s.len()).map(|a| Ahead::of(task, a, &prices)).collect();
        let bound = ahead.iter().map(|a| a.earn.first().copied().unwrap_or(0)).sum::<i64>()
            + prices.iter().sum::<i64>();
        let mut pieces = Vec::new();
        for (antenna, gap_s) in ahead.iter().zip(&task.gap_s) {
            antenna.trace(*gap_s, &mut pieces);
        }
        let mut uses = vec![0i64; task.jobs];
        for piece in &pieces {
            uses[task.choices[piece.choice].job] += 1;
        }
        let kept = once_each(task, pieces);
        let weight = task.weight(&kept);
        if weight > held.0 {
            held = (weight, kept);
        }
        if best.as_ref().is_none_or(|b| bound < b.bound) {
            best = Some(Relaxed { ahead, prices: prices.clone(), bound, pieces: Vec::new() });
            since_better = 0;
        } else {
            since_better += 1;
        }
        if since_better == 4 {
            pace /= 2.0;
            since_better = 0;
        }
        if pace < 0.1 {
            break;
        }
        let lowest = best.as_ref().map_or(bound, |b| b.bound);
        let slope: Vec<i64> =
            uses.iter().zip(&prices).map(|(u, p)| if *u == 0 && *p == 0 { 0 } else { u - 1 }).collect();
        let steepness: i64 = slope.iter().map(|s| s * s).sum();
        if lowest <= held.0 || steepness == 0 {
            break;
        }
        // Towards a target a little above what is held: the true answer lies between.
        let step = pace * ((bound - held.0) as f64) / steepness as f64;
        for (price, slope) in prices.iter_mut().zip(&slope) {
            *price = (*price + (step * *slope as f64) as i64).max(0);
        }
    }
    let mut found = best.unwrap_or(Relaxed { ahead: Vec::new(), prices, bound: 0, pieces: Vec::new() });
    found.pieces = held.1;
    found
}

/// Of each job only its weightiest piece.
fn once_each(task: &Task, mut pieces: Vec<Piece>) -> Vec<Piece> {
    let weight = |p: &Piece| task.choices[p.choice].weight(p.start_s, p.stop_s);
    pieces.sort_by_key(|p| (std::cmp::Reverse(weight(p)), p.start_s, p.choice));
    let mut taken = vec![false; task.jobs];
    pieces.retain(|p| !std::mem::replace(&mut taken[task.choices[p.choice].job], true));
    pieces
}
