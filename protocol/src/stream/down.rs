//! Downlink frames out of a byte stream: ground's side.

use super::{
    magic,
    window::{View, Window},
};
use crate::{
    DOWN_MAGIC, DOWN_PAYLOAD_MAX, DownFrame, FRAME_LEN, MAGIC_LEN, SHORT_OVERHEAD,
    crc::crc32_continue,
    crc32,
    header::{CONTENTS_AT, CRC_AT, PAYLOAD_AT},
};

/// Magics do not overlap, so fewer than 240 / 8 begin within one frame.
const OPEN_MAX: usize = FRAME_LEN / MAGIC_LEN;

/// What comes out of a [`DownDecoder`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum DownItem<'a> {
    /// A frame whose last byte has just arrived.
    Frame {
        /// Offset of its magic in the stream.
        offset: u64,
        /// The frame.
        frame: DownFrame<'a>,
        /// It lies inside another candidate: keep it, but let it change no state, unless it is promoted later.
        nested: bool,
    },
    /// A frame handed out as nested before, around which no other frame was: now it counts.
    Promoted {
        /// Offset of its magic in the stream, as before.
        offset: u64,
        /// The same frame.
        frame: DownFrame<'a>,
    },
    /// Signal strength the radio measured for a frame.
    Rssi {
        /// Offset of that frame's magic.
        frame_offset: u64,
        /// Strength, dBm, -255..=-1.
        dbm: i16,
    },
}

/// What a [`DownDecoder`] has seen, and what it passed over by reason.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct DecoderCounters {
    /// Frames handed out, nested ones included, promotions not counted again.
    pub frames: u64,
    /// Frames handed out as nested.
    pub nested: u64,
    /// Nested frames that counted after all.
    pub promoted: u64,
    /// Candidates with a sensible header that ended without a valid checksum.
    pub bad_crc: u64,
    /// Candidates whose header claims more than fits and that ended without a valid checksum.
    pub bad_header: u64,
    /// Bytes taken as RSSI, those of value 0 included.
    pub rssi_bytes: u64,
    /// Bytes that belong to no frame and are no RSSI, as far as that is decided.
    pub skipped_bytes: u64,
}

/// Finds downlink frames in bytes that come in any pieces.
///
/// # Rules
/// - Every magic opens a *candidate*; all open candidates are followed in parallel, none hides another.
/// - A candidate is decided first when 16 + length bytes are in (the short form), else at 240 (the full form). The CRC
///   alone decides. The frame is handed out in the very call that brings its last byte.
/// - A frame that lies inside an open candidate is handed out at once as well, with `nested: true`: it may be part of an
///   image, so it must not change any state yet. When every candidate around it turns out not to be a frame, the same
///   frame is handed out again as [`DownItem::Promoted`] and now counts. If one of them is accepted, the flag stands
///   and nothing more is said.
/// - A candidate is *around* a frame as long as it could still become a frame that follows the ICD: before its short
///   form is decided; after that while every byte behind its payload is zero, as padding is, or if its header makes no
///   sense and the bytes may mean anything; and never once a valid frame overlaps its beginning or another magic stands
///   in place of its CRC and header. So the frame after a damaged or cut one is nested only if it lies wholly within
///   what the damaged one's header claims as its payload, and then for at most the bytes missing to that candidate's
///   240. [`DownDecoder::silence`] ends even that when the caller knows the line has gone quiet. The price: around a
///   valid 240-byte frame that breaks the ICD by padding with other bytes than zero, frames inside count; all are
///   emitted.
/// - RSSI: with `rssi`, the byte directly after an accepted frame that counts is its RSSI unless it is `P`.
///
/// Memory is bounded by construction: magics do not overlap, so fewer than 30 candidates are open at a time.
#[derive(Clone, Debug)]
pub struct DownDecoder {
    window: Window,
    search: Search,
}

impl DownDecoder {
    /// A decoder at position 0. `rssi`: whether the radio appends an RSSI byte to each frame (profile).
    #[must_use]
    pub const fn new(rssi: bool) -> Self {
        Self { window: Window::new(), search: Search::new(rssi) }
    }

