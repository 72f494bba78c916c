//! Instants in UTC, and how far the Earth has turned at them.

use std::fmt;
use std::str::FromStr;

/// Microseconds in a minute.
const MINUTE_US: f64 = 60e6;
/// Microseconds in a day of 86,400 s.
pub(crate) const DAY_US: i64 = 86_400_000_000;
/// 2000-01-01T12:00:00 as microseconds since 1970: the epoch J2000, taken on the UTC or UT1 scale.
const J2000_US: i64 = 946_728_000_000_000;
/// The first and the last instant this crate works with: 1900-01-01 and 2200-01-01.
const EARLIEST_US: i64 = -2_208_988_800_000_000;
const LATEST_US: i64 = 7_258_118_400_000_000;

/// An instant in UTC as microseconds since 1970-01-01T00:00:00, leap seconds not counted (as POSIX does).
///
/// One count is 8 mm of a low satellite's way. The eight decimals of a TLE's day (864 us) and the six of an OMM's
/// second are held exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct UtcInstant(i64);

impl UtcInstant {
    /// 1900-01-01: nothing this crate reads is older.
    pub const EARLIEST: Self = Self(EARLIEST_US);
    /// 2200-01-01: nothing this crate reads is younger.
    pub const LATEST: Self = Self(LATEST_US);

    /// From microseconds since 1970-01-01T00:00:00 UTC.
    #[must_use]
    pub const fn from_unix_us(unix_us: i64) -> Self {
        Self(unix_us)
    }

    /// Microseconds since 1970-01-01T00:00:00 UTC.
    #[must_use]
    pub const fn unix_us(self) -> i64 {
        self.0
    }

    /// This many seconds later (earlier when negative), rounded to a microsecond.
    #[must_use]
    pub fn plus_seconds(self, seconds: f64) -> Self {
        Self(self.0.saturating_add((seconds * 1e6).round() as i64))
    }

    /// This many microseconds later (earlier when negative).
    #[must_use]
    pub const fn plus_us(self, us: i64) -> Self {
        Self(self.0.saturating_add(us))
    }

    /// Microseconds from `earlier` to this instant.
    #[must_use]
    pub const fn us_since(self, earlier: Self) -> i64 {
        self.0.saturating_sub(earlier.0)
    }

    /// Seconds from `earlier` to this instant.
    #[must_use]
    pub fn seconds_since(self, earlier: Self) -> f64 {
        self.us_since(earlier) as f64 / 1e6
    }

    /// Minutes from `earlier` to this instant: SGP4's measure of time.
    #[must_use]
    pub fn minutes_since(self, earlier: Self) -> f64 {
        self.us_since(earlier) as f64 / MINUTE_US
    }

    /// Whole days since J2000 (2000-01-01T12:00 on the scale of this instant), and the rest as a fraction of a day
    /// in 0..1. Kept apart, because one f64 of a Julian date resolves only 40 us.
    #[must_use]
    pub fn days_since_j2000(self) -> (f64, f64) {
        let us = self.0.saturating_sub(J2000_US);
        (us.div_euclid(DAY_US) as f64, us.rem_euclid(DAY_US) as f64 / DAY_US as f64)
    }
}

/// How UT1, the time that the Earth's rotation shows, differs from UTC.
///
/// The IERS publishes it daily; 0.43 s of it moves a station at the equator by 200 m. The default is 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EarthOrientation {
    ut1_minus_utc_s: f64,
}

impl EarthOrientation {
    /// UT1 taken as UTC.
    pub const UT1_IS_UTC: Self = Self { ut1_minus_utc_s: 0.0 };

    /// From UT1-UTC in seconds (the IERS calls it DUT1 or UT1-UTC).
    ///
    /// # Errors
    /// UTC is kept within 0.9 s of UT1: a value outside that, or no number, is refused.
    pub fn new(ut1_minus_utc_s: f64) -> Result<Self, Ut1Error> {
        if ut1_minus_utc_s.abs() < 0.9 {
            Ok(Self { ut1_minus_utc_s })
        } else {
            Err(Ut1Error { found_s: ut1_minus_utc_s })
        }
    }

