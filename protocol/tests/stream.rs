//! The stream decoders against damage, adversaries and a naive oracle. Every failure prints its seed.
#![expect(clippy::unwrap_used, reason = "a test that cannot build its stream fails")]

use protocol::{
    ChunkIndex, Counter, DOWN_MAGIC, DownDecoder, DownFrame, DownItem, Downlink, FrameForm, Heartbeat,
    ImageChunk, Key, Nonce, RequestTag, SealedUplink, Telecommand, UP_MAGIC, UpDecoder, crc32, encode_down,
    open, seal,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

// ---- what comes out, owned -----------------------------------------------------------------------------------------

#[derive(Clone, Debug, PartialEq)]
enum Item {
    Frame { offset: u64, bytes: Vec<u8>, nested: bool, at: u64 },
    Promoted { offset: u64, bytes: Vec<u8>, at: u64 },
    Rssi { frame_offset: u64, dbm: i16, at: u64 },
}

/// Feeds in pieces; `at` is the number of bytes pushed when the item came out.
fn decode(stream: &[u8], rssi: bool, mut piece: impl FnMut() -> usize) -> (Vec<Item>, DownDecoder) {
    let mut decoder = DownDecoder::new(rssi);
    let mut items = Vec::new();
    let mut rest = stream;
    let mut at = 0;
    while !rest.is_empty() {
        let (now, later) = rest.split_at(piece().clamp(1, rest.len()));
        at += now.len() as u64;
        decoder.push(now, &mut |item| {
            items.push(match item {
                DownItem::Frame { offset, frame, nested } => {
                    Item::Frame { offset, bytes: frame.bytes().to_vec(), nested, at }
                }
                DownItem::Promoted { offset, frame } => {
                    Item::Promoted { offset, bytes: frame.bytes().to_vec(), at }
                }
                DownItem::Rssi { frame_offset, dbm } => Item::Rssi { frame_offset, dbm, at },
            });
        });
        rest = later;
        assert_eq!(decoder.position(), at);
    }
    (items, decoder)
}

/// The same items without `at`, which depends on the pieces.
fn timeless(items: &[Item]) -> Vec<Item> {
    let mut items = items.to_vec();
    for item in &mut items {
        match item {
            Item::Frame { at, .. } | Item::Promoted { at, .. } | Item::Rssi { at, .. } => *at = 0,
        }
    }
    items
}

/// All frames by the ICD's words: at every offset with a magic, 16 + length first, else 240.
fn oracle(stream: &[u8]) -> Vec<(u64, Vec<u8>)> {
    let mut frames = Vec::new();
    for at in 0..stream.len() {
        let here = &stream[at..];
        if !here.starts_with(&DOWN_MAGIC) || here.len() < 16 {
            continue;
        }
        let length = usize::from(here[14]) << 8 | usize::from(here[15]);
        let crc = u32::from_be_bytes(here[8..12].try_into().unwrap());
        let valid = |len: usize| here.get(12..len).is_some_and(|contents| crc32(contents) == crc);
        if length <= 224 && valid(16 + length) {
            frames.push((at as u64, here[..16 + length].to_vec()));
        } else if valid(240) {
            frames.push((at as u64, here[..240].to_vec()));
        }
    }
    frames
}

// ---- what goes in --------------------------------------------------------------------------------------------------

fn frame(packet: &Downlink, tag: u8, form: FrameForm) -> Vec<u8> {
    let mut out = [0xA5; 240];
    let len = encode_down(packet, RequestTag::new(tag), form, &mut out);
    out[..len].to_vec()
}

/// A 240-byte frame with these 228 bytes of contents.
fn full_of(contents: &[u8; 228]) -> Vec<u8> {
    let mut out = DOWN_MAGIC.to_vec();
    out.extend(crc32(contents).to_be_bytes());
    out.extend(contents);
    out
}

fn chunk(index: u16, data: &[u8]) -> Downlink {
    let mut chunk = ImageChunk { index: ChunkIndex(index), data: [0x23; 222] };
    chunk.data[..data.len()].copy_from_slice(data);
    Downlink::ImageChunk(chunk)
}

fn heartbeat(rng: &mut impl Rng) -> Downlink {
    let mut payload = [0; 117];
    rng.fill_bytes(&mut payload);
    payload[116] &= 1;
    let packet = Downlink::decode(6, &payload).unwrap();
    assert!(matches!(packet, Downlink::Heartbeat(Heartbeat { .. })));
    packet
}

fn any_frame(rng: &mut impl Rng) -> Vec<u8> {
    let form = if rng.random_bool(0.5) { FrameForm::Short } else { FrameForm::Full };
    let tag = rng.random();
    match rng.random_range(0..8) {
        0 => frame(&Downlink::Pong, tag, form),
        1 => frame(&heartbeat(rng), tag, form),
        2 => {
            // A chunk that holds a whole short frame, and perhaps the beginning of another.
            let mut data = vec![0x31; rng.random_range(0..60)];
            data.extend(frame(&Downlink::Pong, 0, FrameForm::Short));
            if rng.random() {
                data.extend(&frame(&heartbeat(rng), 0, FrameForm::Short)[..100]);
            }
            frame(&chunk(rng.random(), &data), tag, form)
        }
        3 => {
            // A chunk that ends with magics.
            let mut data = [0; 222];
            data[222 - 24..].copy_from_slice(&DOWN_MAGIC.repeat(3));
            frame(&chunk(rng.random(), &data), tag, form)
        }
        4 => {
            let mut contents = [0; 228];
            rng.fill_bytes(&mut contents);
            full_of(&contents)
        }
        _ => {
            let mut data = [0; 222];
            rng.fill_bytes(&mut data);
            frame(&chunk(rng.random(), &data), tag, form)
        }
    }
}

/// A stream of frames, damaged at a rate per byte, and where the frames stand that came through whole.
struct Damaged {
    stream: Vec<u8>,
    intact: Vec<(u64, Vec<u8>)>,
    sent: usize,
}

fn damage(rng: &mut impl Rng, frames: usize, rate: f64, rssi: bool) -> Damaged {
    let (mut stream, mut intact) = (Vec::new(), Vec::new());
    let hit = |stream: &mut Vec<u8>, rng: &mut dyn Rng, bytes: &[u8]| {
        let mut whole = true;
        let mut cut = false;
        for byte in bytes {
            if cut {
                break;
            }
            if !rng.random_bool(rate) {
                stream.push(*byte);
                continue;
            }
            whole = false;
            match rng.random_range(0..4) {
                0 => {}                                                 // deleted
                1 => stream.push(byte ^ (1 << rng.random_range(0..8))), // flipped
                2 => stream.extend([rng.random(), *byte]),              // inserted
                _ => cut = true,                                        // tail lost
            }
        }
        whole
    };
    for _ in 0..frames {
        match rng.random_range(0..6) {
            0 => stream.extend([0xDE, 0x69, 0x19]), // the radio's own header
            1 => stream.extend(&DOWN_MAGIC[..rng.random_range(0..=8)]),
            2 => stream.extend((0..rng.random_range(0..40)).map(|_| rng.random::<u8>())),
            _ => {}
        }
        let bytes = any_frame(rng);
        let offset = stream.len() as u64;
        if hit(&mut stream, rng, &bytes) {
            intact.push((offset, bytes));
        }
        if rssi {
            let byte = rng.random();
            stream.push(if byte == b'P' { 0 } else { byte });
        }
    }
    Damaged { stream, intact, sent: frames }
}

// ---- damage --------------------------------------------------------------------------------------------------------

#[test]
fn no_intact_frame_is_lost_or_delayed_and_no_false_one_appears() {
    for (seed, rate) in [(1, 0.0), (2, 1e-5), (3, 1e-4), (4, 1e-3), (5, 1e-2)] {
        for rssi in [false, true] {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let Damaged { stream, intact, sent } = damage(&mut rng, 8_000, rate, rssi);
            // One byte at a time: `at` is then the exact position of each item.
            let (items, decoder) = decode(&stream, rssi, || 1);

            let mut found = items.iter().filter_map(|item| match item {
                Item::Frame { offset, bytes, at, .. } => Some((*offset, bytes, *at)),
                _ => None,
            });
            let mut lost = 0;
            for (offset, bytes) in &intact {
                match found.find(|(o, b, _)| o == offset && *b == bytes) {
                    Some((_, _, at)) => {
                        assert_eq!(
                            at,
                            offset + bytes.len() as u64,
                            "seed {seed} {rate}: the frame at {offset} is late"
                        );
                    }
                    None => lost += 1,
                }
            }
            assert_eq!(
                lost,
                0,
                "seed {seed} rate {rate}: {lost} of {} intact frames lost ({sent} sent)",
                intact.len()
            );

            // Nothing false: the oracle finds the same frames, no more.
            let frames: Vec<_> = items
                .iter()
                .filter_map(|item| match item {
                    Item::Frame { offset, bytes, .. } => Some((*offset, bytes.clone())),
                    _ => None,
                })
                .collect();
            let mut sorted = frames.clone();
            sorted.sort();
            assert_eq!(sorted, oracle(&stream), "seed {seed} rate {rate}");
            assert_eq!(decoder.counters().frames as usize, frames.len());

            // Pieces make no difference.
            let mut pieces = ChaCha8Rng::seed_from_u64(seed + 100);
            for most in [7, 300, 5_000, usize::MAX] {
                let (other, decoder_2) = decode(&stream, rssi, || pieces.random_range(1..=most));
                assert_eq!(timeless(&other), timeless(&items), "seed {seed} rate {rate} pieces up to {most}");
                assert_eq!(decoder_2.counters(), decoder.counters());
            }
        }
    }
}

#[test]
fn an_intact_frame_counts_at_once_unless_it_lies_within_what_another_claims() {
    // How often, and by how many bytes, a genuine frame waits to be promoted.
    for (seed, rate) in [(11, 1e-5), (12, 1e-4), (13, 1e-3)] {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let Damaged { stream, intact, .. } = damage(&mut rng, 20_000, rate, false);
        let (items, _) = decode(&stream, false, || 1);
        let (mut counted_late, mut most) = (0, 0);
        for (offset, bytes) in &intact {
            let end = offset + bytes.len() as u64;
            let at = items.iter().find_map(|item| match item {
                Item::Frame { offset: o, nested: false, at, .. } if o == offset => Some(*at),
                Item::Promoted { offset: o, at, .. } if o == offset => Some(*at),
                _ => None,
            });
            let at = at.unwrap_or_else(|| panic!("seed {seed}: the frame at {offset} never counts"));
            if at > end {
                counted_late += 1;
                most = most.max(at - end);
            }
        }
        println!(
            "rate {rate}: {counted_late} of {} intact frames counted late, at most {most} bytes",
            intact.len()
        );
        // Only frames that follow a frame cut short within its claimed payload; under 240 - 16 bytes by construction.
        assert!(counted_late as f64 <= 0.02 * intact.len() as f64, "seed {seed}: {counted_late}");
        assert!(most < 224, "seed {seed}: {most}");
    }
}

#[test]
fn noise_makes_no_frames() {
    // 10^8 bytes; `NOISE_BYTES` for more.
    let total = std::env::var("NOISE_BYTES").ok().and_then(|n| n.parse().ok()).unwrap_or(100_000_000u64);
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let mut decoder = DownDecoder::new(true);
    let mut noise = vec![0; 1 << 16];
    while decoder.position() < total {
        rng.fill_bytes(&mut noise);
        // Sow magics, so that candidates are decided all the time.
        for _ in 0..200 {
            let at = rng.random_range(0..noise.len() - 8);
            noise[at..at + 8].copy_from_slice(&DOWN_MAGIC);
        }
        decoder.push(&noise, &mut |item| panic!("seed 21: {item:?}"));
    }
    let counters = decoder.counters();
    assert_eq!(counters.frames, 0);
    assert!(counters.bad_crc + counters.bad_header > total / 400, "{counters:?}");
    assert!(decoder.position() - counters.skipped_bytes < 240, "{counters:?}");
}

// ---- adversary -----------------------------------------------------------------------------------------------------

/// Overlaps, frames in frames in frames, repeated magics, cut frames, zeros.
fn adversarial(rng: &mut impl Rng) -> Vec<u8> {
    let mut stream: Vec<u8> = Vec::new();
    for _ in 0..rng.random_range(1..12) {
        match rng.random_range(0..9) {
            0 => stream.extend(DOWN_MAGIC.repeat(rng.random_range(1..40))),
            1 => stream.extend(vec![0; rng.random_range(0..300)]),
            2 => {
                let frame = any_frame(rng);
                stream.extend(&frame[..rng.random_range(0..=frame.len())]);
            }
            3 => {
                // Full form with frames in its padding or anywhere.
                let mut contents = [0; 228];
                if rng.random() {
                    rng.fill_bytes(&mut contents);
                }
                contents[2] = 0;
                contents[3] = rng.random_range(0..=230);
                for _ in 0..rng.random_range(0..4) {
                    let inner = frame(&Downlink::Pong, rng.random(), FrameForm::Short);
                    let at = rng.random_range(0..228 - 16);
                    contents[at..at + 16].copy_from_slice(&inner);
                }
                stream.extend(full_of(&contents));
            }
            4 => {
                // A frame whose last bytes are the first of the next: valid frames that overlap.
                let mut data = [0x42; 222];
                let inner = frame(&heartbeat(rng), 1, FrameForm::Short);
                let shown = rng.random_range(1..=inner.len());
                data[222 - shown..].copy_from_slice(&inner[..shown]);
                stream.extend(frame(&chunk(1, &data), 2, FrameForm::Full));
                stream.extend(&inner[shown..]);
            }
            5 => {
                // Three deep.
                let mut data = vec![1; rng.random_range(0..20)];
                let innermost = frame(&Downlink::Pong, 3, FrameForm::Short);
                let mut payload = [0; 117];
                payload[..16].copy_from_slice(&innermost);
                data.extend(frame(&Downlink::decode(6, &payload).unwrap(), 4, FrameForm::Short));
                stream.extend(frame(&chunk(9, &data), 5, FrameForm::Full));
            }
            _ => stream.extend(any_frame(rng)),
        }
        if rng.random_bool(0.2) && !stream.is_empty() {
            let at = rng.random_range(0..stream.len());
            match rng.random_range(0..3) {
                0 => drop(stream.remove(at)),
                1 => stream.insert(at, rng.random()),
                _ => stream[at] ^= 1 << rng.random_range(0..8),
            }
        }
    }
    stream
}

#[test]
fn the_same_frames_as_the_oracle_on_adversarial_streams() {
    for seed in 0..6_000 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let stream = adversarial(&mut rng);
        let rssi = rng.random();
        let (items, decoder) = decode(&stream, rssi, || 1);
        let most = *[3usize, 40, 250, 600, 10_000].get(rng.random_range(0..5)).unwrap();
        let (pieced, decoder_2) = decode(&stream, rssi, || rng.random_range(1..=most));
        assert_eq!(timeless(&pieced), timeless(&items), "seed {seed}");
        assert_eq!(decoder_2.counters(), decoder.counters(), "seed {seed}");

        let expected = oracle(&stream);
        let mut frames = Vec::new();
        let mut counts = std::collections::BTreeMap::new();
        for item in &items {
            match item {
                Item::Frame { offset, bytes, nested, at } => {
                    assert_eq!(*at, offset + bytes.len() as u64, "seed {seed}: late");
                    frames.push((*offset, bytes.clone()));
                    assert_eq!(counts.insert(*offset, !nested), None, "seed {seed}: twice");
                }
                Item::Promoted { offset, bytes, .. } => {
                    assert!(frames.contains(&(*offset, bytes.clone())), "seed {seed}");
                    assert_eq!(
                        counts.insert(*offset, true),
                        Some(false),
                        "seed {seed}: promoted twice or not nested"
                    );
                }
                Item::Rssi { .. } => {}
            }
        }
        frames.sort();
        assert_eq!(frames, expected, "seed {seed}");

        // A frame that never counts lies inside a valid one. One inside the payload of a valid one that follows the ICD
        // and whose beginning no valid frame overlaps does not count.
        let span = |(o, b): &(u64, Vec<u8>)| (*o, *o + b.len() as u64);
        let is_in = |inner: (u64, u64), outer: (u64, u64)| outer.0 < inner.0 && inner.1 <= outer.1;
        let spans: Vec<_> = expected.iter().map(span).collect();
        for inner in &expected {
            let inner = span(inner);
            if inner.1 > stream.len() as u64 - 240u64.min(stream.len() as u64) {
                continue; // may still be undecided
            }
            if !counts[&inner.0] {
                assert!(
                    spans.iter().any(|outer| is_in(inner, *outer)),
                    "seed {seed}: {inner:?} never counts"
                );
            }
            let in_payload = expected.iter().any(|(o, b)| {
                let length = u64::from(u16::from_be_bytes([b[14], b[15]]));
                let payload_end = if length <= 224 { o + 16 + length } else { o + 240 };
                let padding_is_zero = b[(payload_end - o) as usize..].iter().all(|byte| *byte == 0);
                let overlapped = spans.iter().any(|s| s.0 < *o && *o < s.1)
                    || (8..16).any(|at| b[at..].starts_with(&DOWN_MAGIC));
                is_in(inner, (*o, payload_end)) && padding_is_zero && !overlapped
            });
            if in_payload {
                assert!(
                    !counts[&inner.0],
                    "seed {seed}: {inner:?} counts, but is part of another: {spans:?}"
                );
            }
        }

        // Each byte is a frame's, RSSI, skipped, or undecided.
        let counters = decoder.counters();
        let mut is_frame = vec![false; stream.len()];
        for (from, to) in &spans {
            is_frame[*from as usize..*to as usize].fill(true);
        }
        let outside = is_frame.iter().filter(|is| !**is).count() as u64;
        assert!(counters.skipped_bytes <= outside, "seed {seed}: {counters:?} {outside}");
        assert!(
            outside <= counters.skipped_bytes + counters.rssi_bytes + 239,
            "seed {seed}: {counters:?} {outside}"
        );
        assert_eq!(counters.frames as usize, expected.len(), "seed {seed}");
    }
}

