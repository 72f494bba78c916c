//! The step `upload-schedule`: entries to one telecommand or several.

use api::{StepText, telecommand};
use protocol::{ScheduleUpload, Telecommand};
use serde_json::{Map, Value, json};

use super::words::Reader;

/// Entries of one UploadSchedule (ICD section 7).
const PART: usize = 8;

/// The telecommands that carry the step's schedule; what is wrong with its entries is told to `reader`.
pub(super) fn telecommands(reader: &mut Reader, place: &str, words: &StepText) -> Option<Vec<Telecommand>> {
    match (&words.slots, &words.entries) {
        (Some(slots), None) => {
            if words.schedule.is_some() {
                reader.wrong(format!("{place}.schedule"), "belongs to 'entries'", "Take it out.");
            }
            let arguments = map(json!({ "slots": slots }));
            parse(reader, place, "SetDownlinkSchedule", arguments, 0).map(|telecommand| vec![telecommand])
        }
        (None, Some(entries)) => {
            let schedule =
                reader.required(place, "schedule", words.schedule, "the number of the schedule")?;
            parts(reader, place, schedule, entries)
        }
        (Some(_), Some(_)) => {
            reader.wrong(
                format!("{place}.entries"),
                "'slots' and 'entries' are both there",
                "'slots' is the downlink schedule, 'entries' that of the autonomy extension: make two steps.",
            );
            None
        }
        (None, None) => {
            reader.wrong(
                format!("{place}.slots"),
                "there is no schedule",
                "Give 'slots' (SetDownlinkSchedule), or 'schedule' and 'entries' (UploadSchedule).",
            );
            None
        }
    }
}

fn parts(reader: &mut Reader, place: &str, schedule: u8, entries: &[Value]) -> Option<Vec<Telecommand>> {
    let count = entries.len().div_ceil(PART).max(1);
    let Ok(count) = u8::try_from(count) else {
        reader.wrong(format!("{place}.entries"), format!("{} entries", entries.len()), "2040 fit.");
        return None;
    };
    let empty: &[Value] = &[];
    let chunks = if entries.is_empty() { vec![empty] } else { entries.chunks(PART).collect() };
    let uploads: Vec<Option<ScheduleUpload>> = (0..count)
        .zip(chunks)
        .map(|(part, entries)| {
            let arguments = json!({
                "schedule": schedule, "part": part, "parts": count, "entries_crc32": 0, "entries": entries,
            });
            match parse(reader, place, "UploadSchedule", map(arguments), usize::from(part) * PART)? {
                Telecommand::UploadSchedule(upload) => Some(upload),
                _ => None,
            }
        })
        .collect();
    let mut uploads = uploads.into_iter().collect::<Option<Vec<_>>>()?;
    let bytes: Vec<u8> =
        uploads.iter().flat_map(|upload| &upload.entries).flat_map(|entry| entry.to_wire_bytes()).collect();
    let crc = protocol::crc32(&bytes);
    for upload in &mut uploads {
        upload.entries_crc32 = crc;
    }
    Some(uploads.into_iter().map(Telecommand::UploadSchedule).collect())
}

/// One telecommand; the places of its errors are those of the step, its list beginning at `first`.
fn parse(
    reader: &mut Reader,
    place: &str,
    name: &str,
    mut arguments: Map<String, Value>,
    first: usize,
) -> Option<Telecommand> {
    toml_times_as_text(&mut arguments);
    let errors = match telecommand::parse(name, &arguments) {
        Ok(telecommand) => return Some(telecommand),
        Err(errors) => errors,
    };
    for error in errors {
        let field = error.field.strip_prefix("arguments.").unwrap_or(&error.field);
        let field = further(field, first);
        reader.wrong(format!("{place}.{field}"), error.message, "Correct the entry; see docs/api.md.");
    }
    None
}

/// `entries[2].time` of a part that begins at entry `first`.
fn further(field: &str, first: usize) -> String {
    let parsed = field.split_once('[').and_then(|(list, rest)| {
        let (index, rest) = rest.split_once(']')?;
        Some(format!("{list}[{}]{rest}", index.parse::<usize>().ok()? + first))
    });
    parsed.unwrap_or_else(|| field.to_owned())
}

fn map(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

/// A time that stands in TOML without quotes is a time as well.
pub(super) fn toml_times_as_text(map: &mut Map<String, Value>) {
    map.values_mut().for_each(as_text);
}

fn as_text(value: &mut Value) {
    match value {
        Value::Array(entries) => entries.iter_mut().for_each(as_text),
        Value::Object(map) => match map.get("$__toml_private_datetime") {
            Some(Value::String(time)) => *value = Value::String(time.clone()),
            _ => toml_times_as_text(map),
        },
        _ => {}
    }
}
