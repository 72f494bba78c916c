//! A reader cut into items, in bounded memory.

use std::collections::HashMap;
use std::io::{self, BufRead};

use mission::reception::Refusal;
use protocol::{DownDecoder, DownItem};

use super::json::{Cut, Cutter};
use super::kiss::{FEND, Unescape};
use super::{Format, RECEPTION_MAX};

/// Contents whose occurrences are counted; beyond these every content counts as the first of its kind.
const COUNTED: usize = 1 << 20;

/// One piece of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// What it is written in.
    pub format: Format,
    /// Where it begins, from 1. In binary formats the number of the item.
    pub line: u64,
    /// What stood before it on its line: the topic that a subscriber wrote down.
    pub prefix: Option<String>,
    /// Which one of this content it is, from 1: what carries no time is told apart by that.
    pub occurrence: u32,
    /// The bytes, or why they were not held.
    pub body: Result<Vec<u8>, Refusal>,
}

/// The items of a reader.
pub struct Items<R> {
    reader: R,
    cut: CutBy,
    format: Format,
    found: std::collections::VecDeque<Item>,
    occurrences: HashMap<u32, u32>,
    ended: bool,
}

enum CutBy {
    Json(Cutter),
    Lines { line: u64, held: Vec<u8>, too_long: bool },
    Kiss { number: u64, frame: Unescape },
    Raw { number: u64, decoder: Box<DownDecoder> },
}

impl<R: BufRead> Items<R> {
    /// Begins at the beginning of the reader.
    pub fn new(format: Format, reader: R) -> Self {
        let cut = match format {
            Format::Json => CutBy::Json(Cutter::new()),
            Format::SatnogsCsv | Format::Hex => CutBy::Lines { line: 1, held: Vec::new(), too_long: false },
            Format::Kiss => CutBy::Kiss { number: 0, frame: Unescape::default() },
            Format::Raw => CutBy::Raw { number: 0, decoder: Box::new(DownDecoder::new(false)) },
        };
        Self {
            reader,
            cut,
            format,
            found: std::collections::VecDeque::new(),
            occurrences: HashMap::new(),
            ended: false,
        }
    }

    fn take(&mut self) -> io::Result<()> {
        let Self { reader, cut, format, found, ended, .. } = self;
        let format = *format;
        let piece = match reader.fill_buf() {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(()),
            piece => piece?,
        };
        let taken = piece.len();
        *ended = taken == 0;
        let item = |line, prefix, body| Item { format, line, prefix, occurrence: 1, body };
        match cut {
            CutBy::Json(cutter) => {
                let mut take = |cut: Cut| found.push_back(item(cut.line, cut.prefix, cut.body));
                let mut rest = piece;
                while let Some((&byte, after)) = rest.split_first() {
                    cutter.push(byte, &mut take);
                    rest = &after[cutter.push_text(after)..];
                }
                if *ended {
                    cutter.end(&mut take);
                }
            }
            CutBy::Lines { line, held, too_long } => {
                let mut end = |line: u64, held: &mut Vec<u8>, too_long: &mut bool| {
                    let body = std::mem::take(held);
                    if std::mem::take(too_long) {
                        found.push_back(item(line, None, Err(Refusal::TooLong)));
                    } else if !body.trim_ascii().is_empty() && !body.trim_ascii().starts_with(b"#") {
                        found.push_back(item(line, None, Ok(body.trim_ascii().to_vec())));
                    }
                };
                for &byte in piece {
                    if byte == b'\n' {
                        end(*line, held, too_long);
                        *line += 1;
                    } else if held.len() < RECEPTION_MAX {
                        held.push(byte);
                    } else {
                        *too_long = true;
                    }
                }
                if *ended {
                    end(*line, held, too_long);
                }
            }
            CutBy::Kiss { number, frame } => {
                let mut take = |body| {
                    *number += 1;
                    found.push_back(item(*number, None, body));
                };
                piece.iter().for_each(|&byte| frame.push(byte, &mut take));
                if *ended {
                    frame.push(FEND, &mut take);
                }
            }
            CutBy::Raw { number, decoder } => {
                let mut take = |frame: &[u8]| {
                    *number += 1;
                    found.push_back(item(*number, None, Ok(frame.to_vec())));
                };
                let mut each = |found: DownItem<'_>| match found {
                    DownItem::Frame { frame, nested: false, .. } | DownItem::Promoted { frame, .. } => {
                        take(frame.bytes());
                    }
                    _ => {}
                };
                decoder.push(piece, &mut each);
                if *ended {
                    decoder.silence(&mut each);
                }
            }
        }
        reader.consume(taken);
        Ok(())
    }
}

impl<R: BufRead> Iterator for Items<R> {
    type Item = io::Result<Item>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(mut item) = self.found.pop_front() {
                if self.format != Format::Json
                    && let Ok(body) = &item.body
                {
                    let content = protocol::crc32(body);
                    let room = self.occurrences.len() < COUNTED;
                    let count = match self.occurrences.get_mut(&content) {
                        Some(count) => count,
                        None if room => self.occurrences.entry(content).or_insert(0),
                        None => return Some(Ok(item)),
                    };
                    *count += 1;
                    item.occurrence = *count;
                }
                return Some(Ok(item));
            }
            if self.ended {
                return None;
            }
            if let Err(error) = self.take() {
                self.ended = true;
                return Some(Err(error));
            }
        }
    }
}