// ---- cases ---------------------------------------------------------------------------------------------------------

fn plain(stream: &[u8], rssi: bool) -> Vec<Item> {
    decode(stream, rssi, || 1).0
}

#[test]
fn a_frame_behind_one_that_lost_its_tail_is_not_late() {
    let cut = &frame(&chunk(1, &[]), 1, FrameForm::Full)[..200];
    let good = frame(&chunk(2, &[]), 1, FrameForm::Full);
    let items = plain(&[cut, &good].concat(), false);
    assert_eq!(items, [Item::Frame { offset: 200, bytes: good, nested: false, at: 440 }]);
}

#[test]
fn short_frame_is_tried_before_full() {
    let good = frame(&Downlink::Pong, 1, FrameForm::Short);
    let items = plain(&good, false);
    assert_eq!(items, [Item::Frame { offset: 0, bytes: good, nested: false, at: 16 }]);
}

#[test]
fn a_damaged_short_frame_does_not_hold_up_the_next() {
    let mut bad = frame(&Downlink::Pong, 1, FrameForm::Short);
    bad[13] ^= 1;
    let good = frame(&Downlink::Pong, 2, FrameForm::Short);
    let items = plain(&[&bad[..], &good].concat(), false);
    assert_eq!(items, [Item::Frame { offset: 16, bytes: good, nested: false, at: 32 }]);
}

