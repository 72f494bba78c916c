//! TLE: which lines of a text belong together.

use super::{Checksums, Found, SetError, SetFault, card, excerpt, numbered_lines};

/// A name has at most 24 characters, or 26 with Space-Track's `0 ` before it; an element line has many more.
const NAME_MAX: usize = 26;

pub(super) struct Reader<'a> {
    lines: Box<dyn Iterator<Item = (usize, &'a str)> + Send + 'a>,
    checksums: Checksums,
    name: Option<Numbered<'a>>,
    /// Line 1 that waits for its line 2, and the name before it.
    first: Option<(Numbered<'a>, Option<Numbered<'a>>)>,
}

#[derive(Debug, Clone, Copy)]
struct Numbered<'a> {
    number: usize,
    text: &'a str,
}

impl std::fmt::Debug for Reader<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reader").field("name", &self.name).field("first", &self.first).finish()
    }
}

/// Whether a line is line 1 or line 2 of a TLE, well or badly written. A name may begin with `1 ` as well: it is short.
pub(super) fn tle_line(line: &str) -> Option<u8> {
    let text = line.trim();
    let columns = text.chars().count();
    let mut chars = text.chars();
    let which = match chars.next()? {
        '1' => 1,
        '2' => 2,
        _ => return None,
    };
    let spaced = chars.next().is_some_and(char::is_whitespace);
    // Without the blank it is line 1 or 2 with a column lost, and only by its length.
    (columns > if spaced { NAME_MAX } else { 60 }).then_some(which)
}

impl<'a> Reader<'a> {
    pub(super) fn new(text: &'a str, checksums: Checksums) -> Self {
        Self { lines: Box::new(numbered_lines(text)), checksums, name: None, first: None }
    }

    /// The error of a line 1 that found no line 2.
    fn widowed(first: (Numbered<'a>, Option<Numbered<'a>>)) -> SetError {
        let (line, name) = first;
        let object = name.map(|name| object_name(name.text)).or_else(|| number_of(line.text));
        SetError { line: line.number, object, fault: SetFault::LineMissing { wanted: 2 } }
    }

    fn nameless(name: Numbered<'a>) -> SetError {
        SetError { line: name.number, object: None, fault: SetFault::NameAlone { text: excerpt(name.text) } }
    }

    fn read_pair(
        &self,
        first: Numbered<'a>,
        second: Numbered<'a>,
        name: Option<Numbered<'a>>,
    ) -> Result<Found, SetError> {
        let pair = card::read(first.text, second.text, self.checksums);
        match pair {
            Ok((mut elements, warnings)) => {
                elements.name = name.map(|name| object_name(name.text)).filter(|name| !name.is_empty());
                let line = name.map_or(first.number, |name| name.number);
                Ok(Found { elements, line, warnings })
            }
            Err((which, fault)) => Err(SetError {
                line: if which == 1 { first.number } else { second.number },
                object: name.map(|name| object_name(name.text)).or_else(|| number_of(first.text)),
                fault,
            }),
        }
    }
}

/// The name of a name line, without Space-Track's `0 `.
fn object_name(line: &str) -> String {
    let line = line.trim();
    line.strip_prefix("0 ").unwrap_or(line).trim().to_owned()
}

/// The catalogue number of a broken line, for messages.
fn number_of(line: &str) -> Option<String> {
    let number = line.get(2..7)?.trim();
    (!number.is_empty()).then(|| format!("object {number}"))
}

impl Iterator for Reader<'_> {
    type Item = Result<Found, SetError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let Some((number, text)) = self.lines.next() else {
                return self
                    .first
                    .take()
                    .map(Self::widowed)
                    .or_else(|| self.name.take().map(Self::nameless))
                    .map(Err);
            };
            if text.trim().is_empty() || text.trim_start().starts_with('#') {
                continue;
            }
            let line = Numbered { number, text };
            match tle_line(text) {
                Some(1) => {
                    let before = self.first.replace((line, self.name.take()));
                    if let Some(before) = before {
                        return Some(Err(Self::widowed(before)));
                    }
                }
                Some(_) => {
                    let Some((first, name)) = self.first.take() else {
                        let object = self.name.take().map(|name| object_name(name.text));
                        return Some(Err(SetError {
                            line: number,
                            object: object.or_else(|| number_of(text)),
                            fault: SetFault::LineMissing { wanted: 1 },
                        }));
                    };
                    return Some(self.read_pair(first, line, name));
                }
                None => {
                    let before = self.name.replace(line);
                    if let Some(first) = self.first.take() {
                        return Some(Err(Self::widowed(first)));
                    }
                    if let Some(before) = before {
                        return Some(Err(Self::nameless(before)));
                    }
                }
            }
        }
    }
}
