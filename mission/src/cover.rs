//! The cheapest way to ask for missing chunks.
//!
//! A request costs airtime whatever it asks for, and every chunk costs airtime once more. So it may pay to ask for
//! chunks that are held already, as a bridge between two gaps. A dynamic programme over the missing chunks finds the
//! cheapest set of ranges; ties go to the fewest requests, then to the fewest bridged chunks.

/// What asking costs on the air, in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// One request and its turn-rounds, whatever it asks for.
    pub request_us: u64,
    /// One chunk in the answer.
    pub chunk_us: u64,
}

/// A run of chunks to ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    /// The first chunk.
    pub first: u16,
    /// How many.
    pub count: u16,
    /// How many of them are held already.
    pub bridged: u16,
}

impl Range {
    /// How many of them are missing.
    pub const fn missing(&self) -> u16 {
        self.count - self.bridged
    }
}

/// Ranges that together name every missing chunk.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Cover {
    /// Ascending, one request each.
    pub ranges: Vec<Range>,
    /// What they cost together, in microseconds.
    pub cost_us: u64,
}

/// The cheapest cover of `missing` (ascending, without repeats) by ranges of at most `longest` chunks.
pub fn cheapest_cover(missing: &[u16], longest: u16, cost: Cost) -> Cover {
    let longest = longest.max(1);
    let n = missing.len();
    // best[i]: (cost, requests, bridged) of covering missing[i..]; end[i]: where the first range of that stops.
    let mut best = vec![(0u64, 0u32, 0u32); n + 1];
    let mut end = vec![0usize; n];
    for i in (0..n).rev() {
        let mut choice: Option<((u64, u32, u32), usize)> = None;
        for j in i..n {
            let span = u32::from(missing[j]) - u32::from(missing[i]) + 1;
            if span > u32::from(longest) {
                break;
            }
            let wanted = u32::try_from(j - i + 1).unwrap_or(u32::MAX);
            let (rest_us, requests, bridged) = best[j + 1];
            let total_us = rest_us
                .saturating_add(cost.request_us)
                .saturating_add(cost.chunk_us.saturating_mul(u64::from(span)));
            let total = (total_us, requests + 1, bridged + (span - wanted));
            // Equal ones: the longest first range, so that a picture grows from its top.
            if choice.is_none_or(|(least, _)| total <= least) {
                choice = Some((total, j));
            }
        }
        if let Some((total, j)) = choice {
            best[i] = total;
            end[i] = j;
        }
    }
    let mut ranges = Vec::new();
    let mut i = 0;
    while i < n {
        let j = end[i];
        let count = missing[j] - missing[i] + 1;
        let wanted = u16::try_from(j - i + 1).unwrap_or(u16::MAX);
        ranges.push(Range { first: missing[i], count, bridged: count - wanted });
        i = j + 1;
    }
    Cover { ranges, cost_us: best[0].0 }
}

/// The exact runs of missing chunks, at most `runs` of them and `chunks` chunks together: for one request that can
/// name many ranges, where another range costs nothing.
pub(crate) fn exact_runs(missing: &[u16], runs: usize, chunks: u16) -> Vec<Range> {
    let mut out: Vec<Range> = Vec::new();
    for &index in missing.iter().take(usize::from(chunks)) {
        let continues = |range: &Range| u32::from(range.first) + u32::from(range.count) == u32::from(index);
        if let Some(last) = out.last_mut().filter(|range| continues(range)) {
            last.count += 1;
        } else if out.len() < runs {
            out.push(Range { first: index, count: 1, bridged: 0 });
        } else {
            break;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use proptest::prelude::*;

    use super::*;

    /// Every way to choose ranges, by exhaustive search over which chunks are still to be covered.
    fn brute_force(missing: u16, size: u16, longest: u16, cost: Cost, seen: &mut HashMap<u16, u64>) -> u64 {
        if missing == 0 {
            return 0;
        }
        if let Some(&known) = seen.get(&missing) {
            return known;
        }
        let mut least = u64::MAX;
        for first in 0..size {
            for count in 1..=longest.min(size - first) {
                let asked = (0..count).fold(0u16, |mask, k| mask | 1 << (first + k));
                if asked & missing != 0 {
                    let rest = brute_force(missing & !asked, size, longest, cost, seen);
                    least = least.min(rest + cost.request_us + cost.chunk_us * u64::from(count));
                }
            }
        }
        seen.insert(missing, least);
        least
    }

    #[test]
    fn it_equals_brute_force_on_every_bitmap_of_ten_chunks() {
        for (request_us, chunk_us, longest) in [(25, 10, 10), (25, 10, 4), (9, 10, 6), (100, 1, 5), (0, 1, 3)]
        {
            let cost = Cost { request_us, chunk_us };
            let mut seen = HashMap::new();
            for bitmap in 0u16..1 << 10 {
                let missing: Vec<u16> = (0..10).filter(|i| bitmap >> i & 1 == 1).collect();
                let cover = cheapest_cover(&missing, longest, cost);
                assert_eq!(cover.cost_us, brute_force(bitmap, 10, longest, cost, &mut seen), "{bitmap:b}");
            }
        }
    }

    #[test]
    fn a_bridge_is_built_only_where_it_is_cheaper() {
        let cost = Cost { request_us: 25, chunk_us: 10 };
        assert_eq!(cheapest_cover(&[0, 3], 64, cost).ranges, [Range { first: 0, count: 4, bridged: 2 }]);
        assert_eq!(cheapest_cover(&[0, 4], 64, cost).ranges.len(), 2);
    }

    #[test]
    fn exact_runs_keep_their_bounds() {
        let runs = exact_runs(&[0, 1, 2, 5, 7, 8], 2, 64);
        assert_eq!(
            runs,
            [Range { first: 0, count: 3, bridged: 0 }, Range { first: 5, count: 1, bridged: 0 }]
        );
        assert_eq!(exact_runs(&[0, 1, 2], 9, 2), [Range { first: 0, count: 2, bridged: 0 }]);
        assert_eq!(exact_runs(&[65_534, 65_535], 9, 64), [Range { first: 65_534, count: 2, bridged: 0 }]);
    }

    proptest! {
        #[test]
        fn every_missing_chunk_is_named_and_no_range_is_too_long(
            missing in proptest::collection::btree_set(0u16..2000, 0..300), longest in 1u16..80,
            request_us in 0u64..5_000_000, chunk_us in 1u64..2_000_000,
        ) {
            let missing: Vec<u16> = missing.into_iter().collect();
            let cover = cheapest_cover(&missing, longest, Cost { request_us, chunk_us });
            let mut named = Vec::new();
            for range in &cover.ranges {
                prop_assert!(range.count <= longest);
                let inside: Vec<u16> =
                    missing.iter().copied().filter(|m| (range.first..range.first + range.count).contains(m)).collect();
                prop_assert_eq!(inside.len(), usize::from(range.missing()));
                named.extend(inside);
            }
            prop_assert_eq!(named, missing);
        }
    }
}
