//! Uplink frames out of a byte stream: the satellite's side.

use super::{
    magic,
    window::{View, Window},
};
use crate::{FRAME_LEN, MAGIC_LEN, SealedUplink, UP_MAGIC};

/// What an [`UpDecoder`] has seen.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct UpCounters {
    /// Candidates handed out; most are frames, the GCM tag decides.
    pub candidates: u64,
}

/// Finds every magic with 232 bytes behind it and hands it out the moment its last byte arrives; the GCM tag decides.
///
/// Candidates may overlap, so a damaged or forged beginning never hides a frame. At most one candidate per 8 bytes.
#[derive(Clone, Debug)]
pub struct UpDecoder {
    window: Window,
    search: Search,
}

#[derive(Clone, Debug, Default)]
struct Search {
    /// Magics begin at or after this position, or in `open`.
    scanned: u64,
    /// Where magics stand whose frame is not complete, ascending.
    open: heapless::Vec<u64, OPEN_MAX>,
    counters: UpCounters,
}

/// Magics do not overlap, so fewer than 240 / 8 begin within one frame.
const OPEN_MAX: usize = FRAME_LEN / MAGIC_LEN;

impl UpDecoder {
    /// A decoder at position 0.
    #[must_use]
    pub const fn new() -> Self {
        let counters = UpCounters { candidates: 0 };
        Self { window: Window::new(), search: Search { scanned: 0, open: heapless::Vec::new(), counters } }
    }

    /// Takes the next bytes in any piece; `f` gets the offset of the magic in the stream, and the candidate.
    pub fn push(&mut self, bytes: &[u8], f: &mut dyn FnMut(u64, &SealedUplink)) {
        let Self { window, search } = self;
        window.feed(bytes, |view| search.step(view, f));
    }

    /// Bytes taken so far.
    #[must_use]
    pub const fn position(&self) -> u64 {
        self.window.end()
    }

    /// What was seen so far.
    #[must_use]
    pub const fn counters(&self) -> UpCounters {
        self.search.counters
    }

    /// Whether a magic stands open.
    #[must_use]
    pub fn in_frame(&self) -> bool {
        !self.search.open.is_empty()
    }

    /// Forgets everything, as after power-on.
    pub fn reset(&mut self) {
        *self = Self::new();
    }
}

impl Default for UpDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Search {
    fn step(&mut self, view: View<'_>, f: &mut dyn FnMut(u64, &SealedUplink)) -> u64 {
        let end = view.end();
        loop {
            let due = self.open.first().map_or(u64::MAX, |start| start + FRAME_LEN as u64);
            let limit = due.min(end);
            let bytes = view.slice(self.scanned, limit);
            if let Some(found) = magic::find(bytes, &UP_MAGIC) {
                let start = self.scanned + found as u64;
                self.scanned = start + MAGIC_LEN as u64;
                let full = self.open.push(start).is_err();
                debug_assert!(!full, "magics do not overlap");
                continue;
            }
            self.scanned = limit - magic::partial(bytes, &UP_MAGIC) as u64;
            if due > end {
                break;
            }
            let start = self.open.remove(0);
            if let Ok(frame) = SealedUplink::try_from(view.slice(start, due)) {
                self.counters.candidates += 1;
                f(start, &frame);
            }
        }
        self.open.first().copied().unwrap_or(self.scanned)
    }
}
