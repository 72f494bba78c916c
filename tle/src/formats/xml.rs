//! OMM as XML: an `ndm` with many `omm`, or a lone `omm`.
//!
//! The text is cut at `<omm` first and each message is parsed by itself, so that a broken one does not take the others
//! with it.

use super::omm::Fields;
use super::{Found, SetError, SetFault};
use quick_xml::XmlVersion;
use quick_xml::events::Event;

#[derive(Debug)]
pub(super) struct Reader<'a> {
    text: &'a str,
    /// Where to look for the next message.
    position: usize,
    /// The line on which `position` stands.
    line: usize,
}

impl<'a> Reader<'a> {
    pub(super) const fn new(text: &'a str) -> Self {
        Self { text, position: 0, line: 1 }
    }

    fn advance(&mut self, to: usize) {
        self.line += count_lines(self.text.get(self.position..to).unwrap_or_default());
        self.position = to;
    }
}

fn count_lines(text: &str) -> usize {
    text.bytes().filter(|&byte| byte == b'\n').count()
}

/// Where the next `<omm` begins in a text.
fn next_message(text: &str) -> Option<usize> {
    let mut from = 0;
    loop {
        let start = from + text.get(from..)?.find("<omm")?;
        let after = text.as_bytes().get(start + 4);
        if after.is_none_or(|&byte| byte == b'>' || byte == b'/' || byte.is_ascii_whitespace()) {
            return Some(start);
        }
        from = start + 4;
    }
}

impl Iterator for Reader<'_> {
    type Item = Result<Found, SetError>;

    fn next(&mut self) -> Option<Self::Item> {
        let start = self.position + next_message(self.text.get(self.position..)?)?;
        self.advance(start);
        let line = self.line;
        let rest = self.text.get(start..)?;
        let next = rest.get(4..).and_then(next_message).map_or(rest.len(), |next| next + 4);
        let end = rest.get(..next)?.find("</omm>").map_or(next, |end| end + 6);
        self.advance(start + end);
        let mut fields = Fields::new(line);
        match read_message(rest.get(..end)?, &mut fields) {
            Ok(()) => Some(fields.assemble()),
            Err((offset, said)) => {
                let at = line + count_lines(rest.get(..offset).unwrap_or_default());
                // The parser quotes what it found, with whatever line ends stand in it.
                let said = said.chars().take(160).map(|c| if c.is_control() { ' ' } else { c }).collect();
                Some(Err(fields.error(at, SetFault::Syntax { form: "XML", said })))
            }
        }
    }
}

/// Collects the leaves of a message; the error carries the offset where reading ended.
fn read_message(text: &str, fields: &mut Fields) -> Result<(), (usize, String)> {
    let first_line = fields.line;
    let mut reader = quick_xml::Reader::from_str(text);
    // The innermost open element, and the text in it so far.
    let mut leaf: Option<(String, String)> = None;
    let mut depth = 0_usize;
    let mut lines = (0, first_line);
    loop {
        let event = reader.read_event();
        let offset = usize::try_from(reader.buffer_position()).unwrap_or(text.len());
        let fail = |said: String| (offset, said);
        match event.map_err(|error| fail(error.to_string()))? {
            Event::Start(element) => {
                depth += 1;
                let mut name = element.local_name().into_inner().to_owned();
                if name == "omm"
                    && let Some(version) = attribute(&element, "version")
                {
                    fields.push("CCSDS_OMM_VERS", &version, first_line);
                }
                if name == "USER_DEFINED"
                    && let Some(key) = attribute(&element, "parameter")
                {
                    name = key;
                }
                leaf = Some((name, String::new()));
            }
            Event::Text(text) => {
                if let Some((_, value)) = &mut leaf {
                    value.push_str(&text);
                }
            }
            Event::CData(text) => {
                if let Some((_, value)) = &mut leaf {
                    value.push_str(&text);
                }
            }
            Event::GeneralRef(reference) => {
                if let Some((_, value)) = &mut leaf {
                    let entity = format!("&{};", &*reference);
                    let plain =
                        quick_xml::escape::unescape(&entity).map_err(|error| fail(error.to_string()))?;
                    value.push_str(&plain);
                }
            }
            Event::End(_) => {
                depth = depth.saturating_sub(1);
                if let Some((name, value)) = leaf.take() {
                    let passed = text.get(lines.0..offset).unwrap_or_default();
                    lines = (offset, lines.1 + count_lines(passed));
                    fields.push(&name, &value, lines.1);
                }
            }
            Event::Eof if depth > 0 => return Err(fail("the message ends before </omm>".to_owned())),
            Event::Eof => return Ok(()),
            Event::Empty(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
        }
    }
}

fn attribute(element: &quick_xml::events::BytesStart<'_>, name: &str) -> Option<String> {
    let attribute = element.try_get_attribute(name).ok()??;
    attribute.normalized_value(XmlVersion::Implicit1_0).ok().map(std::borrow::Cow::into_owned)
}
