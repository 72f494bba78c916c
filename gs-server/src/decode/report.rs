//! The JSON objects of `gs-server decode`: one per frame, and what was skipped between them.

use std::fmt;

use protocol::{DownFrame, Downlink, ErrorCode, Field, FieldValue, FrameForm, SealedUplink, crc32};
use serde::ser::{SerializeMap as _, Serializer};
use serde::{Deserialize, Serialize};

use super::format::TextNote;
use super::skipped::Skipped;

/// One line of output.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Report {
    /// A downlink frame whose checksum is right.
    Frame(FrameReport),
    /// What looks like a telecommand on its way up; only its key could tell.
    SealedUplink(UplinkReport),
    /// Bytes that belong to nothing.
    Skipped(Skipped),
    /// Characters that are not text of the format.
    Text(TextNote),
    /// The last line.
    Summary(Summary),
}

/// A downlink frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameReport {
    /// First byte of its magic, counted from the start of the input.
    pub offset: u64,
    /// Bytes of the frame.
    pub length: usize,
    /// `short` or `full`.
    pub form: &'static str,
    /// Name of the packet, `Unknown` for a type that the ICD does not have.
    pub name: &'static str,
    /// Packet type byte.
    #[serde(rename = "type")]
    pub packet_type: u8,
    /// Tag of the request that it answers; null when unsolicited.
    pub tag: Option<u8>,
    /// It stands inside another valid frame.
    pub nested: bool,
    /// Received power in dBm, when the radio said it.
    pub rssi_dbm: Option<i16>,
    /// The values, in the order of the payload; null when the payload does not follow the ICD.
    pub fields: Option<Fields>,
    /// Why there are no values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The whole frame in hex, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hex: Option<String>,
    /// The payload in hex, where there are no values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload_hex: Option<String>,
}

impl FrameReport {
    /// Tells what is in a frame.
    pub fn new(offset: u64, frame: &DownFrame<'_>, nested: bool) -> Self {
        let packet = frame.packet();
        let name = Downlink::name_of(frame.packet_type()).unwrap_or("Unknown");
        let (fields, error) = match &packet {
            Ok(Downlink::Unknown { .. }) => (None, Some("no packet of the ICD has this type".to_owned())),
            Ok(packet) => (Some(Fields::of(packet)), None),
            Err(error) => (None, Some(error.to_string())),
        };
        Self {
            offset,
            length: frame.bytes().len(),
            form: match frame.form() {
                FrameForm::Short => "short",
                FrameForm::Full => "full",
            },
            name,
            packet_type: frame.packet_type(),
            tag: frame.tag().map(protocol::RequestTag::get),
            nested,
            rssi_dbm: None,
            hex: None,
            payload_hex: fields.is_none().then(|| hex::encode(frame.payload())),
            fields,
            error,
        }
    }

    /// First byte after the frame.
    pub fn end(&self) -> u64 {
        self.offset + self.length as u64
    }
}

/// A sealed uplink frame, seen from outside.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UplinkReport {
    /// First byte of its magic, counted from the start of the input.
    pub offset: u64,
    /// Always 240.
    pub length: usize,
    /// Uplink counter, from the nonce.
    pub counter: u64,
    /// The whole nonce, in hex.
    pub nonce: String,
    /// Checksum of the plaintext as the frame carries it, in hex.
    pub crc32: String,
    /// CRC-32 of the 240 bytes, to tell copies from repetitions, in hex.
    pub frame_crc32: String,
    /// It stands inside a downlink frame.
    pub nested: bool,
}

impl UplinkReport {
    /// Tells what can be told without a key.
    pub fn new(offset: u64, frame: &SealedUplink, nested: bool) -> Self {
        Self {
            offset,
            length: frame.as_bytes().len(),
            counter: frame.nonce().counter().0,
            nonce: hex::encode(frame.nonce().as_bytes()),
            crc32: format!("{:08x}", frame.crc()),
            frame_crc32: format!("{:08x}", crc32(frame.as_bytes())),
            nested,
        }
    }
}

/// What an input came to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Summary {
    /// Bytes, after hex or base64 was undone.
    pub bytes: u64,
    /// Downlink frames.
    pub frames: u64,
    /// Those of them that stand inside others.
    pub nested: u64,
    /// Frames whose payload does not follow the ICD.
    pub malformed: u64,
    /// Candidates whose checksum is wrong.
    pub bad: u64,
    /// Sealed uplink frames.
    pub sealed_uplinks: u64,
    /// Bytes that belong to nothing.
    pub skipped_bytes: u64,
}

/// The values of a packet: an object in the order of the payload, `{"temp": {"value": 21.5, "unit": "degC"}}`.
#[derive(Debug, Clone, PartialEq)]
pub struct Fields(Vec<Value>);

#[derive(Debug, Clone, PartialEq)]
struct Value {
    name: Name,
    unit: &'static str,
    scalar: Scalar,
}

#[derive(Debug, Clone, PartialEq)]
struct Name(&'static str, Option<u8>);

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.1 {
            Some(index) => write!(f, "{}[{index}]", self.0),
            None => f.write_str(self.0),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Scalar {
    F32(f32),
    U(u64),
    Bool(bool),
    Text(String),
}

impl Fields {
    fn of(packet: &Downlink) -> Self {
        let mut values = Vec::new();
        packet.visit_fields(&mut |Field { name, index, unit, value, .. }| {
            let scalar = match value {
                FieldValue::F32(value) => Scalar::F32(value),
                FieldValue::U(value) => Scalar::U(value),
                FieldValue::Bool(value) => Scalar::Bool(value),
                FieldValue::Bytes(bytes) => Scalar::Text(hex::encode(bytes)),
            };
            values.push(Value { name: Name(name, index), unit, scalar });
        });
        if let Downlink::Error(code) = packet {
            let text = error_text(*code);
            values.push(Value { name: Name("name", None), unit: "", scalar: Scalar::Text(text) });
        }
        Self(values)
    }

    /// Values as a person reads them: `temp=21.5 degC cam=true`.
    pub fn one_line(&self) -> String {
        let mut line = String::new();
        for Value { name, unit, scalar } in &self.0 {
            let space = if unit.is_empty() { "" } else { " " };
            let text = match scalar {
                Scalar::F32(value) => value.to_string(),
                Scalar::U(value) => value.to_string(),
                Scalar::Bool(value) => value.to_string(),
                Scalar::Text(text) if text.len() > 24 => format!("{}...", &text[..16]),
                Scalar::Text(text) => text.clone(),
            };
            line.push_str(&format!(" {name}={text}{space}{unit}"));
        }
        line
    }
}

fn error_text(code: ErrorCode) -> String {
    code.to_string()
}

impl Serialize for Fields {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for value in &self.0 {
            map.serialize_entry(&value.name.to_string(), value)?;
        }
        map.end()
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        match &self.scalar {
            // A failed sensor. JSON has no NaN, and null alone would mean 'unknown'.
            Scalar::F32(value) if !value.is_finite() => {
                map.serialize_entry("value", &())?;
                map.serialize_entry("invalid", &true)?;
            }
            Scalar::F32(value) => map.serialize_entry("value", value)?,
            Scalar::U(value) => map.serialize_entry("value", value)?,
            Scalar::Bool(value) => map.serialize_entry("value", value)?,
            Scalar::Text(value) => map.serialize_entry("value", value)?,
        }
        if !self.unit.is_empty() {
            map.serialize_entry("unit", self.unit)?;
        }
        map.end()
    }
}