    /// Takes the next bytes in any piece; `f` gets each item in the call that brings its last byte.
    pub fn push(&mut self, bytes: &[u8], f: &mut dyn FnMut(DownItem<'_>)) {
        let Self { window, search } = self;
        search.quiet &= bytes.is_empty();
        window.feed(bytes, |view| search.step(view, f));
    }

    /// The caller knows that the line has been silent for longer than a pause within a frame: frames that were handed
    /// out as nested count now. Candidates stay open, so a frame with a pause in it is not lost.
    pub fn silence(&mut self, f: &mut dyn FnMut(DownItem<'_>)) {
        self.search.quiet = true;
        self.search.promote(self.window.view(), f, true);
    }

    /// What was seen so far.
    #[must_use]
    pub fn counters(&self) -> DecoderCounters {
        let search = &self.search;
        let decided = search.keep();
        let skipped_bytes = decided.saturating_sub(search.covered.before(decided));
        DecoderCounters { skipped_bytes, ..search.counters }
    }

    /// Bytes taken so far.
    #[must_use]
    pub const fn position(&self) -> u64 {
        self.window.end()
    }

    /// Whether a candidate is open, so that more bytes may be on their way. Not after [`DownDecoder::silence`], until
    /// the next byte.
    #[must_use]
    pub fn in_frame(&self) -> bool {
        !self.search.quiet && !self.search.open.is_empty()
    }

    /// Forgets everything, as after power-on.
    pub fn reset(&mut self) {
        *self = Self::new(self.search.rssi);
    }
}

/// What a candidate waits for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Stage {
    /// Its header.
    Header,
    /// The end of its short form.
    Short { length: u16 },
    /// Byte 240; a short form of this length was wrong. CRC of what the short form covers.
    Full { length: u16, crc: u32, padding_clean: bool },
    /// Byte 240; its header makes no sense.
    FullSenseless,
}

/// A magic whose frame is not decided.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    start: u64,
    /// Position of the end of what it waits for.
    due: u64,
    stage: Stage,
    /// It begins inside a valid frame, or a magic stands where its CRC and header should: hardly a frame around others,
    /// though its CRC may still say otherwise.
    is_refuted: bool,
}

impl Candidate {
    const fn new(start: u64, is_refuted: bool) -> Self {
        Self { start, due: start + SHORT_OVERHEAD as u64, stage: Stage::Header, is_refuted }
    }

    /// Goes on to wait for the end of its first form, if the header is in.
    fn read_header(&mut self, view: View<'_>) {
        let head = view.slice(self.start, self.start + SHORT_OVERHEAD as u64);
        if head.is_empty() {
            return;
        }
        let length = DownFrame::accepted(head).raw_header().length;
        if usize::from(length) <= DOWN_PAYLOAD_MAX {
            self.stage = Stage::Short { length };
            self.due = self.start + SHORT_OVERHEAD as u64 + u64::from(length);
        } else {
            self.stage = Stage::FullSenseless;
            self.due = self.start + FRAME_LEN as u64;
        }
    }

    /// Whether a frame inside may be part of it, see [`DownDecoder`].
    const fn is_around(&self) -> bool {
        match self.stage {
            _ if self.is_refuted => false,
            Stage::Header | Stage::Short { .. } | Stage::FullSenseless => true,
            Stage::Full { padding_clean, .. } => padding_clean,
        }
    }
}

/// A frame handed out as nested whose surroundings are not decided.
#[derive(Clone, Copy, Debug)]
struct Pending {
    start: u64,
    end: u64,
}

#[derive(Clone, Debug)]
struct Search {
    rssi: bool,
    quiet: bool,
    /// Everything before this position is dealt with.
    at: u64,
    /// Magics begin at or after this position, or stand in `open`.
    scanned: u64,
    /// Ascending by start.
    open: heapless::Vec<Candidate, OPEN_MAX>,
    /// Ascending by end.
    pending: heapless::Vec<Pending, OPEN_MAX>,
    /// Frame and position of the byte that may be its RSSI.
    awaiting_rssi: Option<(u64, u64)>,
    /// The valid frame that ended last; of those that ended together, the longest.
    last: (u64, u64),
    covered: Covered,
    counters: DecoderCounters,
}

impl Search {
    const fn new(rssi: bool) -> Self {
        Self {
            rssi,
            quiet: false,
            at: 0,
            scanned: 0,
            open: heapless::Vec::new(),
            pending: heapless::Vec::new(),
            awaiting_rssi: None,
            last: (0, 0),
            covered: Covered::new(),
            counters: DecoderCounters {
                frames: 0,
                nested: 0,
                promoted: 0,
                bad_crc: 0,
                bad_header: 0,
                rssi_bytes: 0,
                skipped_bytes: 0,
            },
        }
    }

