//! Files and messages of others as [`Reception`]s.
//!
//! [`Items`] cuts what is read into items (an object of JSON, a line, a KISS frame) in bounded memory: at most 16 KiB of
//! a reception are held (256 KiB of a packet that lists its stations), what is longer is passed over, what is nested
//! deeper than 32 levels as well. [`read`] makes receptions of one item; it is pure, so items can be read in parallel.
//!
//! What an object is, is told by its keys: `raw` (TinyGS API), `data` (a TinyGS board's `rx`), `frame` (SatNOGS DB),
//! `pixelsat_reception` (ours).

mod export;
mod hex_log;
mod items;
mod json;
mod kiss;
mod place;
mod satnogs;
mod tinygs;
mod tree;
mod value;

#[cfg(test)]
mod tests;

use std::io::BufRead;

use mission::UtcUs;
use mission::reception::{Admission, Ear, Receiver, Reception, Refusal, Said, Times, admit};
use sha2::{Digest as _, Sha256};

pub use export::{CSV_HEAD, csv, export};
pub use items::{Item, Items};
pub use tinygs::Topic;

/// Bytes of the report of one reception that are read.
pub const RECEPTION_MAX: usize = 16 << 10;
/// Bytes of a packet that lists the stations which heard it.
pub const PACKET_MAX: usize = 256 << 10;
/// Bytes of a message or an answer.
pub const MESSAGE_MAX: usize = 1 << 20;
/// Levels of lists and objects inside one another.
pub const DEPTH_MAX: u32 = 32;

/// How a file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum Format {
    /// JSON or NDJSON of TinyGS (boards and API), of SatNOGS DB, or our own export.
    Json,
    /// Lines of SatNOGS DB's export: time, a separator, hex.
    SatnogsCsv,
    /// KISS frames.
    Kiss,
    /// Lines of hex, each with a time before it or not.
    Hex,
    /// The bytes themselves, frames one after another with anything between.
    Raw,
}

impl Format {
    /// What the first bytes of a file look like; `None`: like nothing that is known.
    pub fn of(head: &[u8]) -> Option<Self> {
        let text = head.trim_ascii_start();
        let first = *text.first()?;
        let line = text.split(|byte| *byte == b'\n').next().unwrap_or(text);
        if first == 0xC0 {
            return Some(Self::Kiss);
        }
        if matches!(first, b'{' | b'[') || text.starts_with(b"tinygs/") {
            return Some(Self::Json);
        }
        let printable = head.iter().all(|byte| matches!(byte, b'\t' | b'\n' | b'\r' | 0x20..=0x7E));
        if !printable || text.starts_with(&protocol::DOWN_MAGIC) {
            return Some(Self::Raw);
        }
        let separated = |byte: &u8| matches!(byte, b'|' | b',' | b';' | b'\t');
        let is_hex = line.iter().all(|byte| byte.is_ascii_hexdigit() || byte.is_ascii_whitespace());
        if line.iter().any(separated) && !is_hex { Some(Self::SatnogsCsv) } else { Some(Self::Hex) }
    }

    /// The format of that name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Json, Self::SatnogsCsv, Self::Kiss, Self::Hex, Self::Raw]
            .into_iter()
            .find(|format| format.name() == name)
    }

    /// The word for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::SatnogsCsv => "satnogs-csv",
            Self::Kiss => "kiss",
            Self::Hex => "hex",
            Self::Raw => "raw",
        }
    }
}

/// What is known of a message besides its text.
#[derive(Debug, Clone, PartialEq)]
pub struct Context {
    /// What is admitted.
    pub admission: Admission,
    /// Who heard it, where the message does not say so itself.
    pub receiver: Receiver,
    /// When the message came in, for one that was waited for.
    pub arrived: Option<UtcUs>,
    /// When it was received, as whoever hands it in says; for formats without a time.
    pub at: Option<UtcUs>,
    /// Whether the board reads its clock at the reception (firmware 2603242 and later).
    pub board_read_at_reception: Option<bool>,
    /// Through which ear it came, where that is not the one that usually speaks this format.
    pub ear: Option<Ear>,
}

