//! What a radio module may answer to one request.

use radio::command::{Mode, READ, SWITCH_PREFIX, at, read, switch, write};
use radio::reply::{AtReply, Expected, MAX_VALUE_CHARS, Verdict, judge, parse_at, parse_ufreq};

const NAMES: [&str; 4] = ["FWCODE", "DEVTYPE", "UFREQ", "UAUX"];

/// First byte which request, second the register address, third how many registers; the rest is what comes back.
pub fn radio_reply(data: &[u8]) {
    let [which, address, len, bytes @ ..] = data else { return };
    let (address, len) = (*address, *len);
    let name = NAMES[usize::from(which >> 4) % NAMES.len()];
    let mode = Mode::from_code(which >> 4 & 3).unwrap_or(Mode::Normal);
    let values: Vec<u8> = (0..len).map(|n| n ^ address).collect();
    let (expected, request) = match which & 7 {
        0 | 1 => (Expected::Registers { address, len }, read(address, len).to_vec()),
        2 => (Expected::Registers { address, len }, write(which & 8 == 0, address, &values)),
        3 | 4 => (Expected::Switched { mode: mode.code() }, switch(mode).to_vec()),
        5 => (Expected::At { name }, at(&format!("{name}=1"), which & 8 == 0)),
        _ => (Expected::At { name }, at(&format!("{name}=?"), which & 8 == 0)),
    };
    for silent in [false, true] {
        holds(expected, &request, bytes, silent);
    }
    // What a driver sees of it: byte by byte, until it decides.
    let decided = (0..=bytes.len()).find(|&end| {
        let verdict = judge(expected, &request, &bytes[..end], false);
        verdict != Verdict::Wait && verdict != Verdict::Refused
    });
    if let Some(end) = decided {
        holds(expected, &request, &bytes[..end], false);
    }
    if let Some(AtReply::Value(value)) = parse_at(name, bytes) {
        ufreq(&value);
    }
    ufreq(&String::from_utf8_lossy(bytes));
}

/// What a verdict claims is in the bytes.
fn holds(expected: Expected, request: &[u8], bytes: &[u8], silent: bool) {
    match (expected, judge(expected, request, bytes, silent)) {
        (_, Verdict::Refused) => {
            assert!(silent, "a refusal is believed after silence only");
            assert!(bytes.windows(3).any(|w| w == [0xFF; 3]));
        }
        (Expected::Registers { address, len }, Verdict::Registers { data, before, .. }) => {
            assert_eq!(data.len(), usize::from(len));
            assert_eq!(bytes[before..before + 3], [READ, address, len]);
            assert_eq!(bytes[before + 3..before + 3 + data.len()], data);
        }
        (Expected::Registers { address, len }, Verdict::Wait) if silent => {
            let whole = bytes.windows(3 + usize::from(len)).any(|w| w.starts_with(&[READ, address, len]));
            assert!(!whole, "a whole answer was overlooked");
        }
        (Expected::Switched { mode }, Verdict::Switched { before, after, .. }) => {
            assert_eq!(bytes[before..after], [&SWITCH_PREFIX[1..], &[mode]].concat());
        }
        (Expected::At { .. }, Verdict::At { reply: AtReply::Value(value), .. }) => {
            assert!(!value.is_empty() && value.chars().count() <= MAX_VALUE_CHARS);
            assert_eq!(value.trim(), value);
            assert!(value.bytes().all(|b| b.is_ascii_graphic() || b == b' '));
            assert!(bytes.windows(value.len()).any(|w| w == value.as_bytes()), "a value was made up");
        }
        (Expected::At { .. }, Verdict::At { reply: AtReply::Ok, .. }) => {
            assert!(bytes.windows(2).any(|w| w == b"OK"));
        }
        (Expected::At { .. }, Verdict::At { reply: AtReply::Error, .. }) => {
            assert!(bytes.windows(3).any(|w| w == b"ERR" || w == [0xFF; 3]));
        }
        (_, Verdict::Wait) => {}
        (expected, verdict) => unreachable!("{verdict:?} to {expected:?}"),
    }
}

/// Numbers that are read are the numbers that stand there.
fn ufreq(text: &str) {
    if let Some((enabled, start_hz, step_hz, last)) = parse_ufreq(text) {
        let again = format!("{},{start_hz},{step_hz},{last}", u8::from(enabled));
        assert_eq!(parse_ufreq(&again), Some((enabled, start_hz, step_hz, last)));
        assert_eq!(text.matches(',').count(), 3);
    }
}
