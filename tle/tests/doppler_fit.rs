//! How late a satellite is, from made-up receptions of which the truth is known: noise, wrong clocks and oscillators,
//! outliers, unknown signs. And against a search by brute force.

#![expect(clippy::unwrap_used, reason = "what is made up here is valid")]

mod common;

use common::{EPOCH, Kind, elements};
use tle::doppler_fit::{
    DopplerFit, FitError, FitSettings, LimitedBy, Observation, Receiver, Sign, fit, late_elements,
};
use tle::passes::{PassFinder, PassSearch};
use tle::{EarthOrientation, Propagator, Station, UtcInstant, doppler, ecef_from_teme, gmst_rad};

/// SplitMix64, and a bell curve of it.
struct Dice(u64);

impl Dice {
    fn part(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.part()
    }

    fn bell(&mut self, sigma: f64) -> f64 {
        let size = (-2.0 * self.part().max(1e-12).ln()).sqrt();
        sigma * size * (std::f64::consts::TAU * self.part()).cos()
    }
}

const NOMINAL_HZ: f64 = 435e6;
const EUROPE: [(f64, f64); 8] = [
    (46.5, 6.6),
    (48.1, 11.6),
    (52.5, 13.4),
    (40.4, -3.7),
    (51.5, -0.1),
    (41.9, 12.5),
    (59.3, 18.1),
    (50.1, 14.4),
];

/// What is wrong with the world.
#[derive(Clone, Copy)]
struct World {
    orbit: u32,
    stations: usize,
    /// Of each station's passes.
    passes: usize,
    every_s: f64,
    noise_hz: f64,
    clock_s: f64,
    outliers: f64,
    signs_known: bool,
}

const USUAL: World = World {
    orbit: 0,
    stations: 4,
    passes: 1,
    every_s: 60.0,
    noise_hz: 150.0,
    clock_s: 0.5,
    outliers: 0.1,
    signs_known: false,
};

struct Case {
    propagator: Propagator,
    receivers: Vec<Receiver>,
    observations: Vec<Observation>,
    late_s: f64,
}

fn case(world: World, late_s: f64, seed: u64) -> Case {
    let mut dice = Dice(seed);
    let believed = elements(Kind::Cubesat, world.orbit);
    let propagator = Propagator::new(&believed).unwrap();
    let satellite_hz = dice.bell(1500.0);
    let mut receivers = Vec::new();
    let mut observations = Vec::new();
    let start = EPOCH.plus_seconds(dice.between(0.0, 43_200.0));
    for (index, &(latitude, longitude)) in EUROPE.iter().take(world.stations).enumerate() {
        let station = Station::new(latitude, longitude, 100.0).unwrap();
        let sign = if dice.part() < 0.5 { Sign::Above } else { Sign::Below };
        let (offset_hz, fast_s) = (dice.bell(800.0), dice.bell(world.clock_s));
        let search = PassSearch::new(start, start.plus_seconds(86_400.0), 5.0);
        let found =
            PassFinder::new(&believed).unwrap().find(std::slice::from_ref(&station), &search).unwrap();
        for pass in found.stations[0].iter().filter(|pass| !pass.is_clipped()).take(world.passes) {
            let mut at = pass.aos.at.plus_seconds(dice.between(0.0, world.every_s));
            while at < pass.los.at {
                // The satellite comes late: where the elements say it was, the Earth has turned on meanwhile.
                let true_at = at.plus_seconds(late_s);
                let object = ecef_from_teme(
                    &propagator.at(at).unwrap(),
                    gmst_rad(true_at, EarthOrientation::UT1_IS_UTC),
                );
                let shift_hz = doppler::downlink_shift_hz(NOMINAL_HZ, station.look(&object).range_rate_km_s);
                let heard_hz = if dice.part() < world.outliers {
                    dice.between(-15_000.0, 15_000.0)
                } else {
                    shift_hz + satellite_hz + offset_hz + dice.bell(world.noise_hz)
                };
                observations.push(Observation {
                    at: true_at.plus_seconds(fast_s),
                    receiver: index,
                    nominal_hz: NOMINAL_HZ,
                    applied_hz: 0.0,
                    error_hz: if sign == Sign::Above { heard_hz } else { -heard_hz },
                });
                at = at.plus_seconds(world.every_s);
            }
        }
        receivers.push(Receiver {
            sign: world.signs_known.then_some(sign),
            clock_error_s: world.clock_s,
            ..Receiver::unknown(station)
        });
    }
    Case { propagator, receivers, observations, late_s }
}

fn solve(case: &Case) -> Result<DopplerFit, FitError> {
    fit(&case.propagator, &case.receivers, &case.observations, &FitSettings::default())
}

