//! The disk of the data folder: how much is left, for how long, and when somebody should care.
//!
//! Values in, values out. The levels come long before the reserve for raw frames is needed: the reserve is for a disk
//! that is full, this is so that it never is.

use std::collections::VecDeque;

use mission::Level;

use crate::config::DiskSection;

/// One look at the disk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiskView {
    /// What may still be written, bytes.
    pub free_bytes: u64,
    /// How fast it becomes less, bytes a day; `None` while that is not known, or when nothing grows.
    pub bytes_per_day: Option<f64>,
    /// Days until it is full at this rate.
    pub days_left: Option<f64>,
    /// How much anybody should care.
    pub level: Level,
}

/// A day in microseconds.
const DAY_US: f64 = 86_400e6;
/// The rate is told when looks lie this far apart, microseconds: an hour.
const RATE_AFTER_US: i64 = 3_600_000_000;
/// Looks that are remembered for the rate are at least this far apart: 10 minutes.
const REMEMBER_EVERY_US: i64 = 600_000_000;
/// So many are remembered: a day.
const REMEMBERED: usize = 144;
/// A level is left when there is a tenth more than its limit.
const BACK: f64 = 1.1;

/// Watches one disk.
#[derive(Debug)]
pub struct DiskWatch {
    limits: DiskSection,
    /// When, and how much was free.
    looks: VecDeque<(i64, u64)>,
    level: Level,
}

impl DiskWatch {
    /// Knows nothing yet.
    #[must_use]
    pub fn new(limits: DiskSection) -> Self {
        Self { limits, looks: VecDeque::new(), level: Level::Normal }
    }

    /// A look: so much was free at this time (microseconds of any steady clock). The second value is what is to be told,
    /// when the level has changed.
    pub fn look(&mut self, at_us: i64, free_bytes: u64) -> (DiskView, Option<(Level, String)>) {
        let bytes_per_day = self.rate(at_us, free_bytes);
        let days_left = bytes_per_day.map(|rate| free_bytes as f64 / rate);
        if self.looks.back().is_none_or(|(last, _)| at_us - last >= REMEMBER_EVERY_US) {
            if self.looks.len() >= REMEMBERED {
                self.looks.pop_front();
            }
            self.looks.push_back((at_us, free_bytes));
        }
        // A level is reached at its limit, and left somewhat above it.
        let (reached, kept) =
            (self.level_at(free_bytes, days_left, 1.0), self.level_at(free_bytes, days_left, BACK));
        let level = reached.max(kept.min(self.level));
        let before = std::mem::replace(&mut self.level, level);
        let view = DiskView { free_bytes, bytes_per_day, days_left, level };
        (view, (level != before).then(|| (level, sentence(&view))))
    }

    fn rate(&self, at_us: i64, free_bytes: u64) -> Option<f64> {
        let (since_us, was) = self.looks.front()?;
        let apart_us = at_us - since_us;
        let lost = was.checked_sub(free_bytes).filter(|lost| *lost > 0)?;
        (apart_us >= RATE_AFTER_US).then(|| lost as f64 * DAY_US / apart_us as f64)
    }

    fn level_at(&self, free_bytes: u64, days_left: Option<f64>, factor: f64) -> Level {
        let limits = &self.limits;
        let below = |bytes: u64, days: f64| {
            (free_bytes as f64) < bytes as f64 * factor || days_left.is_some_and(|left| left < days * factor)
        };
        if below(limits.critical_bytes, limits.critical_days) {
            Level::Critical
        } else if below(limits.warning_bytes, limits.warning_days) {
            Level::Warning
        } else if below(limits.watch_bytes, limits.watch_days) {
            Level::Watch
        } else {
            Level::Normal
        }
    }
}

fn sentence(view: &DiskView) -> String {
    let free = view.free_bytes as f64 / 1e9;
    let days = match view.days_left {
        Some(days) if days < 1000.0 => format!(", {days:.1} days at the present rate"),
        _ => String::new(),
    };
    match view.level {
        Level::Normal => format!("the disk of the data folder has room again: {free:.2} GB{days}"),
        _ => format!(
            "the disk of the data folder has {free:.2} GB left{days}: make room, or move the folder to a larger disk"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR_US: i64 = 3_600_000_000;
    const GB: u64 = 1_000_000_000;

    fn watch() -> DiskWatch {
        DiskWatch::new(DiskSection::default())
    }

    #[test]
    fn each_level_is_told_once_and_left_with_some_room() {
        let mut watch = watch();
        let limits = DiskSection::default();
        assert_eq!(watch.look(0, 100 * GB).1, None);
        let mut told = Vec::new();
        let frees = [
            limits.watch_bytes - 1,
            limits.watch_bytes - 2,
            limits.watch_bytes + 1,
            limits.warning_bytes - 1,
            limits.critical_bytes - 1,
            limits.critical_bytes + 1,
            100 * GB,
        ];
        for free in frees {
            told.push(watch.look(1, free).1.map(|(level, _)| level));
        }
        use Level::{Critical, Normal, Warning, Watch};
        assert_eq!(told, [Some(Watch), None, None, Some(Warning), Some(Critical), None, Some(Normal)]);
    }

    #[test]
    fn a_disk_that_fills_up_is_told_by_the_days_that_are_left() {
        let mut watch = watch();
        let mut free = 200 * GB;
        let mut told = None;
        for hour in 0..24 {
            let (view, news) = watch.look(hour * HOUR_US, free);
            assert_eq!(view.days_left.is_some(), hour > 0, "nothing is known of the rate in the first hour");
            told = told.or(news);
            free -= GB;
        }
        let (level, text) = told.unwrap();
        assert_eq!(level, Level::Warning, "24 GB a day leave 8 days: {text}");
        assert!(text.contains("days at the present rate"), "{text}");
    }

    #[test]
    fn a_disk_that_grows_emptier_or_stands_still_has_no_rate() {
        let mut watch = watch();
        watch.look(0, 50 * GB);
        assert_eq!(watch.look(2 * HOUR_US, 50 * GB).0.days_left, None);
        assert_eq!(watch.look(3 * HOUR_US, 60 * GB).0.days_left, None);
    }
}
