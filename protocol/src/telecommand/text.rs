//! Orbital elements as text.

use crate::{
    FieldValue, PayloadError, TextError,
    wire::{Reader, Walk, Wire, Writer},
};

/// Length of a TLE line, in characters.
const LINE_LEN: usize = 69;

/// Two lines of 69 printable ASCII characters: a TLE whose content this crate does not judge.
///
/// Catalogue numbers above 339999 are written 00000 by whoever makes the lines (ICD section 3).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TwoLines {
    line_1: [u8; LINE_LEN],
    line_2: [u8; LINE_LEN],
}

impl TwoLines {
    /// The two lines, without line ends.
    ///
    /// # Errors
    /// [`TextError::TleLine`] when a line has not 69 characters or one is not printable ASCII.
    pub fn new(line_1: &str, line_2: &str) -> Result<Self, TextError> {
        let line = |text: &str, line| {
            let bytes: [u8; LINE_LEN] =
                text.as_bytes().try_into().map_err(|_| TextError::TleLine { line })?;
            if bytes.iter().all(is_printable) { Ok(bytes) } else { Err(TextError::TleLine { line }) }
        };
        Ok(Self { line_1: line(line_1, 1)?, line_2: line(line_2, 2)? })
    }

    /// First line.
    #[must_use]
    pub fn line_1(&self) -> &str {
        // Both lines are ASCII by construction.
        str::from_utf8(&self.line_1).unwrap_or("")
    }

    /// Second line.
    #[must_use]
    pub fn line_2(&self) -> &str {
        str::from_utf8(&self.line_2).unwrap_or("")
    }
}

fn is_printable(byte: &u8) -> bool {
    (0x20..0x7F).contains(byte)
}

impl Wire for TwoLines {
    const LEN: usize = 2 * LINE_LEN;

    fn read(reader: &mut Reader<'_>) -> Result<Self, PayloadError> {
        let start = reader.offset();
        let lines = Self { line_1: reader.take(), line_2: reader.take() };
        match lines.line_1.iter().chain(&lines.line_2).position(|byte| !is_printable(byte)) {
            Some(at) => Err(PayloadError::Text { offset: (start + at) as u16 }),
            None => Ok(lines),
        }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.put(&self.line_1);
        writer.put(&self.line_2);
    }

    fn walk(&self, walk: &mut Walk<'_>, _: &[&'static str], _: &'static str) {
        walk.field("line_1", "", FieldValue::Bytes(&self.line_1), LINE_LEN);
        walk.field("line_2", "", FieldValue::Bytes(&self.line_2), LINE_LEN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_69_printable_ascii_characters() {
        let good = "x".repeat(69);
        assert!(TwoLines::new(&good, &good).is_ok());
        assert_eq!(TwoLines::new(&good, &good[1..]), Err(TextError::TleLine { line: 2 }));
        let umlaut = std::format!("{}ü", "x".repeat(67));
        assert_eq!(umlaut.len(), 69);
        assert_eq!(TwoLines::new(&umlaut, &good), Err(TextError::TleLine { line: 1 }));
    }
}
