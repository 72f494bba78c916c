//! OMM as JSON: an array of flat objects, or objects one after the other.
//!
//! The text is cut into objects first, and each is parsed by itself: a broken or cut-off object does not take the others
//! with it. Numbers are read from their text, so that none loses its last bit on the way through another parser.

use super::omm::Fields;
use super::{Found, SetError, SetFault};
use serde_json::value::RawValue;

#[derive(Debug)]
pub(super) struct Reader<'a> {
    text: &'a str,
    /// Where to look for the next object.
    position: usize,
    /// The line on which `position` stands.
    line: usize,
}

impl<'a> Reader<'a> {
    pub(super) const fn new(text: &'a str) -> Self {
        Self { text, position: 0, line: 1 }
    }

    fn advance(&mut self, to: usize) {
        let passed = self.text.as_bytes().get(self.position..to).unwrap_or_default();
        self.line += passed.iter().filter(|&&byte| byte == b'\n').count();
        self.position = to;
    }
}

impl Iterator for Reader<'_> {
    type Item = Result<Found, SetError>;

    fn next(&mut self) -> Option<Self::Item> {
        let start = self.position + self.text.get(self.position..)?.find('{')?;
        self.advance(start);
        let line = self.line;
        let end = object_end(self.text.as_bytes(), start);
        self.advance(end);
        let mut fields = Fields::new(line);
        let object = self.text.get(start..end)?;
        match serde_json::from_str::<Object<'_>>(object) {
            Ok(Object(pairs)) => {
                for (key, value) in pairs {
                    if let Some(value) = scalar(value.get()) {
                        fields.push(&key, &value, line);
                    }
                }
                Some(fields.assemble())
            }
            Err(error) => {
                // Its own line counts from the beginning of the object.
                let at = line + error.line().saturating_sub(1);
                let said = error.to_string();
                let said = said.split(" at line ").next().unwrap_or_default().to_owned();
                Some(Err(fields.error(at, SetFault::Syntax { form: "JSON", said })))
            }
        }
    }
}

/// Where the object that begins at `start` ends (exclusive): after its brace, or, in a broken one, where the next begins.
fn object_end(text: &[u8], start: usize) -> usize {
    let mut quoted = false;
    let mut escaped = false;
    for (index, &byte) in text.iter().enumerate().skip(start + 1) {
        match byte {
            _ if escaped => escaped = false,
            b'\\' if quoted => escaped = true,
            // No string goes over the end of a line: this one lost its quotation mark.
            b'"' | b'\n' if quoted => quoted = false,
            b'"' => quoted = true,
            b'}' if !quoted => return index + 1,
            // The objects of OMM are flat: another one begins because this one was cut off.
            b'{' if !quoted => return index,
            _ => {}
        }
    }
    text.len()
}

/// The text of a number, string, true or false; nothing for null, arrays and objects.
fn scalar(raw: &str) -> Option<String> {
    match raw.as_bytes().first()? {
        b'"' => serde_json::from_str(raw).ok(),
        b'[' | b'{' => None,
        _ => (raw != "null").then(|| raw.to_owned()),
    }
}

/// Keys and values of an object in the order of the text, keys twice included.
struct Object<'a>(Vec<(String, &'a RawValue)>);

impl<'de> serde::Deserialize<'de> for Object<'de> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;
        impl<'de> serde::de::Visitor<'de> for Pairs {
            type Value = Object<'de>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object with the keys of an OMM")
            }

            fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<Object<'de>, A::Error> {
                let mut pairs = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    pairs.push(pair);
                }
                Ok(Object(pairs))
            }
        }
        deserializer.deserialize_map(Pairs)
    }
}
