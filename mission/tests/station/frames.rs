//! What a satellite would send, byte by byte.

use protocol::crc32;

/// A frame as it comes out of the air.
pub(crate) fn frame(packet_type: u8, tag: u8, payload: &[u8]) -> Vec<u8> {
    let mut contents = vec![packet_type, tag];
    contents.extend(u16::try_from(payload.len()).unwrap().to_be_bytes());
    contents.extend(payload);
    let mut bytes = b"PIXELSAT".to_vec();
    bytes.extend(crc32(&contents).to_be_bytes());
    bytes.extend(contents);
    bytes
}

pub(crate) fn heartbeat_frame(tag: u8, uptime_ms: u32, timestamp_ms: u64) -> Vec<u8> {
    let mut payload = vec![0; 117];
    payload[104..108].copy_from_slice(&uptime_ms.to_be_bytes());
    payload[108..116].copy_from_slice(&timestamp_ms.to_be_bytes());
    frame(6, tag, &payload)
}

pub(crate) fn info_frame(tag: u8, exists: bool, chunks: u32, size: u32, width: u16) -> Vec<u8> {
    let mut payload = vec![u8::from(exists)];
    payload.extend(chunks.to_be_bytes());
    payload.extend(size.to_be_bytes());
    payload.extend(width.to_be_bytes());
    payload.extend(304u16.to_be_bytes());
    frame(2, tag, &payload)
}

pub(crate) fn chunk_frame(tag: u8, index: u16, fill: u8) -> Vec<u8> {
    let mut payload = index.to_be_bytes().to_vec();
    payload.extend([fill; 222]);
    frame(3, tag, &payload)
}
