//! Frames of a moment ago: the same bytes again are a second reception and not a second frame.

use std::collections::{BTreeMap, VecDeque};

use crate::clock::UtcUs;
use crate::id::FrameId;
use crate::reception::is_same_frame;
use crate::snapshot::RecentFrame;

/// So many frames of our own radio are remembered.
const OWN: usize = 256;
/// So many that only others heard: whatever they send, ours are not forgotten for it.
const OTHERS: usize = 8_192;

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

/// The frames that are remembered.
#[derive(Debug, Default)]
pub(super) struct Recents {
    own: Ring,
    others: Ring,
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
        same.iter_mut()
            .find(|recent| *recent.bytes == *bytes && is_same_frame(bytes, (recent.at, recent.dated), at))
    }
}

impl Recents {
    pub(super) fn remember(&mut self, recent: Recent) {
        if recent.elsewhere {
            self.others.push(recent, OTHERS);
        } else {
            self.own.push(recent, OWN);
        }
    }

    /// The frame with these bytes at this time (and whether that is known).
    pub(super) fn find(&mut self, satellite: usize, bytes: &[u8], at: (UtcUs, bool)) -> Option<&mut Recent> {
        let Self { own, others } = self;
        own.find(satellite, bytes, at).or_else(|| others.find(satellite, bytes, at))
    }
}
