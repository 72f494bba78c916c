//! What a report says, without its form. Texts are as they came; whoever writes them down escapes them.

/// A report in words.
#[derive(Debug, Clone, PartialEq)]
pub struct Document {
    /// What it is about, in one line.
    pub(super) title: String,
    /// From when, and as of when.
    pub(super) subtitle: String,
    /// Time, satellite or radio are made up; nobody may overlook it.
    pub(super) simulated: bool,
    /// In order.
    pub(super) blocks: Vec<Block>,
}

/// A part of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Block {
    Heading(&'static str),
    Paragraph(String),
    List(Vec<String>),
    /// Names and values.
    Facts(Vec<(&'static str, String)>),
    Table(Table),
    /// Drawings with the colours of the page, side by side; only pages have them.
    Plots(Vec<String>),
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    /// A column of numbers stands to the right.
    pub(super) columns: Vec<(&'static str, Side)>,
    pub(super) rows: Vec<Vec<Cell>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    Text(String),
    /// The word of an alarm level: with its shape and colour.
    Level(String),
}

impl Table {
    pub(super) fn new(columns: &[(&'static str, Side)]) -> Self {
        Self { columns: columns.to_vec(), rows: Vec::new() }
    }

    pub(super) fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.rows.push(cells.map(Cell::Text).into());
    }
}

/// The shape of an alarm level: nobody has to see colours.
pub(super) fn shape(level: &str) -> &'static str {
    match level {
        "watch" => "○",
        "warning" => "△",
        "distress" => "◇",
        "critical" => "⬠",
        "severe" => "■",
        _ => "",
    }
}

/// Whether a character may stand in a report: none that steers a terminal or turns the direction of writing.
pub(super) fn is_printable(c: char) -> bool {
    !c.is_control()
        && !matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
        && !matches!(c, '\u{fffe}' | '\u{ffff}')
}
