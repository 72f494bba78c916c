use protocol::{Counter, Downlink, ErrorCode, FrameForm, ImageChunk, Key, Nonce, RequestTag, Telecommand};
use serde_json::{Value, json};

use super::*;

fn down(packet: &Downlink, tag: u8, form: FrameForm) -> Vec<u8> {
    let mut out = [0xa5; 240];
    let len = protocol::encode_down(packet, RequestTag::new(tag), form, &mut out);
    out[..len].to_vec()
}

fn up() -> Vec<u8> {
    let nonce = Nonce::new(Counter(1_700_000_000_000_000), [1, 2, 3, 4]);
    let sealed =
        protocol::seal(&Key::from_bytes([9; 16]), nonce, RequestTag::FIRST, &Telecommand::Ping, &[0x5a; 200]);
    sealed.as_bytes().to_vec()
}

/// All lines as JSON, by offset, and the summary; the same whatever the pieces.
fn decode(bytes: &[u8], rssi: bool) -> (Vec<Value>, Summary) {
    let mut all = [1, 17, 240, 100_000].map(|piece| {
        let mut lines = Vec::new();
        let mut decoder = Decoder::new(rssi);
        let mut tell = |report: Report| lines.push(serde_json::to_value(report).unwrap());
        bytes.chunks(piece).for_each(|piece| decoder.push(piece, &mut tell));
        let summary = decoder.finish(&mut tell);
        lines.sort_by_key(|line| (line["offset"].as_u64(), line["kind"].to_string()));
        (lines, summary)
    });
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]), "{all:#?}");
    std::mem::take(&mut all[0])
}

#[test]
fn frames_come_with_fields_and_what_lies_between_with_its_reason() {
    let error = down(&Downlink::Error(ErrorCode(2)), 7, FrameForm::Short);
    let pong = down(&Downlink::Pong, 0, FrameForm::Full);
    let mut stream = b"noise".to_vec();
    stream.extend(&error); // at 5, 17 bytes
    stream.extend([0xde, 0x70, 0x19]);
    stream.extend(&pong); // at 25
    stream.push(0x9f);
    let mut broken = pong.clone();
    broken[20] ^= 1;
    stream.extend(&broken); // at 266
    stream.extend(up()); // at 506
    stream.extend(b"PIXELSAT cut");
    let (lines, summary) = decode(&stream, false);
    let kinds: Vec<_> = lines
        .iter()
        .map(|line| {
            (line["offset"].as_u64().unwrap(), line["reason"].as_str().or(line["kind"].as_str()).unwrap())
        })
        .collect();
    assert_eq!(
        kinds,
        [
            (0, "no-magic"),
            (5, "frame"),
            (22, "radio-header"),
            (25, "frame"),
            (265, "rssi-byte"),
            (266, "bad-checksum"),
            (506, "sealed-uplink"),
            (746, "cut-off"),
        ]
    );
    assert_eq!(lines[1]["tag"], 7);
    assert_eq!(lines[1]["fields"]["name"]["value"], "CrcFailed");
    assert_eq!(lines[3]["form"], "full");
    assert_eq!(lines[5]["length"], 240);
    assert_eq!(lines[6]["counter"], 1_700_000_000_000_000_u64);
    assert_eq!(
        (summary.frames, summary.sealed_uplinks, summary.bad, summary.skipped_bytes, summary.bytes),
        (2, 1, 1, 5 + 3 + 1 + 240 + 12, stream.len() as u64)
    );
}

#[test]
fn level_belongs_to_its_frame() {
    let pong = down(&Downlink::Pong, 1, FrameForm::Short);
    let mut stream = pong.clone();
    stream.push(0x9c);
    stream.extend(&pong);
    stream.push(0);
    stream.extend(&pong);
    let (lines, summary) = decode(&stream, true);
    let levels: Vec<_> = lines.iter().map(|line| line["rssi_dbm"].clone()).collect();
    assert_eq!(levels, [json!(-100), Value::Null, Value::Null]);
    assert_eq!(summary.skipped_bytes, 0);
}

#[test]
fn a_frame_inside_an_image_is_marked_and_one_after_a_damaged_frame_is_not() {
    let pong = down(&Downlink::Pong, 1, FrameForm::Short);
    let mut data = [0; 222];
    data[50..66].copy_from_slice(&pong);
    let chunk = Downlink::ImageChunk(ImageChunk { index: protocol::ChunkIndex(3), data });
    let chunk = down(&chunk, 4, FrameForm::Full);
    let (lines, summary) = decode(&chunk, false);
    assert_eq!(
        lines.iter().map(|line| line["nested"].clone()).collect::<Vec<_>>(),
        [json!(false), json!(true)]
    );
    assert_eq!((summary.frames, summary.nested, summary.skipped_bytes), (2, 1, 0));

    let (lines, summary) = decode(&chunk[..120], false);
    assert_eq!((summary.frames, summary.nested), (1, 0), "{lines:#?}");
}

#[test]
fn nan_is_null_and_invalid() {
    let mut frame = down(&Downlink::Pong, 0, FrameForm::Full);
    frame[12..16].copy_from_slice(&[6, 0, 0, 117]);
    frame[16..20].copy_from_slice(&f32::NAN.to_be_bytes());
    frame[20..24].copy_from_slice(&0.1_f32.to_be_bytes());
    let crc = protocol::crc32(&frame[12..]).to_be_bytes();
    frame[8..12].copy_from_slice(&crc);
    let (lines, _) = decode(&frame, false);
    let fields = lines[0]["fields"].as_object().unwrap();
    let x = fields.iter().find(|(_, value)| value["invalid"] == true).unwrap();
    assert_eq!((x.1["value"].clone(), x.1["unit"].clone()), (Value::Null, json!("km")));
    let text = serde_json::to_string(&lines[0]).unwrap();
    assert!(text.contains("0.1"), "{text}");
}

#[test]
fn a_payload_that_breaks_the_icd_is_shown_raw() {
    let mut frame = down(&Downlink::Pong, 0, FrameForm::Full);
    frame[12..16].copy_from_slice(&[6, 0, 0, 3]);
    let crc = protocol::crc32(&frame[12..]).to_be_bytes();
    frame[8..12].copy_from_slice(&crc);
    let (lines, summary) = decode(&frame, false);
    assert_eq!(summary.malformed, 1);
    assert_eq!(lines[0]["fields"], Value::Null);
    assert_eq!(lines[0]["error"], "unknown heartbeat layout (3 bytes)");
    assert_eq!(lines[0]["payload_hex"], "000000");
}

#[test]
fn memory_does_not_grow_with_the_input() {
    let mut decoder = Decoder::new(false);
    let junk: Vec<u8> = (0..100_000_u32).map(|i| ((i * 7919) >> 3) as u8).collect();
    let mut lines = 0;
    for _ in 0..50 {
        decoder.push(&junk, &mut |_| lines += 1);
    }
    assert_eq!((lines, decoder.pending.len()), (0, 0));
    let summary = decoder.finish(&mut |_| lines += 1);
    assert_eq!((lines, summary.skipped_bytes), (1, 5_000_000));
}
