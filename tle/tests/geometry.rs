//! Look angles, places below, the Sun and the shadow, against Skyfield and ERFA.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use tle::formats::{self, Checksums};
use tle::shadow::{ShadowEdge, shadow_crossings};
use tle::sun::sun_teme_km;
use tle::vector::{angle_rad, norm};
use tle::{EarthOrientation, Propagator, Station, UtcInstant, ecef_from_teme, gmst_rad};

const LOOK: &str = include_str!("../vectors/look.txt");
const SUN: &str = include_str!("../vectors/sun.txt");

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|word| word.parse().unwrap()).collect()
}

fn propagator_of(record: &str) -> Option<Propagator> {
    let line = |key: &str| record.lines().find_map(|line| line.strip_prefix(key));
    let text = format!("{}\n{}", line("line1: ")?, line("line2: ")?);
    let found = formats::sets(&text, Checksums::Strict).unwrap().next().unwrap().unwrap();
    Some(Propagator::new(&found.elements).unwrap())
}

/// The way from one angle to another, degrees.
fn turn(a: f64, b: f64) -> f64 {
    ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs()
}

#[test]
fn look_angles_are_those_of_skyfield() {
    let (mut compared, mut worst) = (0, [0.0_f64; 6]);
    for record in LOOK.split("\n\n") {
        let Some(propagator) = propagator_of(record) else { continue };
        for line in record.lines().filter_map(|line| line.strip_prefix("look: ")) {
            let v = numbers(line);
            let at = UtcInstant::from_unix_us(v[0] as i64);
            let orientation = EarthOrientation::new(v[1]).unwrap();
            let station = Station::new(v[2], v[3], v[4]).unwrap();
            let fixed = ecef_from_teme(&propagator.at(at).unwrap(), gmst_rad(at, orientation));
            let look = station.look(&fixed);
            // An azimuth counts by what it is on the sky.
            let level = look.elevation_deg.to_radians().cos();
            let found = [
                turn(look.azimuth_deg, v[5]) * level,
                (look.elevation_deg - v[6]).abs(),
                (look.range_km - v[7]).abs(),
                (look.azimuth_rate_deg_s - v[8]).abs() * level,
                (look.elevation_rate_deg_s - v[9]).abs(),
                (look.range_rate_km_s - v[10]).abs(),
            ];
            for (worst, found) in worst.iter_mut().zip(found) {
                *worst = worst.max(found);
            }
            // With the same UT1 on both sides: a hundredth of the pointing and of the Doppler that anybody needs.
            assert!(found[0] < 1e-6 && found[1] < 1e-6 && found[2] < 1e-5, "{line}\n{look:?}");
            assert!(found[3] < 1e-8 && found[4] < 1e-8 && found[5] < 1e-7, "{line}\n{look:?}");
            compared += 1;
        }
    }
    assert_eq!(compared, 336);
    println!("{compared} looks, worst {worst:?}");
}

#[test]
fn places_below_are_those_of_skyfield() {
    let mut compared = 0;
    for record in LOOK.split("\n\n") {
        let Some(propagator) = propagator_of(record) else { continue };
        for line in record.lines().filter_map(|line| line.strip_prefix("below: ")) {
            let v = numbers(line);
            let at = UtcInstant::from_unix_us(v[0] as i64);
            let orientation = EarthOrientation::new(v[1]).unwrap();
            let fixed = ecef_from_teme(&propagator.at(at).unwrap(), gmst_rad(at, orientation));
            let place = tle::ground::subpoint(&fixed);
            let latitude = (place.latitude_rad.to_degrees() - v[2]).abs();
            let longitude = turn(place.longitude_rad.to_degrees(), v[3]) * place.latitude_rad.cos();
            assert!(latitude < 1e-6 && longitude < 1e-6, "{line}\n{place:?}");
            assert!((place.height_km - v[4]).abs() < 1e-4, "{line}\n{place:?}");
            compared += 1;
        }
    }
    assert_eq!(compared, 336);
}

#[test]
fn sun_stands_where_erfa_sees_it() {
    let (mut compared, mut worst) = (0, 0.0_f64);
    for line in SUN.lines().filter_map(|line| line.strip_prefix("sun: ")) {
        let v = numbers(line);
        let ours = sun_teme_km(UtcInstant::from_unix_us(v[0] as i64 * 1_000_000));
        let theirs = [v[1], v[2], v[3]];
        worst = worst.max(angle_rad(ours, theirs).to_degrees());
        assert!((norm(ours) / norm(theirs) - 1.0).abs() < 2e-4, "{line}");
        compared += 1;
    }
    assert_eq!(compared, 120);
    assert!(worst < 0.015, "{worst} degrees");
    println!("{compared} places of the Sun, worst {worst} degrees");
}

