//! The best answer to a task: a forward search over begins, merged where states are equal, pruned by the bound.
//!
//! A label is a schedule so far: what it weighs, until when each antenna is taken, which of the jobs that are still in view are
//! used up. Begins are looked at in order of time; at each, the label declines or accepts, with every end that can
//! matter. Why few ends matter: take the best schedule, and fix its antennas and orders. Begins and ends then solve a
//! linear programme of difference constraints, which has a best vertex. Moving a begin earlier never loses, so a piece begins
//! at its window's begin or when the antenna is free. Moving an end later loses only where it pushes the next one; so
//! a piece ends with its window, or at its minimum, or so that the next piece begins at its window's begin, or
//! begins so late that its minimum just fits, or is itself followed at its minimum by such a one. Those begins are
//! [`turning_points`]. All constraints are whole seconds, so the vertex is, too.

use std::collections::{BTreeMap, BTreeSet};

use super::relax::Relaxed;
use super::task::{Choice, Piece, Task};

/// Free since before the label's own time: it does not matter since when, whatever could have begun then was declined.
const IDLE: i64 = i64::MIN;

/// What of the past matters for the future.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct State {
    /// When each antenna is free, or [`IDLE`].
    free_s: Vec<i64>,
    /// The jobs in view that are used up, ascending.
    used: Vec<usize>,
}

#[derive(Debug, Clone, Copy)]
struct Reached {
    weight: i64,
    bound: i64,
    /// The last piece, in the list of all pieces.
    last: Option<usize>,
}

/// The begins that an end may have to make room for, ascending, by antenna.
fn turning_points(task: &Task) -> Vec<Vec<i64>> {
    let mut points: Vec<BTreeSet<i64>> = vec![BTreeSet::new(); task.gap_s.len()];
    for (antenna, points) in points.iter_mut().enumerate() {
        let gap_s = task.gap_s[antenna];
        // By begin, as the task's are.
        let here: Vec<&Choice> = task.choices.iter().filter(|c| c.antenna == antenna).collect();
        let longest_s = here.iter().map(|c| c.until_s - c.from_s).max().unwrap_or(0);
        let mut news: Vec<i64> = here.iter().flat_map(|c| [c.from_s, c.latest_s()]).collect();
        while let Some(point) = news.pop() {
            if !points.insert(point) {
                continue;
            }
            let first = here.partition_point(|c| c.from_s < point - gap_s - longest_s);
            for c in here[first..].iter().take_while(|c| c.from_s < point) {
                let before = point - gap_s - c.min_s;
                if c.from_s < before && before < c.latest_s() {
                    news.push(before);
                }
            }
        }
    }
    points.into_iter().map(|p| p.into_iter().collect()).collect()
}

/// A search under way.
pub(super) struct Search<'a> {
    task: &'a Task,
    relaxed: &'a Relaxed,
    points: Vec<Vec<i64>>,
    /// For each choice the latest begin of it and all before it: where to begin looking.
    latest_so_far: Vec<i64>,
    /// The last second in which a job can begin.
    job_latest_s: Vec<i64>,
    /// Latest begins of jobs, descending, with the sum of the prices up to there.
    price_after: Vec<(i64, i64)>,
    pieces: Vec<(Option<usize>, Piece)>,
    pending: BTreeMap<(i64, usize), BTreeMap<State, Reached>>,
    waiting: usize,
    /// The best answer so far.
    pub(super) best: Vec<Piece>,
    best_weight: i64,
    /// The highest bound of what was given up unseen.
    dropped: i64,
}

impl<'a> Search<'a> {
    /// A search that begins with the answer `best`; only what weighs more will replace it.
    pub(super) fn new(task: &'a Task, relaxed: &'a Relaxed, best: Vec<Piece>) -> Self {
        let mut latest = i64::MIN;
        let latest_so_far = task
            .choices
            .iter()
            .map(|c| {
                latest = latest.max(c.latest_s());
                latest
            })
            .collect();
        let mut job_latest_s = vec![i64::MIN; task.jobs];
        for c in &task.choices {
            job_latest_s[c.job] = job_latest_s[c.job].max(c.latest_s());
        }
        let mut price_after: Vec<(i64, i64)> =
            job_latest_s.iter().copied().zip(relaxed.prices.iter().copied()).collect();
        price_after.sort_by_key(|(latest_s, _)| std::cmp::Reverse(*latest_s));
        let mut sum = 0;
        for (_, price) in &mut price_after {
            sum += *price;
            *price = sum;
        }
        let best_weight = task.weight(&best);
        Self {
            task,
            relaxed,
            points: turning_points(task),
            latest_so_far,
            job_latest_s,
            price_after,
            pieces: Vec::new(),
            pending: BTreeMap::new(),
            waiting: 0,
            best,
            best_weight,
            dropped: i64::MIN,
        }
    }

