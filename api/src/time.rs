//! The form of a time on the wire.

use std::fmt;
use std::str::FromStr;

use jiff::Timestamp;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// An instant in UTC. On the wire `2026-11-22T05:19:25.123Z`: RFC 3339, always `Z`, always three decimals (what is
/// finer is cut). Read from any offset and precision.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Time(Timestamp);

impl Time {
    /// From microseconds since 1970-01-01T00:00:00Z; what lies outside the years -9999 to 9999 is brought to their end.
    #[must_use]
    pub fn from_unix_us(us: i64) -> Self {
        Self(Timestamp::from_microsecond(us).unwrap_or(if us < 0 { Timestamp::MIN } else { Timestamp::MAX }))
    }

    /// Microseconds since 1970-01-01T00:00:00Z.
    #[must_use]
    pub fn unix_us(self) -> i64 {
        self.0.as_microsecond()
    }
}

/// Text that is no time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeError(String);

impl TimeError {
    pub(crate) fn of(text: &str) -> Self {
        Self(text.chars().take(40).collect())
    }
}

impl fmt::Display for TimeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}' is no time: write it as RFC 3339, e.g. 2026-11-22T05:19:25.123Z", self.0)
    }
}

impl std::error::Error for TimeError {}

impl FromStr for Time {
    type Err = TimeError;

    fn from_str(text: &str) -> Result<Self, TimeError> {
        text.parse().map(Self).map_err(|_| TimeError::of(text))
    }
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3}", self.0)
    }
}

impl Serialize for Time {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(feature = "openapi")]
impl utoipa::PartialSchema for Time {
    fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::Schema> {
        crate::openapi::time(
            "An instant in UTC with milliseconds; read from any offset and precision.",
            "2026-11-22T05:19:25.123Z",
        )
    }
}

#[cfg(feature = "openapi")]
impl utoipa::ToSchema for Time {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_three_decimals_and_z() {
        assert_eq!(Time::from_unix_us(0).to_string(), "1970-01-01T00:00:00.000Z");
        assert_eq!(Time::from_unix_us(1_795_324_765_123_999).to_string(), "2026-11-22T05:19:25.123Z");
    }

    #[test]
    fn any_offset_is_read_and_nonsense_is_told() {
        let time: Time = "2026-11-22T06:19:25.5+01:00".parse().unwrap();
        assert_eq!(time.to_string(), "2026-11-22T05:19:25.500Z");
        let error = "yesterday".parse::<Time>().unwrap_err();
        assert!(error.to_string().contains("RFC 3339"));
    }

    #[test]
    fn what_lies_outside_the_calendar_is_brought_to_its_end() {
        assert!(Time::from_unix_us(i64::MAX).to_string().starts_with("9999-"));
        assert!(Time::from_unix_us(i64::MIN).to_string().starts_with("-009999-"));
    }
}
