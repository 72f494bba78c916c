//! How bytes were written down: raw, hex or base64, told apart by looking, and undone piece by piece.

use protocol::{DOWN_MAGIC, UP_MAGIC};

/// How the input is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Format {
    /// Look at the first bytes and decide.
    #[default]
    Auto,
    /// Hex digits; spaces, commas, colons, dashes, `0x` and `#` remarks between them are ignored.
    Hex,
    /// The bytes themselves.
    Raw,
    /// Base64 of either alphabet.
    Base64,
}

/// Text that is not what the format allows, and was left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct TextNote {
    /// Line, from 1.
    pub line: u64,
    /// Column of the first character, from 1.
    pub column: u64,
    /// How many characters.
    pub length: u64,
    /// Why.
    pub reason: &'static str,
}

const NOT_HEX: &str = "not a hex digit";
const HALF_BYTE: &str = "half a byte";
const NOT_BASE64: &str = "not a base64 character";
/// Text that could be several things is looked at up to here.
const SNIFF_LEN: usize = 64;

/// Undoes a [`Format`], piece by piece, in bounded memory.
#[derive(Debug)]
pub struct Unwrap {
    format: Format,
    sniffed: Vec<u8>,
    line: u64,
    column: u64,
    remark: bool,
    /// A hex digit without its partner.
    nibble: Option<u8>,
    /// Base64 bits that are not yet a byte: value and count.
    bits: (u32, u32),
    note: Option<TextNote>,
}

impl Unwrap {
    /// Begins at the beginning of the input.
    pub fn new(format: Format) -> Self {
        Self {
            format,
            sniffed: Vec::new(),
            line: 1,
            column: 0,
            remark: false,
            nibble: None,
            bits: (0, 0),
            note: None,
        }
    }

    /// What the input turned out to be; [`Format::Auto`] while that is open.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Takes a piece; appends the bytes it stands for.
    pub fn push(&mut self, piece: &[u8], out: &mut Vec<u8>, note: &mut dyn FnMut(TextNote)) {
        match self.format {
            Format::Raw => out.extend_from_slice(piece),
            Format::Hex => piece.iter().for_each(|&byte| self.hex(byte, out, note)),
            Format::Base64 => piece.iter().for_each(|&byte| self.base64(byte, out, note)),
            Format::Auto => {
                self.sniffed.extend_from_slice(piece);
                if let Some(format) = sniff(&self.sniffed, false) {
                    self.settle(format, out, note);
                }
            }
        }
    }

    /// The input has ended.
    pub fn finish(&mut self, out: &mut Vec<u8>, note: &mut dyn FnMut(TextNote)) {
        if self.format == Format::Auto {
            let format = sniff(&self.sniffed, true).unwrap_or(Format::Raw);
            self.settle(format, out, note);
        }
        if self.nibble.take().is_some() {
            self.complain(HALF_BYTE, note);
        }
        self.tell(note);
    }

    fn settle(&mut self, format: Format, out: &mut Vec<u8>, note: &mut dyn FnMut(TextNote)) {
        self.format = format;
        let sniffed = std::mem::take(&mut self.sniffed);
        self.push(&sniffed, out, note);
    }

    fn hex(&mut self, byte: u8, out: &mut Vec<u8>, note: &mut dyn FnMut(TextNote)) {
        if self.place(byte, true) {
            return;
        }
        if let Some(digit) = char::from(byte).to_digit(16) {
            self.tell(note);
            let digit = digit as u8;
            match self.nibble.take() {
                Some(high) => out.push(high << 4 | digit),
                None => self.nibble = Some(digit),
            }
        } else if matches!(byte, b'x' | b'X') && self.nibble == Some(0) {
            self.nibble = None;
        } else {
            if self.nibble.take().is_some() {
                self.complain(HALF_BYTE, note);
            }
            if !(byte.is_ascii_whitespace() || matches!(byte, b',' | b';' | b':' | b'-' | b'#')) {
                self.complain(NOT_HEX, note);
            }
        }
    }

    fn base64(&mut self, byte: u8, out: &mut Vec<u8>, note: &mut dyn FnMut(TextNote)) {
        if self.place(byte, false) {
            return;
        }
        if let Some(six) = base64_value(byte) {
            self.tell(note);
            let (value, count) = (self.bits.0 << 6 | u32::from(six), self.bits.1 + 6);
            if count >= 8 {
                out.push((value >> (count - 8)) as u8);
                self.bits = (value & ((1 << (count - 8)) - 1), count - 8);
            } else {
                self.bits = (value, count);
            }
        } else if byte == b'=' {
            self.bits = (0, 0);
        } else if !byte.is_ascii_whitespace() {
            self.complain(NOT_BASE64, note);
        }
    }

    /// Keeps line and column; true inside a remark.
    fn place(&mut self, byte: u8, remarks: bool) -> bool {
        if byte == b'\n' {
            (self.line, self.column, self.remark) = (self.line + 1, 0, false);
        } else {
            self.column += 1;
            if self.remark {
                return true;
            }
            self.remark = remarks && byte == b'#';
        }
        false
    }

