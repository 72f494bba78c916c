//! Who brought which chunk: the frames with chunks since the image was declared, page by page and then as they come.

use std::collections::{BTreeMap, HashMap};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use api::client::Filter;
use api::{ChunkMap, FrameView, ImageView, Page};
use protocol::{DownFrame, Downlink};
use ui::chunk_grid::Cell;

use super::super::Scene;
use crate::link::Pending;

/// Packet type of a chunk.
const CHUNK: u8 = protocol::down_type::IMAGE_CHUNK;
/// Frames of one page.
const PAGE: u32 = 1000;
/// Frames that are kept.
const FRAMES_MAX: usize = 150_000;

/// Where a chunk came from.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::panes) struct Heard {
    pub(in crate::panes) cell: Cell,
    /// UTC in microseconds since 1970.
    pub(in crate::panes) at_us: i64,
    pub(in crate::panes) who: String,
    pub(in crate::panes) chunk: u16,
    /// Two frames with the same are of the same version.
    content: u64,
}

/// One version of a chunk.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::panes) struct Version {
    /// The frame that brought it first.
    pub(in crate::panes) frame: u64,
    /// Who brought it.
    pub(in crate::panes) who: Vec<String>,
    /// It is the one in use.
    pub(in crate::panes) in_use: bool,
}

/// Who brought which chunk.
#[derive(Default)]
pub(in crate::panes) struct Sources {
    frames: HashMap<u64, Heard>,
    /// Everything up to this frame was asked for.
    reached: Option<u64>,
    pending: Option<Pending<Page<FrameView>>>,
    /// Counts answers.
    pub(in crate::panes) revision: u64,
    asked_for: u64,
}

impl Sources {
    /// Where a frame came from.
    pub(in crate::panes) fn of(&self, frame: u64) -> Option<&Heard> {
        self.frames.get(&frame)
    }

    /// The versions of a chunk that were heard, the one in use first.
    pub(in crate::panes) fn versions(&self, chunk: u16, in_use: Option<u64>) -> Vec<Version> {
        let mut by_content: BTreeMap<u64, Version> = BTreeMap::new();
        let mut frames: Vec<_> = self.frames.iter().filter(|(_, heard)| heard.chunk == chunk).collect();
        frames.sort_unstable_by_key(|(frame, _)| **frame);
        for (frame, heard) in frames {
            let fresh = Version { frame: *frame, who: Vec::new(), in_use: false };
            let version = by_content.entry(heard.content).or_insert(fresh);
            version.in_use |= Some(*frame) == in_use;
            if !version.who.contains(&heard.who) {
                version.who.push(heard.who.clone());
            }
        }
        let mut versions: Vec<Version> = by_content.into_values().collect();
        versions.sort_by_key(|version| (!version.in_use, version.frame));
        versions
    }

    /// Asks on until every frame of the map is known.
    pub(super) fn turn(&mut self, scene: &Scene<'_>, image: &ImageView, chunks: &ChunkMap) {
        if let Some(answer) = self.pending.as_ref().and_then(Pending::take) {
            self.pending = None;
            if let Ok(page) = answer {
                let ours = scene.model.status.as_ref().map(|(status, _)| status.station.as_str());
                self.add(&page.items, ours.unwrap_or_default());
                self.reached = self.frames.keys().max().copied().max(self.reached).max(page.next);
            }
        }
        let newest = chunks.frames.iter().flatten().max().copied().unwrap_or(0);
        let oldest = chunks.frames.iter().flatten().min().copied().unwrap_or(image.declared_by);
        // A version that is not in use may be newer than all that are: each new map brings one look further.
        let news = self.asked_for != u64::from(chunks.held) << 32 | u64::from(chunks.conflicts);
        let due = news || self.reached.is_none_or(|reached| reached < newest);
        if self.pending.is_some() || !due || self.frames.len() >= FRAMES_MAX {
            return;
        }
        self.asked_for = u64::from(chunks.held) << 32 | u64::from(chunks.conflicts);
        let after = self.reached.unwrap_or(oldest.min(image.declared_by).saturating_sub(1));
        let filter = Filter::new()
            .satellite(&image.satellite)
            .with("packet_type", CHUNK)
            .after(i64::try_from(after).unwrap_or(i64::MAX))
            .limit(PAGE);
        self.pending = Some(scene.courier.ask(move |client| async move { client.frames(&filter).await }));
    }