#[test]
fn a_frame_inside_an_image_chunk_is_nested_for_good() {
    let inner = frame(&Downlink::Pong, 0, FrameForm::Short);
    // In the middle, and as the very last bytes.
    for at in [0, 100, 206] {
        let mut data = [7; 222];
        data[at..at + 16].copy_from_slice(&inner);
        let outer = frame(&chunk(3, &data), 9, FrameForm::Full);
        let after = frame(&heartbeat(&mut ChaCha8Rng::seed_from_u64(1)), 0, FrameForm::Short);
        let items = plain(&[&outer[..], &after].concat(), false);
        let inner_offset = 18 + at as u64;
        let nested =
            Item::Frame { offset: inner_offset, bytes: inner.clone(), nested: true, at: inner_offset + 16 };
        let whole = Item::Frame { offset: 0, bytes: outer.clone(), nested: false, at: 240 };
        let last = Item::Frame { offset: 240, bytes: after, nested: false, at: 373 };
        let expected = if at == 206 { [whole, nested, last] } else { [nested, whole, last] };
        assert_eq!(items, expected, "inner frame at {at}");
    }
}

#[test]
fn a_frame_behind_a_cut_chunk_is_promoted_when_the_chunk_fails_or_the_line_is_silent() {
    let cut = &frame(&chunk(1, &[]), 1, FrameForm::Full)[..100];
    let pong = frame(&Downlink::Pong, 2, FrameForm::Short);
    let stream = [cut, &pong].concat();
    let first = Item::Frame { offset: 100, bytes: pong.clone(), nested: true, at: 116 };

    // The chunk's 240 bytes pass: promoted with the last of them, RSSI and all.
    let items = plain(&[&stream[..], &[200], &[0x55; 200]].concat(), true);
    let promoted = Item::Promoted { offset: 100, bytes: pong.clone(), at: 240 };
    assert_eq!(items, [first.clone(), promoted, Item::Rssi { frame_offset: 100, dbm: -56, at: 240 }]);

    // The line falls silent: promoted at once, and the RSSI byte still counts when it comes.
    let (items, mut decoder) = decode(&stream, true, || 1);
    assert_eq!(items, [first]);
    assert!(decoder.in_frame());
    let mut seen = Vec::new();
    decoder.silence(&mut |item| match item {
        DownItem::Promoted { offset, frame } => seen.push((offset, frame.bytes().to_vec())),
        other => panic!("{other:?}"),
    });
    assert_eq!(seen, [(100, pong)]);
    assert!(!decoder.in_frame());
    decoder.push(&[156], &mut |item| assert_eq!(item, DownItem::Rssi { frame_offset: 100, dbm: -100 }));
    assert_eq!(decoder.counters().promoted, 1);
    assert_eq!(decoder.counters().rssi_bytes, 1);
}

