//! Frames out of a byte stream, sans I/O (ICD section 1, *Stream decoding*).

mod down;
mod magic;
mod up;
mod window;

pub use down::{DecoderCounters, DownDecoder, DownItem};
pub use up::{UpCounters, UpDecoder};
