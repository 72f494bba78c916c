//! What the module answers, found among junk, echoes and missing line ends.
//!
//! [`judge`] looks at everything received since the request, as often as bytes arrive and once more after silence. It
//! never panics and never looks at more than it was given; the caller bounds the buffer and the time.

use crate::command::{READ, SWITCH_PREFIX};

/// What a request asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// `C1 address len` and as many bytes.
    Registers {
        /// First register.
        address: u8,
        /// Number of registers.
        len: u8,
    },
    /// `C1 C2 C3 02 mode`.
    Switched {
        /// Mode number.
        mode: u8,
    },
    /// An AT reply to the command of this name.
    At {
        /// Between `AT+` and `=`.
        name: &'static str,
    },
}

/// Verdict on the bytes so far.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Not decided yet; after the time limit this means silence or garbage.
    Wait,
    /// Registers were answered.
    Registers {
        /// Their values.
        data: Vec<u8>,
        /// Bytes before the answer.
        before: usize,
        /// Whether our request came back among them.
        echo: bool,
    },
    /// The mode switch was acknowledged.
    Switched {
        /// Bytes before the answer.
        before: usize,
        /// First byte after the answer.
        after: usize,
        /// Whether our request came back among them.
        echo: bool,
    },
    /// An AT reply.
    At {
        /// What it says.
        reply: AtReply,
        /// Whether our request came back before it.
        echo: bool,
    },
    /// `FF FF FF`: the module did not understand.
    Refused,
}

/// Meaning of an AT reply.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AtReply {
    /// `=OK` or `+OK`.
    Ok,
    /// Anything with `ERR`, or `FF FF FF`.
    Error,
    /// The text after the last `=`, at most [`MAX_VALUE_CHARS`] characters.
    Value(String),
}

/// Longest value kept of an AT reply.
pub const MAX_VALUE_CHARS: usize = 64;

const REFUSAL: [u8; 3] = [0xFF; 3];

/// Looks for the answer to `request` in `bytes`. `silent` says that no byte has come for 50 ms, which ends a reply
/// that has no other end.
#[must_use]
pub fn judge(expected: Expected, request: &[u8], bytes: &[u8], silent: bool) -> Verdict {
    match expected {
        Expected::Registers { address, len } => registers(address, len, request, bytes, silent),
        Expected::Switched { mode } => switched(mode, request, bytes, silent),
        Expected::At { name } => at(name, request, bytes, silent),
    }
}

fn registers(address: u8, len: u8, request: &[u8], bytes: &[u8], silent: bool) -> Verdict {
    let header = [READ, address, len];
    let whole = header.len() + usize::from(len);
    let is_read = request == header;
    let complete = |from: usize| {
        (from..bytes.len()).find(|&at| bytes[at..].starts_with(&header) && bytes.len() - at >= whole)
    };
    let Some(mut at) = complete(0) else {
        return if silent && find(bytes, &REFUSAL).is_some() { Verdict::Refused } else { Verdict::Wait };
    };
    // The echo of a read looks like the head of its answer: "C1 00 09 C1 00 09 ...". Values that begin like a header
    // are believed only when nothing more comes, and the last whole answer wins.
    let mut echo = !is_read && find(&bytes[..at], request).is_some();
    if bytes[at + header.len()..].starts_with(&header) && is_read {
        if !silent {
            return Verdict::Wait;
        }
        while let Some(later) = complete(at + 1) {
            echo = true;
            at = later;
        }
    }
    Verdict::Registers { data: bytes[at + header.len()..at + whole].to_vec(), before: at, echo }
}

fn switched(mode: u8, request: &[u8], bytes: &[u8], silent: bool) -> Verdict {
    let [_, prefix @ ..] = SWITCH_PREFIX;
    let mut answer = [0; 5];
    answer[..4].copy_from_slice(&prefix);
    answer[4] = mode;
    // The request ends like its own answer, so an echo has to be stepped over.
    let echo_end = find(bytes, request).map(|at| at + request.len());
    let from = echo_end.unwrap_or(0);
    match find(&bytes[from..], &answer) {
        // An echo whose first byte was lost would pass for the answer; nothing can be done about that here, the
        // register read that follows will tell.
        Some(at) => {
            Verdict::Switched { before: from + at, after: from + at + answer.len(), echo: echo_end.is_some() }
        }
        None if silent && find(bytes, &REFUSAL).is_some() => Verdict::Refused,
        None => Verdict::Wait,
    }
}

fn at(name: &str, request: &[u8], bytes: &[u8], silent: bool) -> Verdict {
    let echo_end = find(bytes, request).map(|at| at + request.len());
    let echo = echo_end.is_some();
    let rest = &bytes[echo_end.unwrap_or(0)..];
    if !silent && !ends_with_newline(rest) {
        return Verdict::Wait;
    }
    match parse_at(name, rest) {
        Some(reply) => Verdict::At { reply, echo },
        None => Verdict::Wait,
    }
}

