//! What the archive said of a stretch of time, and what came live after it, as one series without a seam.
//!
//! The stream begins where the archive ended, and the archive is asked after the stream has begun: together they have
//! everything, some of it twice. What stands in both is told by its frame.

use std::collections::HashSet;

use api::TelemetryPage;
use jiff::{SignedDuration, Timestamp};
use ui::plot::Series;

use crate::model::{Point, Values};

/// More live values than this behind an answer, and the archive is asked again: it thins them.
const TAIL_MAX: usize = 10_000;

/// A stretch of time in microseconds since 1970.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) from_us: i64,
    /// Not included; `None`: until now, whenever that is.
    pub(super) to_us: Option<i64>,
}

impl Span {
    pub(super) fn covers(self, from_us: i64, to_us: i64) -> bool {
        self.from_us <= from_us && self.to_us.is_none_or(|end| to_us <= end)
    }

    fn has(self, at_us: i64) -> bool {
        self.from_us <= at_us && self.to_us.is_none_or(|end| at_us < end)
    }

    /// How much of that stretch it has, in microseconds.
    pub(super) fn overlap(self, from_us: i64, to_us: i64) -> i64 {
        (self.to_us.unwrap_or(i64::MAX).min(to_us).saturating_sub(self.from_us.max(from_us))).max(0)
    }
}

/// Which frames an answer knows.
#[derive(Debug)]
enum Known {
    /// Each of them.
    Frames(HashSet<u64>),
    /// Thinned: it knows all up to this one, for frames are numbered as they are stored.
    UpTo(u64),
}

#[derive(Debug)]
pub(super) struct Answer {
    pub(super) span: Span,
    /// Length of a bucket in microseconds; `None`: every value is there.
    pub(super) width_us: Option<i64>,
    pub(super) series: Series,
    /// As the archive had it.
    base: Vec<(Timestamp, Option<f64>)>,
    gap: SignedDuration,
    known: Known,
    /// Values of the stream were taken up to this revision.
    seen: u64,
    tail: usize,
    /// The archive must be asked again to be sure, or to save room.
    pub(super) stale: bool,
}

impl Answer {
    pub(super) fn new(span: Span, page: &TelemetryPage, values: &Values) -> Self {
        let (base, width_us, known) = if page.decimated {
            let width_us = page.buckets.first().map(|bucket| bucket.stop.unix_us() - bucket.start.unix_us());
            let last = page.buckets.iter().map(|bucket| bucket.last.frame).max().unwrap_or(0);
            (thinned(page), width_us, Known::UpTo(last))
        } else {
            let samples = page.samples.iter();
            let base = samples.map(|sample| (at(sample.at.unix_us()), sample.value)).collect();
            let frames = page.samples.iter().map(|sample| sample.frame).collect();
            (base, None, Known::Frames(frames))
        };
        let gap = gap(&base, width_us);
        let series = Series::new(Some(gap));
        let mut answer = Self { span, width_us, series, base, gap, known, seen: 0, tail: 0, stale: false };
        answer.rebuild(values, &page.satellite, &page.parameter);
        answer
    }

    /// Whether a view of that length is drawn from it as finely as it can be.
    pub(super) fn is_fine_for(&self, length_us: i64) -> bool {
        self.width_us.is_none_or(|width_us| width_us <= length_us / 500)
    }

    /// Takes what the stream brought since the last time.
    pub(super) fn catch_up(&mut self, values: &Values, satellite: &str, parameter: &str) {
        let revision = values.revision(satellite, parameter);
        if revision == self.seen {
            return;
        }
        let Some(new) = values.since(satellite, parameter, self.seen) else {
            self.stale = true;
            return self.rebuild(values, satellite, parameter);
        };
        let new: Vec<_> = new.filter(|point| self.takes(point)).map(sample).collect();
        self.tail += new.len();
        self.stale |= self.tail > TAIL_MAX;
        self.series.extend(new);
        self.seen = revision;
    }

