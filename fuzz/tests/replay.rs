//! Every body over its corpus and over seeded mutations of it. `FUZZ_ROUNDS` sets how many per body (default 20,000).
#![expect(clippy::unwrap_used, reason = "a corpus that cannot be read fails its test")]

use std::{fs, panic, path::Path};

use rand::{Rng, RngExt, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;

fn corpus(name: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
    let mut files: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(&path).unwrap()))
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{name} has no corpus");
    files
}

/// Another input: parts of the corpus joined, cut, flipped, filled.
fn mutate(rng: &mut impl Rng, corpus: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut data = corpus.choose(rng).unwrap().1.clone();
    for _ in 0..rng.random_range(1..6) {
        let at = rng.random_range(0..=data.len());
        match rng.random_range(0..8) {
            0 => data.truncate(at),
            1 if at < data.len() => data[at] ^= 1 << rng.random_range(0..8),
            2 if at < data.len() => data[at] = *[0, 1, 2, 0x7F, 0x80, 0xFF, 224, 225].choose(rng).unwrap(),
            3 if at < data.len() => drop(data.remove(at)),
            4 => data.insert(at, rng.random()),
            5 => {
                let other = &corpus.choose(rng).unwrap().1;
                let from = rng.random_range(0..=other.len());
                let to = rng.random_range(from..=other.len());
                data.splice(at..at, other[from..to].iter().copied());
            }
            6 => {
                let magic: &[u8] = if rng.random() { b"PIXELSAT" } else { b"DESTINY_" };
                data.splice(at..at, magic.iter().copied());
            }
            _ => data.extend((0..rng.random_range(0..64)).map(|_| rng.random::<u8>())),
        }
    }
    data.truncate(4_096);
    data
}

#[test]
fn every_body_holds_over_its_corpus_and_seeded_mutations() {
    let rounds = std::env::var("FUZZ_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000);
    for (seed, (name, body)) in (1..).zip(fuzz::BODIES) {
        let corpus = corpus(name);
        for (file, data) in &corpus {
            println!("{name} corpus/{name}/{file}");
            body(data);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for round in 0..rounds {
            let data = if round % 16 == 0 {
                let mut noise = vec![0; rng.random_range(0..600)];
                rng.fill_bytes(&mut noise);
                noise
            } else {
                mutate(&mut rng, &corpus)
            };
            if let Err(cause) = panic::catch_unwind(|| body(&data)) {
                println!("{name} seed {seed} round {round} breaks on {data:02x?}");
                panic::resume_unwind(cause);
            }
        }
    }
}
