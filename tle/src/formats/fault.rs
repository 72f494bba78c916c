//! What can be wrong with a text or with one of its sets; each tells the place and what to do.

/// The text as a whole is no elements. A download with such an answer failed: keep the elements that are there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// Nothing but blanks and comments.
    #[error("there are no elements here: the text is empty. Keep the elements you have and try again later")]
    Empty,
    /// A web page.
    #[error(
        "this is a web page{}, not elements: the source answered with a page for people. Keep the elements you have and check \
         the address", title.as_ref().map(|title| format!(" ('{title}')")).unwrap_or_default()
    )]
    Html {
        /// The page's title.
        title: Option<String>,
    },
    /// The source has nothing for this query.
    #[error(
        "the source has no elements for this query ('{said}'): check the catalogue number, name or group"
    )]
    NoData {
        /// Its words.
        said: String,
    },
    /// The source has nothing newer and says so.
    #[error("the source has nothing newer than your last download ('{said}'): keep the elements you have")]
    NotUpdated {
        /// Its words.
        said: String,
    },
    /// The source answered with a message instead of data.
    #[error("the source answered with a message instead of elements: '{said}'. Keep the elements you have")]
    Message {
        /// Its words.
        said: String,
    },
    /// No form of elements.
    #[error(
        "this is no form of elements ('{begins}' ...): wanted are OMM as JSON, CSV, XML or KVN, or TLE with two or three lines"
    )]
    NotElements {
        /// How the text begins.
        begins: String,
    },
    /// Text in two-byte characters.
    #[error("the text is UTF-16: save it as UTF-8")]
    Utf16,
    /// Bytes that are no text.
    #[error("this is a binary file, not text: unpack it first if it is compressed")]
    Binary,
}

/// One set that could not be used. The sets after it can.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}{}: {fault}", object.as_ref().map(|object| format!(" ({object})")).unwrap_or_default())]
pub struct SetError {
    /// The line of the text, counted from 1: where the fault is, or where the set begins.
    pub line: usize,
    /// The object's name or number, when it could be read.
    pub object: Option<String>,
    /// What is wrong.
    pub fault: SetFault,
}

/// What is wrong with a set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SetFault {
    /// Column 69 does not fit the line.
    #[error(
        "the checksum of TLE line {tle_line} is {found}, but the line adds up to {expected}: it was changed on its way. Fetch \
         it again, or read it leniently"
    )]
    Checksum {
        /// 1 or 2.
        tle_line: u8,
        /// The digit in column 69.
        found: u8,
        /// The digit that columns 1-68 add up to.
        expected: u8,
    },
    /// Lines 1 and 2 of different objects.
    #[error("line 1 is of object {first} and line 2 of object {second}: they do not belong together")]
    CatalogueNumbersDiffer {
        /// Of line 1.
        first: u32,
        /// Of line 2.
        second: u32,
    },
    /// A line of the pair is not there.
    #[error("TLE line {wanted} is missing{}", if *.wanted == 2 { " after line 1" } else { " before line 2" })]
    LineMissing {
        /// 1 or 2.
        wanted: u8,
    },
    /// Text between the sets that is followed by no line 1.
    #[error("no elements follow '{text}'")]
    NameAlone {
        /// The text.
        text: String,
    },
    /// A line that ends too early.
    #[error("TLE line {tle_line} has {found} columns instead of 69: it was cut off")]
    CutOff {
        /// 1 or 2.
        tle_line: u8,
        /// Columns found.
        found: usize,
    },
    /// A character where it cannot be.
    #[error("TLE line {tle_line}, column {column} ({field}): found '{}', wanted {wanted}", found.escape_default())]
    Column {
        /// 1 or 2.
        tle_line: u8,
        /// Counted from 1.
        column: usize,
        /// What stands in these columns.
        field: &'static str,
        /// The character.
        found: char,
        /// What may stand there.
        wanted: &'static str,
    },
    /// A value of a TLE or OMM outside its range or of the wrong kind.
    #[error("{field} is '{found}', wanted {wanted}")]
    Value {
        /// The field, by its name in an OMM.
        field: String,
        /// What stands there.
        found: String,
        /// What may stand there.
        wanted: &'static str,
    },
    /// A field without which there is no orbit.
    #[error("{field} is missing: without it there is no orbit")]
    Missing {
        /// The field, by its name in an OMM.
        field: &'static str,
    },
    /// A field given twice.
    #[error("{field} stands there twice")]
    Twice {
        /// The field.
        field: String,
    },
    /// Elements of another theory: they must not be given to SGP4.
    #[error(
        "the elements are made for {found}, not for SGP4: propagating them with SGP4 would be wrong by kilometres. Fetch the \
         ordinary GP elements (EPHEMERIS_TYPE 0)"
    )]
    Theory {
        /// The theory.
        found: String,
    },
    /// The form itself is broken here: JSON, CSV or XML syntax.
    #[error("broken {form}: {said}")]
    Syntax {
        /// The form.
        form: &'static str,
        /// What its parser says.
        said: String,
    },
}

/// Something odd in a set that was understood all the same.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// Column 69 is absent or blank.
    #[error("TLE line {tle_line} has no checksum: a mistyped digit would go unnoticed")]
    NoChecksum {
        /// 1 or 2.
        tle_line: u8,
    },
    /// Column 69 does not fit, and was to be overlooked.
    #[error(
        "the checksum of TLE line {tle_line} is {found}, but the line adds up to {expected}: used all the same"
    )]
    Checksum {
        /// 1 or 2.
        tle_line: u8,
        /// The digit in column 69.
        found: u8,
        /// The digit that columns 1-68 add up to.
        expected: u8,
    },
    /// The epoch is padded with blanks instead of zeros.
    #[error("the epoch '{found}' is padded with blanks; read with zeros")]
    BlankInEpoch {
        /// Columns 19-32.
        found: String,
    },
    /// The designator has not the usual form; kept as it is.
    #[error("the international designator '{found}' is not of the form YYNNNPPP")]
    OddDesignator {
        /// Columns 10-17.
        found: String,
    },
    /// An ephemeris type that public sets do not have.
    #[error("EPHEMERIS_TYPE is {found}; SGP4 is used all the same")]
    EphemerisType {
        /// The type.
        found: u8,
    },
}