fn ends_with_newline(bytes: &[u8]) -> bool {
    matches!(bytes.last(), Some(b'\n' | b'\r'))
}

/// Meaning of the text of an AT reply to the command `name`; None if it makes none.
#[must_use]
pub fn parse_at(name: &str, bytes: &[u8]) -> Option<AtReply> {
    if find(bytes, b"ERR").is_some() || find(bytes, &REFUSAL).is_some() {
        return Some(AtReply::Error);
    }
    if find(bytes, b"=OK").is_some() || find(bytes, b"+OK").is_some() {
        return Some(AtReply::Ok);
    }
    let equals = bytes.iter().rposition(|&b| b == b'=')?;
    // A late reply to another command must not be taken for this one; a bare "=value" may.
    let label: Vec<u8> =
        bytes[..equals].iter().rev().take_while(|b| b.is_ascii_uppercase()).copied().collect();
    if !label.is_empty() && !name.bytes().rev().eq(label) {
        return None;
    }
    let value: String = bytes[equals + 1..]
        .iter()
        .take_while(|b| b.is_ascii_graphic() || **b == b' ')
        .take(MAX_VALUE_CHARS)
        .map(|&b| char::from(b))
        .collect();
    let value = value.trim();
    (!value.is_empty() && value != "?").then(|| AtReply::Value(value.to_owned()))
}

/// The four numbers of `AT+UFREQ`: enabled, start, step, last channel.
#[must_use]
pub fn parse_ufreq(value: &str) -> Option<(bool, u32, u32, u32)> {
    let mut numbers = value.split(',').map(|n| n.trim().parse::<u32>());
    let enabled = numbers.next()?.ok()?;
    let start_hz = numbers.next()?.ok()?;
    let step_hz = numbers.next()?.ok()?;
    let last = numbers.next()?.ok()?;
    (numbers.next().is_none() && enabled <= 1).then_some((enabled == 1, start_hz, step_hz, last))
}

