//! Where modes stand: in columns by how many steps away they are from the first.

use std::collections::VecDeque;

/// For each mode its column, and its place in there.
pub(super) fn columns(modes: usize, ways: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let mut rank: Vec<Option<usize>> = vec![None; modes];
    let mut queue = VecDeque::new();
    // What cannot be reached from the first begins a walk of its own.
    for start in 0..modes {
        if rank[start].is_some() {
            continue;
        }
        rank[start] = Some(0);
        queue.push_back(start);
        while let Some(mode) = queue.pop_front() {
            let next = rank[mode].unwrap_or(0) + 1;
            for &(from, to) in ways {
                if from == mode && to < modes && rank[to].is_none() {
                    rank[to] = Some(next);
                    queue.push_back(to);
                }
            }
        }
    }
    let mut columns: Vec<Vec<usize>> = Vec::new();
    for (mode, rank) in rank.iter().enumerate() {
        let rank = rank.unwrap_or(0);
        if columns.len() <= rank {
            columns.resize(rank + 1, Vec::new());
        }
        columns[rank].push(mode);
    }
    // Each beside those that lead to it, so that lines cross less.
    for index in 1..columns.len() {
        let (before, rest) = columns.split_at_mut(index);
        let place = |mode: usize| {
            let of =
                |from: usize| before.last().and_then(|column| column.iter().position(|&other| other == from));
            let all: Vec<usize> =
                ways.iter().filter(|way| way.1 == mode).filter_map(|way| of(way.0)).collect();
            if all.is_empty() { 0.0 } else { all.iter().sum::<usize>() as f64 / all.len() as f64 }
        };
        rest[0].sort_by(|&one, &other| place(one).total_cmp(&place(other)));
    }
    columns
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn modes_stand_as_far_right_as_they_are_away() {
        let ways = [(0, 1), (1, 2), (2, 1), (0, 3), (3, 0), (2, 0)];
        assert_eq!(columns(5, &ways), vec![vec![0, 4], vec![1, 3], vec![2]]);
    }

    proptest! {
        #[test]
        fn each_mode_stands_somewhere_once(
            modes in 0_usize..20, ways in prop::collection::vec((0_usize..25, 0_usize..25), 0..60),
        ) {
            let mut all: Vec<usize> = columns(modes, &ways).into_iter().flatten().collect();
            all.sort_unstable();
            prop_assert_eq!(all, (0..modes).collect::<Vec<_>>());
        }
    }
}
