//! What was heard.

use protocol::{Downlink, FieldValue};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{OutsideView, Time};

/// Numbers above this are written as text: a JavaScript reader would round them.
const SAFE_INTEGER: u64 = (1 << 53) - 1;

/// A raw frame of the archive.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameView {
    /// Frame.
    pub id: u64,
    /// Satellite.
    pub satellite: String,
    /// Station that heard it first.
    pub station: String,
    /// Link that heard it first.
    pub link: String,
    /// When its last byte was received.
    pub heard_at: Time,
    /// `full` or `short`.
    pub form: String,
    /// Packet type byte; `null` when the header makes no sense.
    pub packet_type: Option<u8>,
    /// Name of the packet; `null` when nobody knows the type.
    pub packet_name: Option<String>,
    /// Request tag that it answers; `null` when unsolicited.
    pub tag: Option<u8>,
    /// It lay inside another valid frame, and changed nothing.
    pub nested: bool,
    /// Length in bytes.
    pub length: u32,
    /// The whole frame in hex.
    pub hex: String,
    /// The decoded packet; only when one frame is asked for, and it decodes.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub packet: Option<PacketView>,
    /// Why it does not decode; only when one frame is asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub undecoded: Option<String>,
    /// Who heard it, of our stations.
    pub receptions: Vec<ReceptionView>,
    /// Who heard it besides: TinyGS, SatNOGS, files.
    #[serde(default)]
    pub heard_elsewhere: Vec<OutsideView>,
}

/// One station heard one frame.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReceptionView {
    /// Satellite.
    pub satellite: String,
    /// Station.
    pub station: String,
    /// Link.
    pub link: String,
    /// `radio` or `file`.
    pub source: String,
    /// When the last byte was received.
    pub received_at: Time,
    /// Received power in dBm.
    pub rssi_dbm: Option<i16>,
}

/// A packet as names and values.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PacketView {
    /// Name of the packet, e.g. `Heartbeat`.
    pub name: String,
    /// Its fields in the order of the wire.
    pub fields: Vec<FieldView>,
}

/// One value of a packet.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FieldView {
    /// Name, e.g. `r_teme.x`.
    pub name: String,
    /// Entry that it belongs to, in a list.
    pub index: Option<u8>,
    /// Unit; empty when it has none or nobody knows it.
    pub unit: String,
    /// Number, boolean, hex text for bytes, decimal text for integers above 2^53; `null` for NaN and infinities.
    pub value: Value,
}

impl PacketView {
    /// The packet, field by field.
    #[must_use]
    pub fn from_packet(packet: &Downlink) -> Self {
        let mut fields = Vec::new();
        packet.visit_fields(&mut |field| {
            fields.push(FieldView {
                name: field.name.to_owned(),
                index: field.index,
                unit: field.unit.to_owned(),
                value: value(&field.value),
            });
        });
        Self { name: packet.name().to_owned(), fields }
    }
}

fn value(value: &FieldValue<'_>) -> Value {
    match *value {
        // A failed sensor: legal downlink, but no number in JSON.
        FieldValue::F32(v) if !v.is_finite() => Value::Null,
        FieldValue::F32(v) => shortest(v),
        FieldValue::U(v) if v > SAFE_INTEGER => Value::String(v.to_string()),
        FieldValue::U(v) => v.into(),
        FieldValue::Bool(v) => v.into(),
        FieldValue::Bytes(bytes) => Value::String(hex::encode(bytes)),
    }
}

/// 0.1f32 is shown as 0.1, not as 0.10000000149011612: the shortest decimal that reads back as the same f32.
pub(crate) fn shortest(v: f32) -> Value {
    v.to_string().parse::<f64>().map_or(Value::Null, Value::from)
}