#[test]
fn a_pause_inside_a_frame_loses_nothing() {
    let good = frame(&chunk(1, &[]), 1, FrameForm::Full);
    let mut decoder = DownDecoder::new(false);
    decoder.push(&good[..120], &mut |item| panic!("{item:?}"));
    decoder.silence(&mut |item| panic!("{item:?}"));
    let mut frames = 0;
    decoder.push(&good[120..], &mut |item| {
        assert!(matches!(item, DownItem::Frame { offset: 0, nested: false, .. }));
        frames += 1;
    });
    assert_eq!(frames, 1);
}

#[test]
fn a_magic_at_the_end_of_a_chunk_does_not_hold_up_what_follows() {
    // The chunk ends with a header that claims 200 bytes of payload: the next frame lies within the claim.
    let mut data = [0; 222];
    data[222 - 16..214].copy_from_slice(&DOWN_MAGIC);
    data[222 - 1] = 200;
    let outer = frame(&chunk(3, &data), 9, FrameForm::Full);
    let after = frame(&Downlink::Pong, 0, FrameForm::Short);
    let items = plain(&[&outer[..], &after].concat(), false);
    assert_eq!(items[1], Item::Frame { offset: 240, bytes: after, nested: false, at: 256 });
}

#[test]
fn repeated_magics_before_a_frame_do_not_hold_it_up() {
    let pong = frame(&Downlink::Pong, 0, FrameForm::Short);
    for repeats in 1..40 {
        let stream = [&DOWN_MAGIC.repeat(repeats)[..], &pong].concat();
        let offset = 8 * repeats as u64;
        let expected = Item::Frame { offset, bytes: pong.clone(), nested: false, at: offset + 16 };
        assert_eq!(plain(&stream, false), [expected]);
    }
}

