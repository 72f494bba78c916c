//! Objects cut out of JSON, NDJSON, arrays and the answers that wrap them, byte by byte; and what each of them is.

use mission::reception::{Refusal, Said};

use super::tree::Object;
use super::{Context, DEPTH_MAX, PACKET_MAX, export, satnogs, tinygs};

/// Bytes of a line before its object that are kept: a topic.
const PREFIX_MAX: usize = 256;
/// Bytes of a string that are looked at.
const WORD_MAX: usize = 16;
/// Keys of an answer whose lists hold the items.
const WRAPPERS: [&[u8]; 2] = [b"packets", b"results"];

/// One object.
pub(super) struct Cut {
    pub(super) line: u64,
    pub(super) prefix: Option<String>,
    pub(super) body: Result<Vec<u8>, Refusal>,
}

/// Finds objects by brackets and strings alone: bounded in memory and in depth, whatever comes. What is no JSON is found
/// to be none when an object is read.
pub(super) struct Cutter {
    line: u64,
    column: u64,
    /// Text on this line before anything of JSON.
    prefix: Vec<u8>,
    prefix_is_text: bool,
    /// Depth at which items stand: 0, or within a list.
    base: u32,
    depth: u32,
    /// For each of the first levels whether it is an object (else a list).
    objects: u64,
    in_string: bool,
    escaped: bool,
    /// The string being read or read last, its beginning: for the keys of wrappers.
    word: Vec<u8>,
    /// The last byte that was no blank.
    before: u8,
    item: Option<Open>,
}

/// An object that is being read.
struct Open {
    line: u64,
    prefix: Option<String>,
    held: Vec<u8>,
    wrong: Option<Refusal>,
}

impl Cutter {
    pub(super) const fn new() -> Self {
        Self {
            line: 1,
            column: 0,
            prefix: Vec::new(),
            prefix_is_text: false,
            base: 0,
            depth: 0,
            objects: 0,
            in_string: false,
            escaped: false,
            word: Vec::new(),
            before: 0,
            item: None,
        }
    }

    pub(super) fn push(&mut self, byte: u8, take: &mut dyn FnMut(Cut)) {
        if byte == b'\n' {
            self.newline(take);
            return;
        }
        if self.column == 0 && self.begins_anew(byte) {
            self.give_up(Refusal::Malformed, take);
        }
        self.column += 1;
        if let Some(item) = &mut self.item {
            item.keep(byte);
        }
        if self.in_string {
            self.string(byte);
            return;
        }
        match byte {
            b'"' if self.depth > 0 => {
                self.in_string = true;
                self.word.clear();
            }
            b'{' | b'[' => self.open(byte),
            b'}' | b']' if self.depth > 0 => self.close(byte, take),
            b' ' | b'\t' | b'\r' => {
                if self.depth == 0 && self.prefix_is_text && self.prefix.len() < PREFIX_MAX {
                    self.prefix.push(byte);
                }
                return;
            }
            _ if self.depth == 0 && !matches!(byte, b',') => {
                self.prefix_is_text = true;
                if self.prefix.len() < PREFIX_MAX {
                    self.prefix.push(byte);
                }
            }
            _ => {}
        }
        self.before = byte;
    }

    /// Takes the bytes at the beginning of `rest` that are nothing but the inside of a string, all at once; how many.
    pub(super) fn push_text(&mut self, rest: &[u8]) -> usize {
        if !self.in_string || self.escaped {
            return 0;
        }
        let ends = |byte: &u8| matches!(byte, b'"' | b'\\' | b'\n');
        let count = rest.iter().position(ends).unwrap_or(rest.len());
        let text = &rest[..count];
        self.column += count as u64;
        if let Some(item) = &mut self.item {
            item.keep_all(text);
        }
        let room = WORD_MAX.saturating_sub(self.word.len());
        self.word.extend_from_slice(&text[..count.min(room)]);
        count
    }

    /// The reader is at its end.
    pub(super) fn end(&mut self, take: &mut dyn FnMut(Cut)) {
        if self.item.is_some() {
            self.give_up(Refusal::Malformed, take);
        } else if self.depth == 0 {
            self.stray(take);
        }
    }

    fn newline(&mut self, take: &mut dyn FnMut(Cut)) {
        if self.in_string {
            // No string of JSON holds a line's end: it was cut.
            self.give_up(Refusal::Malformed, take);
        } else if let Some(item) = &mut self.item {
            item.keep(b'\n');
        } else if self.depth == 0 {
            self.stray(take);
        }
        self.line += 1;
        self.column = 0;
    }

    /// Text on a line without an object.
    fn stray(&mut self, take: &mut dyn FnMut(Cut)) {
        let prefix = std::mem::take(&mut self.prefix);
        if std::mem::take(&mut self.prefix_is_text) && !prefix.trim_ascii().starts_with(b"#") {
            take(Cut { line: self.line, prefix: None, body: Err(Refusal::Malformed) });
        }
    }

