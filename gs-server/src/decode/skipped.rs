//! What was not a frame: where, how long, and why.
//!
//! The stream decoder counts what it skips; a person who looks at a capture wants to see it. This keeps the last
//! 240 bytes, because until then a magic may still become a frame.

use std::collections::VecDeque;

use protocol::{DOWN_MAGIC, FRAME_LEN, Header, MAGIC_LEN, SHORT_OVERHEAD, UP_MAGIC};
use serde::Serialize;

/// A run of bytes that belongs to no frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// First byte, counted from the start of the input.
    pub offset: u64,
    /// How many bytes.
    pub length: u64,
    /// Why, as a word.
    pub reason: SkipReason,
    /// The same as a sentence.
    pub detail: &'static str,
}

/// Why bytes were skipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SkipReason {
    /// No magic.
    NoMagic,
    /// Three bytes directly before a frame.
    RadioHeader,
    /// One byte directly after a frame.
    RssiByte,
    /// A magic, but the checksum is wrong.
    BadChecksum,
    /// The input ends before the frame does.
    CutOff,
}

impl SkipReason {
    const fn detail(self) -> &'static str {
        match self {
            Self::NoMagic => "no frame begins here",
            Self::RadioHeader => "three bytes before a frame: the radio module's header (address, channel)",
            Self::RssiByte => "one byte after a frame: an RSSI byte? then say --rssi",
            Self::BadChecksum => {
                "a frame begins here, and its checksum is wrong in the short and in the full form"
            }
            Self::CutOff => "a frame begins here, and the input ends before it does",
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Run {
    start: u64,
    end: u64,
    reason: SkipReason,
}

/// Sorts a stream into what belongs to frames and what does not.
#[derive(Debug, Default)]
pub struct SkippedRuns {
    /// Bytes that are not yet judged.
    window: VecDeque<u8>,
    /// Stream offset of the first of them.
    base: u64,
    /// What belongs to something: start and end, by start.
    covers: VecDeque<(u64, u64)>,
    open: Option<Run>,
    last_cover_end: Option<u64>,
}

impl SkippedRuns {
    /// The next bytes of the stream, before what was found in them is reported by [`SkippedRuns::cover`].
    pub fn push(&mut self, bytes: &[u8]) {
        self.window.extend(bytes);
    }

    /// These bytes belong to a frame, or are its RSSI byte.
    pub fn cover(&mut self, start: u64, end: u64) {
        let at = self.covers.partition_point(|&(other, _)| other <= start);
        self.covers.insert(at, (start, end));
    }

    /// Judges all bytes that can belong to no frame that is still open; everything when the stream has `ended`.
    pub fn settle(&mut self, ended: bool, tell: &mut dyn FnMut(Skipped)) {
        let end = self.base + self.window.len() as u64;
        let settled = if ended { end } else { end.saturating_sub(FRAME_LEN as u64) };
        while self.base < settled {
            let here = self.base;
            while self.covers.front().is_some_and(|&(_, end)| end <= here) {
                self.covers.pop_front();
            }
            let covered =
                self.covers.iter().take_while(|&&(start, _)| start <= here).map(|&(_, end)| end).max();
            if let Some(covered) = covered.filter(|&covered| covered > here) {
                self.close(true, tell);
                self.last_cover_end = Some(covered);
                self.advance(covered - here);
            } else {
                self.take_byte(end - here, tell);
            }
        }
        if ended {
            self.close(false, tell);
        }
    }

    /// Judges one byte that nothing covers; `left` bytes of the stream are known from here on.
    fn take_byte(&mut self, left: u64, tell: &mut dyn FnMut(Skipped)) {
        let here = self.base;
        if let Some(reason) = self.candidate(left) {
            self.close(false, tell);
            self.open = Some(Run { start: here, end: here + 1, reason });
        } else {
            match &mut self.open {
                Some(run) if run.reason == SkipReason::NoMagic || here - run.start < FRAME_LEN as u64 => {
                    run.end = here + 1;
                }
                _ => {
                    self.close(false, tell);
                    self.open = Some(Run { start: here, end: here + 1, reason: SkipReason::NoMagic });
                }
            }
        }
        self.advance(1);
    }

    /// Whether a frame begins at the first byte of the window and came to nothing.
    fn candidate(&self, left: u64) -> Option<SkipReason> {
        if !self.window.front().is_some_and(|first| [DOWN_MAGIC[0], UP_MAGIC[0]].contains(first)) {
            return None;
        }
        let head = |len: usize| self.window.iter().take(len).copied();
        if head(MAGIC_LEN).eq(UP_MAGIC) {
            return Some(SkipReason::CutOff);
        }
        if !head(MAGIC_LEN).eq(DOWN_MAGIC) {
            return None;
        }
        let header: Vec<u8> = head(SHORT_OVERHEAD).skip(SHORT_OVERHEAD - 4).collect();
        let short = <[u8; 4]>::try_from(header.as_slice())
            .map(|bytes| SHORT_OVERHEAD as u64 + u64::from(Header::from_wire_bytes(bytes).length));
        let has_all = left >= FRAME_LEN as u64 || short.is_ok_and(|short| left >= short);
        Some(if has_all { SkipReason::BadChecksum } else { SkipReason::CutOff })
    }

    fn advance(&mut self, bytes: u64) {
        let known = self.window.len().min(usize::try_from(bytes).unwrap_or(usize::MAX));
        self.window.drain(..known);
        self.base += known as u64;
    }

    fn close(&mut self, before_frame: bool, tell: &mut dyn FnMut(Skipped)) {
        let Some(run) = self.open.take() else { return };
        let length = run.end - run.start;
        let reason = match run.reason {
            SkipReason::NoMagic if length == 3 && before_frame => SkipReason::RadioHeader,
            SkipReason::NoMagic if length == 1 && self.last_cover_end == Some(run.start) => {
                SkipReason::RssiByte
            }
            reason => reason,
        };
        tell(Skipped { offset: run.start, length, reason, detail: reason.detail() });
    }
}
