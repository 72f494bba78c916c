//! How values and levels of the wire are read.

use jiff::{SignedDuration, Timestamp};
use ui::Level;
use ui::format::{self, Quantity};

use super::history::at;

/// The level of a word of the wire; `None` for `normal` and for words that nobody knows.
pub(super) fn level(word: &str) -> Option<Level> {
    Level::ALL.into_iter().find(|level| level.word() == word)
}

/// A value of a parameter as a person reads it. `None` is invalid: the satellite sent no number.
pub(super) fn quantity(parameter: &str, unit: &str, value: Option<f64>) -> Quantity {
    let Some(value) = value else { return Quantity::new("invalid", "") };
    let name = parameter.rsplit('.').next().unwrap_or(parameter);
    match (unit, name) {
        ("ms", "timestamp") if value == 0.0 => Quantity::new("no clock", ""),
        ("ms", "timestamp") => Quantity::new(format::utc(at((value * 1000.0) as i64)), ""),
        ("ms", _) => Quantity::new(format::length(SignedDuration::from_millis(value as i64)), ""),
        _ => Quantity::new(format::number(value, decimals(value)), unit),
    }
}

/// So many decimals that five figures tell it, none for whole numbers.
pub(super) fn decimals(value: f64) -> usize {
    if !value.is_finite() || value == 0.0 || value.fract() == 0.0 && value.abs() < 1e15 {
        return 0;
    }
    (4.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize
}

/// How old something is, as of the server's now.
pub(super) fn age(at_us: i64, now_us: i64) -> String {
    format::age(SignedDuration::from_micros(now_us.saturating_sub(at_us)))
}

/// A time of the server.
pub(super) fn time(at: api::Time) -> Timestamp {
    self::at(at.unix_us())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_by_their_unit_and_what_is_no_number_says_so() {
        let read = |parameter: &str, unit: &str, value| quantity(parameter, unit, value).to_string();
        assert_eq!(read("heartbeat.temp", "°C", Some(21.456_789)), "21.457 °C");
        assert_eq!(read("heartbeat.temp", "°C", None), "invalid");
        assert_eq!(read("heartbeat.uptime", "ms", Some(3_723_000.0)), "1:02:03");
        assert_eq!(read("heartbeat.timestamp", "ms", Some(0.0)), "no clock");
        assert_eq!(read("heartbeat.timestamp", "ms", Some(1.0e12)), "2001-09-09T01:46:40Z");
        assert_eq!(read("heartbeat.mag.x", "T", Some(3.214e-5)), "0.000032140 T");
        assert_eq!(read("heartbeat.cam", "", Some(1.0)), "1");
    }

    #[test]
    fn normal_is_no_level() {
        assert_eq!((level("critical"), level("normal"), level("?")), (Some(Level::Critical), None, None));
    }
}
