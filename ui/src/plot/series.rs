//! Samples of one value over time, kept so that any stretch of them can be asked for its extremes at once.

use std::ops::Range;

use jiff::{SignedDuration, Timestamp};

/// Samples below one node of the level above.
const FAN: usize = 16;

/// Samples of one value in order of time, with a pyramid of extremes above them.
///
/// A sample without a value (`None`, or a number that is not finite) is kept as invalid: a plot shows it as such and
/// draws no line through it.
#[derive(Debug, Clone, Default)]
pub struct Series {
    times_us: Vec<i64>,
    /// NaN where invalid.
    values: Vec<f64>,
    /// `levels[0]` covers `FAN` samples a node, each further one `FAN` nodes.
    levels: Vec<Vec<Node>>,
    /// Two samples further apart than this have a gap between them.
    gap_us: Option<i64>,
}

/// What is known of a stretch of samples, as indices of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Node {
    pub(crate) lowest: u32,
    pub(crate) highest: u32,
    pub(crate) first: u32,
    pub(crate) last: u32,
    low: f64,
    high: f64,
    pub(crate) invalid: u32,
}

impl Node {
    fn of(index: usize, value: f64) -> Self {
        let at = index as u32;
        let invalid = u32::from(value.is_nan());
        Self { lowest: at, highest: at, first: at, last: at, low: value, high: value, invalid }
    }

    /// Whether there is no valid sample.
    pub(crate) fn is_void(&self) -> bool {
        self.low.is_nan()
    }

    /// This stretch and the one after it.
    fn join(self, later: Self) -> Self {
        let invalid = self.invalid + later.invalid;
        if self.is_void() {
            return Self { invalid, ..later };
        }
        if later.is_void() {
            return Self { invalid, ..self };
        }
        let (lowest, low) =
            if later.low < self.low { (later.lowest, later.low) } else { (self.lowest, self.low) };
        let (highest, high) =
            if later.high > self.high { (later.highest, later.high) } else { (self.highest, self.high) };
        Self { lowest, highest, first: self.first, last: later.last, low, high, invalid }
    }
}

/// What a series says about a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// A sample holds at that moment.
    Value {
        /// When it was taken.
        at: Timestamp,
        /// The value.
        value: f64,
    },
    /// The sample that holds has no valid value.
    Invalid {
        /// When it was taken.
        at: Timestamp,
    },
    /// Nothing is known: before the first sample, after a gap, or far after the last one.
    Nothing,
}

impl Series {
    /// An empty series. Samples further apart than `gap` have a gap between them; without it only invalid samples do.
    #[must_use]
    pub fn new(gap: Option<SignedDuration>) -> Self {
        let micros = |gap: SignedDuration| i64::try_from(gap.as_micros()).unwrap_or(i64::MAX);
        Self { gap_us: gap.map(micros), ..Self::default() }
    }

    /// Adds a sample. An older one than the last is put in its place, which costs time in proportion to what follows it;
    /// one of the same moment as the last is added after it.
    pub fn push(&mut self, at: Timestamp, value: Option<f64>) {
        self.extend([(at, value)]);
    }

    /// Adds samples in any order: newer ones at the end, older ones in their place.
    pub fn extend(&mut self, samples: impl IntoIterator<Item = (Timestamp, Option<f64>)>) {
        let before = self.len();
        let mut dirty = before;
        for (at, value) in samples {
            let (at_us, value) = (at.as_microsecond(), value.filter(|value| value.is_finite()));
            if self.times_us.last().is_some_and(|&last| at_us < last) {
                dirty = dirty.min(self.times_us.partition_point(|&time| time <= at_us));
            }
            self.times_us.push(at_us);
            self.values.push(value.unwrap_or(f64::NAN));
        }
        if dirty < before || !self.times_us[dirty.min(self.len())..].is_sorted() {
            let mut tail: Vec<(i64, f64)> =
                self.times_us.drain(dirty..).zip(self.values.drain(dirty..)).collect();
            tail.sort_by_key(|&(at_us, _)| at_us);
            self.times_us.extend(tail.iter().map(|&(at_us, _)| at_us));
            self.values.extend(tail.iter().map(|&(_, value)| value));
        }
        self.rebuild(dirty);
    }

    /// Forgets what is older than `from`, at the earliest when that is half of all: memory stays within twice of what
    /// is wanted, and the work for each sample constant.
    pub fn trim_before(&mut self, from: Timestamp) {
        let old = self.times_us.partition_point(|&at_us| at_us < from.as_microsecond());
        if old * 2 > self.len() {
            self.times_us.drain(..old);
            self.values.drain(..old);
            self.times_us.shrink_to(self.len() * 2);
            self.values.shrink_to(self.len() * 2);
            self.rebuild(0);
        }
    }

