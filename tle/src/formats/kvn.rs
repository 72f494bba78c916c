//! OMM as `KEY = value` lines. A line with CCSDS_OMM_VERS begins a message.

use super::omm::Fields;
use super::{Found, SetError, SetFault, excerpt, numbered_lines};

pub(super) struct Reader<'a> {
    lines: Box<dyn Iterator<Item = (usize, &'a str)> + Send + 'a>,
    /// The message being collected.
    fields: Option<Fields>,
    /// The first line of it that is no field: the message is read to its end all the same, so that the next one is found.
    broken: Option<(usize, String)>,
}

impl std::fmt::Debug for Reader<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reader").field("fields", &self.fields).field("broken", &self.broken).finish()
    }
}

impl<'a> Reader<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { lines: Box::new(numbered_lines(text)), fields: None, broken: None }
    }

    /// The message collected so far, if there is any.
    fn finish(&mut self, next: Option<Fields>) -> Option<Result<Found, SetError>> {
        let fields = std::mem::replace(&mut self.fields, next)?;
        let broken = self.broken.take();
        match broken {
            Some((line, said)) => Some(Err(fields.error(line, SetFault::Syntax { form: "KVN", said }))),
            // A header without anything after it is no set.
            None if fields.is_empty() => None,
            None => Some(fields.assemble()),
        }
    }
}

impl Iterator for Reader<'_> {
    type Item = Result<Found, SetError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let Some((number, line)) = self.lines.next() else {
                return self.finish(None);
            };
            let line = line.trim_start();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            if let Some(comment) = line.strip_prefix("COMMENT")
                && (comment.is_empty() || comment.starts_with([' ', '\t']))
                && !comment.trim_start().starts_with('=')
            {
                self.fields.get_or_insert_with(|| Fields::new(number)).push("COMMENT", comment, number);
                continue;
            }
            let Some((key, value)) = line.split_once('=') else {
                self.fields.get_or_insert_with(|| Fields::new(number));
                self.broken.get_or_insert_with(|| (number, format!("'{}' is no KEY = value", excerpt(line))));
                continue;
            };
            let key = key.trim();
            if key == "CCSDS_OMM_VERS" {
                let mut fields = Fields::new(number);
                fields.push(key, value, number);
                if let Some(found) = self.finish(Some(fields)) {
                    return Some(found);
                }
                continue;
            }
            let fields = self.fields.get_or_insert_with(|| Fields::new(number));
            match key.strip_prefix("USER_DEFINED_") {
                Some(own) => fields.push(own, value, number),
                None => fields.push(key, without_unit(value), number),
            }
        }
    }
}

/// The value without a unit in brackets at its end.
fn without_unit(value: &str) -> &str {
    let value = value.trim();
    match value.strip_suffix(']').and_then(|rest| rest.rsplit_once('[')) {
        Some((number, _)) if number.trim().parse::<f64>().is_ok() => number,
        _ => value,
    }
}
