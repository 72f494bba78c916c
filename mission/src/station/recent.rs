//! Frames of a moment ago: the same bytes again are a second reception and not a second frame.

use std::collections::{BTreeMap, VecDeque};

use crate::clock::UtcUs;
use crate::id::FrameId;
use crate::reception::is_same_frame;
use crate::snapshot::RecentFrame;

/// So many frames of our own radio are remembered.
const OWN: usize = 256;
/// So many that only others heard: whatever they send, ours are not forgotten for it. More of them where large
/// deliveries come.
const OTHERS: usize = 8_192;
/// So many deliveries' frames are remembered. Two are under way when one is looked up in the archive, one of them perhaps
/// behind it when it has to come again; and there is the delivery itself.
const DELIVERIES: usize = 4;

/// A frame that was heard a moment ago.
#[derive(Debug, Clone)]
pub(super) struct Recent {
    pub(super) id: FrameId,
    /// Index of the satellite: equal bytes of two satellites are two frames.
    pub(super) satellite: usize,
    pub(super) at: UtcUs,
    pub(super) bytes: Box<[u8]>,
    /// Only others heard it so far.
    pub(super) elsewhere: bool,
    /// Its time is known, and its values were derived.
    pub(super) dated: bool,
}

impl Recent {
    pub(super) fn of(left: &RecentFrame, satellite: usize) -> Self {
        Self {
            id: left.id,
            satellite,
            at: left.at,
            bytes: left.bytes.clone(),
            elsewhere: left.elsewhere,
            dated: left.dated,
        }
    }

    /// Where to look for it: its satellite and its checksum.
    fn mark(&self) -> Mark {
        mark(self.satellite, &self.bytes)
    }
}

type Mark = (usize, [u8; 4]);

fn mark(satellite: usize, bytes: &[u8]) -> Mark {
    let mut crc = [0; 4];
    for (to, from) in crc.iter_mut().zip(bytes.iter().skip(protocol::MAGIC_LEN)) {
        *to = *from;
    }
    (satellite, crc)
}

/// Of several frames with the same bytes the one that is nearest in time counts, of two as near the older: whoever looks,
/// in memory or in the archive, finds the same.
pub(super) const fn nearness(frame: UtcUs, at: UtcUs, id: FrameId) -> (u64, u64) {
    (frame.0.abs_diff(at.0), id.0)
}

/// The frames that are remembered.
#[derive(Debug, Default)]
pub(super) struct Recents {
    own: Ring,
    others: Ring,
    /// Reports in the largest delivery.
    largest: usize,
}

/// Frames in the order in which they came, found by their mark.
#[derive(Debug, Default)]
struct Ring {
    order: VecDeque<Mark>,
    by_mark: BTreeMap<Mark, VecDeque<Recent>>,
}

impl Ring {
    fn push(&mut self, recent: Recent, most: usize) {
        self.order.push_back(recent.mark());
        self.by_mark.entry(recent.mark()).or_default().push_back(recent);
        while self.order.len() > most
            && let Some(mark) = self.order.pop_front()
            && let Some(same) = self.by_mark.get_mut(&mark)
        {
            same.pop_front();
            if same.is_empty() {
                self.by_mark.remove(&mark);
            }
        }
    }

    fn find(&mut self, satellite: usize, bytes: &[u8], at: (UtcUs, bool)) -> Option<&mut Recent> {
        let same = self.by_mark.get_mut(&mark(satellite, bytes))?;
        let same = same
            .iter_mut()
            .filter(|recent| *recent.bytes == *bytes && is_same_frame(bytes, (recent.at, recent.dated), at));
        same.min_by_key(|recent| nearness(recent.at, at.0, recent.id))
    }
}

impl Recents {
    /// A delivery of so many reports comes.
    pub(super) fn make_room(&mut self, reports: usize) {
        self.largest = self.largest.max(reports);
    }

    pub(super) fn remember(&mut self, recent: Recent) {
        if recent.elsewhere {
            self.others.push(recent, OTHERS.max(self.largest * DELIVERIES));
        } else {
            self.own.push(recent, OWN);
        }
    }

    /// Whether this frame with these bytes is remembered, whatever its time.
    pub(super) fn holds(&self, satellite: usize, bytes: &[u8], id: FrameId) -> bool {
        let mark = mark(satellite, bytes);
        let same = [&self.own, &self.others].into_iter().filter_map(|ring| ring.by_mark.get(&mark));
        same.flatten().any(|recent| recent.id == id)
    }

    /// Somebody has told when a frame was heard that came without a time.
    pub(super) fn date(&mut self, told: Recent) {
        let Self { own, others, .. } = self;
        let same = [own, others].into_iter().find_map(|ring| {
            let same = ring.by_mark.get_mut(&told.mark())?;
            same.iter_mut().find(|recent| recent.id == told.id)
        });
        match same {
            Some(recent) => (recent.at, recent.dated) = (told.at, true),
            None => self.remember(told),
        }
    }

    /// The frame with these bytes at this time (and whether that is known).
    pub(super) fn find(&mut self, satellite: usize, bytes: &[u8], at: (UtcUs, bool)) -> Option<&mut Recent> {
        let Self { own, others, .. } = self;
        let found = [own.find(satellite, bytes, at), others.find(satellite, bytes, at)];
        found.into_iter().flatten().min_by_key(|recent| nearness(recent.at, at.0, recent.id))
    }
}
