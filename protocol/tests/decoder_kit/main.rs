//! The decoder kit for strangers (`docs/decoder`) says what the code says.
//!
//! `frames.json` and `pixelsat.xtce.xml` are written from the tables of this crate; `scripts/decoder-kit`
//! then lets other people's decoders loose on them. After a change of the wire:
//! `INSTA_UPDATE=always cargo nextest run -p protocol --test decoder_kit`.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a file that cannot be read fails its test")]

mod frames;
mod names;
mod text;
mod xtce;

use std::{collections::BTreeSet, env, fs, path::Path};

/// The file in `docs/decoder` is this text, or becomes it when asked to.
fn is_in_the_kit(name: &str, made: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/decoder").join(name);
    if env::var("INSTA_UPDATE").is_ok_and(|how| how == "always") {
        fs::write(&path, made).unwrap();
    }
    let stored = fs::read_to_string(&path).unwrap();
    assert!(
        stored == made,
        "docs/decoder/{name} is not what the code says: INSTA_UPDATE=always cargo nextest run -p protocol --test \
         decoder_kit, and look at what changed"
    );
}

#[test]
fn the_frames_of_the_kit_are_what_this_code_decodes() {
    is_in_the_kit("frames.json", &frames::document());
}

#[test]
fn the_frames_show_every_packet_and_every_way_to_be_no_frame() {
    let cases = frames::cases();
    let layouts: BTreeSet<_> = cases.iter().filter_map(|case| case.layout()).collect();
    let all =
        (0..=u8::MAX).filter_map(protocol::Downlink::name_of).map(names::snake).collect::<BTreeSet<_>>();
    assert_eq!(layouts, all);
    let count = |wanted: &dyn Fn(&frames::Case) -> bool| cases.iter().filter(|case| wanted(case)).count();
    assert!(count(&|case| case.ours.is_none()) >= 8, "packets of others");
    assert!(count(&|case| case.ours.as_ref().is_some_and(|ours| !ours.crc_ok)) >= 5, "damaged frames");
    let raw = count(&|case| case.ours.as_ref().is_some_and(|ours| ours.packet.is_none()));
    assert!(raw >= 15, "payloads that stay raw: {raw}");
}

#[test]
fn the_xtce_of_the_kit_is_made_of_the_tables_of_the_code() {
    is_in_the_kit("pixelsat.xtce.xml", &xtce::document());
}
