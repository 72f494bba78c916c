//! Where in the text a place of the plan stands: `steps[3].when.elevation_deg` to line and column.

use api::PlanFinding;
use mission::plan::Finding;
use toml::de::{DeTable, DeValue};

use super::read::Form;

/// The places of one text.
pub(super) struct Places<'t> {
    text: &'t str,
    root: Option<Node>,
}

/// A value and where it begins, in bytes.
struct Node {
    at: usize,
    inside: Inside,
}

enum Inside {
    Nothing,
    /// Name, where the name begins, value.
    Fields(Vec<(String, usize, Node)>),
    Entries(Vec<Node>),
}

impl<'t> Places<'t> {
    pub(super) fn new(text: &'t str, form: Form) -> Self {
        let root = match form {
            Form::Toml => DeTable::parse(text)
                .ok()
                .map(|table| Node { at: 0, inside: Inside::Fields(fields(table.get_ref())) }),
            Form::Json => Json { text: text.as_bytes(), at: 0 }.value(0),
        };
        Self { text, root }
    }

    /// The finding with its line and column: those of its place, or of what would hold it.
    pub(super) fn put(&self, finding: Finding) -> PlanFinding {
        let at = self.find(&finding.place);
        let (line, column) = at.map(|at| line_and_column(self.text, at)).unzip();
        PlanFinding {
            severity: finding.severity.name().to_owned(),
            place: finding.place,
            line,
            column,
            problem: finding.problem,
            remedy: finding.remedy,
        }
    }

    fn find(&self, place: &str) -> Option<usize> {
        let mut node = self.root.as_ref()?;
        let mut found = None;
        for part in place.split(['.', '[']).filter(|part| !part.is_empty()) {
            let next = match (&node.inside, part.strip_suffix(']')) {
                (Inside::Entries(entries), Some(index)) => index
                    .parse::<usize>()
                    .ok()
                    .and_then(|index| entries.get(index))
                    .map(|node| (node.at, node)),
                (Inside::Fields(fields), _) => {
                    fields.iter().find(|(name, ..)| name == part).map(|(_, at, node)| (*at, node))
                }
                _ => None,
            };
            let Some((at, next)) = next else { break };
            found = Some(at);
            node = next;
        }
        found
    }
}

fn fields(table: &DeTable<'_>) -> Vec<(String, usize, Node)> {
    table.iter().map(|(name, value)| (name.get_ref().to_string(), name.span().start, node(value))).collect()
}

fn node(value: &toml::Spanned<DeValue<'_>>) -> Node {
    let inside = match value.get_ref() {
        DeValue::Table(table) => Inside::Fields(fields(table)),
        DeValue::Array(entries) => Inside::Entries(entries.iter().map(node).collect()),
        _ => Inside::Nothing,
    };
    Node { at: value.span().start, inside }
}

/// Walks over text that is known to be JSON; gives up at anything else.
struct Json<'t> {
    text: &'t [u8],
    at: usize,
}

/// As deep as serde_json goes.
const DEPTH_MAX: usize = 128;

impl Json<'_> {
    fn value(&mut self, depth: usize) -> Option<Node> {
        self.blanks();
        let at = self.at;
        let inside = match self.text.get(at)? {
            _ if depth > DEPTH_MAX => return None,
            b'{' => {
                self.at += 1;
                let mut fields = Vec::new();
                while !self.ends(b'}')? {
                    let name_at = self.at;
                    let name = self.string()?;
                    self.blanks();
                    self.take(b':')?;
                    fields.push((name, name_at, self.value(depth + 1)?));
                }
                Inside::Fields(fields)
            }
            b'[' => {
                self.at += 1;
                let mut entries = Vec::new();
                while !self.ends(b']')? {
                    entries.push(self.value(depth + 1)?);
                }
                Inside::Entries(entries)
            }
            b'"' => {
                self.string()?;
                Inside::Nothing
            }
            _ => {
                let rest = &self.text[at..];
                self.at += rest.iter().position(|b| b",]} \t\r\n".contains(b)).unwrap_or(rest.len());
                Inside::Nothing
            }
        };
        Some(Node { at, inside })
    }

    /// Past a comma and blanks; whether the list ends here.
    fn ends(&mut self, close: u8) -> Option<bool> {
        self.blanks();
        if self.text.get(self.at) == Some(&b',') {
            self.at += 1;
            self.blanks();
        }
        let ends = *self.text.get(self.at)? == close;
        if ends {
            self.at += 1;
        }
        Some(ends)
    }

    fn string(&mut self) -> Option<String> {
        let from = self.at;
        self.take(b'"')?;
        while *self.text.get(self.at)? != b'"' {
            self.at += if self.text[self.at] == b'\\' { 2 } else { 1 };
        }
        self.at += 1;
        serde_json::from_slice(self.text.get(from..self.at)?).ok()
    }

    fn take(&mut self, byte: u8) -> Option<()> {
        (*self.text.get(self.at)? == byte).then(|| self.at += 1)
    }

    fn blanks(&mut self) {
        while self.text.get(self.at).is_some_and(|b| b" \t\r\n".contains(b)) {
            self.at += 1;
        }
    }
}

/// Line and column, both from 1, of a byte.
pub(super) fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..byte.min(text.len())];
    let line = before.iter().filter(|b| **b == b'\n').count() + 1;
    let begin = before.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
    // Not the bytes that go on with a character.
    let column = before[begin..].iter().filter(|b| **b & 0xC0 != 0x80).count() + 1;
    (line, column)
}