fn find(bytes: &[u8], pattern: &[u8]) -> Option<usize> {
    if pattern.is_empty() || bytes.len() < pattern.len() {
        return None;
    }
    bytes.windows(pattern.len()).position(|window| window == pattern)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{Mode, at, read, switch, write};
    use proptest::prelude::*;

    const BLOCK: Expected = Expected::Registers { address: 0, len: 9 };
    const VALUES: [u8; 9] = [0xde, 0x70, 0, 0x62, 0, 0x19, 0xc3, 0, 0];

    fn answer(values: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0xC1, 0, 9];
        bytes.extend_from_slice(values);
        bytes
    }

    #[test]
    fn junk_before_the_answer_is_skipped() {
        for junk in [&[][..], &[0, 0], &[0, 0, 0xC1], &[0xC1, 0x00], &[0xFF, 0xFF, 0xFF]] {
            let mut bytes = junk.to_vec();
            bytes.extend(answer(&VALUES));
            let expected = Verdict::Registers { data: VALUES.to_vec(), before: junk.len(), echo: false };
            assert_eq!(judge(BLOCK, &read(0, 9), &bytes, false), expected, "{junk:02x?}");
        }
    }

    #[test]
    fn echo_of_a_read_is_not_its_answer() {
        let mut bytes = read(0, 9).to_vec();
        assert_eq!(judge(BLOCK, &read(0, 9), &bytes, true), Verdict::Wait);
        bytes.extend(answer(&VALUES));
        assert_eq!(judge(BLOCK, &read(0, 9), &bytes, false), Verdict::Wait);
        let expected = Verdict::Registers { data: VALUES.to_vec(), before: 3, echo: true };
        assert_eq!(judge(BLOCK, &read(0, 9), &bytes, true), expected);
    }

    #[test]
    fn values_that_look_like_a_header_are_values() {
        let values = [0xC1, 0, 9, 0x62, 0, 0x19, 0xc3, 0, 0];
        let expected = Verdict::Registers { data: values.to_vec(), before: 0, echo: false };
        assert_eq!(judge(BLOCK, &read(0, 9), &answer(&values), true), expected);
    }

    #[test]
    fn echo_of_a_write_is_noticed() {
        let request = write(true, 0, &VALUES);
        let mut bytes = request.clone();
        assert_eq!(judge(BLOCK, &request, &bytes, true), Verdict::Wait);
        bytes.extend(answer(&VALUES));
        let expected = Verdict::Registers { data: VALUES.to_vec(), before: 12, echo: true };
        assert_eq!(judge(BLOCK, &request, &bytes, false), expected);
    }

    #[test]
    fn refusal_is_believed_after_silence() {
        assert_eq!(judge(BLOCK, &read(0, 9), &[0xFF; 3], false), Verdict::Wait);
        assert_eq!(judge(BLOCK, &read(0, 9), &[0xFF; 3], true), Verdict::Refused);
    }

    #[test]
    fn echo_of_the_switch_is_not_its_answer() {
        let request = switch(Mode::Configuration);
        let expected = Expected::Switched { mode: 2 };
        let mut bytes = request.to_vec();
        assert_eq!(judge(expected, &request, &bytes, true), Verdict::Wait);
        bytes.extend([0xC1, 0xC2, 0xC3, 0x02, 0x02]);
        assert_eq!(
            judge(expected, &request, &bytes, false),
            Verdict::Switched { before: 6, after: 11, echo: true }
        );
        assert_eq!(
            judge(expected, &request, &bytes[6..], false),
            Verdict::Switched { before: 0, after: 5, echo: false }
        );
    }

    #[test]
    fn at_replies_as_seen_in_the_field() {
        let query = |text: &[u8], silent| {
            judge(Expected::At { name: "FWCODE" }, &at("FWCODE=?", false), text, silent)
        };
        let value = |text: &str| AtReply::Value(text.to_owned());
        let plain = |reply| Verdict::At { reply, echo: false };
        assert_eq!(query(b"AT+FWCODE=7453-0-21\r\n", false), plain(value("7453-0-21")));
        assert_eq!(query(b"FWCODE=7432-0-10", false), Verdict::Wait);
        assert_eq!(query(b"FWCODE=7432-0-10", true), plain(value("7432-0-10")));
        assert_eq!(query(b"=ERR\r\n", false), plain(AtReply::Error));
        assert_eq!(query(&[0xFF; 3], true), plain(AtReply::Error));
        assert_eq!(query(b"AT+FWCODE=?", true), Verdict::Wait);
        assert_eq!(
            query(b"AT+FWCODE=?AT+FWCODE=1\r\n", false),
            Verdict::At { reply: value("1"), echo: true }
        );
        assert_eq!(query(b"DEVTYPE=E22\r\n", true), Verdict::Wait);
        assert_eq!(query(b"\x00\xfe=1\n", false), plain(value("1")));
        let set = |text: &[u8]| judge(Expected::At { name: "UAUX" }, &at("UAUX=1", false), text, true);
        assert_eq!(set(b"AT+UAUX=OK"), plain(AtReply::Ok));
        assert_eq!(set(b"+OK\r\n"), plain(AtReply::Ok));
        assert_eq!(set(b"AT+UAUX=ERR"), plain(AtReply::Error));
    }

    #[test]
    fn ufreq_has_four_numbers() {
        assert_eq!(parse_ufreq("1,410000000,1000000,83"), Some((true, 410_000_000, 1_000_000, 83)));
        for text in ["", "-125000", "1,2,3", "1,2,3,4,5", "2,1,1,1", "1,x,1,1", "1,99999999999,1,1"] {
            assert_eq!(parse_ufreq(text), None, "{text}");
        }
    }

    proptest! {
        /// Any bytes, cut anywhere: no panic, and what is found lies inside.
        #[test]
        fn any_bytes_are_judged(bytes in proptest::collection::vec(any::<u8>(), 0..600), silent: bool, len in 0u8..20) {
            let _ = judge(Expected::Registers { address: 0, len }, &read(0, len), &bytes, silent);
            let _ = judge(Expected::At { name: "UFREQ" }, &at("UFREQ=?", false), &bytes, silent);
            if let Verdict::Switched { before, after, .. } =
                judge(Expected::Switched { mode: 2 }, &switch(Mode::Configuration), &bytes, silent)
            {
                prop_assert!(before < after && after <= bytes.len());
            }
        }

        /// Text out of the protocol's own alphabet, which random bytes seldom form.
        #[test]
        fn any_text_is_judged(text in "(AT\\+|FWCODE|UFREQ|=|\\?|OK|ERR|[0-9,]|\r|\n|\\+){0,20}", silent: bool) {
            let _ = judge(Expected::At { name: "FWCODE" }, &at("FWCODE=?", true), text.as_bytes(), silent);
            let _ = parse_ufreq(&text);
        }

        /// Junk before and after never hides or changes an answer, whatever the values.
        #[test]
        fn an_answer_is_found_in_junk(
            junk in proptest::collection::vec(0u8..0xC0, 0..40),
            values in proptest::array::uniform9(any::<u8>()),
            tail in proptest::collection::vec(0u8..0xC0, 0..40),
        ) {
            let mut bytes = junk.clone();
            bytes.extend(answer(&values));
            bytes.extend(&tail);
            let found = judge(BLOCK, &read(0, 9), &bytes, true);
            prop_assert_eq!(found, Verdict::Registers { data: values.to_vec(), before: junk.len(), echo: false });
        }
    }
}
