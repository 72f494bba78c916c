//! Rust source taken apart into code and string literals; comments fall away.
//!
//! Not a parser: it knows strings (raw, byte and C strings too), characters, lifetimes and nested comments, which is
//! what a check needs in order not to find SQL in a comment or a path in a message.

/// A Rust source file without its comments.
#[derive(Debug, Default)]
pub(crate) struct Source {
    /// The code, with comments and the contents of literals blanked out; lines stay where they are.
    pub(crate) code: String,
    /// Each string literal with the line it begins on (from 1) and its text as written.
    pub(crate) literals: Vec<(usize, String)>,
}

impl Source {
    pub(crate) fn read(text: &str) -> Self {
        let mut reader = Reader { chars: text.chars().collect(), at: 0, line: 1, source: Self::default() };
        while reader.at < reader.chars.len() {
            reader.step();
        }
        reader.source
    }

    /// Each line of code with its number, from 1.
    pub(crate) fn lines(&self) -> impl Iterator<Item = (usize, &str)> {
        self.code.lines().enumerate().map(|(index, line)| (index + 1, line))
    }
}

struct Reader {
    chars: Vec<char>,
    at: usize,
    line: usize,
    source: Source,
}

impl Reader {
    fn peek(&self, ahead: usize) -> Option<char> {
        self.chars.get(self.at + ahead).copied()
    }

    /// Takes one character and keeps it as code.
    fn keep(&mut self) {
        let Some(c) = self.peek(0) else { return };
        self.source.code.push(c);
        self.pass(c);
    }

    /// Takes one character and leaves a blank, or the line break, in its place.
    fn blank(&mut self) {
        let Some(c) = self.peek(0) else { return };
        self.source.code.push(if c == '\n' { '\n' } else { ' ' });
        self.pass(c);
    }

    fn pass(&mut self, c: char) {
        self.at += 1;
        if c == '\n' {
            self.line += 1;
        }
    }

    fn step(&mut self) {
        match (self.peek(0), self.peek(1)) {
            (Some('/'), Some('/')) => {
                while self.peek(0).is_some_and(|c| c != '\n') {
                    self.blank();
                }
            }
            (Some('/'), Some('*')) => self.block_comment(),
            (Some('"'), _) => self.string(None),
            (Some('r'), Some('"' | '#')) if !self.inside_a_word() => match self.raw_hashes() {
                Some(hashes) => self.string(Some(hashes)),
                None => self.keep(),
            },
            (Some('\''), Some('\\')) => self.escaped_character(),
            (Some('\''), _) if self.peek(2) == Some('\'') => (0..3).for_each(|_| self.blank()),
            _ => self.keep(),
        }
    }

    /// True for the `r` of `car"`; the prefixes of byte and C strings are no word.
    fn inside_a_word(&self) -> bool {
        let before = |back: usize| self.at.checked_sub(back).and_then(|at| self.chars.get(at)).copied();
        let is_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
        match before(1) {
            Some('b' | 'c') => is_word(before(2)),
            other => is_word(other),
        }
    }

    /// The number of `#` of a raw string that begins here, or `None` for a raw identifier.
    fn raw_hashes(&self) -> Option<usize> {
        let hashes = self.chars[self.at + 1..].iter().take_while(|c| **c == '#').count();
        (self.peek(1 + hashes) == Some('"')).then_some(hashes)
    }

    fn block_comment(&mut self) {
        let mut depth = 0_usize;
        while let Some(c) = self.peek(0) {
            let next = self.peek(1);
            if c == '/' && next == Some('*') {
                depth += 1;
                self.blank();
            } else if c == '*' && next == Some('/') {
                depth -= 1;
                self.blank();
            }
            self.blank();
            if depth == 0 {
                return;
            }
        }
    }

    /// A string from its opening quote (or `r`) to its closing one; `hashes` is `Some` for raw strings.
    fn string(&mut self, hashes: Option<usize>) {
        let line = self.line;
        let mut text = String::new();
        (0..hashes.map_or(1, |hashes| hashes + 2)).for_each(|_| self.blank());
        while let Some(c) = self.peek(0) {
            if c == '"' && self.closing_hashes() >= hashes.unwrap_or(0) {
                (0..=hashes.unwrap_or(0)).for_each(|_| self.blank());
                break;
            }
            if c == '\\' && hashes.is_none() {
                text.push(c);
                self.blank();
            }
            text.extend(self.peek(0));
            self.blank();
        }
        self.source.literals.push((line, text));
    }

    fn closing_hashes(&self) -> usize {
        self.chars[self.at + 1..].iter().take_while(|c| **c == '#').count()
    }

    fn escaped_character(&mut self) {
        (0..3).for_each(|_| self.blank());
        while self.peek(0).is_some_and(|c| c != '\'' && c != '\n') {
            self.blank();
        }
        self.blank();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn literals(text: &str) -> Vec<String> {
        Source::read(text).literals.into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn comments_are_not_code_and_hold_no_literals() {
        let source = Source::read("a // \"x\"\n/* \"y\" /* z */ */ b");
        assert!(source.literals.is_empty());
        assert_eq!(source.code.split_whitespace().collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(source.code.lines().count(), 2);
    }

    #[test]
    fn every_kind_of_string_is_a_literal() {
        assert_eq!(
            literals(r##"f("a\"b", r"c\", r#"d"e"#, b"f", br#"g"#)"##),
            [r#"a\"b"#, r"c\", "d\"e", "f", "g"]
        );
    }

    #[test]
    fn characters_and_lifetimes_open_no_string() {
        assert_eq!(literals(r#"fn f<'a>(x: &'a str) { g('"', '\'', '\u{22}', "s") }"#), ["s"]);
    }

    #[test]
    fn raw_identifiers_and_words_ending_in_r_open_no_raw_string() {
        assert_eq!(literals(r#"r#type; for"x""#), ["x"]);
    }

    #[test]
    fn literal_knows_its_line() {
        assert_eq!(
            Source::read("\n\n\"x\ny\" \"z\"").literals,
            [(3, "x\ny".to_owned()), (4, "z".to_owned())]
        );
    }

    #[test]
    fn unfinished_source_ends() {
        for text in ["\"abc", "/* abc", "'\\", "r#\"abc\"", "'"] {
            Source::read(text);
        }
    }
}