    /// Searches with at most `width` labels waiting, and few once `states` were looked at. The bound on every answer.
    pub(super) fn run(&mut self, width: usize, states: &mut usize) -> i64 {
        self.pieces.clear();
        self.dropped = i64::MIN;
        let (from_s, _) = self.task.span_s();
        let start = State { free_s: vec![IDLE; self.task.gap_s.len()], used: Vec::new() };
        self.enqueue(start, 0, None, (from_s - 1, usize::MAX));
        while let Some(((at_s, choice), layer)) = self.pending.pop_first() {
            self.waiting -= layer.len();
            for (state, reached) in undominated(layer) {
                if reached.bound <= self.best_weight {
                    continue;
                }
                *states = states.saturating_sub(1);
                self.accept(&state, reached, at_s, choice);
                self.enqueue(state, reached.weight, reached.last, (at_s, choice));
            }
            let width = if *states == 0 { width.min(8) } else { width };
            if self.waiting > 2 * width {
                self.thin_out(width);
            }
        }
        self.best_weight.max(self.dropped).min(self.relaxed.bound.max(self.best_weight))
    }

    /// Takes the choice from `start_s`, with every end that can matter.
    fn accept(&mut self, state: &State, reached: Reached, start_s: i64, choice: usize) {
        let c = &self.task.choices[choice];
        let (antenna, gap_s) = (c.antenna, self.task.gap_s[c.antenna]);
        let shortest_s = start_s + c.min_s;
        let mut ends = vec![c.until_s];
        if !c.is_rigid() && shortest_s < c.until_s {
            ends.push(shortest_s);
            let points = &self.points[antenna];
            let first = points.partition_point(|p| p - gap_s <= shortest_s);
            ends.extend(points[first..].iter().map(|p| p - gap_s).take_while(|e| *e < c.until_s));
        }
        let mut used = state.used.clone();
        if let Err(place) = used.binary_search(&c.job) {
            used.insert(place, c.job);
        }
        let others: i64 = self
            .relaxed
            .ahead
            .iter()
            .zip(&state.free_s)
            .enumerate()
            .filter(|(a, _)| *a != antenna)
            .map(|(_, (ahead, free_s))| ahead.earn((*free_s).max(start_s)))
            .sum::<i64>()
            + self.prices(start_s, &used);
        for stop_s in ends {
            let weight = reached.weight + c.weight(start_s, stop_s);
            let bound = weight + others + self.relaxed.ahead[antenna].earn(stop_s + gap_s);
            if bound <= self.best_weight {
                continue;
            }
            self.pieces.push((reached.last, Piece { choice, start_s, stop_s }));
            let last = Some(self.pieces.len() - 1);
            if weight > self.best_weight {
                self.best_weight = weight;
                self.best = self.trace(last);
            }
            let mut free_s = state.free_s.clone();
            free_s[antenna] = stop_s + gap_s;
            self.enqueue(State { free_s, used: used.clone() }, weight, last, (start_s, choice));
        }
    }

    /// Lets the label wait at the first begin after `passed`, if there is one that can still lead to something better.
    fn enqueue(&mut self, mut state: State, weight: i64, last: Option<usize>, passed: (i64, usize)) {
        let first = self.latest_so_far.partition_point(|latest_s| *latest_s < passed.0);
        let mut next: Option<(i64, usize)> = None;
        for (choice, c) in self.task.choices.iter().enumerate().skip(first) {
            if next.is_some_and(|n| c.from_s > n.0) {
                break;
            }
            let start_s = c.from_s.max(state.free_s[c.antenna]);
            let begin = (start_s, choice);
            if begin > passed
                && start_s <= c.latest_s()
                && next.is_none_or(|n| begin < n)
                && state.used.binary_search(&c.job).is_err()
            {
                next = Some(begin);
            }
        }
        let Some(next) = next else { return };
        for free_s in &mut state.free_s {
            if *free_s < next.0 {
                *free_s = IDLE;
            }
        }
        state.used.retain(|job| self.job_latest_s[*job] >= next.0);
        let earn: i64 = self
            .relaxed
            .ahead
            .iter()
            .zip(&state.free_s)
            .map(|(a, free_s)| a.earn((*free_s).max(next.0)))
            .sum();
        let bound = weight + earn + self.prices(next.0, &state.used);
        if bound <= self.best_weight {
            return;
        }
        let reached = Reached { weight, bound, last };
        match self.pending.entry(next).or_default().entry(state) {
            std::collections::btree_map::Entry::Vacant(place) => {
                place.insert(reached);
                self.waiting += 1;
            }
            std::collections::btree_map::Entry::Occupied(mut place) => {
                if weight > place.get().weight {
                    place.insert(reached);
                }
            }
        }
    }