#[test]
fn edges_of_the_shadow_are_met_within_two_seconds() {
    let (mut compared, mut worst) = (0, 0.0_f64);
    for record in SUN.split("\n\n") {
        let Some(propagator) = propagator_of(record) else { continue };
        let lines = |key: &'static str| record.lines().filter_map(move |line| line.strip_prefix(key));
        let window = numbers(lines("window: ").next().unwrap());
        let [start, stop] = [window[0], window[1]].map(|s| UtcInstant::from_unix_us(s as i64 * 1_000_000));
        let ours: Vec<_> = shadow_crossings(&propagator, start, stop).map(Result::unwrap).collect();
        let theirs: Vec<_> = lines("edge: ").collect();
        assert_eq!(ours.len(), theirs.len(), "{record}");
        for (crossing, line) in ours.iter().zip(theirs) {
            let (when, edge) = line.split_once(' ').unwrap();
            let name = match crossing.edge {
                ShadowEdge::PenumbraEntered => "penumbra-entered",
                ShadowEdge::UmbraEntered => "umbra-entered",
                ShadowEdge::UmbraLeft => "umbra-left",
                ShadowEdge::PenumbraLeft => "penumbra-left",
            };
            assert_eq!(name, edge, "{line}");
            let apart_s = (crossing.at.unix_us() as f64 / 1e6 - when.parse::<f64>().unwrap()).abs();
            worst = worst.max(apart_s);
            assert!(apart_s < 2.0, "{line}: {apart_s} s\n{record}");
            compared += 1;
        }
    }
    assert_eq!(compared, 262);
    println!("{compared} edges, worst {worst} s");
}

#[test]
fn rates_are_the_derivatives_of_the_angles() {
    let propagator = propagator_of(LOOK.split("\n\n").nth(1).unwrap()).unwrap();
    let station = Station::new(46.5, 6.5, 400.0).unwrap();
    let look = |at: UtcInstant| {
        let state = propagator.at(at).unwrap();
        station.look(&ecef_from_teme(&state, gmst_rad(at, EarthOrientation::UT1_IS_UTC)))
    };
    for minute in 0..200 {
        let at = propagator.epoch().plus_seconds(f64::from(minute) * 60.0);
        let (now, before, after) = (look(at), look(at.plus_us(-500_000)), look(at.plus_us(500_000)));
        // SGP4's velocity is not exactly the derivative of its position.
        assert!((after.elevation_deg - before.elevation_deg - now.elevation_rate_deg_s).abs() < 2e-5);
        assert!((after.range_km - before.range_km - now.range_rate_km_s).abs() < 1e-3);
        let turned = (after.azimuth_deg - before.azimuth_deg + 180.0).rem_euclid(360.0) - 180.0;
        assert!((turned - now.azimuth_rate_deg_s).abs() < 2e-5);
        let state = propagator.at(at).unwrap();
        let fixed = ecef_from_teme(&state, gmst_rad(at, EarthOrientation::UT1_IS_UTC));
        let acceleration = tle::doppler::range_acceleration_km_s2(station.axes(), &fixed);
        assert!((after.range_rate_km_s - before.range_rate_km_s - acceleration).abs() < 1e-6);
        let back = tle::frames::teme_from_ecef(&fixed, gmst_rad(at, EarthOrientation::UT1_IS_UTC));
        assert!(norm(tle::vector::sub(back.r_teme_km, state.r_teme_km)) < 1e-9);
        assert!(norm(tle::vector::sub(back.v_teme_km_s, state.v_teme_km_s)) < 1e-12);
    }
}

#[test]
fn places_that_are_not_on_earth_are_refused_with_a_remedy() {
    for (latitude, longitude, height, wanted) in [
        (91.0, 0.0, 0.0, "the latitude 91 is outside -90 to 90 degrees: give latitude first"),
        (f64::NAN, 0.0, 0.0, "the latitude NaN"),
        (0.0, 361.0, 0.0, "the longitude 361 is outside"),
        (0.0, 0.0, 1e6, "the height 1000000 m is outside"),
    ] {
        let error = Station::new(latitude, longitude, height).unwrap_err().to_string();
        assert!(error.starts_with(wanted), "{error}");
    }
}