    /// Neighbours with the same complaint become one note.
    fn complain(&mut self, reason: &'static str, note: &mut dyn FnMut(TextNote)) {
        match &mut self.note {
            Some(open) if open.reason == reason && reason != HALF_BYTE && open.line == self.line => {
                open.length += 1;
            }
            _ => {
                self.tell(note);
                self.note = Some(TextNote { line: self.line, column: self.column.max(1), length: 1, reason });
            }
        }
    }

    fn tell(&mut self, note: &mut dyn FnMut(TextNote)) {
        if let Some(open) = self.note.take() {
            note(open);
        }
    }
}

fn base64_value(byte: u8) -> Option<u8> {
    match byte {
        b'A'..=b'Z' => Some(byte - b'A'),
        b'a'..=b'z' => Some(byte - b'a' + 26),
        b'0'..=b'9' => Some(byte - b'0' + 52),
        b'+' | b'-' => Some(62),
        b'/' | b'_' => Some(63),
        _ => None,
    }
}

/// What the beginning of an input looks like; `None` while more of it is needed.
fn sniff(head: &[u8], is_all: bool) -> Option<Format> {
    let has_magic = head.windows(8).any(|bytes| bytes == DOWN_MAGIC || bytes == UP_MAGIC);
    let is_text = |&byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    if has_magic || !head.iter().all(is_text) {
        return Some(Format::Raw);
    }
    if head.len() < SNIFF_LEN && !is_all {
        return None;
    }
    let mut in_remark = false;
    let mut previous = b' ';
    let is_hex = head.iter().all(|&byte| {
        in_remark = byte != b'\n' && (in_remark || byte == b'#');
        let digit = byte.is_ascii_hexdigit() || (matches!(byte, b'x' | b'X') && previous == b'0');
        previous = byte;
        in_remark || digit || byte.is_ascii_whitespace() || matches!(byte, b',' | b';' | b':' | b'-')
    });
    let is_base64 = head.iter().all(|&b| base64_value(b).is_some() || b == b'=' || b.is_ascii_whitespace());
    Some(match (is_hex, is_base64) {
        (true, _) => Format::Hex,
        (false, true) => Format::Base64,
        (false, false) => Format::Raw,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine as _;

    fn unwrap(format: Format, text: &[u8], piece: usize) -> (Format, Vec<u8>, Vec<TextNote>) {
        let (mut out, mut notes) = (Vec::new(), Vec::new());
        let mut unwrap = Unwrap::new(format);
        for piece in text.chunks(piece) {
            unwrap.push(piece, &mut out, &mut |note| notes.push(note));
        }
        unwrap.finish(&mut out, &mut |note| notes.push(note));
        (unwrap.format(), out, notes)
    }

    #[test]
    fn the_same_bytes_come_out_of_all_formats() {
        let bytes: Vec<u8> = b"PIXELSAT".iter().copied().chain(0..=255).collect();
        let hex = hex::encode(&bytes);
        let spaced: String = bytes.iter().map(|b| format!("0x{b:02X}, ")).collect();
        let remarked = format!("# a capture\n{}\n# end\n{}\n", &hex[..100], &hex[100..]);
        let base64 = base64::engine::general_purpose::STANDARD.encode(&bytes);
        let url = base64::engine::general_purpose::URL_SAFE_NO_PAD.encode(&bytes);
        let wrapped = format!("{}\n{}\n", &base64[..77], &base64[77..]);
        for piece in [1, 7, 4096] {
            for (text, format) in [
                (hex.as_bytes(), Format::Hex),
                (spaced.as_bytes(), Format::Hex),
                (remarked.as_bytes(), Format::Hex),
                (base64.as_bytes(), Format::Base64),
                (url.as_bytes(), Format::Base64),
                (wrapped.as_bytes(), Format::Base64),
                (&bytes, Format::Raw),
            ] {
                assert_eq!(unwrap(Format::Auto, text, piece), (format, bytes.clone(), vec![]));
            }
        }
    }

    #[test]
    fn what_is_not_text_of_the_format_is_noted_and_left_out() {
        let (_, out, notes) = unwrap(Format::Hex, b"50 5\n4zzz9 0x58\n", 3);
        assert_eq!(out, [0x50, 0x58]);
        let told: Vec<_> = notes.iter().map(|n| (n.line, n.length, n.reason)).collect();
        assert_eq!(told, [(2, 1, HALF_BYTE), (2, 1, HALF_BYTE), (2, 3, NOT_HEX), (2, 1, HALF_BYTE)]);
        let (_, out, notes) = unwrap(Format::Base64, b"UE!!lY", 2);
        assert_eq!((out.as_slice(), notes.len()), (b"PIX".as_slice(), 1));
    }

    #[test]
    fn a_short_input_is_judged_at_its_end() {
        assert_eq!(unwrap(Format::Auto, b"5049", 4).0, Format::Hex);
        assert_eq!(unwrap(Format::Auto, b"hello, world!", 4).0, Format::Raw);
    }
}
