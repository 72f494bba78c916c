//! Reading and writing elements: OMM as JSON, CSV, XML or KVN, and the legacy TLE with two or three lines.
//!
//! ```
//! use tle::formats::{self, Checksums};
//!
//! let text = "ISS (ZARYA)\n\
//!     1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
//!     2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";
//! for set in formats::sets(text, Checksums::Strict)? {
//!     match set {
//!         Ok(found) => println!("{} of {}", found.elements.label(), found.elements.epoch),
//!         Err(error) => eprintln!("{error}"), // and on with the next: one broken set never stops a file
//!     }
//! }
//! # Ok::<(), formats::SourceError>(())
//! ```
//!
//! | file | idea |
//! |---|---|
//! | `detect` | which form a text has, and when it is no elements at all but a failed download |
//! | `omm` | keys and values to elements, whatever form they came in |
//! | `json`, `csv`, `xml`, `kvn` | the forms of an OMM cut into sets of keys and values |
//! | `lines`, `card` | TLE: which lines belong together; the columns of one pair |
//! | `catalogue` | catalogue numbers, Alpha-5 included |
//! | `write`, `write_card` | the way back |
//!
//! No reader panics, whatever the text; the work is bounded by its length.

mod card;
mod catalogue;
mod csv;
mod detect;
mod fault;
mod json;
mod kvn;
mod lines;
mod omm;
mod write;
mod write_card;
mod xml;

use crate::elements::Elements;
use std::borrow::Cow;

pub use catalogue::{ALPHA5_MAX, CATALOGUE_MAX};
pub use fault::{SetError, SetFault, SourceError, Warning};
pub use write::{WriteError, write};

/// How elements are written down.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// An array of objects with the keys of an OMM.
    OmmJson,
    /// A header with the keys of an OMM, one set a line.
    OmmCsv,
    /// CCSDS navigation data message.
    OmmXml,
    /// `KEY = value` lines.
    OmmKvn,
    /// A name, line 1 and line 2.
    ThreeLine,
    /// Line 1 and line 2.
    TwoLine,
}

impl Form {
    /// All, the preferred first.
    pub const ALL: [Self; 6] =
        [Self::OmmJson, Self::OmmCsv, Self::OmmXml, Self::OmmKvn, Self::ThreeLine, Self::TwoLine];

    /// As an operator calls it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::OmmJson => "OMM JSON",
            Self::OmmCsv => "OMM CSV",
            Self::OmmXml => "OMM XML",
            Self::OmmKvn => "OMM KVN",
            Self::ThreeLine => "TLE with names",
            Self::TwoLine => "TLE",
        }
    }
}

/// What to do with a TLE whose checksum does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Checksums {
    /// Refuse the set.
    #[default]
    Strict,
    /// Use it, with a warning.
    Lenient,
}

/// A set of elements as it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The elements.
    pub elements: Elements,
    /// The line of the text on which the set begins, counted from 1.
    pub line: usize,
    /// What was odd but understood.
    pub warnings: Vec<Warning>,
}

/// The sets of a text, one after the other; see [`sets`].
#[derive(Debug)]
pub struct Sets<'a> {
    form: Form,
    reader: Reader<'a>,
}

#[derive(Debug)]
enum Reader<'a> {
    Json(json::Reader<'a>),
    Csv(csv::Reader<'a>),
    Xml(xml::Reader<'a>),
    Kvn(kvn::Reader<'a>),
    Lines(lines::Reader<'a>),
}

/// Recognises the form of a text and reads it set by set.
///
/// # Errors
/// When the text as a whole is no elements: empty, a web page, a server's message. Then keep what you have. A broken
/// set is an item of the iterator, and the next one follows.
pub fn sets(text: &str, checksums: Checksums) -> Result<Sets<'_>, SourceError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let form = detect::form(text)?;
    let reader = match form {
        Form::OmmJson => Reader::Json(json::Reader::new(text)),
        Form::OmmCsv => Reader::Csv(csv::Reader::new(text)?),
        Form::OmmXml => Reader::Xml(xml::Reader::new(text)),
        Form::OmmKvn => Reader::Kvn(kvn::Reader::new(text)),
        Form::ThreeLine | Form::TwoLine => Reader::Lines(lines::Reader::new(text, checksums)),
    };
    Ok(Sets { form, reader })
}

/// The text of a file: UTF-8, with or without a byte order mark. Bytes that are none become U+FFFD, so that only the set
/// they stand in is refused.
///
/// # Errors
/// UTF-16, and bytes that are no text.
pub fn text_of(bytes: &[u8]) -> Result<Cow<'_, str>, SourceError> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(SourceError::Utf16);
    }
    if bytes.iter().take(4096).any(|&byte| byte == 0) {
        return Err(SourceError::Binary);
    }
    Ok(String::from_utf8_lossy(bytes))
}

impl Sets<'_> {
    /// The form that was recognised.
    #[must_use]
    pub const fn form(&self) -> Form {
        self.form
    }
}

impl Iterator for Sets<'_> {
    type Item = Result<Found, SetError>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.reader {
            Reader::Json(reader) => reader.next(),
            Reader::Csv(reader) => reader.next(),
            Reader::Xml(reader) => reader.next(),
            Reader::Kvn(reader) => reader.next(),
            Reader::Lines(reader) => reader.next(),
        }
    }
}

/// A line and its number, counted from 1, without line ends, trailing blanks and tabs.
fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.split('\n').enumerate().map(|(index, line)| (index + 1, line.trim_end_matches([' ', '\t', '\r'])))
}

/// A text for a message: one line, cut at 60 characters.
fn excerpt(text: &str) -> String {
    let mut short: String =
        text.trim().chars().take(60).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.trim().chars().nth(60).is_some() {
        short.push('…');
    }
    short
}
