//! Real geometry: days under an orbit, with everything joined.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use rehearsal::{Chaos, Invariant, Operator, Report, Violation, World, WorldConfig};
use satellite::{Orbit, PassProfile, Sky};
use tle::{Station, UtcInstant};

/// 2027-06-01T04:05:06.789Z.
const ZERO_MS: u64 = 1_811_822_706_789;
const ZERO: UtcInstant = UtcInstant::from_unix_us(ZERO_MS.cast_signed() * 1000);
const DAY_S: f64 = 86_400.0;
/// From the satellite's antenna to a committed frame: the end of the frame, light, UART and driver.
const ARRIVAL_US: u64 = 3_000_000;

fn lausanne() -> Station {
    Station::new(46.5191, 6.5668, 410.0).unwrap()
}

fn config(seed: u64) -> WorldConfig {
    WorldConfig {
        operator: Operator::Busy,
        view_is_known: true,
        image_bytes: 30_000,
        chaos: Chaos { kill_every_s: Some(400.0), ..Chaos::default() },
        ..WorldConfig::seeded(seed).with_orbit(Orbit::fictional(seed, ZERO), lausanne(), ZERO_MS)
    }
}

/// Runs for some days; at each frame that comes home the satellite is, or just was, above the horizon.
fn fly(config: WorldConfig, days: f64) -> Result<Report, Violation> {
    let orbit = config.orbit.clone().unwrap();
    let mut sky = Sky::new(&PassProfile::seen_from(lausanne()), &orbit, ZERO);
    let seed = config.seed;
    let mut world = World::new(config);
    let mut heard = 0;
    while world.now_s() < days * DAY_S {
        world.step()?;
        let frames = world.report().frames_heard;
        if frames > heard {
            heard = frames;
            let now_us = (world.now_s() * 1e6) as u64;
            if !sky.in_view(now_us) && !sky.in_view(now_us.saturating_sub(ARRIVAL_US)) {
                let detail = "a frame was heard from below the horizon".to_owned();
                return Err(Violation { invariant: Invariant::Bounded, seed, at_us: now_us, detail });
            }
        }
    }
    Ok(world.report())
}

#[track_caller]
fn held(run: Result<Report, Violation>) -> Report {
    match run {
        Ok(report) => report,
        Err(violation) => unreachable!("{violation}"),
    }
}

#[test]
fn days_of_true_passes_are_heard_only_above_the_horizon_and_best_high_up() {
    let mut bands = [(0, 0); 9];
    let (mut passes, mut kills, mut answered) = (0, 0, 0);
    for seed in 1..=4 {
        let report = held(fly(config(seed), 1.0));
        assert!((4..=8).contains(&report.passes), "seed {seed}: {} passes", report.passes);
        assert!(report.frames_heard > 100, "seed {seed}: {}", report.frames_heard);
        passes += report.passes;
        kills += report.kills;
        answered += report.commands.get("answered").copied().unwrap_or(0);
        for (sum, band) in bands.iter_mut().zip(report.by_elevation) {
            *sum = (sum.0 + band.sent, sum.1 + band.lost);
        }
    }
    let share = |from: usize, to: usize| {
        let (sent, lost) = bands[from..to].iter().fold((0, 0), |sum, band| (sum.0 + band.0, sum.1 + band.1));
        assert!(sent > 50, "{bands:?}");
        lost as f64 / sent as f64
    };
    let (low, middle, high) = (share(0, 1), share(1, 3), share(3, 9));
    println!(
        "{passes} passes, {kills} kills, lost {low:.3} below 10 degrees, {middle:.3} below 30, {high:.3} above"
    );
    assert!(low > 0.08 && low > 10.0 * middle && middle >= high && high < 0.01, "{bands:?}");
    assert!(kills > 0 && answered > 50, "{kills} kills, {answered} commands answered");
}

#[test]
fn same_seed_and_orbit_give_the_same_log() {
    let hash = |config: WorldConfig| held(World::new(config).run_passes(4)).log_hash;
    assert_eq!(hash(config(5)), hash(config(5)));
    let other = WorldConfig { orbit: Some(Orbit::fictional(77, ZERO)), ..config(5) };
    assert_ne!(hash(config(5)), hash(other));
}

#[test]
fn the_image_comes_home_over_true_passes() {
    let lossy = WorldConfig::seeded(3).lossy(0.2, 1e-4);
    let orbit = Orbit::passing_over(&lausanne(), ZERO.plus_seconds(600.0));
    let config = WorldConfig {
        image_bytes: 150_000,
        view_is_known: true,
        ..lossy.with_orbit(orbit, lausanne(), ZERO_MS)
    };
    let report = held(World::new(config).run_until_image(400_000));
    assert!(report.passes >= 2, "{}", report.passes);
}
