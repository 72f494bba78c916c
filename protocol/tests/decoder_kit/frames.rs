//! Packets as receivers hand them over, and what this code reads in them.

use std::{fs, path::Path};

use protocol::{AdcsMode, DOWN_MAGIC, Downlink, FRAME_LEN, Field, FieldValue, SHORT_OVERHEAD, crc32};

use crate::{names, text::Json};

/// Most bytes that a radio module puts before a frame.
const LEAD_MAX: usize = 3;

/// One packet as it was received.
pub(crate) struct Case {
    pub name: String,
    pub bytes: Vec<u8>,
    /// What is in it; `None` for somebody else's packet.
    pub ours: Option<Ours>,
}

/// What is in a packet of ours.
pub(crate) struct Ours {
    pub lead: usize,
    pub crc_ok: bool,
    /// `None` when the payload stays raw.
    pub packet: Option<Downlink>,
    pub payload: Vec<u8>,
}

impl Case {
    fn new(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        let ours = Ours::find(&bytes);
        Self { name: name.into(), bytes, ours }
    }

    /// The name of the packet that is decoded.
    pub(crate) fn layout(&self) -> Option<String> {
        self.ours.as_ref()?.packet.map(|packet| names::snake(packet.name()))
    }
}

impl Ours {
    /// The frame at byte 0 to 3, with all that can be said of it whether its checksum is right or not.
    fn find(bytes: &[u8]) -> Option<Self> {
        let lead =
            (0..=LEAD_MAX).find(|lead| bytes.get(*lead..).is_some_and(|at| at.starts_with(&DOWN_MAGIC)))?;
        let frame = &bytes[lead..];
        let behind = frame.get(SHORT_OVERHEAD..)?;
        let length = usize::from(u16::from_be_bytes([frame[14], frame[15]]));
        let crc = u32::from_be_bytes(frame[8..12].try_into().unwrap());
        let is_right = |end: usize| frame.get(12..end).is_some_and(|contents| crc32(contents) == crc);
        let packet = behind.get(..length).and_then(|payload| Downlink::decode(frame[12], payload).ok());
        Some(Self {
            lead,
            crc_ok: is_right(SHORT_OVERHEAD + length) || is_right(FRAME_LEN),
            packet: packet.filter(|packet| !matches!(packet, Downlink::Unknown { .. })),
            payload: behind[..length.min(behind.len())].to_vec(),
        })
    }

    fn json(&self, bytes: &[u8]) -> Vec<(String, Json)> {
        let frame = &bytes[self.lead..];
        let packet_type = frame[12];
        let mut members = vec![
            ("module_header", Json::text(hex::encode(&bytes[..self.lead]))),
            ("crc32", Json::text(hex::encode(&frame[8..12]))),
            ("crc_ok", Json::plain(self.crc_ok)),
            ("packet_type", Json::plain(packet_type)),
            ("packet_type_name", Json::text_or_null(Downlink::name_of(packet_type).map(names::snake))),
            ("tag", Json::plain(frame[13])),
            ("length", Json::plain(u16::from_be_bytes([frame[14], frame[15]]))),
        ];
        // A Pong has a payload of no bytes.
        match self.packet.filter(|packet| !matches!(packet, Downlink::Pong)) {
            Some(packet) => members.push(("payload", payload_json(&packet))),
            None => members.push(("payload_raw", Json::text(hex::encode(&self.payload)))),
        }
        match self.packet {
            Some(Downlink::Error(code)) => {
                members.push(("code_name", Json::text_or_null(code.name().map(names::snake))));
            }
            Some(Downlink::AdcsInfo(info)) => {
                let mode = info.adcs_mode();
                let name = (!matches!(mode, AdcsMode::Unknown(_))).then(|| names::snake(&mode.to_string()));
                members.push(("mode_name", Json::text_or_null(name)));
            }
            _ => {}
        }
        members.push(("rest", Json::text(hex::encode(&frame[SHORT_OVERHEAD + self.payload.len()..]))));
        members.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }
}

fn payload_json(packet: &Downlink) -> Json {
    let mut payload = Json::Object(Vec::new());
    packet.visit_fields(&mut |field: Field<'_>| {
        let path = names::path(field.name, field.unit);
        let (last, parents) = path.split_last().unwrap();
        let parent = match (parents, field.index) {
            ([], _) => &mut payload,
            ([list], Some(index)) => {
                let Json::List(items) = payload.member(list, Json::List(Vec::new())) else {
                    panic!("{list}")
                };
                items.resize(items.len().max(usize::from(index) + 1), Json::Object(Vec::new()));
                &mut items[usize::from(index)]
            }
            ([vector], None) => payload.member(vector, Json::Object(Vec::new())),
            (_, _) => panic!("{} is too deep", field.name),
        };
        parent.member(
            last,
            match field.value {
                FieldValue::F32(value) => Json::float(value),
                FieldValue::U(value) if value >= 1 << 53 => Json::text(value.to_string()),
                FieldValue::U(value) => Json::plain(value),
                FieldValue::Bool(value) => Json::plain(u8::from(value)),
                FieldValue::Bytes(value) => Json::text(hex::encode(value)),
            },
        );
    });
    if matches!(packet, Downlink::EventReport(_)) {
        payload.member("events", Json::List(Vec::new()));
    }
    payload
}