impl Context {
    /// A file that is read now, of which nothing else is known.
    pub const fn file(admission: Admission) -> Self {
        Self {
            admission,
            receiver: Receiver {
                id: None,
                name: None,
                latitude_deg: None,
                longitude_deg: None,
                altitude_m: None,
            },
            arrived: None,
            at: None,
            board_read_at_reception: None,
            ear: None,
        }
    }

    /// An empty claim, with what the context knows.
    fn said(&self, ear: Ear, source_id: String) -> Said {
        Said {
            receiver: self.receiver.clone(),
            times: Times {
                stated: self.at,
                arrived: self.arrived,
                board_read_at_reception: self.board_read_at_reception,
                ..Times::default()
            },
            ..Said::new(self.ear.unwrap_or(ear), source_id)
        }
    }
}

/// Something that did not become a reception.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct Refused {
    /// Where it begins, from 1.
    pub line: u64,
    /// Why.
    pub reason: Refusal,
}

/// What one item came to, several for a packet that several stations heard.
pub type Read = Result<Reception, Refused>;

/// Makes receptions of one item.
pub fn read(item: &Item, context: &Context, out: &mut Vec<Read>) {
    said(item, context, &mut |said| {
        let reception = said.and_then(|said| admit(said, &context.admission));
        out.push(reception.map_err(|reason| Refused { line: item.line, reason }));
    });
}

/// What one item claims.
fn said(item: &Item, context: &Context, take: &mut dyn FnMut(Result<Said, Refusal>)) {
    match &item.body {
        Err(reason) => take(Err(*reason)),
        Ok(body) => match item.format {
            Format::Json => json::said(item.prefix.as_deref(), body, context, take),
            Format::SatnogsCsv => take(satnogs::line(body, context)),
            Format::Kiss | Format::Raw => take(Ok(kiss::said(body, item.occurrence, context))),
            Format::Hex => take(hex_log::line(body, item.occurrence, context)),
        },
    }
}

/// What all items of a reader claim, before anything of it is believed: for those who look at what was measured, whoever's
/// the bytes are.
///
/// # Errors
/// The reader's own.
pub fn claims<R: BufRead>(
    format: Format,
    reader: R,
    context: &Context,
    mut take: impl FnMut(Result<Said, Refused>),
) -> std::io::Result<()> {
    for item in Items::new(format, reader) {
        let item = item?;
        said(&item, context, &mut |said| take(said.map_err(|reason| Refused { line: item.line, reason })));
    }
    Ok(())
}

/// All receptions of a reader, one after the other. A message that ends the reading is the error of its last element.
pub fn receptions<R: BufRead>(
    format: Format,
    reader: R,
    context: &Context,
) -> impl Iterator<Item = std::io::Result<Read>> {
    let mut found = Vec::new().into_iter();
    let mut items = Items::new(format, reader);
    std::iter::from_fn(move || {
        loop {
            if let Some(next) = found.next() {
                return Some(Ok(next));
            }
            match items.next()? {
                Ok(item) => {
                    let mut out = Vec::new();
                    read(&item, context, &mut out);
                    found = out.into_iter();
                }
                Err(error) => return Some(Err(error)),
            }
        }
    })
}

/// All receptions of one message, which is at most 1 MiB long.
pub fn message(body: &[u8], context: &Context) -> Vec<Read> {
    message_of(None, body, context)
}

/// The reception in one message of a board, published on this topic.
pub fn rx(topic: &Topic, body: &[u8], context: &Context) -> Vec<Read> {
    message_of(Some(topic), body, context)
}

fn message_of(topic: Option<&Topic>, body: &[u8], context: &Context) -> Vec<Read> {
    if body.len() > MESSAGE_MAX {
        return vec![Err(Refused { line: 1, reason: Refusal::TooLong })];
    }
    let mut out = Vec::new();
    for item in Items::new(Format::Json, body) {
        let Ok(mut item) = item else { break };
        item.prefix = topic.map(Topic::to_string).or(item.prefix);
        read(&item, context, &mut out);
    }
    if out.is_empty() {
        out.push(Err(Refused { line: 1, reason: Refusal::Malformed }));
    }
    out
}

/// A short name for some bytes: the same for the same bytes.
fn digest(parts: &[&[u8]]) -> String {
    let mut hasher = Sha256::new();
    for part in parts {
        hasher.update((part.len() as u64).to_le_bytes());
        hasher.update(part);
    }
    hex::encode(&hasher.finalize()[..16])
}