    fn rebuild(&mut self, values: &Values, satellite: &str, parameter: &str) {
        let live = values.points(satellite, parameter).into_iter().flatten();
        let live: Vec<_> = live.filter(|point| self.takes(point)).copied().map(sample).collect();
        self.tail = live.len();
        self.series = Series::new(Some(self.gap));
        self.series.extend(self.base.iter().copied().chain(live));
        self.seen = values.revision(satellite, parameter);
    }

    fn takes(&self, point: &Point) -> bool {
        let new = match &self.known {
            Known::Frames(frames) => !frames.contains(&point.frame),
            Known::UpTo(last) => point.frame > *last,
        };
        new && self.span.has(point.at_us)
    }
}

/// Two points for each bucket, its least and its greatest value; one where it has one value, and a break where it has
/// invalid ones.
fn thinned(page: &TelemetryPage) -> Vec<(Timestamp, Option<f64>)> {
    let mut points = Vec::with_capacity(page.buckets.len() * 2);
    for bucket in &page.buckets {
        let (start_us, last_us) = (bucket.start.unix_us(), bucket.last.at.unix_us());
        if bucket.invalid > 0 && bucket.last.value.is_some() {
            points.push((at(start_us), None));
        }
        match (bucket.min, bucket.max) {
            (Some(min), Some(max)) if bucket.count > 1 => {
                // A value lay at the last moment, and another no later than that.
                let middle_us = start_us + (last_us - start_us) / 2;
                points.push((at(middle_us), Some(min)));
                points.push((at(last_us), Some(max)));
            }
            (Some(only), _) => points.push((at(last_us), Some(only))),
            _ => points.push((at(last_us), None)),
        }
        if bucket.last.value.is_none() && bucket.count > 0 {
            points.push((at(last_us), None));
        }
    }
    points
}

/// Values further apart than this are not joined: a few times the usual distance.
fn gap(base: &[(Timestamp, Option<f64>)], width_us: Option<i64>) -> SignedDuration {
    let mut apart: Vec<i64> =
        base.windows(2).map(|two| two[1].0.as_microsecond() - two[0].0.as_microsecond()).collect();
    let middle = apart.len() / 2;
    let usual_us = match apart.is_empty() {
        true => 120_000_000,
        false => *apart.select_nth_unstable(middle).1,
    };
    SignedDuration::from_micros((5 * usual_us).max(2 * width_us.unwrap_or(0)).max(1_000_000))
}

fn sample(point: Point) -> (Timestamp, Option<f64>) {
    (at(point.at_us), point.value)
}

pub(in crate::panes) fn at(us: i64) -> Timestamp {
    Timestamp::from_microsecond(us).unwrap_or(if us < 0 { Timestamp::MIN } else { Timestamp::MAX })
}

#[cfg(test)]
mod tests {
    use api::{Bucket, Sample, Time};
    use ui::plot::Reading;

    use super::*;

    const SPAN: Span = Span { from_us: 0, to_us: None };

    fn all(count: u64) -> Vec<Point> {
        let value = |frame: u64| (frame % 7 != 3).then_some(frame as f64);
        (0..count)
            .map(|frame| Point { at_us: frame as i64 * 60_000_000, value: value(frame), frame: frame + 1 })
            .collect()
    }

    fn page(points: &[Point]) -> TelemetryPage {
        let sample = |point: &Point| Sample {
            at: Time::from_unix_us(point.at_us),
            value: point.value,
            frame: point.frame,
        };
        TelemetryPage {
            parameter: "p".to_owned(),
            unit: "V".to_owned(),
            satellite: "s".to_owned(),
            start: None,
            stop: None,
            decimated: false,
            samples: points.iter().map(sample).collect(),
            buckets: Vec::new(),
        }
    }

