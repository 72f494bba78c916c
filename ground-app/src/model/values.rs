//! Values as they came, by satellite and parameter.

use std::collections::{BTreeMap, VecDeque};

/// Values of one parameter that are kept at hand.
pub const VALUES_MAX: usize = 100_000;

/// A value at its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// UTC in microseconds since 1970, when it was heard.
    pub at_us: i64,
    /// The value; `None`: invalid (a failed sensor).
    pub value: Option<f64>,
    /// The frame it stands in: with the time it tells two samples apart.
    pub frame: u64,
}

/// Values as they came. Times rise within a parameter: what comes late is sorted in.
#[derive(Debug, Default)]
pub struct Values {
    held: BTreeMap<String, BTreeMap<String, Held>>,
}

#[derive(Debug, Default)]
struct Held {
    unit: String,
    points: VecDeque<Point>,
    revision: u64,
    /// The revision at which a value was last put among older ones.
    disordered_at: u64,
}

impl Values {
    /// Takes one.
    pub fn add(&mut self, satellite: &str, parameter: &str, unit: &str, point: Point) {
        if !self.held.contains_key(satellite) {
            self.held.insert(satellite.to_owned(), BTreeMap::new());
        }
        let Some(parameters) = self.held.get_mut(satellite) else { return };
        if !parameters.contains_key(parameter) {
            parameters.insert(parameter.to_owned(), Held { unit: unit.to_owned(), ..Held::default() });
        }
        let Some(held) = parameters.get_mut(parameter) else { return };
        held.revision += 1;
        let place = held.points.partition_point(|other| other.at_us <= point.at_us);
        if place < held.points.len() {
            held.disordered_at = held.revision;
        }
        held.points.insert(place, point);
        if held.points.len() > VALUES_MAX {
            held.points.pop_front();
        }
    }

    /// The values of a parameter that came by the stream, oldest first.
    #[must_use]
    pub fn points(&self, satellite: &str, parameter: &str) -> Option<&VecDeque<Point>> {
        Some(&self.held.get(satellite)?.get(parameter)?.points)
    }

    /// The unit that came with that parameter.
    #[must_use]
    pub fn unit(&self, satellite: &str, parameter: &str) -> Option<&str> {
        Some(&self.held.get(satellite)?.get(parameter)?.unit)
    }

    /// Rises with each value of that parameter.
    #[must_use]
    pub fn revision(&self, satellite: &str, parameter: &str) -> u64 {
        self.held.get(satellite).and_then(|of| of.get(parameter)).map_or(0, |held| held.revision)
    }

    /// What came after that revision, oldest first; `None` when it is not just what stands last: something came late, or
    /// more came than is held.
    #[must_use]
    pub fn since(
        &self,
        satellite: &str,
        parameter: &str,
        revision: u64,
    ) -> Option<impl Iterator<Item = Point>> {
        let held = self.held.get(satellite)?.get(parameter)?;
        let new = usize::try_from(held.revision.checked_sub(revision)?).ok()?;
        let from = held.points.len().checked_sub(new)?;
        (held.disordered_at <= revision).then(|| held.points.range(from..).copied())
    }

    /// The newest of each parameter: name, unit, point.
    pub fn newest(&self, satellite: &str) -> impl Iterator<Item = (&str, &str, Point)> {
        let of = self.held.get(satellite).into_iter().flatten();
        of.filter_map(|(name, held)| Some((name.as_str(), held.unit.as_str(), *held.points.back()?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(at_us: i64, value: Option<f64>) -> Point {
        Point { at_us, value, frame: 0 }
    }

    #[test]
    fn what_is_new_is_told_unless_it_came_late() {
        let mut values = Values::default();
        let since = |values: &Values, revision| {
            values.since("s", "p", revision).map(|new| new.map(|point| point.at_us).collect::<Vec<_>>())
        };
        for at in [10, 20] {
            values.add("s", "p", "V", point(at, None));
        }
        let seen = values.revision("s", "p");
        assert_eq!(since(&values, seen), Some(vec![]));
        values.add("s", "p", "V", point(20, None));
        assert_eq!(since(&values, seen), Some(vec![20]));
        values.add("s", "p", "V", point(15, None));
        assert_eq!(since(&values, seen), None);
        assert_eq!(since(&values, values.revision("s", "p")), Some(vec![]));
        assert_eq!(since(&values, 99), None, "of another world");
    }

    #[test]
    fn what_comes_late_is_sorted_in_and_the_oldest_goes() {
        let mut values = Values::default();
        for at in [3, 1, 2] {
            values.add("s", "p", "V", point(at, Some(at as f64)));
        }
        let times: Vec<i64> = values.points("s", "p").unwrap().iter().map(|point| point.at_us).collect();
        assert_eq!(times, [1, 2, 3]);
        for at in 0..VALUES_MAX as i64 {
            values.add("s", "p", "V", point(10 + at, None));
        }
        assert_eq!(values.points("s", "p").unwrap().len(), VALUES_MAX);
        assert_eq!(values.points("s", "p").unwrap()[0].at_us, 10);
    }
}
