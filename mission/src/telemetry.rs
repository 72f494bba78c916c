//! Values out of a packet: one place, for live frames and for `redecode` alike.

use std::collections::BTreeSet;

use protocol::{DOWN_PAYLOAD_MAX, Downlink, FieldValue};

use crate::record::Point;

/// The names of all values that any packet can bring.
pub fn known_parameters() -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for packet_type in 0..=u8::MAX {
        // Lists (events) have as many entries as their first byte says.
        let payload = [0; DOWN_PAYLOAD_MAX];
        let packet = (0..=payload.len()).find_map(|len| Downlink::decode(packet_type, &payload[..len]).ok());
        if let Some(packet) = packet {
            names.extend(points(&packet).into_iter().map(|point| point.parameter));
        }
    }
    names
}

/// The values of a packet, named `packet.field`. Chunks and packets without fields give none.
///
/// NaN and infinities are legal downlink (a failed sensor): the point is there, its value is `None`.
pub fn points(packet: &Downlink) -> Vec<Point> {
    let mut points = Vec::new();
    if matches!(packet, Downlink::ImageChunk(_)) {
        return points;
    }
    let prefix = packet.name().to_ascii_lowercase();
    packet.visit_fields(&mut |field| {
        let value = match field.value {
            FieldValue::F32(v) => Some(f64::from(v)).filter(|v| v.is_finite()),
            #[expect(
                clippy::cast_precision_loss,
                reason = "counters and times stay far below 2^53 for 285 years"
            )]
            FieldValue::U(v) => Some(v as f64),
            FieldValue::Bool(v) => Some(f64::from(u8::from(v))),
            FieldValue::Bytes(_) => return,
        };
        points.push(Point { parameter: format!("{prefix}.{}", field.name), unit: field.unit, value });
    });
    points
}
