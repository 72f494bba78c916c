//! What no schedule can exceed: the same task with chunks sent in any order, not in ranges, and the battery full.
//!
//! With `w = -ln(1 - p)` for a frame that somebody hears with probability `p`, a chunk comes home with `1 - exp(-sum of w)` at
//! most: listening once for all frames of a pass, as it is, only makes repeats worth less. For every level `L` the
//! tangent of that curve at `L` bounds a chunk by `b(L) + sum of h(w)`, with
//! `b = 1 - e^-L (1 + L)` and `h(w) = e^-L w` up to the level, `1 - e^-w - b` above it (a frame better than the level cannot be
//! shared out). That is a sum over frames, so the best places for the entries can be found exactly, by a dynamic programme.
//! In one stretch of coverage a chunk gains no more than if every station that listens in it had heard it, which caps the
//! stretch (and `held_down` more closely, as below). The least bound over some levels counts.
//!
//! `priced` then tightens it where the same few stations hear an entry again and again. What frames of one listener's pass add to
//! one chunk is `G(sum of u)` with `u = -ln(1 - q)`, `q` the chance to hear a frame while listening with chance `a`, and
//! `G(s) = -ln(1 - a (1 - e^-s))`: concave, so its tangents bound it in the same way as above. Each pass has a price between 0 and 1 with
//! which its tangent is mixed in (Lagrange's multiplier), moved by subgradients; any prices give a bound.

use super::coverage::Coverage;
use super::task::Task;

/// Levels that are tried.
const LEVELS: [f64; 17] =
    [0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0];
/// Prices of a frame that are tried where ranges hold chunks that are not missing, as shares of the best frame.
const PRICES: [f64; 6] = [0.0, 0.3, 0.5, 0.7, 0.85, 0.95];

/// Levels in which repeats are priced, as shares of the best level without, and rounds of each.
const LEVEL_SHARES: [f64; 3] = [1.0, 0.75, 1.35];
const PRICE_ROUNDS: i32 = 24;
/// A bound so close to what was reached says enough.
const CLOSE_ENOUGH: f64 = 1.02;
/// Where the tangent of a pass touches, as `u`: the last one is the limit that a pass has at all.
const KNEES: [f64; 4] = [1.0, 2.0, 3.5, 40.0];

/// A run of coverage in which entries may lie.
struct Stretch {
    first: usize,
    end: usize,
    /// The most that one chunk can gain in it, as a sum of `w`.
    cap: f64,
}

/// The bound, in chunks. It is not tightened further once it is within two hundredths of what was `reached`.
pub(super) fn upper(task: &Task, coverage: &Coverage, reached: f64) -> f64 {
    let missing = task.missing.len() as f64;
    let (Some(first), Some(last)) = (task.missing.first(), task.missing.last()) else { return 0.0 };
    let longest = usize::from(task.rules.chunks_max).min(usize::from(last - first) + 1);
    let entries = task.rules.entries_max;
    let useful = densest(&task.missing, longest);
    let stretches = stretches(coverage, longest);
    let held_down = held_down(task, coverage, &stretches, longest);
    let (mut least, mut best_level) = (missing, 1.0);
    for level in LEVELS {
        let down = (-level).exp();
        let base = 1.0 - down * (1.0 + level);
        let worth = |w: f64| if w <= level { down * w } else { 1.0 - (-w).exp() - base };
        let prices = if useful < longest { &PRICES[..] } else { &PRICES[..1] };
        let frames: Vec<f64> = coverage.anybody.iter().map(|p| worth(-(1.0 - p).max(1e-300).ln())).collect();
        let most = frames.iter().copied().fold(0.0, f64::max);
        for share in prices {
            let price = share * most;
            let paid = price * (useful * entries) as f64;
            let mut table = vec![0.0; entries + 1];
            for (stretch, held_down) in stretches.iter().zip(&held_down) {
                let cap = missing * worth(stretch.cap);
                let gains = placed(&frames[stretch.first..stretch.end], price, longest, entries);
                let mut better = table.clone();
                for (used, before) in table.iter().enumerate() {
                    for (more, gain) in gains.iter().enumerate().take(entries + 1 - used) {
                        let sum = before + gain.min(cap).min(down * held_down[more]);
                        better[used + more] = f64::max(better[used + more], sum);
                    }
                }
                table = better;
            }
            let bound = missing * base + paid + table.iter().copied().fold(0.0, f64::max);
            if bound < least {
                (least, best_level) = (bound, level);
            }
        }
    }
    for knee in KNEES {
        for share in LEVEL_SHARES {
            if least > CLOSE_ENOUGH * reached {
                least = priced(task, coverage, longest, (knee, share * best_level), least);
            }
        }
    }
    least
}

