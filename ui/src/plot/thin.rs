//! Of many samples, those that a picture of a certain width can show.

use super::series::Series;

/// More samples than this for each column of pixels are thinned.
const PER_COLUMN: usize = 2;

/// What to draw of a series.
#[derive(Debug, Default)]
pub(crate) struct Thinned {
    /// Samples that are drawn, as indices.
    samples: Vec<usize>,
    /// Where in `samples` each piece of the line but the first begins.
    breaks: Vec<usize>,
    /// Moments with invalid samples, at most one a column.
    pub(crate) invalid_us: Vec<i64>,
    /// Number of invalid samples in sight.
    pub(crate) invalid: usize,
    /// Number of samples in sight.
    pub(crate) in_sight: usize,
}

impl Thinned {
    /// The samples of each piece of the line; between pieces is a gap.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = &[usize]> {
        let starts = std::iter::once(0).chain(self.breaks.iter().copied());
        let ends = self.breaks.iter().copied().chain([self.samples.len()]);
        starts.zip(ends).map(|(start, end)| &self.samples[start..end]).filter(|piece| !piece.is_empty())
    }
}

/// What to draw from `from_us` to `to_us` on so many columns: everything where it is little, else the first, the
/// lowest, the highest and the last sample of each column. No line goes over a gap. One sample before and one after
/// the stretch are included, so that lines leave the picture at its edges.
///
/// Columns lie at multiples of their own width, so a picture that moves on does not shimmer.
pub(crate) fn thin(series: &Series, from_us: i64, to_us: i64, columns: usize) -> Thinned {
    let mut thinned = Thinned::default();
    if to_us <= from_us || series.is_empty() {
        return thinned;
    }
    let seen = series.between(from_us, to_us);
    thinned.in_sight = seen.len();
    let stretch = seen.start.saturating_sub(1)..(seen.end + 1).min(series.len());
    let mut line = Path { series, samples: Vec::new(), breaks: Vec::new() };
    if stretch.len() <= columns.max(1) * PER_COLUMN {
        for index in stretch {
            if series.value(index).is_nan() {
                if seen.contains(&index) {
                    thinned.invalid += 1;
                    thinned.invalid_us.push(series.time_us(index));
                }
            } else {
                line.enter(index);
            }
        }
        (thinned.samples, thinned.breaks) = (line.samples, line.breaks);
        return thinned;
    }
    let width_us = ((to_us - from_us) / columns.max(1) as i64).max(1);
    let mut low = stretch.start;
    while low < stretch.end {
        let column_end_us = (series.time_us(low).div_euclid(width_us) + 1) * width_us;
        let high = series.seek(low, column_end_us).min(stretch.end);
        if let Some(node) = series.node(low..high) {
            if node.invalid > 0 {
                thinned.invalid += node.invalid as usize;
                thinned.invalid_us.push(column_end_us - width_us / 2);
            }
            if !node.is_void() {
                line.enter(node.first as usize);
                line.go(node.lowest.min(node.highest) as usize);
                line.go(node.lowest.max(node.highest) as usize);
                line.go(node.last as usize);
            }
        }
        low = high;
    }
    (thinned.samples, thinned.breaks) = (line.samples, line.breaks);
    thinned
}

struct Path<'a> {
    series: &'a Series,
    samples: Vec<usize>,
    breaks: Vec<usize>,
}

impl Path<'_> {
    /// On to a sample of another column, unless there is a gap before it.
    fn enter(&mut self, index: usize) {
        if self.samples.last().is_some_and(|&last| self.series.gap_between(last, index)) {
            self.breaks.push(self.samples.len());
        }
        self.go(index);
    }

    /// On to a sample of the same column: a gap in here is narrower than a pixel.
    fn go(&mut self, index: usize) {
        if self.samples.last() != Some(&index) {
            self.samples.push(index);
        }
    }
}

#[cfg(test)]
mod tests {
    use jiff::{SignedDuration, Timestamp};
    use proptest::prelude::*;

    use super::*;

    /// Steps of time in microseconds (some are gaps), each with a value or none.
    fn samples() -> impl Strategy<Value = Vec<(i64, Option<f64>)>> {
        let step = prop_oneof![20 => 1_i64..20, 1 => 100_i64..5_000];
        let value = prop_oneof![15 => (-10.0..10.0).prop_map(Some), 1 => Just(None)];
        prop::collection::vec((step, value), 1..1_500)
    }

    fn series(steps: &[(i64, Option<f64>)]) -> Series {
        let mut series = Series::new(Some(SignedDuration::from_micros(60)));
        let mut time = 0;
        series.extend(steps.iter().map(|&(step, value)| {
            time += step;
            (Timestamp::from_microsecond(time).unwrap(), value)
        }));
        series
    }

    proptest! {
        #[test]
        fn each_column_keeps_its_least_and_its_greatest(steps in samples(), columns in 1_usize..200) {
            let series = series(&steps);
            let to_us = series.time_us(series.len() - 1);
            let thinned = thin(&series, 0, to_us, columns);
            let kept: Vec<usize> = thinned.pieces().flatten().copied().collect();
            prop_assert!(kept.is_sorted());
            prop_assert!(kept.len() <= (columns + 2) * 4, "{} for {columns} columns", kept.len());
            let width_us = (to_us / columns as i64).max(1);
            let mut wanted = std::collections::BTreeMap::new();
            let mut found = std::collections::BTreeMap::new();
            let note = |map: &mut std::collections::BTreeMap<i64, (f64, f64)>, index: usize| {
                let value = series.value(index);
                if !value.is_nan() {
                    let range = map.entry(series.time_us(index) / width_us).or_insert((value, value));
                    *range = (range.0.min(value), range.1.max(value));
                }
            };
            for index in 0..series.len() {
                note(&mut wanted, index);
            }
            for index in kept {
                note(&mut found, index);
            }
            prop_assert_eq!(wanted, found);
            let invalid = steps.iter().filter(|(_, value)| value.is_none()).count();
            prop_assert_eq!(thinned.invalid, invalid);
        }

        #[test]
        fn no_line_goes_over_a_gap(
            steps in samples(), columns in 1_usize..400, view in (0.0..1.0_f64, 0.0..1.0_f64),
        ) {
            let series = series(&steps);
            let end_us = series.time_us(series.len() - 1) as f64;
            let from_us = (view.0 * end_us) as i64;
            let to_us = from_us + ((view.1 * end_us) as i64).max(1);
            let column_us = ((to_us - from_us) / columns as i64).max(1);
            for piece in thin(&series, from_us, to_us, columns).pieces() {
                for pair in piece.windows(2) {
                    for earlier in pair[0]..pair[1] {
                        let hole_us = series.time_us(earlier + 1) - series.time_us(earlier);
                        prop_assert!(hole_us <= 60.max(column_us), "{hole_us} µs bridged");
                    }
                }
                prop_assert!(piece.iter().all(|&index| !series.value(index).is_nan()));
            }
        }

        #[test]
        fn an_invalid_sample_breaks_the_line_where_a_picture_can_show_it(at in 1_usize..99) {
            let steps: Vec<_> = (0..100).map(|index| (10, (index != at).then_some(1.0))).collect();
            let series = series(&steps);
            prop_assert_eq!(thin(&series, 0, 1_000, 100).pieces().count(), 2 - usize::from(at == 99));
        }
    }
}
