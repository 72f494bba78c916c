//! Known answers, made by `scripts/vectors.py` and never by this crate: both directions, every field, every error.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a vector that cannot be read fails its test")]

use std::{fmt::Write as _, fs, path::Path};

use protocol::{
    Counter, CrcMismatch, DownFrame, Downlink, Field, FieldValue, FrameError, FrameForm, Key, Nonce,
    OpenError, PayloadError, RequestTag, SealedUplink, Telecommand, encode_down, open, seal,
};

/// One record of a vector file.
struct Record {
    pairs: Vec<(String, String)>,
}

impl Record {
    fn find(&self, key: &str) -> Option<&str> {
        self.pairs.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }
    fn text(&self, key: &str) -> &str {
        self.find(key).unwrap_or_else(|| panic!("{} has no {key}", self.pairs[0].1))
    }
    fn bytes(&self, key: &str) -> Vec<u8> {
        hex::decode(self.text(key)).unwrap()
    }
    fn array<const N: usize>(&self, key: &str) -> [u8; N] {
        self.bytes(key).try_into().unwrap()
    }
    fn number<T: std::str::FromStr<Err: std::fmt::Debug>>(&self, key: &str) -> T {
        self.text(key).parse().unwrap()
    }
    fn fields(&self) -> Vec<&str> {
        let fields = self.pairs.iter().filter(|(k, _)| k == "field");
        fields.map(|(_, v)| v.split_once(" # ").map_or(v.as_str(), |(shown, _remark)| shown)).collect()
    }
}

/// All records of the files whose name begins so.
fn records(prefix: &str) -> Vec<Record> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("vectors");
    let mut records = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if !path.file_name().unwrap().to_str().unwrap().starts_with(prefix) {
            continue;
        }
        for block in fs::read_to_string(&path).unwrap().split("\n\n").skip(1) {
            let line = |line: &str| line.split_once(": ").map(|(k, v)| (k.to_owned(), v.trim().to_owned()));
            let pairs: Vec<_> = block
                .lines()
                .map(|text| {
                    line(text)
                        .or_else(|| text.strip_suffix(':').map(|key| (key.to_owned(), String::new())))
                        .unwrap_or_else(|| panic!("{}: {text}", path.display()))
                })
                .collect();
            records.push(Record { pairs });
        }
    }
    assert!(!records.is_empty(), "no vectors {prefix}");
    records
}

/// A field as the vector files write it.
fn shown(field: &Field<'_>) -> String {
    let mut line = String::new();
    if let Some(index) = field.index {
        write!(line, "[{index}]").unwrap();
    }
    write!(line, "{} @{}+{} ", field.name, field.offset, field.len).unwrap();
    match field.value {
        FieldValue::F32(value) => write!(line, "f32:{:08x}", value.to_bits()),
        FieldValue::U(value) => write!(line, "u:{value}"),
        FieldValue::Bool(value) => write!(line, "bool:{}", u8::from(value)),
        FieldValue::Bytes(value) => write!(line, "bytes:{}", hex::encode(value)),
    }
    .unwrap();
    if !field.unit.is_empty() {
        write!(line, " {}", field.unit).unwrap();
    }
    line
}

fn payload_error(error: &PayloadError) -> &'static str {
    match error {
        PayloadError::HeaderLength { .. } => "header_length",
        PayloadError::Length { .. } => "length",
        PayloadError::HeartbeatLayout { .. } => "heartbeat_layout",
        PayloadError::Bool { .. } => "bool",
        PayloadError::Count { .. } => "count",
        PayloadError::NotFinite { .. } => "not_finite",
        PayloadError::Range { .. } => "range",
        PayloadError::Order { .. } => "order",
        PayloadError::Duration { .. } => "duration",
        PayloadError::Text { .. } => "text",
        PayloadError::UnknownTelecommand { .. } => "unknown_telecommand",
    }
}

#[test]
fn downlink_vectors_decode_to_their_fields_and_encode_to_their_bytes() {
    let mut types_seen = std::collections::BTreeSet::new();
    for record in records("down_") {
        let name = record.text("name");
        let bytes = record.bytes("frame");
        let frame = DownFrame::parse(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        let header = frame.header().unwrap();
        assert_eq!(header.packet_type, record.number::<u8>("type"), "{name}");
        assert_eq!(header.tag, record.number::<u8>("tag"), "{name}");
        assert_eq!(frame.tag(), RequestTag::new(record.number("tag")), "{name}");
        assert_eq!(header.length, record.number::<u16>("length"), "{name}");
        assert_eq!(format!("{:08x}", frame.crc()), record.text("crc32"), "{name}");
        assert_eq!(frame.form() == FrameForm::Full, record.text("form") == "full", "{name}");

        let packet = frame.packet().unwrap_or_else(|e| panic!("{name}: {e}"));
        types_seen.insert(packet.packet_type());
        let mut fields = Vec::new();
        packet.visit_fields(&mut |field| fields.push(shown(&field)));
        assert_eq!(fields, record.fields(), "{name}");

        let mut out = [0xA5; 240];
        let len = encode_down(&packet, frame.tag(), frame.form(), &mut out);
        assert_eq!(hex::encode(&out[..len]), record.text("frame"), "{name}");
        assert!(out[len..].iter().all(|byte| *byte == 0xA5), "{name}: bytes behind the frame are touched");
        let mut payload = [0xA5; 224];
        assert_eq!(packet.encode_payload(&mut payload), packet.payload_len(), "{name}");
        assert_eq!(&payload[..packet.payload_len()], frame.payload(), "{name}");
    }
    assert_eq!(types_seen.into_iter().collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6, 0x3F, 0x40, 0x41]);
}