#[test]
fn rssi_is_the_byte_after_a_frame_unless_it_begins_a_magic() {
    let pong = frame(&Downlink::Pong, 1, FrameForm::Short);
    let rssi = |stream: &[u8]| -> Vec<(u64, i16)> {
        let items = plain(stream, true).into_iter();
        items
            .filter_map(|item| match item {
                Item::Rssi { frame_offset, dbm, at } => {
                    assert_eq!(at, frame_offset + 17);
                    Some((frame_offset, dbm))
                }
                _ => None,
            })
            .collect()
    };
    assert_eq!(rssi(&[&pong[..], &[156]].concat()), [(0, -100)]);
    assert_eq!(rssi(&[&pong[..], &[255]].concat()), [(0, -1)]);
    assert_eq!(rssi(&[&pong[..], &[0]].concat()), []);
    assert_eq!(rssi(&pong), []);
    assert_eq!(rssi(&[&pong[..], &pong, &[1]].concat()), [(16, -255)]);
    assert_eq!(rssi(&[&pong[..], b"PI"].concat()), []);
    let framed = plain(&[&pong[..], &[156]].concat(), false);
    assert_eq!(framed.len(), 1, "no RSSI unless the profile says so");
}

#[test]
fn a_full_frame_with_a_senseless_header_is_kept() {
    let mut contents = [0xEE; 228];
    contents[2] = 0xFF;
    let bytes = full_of(&contents);
    let items = plain(&bytes, false);
    assert_eq!(items, [Item::Frame { offset: 0, bytes: bytes.clone(), nested: false, at: 240 }]);
    let frame = DownFrame::parse(&bytes).unwrap();
    assert_eq!(frame.header(), None);
    assert_eq!(frame.payload().len(), 224);
    assert!(frame.packet().is_err());
}

