//! Pictures brought home by strangers: our radio loses much, others hear much of the rest and say so later.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use rehearsal::{Report, Strangers, World, WorldConfig};
use satellite::PassProfile;

/// Our radio loses 40 %; passes come and go.
fn config(seed: u64, strangers: Option<Strangers>) -> WorldConfig {
    let mut config =
        WorldConfig { image_bytes: 40_000, strangers, ..WorldConfig::seeded(seed) }.with_passes();
    config.channel.loss = 0.4;
    config.channel.elevation_loss = false;
    config
}

/// The image comes home whole. That no chunk which is held, whoever heard it, is asked for again without a bridge event
/// is held at every step by the world itself (`Invariant::NoHeldChunk`); it compares the image byte for byte as well.
fn fly(seed: u64, strangers: Option<Strangers>) -> Report {
    World::new(config(seed, strangers)).run_until_image(10 * 86_400).unwrap()
}

#[test]
fn strangers_fill_the_gaps_and_nothing_that_anyone_heard_is_asked_for_again() {
    let (mut alone, mut together) = ((0, 0.0), (0, 0.0));
    for seed in 1..=30 {
        let with = fly(seed, Some(Strangers { hear: 0.6, delay_s: 2.0, abroad: false }));
        let without = fly(seed, None);
        for report in [&with, &without] {
            assert!(report.images_equal && report.images_complete == 1, "seed {seed}: {report:?}");
        }
        assert!(with.reported > 50, "seed {seed}: {} reports", with.reported);
        assert!(with.frames_heard > 0);
        alone = (alone.0 + without.chunks_requested, alone.1 + without.simulated_s);
        together = (together.0 + with.chunks_requested, together.1 + with.simulated_s);
    }
    println!("chunks asked for: {} alone, {} with strangers", alone.0, together.0);
    println!("simulated: {:.0} s alone, {:.0} s with strangers", alone.1, together.1);
    // 181 chunks of which each is asked for 1/0.6 times alone, 1/0.84 times together.
    assert!(together.0 * 100 < alone.0 * 85, "{} against {}", together.0, alone.0);
}

#[test]
fn reports_from_hours_later_are_as_good() {
    for seed in 1..=10 {
        let report = fly(seed, Some(Strangers { hear: 0.6, delay_s: 3_600.0, abroad: false }));
        assert!(report.images_equal, "seed {seed}");
        assert!(report.chunks_bridged < report.chunks_requested / 4, "seed {seed}: {report:?}");
    }
}

/// A pass every eight hours; more image than our own radio gets in two of them.
fn far(seed: u64, strangers: Option<Strangers>) -> Report {
    let mut config = WorldConfig { image_bytes: 100_000, ..config(seed, strangers) };
    if let PassProfile::Repeating { period_us, .. } = &mut config.channel.passes {
        *period_us = 8 * 3_600_000_000;
    }
    World::new(config).run_until_image(20 * 86_400).unwrap()
}

#[test]
fn others_hear_in_other_passes_what_ours_lost_and_tell_hours_later() {
    let (mut alone, mut together) = ((0, 0, 0), (0, 0, 0));
    let add = |sum: (u64, u64, u64), report: &Report| {
        (sum.0 + report.chunks_requested, sum.1 + report.passes, sum.2 + report.chunks_bridged)
    };
    for seed in 1..=20 {
        let strangers = Strangers { hear: 0.6, delay_s: 2.0 * 3_600.0, abroad: true };
        let (with, without) = (far(seed, Some(strangers)), far(seed, None));
        for report in [&with, &without] {
            assert!(report.images_equal && report.images_complete == 1, "seed {seed}: {report:?}");
        }
        assert!(with.scheduled > 0 && with.chunks_reported > 50, "seed {seed}: {with:?}");
        assert_eq!(with.chunks_reported_in_view, 0, "seed {seed}: reports come before our next pass");
        (alone, together) = (add(alone, &without), add(together, &with));
    }
    println!(
        "chunks asked for: {} alone, {} with strangers, {} of them bridges",
        alone.0, together.0, together.2
    );
    println!("passes over: {} alone, {} with strangers", alone.1, together.1);
    assert!(together.0 * 100 < alone.0 * 85, "{} against {}", together.0, alone.0);
    // Each of them has its event, or the world itself objects.
    assert!(together.2 * 4 < together.0, "{} bridges of {}", together.2, together.0);
}

#[test]
fn the_same_seed_is_the_same_story() {
    let strangers = Some(Strangers { hear: 0.6, delay_s: 60.0, abroad: false });
    assert_eq!(fly(7, strangers), fly(7, strangers));
}
