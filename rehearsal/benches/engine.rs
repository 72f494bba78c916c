//! What the engine costs: `cargo bench -p rehearsal --bench engine`.
//!
//! First a table: whole worlds in simulated seconds per second, and the engine alone in frames per second beside the
//! bare stream decoder on the same bytes, both timed in turns in this run. Then divan's figures for single inputs.
//! `ENGINE_ONLY=bare` (or `passes`, `images`) runs one row alone, for a profiler.
#![expect(clippy::expect_used, reason = "a bench that cannot build its input, or breaks an invariant, stops")]
#![expect(clippy::disallowed_methods, reason = "a bench reads the clock")]

use std::{hint::black_box, time::Instant};

use divan::Bencher;
use mission::{
    Effect, Entropy, Input, LinkConfig, LinkId, LinkState, MonoUs, Now, Profile, SatelliteConfig,
    SatelliteId, Snapshot, Source, Station, StationConfig, StationId, UtcUs,
};
use protocol::{CHUNK_LEN, DownDecoder, Downlink, FrameForm, ImageInfo, Key, down_type, encode_down};
use radio::airtime::LinkTiming;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rehearsal::{Operator, Report, World, WorldConfig};

/// Frames of one run of the engine alone; one of its chunks each.
const FRAMES: u32 = 4_000;
/// Time on the air of a full frame, rounded: how far apart the engine hears two of them.
const FRAME_US: u64 = 1_230_000;

fn main() {
    let only = std::env::var("ENGINE_ONLY").ok();
    let wanted = |row: &str| only.as_deref().is_none_or(|only| only == row);
    if wanted("passes") || wanted("images") {
        println!("engine, driver, module, air, twin and every invariant checked, one thread");
        println!("{:<38}{:>14}{:>12}{:>10}", "", "simulated s/s", "frames/s", "wall s");
    }
    if wanted("passes") {
        world("passes, busy operator, 20 % lost", 20, |seed| {
            let config = WorldConfig {
                operator: Operator::Busy,
                view_is_known: true,
                image_bytes: 30_000,
                ..WorldConfig::seeded(seed).lossy(0.2, 1e-4).with_passes()
            };
            World::new(config).run_passes(50)
        });
    }
    if wanted("images") {
        world("always in view, images back to back", 150, |seed| {
            let config = WorldConfig { image_bytes: 200_000, ..WorldConfig::seeded(seed) };
            World::new(config).run_until_image(20_000)
        });
    }
    if wanted("bare") {
        bare();
    }
    if only.is_none() {
        divan::main();
    }
}

/// Some worlds, one after the other.
fn world(name: &str, worlds: u64, run: impl Fn(u64) -> Result<Report, rehearsal::Violation>) {
    let start = Instant::now();
    let (mut simulated_s, mut frames) = (0.0, 0);
    for seed in 1..=worlds {
        let report = run(seed).expect("every invariant holds");
        simulated_s += report.simulated_s;
        frames += report.frames_heard;
    }
    let wall_s = start.elapsed().as_secs_f64();
    println!("{name:<38}{:>14.0}{:>12.0}{wall_s:>10.2}", simulated_s / wall_s, frames as f64 / wall_s);
}

/// Seconds of the fastest of some runs.
fn fastest(mut run: impl FnMut()) -> f64 {
    let timed = (0..20).map(|_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    });
    timed.fold(f64::INFINITY, f64::min)
}

fn bare() {
    println!("\nthe engine alone, persists confirmed at once, {FRAMES} frames, fastest of 20 runs");
    println!("{:<38}{:>14}{:>12}{:>16}", "", "simulated s/s", "frames/s", "times decoding");
    for (name, is_chunk) in [("image chunks", true), ("heartbeats", false)] {
        let frames = frames(is_chunk);
        let decoding = fastest(|| {
            let mut decoder = DownDecoder::new(true);
            let mut count = 0;
            for frame in &frames {
                decoder.push(black_box(frame), &mut |_| count += 1);
            }
            assert!(count >= FRAMES);
        });
        let engine = fastest(|| {
            let mut ground = Ground::new();
            for frame in &frames {
                ground.hear(black_box(frame));
            }
            assert!(ground.records >= u64::from(FRAMES));
        });
        let rate = f64::from(FRAMES) / engine;
        println!("{name:<38}{:>14.0}{rate:>12.0}{:>16.1}", rate * FRAME_US as f64 / 1e6, engine / decoding);
    }
    println!();
}

