//! The last bytes of a stream in one piece, so that a decoder reads frames whatever pieces they came in.

use crate::FRAME_LEN;

/// Room for what may have to be kept (under one frame) and at least one more frame.
const ROOM: usize = 512;

/// A run of a stream, addressed by position in the stream.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) bytes: &'a [u8],
    /// Position of the first byte.
    pub(super) start: u64,
}

impl<'a> View<'a> {
    /// Position after the last byte.
    pub(super) const fn end(&self) -> u64 {
        self.start + self.bytes.len() as u64
    }

    /// The bytes `from..to`; empty if they are not all here, which a decoder never asks for.
    pub(super) fn slice(&self, from: u64, to: u64) -> &'a [u8] {
        let (Some(from), Some(to)) = (from.checked_sub(self.start), to.checked_sub(self.start)) else {
            return &[];
        };
        self.bytes.get(from as usize..to as usize).unwrap_or(&[])
    }

    /// The byte at a position, if it has arrived.
    pub(super) fn byte(&self, at: u64) -> Option<u8> {
        self.slice(at, at + 1).first().copied()
    }
}

/// Keeps what is still needed between pushes. Large pieces are read where they lie and not copied.
#[derive(Clone, Debug)]
pub(super) struct Window {
    buf: [u8; ROOM],
    len: usize,
    /// Position of the first byte of `buf`.
    start: u64,
    /// Position from which on bytes are needed; what lies before it is forgotten when room is short.
    keep: u64,
}

impl Window {
    pub(super) const fn new() -> Self {
        Self { buf: [0; ROOM], len: 0, start: 0, keep: 0 }
    }

    /// Position after the last byte fed.
    pub(super) const fn end(&self) -> u64 {
        self.start + self.len as u64
    }

    /// What is kept.
    pub(super) fn view(&self) -> View<'_> {
        View { bytes: self.buf.get(..self.len).unwrap_or(&[]), start: self.start }
    }

    /// Shows all of `bytes` to `step`, each time after what is kept; `step` returns the position from which on bytes
    /// must be kept, never more than 239 before the end.
    pub(super) fn feed(&mut self, mut bytes: &[u8], mut step: impl FnMut(View<'_>) -> u64) {
        while !bytes.is_empty() {
            if self.len == 0 {
                let view = View { bytes, start: self.start };
                self.keep = step(view);
                self.take_over(view);
                return;
            }
            if bytes.len() > ROOM - self.len {
                self.forget();
            }
            let piece_start = self.end();
            let taken = bytes.len().min(ROOM - self.len);
            self.buf[self.len..self.len + taken].copy_from_slice(&bytes[..taken]);
            self.len += taken;
            self.keep = step(self.view());
            if self.keep >= self.end() || (self.keep >= piece_start && taken < bytes.len()) {
                // Nothing before the caller's piece is needed any more: go on where it lies.
                bytes = &bytes[(self.keep - piece_start) as usize..];
                self.start = self.keep;
                self.len = 0;
            } else {
                bytes = &bytes[taken..];
            }
        }
    }

    /// Keeps the needed end of a piece that was read where it lies.
    fn take_over(&mut self, view: View<'_>) {
        let end = view.end();
        let kept = view.slice(self.keep, end);
        debug_assert!(kept.len() < FRAME_LEN, "a decoder keeps less than one frame");
        let kept = &kept[kept.len() - kept.len().min(ROOM)..];
        self.buf[..kept.len()].copy_from_slice(kept);
        self.len = kept.len();
        self.start = end - kept.len() as u64;
    }

    /// Makes room.
    fn forget(&mut self) {
        let gone = ((self.keep - self.start) as usize).min(self.len);
        self.buf.copy_within(gone..self.len, 0);
        self.len -= gone;
        self.start += gone as u64;
    }
}
