//! The twin's journal: what happened, one line each, and the memory of a twin whose process was restarted.
//!
//! A line is `<µs> <kind> key=value …`, bytes in hex. It is the far end's own witness of what ground sent.

use std::fmt::Write as _;

use protocol::{Nonce, RequestTag, Resolution};
use thiserror::Error;

use crate::state::{ClockSetting, StateChange, StoredImage};

/// Why a frame that reached the satellite's computer was not obeyed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Refusal {
    /// The GCM tag is wrong: another key, a forgery, damage. Never answered.
    Authentication,
    /// The counter is not one the policy accepts. Never answered.
    Counter,
    /// This very nonce was accepted before. Never answered.
    Replayed,
    /// The plaintext's checksum is wrong. Answered by Error CrcFailed.
    Crc,
    /// Header, payload or content do not follow the ICD. Answered by Error MalformedPacket.
    Malformed,
    /// Too many requests wait already. Not answered.
    Busy,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Self; 6] =
        [Self::Authentication, Self::Counter, Self::Replayed, Self::Crc, Self::Malformed, Self::Busy];

    /// The reason as one word of the journal.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Authentication => "authentication",
            Self::Counter => "counter",
            Self::Replayed => "replayed",
            Self::Crc => "crc",
            Self::Malformed => "malformed",
            Self::Busy => "busy",
        }
    }
}

/// One thing that happened. Times are microseconds on the twin's monotonic scale.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JournalEntry {
    /// The ground's module began to radiate.
    GroundRadiated {
        /// First symbol.
        at_us: u64,
        /// After the last symbol.
        end_us: u64,
        /// Address it was meant for.
        target: u16,
        /// Channel it was sent on.
        channel: u8,
        /// The packet, without the module's header.
        packet: Vec<u8>,
    },
    /// A request was accepted and is carried out.
    Accepted {
        /// When.
        at_us: u64,
        /// Its nonce.
        nonce: Nonce,
        /// Its tag.
        tag: RequestTag,
        /// Its packet type.
        packet_type: u8,
    },
    /// A frame was not obeyed.
    Refused {
        /// When.
        at_us: u64,
        /// Why.
        reason: Refusal,
        /// The nonce it bore, authentic or not.
        nonce: Nonce,
    },
    /// The satellite began to radiate.
    SatelliteSent {
        /// First symbol.
        at_us: u64,
        /// After the last symbol.
        end_us: u64,
        /// The frame.
        frame: Vec<u8>,
    },
    /// The satellite wrote to its permanent memory. Whoever plays the twin makes this line durable before taking
    /// anything further from it.
    Stored {
        /// When.
        at_us: u64,
        /// What.
        change: StateChange,
    },
}

/// A line that is none of a journal's.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("journal line {line}: {problem}")]
pub struct JournalError {
    /// Number of the line, from 1; 0 when a single line was parsed.
    pub line: usize,
    /// What is wrong.
    pub problem: String,
}

impl JournalError {
    fn new(problem: impl Into<String>) -> Self {
        Self { line: 0, problem: problem.into() }
    }

    pub(crate) fn on_line(self, line: usize) -> Self {
        Self { line, ..self }
    }
}

impl JournalEntry {
    /// When it happened.
    #[must_use]
    pub const fn at_us(&self) -> u64 {
        match self {
            Self::GroundRadiated { at_us, .. }
            | Self::Accepted { at_us, .. }
            | Self::Refused { at_us, .. }
            | Self::SatelliteSent { at_us, .. }
            | Self::Stored { at_us, .. } => *at_us,
        }
    }

    /// The entry as one line, without its end.
    #[must_use]
    pub fn to_line(&self) -> String {
        let at_us = self.at_us();
        match self {
            Self::GroundRadiated { end_us, target, channel, packet, .. } => {
                let packet = hex(packet);
                format!(
                    "{at_us} ground-radiated end={end_us} target={target:04x} channel={channel} packet={packet}"
                )
            }
            Self::Accepted { nonce, tag, packet_type, .. } => {
                format!("{at_us} accepted nonce={nonce} tag={tag} type={packet_type}")
            }
            Self::Refused { reason, nonce, .. } => {
                format!("{at_us} refused reason={} nonce={nonce}", reason.name())
            }
            Self::SatelliteSent { end_us, frame, .. } => {
                format!("{at_us} satellite-sent end={end_us} frame={}", hex(frame))
            }
            Self::Stored { change, .. } => format!("{at_us} stored {}", change_text(change)),
        }
    }

