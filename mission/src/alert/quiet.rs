//! Quiet hours: a stretch of each day, UTC.

use std::fmt;
use std::str::FromStr;

use crate::clock::UtcUs;

const DAY_MIN: i64 = 24 * 60;

/// From a minute of the day to another, UTC; over midnight when the end lies before the begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QuietHours {
    start_min: i64,
    stop_min: i64,
}

/// Text that is no stretch of a day.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no stretch of a day: write two different times of day in UTC, as in 21:00-05:30")]
pub struct QuietHoursError(pub String);

impl QuietHours {
    /// Whether they hold at this instant.
    #[must_use]
    pub fn holds(&self, at: UtcUs) -> bool {
        let minute = at.0.div_euclid(60_000_000).rem_euclid(DAY_MIN);
        if self.start_min <= self.stop_min {
            (self.start_min..self.stop_min).contains(&minute)
        } else {
            minute >= self.start_min || minute < self.stop_min
        }
    }
}

impl FromStr for QuietHours {
    type Err = QuietHoursError;

    fn from_str(text: &str) -> Result<Self, QuietHoursError> {
        let wrong = || QuietHoursError(text.chars().take(40).collect());
        let minute = |text: &str| {
            let (hours, minutes) = text.split_once(':')?;
            let two = |part: &str| {
                (part.len() == 2 && part.bytes().all(|b| b.is_ascii_digit()))
                    .then(|| part.parse::<i64>().ok())
                    .flatten()
            };
            let (hours, minutes) = (two(hours)?, two(minutes)?);
            (hours < 24 && minutes < 60).then_some(hours * 60 + minutes)
        };
        let (start, stop) = text.split_once('-').ok_or_else(wrong)?;
        let (start_min, stop_min) =
            minute(start.trim()).zip(minute(stop.trim())).filter(|(a, b)| a != b).ok_or_else(wrong)?;
        Ok(Self { start_min, stop_min })
    }
}

impl fmt::Display for QuietHours {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { start_min: a, stop_min: b } = self;
        write!(f, "{:02}:{:02}-{:02}:{:02}", a / 60, a % 60, b / 60, b % 60)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(hours: i64, minutes: i64) -> UtcUs {
        UtcUs(((20_000 * 24 + hours) * 60 + minutes) * 60_000_000)
    }

    #[test]
    fn a_night_goes_over_midnight_and_ends_with_its_minute() {
        let night: QuietHours = "21:00-05:30".parse().unwrap();
        assert!(night.holds(at(21, 0)) && night.holds(at(0, 0)) && night.holds(at(5, 29)));
        assert!(!night.holds(at(5, 30)) && !night.holds(at(20, 59)) && !night.holds(at(12, 0)));
        let noon: QuietHours = "12:00 - 13:00".parse().unwrap();
        assert!(noon.holds(at(12, 59)) && !noon.holds(at(13, 0)) && !noon.holds(at(11, 59)));
        assert_eq!(noon.to_string(), "12:00-13:00");
    }

    #[test]
    fn nonsense_is_refused() {
        for bad in ["", "21-5", "24:00-05:00", "21:60-05:00", "5:00-06:00", "05:00-05:00", "a:bb-c:dd"] {
            assert!(bad.parse::<QuietHours>().is_err(), "{bad}");
        }
    }
}