/// Frames as a radio delivers them, RSSI byte behind each. Chunks come after the ImageInfo that declares them.
fn frames(is_chunk: bool) -> Vec<Vec<u8>> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let info = ImageInfo {
        exists: true,
        chunks: FRAMES,
        size_bytes: FRAMES * CHUNK_LEN as u32,
        width_px: 3_280,
        height_px: 2_464,
    };
    let declared = is_chunk.then(|| framed(&Downlink::ImageInfo(info)));
    let packets = (0..FRAMES).map(|n| {
        let mut payload = [0; 224];
        rng.fill_bytes(&mut payload);
        let packet = if is_chunk {
            let index = u16::try_from(n).expect("few chunks");
            payload[..2].copy_from_slice(&index.to_be_bytes());
            Downlink::decode(down_type::IMAGE_CHUNK, &payload)
        } else {
            payload[116] &= 1;
            Downlink::decode(down_type::HEARTBEAT, &payload[..117])
        };
        framed(&packet.expect("a legal payload"))
    });
    declared.into_iter().chain(packets).collect()
}

fn framed(packet: &Downlink) -> Vec<u8> {
    let mut out = [0; 240];
    let len = encode_down(packet, None, FrameForm::Short, &mut out);
    let mut bytes = out[..len].to_vec();
    bytes.push(100);
    bytes
}

struct Zero;

impl Entropy for Zero {
    fn fill(&mut self, bytes: &mut [u8]) {
        bytes.fill(0);
    }
}

/// A station whose storage is done before it begins.
struct Ground {
    station: Station,
    link: LinkId,
    now_us: u64,
    records: u64,
}

impl Ground {
    fn new() -> Self {
        let satellite = SatelliteId::new("pixelsat-1").expect("a legal name");
        let link = LinkId::new("radio").expect("a legal name");
        let config = StationConfig {
            station: StationId::new("home").expect("a legal name"),
            site: None,
            times: mission::config::Times::default(),
            satellites: vec![SatelliteConfig {
                id: satellite.clone(),
                profile: Profile::default(),
                key: Some(Key::from_bytes([7; 16])),
                limits: Vec::new(),
            }],
            links: vec![LinkConfig {
                id: link.clone(),
                satellite,
                timing: LinkTiming::default(),
                armed: true,
                receive_only: false,
            }],
        };
        let station = Station::new(config, Snapshot::default(), Box::new(Zero), at(0));
        let mut ground = Self { station, link: link.clone(), now_us: 0, records: 0 };
        ground.tell(Input::Clock { synchronised: true });
        ground.tell(Input::Link { link: &link, state: LinkState::Ok });
        ground
    }

    /// One frame, when its time on the air is over.
    fn hear(&mut self, bytes: &[u8]) {
        self.now_us += FRAME_US;
        let (link, received) = (self.link.clone(), at(self.now_us));
        self.tell(Input::Bytes { link: &link, bytes, source: Source::Radio, received });
    }

    fn tell(&mut self, input: Input<'_>) {
        let now = at(self.now_us);
        self.station.handle(now, input);
        while let Some(effect) = self.station.next_effect() {
            match effect {
                Effect::Persist(batch) => {
                    self.records += black_box(&batch.records).len() as u64;
                    self.station.handle(now, Input::PersistDone(batch.id));
                }
                Effect::Witness { key, counter } => {
                    self.station.handle(now, Input::WitnessDone { key, counter });
                }
                Effect::Transmit(_)
                | Effect::Reply { .. }
                | Effect::Taken { .. }
                | Effect::Reserve(_)
                | Effect::ReserveClear => {}
            }
        }
    }
}

fn at(us: u64) -> Now {
    let utc_us = 1_800_000_000_000_000 + i64::try_from(us).expect("no such time");
    Now { mono: MonoUs(us), utc: UtcUs(utc_us) }
}

/// The engine looks whether there is something to do, and there is nothing.
#[divan::bench]
fn wake(bencher: Bencher<'_, '_>) {
    let mut ground = Ground::new();
    bencher.bench_local(|| {
        ground.now_us += 1_000_000;
        ground.tell(Input::Wake);
    });
}

/// One heartbeat: frame, reception, every value of it, confirmed.
#[divan::bench]
fn heartbeat(bencher: Bencher<'_, '_>) {
    let frames = frames(false);
    let mut ground = Ground::new();
    let mut next = frames.iter().cycle();
    bencher.bench_local(|| next.next().map(|frame| ground.hear(frame)));
}

/// What the page and the API ask for.
#[divan::bench]
fn status(bencher: Bencher<'_, '_>) {
    let mut ground = Ground::new();
    for frame in frames(true).iter().take(1_000) {
        ground.hear(frame);
    }
    bencher.bench_local(|| black_box(ground.station.status(at(ground.now_us))));
}