    /// The entry in a line made by [`Self::to_line`].
    ///
    /// # Errors
    /// [`JournalError`] that says what is missing or wrong.
    pub fn parse_line(line: &str) -> Result<Self, JournalError> {
        let mut words = line.split_ascii_whitespace();
        let at_us = words
            .next()
            .and_then(|word| word.parse().ok())
            .ok_or_else(|| JournalError::new("it does not begin with a time"))?;
        let kind = words.next().ok_or_else(|| JournalError::new("it says nothing"))?;
        let fields = Fields(words.collect());
        Ok(match kind {
            "ground-radiated" => Self::GroundRadiated {
                at_us,
                end_us: fields.number("end")?,
                target: u16::from_str_radix(fields.text("target")?, 16).map_err(|_| bad("target"))?,
                channel: fields.number("channel")?,
                packet: fields.bytes("packet")?,
            },
            "accepted" => Self::Accepted {
                at_us,
                nonce: fields.nonce()?,
                tag: RequestTag::new(fields.number("tag")?).ok_or_else(|| bad("tag"))?,
                packet_type: fields.number("type")?,
            },
            "refused" => {
                let name = fields.text("reason")?;
                let reason = Refusal::ALL.into_iter().find(|reason| reason.name() == name);
                Self::Refused { at_us, reason: reason.ok_or_else(|| bad("reason"))?, nonce: fields.nonce()? }
            }
            "satellite-sent" => {
                Self::SatelliteSent { at_us, end_us: fields.number("end")?, frame: fields.bytes("frame")? }
            }
            "stored" => Self::Stored { at_us, change: parse_change(&fields)? },
            other => return Err(JournalError::new(format!("'{other}' is no kind of entry"))),
        })
    }
}

fn change_text(change: &StateChange) -> String {
    match change {
        StateChange::Nonce(nonce) => format!("what=nonce nonce={nonce}"),
        StateChange::Boot { boots, utc_ms } => format!("what=boot boots={boots} utc={utc_ms}"),
        StateChange::ImageErased { next_number } => format!("what=image-erased next={next_number}"),
        StateChange::Image(StoredImage { number, resolution, grey, strong_compression }) => format!(
            "what=image number={number} resolution={} grey={grey} strong={strong_compression}",
            resolution.code()
        ),
        StateChange::Clock(None) => "what=clock-lost".to_owned(),
        StateChange::Clock(Some(ClockSetting { set_ms, at_utc_ms })) => {
            format!("what=clock set={set_ms} utc={at_utc_ms}")
        }
        StateChange::Transmitter(on) => format!("what=transmitter on={on}"),
        StateChange::Elements => "what=elements".to_owned(),
    }
}

fn parse_change(fields: &Fields<'_>) -> Result<StateChange, JournalError> {
    Ok(match fields.text("what")? {
        "nonce" => StateChange::Nonce(fields.nonce()?),
        "boot" => StateChange::Boot { boots: fields.number("boots")?, utc_ms: fields.number("utc")? },
        "image-erased" => StateChange::ImageErased { next_number: fields.number("next")? },
        "image" => StateChange::Image(StoredImage {
            number: fields.number("number")?,
            resolution: Resolution::from_code(fields.number("resolution")?)
                .ok_or_else(|| bad("resolution"))?,
            grey: fields.number("grey")?,
            strong_compression: fields.number("strong")?,
        }),
        "clock-lost" => StateChange::Clock(None),
        "clock" => StateChange::Clock(Some(ClockSetting {
            set_ms: fields.number("set")?,
            at_utc_ms: fields.number("utc")?,
        })),
        "transmitter" => StateChange::Transmitter(fields.number("on")?),
        "elements" => StateChange::Elements,
        other => return Err(JournalError::new(format!("'{other}' is nothing the satellite stores"))),
    })
}

/// The `key=value` words of a line.
struct Fields<'a>(Vec<&'a str>);