    /// What was begun is broken: begin anew, at the top.
    fn give_up(&mut self, reason: Refusal, take: &mut dyn FnMut(Cut)) {
        let line = self.item.take().map_or(self.line, |item| item.line);
        take(Cut { line, prefix: None, body: Err(reason) });
        *self = Self { line: self.line, column: self.column, ..Self::new() };
    }

    /// An object, or a topic where there was one before, at the very beginning of a line inside another object: the line
    /// before was cut. Whoever writes an object over several lines indents what is in it.
    fn begins_anew(&self, byte: u8) -> bool {
        let has_topic = self.item.as_ref().is_some_and(|item| item.prefix.is_some());
        !self.in_string && self.depth > self.base && (byte == b'{' || byte == b't' && has_topic)
    }

    fn is_object(&self) -> bool {
        (1..=64).contains(&self.depth) && self.objects >> (self.depth - 1) & 1 == 1
    }

    fn string(&mut self, byte: u8) {
        if self.escaped {
            self.escaped = false;
        } else if byte == b'\\' {
            self.escaped = true;
        } else if byte == b'"' {
            self.in_string = false;
            self.before = b'"';
            return;
        }
        if self.word.len() < WORD_MAX {
            self.word.push(byte);
        }
    }

    fn open(&mut self, byte: u8) {
        let is_object = byte == b'{';
        // An answer that wraps its items: go on inside its list.
        let wraps =
            !is_object && self.base == 0 && self.depth == 1 && self.before == b':' && self.is_object();
        if wraps && WRAPPERS.contains(&self.word.as_slice()) {
            self.item = None;
            self.base = 2;
        } else if !is_object && self.depth == 0 {
            self.base = 1;
            self.prefix.clear();
            self.prefix_is_text = false;
        } else if is_object && self.depth == self.base && self.item.is_none() {
            let prefix = std::mem::take(&mut self.prefix);
            self.prefix_is_text = false;
            let prefix = String::from_utf8(prefix).ok().map(|text| text.trim().to_owned());
            let prefix = prefix.filter(|text| !text.is_empty());
            self.item = Some(Open { line: self.line, prefix, held: vec![byte], wrong: None });
        }
        self.depth = self.depth.saturating_add(1);
        if (1..=64).contains(&self.depth) {
            let bit = 1 << (self.depth - 1);
            self.objects = if is_object { self.objects | bit } else { self.objects & !bit };
        }
        if self.depth - self.base > DEPTH_MAX
            && let Some(item) = &mut self.item
        {
            item.wrong.get_or_insert(Refusal::TooDeep);
        }
    }

    fn close(&mut self, byte: u8, take: &mut dyn FnMut(Cut)) {
        if self.depth <= 64 && self.is_object() != (byte == b'}') {
            self.give_up(Refusal::Malformed, take);
            return;
        }
        self.depth -= 1;
        if self.depth < self.base {
            self.base = 0;
        }
        if self.depth == self.base
            && let Some(Open { line, prefix, held, wrong }) = self.item.take()
        {
            take(Cut { line, prefix, body: wrong.map_or(Ok(held), Err) });
        }
    }
}

impl Open {
    fn keep_all(&mut self, bytes: &[u8]) {
        if self.wrong.is_none() && self.held.len() + bytes.len() <= PACKET_MAX {
            self.held.extend_from_slice(bytes);
        } else if !bytes.is_empty() {
            self.wrong.get_or_insert(Refusal::TooLong);
            self.held = Vec::new();
        }
    }

    fn keep(&mut self, byte: u8) {
        if self.wrong.is_some() {
            self.held = Vec::new();
        } else if self.held.len() < PACKET_MAX {
            self.held.push(byte);
        } else {
            self.wrong = Some(Refusal::TooLong);
        }
    }
}

/// What an object says, by what it is.
pub(super) fn said(
    prefix: Option<&str>,
    body: &[u8],
    context: &Context,
    take: &mut dyn FnMut(Result<Said, Refusal>),
) {
    let is_long = body.len() > super::RECEPTION_MAX;
    let Some(object) = Object::parse(body) else {
        return take(Err(Refusal::Malformed));
    };
    if is_long && !(object.contains_key("raw") && object.contains_key("stations")) {
        return take(Err(Refusal::TooLong));
    }
    if object.contains_key("pixelsat_reception") {
        take(export::said(&object, body, context));
    } else if object.contains_key("raw") {
        tinygs::packet(&object, body, context, take);
    } else if object.contains_key("data") || object.contains_key("crc_error") {
        take(tinygs::rx(prefix, &object, body, context));
    } else if object.contains_key("frame") {
        take(satnogs::object(&object, body, context));
    } else {
        take(Err(Refusal::NotAReport));
    }
}
