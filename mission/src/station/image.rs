//! An image as it comes together: the bitmap of chunks, the bytes, the conflicts.

use protocol::{CHUNK_LEN, ImageInfo};
use sha2::{Digest, Sha256};

use crate::record::ImageRecord;
use crate::snapshot::ImageSnapshot;

/// A forger may send any number of versions of a chunk; so many are kept of the whole image, the rest is counted.
const CONFLICTS_KEPT: u32 = 1_024;

/// What a chunk was to the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fit {
    /// It was missing.
    New,
    /// It is held, with the same bytes.
    Same,
    /// It is held, with other bytes.
    Conflict {
        /// This version is to be kept.
        keep: bool,
    },
    /// The image has no such chunk.
    Outside,
}

/// The newest image of a satellite.
#[derive(Debug)]
pub(super) struct Assembly {
    pub(super) record: ImageRecord,
    held: Vec<bool>,
    in_conflict: Vec<bool>,
    versions: u32,
    data: Vec<u8>,
}

/// Whether there are bytes, chunks and size fit together, and the index can name every chunk.
pub(super) fn is_usable(info: &ImageInfo) -> bool {
    info.size_bytes > 0 && info.is_consistent() && info.chunks <= 1 << 16
}

impl Assembly {
    pub(super) fn new(record: ImageRecord) -> Self {
        let chunks = usize::try_from(record.chunks).unwrap_or(0).min(1 << 16);
        Self {
            record,
            held: vec![false; chunks],
            in_conflict: vec![false; chunks],
            versions: 0,
            data: vec![0; chunks * CHUNK_LEN],
        }
    }

    pub(super) fn restore(snapshot: &ImageSnapshot) -> Self {
        let mut assembly = Self::new(ImageRecord { held: 0, conflicts: 0, ..snapshot.record.clone() });
        for (index, bytes) in &snapshot.chunks {
            assembly.fit(*index, bytes);
        }
        for index in &snapshot.conflicts {
            assembly.note_conflict(*index);
            assembly.versions += 1;
        }
        assembly
    }

    /// Whether this ImageInfo describes the image that we have.
    pub(super) fn is(&self, info: &ImageInfo) -> bool {
        (self.record.size_bytes, self.record.chunks) == (info.size_bytes, info.chunks)
            && (self.record.width_px, self.record.height_px) == (info.width_px, info.height_px)
    }

    /// Takes a chunk in, if it is missing.
    pub(super) fn fit(&mut self, index: u16, bytes: &[u8; CHUNK_LEN]) -> Fit {
        let at = usize::from(index);
        let Some(held) = self.held.get_mut(at) else { return Fit::Outside };
        let place = &mut self.data[at * CHUNK_LEN..(at + 1) * CHUNK_LEN];
        if !*held {
            *held = true;
            place.copy_from_slice(bytes);
            self.record.held += 1;
            Fit::New
        } else if place == bytes {
            Fit::Same
        } else {
            self.note_conflict(index);
            self.versions = self.versions.saturating_add(1);
            Fit::Conflict { keep: self.versions <= CONFLICTS_KEPT }
        }
    }

    fn note_conflict(&mut self, index: u16) {
        if let Some(flag) = self.in_conflict.get_mut(usize::from(index)) {
            self.record.conflicts += u32::from(!*flag);
            *flag = true;
        }
    }

    pub(super) fn is_complete(&self) -> bool {
        self.record.held == self.record.chunks
    }

    /// Chunks that are not held, ascending.
    pub(super) fn missing(&self) -> Vec<u16> {
        let indices = self.held.iter().enumerate().filter(|(_, held)| !**held);
        indices.filter_map(|(at, _)| u16::try_from(at).ok()).collect()
    }

    /// SHA-256 of the file: the chunks, cut at the size.
    pub(super) fn sha256(&self) -> [u8; 32] {
        let size = usize::try_from(self.record.size_bytes).unwrap_or(usize::MAX).min(self.data.len());
        Sha256::digest(&self.data[..size]).into()
    }
}
