//! Questions to ask.

use mission::schedule::{
    Antenna, Blackout, Candidate, Health, Partial, PassKey, Policy, Problem, Scope, Site, Window,
};
use mission::{AntennaId, SatelliteId, StationId, UtcUs};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

pub(crate) type Chance = ChaCha8Rng;

pub(crate) fn chance(seed: u64) -> Chance {
    ChaCha8Rng::seed_from_u64(seed)
}

pub(crate) fn satellite(name: &str) -> SatelliteId {
    SatelliteId::new(name).expect("a name")
}

pub(crate) fn station(name: &str) -> StationId {
    StationId::new(name).expect("a name")
}

pub(crate) fn antenna(name: &str) -> AntennaId {
    AntennaId::new(name).expect("a name")
}

/// 2026-11-22T00:00:00Z.
pub(crate) const DAY_S: i64 = 1_795_305_600;

pub(crate) fn at(seconds: i64) -> UtcUs {
    UtcUs((DAY_S + seconds) * 1_000_000)
}

pub(crate) fn window(start_s: i64, stop_s: i64) -> Window {
    Window { start: at(start_s), stop: at(stop_s) }
}

/// A pass that may be cut down to its minimum of 120 s, on any antenna of the station.
pub(crate) fn pass(who: &str, place: &str, aos_s: i64, los_s: i64, value: u32) -> Candidate {
    Candidate {
        key: PassKey {
            satellite: satellite(who),
            station: station(place),
            minute: (aos_s + los_s).div_euclid(120),
        },
        satellite: satellite(who),
        station: station(place),
        antennas: Vec::new(),
        aos: at(aos_s),
        los: at(los_s),
        max_elevation_deg: 45.0,
        value,
        min_duration_s: 120,
        partial: Partial::Proportional,
        transmit: false,
        plan: None,
    }
}

pub(crate) fn mast(name: &str, place: &str, switch_over_s: u32) -> Antenna {
    Antenna { id: antenna(name), station: station(place), switch_over_s }
}

/// One station, a minute in which everything is tight: one to three antennas, up to eight passes of up to five
/// satellites, whole and partial, blackouts of all kinds, a licence.
pub(crate) fn tight(seed: u64) -> Problem {
    let mut rng = chance(seed);
    let mut problem = Problem {
        policy: Policy { drift_s: rng.random_range(0..2), ..Policy::default() },
        ..Problem::default()
    };
    let masts = rng.random_range(1..=3usize);
    for a in 0..masts {
        problem.antennas.push(mast(&format!("mast-{a}"), "home", rng.random_range(0..5)));
    }
    for n in 0..rng.random_range(2..=8) {
        let (aos_s, length_s) = (rng.random_range(0..35), rng.random_range(2..16));
        let who = format!("sat-{}", rng.random_range(0..5));
        let mut candidate = pass(&who, "home", aos_s, aos_s + length_s, rng.random_range(1..60));
        candidate.key.minute = n;
        candidate.min_duration_s = rng.random_range(1..8);
        if rng.random_bool(0.4) {
            candidate.partial = Partial::Worthless;
        }
        if masts > 1 && rng.random_bool(0.3) {
            candidate.antennas.push(antenna(&format!("mast-{}", rng.random_range(0..masts))));
        }
        candidate.transmit = rng.random_bool(0.5);
        problem.candidates.push(candidate);
    }
    for n in 0..rng.random_range(0..3) {
        let from_s = rng.random_range(0..45);
        let scope = match rng.random_range(0..3) {
            0 => Scope::Station(station("home")),
            1 => Scope::Antenna(antenna("mast-0")),
            _ => Scope::Satellite(satellite("sat-1")),
        };
        problem.blackouts.push(Blackout {
            scope,
            window: window(from_s, from_s + rng.random_range(1..6)),
            reason: format!("work {n}"),
        });
    }
    if rng.random_bool(0.3) {
        let licence = Some(vec![window(rng.random_range(0..15), rng.random_range(20..50))]);
        problem.sites.push(Site { station: station("home"), health: Health::Fit, licence });
    }
    problem
}

/// The same at two stations with an antenna or two: passages that both could take.
pub(crate) fn tight_pair(seed: u64) -> Problem {
    let mut problem = tight(seed);
    let mut rng = chance(seed ^ 0xfeed);
    problem.antennas.truncate(2);
    problem.antennas.push(mast("dish", "hill", rng.random_range(0..5)));
    for candidate in &mut problem.candidates {
        candidate.antennas.clear();
        if rng.random_bool(0.5) {
            candidate.station = station("hill");
            candidate.key.station = station("hill");
        }
    }
    problem
}

/// Days as they are: satellites with a period of some 95 min, seen by neighbouring stations at nearly the same time.
pub(crate) fn days(seed: u64, satellites: usize, stations: usize, masts: usize, days: i64) -> Problem {
    let mut rng = chance(seed);
    let mut problem = Problem::default();
    for s in 0..stations {
        for m in 0..masts {
            let switch_over_s = rng.random_range(30..120);
            problem.antennas.push(mast(&format!("place-{s}-mast-{m}"), &format!("place-{s}"), switch_over_s));
        }
    }
    for n in 0..satellites {
        let period_s = rng.random_range(5_500..5_900);
        let (priority, partial) = (rng.random_range(1..=5), rng.random_bool(0.7));
        let min_duration_s = rng.random_range(90..240);
        let mut middle_s = rng.random_range(0..period_s);
        while middle_s < days * 86_400 {
            if rng.random_bool(0.38) {
                for s in 0..stations {
                    if rng.random_bool(0.15) {
                        continue;
                    }
                    let half_us = rng.random_range(110_000_000..350_000_000);
                    let there_us =
                        middle_s * 1_000_000 + (s as i64) * 70_000_000 + rng.random_range(0..30_000_000);
                    let mut candidate = pass(&format!("sat-{n}"), &format!("place-{s}"), 0, 0, 1);
                    candidate.aos = UtcUs(at(0).0 + there_us - half_us);
                    candidate.los = UtcUs(at(0).0 + there_us + half_us);
                    candidate.key.minute = there_us / 60_000_000;
                    candidate.max_elevation_deg = (half_us / 4_000_000) as f64;
                    candidate.value = mission::schedule::points(
                        priority,
                        u32::try_from(half_us / 500_000).expect("small"),
                        candidate.max_elevation_deg,
                    );
                    candidate.min_duration_s = min_duration_s;
                    candidate.partial = if partial { Partial::Proportional } else { Partial::Worthless };
                    candidate.transmit = true;
                    problem.candidates.push(candidate);
                }
            }
            middle_s += period_s;
        }
    }
    for n in 0..days {
        let from_s = n * 86_400 + rng.random_range(0..80_000);
        problem.blackouts.push(Blackout {
            scope: Scope::Station(station(&format!("place-{}", rng.random_range(0..stations)))),
            window: window(from_s, from_s + rng.random_range(600..5_000)),
            reason: "people on the roof".to_owned(),
        });
    }
    problem
}

/// The same passes by other elements: every AOS and LOS moved by less than `most_us`.
pub(crate) fn moved(problem: &Problem, rng: &mut Chance, most_us: i64) -> Problem {
    let mut problem = problem.clone();
    for candidate in &mut problem.candidates {
        candidate.aos = candidate.aos.plus(rng.random_range(1 - most_us..most_us));
        candidate.los = candidate.los.plus(rng.random_range(1 - most_us..most_us));
    }
    problem
}