    /// Position from which on bytes are still needed.
    fn keep(&self) -> u64 {
        self.open.first().map_or(self.scanned, |candidate| candidate.start)
    }

    /// Deals with all bytes of `view` from `self.at` on, event by event.
    fn step(&mut self, view: View<'_>, f: &mut dyn FnMut(DownItem<'_>)) -> u64 {
        let end = view.end();
        loop {
            if let Some((frame_offset, at)) = self.awaiting_rssi
                && let Some(byte) = view.byte(at)
            {
                self.awaiting_rssi = None;
                self.take_rssi(frame_offset, at, byte, f);
            }
            let mut limit = self.open.iter().map(|candidate| candidate.due).fold(end, u64::min);
            if !self.pending.is_empty() {
                // Byte by byte, so that a promotion is not late either.
                limit = limit.min(self.at + 1).max(self.at);
            }
            let bytes = view.slice(self.scanned, limit);
            let found = magic::find(bytes, &DOWN_MAGIC);
            let reached = if let Some(found) = found {
                let start = self.scanned + found as u64;
                self.scanned = start + MAGIC_LEN as u64;
                if let Some(before) = self.open.last_mut()
                    && start < before.start + SHORT_OVERHEAD as u64
                {
                    before.is_refuted = true;
                }
                let mut candidate = Candidate::new(start, start < self.last.1);
                candidate.read_header(view);
                let full = self.open.push(candidate).is_err();
                debug_assert!(!full, "magics do not overlap");
                self.scanned
            } else {
                self.scanned = limit - magic::partial(bytes, &DOWN_MAGIC) as u64;
                limit
            };
            if !self.pending.is_empty() && reached > self.at {
                self.watch_padding(view, reached);
                self.promote(view, f, false);
            }
            self.at = reached;
            while let Some(index) = self.open.iter().position(|candidate| candidate.due == reached) {
                self.decide(index, view, f);
            }
            if reached == end && found.is_none() {
                break;
            }
        }
        self.keep()
    }

    /// What candidate `index` waited for is in.
    fn decide(&mut self, index: usize, view: View<'_>, f: &mut dyn FnMut(DownItem<'_>)) {
        let Some(candidate) = self.open.get_mut(index) else { return };
        let (start, due) = (candidate.start, candidate.due);
        let frame = view.slice(start, due);
        let full_due = start + FRAME_LEN as u64;
        let contents_crc = match candidate.stage {
            Stage::Header => {
                candidate.read_header(view);
                return;
            }
            Stage::Short { .. } | Stage::FullSenseless => crc32(&frame[CONTENTS_AT..]),
            Stage::Full { length, crc, .. } => {
                crc32_continue(crc, &frame[PAYLOAD_AT + usize::from(length)..])
            }
        };
        let is_frame = frame[CRC_AT..CONTENTS_AT] == contents_crc.to_be_bytes();
        match candidate.stage {
            Stage::Short { length } if !is_frame && due < full_due => {
                candidate.stage = Stage::Full { length, crc: contents_crc, padding_clean: true };
                candidate.due = full_due;
                return;
            }
            _ => {}
        }
        let stage = candidate.stage;
        self.open.remove(index);
        if is_frame {
            self.accept(index, start, view, f);
        } else {
            match stage {
                Stage::FullSenseless => self.counters.bad_header += 1,
                _ => self.counters.bad_crc += 1,
            }
        }
        self.promote(view, f, false);
    }

    /// The frame `start..self.at` is valid; `before` candidates that began before it are open.
    fn accept(&mut self, before: usize, start: u64, view: View<'_>, f: &mut dyn FnMut(DownItem<'_>)) {
        let end = self.at;
        // What lies inside this frame is part of it for good, and what began inside it is no frame around others.
        self.pending.retain(|pending| pending.start < start);
        let (earlier, later) = self.open.split_at_mut(before);
        later.iter_mut().for_each(|candidate| candidate.is_refuted = true);
        let is_inside_last = self.last.1 == end;
        let mut is_inside_open = false;
        for candidate in earlier {
            if let Stage::Full { length, padding_clean, .. } = &mut candidate.stage {
                let padding_at = candidate.start + SHORT_OVERHEAD as u64 + u64::from(*length);
                *padding_clean = view.slice(padding_at, end).iter().all(|byte| *byte == 0);
            }
            is_inside_open |= candidate.is_around();
        }
        let nested = is_inside_last || is_inside_open;
        if !is_inside_last {
            self.last = (start, end);
        }
        self.counters.frames += 1;
        self.covered.forget_before(self.keep().min(start));
        self.covered.add(start, end);
        f(DownItem::Frame { offset: start, frame: DownFrame::accepted(view.slice(start, end)), nested });
        if nested {
            self.counters.nested += 1;
        }
        if is_inside_open && !is_inside_last {
            let full = self.pending.push(Pending { start, end }).is_err();
            debug_assert!(!full, "fewer frames than magics are pending");
        } else if self.rssi && !nested {
            self.awaiting_rssi = Some((start, end));
        }
    }

    /// The bytes up to `reached` are looked at: is the padding of open candidates still zero?
    fn watch_padding(&mut self, view: View<'_>, reached: u64) {
        if view.slice(self.at, reached).iter().all(|byte| *byte == 0) {
            return;
        }
        for candidate in &mut self.open {
            if let Stage::Full { padding_clean, .. } = &mut candidate.stage {
                *padding_clean = false;
            }
        }
    }

    /// Hands out the pending frames around which nothing is any more (or all, `forced`).
    fn promote(&mut self, view: View<'_>, f: &mut dyn FnMut(DownItem<'_>), forced: bool) {
        let mut index = 0;
        while let Some(pending) = self.pending.get(index).copied() {
            let mut around = self.open.iter().take_while(|candidate| candidate.start < pending.start);
            if !forced && around.any(Candidate::is_around) {
                index += 1;
                continue;
            }
            self.pending.remove(index);
            self.counters.promoted += 1;
            let frame = DownFrame::accepted(view.slice(pending.start, pending.end));
            f(DownItem::Promoted { offset: pending.start, frame });
            if self.rssi && pending.end == self.at {
                self.awaiting_rssi = Some((pending.start, pending.end));
            } else if self.rssi
                && let Some(byte) = view.byte(pending.end)
            {
                self.take_rssi(pending.start, pending.end, byte, f);
            }
        }
    }

    /// The byte after a frame that counts is its RSSI, unless it is the first of a magic.
    fn take_rssi(&mut self, frame_offset: u64, at: u64, byte: u8, f: &mut dyn FnMut(DownItem<'_>)) {
        if byte == DOWN_MAGIC[0] {
            return;
        }
        self.counters.rssi_bytes += 1;
        self.covered.add(at, at + 1);
        if byte != 0 {
            f(DownItem::Rssi { frame_offset, dbm: i16::from(byte) - 256 });
        }
    }
}

