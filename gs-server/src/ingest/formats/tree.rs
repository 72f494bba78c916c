//! JSON as a tree that borrows its text from the message: what a million reports need, each for a moment.
//!
//! It takes what `serde_json::Value` takes and refuses what that refuses; of a key that stands twice the last one counts.

use std::borrow::Cow;
use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value<'a> {
    Null,
    Truth(bool),
    /// A whole number that is not below zero.
    Count(u64),
    /// A whole number below zero.
    Below(i64),
    Number(f64),
    Text(Cow<'a, str>),
    Array(Vec<Value<'a>>),
    Object(Object<'a>),
}

/// Keys and their values, in the order in which they were written.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Object<'a>(Vec<(Cow<'a, str>, Value<'a>)>);

impl<'a> Object<'a> {
    /// The object that these bytes are; `None` when they are anything else.
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        match serde_json::from_slice(body) {
            Ok(Value::Object(object)) => Some(object),
            _ => None,
        }
    }

    pub(super) fn get(&self, key: &str) -> Option<&Value<'a>> {
        self.0.iter().rev().find(|(known, _)| known == key).map(|(_, value)| value)
    }

    pub(super) fn contains_key(&self, key: &str) -> bool {
        self.get(key).is_some()
    }
}

impl Value<'_> {
    pub(super) const fn is_null(&self) -> bool {
        matches!(self, Self::Null)
    }

    pub(super) const fn as_bool(&self) -> Option<bool> {
        match self {
            Self::Truth(truth) => Some(*truth),
            _ => None,
        }
    }

    pub(super) fn as_i64(&self) -> Option<i64> {
        match self {
            Self::Count(count) => i64::try_from(*count).ok(),
            Self::Below(below) => Some(*below),
            _ => None,
        }
    }

    pub(super) const fn as_u64(&self) -> Option<u64> {
        match self {
            Self::Count(count) => Some(*count),
            _ => None,
        }
    }

    pub(super) const fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(*count as f64),
            Self::Below(below) => Some(*below as f64),
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }

    pub(super) fn as_str(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    pub(super) fn as_array(&self) -> Option<&[Self]> {
        match self {
            Self::Array(values) => Some(values),
            _ => None,
        }
    }
}

impl<'de> Deserialize<'de> for Value<'de> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(Reader)
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Value<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Value<'de>, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, truth: bool) -> Result<Value<'de>, E> {
        Ok(Value::Truth(truth))
    }

    fn visit_u64<E>(self, count: u64) -> Result<Value<'de>, E> {
        Ok(Value::Count(count))
    }

    fn visit_i64<E>(self, number: i64) -> Result<Value<'de>, E> {
        Ok(u64::try_from(number).map_or(Value::Below(number), Value::Count))
    }

    fn visit_f64<E>(self, number: f64) -> Result<Value<'de>, E> {
        Ok(Value::Number(number))
    }

    fn visit_borrowed_str<E>(self, text: &'de str) -> Result<Value<'de>, E> {
        Ok(Value::Text(Cow::Borrowed(text)))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Value<'de>, E> {
        Ok(Value::Text(Cow::Owned(text.to_owned())))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Value<'de>, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = list.next_element()? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value<'de>, A::Error> {
        let mut members = Vec::new();
        while let Some(Key(key)) = map.next_key()? {
            members.push((key, map.next_value()?));
        }
        Ok(Value::Object(Object(members)))
    }
}

/// The key of a member.
struct Key<'a>(Cow<'a, str>);

impl<'de> Deserialize<'de> for Key<'de> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_str(KeyReader)
    }
}

struct KeyReader;

impl<'de> Visitor<'de> for KeyReader {
    type Value = Key<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_borrowed_str<E>(self, text: &'de str) -> Result<Key<'de>, E> {
        Ok(Key(Cow::Borrowed(text)))
    }

    fn visit_str<E>(self, text: &str) -> Result<Key<'de>, E> {
        Ok(Key(Cow::Owned(text.to_owned())))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// As `serde_json` has it.
    fn same(ours: &Value<'_>, theirs: &serde_json::Value) -> bool {
        let numbers = ours.as_f64() == theirs.as_f64()
            && ours.as_i64() == theirs.as_i64()
            && ours.as_u64() == theirs.as_u64();
        let inside = match (ours, theirs) {
            (Value::Array(ours), serde_json::Value::Array(theirs)) => {
                ours.len() == theirs.len() && ours.iter().zip(theirs).all(|(a, b)| same(a, b))
            }
            (Value::Object(ours), serde_json::Value::Object(theirs)) => {
                ours.0.iter().all(|(key, _)| theirs.contains_key(&**key))
                    && theirs.iter().all(|(key, b)| ours.get(key).is_some_and(|a| same(a, b)))
            }
            (Value::Array(_) | Value::Object(_), _) => false,
            (_, theirs) => !theirs.is_array() && !theirs.is_object(),
        };
        let words = ours.as_str() == theirs.as_str() && ours.as_bool() == theirs.as_bool();
        numbers && words && inside && ours.is_null() == theirs.is_null()
    }

    fn both(text: &[u8]) {
        let (ours, theirs) =
            (serde_json::from_slice::<Value<'_>>(text), serde_json::from_slice::<serde_json::Value>(text));
        match (&ours, &theirs) {
            (Ok(ours), Ok(theirs)) => assert!(same(ours, theirs), "{ours:?} {theirs:?}"),
            (Err(_), Err(_)) => {}
            _ => panic!("{}: {ours:?} {theirs:?}", String::from_utf8_lossy(text)),
        }
    }

    #[test]
    fn it_takes_what_serde_json_takes_and_refuses_what_that_refuses() {
        let deep = [b"[".repeat(200), b"]".repeat(200)].concat();
        let texts: [&[u8]; 16] = [
            b"{\"a\":1,\"a\":2}",
            b"{\"\\u0061\":\"\\u00e4\\n\"}",
            b"18446744073709551615",
            b"18446744073709551616",
            b"-9223372036854775808",
            b"-0",
            b"-0.0",
            b"1e400",
            b"1e-400",
            b"{\"a\":[1,[2,{\"b\":null}],true]}",
            b"{\"a\":\"\xff\"}",
            b"{\"a\":\"\\ud800\"}",
            b"{a:1}",
            b"{\"a\":1,}",
            b"{\"a\":1} x",
            &deep,
        ];
        texts.into_iter().for_each(both);
    }

    proptest! {
        #[test]
        fn anything_may_come(text in "[\\[\\]{}:, \"\\\\a0-9.eE+-]{0,40}") {
            both(text.as_bytes());
        }
    }
}
