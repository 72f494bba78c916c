//! Passes against our own sampling every second: none missed, none added, every AOS and LOS within 10 us.

#![expect(clippy::unwrap_used, reason = "a test's helpers fail by panicking")]

use tle::passes::{EndCause, PassFinder, PassSearch};
use tle::{EarthOrientation, LookAngles, Propagator, Station, UtcInstant, ecef_from_teme, gmst_rad};

mod common;

use common::{EPOCH as T0, Kind, elements, stations};

fn look(propagator: &Propagator, station: &Station, at: UtcInstant) -> Option<LookAngles> {
    let state = propagator.at(at).ok()?;
    Some(station.look(&ecef_from_teme(&state, gmst_rad(at, EarthOrientation::UT1_IS_UTC))))
}

/// The crossing between two instants, us since the first, by halving the true elevation.
fn crossing_us(
    propagator: &Propagator,
    station: &Station,
    from: UtcInstant,
    step_us: i64,
    threshold: f64,
) -> i64 {
    let above = |us: i64| look(propagator, station, from.plus_us(us)).unwrap().elevation_deg > threshold;
    let (mut low, mut high) = (0, step_us);
    let rising = above(high);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if above(middle) == rising { high = middle } else { low = middle }
    }
    high
}

#[derive(Default, Debug)]
struct Tally {
    passes: u64,
    calls: u64,
    worst_us: i64,
    worst_summit_deg: f64,
    too_short_to_sample: u64,
}

fn compare(kind: Kind, objects: u32, hours: i64, threshold: f64, tally: &mut Tally) {
    let stations = stations();
    let search = PassSearch::new(T0.plus_seconds(-3600.0), T0.plus_us(hours * 3_600_000_000), threshold);
    for k in 0..objects {
        let elements = elements(kind, k);
        let finder = PassFinder::new(&elements).unwrap();
        let found = finder.find(&stations, &search).unwrap();
        assert!(found.gaps.is_empty(), "{elements:?} {:?}", found.gaps);
        tally.calls += found.sgp4_calls;
        let seconds = search.stop.us_since(search.start) / 1_000_000;
        let samples: Vec<_> = (0..=seconds)
            .map(|s| {
                let at = search.start.plus_us(s * 1_000_000);
                let state = finder.propagator().at(at).unwrap();
                ecef_from_teme(&state, gmst_rad(at, search.orientation))
            })
            .collect();
        for (station, passes) in stations.iter().zip(&found.stations) {
            let elevations: Vec<f64> =
                samples.iter().map(|state| station.look(state).elevation_deg).collect();
            let mut sampled = Vec::new();
            let mut open = (elevations[0] > threshold).then_some((search.start, elevations[0]));
            for s in 1..elevations.len() {
                let (before, now) = (elevations[s - 1] > threshold, elevations[s] > threshold);
                if before != now {
                    let from = search.start.plus_us((s as i64 - 1) * 1_000_000);
                    let at =
                        from.plus_us(crossing_us(finder.propagator(), station, from, 1_000_000, threshold));
                    if now {
                        open = Some((at, threshold));
                    } else {
                        let (aos, best) = open.take().unwrap();
                        sampled.push((aos, at, best));
                    }
                }
                if let Some((_, best)) = &mut open {
                    *best = best.max(elevations[s]);
                }
            }
            if let Some((aos, best)) = open {
                sampled.push((aos, search.stop, best));
            }
            // Passes that fit between two samples exist; they are passes all the same.
            let visible: Vec<_> = passes
                .iter()
                .filter(|pass| {
                    let aos = pass.aos.at.us_since(search.start).div_euclid(1_000_000);
                    let los = pass.los.at.us_since(search.start).div_euclid(1_000_000);
                    let short = aos == los && !pass.is_clipped();
                    if short {
                        tally.too_short_to_sample += 1;
                        assert!(pass.tca.look.elevation_deg > threshold);
                    }
                    !short
                })
                .collect();
            let told: Vec<_> = visible
                .iter()
                .map(|p| (p.aos.at.to_string(), p.los.at.to_string(), p.tca.look.elevation_deg))
                .collect();
            let expected: Vec<_> = sampled.iter().map(|p| (p.0.to_string(), p.1.to_string(), p.2)).collect();
            assert_eq!(
                told.len(),
                expected.len(),
                "{elements:?}\n{station:?}\nfound {told:#?}\nsampled {expected:#?}"
            );
            for (pass, (aos, los, best)) in visible.iter().zip(&sampled) {
                tally.passes += 1;
                let off = pass.aos.at.us_since(*aos).abs().max(pass.los.at.us_since(*los).abs());
                assert!(off <= 10, "{off} us: {elements:?} {station:?} {pass:?} {aos} {los}");
                tally.worst_us = tally.worst_us.max(off);
                let more = pass.tca.look.elevation_deg - best;
                assert!(more > -1e-6, "{elements:?} {pass:?} {best}");
                tally.worst_summit_deg = tally.worst_summit_deg.max(-more);
                assert!(pass.aos.at <= pass.tca.at && pass.tca.at <= pass.los.at, "{pass:?}");
                for end in [&pass.aos, &pass.los] {
                    let true_look = look(finder.propagator(), station, end.at).unwrap();
                    assert!(
                        (true_look.elevation_deg - end.look.elevation_deg).abs() < 1e-6,
                        "{end:?} {true_look:?}"
                    );
                    assert!((true_look.range_km - end.look.range_km).abs() < 2e-4, "{end:?} {true_look:?}");
                    if end.cause == EndCause::Horizon {
                        assert!((end.look.elevation_deg - threshold).abs() < 1e-6, "{end:?}");
                    }
                }
            }
        }
    }
}

fn report(name: &str, tally: &Tally) {
    println!("{name}: {tally:?}, {:.2} calls a pass", tally.calls as f64 / tally.passes as f64);
    assert!(tally.worst_us <= 10, "{name}: {tally:?}");
}

#[test]
fn low_orbits_agree_with_sampling() {
    let mut tally = Tally::default();
    for (threshold, objects) in [(0.0, 14), (10.0, 14), (-3.0, 6), (70.0, 10)] {
        compare(Kind::Low, objects, 47, threshold, &mut tally);
    }
    report("low", &tally);
}

#[test]
fn eccentric_orbits_agree_with_sampling() {
    let mut tally = Tally::default();
    for (threshold, objects) in [(0.0, 14), (10.0, 14), (40.0, 6)] {
        compare(Kind::Eccentric, objects, 47, threshold, &mut tally);
    }
    report("eccentric", &tally);
}

#[test]
fn deep_space_agrees_with_sampling() {
    let mut tally = Tally::default();
    for (threshold, objects) in [(0.0, 10), (10.0, 10), (-2.0, 5)] {
        compare(Kind::Deep, objects, 47, threshold, &mut tally);
    }
    report("deep", &tally);
}
