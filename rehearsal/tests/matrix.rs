//! The main job in virtual time: whatever the air does, the image on the ground becomes the satellite's.

use rehearsal::{Operator, Report, Violation, World, WorldConfig};

/// A violation prints its seed, which replays it.
#[track_caller]
fn held(run: Result<Report, Violation>) -> Report {
    match run {
        Ok(report) => report,
        Err(violation) => unreachable!("{violation}"),
    }
}

/// Chance per byte of a flipped bit where flips are on: a full frame in forty is damaged.
const FLIPS: f64 = 1e-4;

fn brings_the_image_home(loss: f64, flips: f64) {
    for seed in 1..=20 {
        let config =
            WorldConfig { operator: Operator::WantsImage, ..WorldConfig::seeded(seed).lossy(loss, flips) };
        let report = held(World::new(config).run_until_image(20_000));
        assert!(report.images_equal, "seed {seed}");
        if loss == 0.0 && flips == 0.0 {
            assert_eq!(report.chunks_bridged, 0, "seed {seed}");
            assert_eq!(
                report.chunks_sent, report.image_chunks,
                "seed {seed}: nothing is sent twice on a clean channel"
            );
        }
    }
}

#[test]
fn image_comes_home_over_a_clean_channel() {
    brings_the_image_home(0.0, 0.0);
}

#[test]
fn image_comes_home_with_flips() {
    brings_the_image_home(0.0, FLIPS);
}

#[test]
fn image_comes_home_with_a_fifth_lost() {
    brings_the_image_home(0.2, 0.0);
}

#[test]
fn image_comes_home_with_a_fifth_lost_and_flips() {
    brings_the_image_home(0.2, FLIPS);
}

#[test]
fn image_comes_home_with_half_lost() {
    brings_the_image_home(0.5, 0.0);
}

#[test]
fn image_comes_home_with_half_lost_and_flips() {
    brings_the_image_home(0.5, FLIPS);
}

#[test]
fn image_comes_home_by_ranges() {
    for seed in 1..=5 {
        let config = WorldConfig { ranges: true, ..WorldConfig::seeded(seed).lossy(0.3, 0.0) };
        let report = held(World::new(config).run_until_image(20_000));
        assert_eq!(report.chunks_bridged, 0, "ranges need no bridge");
    }
}

#[test]
fn image_comes_home_from_a_satellite_without_tags() {
    for seed in 1..=5 {
        let config = WorldConfig { tags: false, ..WorldConfig::seeded(seed).lossy(0.2, 0.0) };
        held(World::new(config).run_until_image(20_000));
    }
}

#[test]
fn image_comes_home_over_several_passes() {
    for seed in 1..=3 {
        let config =
            WorldConfig { image_bytes: 150_000, ..WorldConfig::seeded(seed).lossy(0.2, FLIPS).with_passes() };
        let report = held(World::new(config).run_until_image(100_000));
        assert!(report.passes >= 1);
    }
}

#[test]
fn same_seed_gives_the_same_log() {
    let hash = |seed| {
        let config = WorldConfig {
            operator: Operator::Busy,
            ..WorldConfig::seeded(seed).lossy(0.2, FLIPS).with_passes()
        };
        held(World::new(config).run_passes(2)).log_hash
    };
    assert_eq!(hash(5), hash(5));
    assert_ne!(hash(5), hash(6));
}
