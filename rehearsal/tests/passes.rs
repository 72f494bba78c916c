//! Thousands of passes with everything going wrong at once: kills, full disks, a port that is pulled, a witness that
//! cannot be written, losses, bursts and flips. Every invariant is held at every step; a failure prints its seed.

use std::thread;

use rehearsal::{Chaos, Operator, Report, World, WorldConfig};
use satellite::Burst;

/// Passes of one world; a new seed after that.
const PASSES_OF_A_WORLD: u64 = 50;

fn world(seed: u64) -> WorldConfig {
    let mut config = WorldConfig::seeded(seed).with_passes();
    // Each seed has its own weather.
    config.channel.loss = [0.0, 0.1, 0.3, 0.5][(seed % 4) as usize];
    config.channel.flips = [0.0, 1e-5, 1e-4, 1e-3][(seed / 4 % 4) as usize];
    config.channel.cut = if seed.is_multiple_of(3) { 0.02 } else { 0.0 };
    config.channel.noise = if seed.is_multiple_of(5) { 0.1 } else { 0.0 };
    config.channel.burst = seed.is_multiple_of(2).then_some(Burst { enter: 0.02, leave: 0.2, loss: 0.9 });
    config.view_is_known = !seed.is_multiple_of(3);
    config.ranges = seed.is_multiple_of(7);
    config.operator = Operator::Busy;
    config.image_bytes = 4_000 + (seed % 11) as u32 * 3_000;
    config.chaos = Chaos {
        kill_every_s: (seed % 3 != 1).then_some(200.0),
        persist_fails: if seed.is_multiple_of(4) { 0.01 } else { 0.0 },
        witness_fails: if seed.is_multiple_of(6) { 0.05 } else { 0.0 },
        unplug_every_s: (seed % 5 == 2).then_some(150.0),
    };
    config
}

fn fly(seeds: impl Iterator<Item = u64>) -> Vec<Report> {
    seeds
        .map(|seed| match World::new(world(seed)).run_passes(PASSES_OF_A_WORLD) {
            Ok(report) => report,
            Err(violation) => unreachable!("{violation}"),
        })
        .collect()
}

#[test]
fn ten_thousand_passes_hold_every_invariant() {
    let passes: u64 = std::env::var("REHEARSAL_PASSES").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000);
    let worlds = passes.div_ceil(PASSES_OF_A_WORLD);
    let reports: Vec<Report> = thread::scope(|scope| {
        let halves =
            [0, 1].map(|half| scope.spawn(move || fly((1..=worlds).filter(move |seed| seed % 2 == half))));
        halves.into_iter().flat_map(|half| half.join().unwrap()).collect()
    });
    let sum = |of: fn(&Report) -> u64| reports.iter().map(of).sum::<u64>();
    let total = (sum(|r| r.passes), sum(|r| r.images_complete), sum(|r| r.uplinks), sum(|r| r.kills));
    println!(
        "{} passes, {} images, {} uplinks, {} kills, {} frames",
        total.0,
        total.1,
        total.2,
        total.3,
        sum(|r| r.frames_heard)
    );
    println!("{} collisions on the air", sum(|r| r.collisions));
    assert!(total.0 >= passes);
    // Listening first works: what is left are errors the satellite sends of its own accord, and other surprises.
    assert!(sum(|r| r.collisions) * 50 < total.2, "collisions: {}", sum(|r| r.collisions));
    // A test in which nothing happens could not fail.
    assert!(total.1 > passes / 10, "images: {}", total.1);
    assert!(total.2 > passes * 3, "uplinks: {}", total.2);
    assert!(total.3 > passes / 20, "kills: {}", total.3);
}
