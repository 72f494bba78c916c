//! Lines of hex, as people type and programs log them: `2026-11-22T03:11:21.123Z rssi=-120 50 49 58 45 …`.

use mission::reception::{Doubt, Ear, Refusal, Said};

use super::value::stamp;
use super::{Context, digest};

/// A line: a time or none, `name=value` words for `rssi`, `snr`, `ferr` (Hz) and `station`, then hex with blanks,
/// colons, commas or `0x` between its bytes.
pub(super) fn line(body: &[u8], occurrence: u32, context: &Context) -> Result<Said, Refusal> {
    let text = std::str::from_utf8(body).map_err(|_| Refusal::Malformed)?;
    let mut said = context.said(Ear::File, String::new());
    let (time, rest) = time_before(text);
    said.times.stated = time.or(said.times.stated);
    let mut digits = String::new();
    for word in
        rest.split(|c: char| c.is_whitespace() || matches!(c, ',' | ':' | ';')).filter(|w| !w.is_empty())
    {
        if let Some((name, value)) = word.split_once('=') {
            let number = value.parse::<f64>().ok();
            match name.to_ascii_lowercase().as_str() {
                "rssi" => said.signal.rssi_dbm = number,
                "snr" => said.signal.snr_db = number,
                "ferr" => said.signal.frequency_error_hz = number,
                "station" => {
                    said.receiver.name = Some(value.to_owned());
                    said.receiver.id = Some(value.to_owned());
                    continue;
                }
                _ => return Err(Refusal::Malformed),
            }
            if number.is_none() {
                said.doubts.add(Doubt::WrongType);
            }
        } else {
            digits.push_str(word.strip_prefix("0x").unwrap_or(word));
        }
    }
    if digits.is_empty() {
        return Err(Refusal::NoBytes);
    }
    let bytes = hex::decode(&digits).map_err(|_| Refusal::BadBytes)?;
    let count = if time.is_some() { 0 } else { occurrence };
    let at = time.map_or(0, |at| at.0);
    said.source_id = digest(&[&bytes, &at.to_le_bytes(), &count.to_le_bytes()]);
    said.bytes = Some(bytes);
    said.original = Some(body.into());
    Ok(said)
}

/// A time at the beginning, as one word or as two (date and time).
fn time_before(text: &str) -> (Option<mission::UtcUs>, &str) {
    let ends = text.match_indices(char::is_whitespace).map(|(at, _)| at).take(2);
    let ends: Vec<usize> = ends.collect();
    for end in ends.into_iter().rev() {
        let (head, rest) = text.split_at(end);
        if let Some(time) = stamp(head.trim_end_matches(',')) {
            return (Some(time), rest);
        }
    }
    (None, text)
}
