//! KISS (Chepponis, Karn 1987): frames between FEND bytes, with two escapes; and bytes that carry nothing but themselves.

use mission::reception::{Ear, Refusal, Said};

use super::{Context, RECEPTION_MAX, digest};

/// Ends and begins a frame.
pub(super) const FEND: u8 = 0xC0;
const FESC: u8 = 0xDB;
const TFEND: u8 = 0xDC;
const TFESC: u8 = 0xDD;

/// Undoes the escapes, byte by byte.
#[derive(Debug, Default)]
pub(super) struct Unescape {
    held: Vec<u8>,
    escaped: bool,
    wrong: Option<Refusal>,
}

impl Unescape {
    /// Takes a byte. A data frame (command 0 on any port) is handed out without its command byte; other commands are
    /// settings of a modem and say nothing.
    pub(super) fn push(&mut self, byte: u8, take: &mut dyn FnMut(Result<Vec<u8>, Refusal>)) {
        let meant = match byte {
            FEND => return self.end(take),
            FESC => {
                self.escaped = true;
                return;
            }
            TFEND if self.escaped => FEND,
            TFESC if self.escaped => FESC,
            _ if self.escaped => {
                self.wrong = Some(Refusal::Malformed);
                byte
            }
            _ => byte,
        };
        self.escaped = false;
        if self.held.len() < RECEPTION_MAX {
            self.held.push(meant);
        } else {
            self.wrong = Some(Refusal::TooLong);
        }
    }

    fn end(&mut self, take: &mut dyn FnMut(Result<Vec<u8>, Refusal>)) {
        let Self { held, escaped, wrong } = std::mem::take(self);
        let wrong = wrong.or(escaped.then_some(Refusal::Malformed));
        match (wrong, held.split_first()) {
            (Some(reason), _) => take(Err(reason)),
            (None, Some((command, data))) if command & 0x0F == 0 => take(Ok(data.to_vec())),
            _ => {}
        }
    }
}

/// Bytes of which nothing else is known.
pub(super) fn said(bytes: &[u8], occurrence: u32, context: &Context) -> Said {
    let mut said = context.said(Ear::File, digest(&[bytes, &occurrence.to_le_bytes()]));
    said.bytes = Some(bytes.to_vec());
    said.original = Some(bytes.into());
    said
}