/// Seeds, answers, answers within three sigma, mean sigma.
fn tally(world: World, seeds: std::ops::Range<u64>) -> (usize, usize, usize, f64) {
    let (mut tried, mut answered, mut right, mut sigmas) = (0, 0, 0, 0.0);
    for seed in seeds {
        let late_s = Dice(seed ^ 0xABCD).between(-60.0, 60.0);
        let case = case(World { orbit: world.orbit + (seed % 16) as u32, ..world }, late_s, seed);
        if case.observations.len() < 4 {
            continue;
        }
        tried += 1;
        if let Ok(found) = solve(&case) {
            answered += 1;
            sigmas += found.sigma_s;
            let is_right = (found.late_s - late_s).abs() <= 3.0 * found.sigma_s;
            right += usize::from(is_right);
            if !is_right {
                println!("seed {seed}: {late_s:.2} s late, found {found:?}");
            }
        }
    }
    (tried, answered, right, sigmas / answered.max(1) as f64)
}

#[test]
fn the_truth_lies_within_three_sigma_in_at_least_95_of_100() {
    let worlds = [
        ("four stations, a frame a minute, 150 Hz", USUAL, 0.9),
        ("four stations, 50 Hz", World { noise_hz: 50.0, ..USUAL }, 0.9),
        ("eight stations, 500 Hz", World { noise_hz: 500.0, stations: 8, ..USUAL }, 0.8),
        ("one station, image chunks every 3 s", World { stations: 1, every_s: 3.0, ..USUAL }, 0.8),
        ("one station, a frame a minute", World { stations: 1, ..USUAL }, 0.3),
        (
            "two stations, three passes, wrong clocks",
            World { stations: 2, passes: 3, clock_s: 2.0, ..USUAL },
            0.9,
        ),
        ("signs known, no outliers", World { signs_known: true, outliers: 0.0, ..USUAL }, 0.95),
    ];
    for (name, world, answers) in worlds {
        let (tried, answered, right, sigma_s) = tally(world, 0..120);
        println!("{name}: {answered} of {tried} answered, {right} within 3 sigma, mean sigma {sigma_s:.2} s");
        assert!(tried >= 60, "{name}: {tried}");
        assert!(answered as f64 >= answers * tried as f64, "{name}: {answered} of {tried}");
        assert!(right as f64 >= 0.95 * answered as f64, "{name}: {right} of {answered}");
    }
}

#[test]
fn brute_force_over_the_same_sum_of_squares_finds_the_same_minimum() {
    for seed in 0..12 {
        let world =
            World { noise_hz: 60.0, clock_s: 0.0, outliers: 0.0, signs_known: true, stations: 3, ..USUAL };
        let case = case(World { orbit: seed as u32, ..world }, -17.3, seed);
        if case.observations.len() < 12 {
            continue;
        }
        let found = solve(&case).unwrap();
        // One constant for each receiver, freely chosen: the mean of what is left over.
        let squares = |late_s: f64| {
            let mut sum = 0.0;
            for (index, receiver) in case.receivers.iter().enumerate() {
                let off: Vec<f64> = case
                    .observations
                    .iter()
                    .filter(|seen| seen.receiver == index)
                    .map(|seen| {
                        let state = case.propagator.at(seen.at.plus_seconds(-late_s)).unwrap();
                        let object = ecef_from_teme(&state, gmst_rad(seen.at, EarthOrientation::UT1_IS_UTC));
                        let heard =
                            if receiver.sign == Some(Sign::Below) { -seen.error_hz } else { seen.error_hz };
                        heard
                            - doppler::downlink_shift_hz(
                                NOMINAL_HZ,
                                receiver.station.look(&object).range_rate_km_s,
                            )
                    })
                    .collect();
                let mean = off.iter().sum::<f64>() / off.len().max(1) as f64;
                sum += off.iter().map(|hz| (hz - mean).powi(2)).sum::<f64>();
            }
            sum
        };
        let best_s = (-6000..=6000)
            .map(|step| f64::from(step) * 0.02)
            .min_by(|a, b| squares(*a).total_cmp(&squares(*b)))
            .unwrap();
        println!("seed {seed}: brute force {best_s:.2}, fit {:.2} +- {:.2}", found.late_s, found.sigma_s);
        assert!(
            (found.late_s - best_s).abs() < 0.02 + 0.6 * found.sigma_s,
            "seed {seed}: {best_s} {found:?}"
        );
        assert!((found.late_s + 17.3).abs() < 4.0 * found.sigma_s, "seed {seed}: {found:?}");
    }
}

#[test]
fn signs_and_the_satellites_lateness_come_out_together() {
    let case = case(World { outliers: 0.0, ..USUAL }, 33.0, 5);
    let found = solve(&case).unwrap();
    assert!((found.late_s - 33.0).abs() < 3.0 * found.sigma_s, "{found:?}");
    assert!(found.receivers_used() >= 3, "{found:?}");
    let known = World { outliers: 0.0, signs_known: true, ..USUAL };
    let told = self::case(known, 33.0, 5).receivers;
    for (one, told) in found.receivers.iter().zip(&told) {
        assert!(one.sign.is_none() || one.sign == told.sign, "{one:?} {told:?}");
    }
}

