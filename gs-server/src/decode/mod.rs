//! `gs-server decode`: a capture in, one JSON object per frame out, and what was skipped and why.
//!
//! No key is needed: downlink is in the clear, and of a telecommand only what everybody can see is told. Memory is
//! bounded however long the input is. A frame is reported in the call that brings its last byte; with `rssi` it waits
//! for one byte more, and a frame that stands inside another candidate waits until that one is decided. Skipped bytes
//! are reported once no frame can claim them any more, so lines come in the order of certainty: sort by `offset`.

mod format;
mod report;
mod skipped;

pub use format::{Format, TextNote, Unwrap};
pub use report::{Fields, FrameReport, Report, Summary, UplinkReport};
pub use skipped::{SkipReason, Skipped, SkippedRuns};

use protocol::{DownDecoder, DownItem, FRAME_LEN, UpDecoder};

/// Bytes looked at in one step; keeps the window of the skipped bytes small.
const STEP_LEN: usize = 4096;
/// Two frames further on, no candidate can be around a frame any more.
const NESTED_LIMIT: u64 = 2 * FRAME_LEN as u64;

/// Turns a stream into [`Report`]s.
#[derive(Debug)]
pub struct Decoder {
    rssi: bool,
    hex: bool,
    down: DownDecoder,
    up: UpDecoder,
    skipped: SkippedRuns,
    /// Frames that wait for their RSSI byte or for the candidate around them.
    pending: Vec<FrameReport>,
    summary: Summary,
    /// The last downlink frame that counted: start and end.
    last: Option<(u64, u64)>,
}

impl Decoder {
    /// A decoder at offset 0. `rssi`: the byte after a frame is its level.
    pub fn new(rssi: bool) -> Self {
        Self {
            rssi,
            hex: false,
            down: DownDecoder::new(rssi),
            up: UpDecoder::new(),
            skipped: SkippedRuns::default(),
            pending: Vec::new(),
            summary: Summary::default(),
            last: None,
        }
    }

    /// Puts the whole frame in hex into each report.
    #[must_use]
    pub fn with_hex(self, hex: bool) -> Self {
        Self { hex, ..self }
    }

    /// Takes the next bytes, in any piece.
    pub fn push(&mut self, bytes: &[u8], tell: &mut dyn FnMut(Report)) {
        for step in bytes.chunks(STEP_LEN) {
            self.skipped.push(step);
            self.summary.bytes += step.len() as u64;
            let Self { down, skipped, pending, last, hex, .. } = self;
            down.push(step, &mut |item| take(item, skipped, pending, last, *hex));
            self.release(false, tell);
            let Self { up, skipped, last, summary, .. } = self;
            up.push(step, &mut |offset, frame| {
                let end = offset + FRAME_LEN as u64;
                let nested = last.is_some_and(|(start, stop)| offset < stop && start < end);
                skipped.cover(offset, end);
                summary.sealed_uplinks += 1;
                tell(Report::SealedUplink(UplinkReport::new(offset, frame, nested)));
            });
            self.settle(false, tell);
        }
    }

    /// The line has gone quiet for longer than a pause within a frame: what was found so far is told.
    pub fn silence(&mut self, tell: &mut dyn FnMut(Report)) {
        let Self { down, skipped, pending, last, hex, .. } = self;
        down.silence(&mut |item| take(item, skipped, pending, last, *hex));
        self.release(true, tell);
    }

    /// The input has ended: what is still open is decided.
    pub fn finish(mut self, tell: &mut dyn FnMut(Report)) -> Summary {
        self.silence(tell);
        self.settle(true, tell);
        self.summary
    }

    /// Reports the frames of which nothing more can become known.
    fn release(&mut self, ended: bool, tell: &mut dyn FnMut(Report)) {
        let position = self.down.position();
        let rssi = self.rssi;
        let is_ready = |frame: &mut FrameReport| {
            ended
                || if frame.nested {
                    position >= frame.offset + NESTED_LIMIT
                } else {
                    !rssi || frame.rssi_dbm.is_some() || position > frame.end()
                }
        };
        for frame in self.pending.extract_if(.., is_ready) {
            self.summary.frames += 1;
            self.summary.nested += u64::from(frame.nested);
            self.summary.malformed += u64::from(frame.error.is_some());
            tell(Report::Frame(frame));
        }
    }

    fn settle(&mut self, ended: bool, tell: &mut dyn FnMut(Report)) {
        let Self { skipped, summary, rssi, .. } = self;
        skipped.settle(ended, &mut |run| {
            // With rssi it is what it should be: the level 0, which means 'none'.
            if *rssi && run.reason == SkipReason::RssiByte {
                return;
            }
            summary.skipped_bytes += run.length;
            summary.bad += u64::from(run.reason == SkipReason::BadChecksum);
            tell(Report::Skipped(run));
        });
    }
}

fn take(
    item: DownItem<'_>,
    skipped: &mut SkippedRuns,
    pending: &mut Vec<FrameReport>,
    last: &mut Option<(u64, u64)>,
    hex: bool,
) {
    match item {
        DownItem::Frame { offset, frame, nested } => {
            let mut report = FrameReport::new(offset, &frame, nested);
            report.hex = hex.then(|| hex::encode(frame.bytes()));
            skipped.cover(offset, report.end());
            if !nested {
                *last = Some((offset, report.end()));
            }
            pending.push(report);
        }
        DownItem::Promoted { offset, .. } => {
            if let Some(frame) = pending.iter_mut().find(|frame| frame.offset == offset) {
                frame.nested = false;
            }
        }
        DownItem::Rssi { frame_offset, dbm } => {
            if let Some(frame) = pending.iter_mut().find(|frame| frame.offset == frame_offset) {
                frame.rssi_dbm = Some(dbm);
                skipped.cover(frame.end(), frame.end() + 1);
            }
        }
    }
}

#[cfg(test)]
mod tests;
