//! A large question falls apart: choices that cannot meet, on an antenna or in a job, are answered apart.

use super::relax::relax;
use super::search::Search;
use super::task::{Choice, Piece, Solution, Task};

/// Groups of choices (their indices, by begin) that share nothing: no antenna at a time, no job.
pub(super) fn clusters(choices: &[Choice], gap_s: &[i64]) -> Vec<Vec<usize>> {
    let mut root: Vec<usize> = (0..choices.len()).collect();
    let mut order: Vec<usize> = (0..choices.len()).collect();
    order.sort_by_key(|&i| (choices[i].from_s, i));
    let mut busy: Vec<Option<(i64, usize)>> = vec![None; gap_s.len()];
    let mut first_of_job: Vec<Option<usize>> = Vec::new();
    for &i in &order {
        let c = &choices[i];
        if first_of_job.len() <= c.job {
            first_of_job.resize(c.job + 1, None);
        }
        match first_of_job[c.job] {
            Some(other) => join(&mut root, i, other),
            None => first_of_job[c.job] = Some(i),
        }
        let until_s = c.until_s + gap_s[c.antenna];
        match &mut busy[c.antenna] {
            Some((taken_s, other)) if c.from_s < *taken_s => {
                join(&mut root, i, *other);
                *taken_s = until_s.max(*taken_s);
            }
            free => *free = Some((until_s, i)),
        }
    }
    let mut place: Vec<Option<usize>> = vec![None; choices.len()];
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &i in &order {
        let top = find(&mut root, i);
        let group = *place[top].get_or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[group].push(i);
    }
    groups
}

fn find(root: &mut [usize], mut i: usize) -> usize {
    while root[i] != i {
        root[i] = root[root[i]];
        i = root[i];
    }
    i
}

fn join(root: &mut [usize], a: usize, b: usize) {
    let (a, b) = (find(root, a), find(root, b));
    root[a.max(b)] = a.min(b);
}

/// The part of a question that a cluster is, with jobs and antennas numbered anew.
pub(super) fn part(choices: &[Choice], gap_s: &[i64], members: &[usize]) -> Task {
    let (mut jobs, mut antennas) = (Vec::new(), Vec::new());
    let mut task = Task::default();
    for &i in members {
        let mut c = choices[i].clone();
        c.job = number(&mut jobs, c.job);
        c.antenna = number(&mut antennas, c.antenna);
        task.choices.push(c);
    }
    task.gap_s = antennas.into_iter().map(|a| gap_s[a]).collect();
    task.jobs = jobs.len();
    task
}

fn number(known: &mut Vec<usize>, what: usize) -> usize {
    known.iter().position(|k| *k == what).unwrap_or_else(|| {
        known.push(what);
        known.len() - 1
    })
}

/// How many labels wait at most: first few, for a good answer soon, then enough for a proof.
const WIDTHS: [usize; 2] = [16, 4096];

/// Answers a task; `start` is an answer to begin with, and wins a tie.
pub(super) fn solve(task: &Task, start: Vec<Piece>, states: &mut usize) -> Solution {
    if let [only] = task.choices.as_slice() {
        let whole = Piece { choice: 0, start_s: only.from_s, stop_s: only.until_s };
        return Solution { pieces: vec![whole], bound: task.weight(&[whole]) };
    }
    let relaxed = relax(task);
    let better = task.weight(&relaxed.pieces) > task.weight(&start);
    let mut best = if better { relaxed.pieces.clone() } else { start };
    let mut bound = relaxed.bound;
    for width in WIDTHS {
        if task.weight(&best) >= bound {
            break;
        }
        let mut search = Search::new(task, &relaxed, best);
        bound = bound.min(search.run(width, states));
        best = search.best;
    }
    best.sort_by_key(|p| (p.start_s, p.choice));
    Solution { bound: bound.max(task.weight(&best)), pieces: best }
}