    /// UT1-UTC in seconds.
    #[must_use]
    pub const fn ut1_minus_utc_s(self) -> f64 {
        self.ut1_minus_utc_s
    }
}

/// UT1-UTC outside what UTC's leap seconds allow.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "UT1-UTC is {found_s} s, and UTC is kept within 0.9 s of UT1: give the IERS value in seconds, for example -0.043"
)]
pub struct Ut1Error {
    /// The value given, in seconds.
    pub found_s: f64,
}

/// Text that is no instant in UTC.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{found}' is no instant in UTC: write 2026-11-22T05:19:25.123456Z or, with the day of the year, 2026-326T05:19:25Z"
)]
pub struct InstantError {
    /// The text, cut short if it is long.
    pub found: String,
}

impl FromStr for UtcInstant {
    type Err = InstantError;

    /// Reads `YYYY-MM-DDThh:mm:ss` or `YYYY-DDDThh:mm:ss`, with or without a fraction (rounded to a microsecond) and with
    /// or without Z: UTC in any case. Other offsets are refused.
    fn from_str(text: &str) -> Result<Self, InstantError> {
        read_instant(text.trim())
            .filter(|instant| (Self::EARLIEST..Self::LATEST).contains(instant))
            .ok_or_else(|| InstantError { found: text.chars().take(40).collect() })
    }
}

fn read_instant(text: &str) -> Option<UtcInstant> {
    let text = text.strip_suffix('Z').unwrap_or(text);
    let (date, clock) = text.split_once('T')?;
    let mut parts = date.split('-');
    let year = digits(parts.next()?, 4)?;
    let days = match (parts.next()?, parts.next(), parts.next()) {
        (day_of_year, None, None) => {
            let day = digits(day_of_year, 3)?;
            (1..=days_in_year(year)).contains(&day).then(|| days_from_civil(year, 1, 1) + day - 1)?
        }
        (month, Some(day), None) => {
            let date = (year, digits(month, 2)?, digits(day, 2)?);
            let days = days_from_civil(date.0, date.1, date.2);
            // 31 November and month 13 come back as another date.
            (civil_from_days(days) == date).then_some(days)?
        }
        _ => return None,
    };
    let mut parts = clock.split(':');
    let (hour, minute) = (digits(parts.next()?, 2)?, digits(parts.next()?, 2)?);
    let (second, fraction) = parts.next()?.split_once('.').map_or_else(
        || (clock.rsplit(':').next().unwrap_or_default(), ""),
        |(second, fraction)| (second, fraction),
    );
    let second = digits(second, 2)?;
    // 60 is a leap second: on this scale it is the first of the next minute.
    if parts.next().is_some() || hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    let us = decimals_as_parts(fraction, 1_000_000)?;
    Some(UtcInstant(days * DAY_US + ((hour * 60 + minute) * 60 + second) * 1_000_000 + us))
}

/// Exactly `count` digits as a number.
fn digits(text: &str, count: usize) -> Option<i64> {
    (text.len() == count && text.bytes().all(|byte| byte.is_ascii_digit())).then(|| text.parse().ok())?
}

/// Digits after a decimal point as a count of `parts` in one, rounded to the nearest. No digits are 0.
pub(crate) fn decimals_as_parts(digits: &str, parts: i64) -> Option<i64> {
    if !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    // 18 digits are more than anybody publishes and all that i64 holds.
    let digits = digits.get(..18).unwrap_or(digits);
    if digits.is_empty() {
        return Some(0);
    }
    let scale = 10_i128.pow(u32::try_from(digits.len()).ok()?);
    let value = i128::from(digits.parse::<i64>().ok()?) * i128::from(parts);
    i64::try_from((value + scale / 2).div_euclid(scale)).ok()
}

