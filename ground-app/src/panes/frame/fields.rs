//! Which bytes of a frame are which: magic, checksum, header, and the fields of the packet as the protocol tells them.

use protocol::{CHUNK_LEN, DownFrame, FieldValue, HEADER_LEN, MAGIC_LEN, SHORT_OVERHEAD};
use ui::inspector::Field;

use super::super::words;

/// Where the checksum and the header stand.
const CRC_AT: usize = MAGIC_LEN;
const HEADER_AT: usize = SHORT_OVERHEAD - HEADER_LEN;
const PAYLOAD_AT: usize = SHORT_OVERHEAD;
/// Bytes that are shown of a value of many.
const BYTES_SHOWN: usize = 12;

/// A field with its words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) name: String,
    pub(super) value: String,
    pub(super) unit: String,
    /// First byte, and how many.
    pub(super) at: (usize, usize),
    pub(super) depth: usize,
}

impl Part {
    fn new(name: &str, value: String, at: (usize, usize)) -> Self {
        Self { name: name.to_owned(), value, unit: String::new(), at, depth: 0 }
    }

    /// As the inspector takes it.
    pub(super) fn field(&self) -> Field<'_> {
        Field {
            name: &self.name,
            value: &self.value,
            unit: &self.unit,
            start_bit: self.at.0 * 8,
            bits: self.at.1 * 8,
            depth: self.depth,
            level: None,
        }
    }
}

/// What is known of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Dissected {
    pub(super) parts: Vec<Part>,
    /// Whether the checksum is right.
    pub(super) crc: bool,
    /// Why the packet cannot be read; `None`: it can.
    pub(super) fault: Option<String>,
}

/// Tells the parts of a frame, of a damaged one as far as they can be told.
pub(super) fn dissect(bytes: &[u8]) -> Dissected {
    let mut parts = Vec::new();
    let has = |from: usize, len: usize| bytes.get(from..from + len);
    if let Some(magic) = has(0, MAGIC_LEN) {
        parts.push(Part::new("magic", String::from_utf8_lossy(magic).into_owned(), (0, MAGIC_LEN)));
    }
    if let Some(crc) = has(CRC_AT, 4) {
        parts.push(Part::new("crc", hex(crc), (CRC_AT, 4)));
    }
    let frame = match DownFrame::parse(bytes) {
        Ok(frame) => frame,
        Err(error) => return Dissected { parts, crc: false, fault: Some(error.to_string()) },
    };
    let header = frame.raw_header();
    let packet = frame.packet();
    let name = packet.as_ref().map_or("unknown", |packet| packet.name());
    parts.push(Part::new("type", format!("{} {name}", header.packet_type), (HEADER_AT, 1)));
    let tag = frame.tag().map_or_else(|| "unsolicited".to_owned(), |tag| tag.get().to_string());
    parts.push(Part::new("tag", tag, (HEADER_AT + 1, 1)));
    parts.push(Part::new("length", header.length.to_string(), (HEADER_AT + 2, 2)));
    let payload = frame.payload().len();
    let fault = match &packet {
        Err(error) => {
            if payload > 0 {
                parts.push(Part::new("payload", format!("{payload} bytes"), (PAYLOAD_AT, payload)));
            }
            Some(error.to_string())
        }
        Ok(packet) => {
            let before = parts.len();
            packet.visit_fields(&mut |field| parts.push(part(packet.name(), &field)));
            if parts.len() == before && payload > 0 {
                parts.push(Part::new("payload", format!("{payload} bytes"), (PAYLOAD_AT, payload)));
            }
            None
        }
    };
    let end = PAYLOAD_AT + payload;
    if end < bytes.len() {
        parts.push(Part::new("padding", format!("{} bytes", bytes.len() - end), (end, bytes.len() - end)));
    }
    Dissected { parts, crc: true, fault }
}