    fn add(&mut self, frames: &[FrameView], ours: &str) {
        for frame in frames {
            if let Some((chunk, content)) = chunk_of(&frame.hex) {
                let (cell, who) = heard_by(frame, ours);
                let at_us = frame.heard_at.unix_us();
                self.frames.insert(frame.id, Heard { cell, at_us, who, chunk, content });
            }
        }
        self.revision += 1;
    }
}

/// Number and content of the chunk in a frame.
fn chunk_of(hex: &str) -> Option<(u16, u64)> {
    let bytes = bytes_of(hex)?;
    match DownFrame::parse(&bytes).ok()?.packet().ok()? {
        Downlink::ImageChunk(chunk) => {
            let mut hasher = DefaultHasher::new();
            chunk.data.hash(&mut hasher);
            Some((chunk.index.0, hasher.finish()))
        }
        _ => None,
    }
}

/// Bytes from hex digits.
pub(in crate::panes) fn bytes_of(hex: &str) -> Option<Vec<u8>> {
    let digits = hex.as_bytes();
    let pair = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    digits.len().is_multiple_of(2).then(|| digits.chunks(2).map(pair).collect::<Option<Vec<u8>>>())?
}

/// Our own radio, another station of ours, or strangers; and their names.
fn heard_by(frame: &FrameView, ours: &str) -> (Cell, String) {
    if frame.receptions.iter().any(|reception| reception.station == ours) {
        return (Cell::Own, ours.to_owned());
    }
    if let Some(reception) = frame.receptions.first() {
        return (Cell::Station, reception.station.clone());
    }
    let names = frame.heard_elsewhere.iter().map(|outside| {
        outside.receiver_name.clone().or(outside.receiver.clone()).unwrap_or(outside.source.clone())
    });
    (Cell::Strangers, names.take(3).collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use protocol::{FRAME_LEN, FrameForm, ImageChunk, encode_down};

    use super::*;

    fn hex(chunk: u16, byte: u8) -> String {
        let packet =
            Downlink::ImageChunk(ImageChunk { index: protocol::ChunkIndex(chunk), data: [byte; 222] });
        let mut out = [0; FRAME_LEN];
        let length = encode_down(&packet, None, FrameForm::Full, &mut out);
        out[..length].iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn frame(id: u64, station: Option<&str>, hex: String) -> FrameView {
        let at = api::Time::from_unix_us(id as i64);
        let receptions = station.map(|station| api::ReceptionView {
            satellite: "s".to_owned(),
            station: station.to_owned(),
            link: "l".to_owned(),
            source: "radio".to_owned(),
            received_at: at,
            rssi_dbm: None,
        });
        FrameView {
            id,
            satellite: "s".to_owned(),
            station: station.unwrap_or("").to_owned(),
            link: "l".to_owned(),
            heard_at: at,
            form: "full".to_owned(),
            packet_type: Some(CHUNK),
            packet_name: None,
            tag: None,
            nested: false,
            length: 240,
            hex,
            packet: None,
            undecoded: None,
            receptions: receptions.into_iter().collect(),
            heard_elsewhere: Vec::new(),
        }
    }

    #[test]
    fn versions_of_a_chunk_stand_side_by_side_with_who_brought_them() {
        let mut sources = Sources::default();
        let frames = [
            frame(1, Some("home"), hex(7, 1)),
            frame(2, Some("other"), hex(7, 2)),
            frame(3, None, hex(7, 1)),
            frame(4, Some("home"), hex(8, 9)),
            frame(5, Some("home"), "zz".to_owned()),
        ];
        sources.add(&frames, "home");
        let versions = sources.versions(7, Some(2));
        assert_eq!(versions.len(), 2);
        assert_eq!(
            (versions[0].frame, versions[0].in_use, versions[0].who.as_slice()),
            (2, true, &["other".to_owned()][..])
        );
        assert_eq!((versions[1].frame, versions[1].who.len()), (1, 2));
        assert_eq!(sources.of(1).map(|heard| heard.cell), Some(Cell::Own));
        assert_eq!(sources.of(2).map(|heard| heard.cell), Some(Cell::Station));
        assert_eq!(sources.of(3).map(|heard| heard.cell), Some(Cell::Strangers));
        assert_eq!(sources.of(5), None);
    }
}