    /// Number of samples, invalid ones included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// When the first sample was taken.
    #[must_use]
    pub fn first_at(&self) -> Option<Timestamp> {
        self.times_us.first().and_then(|&at_us| Timestamp::from_microsecond(at_us).ok())
    }

    /// When the last sample was taken.
    #[must_use]
    pub fn last_at(&self) -> Option<Timestamp> {
        self.times_us.last().and_then(|&at_us| Timestamp::from_microsecond(at_us).ok())
    }

    /// The least and the greatest valid value from `from` to `to`.
    #[must_use]
    pub fn range(&self, from: Timestamp, to: Timestamp) -> Option<(f64, f64)> {
        let node = self.node(self.between(from.as_microsecond(), to.as_microsecond()))?;
        (!node.is_void()).then_some((node.low, node.high))
    }

    /// What held at `at`: the last sample up to then, unless a gap lies between.
    #[must_use]
    pub fn reading(&self, at: Timestamp) -> Reading {
        let at_us = at.as_microsecond();
        let Some(index) = self.times_us.partition_point(|&time| time <= at_us).checked_sub(1) else {
            return Reading::Nothing;
        };
        let taken_us = self.times_us[index];
        if self.gap_us.is_some_and(|gap_us| at_us - taken_us > gap_us) {
            return Reading::Nothing;
        }
        let at = Timestamp::from_microsecond(taken_us).unwrap_or(at);
        match self.values[index] {
            value if value.is_nan() => Reading::Invalid { at },
            value => Reading::Value { at, value },
        }
    }

    /// The samples from `from_us` to `to_us`, both included.
    pub(crate) fn between(&self, from_us: i64, to_us: i64) -> Range<usize> {
        let low = self.times_us.partition_point(|&at_us| at_us < from_us);
        let high = low + self.times_us[low..].partition_point(|&at_us| at_us <= to_us);
        low..high
    }

    /// The first sample at or after `at_us`, looked for from `from` on: near ones are found at once.
    pub(crate) fn seek(&self, from: usize, at_us: i64) -> usize {
        let rest = &self.times_us[from..];
        let mut reach = 1;
        while reach < rest.len() && rest[reach - 1] < at_us {
            reach *= 2;
        }
        let start = reach / 2;
        let end = reach.min(rest.len());
        from + start + rest[start..end].partition_point(|&time| time < at_us)
    }

    pub(crate) fn time_us(&self, index: usize) -> i64 {
        self.times_us[index]
    }

    /// NaN where invalid.
    pub(crate) fn value(&self, index: usize) -> f64 {
        self.values[index]
    }

    /// Whether no line may be drawn from a valid sample to the next valid one.
    pub(crate) fn gap_between(&self, earlier: usize, later: usize) -> bool {
        let apart_us = self.times_us[later] - self.times_us[earlier];
        later != earlier + 1 || self.gap_us.is_some_and(|gap_us| apart_us > gap_us)
    }

    /// The extremes of a stretch; `None` for an empty one.
    pub(crate) fn node(&self, stretch: Range<usize>) -> Option<Node> {
        let mut before: Option<Node> = None;
        let mut after: Option<Node> = None;
        let (mut low, mut high) = (stretch.start, stretch.end);
        // Climbs the pyramid: at each level what sticks out on both sides of whole nodes is taken singly.
        let mut level = 0;
        while low < high {
            let take = |index: usize| match level {
                0 => Node::of(index, self.values[index]),
                level => self.levels[level - 1][index],
            };
            let is_top = level >= self.levels.len() || high - low < 2 * FAN;
            let (inner_low, inner_high) =
                if is_top { (high, high) } else { (low.next_multiple_of(FAN), high / FAN * FAN) };
            for index in low..inner_low.min(high) {
                before = Some(before.map_or_else(|| take(index), |node| node.join(take(index))));
            }
            for index in (inner_high.max(inner_low)..high).rev() {
                after = Some(after.map_or_else(|| take(index), |node| take(index).join(node)));
            }
            (low, high) = (inner_low / FAN, inner_high / FAN);
            level += 1;
            if is_top {
                break;
            }
        }
        match (before, after) {
            (Some(before), Some(after)) => Some(before.join(after)),
            (one, other) => one.or(other),
        }
    }