fn part(packet: &str, field: &protocol::Field<'_>) -> Part {
    let name = match field.index {
        Some(index) => format!("{}[{index}]", field.name),
        None => field.name.to_owned(),
    };
    let parameter = format!("{}.{}", packet.to_ascii_lowercase(), field.name);
    let (value, unit) = match field.value {
        FieldValue::F32(value) if value.is_nan() => ("NaN".to_owned(), String::new()),
        FieldValue::F32(value) if value.is_infinite() => (value.to_string(), String::new()),
        FieldValue::F32(value) => {
            let quantity = words::quantity(&parameter, field.unit, Some(f64::from(value)));
            (quantity.number, quantity.unit)
        }
        FieldValue::U(value) if field.unit == "ms" => {
            let quantity = words::quantity(&parameter, field.unit, Some(value as f64));
            (quantity.number, quantity.unit)
        }
        FieldValue::U(value) => (value.to_string(), field.unit.to_owned()),
        FieldValue::Bool(value) => (if value { "yes" } else { "no" }.to_owned(), String::new()),
        FieldValue::Bytes(bytes) if bytes.len() > BYTES_SHOWN => {
            let part = if bytes.len() == CHUNK_LEN { "of the image" } else { "" };
            (format!("{} bytes {part}", bytes.len()).trim_end().to_owned(), String::new())
        }
        FieldValue::Bytes(bytes) => (hex(bytes), String::new()),
    };
    let at = (PAYLOAD_AT + usize::from(field.offset), usize::from(field.len));
    Part { name, value, unit, at, depth: 1 }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use protocol::{Downlink, FRAME_LEN, FrameForm, encode_down};
    use ui::inspector::field_at;

    const HEARTBEAT: usize = 117;

    use super::*;

    fn heartbeat(form: FrameForm) -> Vec<u8> {
        let payload: Vec<u8> =
            (0..HEARTBEAT).map(|place| if place == 116 { 1 } else { place as u8 }).collect();
        let packet = Downlink::decode(6, &payload).unwrap();
        let mut out = [0; FRAME_LEN];
        let length = encode_down(&packet, None, form, &mut out);
        out[..length].to_vec()
    }

    /// Every byte belongs to exactly one part, and the bytes of a part are those that its value is read from.
    #[test]
    fn parts_lie_side_by_side_and_hold_what_they_say() {
        for form in [FrameForm::Short, FrameForm::Full] {
            let bytes = heartbeat(form);
            let told = dissect(&bytes);
            assert!(told.crc && told.fault.is_none());
            let mut next = 0;
            for part in &told.parts {
                assert_eq!(part.at.0, next, "{}", part.name);
                next += part.at.1;
            }
            assert_eq!(next, bytes.len());
            let fields: Vec<Field<'_>> = told.parts.iter().map(Part::field).collect();
            for place in 0..bytes.len() {
                let part = &told.parts[field_at(&fields, place).unwrap()];
                assert!((part.at.0..part.at.0 + part.at.1).contains(&place));
            }
            let of = |name: &str| told.parts.iter().find(|part| part.name == name).unwrap();
            let temp = of("temp").at;
            assert_eq!(temp.1, 4);
            let raw = f32::from_be_bytes(bytes[temp.0..temp.0 + 4].try_into().unwrap());
            assert_eq!(of("temp").value, words::quantity("heartbeat.temp", "°C", Some(raw.into())).number);
            assert_eq!((of("cam").value.as_str(), of("cam").at), ("yes", (16 + 116, 1)));
        }
    }

    #[test]
    fn damaged_frames_are_told_as_far_as_they_go() {
        let mut bytes = heartbeat(FrameForm::Short);
        bytes[40] ^= 1;
        let told = dissect(&bytes);
        assert!(!told.crc && told.fault.is_some() && told.parts.len() == 2);
        for end in 0..bytes.len() {
            assert!(!dissect(&bytes[..end]).crc);
        }
        assert!(dissect(&[]).parts.is_empty());
    }

    #[test]
    fn what_is_no_number_is_named() {
        let mut payload = vec![0; HEARTBEAT];
        payload[..4].copy_from_slice(&f32::NAN.to_be_bytes());
        payload[4..8].copy_from_slice(&f32::INFINITY.to_be_bytes());
        let packet = Downlink::decode(6, &payload).unwrap();
        let mut out = [0; FRAME_LEN];
        let length = encode_down(&packet, None, FrameForm::Short, &mut out);
        let told = dissect(&out[..length]);
        let of = |name: &str| told.parts.iter().find(|part| part.name == name).unwrap().value.clone();
        assert_eq!((of("r_teme.x"), of("r_teme.y")), ("NaN".to_owned(), "inf".to_owned()));
        assert_eq!(of("timestamp"), "no clock");
    }
}
