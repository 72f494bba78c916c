//! Our own export: one reception a line, with everything that is known of it.

use mission::UtcUs;
use mission::reception::{Content, Ear, RadioCrc, Reception, Refusal, Said, Signal, TimeBasis};
use serde_json::json;

use super::Context;
use super::tree::{Object, Value};
use super::value::{Fields, stamp};

/// An error of a time beyond this is none that is known, seconds: a year.
const ERROR_MOST_S: f64 = 31_536_000.0;

/// The line of a reception.
pub fn export(reception: &Reception) -> String {
    let Reception { receiver, signal, .. } = reception;
    json!({
        "pixelsat_reception": 1,
        "source": reception.ear.name(),
        "source_id": reception.source_id,
        "receiver": {
            "id": receiver.id, "name": receiver.name, "latitude_deg": receiver.latitude_deg,
            "longitude_deg": receiver.longitude_deg, "altitude_m": receiver.altitude_m,
        },
        "received_at": time(reception.received_at),
        "time_basis": reception.time_basis.name(),
        "time_error_s": reception.time_error_us.map(|us| us as f64 / 1e6),
        "frequency_hz": signal.frequency_hz,
        "frequency_offset_hz": signal.frequency_offset_hz,
        "doppler_hz": signal.doppler_hz,
        "frequency_error_hz": signal.frequency_error_hz,
        "spreading_factor": signal.spreading_factor,
        "bandwidth_hz": signal.bandwidth_hz,
        "coding_rate": signal.coding_rate,
        "rssi_dbm": signal.rssi_dbm,
        "snr_db": signal.snr_db,
        "radio_crc": reception.radio_crc.name(),
        "noisy": reception.noisy,
        "label": reception.label,
        "norad": reception.norad,
        "hex": bytes(reception),
    })
    .to_string()
}

/// The names of the columns of [`csv`].
pub const CSV_HEAD: &str = "received_at,time_basis,time_error_s,kind,source,source_id,receiver,receiver_name,latitude_deg,longitude_deg,\
    altitude_m,frequency_hz,frequency_offset_hz,doppler_hz,frequency_error_hz,spreading_factor,bandwidth_hz,coding_rate,\
    rssi_dbm,snr_db,radio_crc,noisy,label,norad,hex";

/// The line of a reception in a table.
pub fn csv(reception: &Reception) -> String {
    let Reception { receiver, signal, .. } = reception;
    let number = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    let small = |value: Option<u8>| value.map(|value| value.to_string()).unwrap_or_default();
    [
        time(reception.received_at).unwrap_or_default(),
        reception.time_basis.name().to_owned(),
        number(reception.time_error_us.map(|us| us as f64 / 1e6)),
        reception.content.kind().to_owned(),
        reception.ear.name().to_owned(),
        cell(&reception.source_id),
        cell(reception.receiver_id()),
        cell(receiver.name.as_deref().unwrap_or_default()),
        number(receiver.latitude_deg),
        number(receiver.longitude_deg),
        number(receiver.altitude_m),
        number(signal.frequency_hz),
        number(signal.frequency_offset_hz),
        number(signal.doppler_hz),
        number(signal.frequency_error_hz),
        small(signal.spreading_factor),
        number(signal.bandwidth_hz),
        small(signal.coding_rate),
        number(signal.rssi_dbm),
        number(signal.snr_db),
        reception.radio_crc.name().to_owned(),
        reception.noisy.to_string(),
        cell(reception.label.as_deref().unwrap_or_default()),
        reception.norad.map(|norad| norad.to_string()).unwrap_or_default(),
        bytes(reception).unwrap_or_default(),
    ]
    .join(",")
}

/// Text of a stranger as a cell: quoted where need be, and never a formula.
fn cell(text: &str) -> String {
    let formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    let text = format!("{}{text}", if formula { "'" } else { "" });
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

/// The frame, or what is left of one.
fn bytes(reception: &Reception) -> Option<String> {
    match &reception.content {
        Content::Frame { bytes, .. } => Some(hex::encode(bytes)),
        Content::Damaged { delivered, .. } => Some(hex::encode(delivered)),
        Content::Detection => None,
    }
}

fn time(at: UtcUs) -> Option<String> {
    jiff::Timestamp::from_microsecond(at.0).ok().map(|at| format!("{at:.6}"))
}

/// How far off the time may be, microseconds: as the line says; what is usual where an older export or a hand left it out.
fn error_us(object: &Object<'_>, basis: TimeBasis) -> Option<u64> {
    match object.get("time_error_s") {
        Some(Value::Null) => None,
        Some(told @ (Value::Count(_) | Value::Below(_) | Value::Number(_))) => {
            let seconds = told.as_f64().filter(|seconds| (0.0..=ERROR_MOST_S).contains(seconds));
            seconds.map(|seconds| (seconds * 1e6).round() as u64)
        }
        _ => basis.usual_error_us(),
    }
}

/// A line that [`export`] wrote.
pub(super) fn said(object: &Object<'_>, body: &[u8], context: &Context) -> Result<Said, Refusal> {
    let mut fields = Fields::of(object, mission::reception::Doubts::default());
    let ear = fields.text("source").and_then(Ear::from_name).unwrap_or(Ear::File);
    let source_id = fields.text("source_id").ok_or(Refusal::Malformed)?.to_owned();
    let mut said = context.said(ear, source_id);
    let basis = fields.text("time_basis").and_then(TimeBasis::from_name);
    // Whoever hands in a time knows more than an archive that had none.
    let is_undated = basis == Some(TimeBasis::Import) && context.at.is_some();
    if let Some(at) = fields.text("received_at").and_then(stamp).filter(|_| !is_undated) {
        said.times.stated = Some(at);
        said.times.stated_as = basis.map(|basis| (basis, error_us(object, basis)));
    }
    said.signal = Signal {
        frequency_hz: fields.number("frequency_hz"),
        frequency_offset_hz: fields.number("frequency_offset_hz"),
        doppler_hz: fields.number("doppler_hz"),
        frequency_error_hz: fields.number("frequency_error_hz"),
        spreading_factor: fields.small("spreading_factor"),
        bandwidth_hz: fields.number("bandwidth_hz"),
        coding_rate: fields.small("coding_rate"),
        rssi_dbm: fields.number("rssi_dbm"),
        snr_db: fields.number("snr_db"),
    };
    said.radio_crc = match fields.text("radio_crc") {
        Some("right") => RadioCrc::Right,
        Some("wrong") => RadioCrc::Wrong,
        _ => RadioCrc::Unknown,
    };
    said.noisy = fields.truth("noisy").unwrap_or(false);
    said.label = fields.text("label").map(str::to_owned);
    said.norad = fields.catalogue("norad");
    said.bytes = fields.text("hex").map(hex::decode).transpose().map_err(|_| Refusal::BadBytes)?;
    said.doubts = fields.doubts;
    if let Some(Value::Object(receiver)) = object.get("receiver") {
        let mut fields = Fields::of(receiver, said.doubts);
        said.receiver.id = fields.text("id").map(str::to_owned);
        said.receiver.name = fields.text("name").map(str::to_owned);
        said.receiver.latitude_deg = fields.number("latitude_deg");
        said.receiver.longitude_deg = fields.number("longitude_deg");
        said.receiver.altitude_m = fields.number("altitude_m");
        said.doubts = fields.doubts;
    }
    said.original = Some(body.into());
    Ok(said)
}