/// What a frame adds to a chunk by one pass.
#[derive(Clone, Copy)]
struct Hearing {
    visit: usize,
    /// On its own.
    alone: f64,
    /// Where the chunk may have been heard in the same pass already.
    again: f64,
}

/// What frames add by each pass, beat by beat, with the tangent at a knee; and where the tangent of each pass begins.
fn hearings(task: &Task, coverage: &Coverage, knee: f64) -> (Vec<Vec<Hearing>>, Vec<f64>) {
    let held_db = task.pointing.map_or(0.0, |pointing| pointing.held_loss_db);
    let added = |listening: f64, u: f64| -(1.0 - listening * (1.0 - (-u).exp())).max(1e-300).ln();
    let tangent = |listening: f64| {
        let left = listening * f64::exp(-knee);
        let slope = left / (1.0 - listening + left);
        (slope, added(listening, knee) - slope * knee)
    };
    let hearing = |number: u32, beat: usize| {
        let visit = &coverage.visits[number as usize];
        let u = -(1.0 - visit.heard(task, beat, held_db)).max(1e-300).ln();
        let (slope, begin) = tangent(visit.listening);
        let alone = added(visit.listening, u);
        Hearing { visit: number as usize, alone, again: if u <= knee { slope * u } else { alone - begin } }
    };
    let by_beat = coverage
        .in_view
        .iter()
        .zip(&coverage.is_silent)
        .enumerate()
        .map(|(beat, (visits, is_silent))| {
            let visits = if *is_silent { &[][..] } else { &visits[..] };
            visits.iter().map(|&number| hearing(number, beat)).collect()
        })
        .collect();
    let missing = task.missing.len() as f64;
    (by_beat, coverage.visits.iter().map(|visit| missing * tangent(visit.listening).1).collect())
}

/// What a stretch adds to all chunks at most, as a sum of `w`, by number of entries in it: repeats in its passes held down.
fn held_down(task: &Task, coverage: &Coverage, stretches: &[Stretch], longest: usize) -> Vec<Vec<f64>> {
    let entries = task.rules.entries_max;
    let mut least = vec![vec![f64::INFINITY; entries + 1]; stretches.len()];
    for knee in KNEES {
        let (by_beat, begins) = hearings(task, coverage, knee);
        let frames: Vec<f64> = by_beat.iter().map(|beat| beat.iter().map(|one| one.again).sum()).collect();
        for (stretch, least) in stretches.iter().zip(&mut least) {
            let within = |visit: &super::coverage::Visit| {
                visit.first < stretch.end && visit.first + visit.margins_db.len() > stretch.first
            };
            let begin: f64 = coverage
                .visits
                .iter()
                .zip(&begins)
                .filter(|(visit, _)| within(visit))
                .map(|(_, begin)| begin)
                .sum();
            let placed = placed(&frames[stretch.first..stretch.end], 0.0, longest, entries);
            for (least, most) in least.iter_mut().zip(placed) {
                *least = least.min(begin + most);
            }
        }
    }
    least
}

