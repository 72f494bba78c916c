//! Forged, damaged, replayed and reordered uplinks: none is obeyed that was not sealed for this moment, and nothing
//! an attacker sends locks the ground out.

mod common;

use std::collections::HashSet;

use common::{config, key};
use proptest::prelude::*;
use protocol::{Counter, Key, Nonce, RequestTag, SealedUplink, Telecommand, seal};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satellite::{ReplayPolicy, Twin, TwinConfig, TwinState};

const FORGERIES: u64 = 100_000;

fn twin(replay: ReplayPolicy) -> Twin {
    Twin::new(TwinConfig { replay, ..config() }, TwinState::default())
}

fn ping(key: &Key, counter: u64, random: [u8; 4]) -> SealedUplink {
    seal(key, Nonce::new(Counter(counter), random), RequestTag::FIRST, &Telecommand::Ping, &[7; 200])
}

/// Hands a frame over and lets the satellite answer; true if it was obeyed.
fn is_obeyed(twin: &mut Twin, now_us: u64, bytes: &[u8]) -> bool {
    let before = twin.stats().accepted;
    twin.receive(now_us, bytes);
    while twin.next_journal().is_some() {}
    while twin.poll(now_us + 50_000).is_some() {
        twin.sent(now_us + 50_000);
    }
    twin.stats().accepted > before
}

#[test]
fn no_forgery_is_obeyed() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut twin = twin(ReplayPolicy::None);
    let real = ping(&key(), 1_000, [1, 2, 3, 4]);
    for round in 0..FORGERIES {
        let mut bytes = *real.as_bytes();
        match round % 4 {
            // anything behind the magic
            0 => rng.fill_bytes(&mut bytes[8..]),
            // one flipped bit of a real frame, the checksum's own apart
            1 => bytes[rng.random_range(12..240)] ^= 1 << rng.random_range(0..8_u32),
            // real ciphertext under another nonce
            2 => rng.fill_bytes(&mut bytes[12..24]),
            // another key
            _ => {
                let mut other = [0; 16];
                rng.fill_bytes(&mut other);
                bytes = *ping(&Key::from_bytes(other), round, [0; 4]).as_bytes();
            }
        }
        assert!(!is_obeyed(&mut twin, round * 100_000, &bytes), "round {round}");
    }
    let stats = *twin.stats();
    assert_eq!((stats.accepted, stats.refused.authentication), (0, FORGERIES));
    assert!(is_obeyed(&mut twin, FORGERIES * 100_000, real.as_bytes()), "no lock-out");
}

#[test]
fn every_recorded_frame_is_refused_when_it_is_played_again() {
    for policy in [ReplayPolicy::StrictlyGreater, ReplayPolicy::Icd, ReplayPolicy::ForwardWindow10] {
        let mut twin = twin(policy);
        let recorded: Vec<SealedUplink> =
            (1..=2_000).map(|counter| ping(&key(), counter, [1, 2, 3, 4])).collect();
        let mut now_us = 0;
        for frame in &recorded {
            now_us += 100_000;
            assert!(is_obeyed(&mut twin, now_us, frame.as_bytes()), "{policy:?}");
        }
        for frame in recorded.iter().chain(recorded.iter().rev()) {
            now_us += 100_000;
            assert!(!is_obeyed(&mut twin, now_us, frame.as_bytes()), "{policy:?}");
        }
    }
}

#[test]
fn without_a_policy_a_recording_is_obeyed() {
    let mut twin = twin(ReplayPolicy::None);
    let frame = ping(&key(), 5, [0; 4]);
    assert!(is_obeyed(&mut twin, 0, frame.as_bytes()) && is_obeyed(&mut twin, 100_000, frame.as_bytes()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever order, loss and repetition: no nonce is obeyed twice, and the next honest frame always is.
    #[test]
    fn no_nonce_is_obeyed_twice_and_nobody_is_locked_out(
        counters in prop::collection::vec(
            prop_oneof![1..200_u64, 1_000_000..30_000_000_u64, any::<u64>().prop_map(|c| c >> 1)],
            1..300,
        ),
        policy in prop_oneof![Just(ReplayPolicy::Icd), Just(ReplayPolicy::StrictlyGreater)],
    ) {
        let mut twin = twin(policy);
        let mut obeyed = HashSet::new();
        let mut now_us = 0;
        for counter in counters.iter().chain(counters.iter().rev()) {
            now_us += 100_000;
            if is_obeyed(&mut twin, now_us, ping(&key(), *counter, [1; 4]).as_bytes()) {
                prop_assert!(obeyed.insert(*counter), "counter {counter} was obeyed twice");
            }
        }
        let highest = twin.state().nonces.highest().map_or(0, |counter| counter.0);
        let honest = ping(&key(), highest + 1, [2; 4]);
        prop_assert!(is_obeyed(&mut twin, now_us + 100_000, honest.as_bytes()));
    }

    /// Arbitrary bytes neither panic nor answer.
    #[test]
    fn arbitrary_bytes_do_nothing(bytes in prop::collection::vec(any::<u8>(), 0..600), magics in 0..4_usize) {
        let mut twin = twin(ReplayPolicy::Icd);
        let mut packet = b"DESTINY_".repeat(magics);
        packet.extend(bytes);
        prop_assert!(!is_obeyed(&mut twin, 0, &packet));
        prop_assert_eq!(twin.stats().frames, 0);
    }
}