#[test]
fn reset_forgets_everything() {
    let good = frame(&chunk(1, &[]), 1, FrameForm::Full);
    let mut decoder = DownDecoder::new(true);
    decoder.push(&good[..100], &mut |_| {});
    decoder.reset();
    assert_eq!((decoder.position(), decoder.in_frame()), (0, false));
    decoder.push(&good[100..], &mut |item| panic!("{item:?}"));
}

// ---- uplink --------------------------------------------------------------------------------------------------------

#[test]
fn every_uplink_magic_with_232_bytes_behind_it_is_a_candidate() {
    for seed in 0..400 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let key = Key::from_bytes(rng.random());
        let (mut stream, mut intact) = (Vec::new(), Vec::new());
        for n in 0..rng.random_range(1..12) {
            match rng.random_range(0..4) {
                0 => stream.extend(UP_MAGIC.repeat(rng.random_range(1..35))),
                1 => stream.extend((0..rng.random_range(0..300)).map(|_| rng.random::<u8>())),
                2 => stream.extend([0xDE, 0x69, 0x19]),
                _ => {}
            }
            let mut padding = [0; 200];
            rng.fill_bytes(&mut padding);
            let sealed = seal(
                &key,
                Nonce::new(Counter(n), rng.random()),
                RequestTag::FIRST,
                &Telecommand::Ping,
                &padding,
            );
            let mut bytes = sealed.as_bytes().to_vec();
            match rng.random_range(0..5) {
                0 => bytes.truncate(rng.random_range(0..200)),
                1 => drop(bytes.remove(rng.random_range(0..200))),
                2 => bytes[rng.random_range(12..240)] ^= 0x10, // the CRC is not under the GCM tag
                _ => intact.push((stream.len() as u64, sealed)),
            }
            stream.extend(bytes);
        }
        let expected: Vec<_> = (0..stream.len().saturating_sub(239))
            .filter(|at| stream[*at..].starts_with(&UP_MAGIC))
            .map(|at| (at as u64, SealedUplink::try_from(&stream[at..at + 240]).unwrap()))
            .collect();
        for most in [1, 9, 300, 5_000] {
            let (mut found, mut decoder, mut rest, mut at) = (Vec::new(), UpDecoder::new(), &stream[..], 0);
            while !rest.is_empty() {
                let (now, later) = rest.split_at(rng.random_range(1..=most).min(rest.len()));
                at += now.len() as u64;
                decoder.push(now, &mut |offset, sealed| {
                    assert!(at - now.len() as u64 <= offset + 239 && offset + 240 <= at, "seed {seed}: late");
                    found.push((offset, *sealed));
                });
                rest = later;
            }
            assert_eq!(found, expected, "seed {seed}");
            assert_eq!(decoder.counters().candidates as usize, expected.len());
            let opened: Vec<_> = found.into_iter().filter(|(_, sealed)| open(&key, sealed).is_ok()).collect();
            assert_eq!(opened, intact, "seed {seed}");
        }
    }
}
