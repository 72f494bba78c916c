//! What the wire costs: `cargo bench -p protocol`.
//!
//! First a table that sets the stream decoder beside the bare CRC of the same bytes, both timed in turns in this run, so
//! that the ratio holds on any machine; then divan's figures for each operation alone.
#![expect(clippy::unwrap_used, reason = "a bench that cannot build its input stops")]
#![expect(clippy::disallowed_methods, reason = "a bench reads the clock")]

use std::{hint::black_box, time::Instant};

use divan::Bencher;
use protocol::{
    Counter, DownDecoder, Downlink, FrameForm, Key, Nonce, RequestTag, SealedUplink, Telecommand, UpDecoder,
    crc32, encode_down, open, seal,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const FRAMES: usize = 4_000;

/// Full chunk frames of random bytes, or short heartbeats.
fn stream(chunks: bool) -> (Vec<u8>, usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut stream = Vec::new();
    for _ in 0..FRAMES {
        let mut payload = [0; 224];
        rng.fill_bytes(&mut payload);
        payload[116] &= 1;
        let packet = match chunks {
            true => Downlink::decode(3, &payload),
            false => Downlink::decode(6, &payload[..117]),
        };
        let mut out = [0; 240];
        let len = encode_down(&packet.unwrap(), None, FrameForm::Short, &mut out);
        stream.extend(&out[..len]);
    }
    let frame_len = stream.len() / FRAMES;
    (stream, frame_len)
}

fn decode(stream: &[u8], piece: usize) -> usize {
    let mut decoder = DownDecoder::new(false);
    let mut frames = 0;
    for bytes in stream.chunks(piece) {
        decoder.push(bytes, &mut |_| frames += 1);
    }
    assert_eq!(frames, FRAMES);
    frames
}

/// Seconds of the fastest of some runs.
fn fastest(mut run: impl FnMut()) -> f64 {
    let timed = (0..40).map(|_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    });
    timed.fold(f64::INFINITY, f64::min)
}

fn table() {
    println!("stream decoding beside the bare CRC of the same contents, {FRAMES} frames, fastest of 40 runs");
    println!("{:<34}{:>12}{:>10}{:>16}", "", "frames/s", "MB/s", "times bare CRC");
    for (name, chunks) in [("240-byte chunk frames", true), ("133-byte heartbeats", false)] {
        let (stream, frame_len) = stream(chunks);
        let bare = fastest(|| {
            for frame in stream.chunks(frame_len) {
                black_box(crc32(black_box(&frame[12..])));
            }
        });
        let row = |what: &str, seconds: f64| {
            let rate = FRAMES as f64 / seconds;
            let megabytes = stream.len() as f64 / seconds / 1e6;
            println!(
                "{:<34}{rate:>12.0}{megabytes:>10.0}{:>16.2}",
                format!("{name}, {what}"),
                seconds / bare
            );
        };
        row("bare CRC", bare);
        let fast = fastest(|| {
            for frame in stream.chunks(frame_len) {
                black_box(crc32fast::hash(black_box(&frame[12..])));
            }
        });
        row("crc32fast", fast);
        for (what, piece) in [("in one", usize::MAX), ("by 4096", 4096), ("by 64", 64), ("by 1", 1)] {
            let seconds = fastest(|| {
                black_box(decode(black_box(&stream), piece));
            });
            row(what, seconds);
        }
    }
    println!();
}

fn main() {
    table();
    divan::main();
}

#[divan::bench(args = [16, 240])]
fn crc_of_contents(bencher: Bencher<'_, '_>, len: usize) {
    let bytes = vec![0x5A; len];
    bencher.counter(divan::counter::BytesCount::of_slice(&bytes)).bench(|| crc32(black_box(&bytes)));
}

#[divan::bench]
fn encode_chunk_frame(bencher: Bencher<'_, '_>) {
    let packet = Downlink::decode(3, &[7; 224]).unwrap();
    let mut out = [0; 240];
    bencher.bench_local(|| encode_down(black_box(&packet), None, FrameForm::Full, &mut out));
}

#[divan::bench]
fn decode_heartbeat(bencher: Bencher<'_, '_>) {
    let payload = [0; 117];
    bencher.bench(|| Downlink::decode(6, black_box(&payload)));
}

fn sealed() -> (Key, Telecommand, SealedUplink) {
    let key = Key::from_bytes([7; 16]);
    let command = Telecommand::GetImageChunk { first: 0, count: 64 };
    let sealed = seal(&key, Nonce::new(Counter(1), [2; 4]), RequestTag::FIRST, &command, &[3; 200]);
    (key, command, sealed)
}

#[divan::bench]
fn seal_frame(bencher: Bencher<'_, '_>) {
    let (key, command, _) = sealed();
    let nonce = Nonce::new(Counter(1), [2; 4]);
    bencher
        .counter(divan::counter::ItemsCount::new(1usize))
        .bench(|| seal(&key, black_box(nonce), RequestTag::FIRST, black_box(&command), &[3; 200]));
}

#[divan::bench]
fn open_frame(bencher: Bencher<'_, '_>) {
    let (key, _, sealed) = sealed();
    bencher.counter(divan::counter::ItemsCount::new(1usize)).bench(|| open(&key, black_box(&sealed)));
}

#[divan::bench]
fn up_stream(bencher: Bencher<'_, '_>) {
    let stream = sealed().2.as_bytes().repeat(100);
    bencher.counter(divan::counter::BytesCount::of_slice(&stream)).bench(|| {
        let mut frames = 0;
        UpDecoder::new().push(black_box(&stream), &mut |_, _| frames += 1);
        assert_eq!(frames, 100);
    });
}

/// The worst an adversary can do to the decoder: a magic every 8 bytes.
#[divan::bench]
fn down_stream_of_magics(bencher: Bencher<'_, '_>) {
    let stream = b"PIXELSAT".repeat(3_000);
    bencher
        .counter(divan::counter::BytesCount::of_slice(&stream))
        .bench(|| DownDecoder::new(false).push(black_box(&stream), &mut |_| {}));
}