    fn thin_page(points: &[Point], each: usize) -> TelemetryPage {
        let bucket = |points: &[Point]| {
            let valid: Vec<f64> = points.iter().filter_map(|point| point.value).collect();
            let last = points[points.len() - 1];
            Bucket {
                start: Time::from_unix_us(points[0].at_us),
                stop: Time::from_unix_us(points[0].at_us + each as i64 * 60_000_000),
                min: valid.iter().copied().reduce(f64::min),
                max: valid.iter().copied().reduce(f64::max),
                avg: None,
                count: valid.len() as u64,
                invalid: (points.len() - valid.len()) as u64,
                last: Sample { at: Time::from_unix_us(last.at_us), value: last.value, frame: last.frame },
            }
        };
        let buckets = points.chunks(each).map(bucket).collect();
        TelemetryPage { decimated: true, buckets, samples: Vec::new(), ..page(&[]) }
    }

    fn live(points: &[Point]) -> Values {
        let mut values = Values::default();
        for point in points {
            values.add("s", "p", "V", *point);
        }
        values
    }

    /// Whatever is in the archive and whatever came live, and however much of it in both: each once.
    #[test]
    fn archive_and_live_join_without_gap_and_without_double() {
        let all = all(50);
        for stored in 0..=50 {
            for heard_from in 0..=stored {
                let values = live(&all[heard_from..]);
                let answer = Answer::new(SPAN, &page(&all[..stored]), &values);
                assert_eq!(answer.series.len(), 50, "{stored} stored, live from {heard_from}");
                for point in &all {
                    let expected = match point.value {
                        Some(value) => Reading::Value { at: at(point.at_us), value },
                        None => Reading::Invalid { at: at(point.at_us) },
                    };
                    assert_eq!(answer.series.reading(at(point.at_us)), expected);
                }
            }
        }
    }

    #[test]
    fn what_comes_afterwards_is_added_once_and_what_comes_late_is_sorted_in() {
        let all = all(20);
        let mut values = live(&all[5..12]);
        let mut answer = Answer::new(SPAN, &page(&all[..10]), &values);
        for point in all[12..].iter().chain([&Point { at_us: 30_000_000, value: Some(-1.0), frame: 99 }]) {
            values.add("s", "p", "V", *point);
            answer.catch_up(&values, "s", "p");
            answer.catch_up(&values, "s", "p");
        }
        assert_eq!(answer.series.len(), 21);
        assert!(answer.stale, "something came late: the archive knows better");
        assert!(
            matches!(answer.series.reading(at(31_000_000)), Reading::Value { value, .. } if value == -1.0)
        );
    }

    #[test]
    fn a_thinned_archive_keeps_its_extremes_and_joins_the_same_way() {
        let all = all(100);
        for heard_from in [0, 60, 80] {
            let values = live(&all[heard_from..]);
            let answer = Answer::new(SPAN, &thin_page(&all[..80], 10), &values);
            assert_eq!(answer.series.range(at(0), at(i64::MAX)), Some((0.0, 99.0)));
            for point in &all[80..] {
                let expected = match point.value {
                    Some(value) => Reading::Value { at: at(point.at_us), value },
                    None => Reading::Invalid { at: at(point.at_us) },
                };
                assert_eq!(answer.series.reading(at(point.at_us)), expected, "live from {heard_from}");
            }
            let (low, high) = answer.series.range(at(0), at(79 * 60_000_000)).unwrap();
            assert_eq!((low, high), (0.0, 79.0), "78 and 79 are the last of the archive");
        }
    }

    #[test]
    fn a_view_between_two_times_has_nothing_of_later() {
        let span = Span { from_us: 0, to_us: Some(5 * 60_000_000) };
        let all = all(10);
        let answer = Answer::new(span, &page(&all[..5]), &live(&all));
        assert_eq!(answer.series.len(), 5);
        assert!(span.covers(0, 5 * 60_000_000) && !span.covers(0, 5 * 60_000_000 + 1));
        assert_eq!(span.overlap(60_000_000, i64::MAX), 4 * 60_000_000);
    }
}