#[test]
fn lone_clock_cannot_be_told_from_a_late_satellite_and_many_can() {
    let dense = World { every_s: 3.0, clock_s: 3.0, noise_hz: 50.0, outliers: 0.0, ..USUAL };
    let one = solve(&case(World { stations: 1, ..dense }, 10.0, 3)).unwrap();
    assert_eq!(one.limited_by, LimitedBy::Clocks, "{one:?}");
    assert!(one.sigma_s > 2.5, "{one:?}");
    let eight = solve(&case(World { stations: 8, ..dense }, 10.0, 3)).unwrap();
    assert!(eight.sigma_s < 0.6 * one.sigma_s, "{eight:?}");
    assert_eq!(case(World { stations: 1, ..dense }, 10.0, 3).late_s, 10.0);
}

#[test]
fn what_is_not_determined_is_refused_and_says_what_would_help() {
    let case = case(World { outliers: 0.0, ..USUAL }, 5.0, 2);
    let with = |observations: &[Observation], settings: &FitSettings| {
        fit(&case.propagator, &case.receivers, observations, settings)
    };
    let usual = FitSettings::default();
    assert!(matches!(with(&case.observations[..3], &usual), Err(FitError::TooFew { found: 3, .. })));
    // Four frames within three seconds: a line has no bend.
    let first = case.observations[0];
    let burst: Vec<Observation> =
        (0..4).map(|k| Observation { at: first.at.plus_seconds(f64::from(k)), ..first }).collect();
    let refusal = with(&burst, &usual).unwrap_err();
    println!("{refusal}");
    assert!(
        matches!(
            refusal,
            FitError::Undetermined { .. }
                | FitError::TooFew { .. }
                | FitError::Ambiguous { .. }
                | FitError::AtEdge { .. }
        ),
        "{refusal}"
    );
    let far = self::case(World { outliers: 0.0, ..USUAL }, 80.0, 2);
    let narrow = FitSettings { search_s: 20.0, ..usual };
    let refused = fit(&far.propagator, &far.receivers, &far.observations, &narrow);
    assert!(refused.is_err(), "{refused:?}");
    let mut broken = case.observations.clone();
    broken[1].error_hz = f64::NAN;
    assert!(matches!(with(&broken, &usual), Err(FitError::NoNumber { index: 1, field: "error_hz", .. })));
    broken[1] = Observation { receiver: 99, ..first };
    assert!(matches!(with(&broken, &usual), Err(FitError::NoReceiver { index: 1, receiver: 99, .. })));
    let settings = FitSettings { search_s: f64::NAN, ..usual };
    assert!(matches!(with(&case.observations, &settings), Err(FitError::Setting { .. })));
}

#[test]
fn sign_of_a_board_that_corrects_doppler_itself_is_not_guessed() {
    // What is left after the correction is small, and it fits a satellite that is late as well as, with the other sign, one
    // that is early.
    let mut case = case(World { stations: 1, every_s: 10.0, outliers: 0.0, ..USUAL }, 6.0, 11);
    let mut dice = Dice(77);
    for seen in &mut case.observations {
        let object = ecef_from_teme(
            &case.propagator.at(seen.at).unwrap(),
            gmst_rad(seen.at, EarthOrientation::UT1_IS_UTC),
        );
        let rate = case.receivers[0].station.look(&object).range_rate_km_s;
        let applied_hz = doppler::downlink_shift_hz(NOMINAL_HZ, rate);
        let truth = object_shift(&case.propagator, &case.receivers[0].station, seen.at, 6.0);
        (seen.applied_hz, seen.error_hz) = (applied_hz, truth - applied_hz + dice.bell(200.0));
    }
    let refused = solve(&case);
    assert!(
        matches!(
            refused,
            Err(FitError::Ambiguous { .. } | FitError::TooFew { .. } | FitError::Undetermined { .. })
        ),
        "{refused:?}"
    );
    case.receivers[0].sign = Some(Sign::Above);
    let found = solve(&case).unwrap();
    assert!((found.late_s - 6.0).abs() < 3.0 * found.sigma_s, "{found:?}");
    case.receivers[0].sign = Some(Sign::Below);
    let mirrored = solve(&case).unwrap();
    assert!((mirrored.late_s + 6.0).abs() < 4.0 * mirrored.sigma_s, "{mirrored:?}");
}

fn object_shift(propagator: &Propagator, station: &Station, at: UtcInstant, late_s: f64) -> f64 {
    let state = propagator.at(at.plus_seconds(-late_s)).unwrap();
    let object = ecef_from_teme(&state, gmst_rad(at, EarthOrientation::UT1_IS_UTC));
    doppler::downlink_shift_hz(NOMINAL_HZ, station.look(&object).range_rate_km_s)
}

#[test]
fn elements_corrected_by_the_answer_stand_where_the_satellite_is() {
    let believed = elements(Kind::Cubesat, 3);
    let corrected = Propagator::new(&late_elements(&believed, 20.0)).unwrap();
    let propagator = Propagator::new(&believed).unwrap();
    for hours in [0.0, 5.0, 30.0] {
        let at = EPOCH.plus_seconds(hours * 3600.0);
        let truth = propagator.at(at.plus_seconds(-20.0)).unwrap();
        let told = corrected.at(at).unwrap();
        let off_km = tle::vector::norm(tle::vector::sub(truth.r_teme_km, told.r_teme_km));
        // 150 km uncorrected.
        assert!(off_km < 3.0, "{off_km} km after {hours} h");
    }
}
