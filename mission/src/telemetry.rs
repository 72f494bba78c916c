//! Values out of a packet: one place, for live frames and for `redecode` alike.

use std::collections::BTreeSet;

use protocol::{DOWN_PAYLOAD_MAX, Downlink, FieldValue};

use crate::record::Point;

/// The names of all values that any packet can bring.
pub fn known_parameters() -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for packet_type in 0..=u8::MAX {
        // Lists (events) have as many entries as their first byte says: one, so that its values are named, too.
        let mut payload = [0; DOWN_PAYLOAD_MAX];
        payload[0] = 1;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_xtce_for_strangers_has_every_parameter_of_the_archive_and_no_other() {
        let xtce = include_str!("../../docs/decoder/pixelsat.xtce.xml");
        let aliases = xtce.split("alias=\"").skip(1).filter_map(|rest| rest.split_once('"'));
        let aliases: BTreeSet<String> = aliases.map(|(alias, _)| alias.to_owned()).collect();
        assert_eq!(aliases, known_parameters());
    }
}
