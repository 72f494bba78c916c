//! One fuzz body per decoder of the wire, of what a radio module answers, of elements and of reports. A body takes any bytes and asserts what
//! must hold for all bytes: no panic, bounds, round trips, and for the stream decoders the same result as a naive reading
//! of the ICD.
//!
//! The bodies know no fuzzing engine: `cargo test -p fuzz` runs them on stable over `corpus/<body>/` and over seeded
//! mutations of it; `libfuzzer/` runs the same bodies under coverage guidance by hand (`README.md`). A finding becomes a
//! file in the corpus.

mod down;
mod elements;
mod formats;
mod radio_driver;
mod radio_reply;
mod reception;
mod up;

pub use down::{down_frame, down_stream, downlink_payload};
pub use elements::elements;
pub use formats::formats;
pub use radio_driver::radio_driver;
pub use radio_reply::radio_reply;
pub use reception::reception;
pub use up::{sealed_open, telecommand_payload, up_stream};

/// A body: takes any bytes, panics when an invariant is broken.
pub type Body = fn(&[u8]);

/// Every body by the name of its corpus folder and fuzz target.
pub const BODIES: [(&str, Body); 11] = [
    ("down_stream", down_stream),
    ("down_frame", down_frame),
    ("downlink_payload", downlink_payload),
    ("telecommand_payload", telecommand_payload),
    ("up_stream", up_stream),
    ("sealed_open", sealed_open),
    ("radio_reply", radio_reply),
    ("radio_driver", radio_driver),
    ("elements", elements),
    ("reception", reception),
    ("formats", formats),
];

/// Feeds a stream in pieces whose lengths a few input bytes choose.
fn pieces(choice: u8, stream: &[u8]) -> impl Iterator<Item = &[u8]> {
    let most = match choice % 4 {
        0 => 1,
        1 => 17,
        2 => 260,
        _ => 900,
    };
    let mut rest = stream;
    let mut state = u32::from(choice) | 1;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let len = (1 + (state >> 8) as usize % most).min(rest.len());
        let (now, later) = rest.split_at(len);
        rest = later;
        Some(now)
    })
}