impl<'a> Fields<'a> {
    fn text(&self, name: &str) -> Result<&'a str, JournalError> {
        self.0
            .iter()
            .find_map(|word| word.strip_prefix(name)?.strip_prefix('='))
            .ok_or_else(|| JournalError::new(format!("'{name}' is missing")))
    }

    fn number<T: std::str::FromStr>(&self, name: &str) -> Result<T, JournalError> {
        self.text(name)?.parse().map_err(|_| bad(name))
    }

    fn bytes(&self, name: &str) -> Result<Vec<u8>, JournalError> {
        unhex(self.text(name)?).ok_or_else(|| bad(name))
    }

    fn nonce(&self) -> Result<Nonce, JournalError> {
        let bytes = self.bytes("nonce")?;
        bytes.try_into().map(Nonce::from_bytes).map_err(|_| bad("nonce"))
    }
}

fn bad(name: &str) -> JournalError {
    JournalError::new(format!("the value of '{name}' is wrong"))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(bytes.len() * 2), |mut text, byte| {
        // writing to a string does not fail
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn unhex(text: &str) -> Option<Vec<u8>> {
    if !text.len().is_multiple_of(2) {
        return None;
    }
    let digit = |byte: u8| char::from(byte).to_digit(16);
    text.as_bytes()
        .chunks_exact(2)
        .map(|pair| u8::try_from(digit(pair[0])? << 4 | digit(pair[1])?).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TwinState;
    use protocol::Counter;

    fn entries() -> Vec<JournalEntry> {
        let nonce = Nonce::new(Counter(77), [1, 2, 3, 255]);
        let image =
            StoredImage { number: 3, resolution: Resolution::Svga, grey: true, strong_compression: false };
        let changes = [
            StateChange::Boot { boots: 2, utc_ms: 1_805_544_000_000 },
            StateChange::Nonce(nonce),
            StateChange::ImageErased { next_number: 3 },
            StateChange::Image(image),
            StateChange::Clock(Some(ClockSetting { set_ms: u64::MAX, at_utc_ms: 5 })),
            StateChange::Transmitter(false),
            StateChange::Elements,
            StateChange::Clock(None),
        ];
        let mut entries = vec![
            JournalEntry::GroundRadiated {
                at_us: 1,
                end_us: 2,
                target: 0xDE69,
                channel: 25,
                packet: b"DESTINY_\0\xff".to_vec(),
            },
            JournalEntry::Accepted { at_us: 3, nonce, tag: RequestTag::FIRST, packet_type: 12 },
            JournalEntry::SatelliteSent { at_us: 9, end_us: 10, frame: Vec::new() },
        ];
        entries.extend(Refusal::ALL.map(|reason| JournalEntry::Refused { at_us: 4, reason, nonce }));
        entries.extend(changes.map(|change| JournalEntry::Stored { at_us: u64::MAX, change }));
        entries
    }

    #[test]
    fn every_entry_survives_its_line() {
        for entry in entries() {
            let line = entry.to_line();
            assert!(!line.contains('\n'));
            assert_eq!(JournalEntry::parse_line(&line), Ok(entry), "{line}");
        }
    }

    #[test]
    fn a_state_is_rebuilt_from_its_journal_and_a_torn_last_line_is_left_out() {
        let mut text: String = entries().iter().map(|entry| entry.to_line() + "\n").collect();
        let state = TwinState::from_journal(&text).unwrap();
        assert_eq!((state.boots, state.transmitter, state.elements), (2, false, true));
        assert_eq!(state.nonces.highest(), Some(Counter(77)));
        assert_eq!((state.image.map(|image| image.number), state.next_image), (Some(3), 4));
        text.push_str("12 stored what=boot boots=9");
        assert_eq!(TwinState::from_journal(&text).as_ref(), Ok(&state));
        text.push('\n');
        assert_eq!(TwinState::from_journal(&text).unwrap_err().line, entries().len() + 1);
    }

    #[test]
    fn lines_that_are_none_say_what_is_wrong() {
        for bad in
            ["", "x", "1", "1 dance", "1 accepted", "1 stored what=soul", "1 refused reason=mood nonce=00"]
        {
            assert!(JournalEntry::parse_line(bad).is_err(), "{bad}");
        }
        let odd = "1 satellite-sent end=2 frame=abc";
        assert!(JournalEntry::parse_line(odd).unwrap_err().to_string().contains("'frame'"));
    }
}