/// The bound with repeats in a listener's pass priced in, for a knee and a level, if it is less than `least`.
fn priced(
    task: &Task,
    coverage: &Coverage,
    longest: usize,
    (knee, level): (f64, f64),
    mut least: f64,
) -> f64 {
    let missing = task.missing.len() as f64;
    let (by_beat, begins) = hearings(task, coverage, knee);
    let mut prices = vec![0.0; begins.len()];
    let down = f64::exp(-level);
    let base = missing * (1.0 - down * (1.0 + level));
    for round in 0..PRICE_ROUNDS {
        let mixed = |one: &Hearing| one.alone + prices[one.visit] * (one.again - one.alone);
        let frames: Vec<f64> = by_beat.iter().map(|beat| beat.iter().map(mixed).sum()).collect();
        let (most, windows) = windows(&frames, longest, task.rules.entries_max);
        let paid: f64 = prices.iter().zip(&begins).map(|(price, begin)| price * begin).sum();
        least = least.min(base + down * (most + paid));
        let mut saved = vec![0.0; begins.len()];
        for &(start, end) in &windows {
            for one in by_beat.get(start..end.min(by_beat.len())).into_iter().flatten().flatten() {
                saved[one.visit] += one.alone - one.again;
            }
        }
        let stride = 0.6 / (1.0 + 0.2 * f64::from(round));
        for ((price, begin), saved) in prices.iter_mut().zip(&begins).zip(&saved) {
            let over = (saved - begin) / begin.max(1e-12);
            *price = (*price + stride * over.clamp(-1.0, 1.0)).clamp(0.0, 1.0);
        }
    }
    least
}

/// The most that so many windows of a length, apart from each other, hold, and where they lie.
fn windows(frames: &[f64], longest: usize, entries: usize) -> (f64, Vec<(usize, usize)>) {
    let count = frames.len() + longest;
    let mut sums = vec![0.0];
    for beat in 0..count {
        sums.push(sums[beat] + frames.get(beat).copied().unwrap_or(0.0));
    }
    let gain = |end: usize| sums[end] - sums[end.saturating_sub(longest)];
    let mut tables: Vec<Vec<f64>> = vec![vec![0.0; count + 1]];
    for k in 0..entries {
        let mut best = vec![0.0; count + 1];
        for end in 1..=count {
            best[end] = f64::max(best[end - 1], tables[k][end.saturating_sub(longest)] + gain(end));
        }
        tables.push(best);
    }
    let (mut left, mut end, mut found) = (entries, count, Vec::new());
    while left > 0 && end > 0 {
        if tables[left][end] == tables[left][end - 1] {
            end -= 1;
        } else {
            found.push((end.saturating_sub(longest), end));
            (left, end) = (left - 1, end.saturating_sub(longest));
        }
    }
    (tables[entries][count], found)
}

/// Most missing chunks in a range of this length.
fn densest(missing: &[u16], longest: usize) -> usize {
    let (mut most, mut start) = (0, 0);
    for (end, &chunk) in missing.iter().enumerate() {
        while usize::from(chunk - missing[start]) >= longest {
            start += 1;
        }
        most = most.max(end - start + 1);
    }
    most
}

/// Runs of coverage that are further apart than an entry is long.
fn stretches(coverage: &Coverage, longest: usize) -> Vec<Stretch> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (beat, heard) in coverage.anybody.iter().enumerate() {
        if *heard > 0.0 {
            match runs.last_mut() {
                Some(run) if beat - run.1 <= longest => run.1 = beat + 1,
                _ => runs.push((beat, beat + 1)),
            }
        }
    }
    let cap = |first: usize, end: usize| {
        let visits = coverage.visits.iter();
        visits
            .filter(|visit| visit.first < end && visit.first + visit.margins_db.len() > first)
            .map(|visit| -(1.0 - visit.listening).max(1e-300).ln())
            .sum()
    };
    runs.into_iter().map(|(first, end)| Stretch { first, end, cap: cap(first, end) }).collect()
}

/// The most that so many windows of a length, apart from each other, hold; by number of windows.
fn placed(frames: &[f64], price: f64, longest: usize, entries: usize) -> Vec<f64> {
    let count = frames.len() + longest;
    // Windows may reach out at both ends, where there is nothing to be had.
    let mut sums = vec![0.0];
    for beat in 0..count {
        let frame = frames.get(beat).copied().unwrap_or(0.0);
        sums.push(sums[beat] + (frame - price).max(0.0));
    }
    let mut most = vec![0.0];
    let mut fewer = vec![0.0; count + 1];
    for _ in 0..entries {
        let mut best = vec![0.0; count + 1];
        for end in 1..=count {
            let start = end.saturating_sub(longest);
            best[end] = f64::max(best[end - 1], fewer[start] + sums[end] - sums[start]);
        }
        most.push(best[count]);
        fewer = best;
    }
    most
}
