//! Values out of objects that strangers wrote: what is of another type than it should be is dropped, and that is noted.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;
use mission::UtcUs;
use mission::reception::{Doubt, Doubts};

use super::tree::{Object, Value};

/// One object and what was found wrong with it.
pub(super) struct Fields<'a> {
    pub(super) object: &'a Object<'a>,
    pub(super) doubts: Doubts,
}

impl<'a> Fields<'a> {
    pub(super) const fn of(object: &'a Object<'a>, doubts: Doubts) -> Self {
        Self { object, doubts }
    }

    fn take<T>(&mut self, key: &str, read: impl Fn(&'a Value<'a>) -> Option<T>) -> Option<T> {
        let value = self.object.get(key).filter(|value| !value.is_null())?;
        let read = read(value);
        if read.is_none() {
            self.doubts.add(Doubt::WrongType);
        }
        read
    }

    /// A number.
    pub(super) fn number(&mut self, key: &str) -> Option<f64> {
        self.take(key, Value::as_f64)
    }

    /// A whole number, exact to 64 bits: never by way of a float.
    pub(super) fn whole(&mut self, key: &str) -> Option<i64> {
        self.take(key, Value::as_i64)
    }

    /// A small whole number.
    pub(super) fn small(&mut self, key: &str) -> Option<u8> {
        self.take(key, |value| value.as_u64().map(|value| u8::try_from(value).unwrap_or(u8::MAX)))
    }

    /// A catalogue number.
    pub(super) fn catalogue(&mut self, key: &str) -> Option<u32> {
        self.take(key, |value| u32::try_from(value.as_u64()?).ok())
    }

    /// Text.
    pub(super) fn text(&mut self, key: &str) -> Option<&'a str> {
        self.take(key, Value::as_str)
    }

    /// Yes or no.
    pub(super) fn truth(&mut self, key: &str) -> Option<bool> {
        self.take(key, Value::as_bool)
    }

    /// A pair of numbers, or an object with `lat` and `lng`.
    pub(super) fn place(&mut self, key: &str) -> Option<(f64, f64)> {
        self.take(key, |value| match value {
            Value::Array(pair) => Some((pair.first()?.as_f64()?, pair.get(1)?.as_f64()?)),
            Value::Object(object) => Some((object.get("lat")?.as_f64()?, object.get("lng")?.as_f64()?)),
            _ => None,
        })
    }
}

/// A time as text: RFC 3339, or date and time without a zone, which is UTC then. Between the years 1970 and 2262.
pub(super) fn stamp(text: &str) -> Option<UtcUs> {
    let text = text.trim();
    let parsed = text
        .parse::<Timestamp>()
        .ok()
        .or_else(|| Some(text.parse::<DateTime>().ok()?.to_zoned(TimeZone::UTC).ok()?.timestamp()))?;
    // A bare date is no time of a reception.
    (text.len() > 10).then(|| UtcUs(parsed.as_microsecond()))
}

/// Megahertz as hertz: 32-bit floats printed in decimal, so what is finer than 100 Hz is noise.
pub(super) fn hz_of_mhz(mhz: f64) -> f64 {
    (mhz * 1e4).round() * 100.0
}