    /// The prices of the jobs that can still begin at or after `at_s` and are not used up.
    fn prices(&self, at_s: i64, used: &[usize]) -> i64 {
        let alive = self.price_after.partition_point(|(latest_s, _)| *latest_s >= at_s);
        let all = alive.checked_sub(1).map_or(0, |i| self.price_after[i].1);
        let spent: i64 =
            used.iter().filter(|&&j| self.job_latest_s[j] >= at_s).map(|&j| self.relaxed.prices[j]).sum();
        all - spent
    }

    /// Keeps the `width` labels with the highest bounds.
    fn thin_out(&mut self, width: usize) {
        let mut bounds: Vec<i64> = self.pending.values().flat_map(|l| l.values().map(|r| r.bound)).collect();
        bounds.sort_unstable_by_key(|b| std::cmp::Reverse(*b));
        let Some(&least) = bounds.get(width.saturating_sub(1)) else { return };
        let mut ties = width - bounds.iter().take(width).filter(|b| **b > least).count();
        let (best, dropped) = (self.best_weight, &mut self.dropped);
        self.waiting = 0;
        for layer in self.pending.values_mut() {
            layer.retain(|_, reached| {
                let stays = reached.bound > least || (reached.bound == least && ties > 0);
                if stays && reached.bound == least {
                    ties -= 1;
                }
                if !stays && reached.bound > best {
                    *dropped = (*dropped).max(reached.bound);
                }
                stays
            });
            self.waiting += layer.len();
        }
        self.pending.retain(|_, layer| !layer.is_empty());
    }

    fn trace(&self, mut last: Option<usize>) -> Vec<Piece> {
        let mut pieces = Vec::new();
        while let Some(index) = last {
            let (before, piece) = self.pieces[index];
            pieces.push(piece);
            last = before;
        }
        pieces.reverse();
        pieces
    }
}

/// Without the labels that another one of the same layer beats in every respect.
fn undominated(layer: BTreeMap<State, Reached>) -> Vec<(State, Reached)> {
    let mut labels: Vec<(State, Reached)> = layer.into_iter().collect();
    if labels.len() > 256 {
        return labels;
    }
    labels.sort_by_key(|(_, reached)| std::cmp::Reverse(reached.weight));
    let mut kept: Vec<(State, Reached)> = Vec::with_capacity(labels.len());
    for (state, reached) in labels {
        let beaten = kept.iter().any(|(other, _)| {
            other.used.iter().all(|job| state.used.binary_search(job).is_ok())
                && other.free_s.iter().zip(&state.free_s).all(|(a, b)| a <= b)
        });
        if !beaten {
            kept.push((state, reached));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::super::relax::relax;
    use super::*;

    /// The first is cut neither for its neighbour's begin nor for its end, but so that the neighbour at its shortest is
    /// done when the third begins. The search must find it by itself, without the answer of the relaxation.
    #[test]
    fn a_chain_of_shortest_pieces_moves_the_cut() {
        let choice = |job, from_s, until_s, min_s, rate| {
            let (candidate, antenna, promise) = (job, 0, 0);
            Choice { job, candidate, antenna, from_s, until_s, min_s, rate, promise }
        };
        let choices = vec![choice(0, 0, 22, 2, 10), choice(1, 5, 33, 4, 7), choice(2, 26, 30, 4, 25)];
        let task = Task { choices, gap_s: vec![1], jobs: 3 };
        let relaxed = relax(&task);
        let mut search = Search::new(&task, &relaxed, Vec::new());
        assert_eq!(search.run(1000, &mut 1000), 328);
        let ends: Vec<i64> = search.best.iter().map(|p| p.stop_s).collect();
        assert_eq!(ends, [20, 25, 30]);
    }

    /// With one label at a time the search still ends, with an answer and an honest bound.
    #[test]
    fn a_narrow_search_says_what_it_gave_up() {
        let choices: Vec<Choice> = (0..12)
            .map(|n| Choice {
                job: n / 2,
                candidate: n,
                antenna: n % 2,
                from_s: 7 * (n as i64 / 2),
                until_s: 7 * (n as i64 / 2) + 20,
                min_s: 5,
                rate: 3 + (n as i64 * 5) % 7,
                promise: 0,
            })
            .collect();
        let task = Task { choices, gap_s: vec![2, 3], jobs: 6 };
        let relaxed = relax(&task);
        let wide = Search::new(&task, &relaxed, Vec::new()).run(10_000, &mut 100_000);
        let mut narrow = Search::new(&task, &relaxed, Vec::new());
        let bound = narrow.run(1, &mut 0);
        assert!(!narrow.best.is_empty() && task.weight(&narrow.best) <= wide && wide <= bound);
    }
}
