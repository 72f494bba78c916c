//! Telecommands to JSON.

use protocol::Telecommand;
use serde_json::{Map, Value, json};

use crate::Time;
use crate::frame::shortest;

/// The arguments of a telecommand by name: what [`super::parse`] reads back.
#[must_use]
pub fn arguments(command: &Telecommand) -> Map<String, Value> {
    match value(command) {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

fn value(command: &Telecommand) -> Value {
    match command {
        Telecommand::Ping
        | Telecommand::GetImageInfo
        | Telecommand::Reset
        | Telecommand::GetAdcsInfo
        | Telecommand::SetAdcsOmegaKill
        | Telecommand::SetAdcsAuto
        | Telecommand::GetModeReport => json!({}),
        Telecommand::GetImageChunk { first, count } => json!({ "first": first, "count": count }),
        Telecommand::ExecuteTorqueProfile(profile) => json!({
            "steps": each(&profile.steps, |step| json!({
                "torque_n_m": vector(step.torque_n_m),
                "duration_ms": step.duration_ms,
            })),
        }),
        Telecommand::CaptureImage { resolution, grey, strong_compression } => json!({
            "resolution": resolution.to_string(),
            "grey": grey,
            "strong_compression": strong_compression,
        }),
        Telecommand::SetDownlinkSchedule(schedule) => json!({
            "slots": each(&schedule.slots, |slot| json!({
                "time": time(slot.time_ms),
                "first": slot.first,
                "count": slot.count,
                "attitude_mrp": slot.attitude_mrp.map(vector),
            })),
        }),
        Telecommand::SetAdcsAttitude { attitude_mrp } => json!({ "attitude_mrp": vector(*attitude_mrp) }),
        Telecommand::SetAdcsTarget { latitude_deg, longitude_deg } => json!({
            "latitude_deg": shortest(*latitude_deg),
            "longitude_deg": shortest(*longitude_deg),
        }),
        Telecommand::SetTimestamp { utc_ms } => json!({ "utc": time(*utc_ms) }),
        Telecommand::SetTle(lines) => json!({ "line_1": lines.line_1(), "line_2": lines.line_2() }),
        Telecommand::GetImageRanges(ranges) => json!({
            "ranges": each(&ranges.ranges, |range| json!({ "first": range.first, "count": range.count })),
        }),
        Telecommand::SetTransmitter { on } => json!({ "on": on }),
        Telecommand::SetMode { mode, substate } => json!({ "mode": mode, "substate": substate }),
        Telecommand::UploadSchedule(upload) => json!({
            "schedule": upload.schedule,
            "part": upload.part,
            "parts": upload.parts,
            "entries_crc32": upload.entries_crc32,
            "entries": each(&upload.entries, |entry| json!({
                "time": time(entry.time_ms),
                "script": entry.script,
                "argument": vector(entry.argument),
            })),
        }),
        Telecommand::SetParameter { parameter, value } => json!({
            "parameter": parameter,
            "value": shortest(*value),
        }),
        Telecommand::UploadScript(upload) => json!({
            "script": upload.script,
            "part": upload.part,
            "parts": upload.parts,
            "steps": each(&upload.steps, |step| json!({
                "offset_ms": step.offset_ms,
                "command": step.command,
                "argument": vector(step.argument),
                "expect": step.expect,
                "timeout_ms": step.timeout_ms,
                "on_fail": step.on_fail,
            })),
        }),
        Telecommand::GetEvents { first } => json!({ "first": first }),
        Telecommand::UploadGuidance(guidance) => json!({
            "id": guidance.id,
            "actuator": guidance.actuator,
            "start": time(guidance.start_ms),
            "coefficients": each(&guidance.coefficients, |coefficient| vector(*coefficient)),
        }),
    }
}

fn each<T>(entries: &[T], write: impl Fn(&T) -> Value) -> Value {
    entries.iter().map(write).collect()
}

fn vector(vector: [f32; 3]) -> Value {
    vector.into_iter().map(shortest).collect()
}

fn time(ms: u64) -> Value {
    let us = i64::try_from(ms).unwrap_or(i64::MAX).saturating_mul(1000);
    Value::String(Time::from_unix_us(us).to_string())
}