#[test]
fn malformed_downlink_vectors_fail_as_they_say() {
    for record in records("malformed_down") {
        let name = record.text("name");
        let bytes = record.bytes("frame");
        let parsed = DownFrame::parse(&bytes);
        if let Some(expected) = record.find("frame_error") {
            let found = match parsed.expect_err(name) {
                FrameError::Length { .. } => "length",
                FrameError::Magic => "magic",
                FrameError::Crc => "crc",
            };
            assert_eq!(found, expected, "{name}");
            continue;
        }
        let packet = parsed.unwrap_or_else(|e| panic!("{name}: {e}")).packet();
        let found = packet.as_ref().err().map_or("none", payload_error);
        assert_eq!(found, record.text("payload_error"), "{name}");
    }
}

#[test]
fn uplink_vectors_open_to_their_fields_and_seal_to_their_bytes() {
    let mut types_seen = std::collections::BTreeSet::new();
    for record in records("up_") {
        let name = record.text("name");
        let key = Key::from_bytes(record.array("key"));
        assert_eq!(key.id().to_string(), record.text("key_id"), "{name}");
        let frame = SealedUplink::from_bytes(record.array("frame")).unwrap();
        let nonce = Nonce::from_bytes(record.array("nonce"));
        assert_eq!(frame.nonce(), nonce, "{name}");
        assert_eq!(nonce.counter(), Counter(record.number("counter")), "{name}");
        assert_eq!(format!("{:08x}", frame.crc()), record.text("crc32"), "{name}");
        assert_eq!(hex::encode(&frame.as_bytes()[224..]), record.text("gcm_tag"), "{name}");

        let opened = open(&key, &frame).unwrap_or_else(|e| panic!("{name}: {e}"));
        opened.check_crc().unwrap();
        assert_eq!(hex::encode(opened.plaintext()), record.text("plaintext"), "{name}");
        assert_eq!(opened.header().packet_type, record.number::<u8>("type"), "{name}");
        assert_eq!(opened.header().length, record.number::<u16>("length"), "{name}");
        let tag = RequestTag::new(record.number("tag")).unwrap();
        assert_eq!(opened.tag(), Some(tag), "{name}");

        let command = opened.telecommand().unwrap_or_else(|e| panic!("{name}: {e}"));
        types_seen.insert(command.packet_type());
        let kind = command.name().to_lowercase();
        assert_eq!(name.split('/').next().unwrap().replace('_', ""), kind, "{name}");
        let mut fields = Vec::new();
        command.visit_fields(&mut |field| fields.push(shown(&field)));
        assert_eq!(fields, record.fields(), "{name}");

        let mut payload = [0xA5; 196];
        let len = command.encode_payload(&mut payload);
        assert_eq!(&payload[..len], opened.payload().unwrap(), "{name}");
        assert!(
            payload[len..].iter().all(|byte| *byte == 0xA5),
            "{name}: bytes behind the payload are touched"
        );
        let sealed = seal(&key, nonce, tag, &command, &record.array("padding"));
        assert_eq!(hex::encode(sealed.as_bytes()), record.text("frame"), "{name}");
    }
    assert_eq!(types_seen.into_iter().collect::<Vec<_>>(), (0..16).chain(0x40..0x47).collect::<Vec<_>>());
}

#[test]
fn malformed_uplink_vectors_fail_as_they_say() {
    for record in records("malformed_up") {
        let name = record.text("name");
        let frame = SealedUplink::from_bytes(record.array("frame")).unwrap();
        let opened = open(&Key::from_bytes(record.array("key")), &frame);
        if record.find("open_error").is_some() {
            assert_eq!(opened.expect_err(name), OpenError::Authentication, "{name}");
            continue;
        }
        let opened = opened.unwrap_or_else(|e| panic!("{name}: {e}"));
        if record.find("crc_error").is_some() {
            assert!(matches!(opened.check_crc(), Err(CrcMismatch { .. })), "{name}");
            continue;
        }
        opened.check_crc().unwrap();
        let command = opened.telecommand();
        let found = command.as_ref().err().map_or("none", payload_error);
        assert_eq!(found, record.text("payload_error"), "{name}");
    }
}

#[test]
fn every_type_of_the_icd_has_its_name() {
    let named = |name: fn(u8) -> Option<&'static str>| (0..=255).filter(|t| name(*t).is_some()).count();
    assert_eq!(named(Downlink::name_of), 9);
    assert_eq!(named(Telecommand::name_of), 23);
}