    /// Makes the pyramid anew from the sample `dirty` on.
    fn rebuild(&mut self, dirty: usize) {
        let mut from = dirty;
        let mut below = self.values.len();
        let mut level = 0;
        loop {
            from /= FAN;
            let count = below.div_ceil(FAN);
            if below <= FAN {
                self.levels.truncate(level);
                break;
            }
            if self.levels.len() == level {
                self.levels.push(Vec::new());
                from = 0;
            }
            let (lower, here) = self.levels.split_at_mut(level);
            let nodes = &mut here[0];
            nodes.truncate(from);
            for node in from..count {
                let stretch = node * FAN..(node * FAN + FAN).min(below);
                let all = match lower.last() {
                    None => stretch.map(|index| Node::of(index, self.values[index])).reduce(Node::join),
                    Some(lower) => lower[stretch].iter().copied().reduce(Node::join),
                };
                nodes.extend(all);
            }
            below = count;
            level += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn at(us: i64) -> Timestamp {
        Timestamp::from_microsecond(us).unwrap()
    }

    fn plain(values: &[f64]) -> Option<(f64, f64)> {
        let valid = values.iter().copied().filter(|value| value.is_finite());
        valid.fold(None, |range, value| {
            Some(range.map_or((value, value), |(low, high): (f64, f64)| (low.min(value), high.max(value))))
        })
    }

    proptest! {
        #[test]
        fn the_pyramid_knows_every_extreme(
            values in prop::collection::vec(prop_oneof![9 => -100.0..100.0, 1 => Just(f64::NAN)], 1..1200),
            ends in (0.0..1.0_f64, 0.0..1.0_f64),
            cut in 0.0..1.0_f64,
        ) {
            let mut series = Series::new(None);
            let samples = |range: Range<usize>| {
                let values = values.clone();
                range.map(move |index| (at(index as i64), Some(values[index])))
            };
            let cut = (cut * values.len() as f64) as usize;
            series.extend(samples(0..cut));
            for sample in samples(cut..values.len()) {
                series.push(sample.0, sample.1);
            }
            let place = |end: f64| (end * values.len() as f64) as usize;
            let (low, high) = (place(ends.0.min(ends.1)), place(ends.0.max(ends.1)));
            prop_assert_eq!(series.range(at(low as i64), at(high as i64 - 1)), plain(&values[low..high.max(low)]));
            if let Some(node) = series.node(low..high) {
                let invalid = values[low..high].iter().filter(|value| value.is_nan()).count();
                prop_assert_eq!(node.invalid as usize, invalid);
            }
        }

        #[test]
        fn samples_in_any_order_end_up_in_order(mut times in prop::collection::vec(0_i64..500, 1..300), cut in 0_usize..300) {
            let mut series = Series::new(None);
            let sample = |&time: &i64| (at(time), Some(time as f64));
            let cut = cut.min(times.len());
            series.extend(times[..cut].iter().map(sample));
            series.extend(times[cut..].iter().map(sample));
            times.sort_unstable();
            prop_assert_eq!(&series.times_us, &times);
            for (low, high) in [(0, 499), (100, 200), (250, 251)] {
                let wanted: Vec<f64> = times.iter().filter(|&&t| t >= low && t <= high).map(|&t| t as f64).collect();
                prop_assert_eq!(series.range(at(low), at(high)), plain(&wanted));
            }
        }

        #[test]
        fn seeking_finds_what_looking_finds(
            steps in prop::collection::vec(0_i64..4, 1..400), from in 0.0..1.0_f64, target in 0_i64..900,
        ) {
            let mut series = Series::new(None);
            let mut time = 0;
            for step in steps {
                time += step;
                series.push(at(time), Some(0.0));
            }
            let from = (from * series.len() as f64) as usize;
            let found = series.seek(from, target);
            prop_assert_eq!(found, from.max(series.times_us.partition_point(|&time| time < target)));
        }
    }

    #[test]
    fn a_reading_does_not_reach_over_a_gap() {
        let mut series = Series::new(Some(SignedDuration::from_micros(10)));
        series.extend([(at(0), Some(1.0)), (at(5), None), (at(8), Some(2.0)), (at(100), Some(3.0))]);
        assert_eq!(series.reading(at(-1)), Reading::Nothing);
        assert_eq!(series.reading(at(4)), Reading::Value { at: at(0), value: 1.0 });
        assert_eq!(series.reading(at(7)), Reading::Invalid { at: at(5) });
        assert_eq!(series.reading(at(18)), Reading::Value { at: at(8), value: 2.0 });
        assert_eq!(series.reading(at(19)), Reading::Nothing);
    }

    #[test]
    fn memory_stays_flat_when_the_old_is_trimmed() {
        let mut series = Series::new(None);
        for index in 0..100_000 {
            series.push(at(index), Some(index as f64));
            series.trim_before(at(index - 1000));
        }
        assert!(series.len() <= 2003, "{}", series.len());
        assert!(series.times_us.capacity() <= 8192, "{}", series.times_us.capacity());
        assert_eq!(series.range(at(99_500), at(99_600)), Some((99_500.0, 99_600.0)));
    }
}
