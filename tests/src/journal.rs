//! The twin's journal: what the far end heard and sent, whatever the ground believes.

use std::collections::BTreeMap;
use std::path::Path;

use protocol::{DownFrame, Downlink};
use satellite::JournalEntry;

/// Every entry of a journal that somebody may be writing: a last line without its end is left out.
///
/// # Panics
/// When a whole line is no entry.
#[must_use]
pub fn read(path: &Path) -> Vec<JournalEntry> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    whole
        .lines()
        .filter(|line| !line.is_empty())
        .map(|line| JournalEntry::parse_line(line).unwrap_or_else(|error| panic!("{error}: {line}")))
        .collect()
}

/// Packets that ground radiated, in order.
#[must_use]
pub fn radiated(entries: &[JournalEntry]) -> Vec<&[u8]> {
    let packets = entries.iter().filter_map(|entry| match entry {
        JournalEntry::GroundRadiated { packet, .. } => Some(packet.as_slice()),
        _ => None,
    });
    packets.collect()
}

/// Images as the satellite sent them: each ImageInfo that says something new begins one; the chunks after it, whatever
/// became of them on the way, are its bytes. Those that were not sent whole are left out.
#[must_use]
pub fn images(entries: &[JournalEntry]) -> Vec<Vec<u8>> {
    let mut images = Vec::new();
    let mut size = 0;
    let mut chunks: BTreeMap<u16, [u8; 222]> = BTreeMap::new();
    let mut finish = |size: usize, chunks: &BTreeMap<u16, [u8; 222]>| {
        if size > 0 && chunks.len() == size.div_ceil(222) {
            let mut bytes: Vec<u8> = chunks.values().flatten().copied().collect();
            bytes.truncate(size);
            images.push(bytes);
        }
    };
    let sent = entries.iter().filter_map(|entry| match entry {
        JournalEntry::SatelliteSent { frame, .. } => DownFrame::parse(frame).ok()?.packet().ok(),
        _ => None,
    });
    for packet in sent {
        match packet {
            Downlink::ImageInfo(info) if info.exists && info.size_bytes as usize != size => {
                finish(size, &chunks);
                size = info.size_bytes as usize;
                chunks.clear();
            }
            Downlink::ImageChunk(chunk) => {
                // Another image of the same size has begun.
                if chunks.get(&chunk.index.0).is_some_and(|before| *before != chunk.data) {
                    finish(size, &chunks);
                    chunks.clear();
                }
                chunks.insert(chunk.index.0, chunk.data);
            }
            _ => {}
        }
    }
    finish(size, &chunks);
    images
}
