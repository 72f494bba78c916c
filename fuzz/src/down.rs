//! Downlink: streams, frames, payloads.

use protocol::{
    DOWN_MAGIC, DecoderCounters, DownDecoder, DownFrame, DownItem, Downlink, FieldValue, FrameForm, crc32,
    encode_down,
};

use crate::pieces;

#[derive(PartialEq, Debug)]
enum Item {
    Frame { offset: u64, bytes: Vec<u8>, nested: bool },
    Promoted { offset: u64, bytes: Vec<u8> },
    Rssi { frame_offset: u64, dbm: i16 },
}

fn run<'a>(rssi: bool, stream: impl Iterator<Item = &'a [u8]>) -> (Vec<Item>, DecoderCounters) {
    let mut decoder = DownDecoder::new(rssi);
    let mut items = Vec::new();
    let mut pushed = 0;
    for piece in stream {
        let before = pushed;
        pushed += piece.len() as u64;
        decoder.push(piece, &mut |item| {
            items.push(match item {
                DownItem::Frame { offset, frame, nested } => {
                    let end = offset + frame.bytes().len() as u64;
                    assert!(before < end && end <= pushed, "a frame comes with its last byte");
                    Item::Frame { offset, bytes: frame.bytes().to_vec(), nested }
                }
                DownItem::Promoted { offset, frame } => {
                    Item::Promoted { offset, bytes: frame.bytes().to_vec() }
                }
                DownItem::Rssi { frame_offset, dbm } => Item::Rssi { frame_offset, dbm },
            });
        });
    }
    assert_eq!(decoder.position(), pushed);
    (items, decoder.counters())
}

/// Every offset with a magic, 16 + length first, else 240: the ICD read naively.
fn oracle(stream: &[u8]) -> Vec<(u64, Vec<u8>)> {
    let mut frames = Vec::new();
    for at in 0..stream.len() {
        let here = &stream[at..];
        if !here.starts_with(&DOWN_MAGIC) || here.len() < 16 {
            continue;
        }
        let length = usize::from(u16::from_be_bytes([here[14], here[15]]));
        let is_valid = |len: usize| {
            here.get(12..len).is_some_and(|contents| crc32(contents).to_be_bytes() == here[8..12])
        };
        if length <= 224 && is_valid(16 + length) {
            frames.push((at as u64, here[..16 + length].to_vec()));
        } else if is_valid(240) {
            frames.push((at as u64, here[..240].to_vec()));
        }
    }
    frames
}

/// Puts right checksums behind magics, from the last to the first, so that frames in frames stay valid: without it, a
/// fuzzer never gets past the CRC.
fn repair(stream: &mut [u8], full: bool) {
    for at in (0..stream.len()).rev() {
        let here = &mut stream[at..];
        if !here.starts_with(&DOWN_MAGIC) || here.len() < 16 {
            continue;
        }
        let length = usize::from(u16::from_be_bytes([here[14], here[15]]));
        let len = if full || length > 224 { 240 } else { 16 + length };
        if let Some(contents) = here.get(12..len) {
            let crc = crc32(contents).to_be_bytes();
            here[8..12].copy_from_slice(&crc);
        }
    }
}

/// A stream: first byte how to treat it, second how to cut it.
pub fn down_stream(data: &[u8]) {
    let [how, cut, stream @ ..] = data else { return };
    let mut stream = stream.to_vec();
    match how >> 1 & 3 {
        1 => repair(&mut stream, false),
        2 => repair(&mut stream, true),
        _ => {}
    }
    let rssi = how & 1 == 1;
    let (whole, counters) = run(rssi, std::iter::once(&stream[..]));
    let (pieced, pieced_counters) = run(rssi, pieces(*cut, &stream));
    assert_eq!(whole, pieced, "pieces make no difference");
    assert_eq!(counters, pieced_counters);

    let (mut frames, mut nested, mut promoted) = (Vec::new(), Vec::new(), Vec::new());
    for item in whole {
        match item {
            Item::Frame { offset, bytes, nested: is_nested } => {
                if is_nested {
                    nested.push(offset);
                }
                frames.push((offset, bytes));
            }
            Item::Promoted { offset, bytes } => {
                assert!(nested.contains(&offset) && !promoted.contains(&offset), "only nested frames, once");
                assert!(frames.contains(&(offset, bytes)));
                promoted.push(offset);
            }
            Item::Rssi { frame_offset, dbm } => {
                assert!(rssi && (-255..0).contains(&dbm));
                let counts = |offset| !nested.contains(&offset) || promoted.contains(&offset);
                assert!(frames.iter().any(|(offset, _)| *offset == frame_offset) && counts(frame_offset));
            }
        }
    }
    frames.sort();
    assert_eq!(frames, oracle(&stream), "the same frames as the naive reading");
    assert_eq!(counters.frames, frames.len() as u64);
    assert_eq!((counters.nested, counters.promoted), (nested.len() as u64, promoted.len() as u64));
    assert!(counters.skipped_bytes <= stream.len() as u64);
}

/// Exactly one frame, as it is and with its checksum put right.
pub fn down_frame(data: &[u8]) {
    judge_frame(data);
    let mut repaired = data.to_vec();
    if repaired.len() >= 16 {
        repaired[..8].copy_from_slice(&DOWN_MAGIC);
        let crc = crc32(&repaired[12..]).to_be_bytes();
        repaired[8..12].copy_from_slice(&crc);
        judge_frame(&repaired);
    }
}

fn judge_frame(bytes: &[u8]) {
    let Ok(frame) = DownFrame::parse(bytes) else { return };
    assert_eq!(frame.bytes(), bytes);
    assert!((16..=240).contains(&bytes.len()));
    assert_eq!(frame.form() == FrameForm::Full, bytes.len() == 240);
    assert_eq!(frame.crc(), crc32(frame.contents()));
    assert!(frame.payload().len() <= 224);
    let Ok(packet) = frame.packet() else { return };
    if !matches!(packet, Downlink::Unknown { .. }) {
        let mut out = [0xA5; 240];
        let len = encode_down(&packet, frame.tag(), frame.form(), &mut out);
        let covered = 16 + packet.payload_len();
        assert_eq!(out[12..covered], bytes[12..covered], "header and payload come back");
        assert_eq!(len, bytes.len());
    }
}

/// First byte the type, the rest the payload.
pub fn downlink_payload(data: &[u8]) {
    let [packet_type, payload @ ..] = data else { return };
    let Ok(packet) = Downlink::decode(*packet_type, payload) else { return };
    assert_eq!(packet.packet_type(), *packet_type);
    if matches!(packet, Downlink::Unknown { .. }) {
        return;
    }
    let mut out = [0xA5; 224];
    let len = packet.encode_payload(&mut out);
    assert_eq!(&out[..len], payload);
    let mut at = 0;
    packet.visit_fields(&mut |field| {
        assert_eq!(usize::from(field.offset), at, "fields tile the payload");
        if let FieldValue::Bytes(bytes) = field.value {
            assert_eq!(bytes.len(), usize::from(field.len));
        }
        at += usize::from(field.len);
    });
    assert_eq!(at, len);
}
