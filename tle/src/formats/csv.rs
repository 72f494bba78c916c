//! OMM as CSV: a header with the keys, one set a line. Columns are found by their names.

use super::omm::Fields;
use super::{Found, SetError, SetFault, SourceError, excerpt, numbered_lines};

pub(super) struct Reader<'a> {
    lines: Box<dyn Iterator<Item = (usize, &'a str)> + Send + 'a>,
    header: Vec<String>,
}

impl std::fmt::Debug for Reader<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reader").field("header", &self.header).finish()
    }
}

impl<'a> Reader<'a> {
    pub(super) fn new(text: &'a str) -> Result<Self, SourceError> {
        let mut lines = numbered_lines(text)
            .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
        let (_, first) = lines.next().ok_or(SourceError::Empty)?;
        let header = cells(first).ok_or_else(|| SourceError::NotElements { begins: excerpt(first) })?;
        let header = header.iter().map(|key| key.trim().to_owned()).collect();
        Ok(Self { lines: Box::new(lines), header })
    }
}

impl Iterator for Reader<'_> {
    type Item = Result<Found, SetError>;

    fn next(&mut self) -> Option<Self::Item> {
        let (number, line) = self.lines.next()?;
        let mut fields = Fields::new(number);
        let Some(row) = cells(line) else {
            let said = "a quotation mark is not closed".to_owned();
            return Some(Err(fields.error(number, SetFault::Syntax { form: "CSV", said })));
        };
        for (key, value) in self.header.iter().zip(&row) {
            fields.push(key, value, number);
        }
        if row.len() != self.header.len() {
            let said = format!("{} values for {} columns", row.len(), self.header.len());
            return Some(Err(fields.error(number, SetFault::Syntax { form: "CSV", said })));
        }
        Some(fields.assemble())
    }
}

/// The cells of a line (RFC 4180, one record a line); `None` when a quotation mark is not closed.
fn cells(line: &str) -> Option<Vec<String>> {
    let mut cells = Vec::new();
    let mut rest = line;
    loop {
        let (cell, after) = match rest.trim_start_matches(' ').strip_prefix('"') {
            Some(quoted) => quoted_cell(quoted)?,
            None => match rest.split_once(',') {
                Some((cell, after)) => (cell.to_owned(), Some(after)),
                None => (rest.to_owned(), None),
            },
        };
        cells.push(cell);
        match after {
            Some(after) => rest = after,
            None => return Some(cells),
        }
    }
}

/// The rest of a quoted cell, in which two quotation marks stand for one, and what follows its comma.
fn quoted_cell(mut text: &str) -> Option<(String, Option<&str>)> {
    let mut cell = String::new();
    loop {
        let (part, after) = text.split_once('"')?;
        cell.push_str(part);
        if let Some(more) = after.strip_prefix('"') {
            cell.push('"');
            text = more;
            continue;
        }
        let after = after.trim_start_matches(' ');
        return match after.strip_prefix(',') {
            Some(next) => Some((cell, Some(next))),
            None => after.is_empty().then_some((cell, None)),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_cut_at_commas_outside_quotation_marks() {
        let cut = |line| cells(line).map(|row| row.join("|"));
        assert_eq!(cut("a,b,,c").as_deref(), Some("a|b||c"));
        assert_eq!(cut(r#""a,b", "say ""x""",c,"#).as_deref(), Some(r#"a,b|say "x"|c|"#));
        assert_eq!(cut(r#"a,"b"#), None);
        assert_eq!(cut(r#""a"b,c"#), None);
        assert_eq!(cut("").as_deref(), Some(""));
    }
}