/// 365 or 366.
pub(crate) const fn days_in_year(year: i64) -> i64 {
    days_from_civil(year + 1, 1, 1) - days_from_civil(year, 1, 1)
}

impl fmt::Display for UtcInstant {
    /// RFC 3339 with microseconds and Z.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = civil_from_days(self.0.div_euclid(DAY_US));
        let us = self.0.rem_euclid(DAY_US);
        let (hour, minute) = (us / 3_600_000_000, us / 60_000_000 % 60);
        let (second, fraction) = (us / 1_000_000 % 60, us % 1_000_000);
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{fraction:06}Z")
    }
}

/// Days since 1970-01-01 of a day of the Gregorian calendar (month 1-12, day 1-31).
///
/// Howard Hinnant's `days_from_civil`, <https://howardhinnant.github.io/date_algorithms.html>.
pub(crate) const fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let shifted = if month <= 2 { year - 1 } else { year };
    let era = shifted.div_euclid(400);
    let year_of_era = shifted - era * 400;
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    era * 146_097 + day_of_era - 719_468
}

/// Year, month and day of a count of days since 1970-01-01: the inverse of [`days_from_civil`].
pub(crate) const fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let day_of_era = z - era * 146_097;
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let mp = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * mp + 2) / 5 + 1;
    let month = if mp < 10 { mp + 3 } else { mp - 9 };
    let year = year_of_era + era * 400;
    (if month <= 2 { year + 1 } else { year }, month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_and_dates_agree() {
        for (date, days) in
            [((1970, 1, 1), 0), ((2000, 3, 1), 11_017), ((1900, 1, 1), -25_567), ((2200, 1, 1), 84_006)]
        {
            assert_eq!(days_from_civil(date.0, date.1, date.2), days);
            assert_eq!(civil_from_days(days), date);
        }
        assert_eq!(days_from_civil(1900, 1, 1) * DAY_US, EARLIEST_US);
        assert_eq!(days_from_civil(2200, 1, 1) * DAY_US, LATEST_US);
    }

    #[test]
    fn instant_is_written_as_rfc_3339() {
        assert_eq!(UtcInstant::from_unix_us(-1).to_string(), "1969-12-31T23:59:59.999999Z");
        assert_eq!(UtcInstant::from_unix_us(J2000_US).to_string(), "2000-01-01T12:00:00.000000Z");
    }

    #[test]
    fn instants_are_read_in_both_forms_of_ccsds() {
        let read = |text: &str| text.parse::<UtcInstant>().map(|instant| instant.to_string());
        assert_eq!(read("2020-05-27T18:57:31.456608").unwrap(), "2020-05-27T18:57:31.456608Z");
        assert_eq!(read("2020-148T18:57:31.456608Z").unwrap(), "2020-05-27T18:57:31.456608Z");
        assert_eq!(read("2024-366T00:00:00").unwrap(), "2024-12-31T00:00:00.000000Z");
        assert_eq!(read("2016-12-31T23:59:60Z").unwrap(), "2017-01-01T00:00:00.000000Z");
        assert_eq!(read("2020-01-01T00:00:00.1234565").unwrap(), "2020-01-01T00:00:00.123457Z");
        for wrong in [
            "",
            "2020-05-27",
            "2020-13-01T00:00:00",
            "2020-02-30T00:00:00",
            "2023-366T00:00:00",
            "2020-000T00:00:00",
            "2020-05-27T24:00:00",
            "2020-05-27T00:00",
            "2020-05-27T00:00:00+02:00",
            "2020-05-27T00:00:00.1e3",
            "1850-01-01T00:00:00",
            "9999-12-31T00:00:00",
            "2020-05-27T+1:00:00",
            "T",
            "--T::",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn ut1_far_from_utc_is_refused() {
        assert!(EarthOrientation::new(-0.043).is_ok());
        assert!(EarthOrientation::new(0.9).is_err());
        assert!(EarthOrientation::new(f64::NAN).is_err());
    }
}
