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
}

impl Values {
    /// Takes one.
    pub fn add(&mut self, satellite: &str, parameter: &str, unit: &str, at_us: i64, value: Option<f64>) {
        if !self.held.contains_key(satellite) {
            self.held.insert(satellite.to_owned(), BTreeMap::new());
        }
        let Some(parameters) = self.held.get_mut(satellite) else { return };
        if !parameters.contains_key(parameter) {
            parameters.insert(parameter.to_owned(), Held { unit: unit.to_owned(), ..Held::default() });
        }
        let Some(held) = parameters.get_mut(parameter) else { return };
        let point = Point { at_us, value };
        let place = held.points.partition_point(|other| other.at_us <= at_us);
        held.points.insert(place, point);
        if held.points.len() > VALUES_MAX {
            held.points.pop_front();
        }
        held.revision += 1;
    }

    /// The values of a parameter that came by the stream, oldest first.
    #[must_use]
    pub fn points(&self, satellite: &str, parameter: &str) -> Option<&VecDeque<Point>> {
        Some(&self.held.get(satellite)?.get(parameter)?.points)
    }

    /// Rises with each value of that parameter.
    #[must_use]
    pub fn revision(&self, satellite: &str, parameter: &str) -> u64 {
        self.held.get(satellite).and_then(|of| of.get(parameter)).map_or(0, |held| held.revision)
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

    #[test]
    fn what_comes_late_is_sorted_in_and_the_oldest_goes() {
        let mut values = Values::default();
        for at in [3, 1, 2] {
            values.add("s", "p", "V", at, Some(at as f64));
        }
        let times: Vec<i64> = values.points("s", "p").unwrap().iter().map(|point| point.at_us).collect();
        assert_eq!(times, [1, 2, 3]);
        for at in 0..VALUES_MAX as i64 {
            values.add("s", "p", "V", 10 + at, None);
        }
        assert_eq!(values.points("s", "p").unwrap().len(), VALUES_MAX);
        assert_eq!(values.points("s", "p").unwrap()[0].at_us, 10);
    }
}