/// Name and bytes of the records in a file of known answers.
fn known(file: &str) -> Vec<(String, Vec<u8>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("vectors").join(file);
    let text = fs::read_to_string(path).unwrap();
    let record = |record: &str| {
        let value =
            |key: &str| record.lines().find_map(|line| line.strip_prefix(key)).unwrap().trim().to_owned();
        (value("name:"), hex::decode(value("frame:")).unwrap())
    };
    text.split("\n\n").skip(1).map(record).collect()
}

/// Every packet of the kit.
pub(crate) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for kind in [
        "heartbeat",
        "pong",
        "error",
        "image_info",
        "image_chunk",
        "adcs_info",
        "schedule_info",
        "mode_report",
        "event_report",
        "unknown",
    ] {
        let records = known(&format!("down_{kind}.txt"));
        cases.extend(records.into_iter().map(|(name, bytes)| Case::new(name, bytes)));
    }
    let malformed = known("malformed_down.txt");
    cases.extend(malformed.into_iter().map(|(name, bytes)| Case::new(format!("malformed/{name}"), bytes)));

    let heartbeats = known("down_heartbeat.txt");
    let (short, full) = (heartbeats[0].1.clone(), heartbeats[1].1.clone());
    let joined = |parts: &[&[u8]]| parts.concat();
    let flipped = |at: usize| {
        let mut bytes = short.clone();
        bytes[at] ^= 0x10;
        bytes
    };
    let shifted = short.iter().scan(1, |carry, byte| {
        let out = (*carry << 7) | (byte >> 1);
        *carry = byte & 1;
        Some(out)
    });
    let more = [
        ("received/one_byte_before", joined(&[&[0x19], &short])),
        ("received/two_bytes_before", joined(&[&[0xff, 0xff], &short])),
        ("received/header_of_the_module_before", joined(&[&[0xde, 0x70, 0x19], &short])),
        ("received/header_of_the_module_before_a_full_frame", joined(&[&[0xff, 0xff, 0x19], &full])),
        ("received/bytes_like_the_magic_before", joined(&[b"PIX", &short])),
        ("received/four_bytes_before", joined(&[&[0, 0xde, 0x70, 0x19], &short])),
        ("received/signal_strength_behind", joined(&[&short, &[0x8f]])),
        ("received/two_frames", joined(&[&known("down_pong.txt")[0].1, &short])),
        ("received/cut_in_the_payload", short[..60].to_vec()),
        ("received/cut_behind_the_header", short[..16].to_vec()),
        ("received/cut_in_the_header", short[..15].to_vec()),
        ("received/cut_in_the_magic", short[..7].to_vec()),
        ("received/cut_in_the_padding", full[..200].to_vec()),
        ("received/a_bit_wrong_in_the_temperature", flipped(117)),
        ("received/a_bit_wrong_in_the_magic", flipped(3)),
        ("received/a_bit_too_many", shifted.collect()),
        ("received/unknown_type_with_a_payload", sealed(0x3f, b"something new")),
        ("received/unknown_heartbeat_layout", sealed(6, &[0x55; 120])),
        ("others/test_packet", b"TinyGS-test 1234567890".to_vec()),
        ("others/notice_of_a_bad_checksum", b"Error_CRC".to_vec()),
        ("others/a_foreign_packet", (0..64_u8).map(|n| n.wrapping_mul(37)).collect()),
    ];
    cases.extend(more.map(|(name, bytes)| Case::new(name, bytes)));
    cases
}

/// A short frame around any payload.
fn sealed(packet_type: u8, payload: &[u8]) -> Vec<u8> {
    let mut contents = vec![packet_type, 0];
    contents.extend_from_slice(&u16::try_from(payload.len()).unwrap().to_be_bytes());
    contents.extend_from_slice(payload);
    [&DOWN_MAGIC[..], &crc32(&contents).to_be_bytes(), &contents].concat()
}

/// The file.
pub(crate) fn document() -> String {
    let frames = cases().into_iter().map(|case| {
        let mut members = vec![
            ("name".to_owned(), Json::text(case.name)),
            ("hex".to_owned(), Json::text(hex::encode(&case.bytes))),
            ("ours".to_owned(), Json::plain(case.ours.is_some())),
        ];
        members.extend(case.ours.iter().flat_map(|ours| ours.json(&case.bytes)));
        Json::Object(members)
    });
    let document = Json::Object(vec![
        (
            "about".to_owned(),
            Json::List(
                [
                    "Packets as a LoRa receiver hands them over, and what is in them; made by the tests of the protocol crate.",
                    "ours: whether pixelsat.ksy accepts it. crc_ok: whether its values may be believed.",
                    "payload: the fields, units at the end of their names; payload_raw: a payload that is not decoded, in hex.",
                    "Numbers from 2^53 on, NaN and infinities stand as text, because JSON has no such numbers.",
                ]
                .map(Json::text)
                .to_vec(),
            ),
        ),
        ("frames".to_owned(), Json::List(frames.collect())),
    ]);
    let mut out = String::new();
    document.write(4, 0, &mut out);
    out.push('\n');
    out
}