/// Which bytes belong to frames: a count, and the runs near the end, which later frames may still overlap.
#[derive(Clone, Debug)]
struct Covered {
    /// Bytes in runs already forgotten.
    bytes: u64,
    /// Disjoint runs.
    runs: heapless::Vec<(u64, u64), { 2 * OPEN_MAX }>,
}

impl Covered {
    const fn new() -> Self {
        Self { bytes: 0, runs: heapless::Vec::new() }
    }

    fn add(&mut self, mut from: u64, mut to: u64) {
        // Frame after frame without a gap.
        if let [(_, end)] = &mut self.runs[..]
            && *end == from
        {
            *end = to;
            return;
        }
        self.runs.retain(|(start, end)| {
            let touches = *start <= to && from <= *end;
            if touches {
                from = from.min(*start);
                to = to.max(*end);
            }
            !touches
        });
        if self.runs.push((from, to)).is_err() {
            self.bytes += to - from;
        }
    }

    /// Covered bytes before a position.
    fn before(&self, at: u64) -> u64 {
        let near = self.runs.iter().map(|(start, end)| (*end).min(at).saturating_sub(*start));
        self.bytes + near.sum::<u64>()
    }

    /// No frame will begin before this position any more.
    fn forget_before(&mut self, at: u64) {
        let bytes = &mut self.bytes;
        self.runs.retain(|(start, end)| {
            let is_near = *end > at;
            if !is_near {
                *bytes += end - start;
            }
            is_near
        });
    }
}
