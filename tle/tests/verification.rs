//! SGP4 against the verification set of AIAA 2006-6753, and TLE against OMM.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use tle::formats::{self, Checksums, Form};
use tle::{Elements, Propagator, UtcInstant};

const VECTORS: &str = include_str!("../vectors/sgp4.txt");

struct Run {
    elements: Elements,
    omm: Option<Elements>,
    states: Vec<[f64; 7]>,
    errors: Vec<(f64, u8)>,
}

fn numbers<const N: usize>(text: &str) -> [f64; N] {
    let numbers: Vec<f64> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
    numbers.try_into().unwrap()
}

fn runs() -> Vec<Run> {
    let mut runs = Vec::new();
    for record in VECTORS.split("\n\n") {
        let of =
            |key: &str| record.lines().filter_map(move |line| line.strip_prefix(key)).collect::<Vec<_>>();
        let (Some(one), Some(two)) = (of("line1: ").first().copied(), of("line2: ").first().copied()) else {
            continue;
        };
        // Three of the sets have wrong checksums.
        let text = format!("{one}\n{two}");
        let found = formats::sets(&text, Checksums::Lenient).unwrap().next().unwrap().unwrap();
        let omm = of("omm: ")
            .first()
            .map(|json| formats::sets(json, Checksums::Strict).unwrap().next().unwrap().unwrap().elements);
        runs.push(Run {
            elements: found.elements,
            omm,
            states: of("state: ").into_iter().map(numbers).collect(),
            errors: of("error: ")
                .into_iter()
                .map(|text| {
                    let [minutes, code] = numbers(text);
                    (minutes, code as u8)
                })
                .collect(),
        });
    }
    runs
}

#[test]
fn states_of_the_verification_set_are_met() {
    let runs = runs();
    assert_eq!(runs.len(), 33);
    let (mut compared, mut worst_km, mut worst_km_s) = (0, 0.0_f64, 0.0_f64);
    for run in &runs {
        let propagator = Propagator::new(&run.elements).unwrap();
        for [minutes, x, y, z, vx, vy, vz] in &run.states {
            let state = propagator.at_minutes(*minutes).unwrap();
            for (ours, theirs) in state.r_teme_km.iter().zip([x, y, z]) {
                worst_km = worst_km.max((ours - theirs).abs());
            }
            for (ours, theirs) in state.v_teme_km_s.iter().zip([vx, vy, vz]) {
                worst_km_s = worst_km_s.max((ours - theirs).abs());
            }
            assert!(
                worst_km < 1e-6 && worst_km_s < 1e-9,
                "{} at {minutes} min: {worst_km:e} km, {worst_km_s:e} km/s",
                run.elements.label()
            );
            compared += 1;
        }
    }
    assert!(compared > 700, "{compared}");
    println!("{compared} states, worst {worst_km:e} km, {worst_km_s:e} km/s");
}

#[test]
fn errors_appear_at_their_steps_with_their_codes() {
    let mut first_errors = Vec::new();
    for run in &runs() {
        let propagator = Propagator::new(&run.elements).unwrap();
        for &(minutes, code) in &run.errors {
            let error = propagator.at_minutes(minutes).expect_err("the reference fails here");
            assert_eq!(error.code(), Some(code), "{} at {minutes} min: {error}", run.elements.label());
        }
        if let Some(&(minutes, code)) = run.errors.first() {
            first_errors.push((run.elements.norad_cat_id.unwrap(), code, minutes));
        }
    }
    assert_eq!(
        first_errors,
        [
            (22_312, 1, 494.202_867_2),
            (28_350, 1, 1560.0),
            (28_872, 6, 55.0),
            (29_141, 6, 440.0),
            (33_333, 4, 25.0),
            (33_334, 3, 0.0),
            (20_413, 6, 1_844_345.0),
        ]
    );
}

#[test]
fn the_same_object_as_tle_and_as_omm_is_the_same() {
    for run in runs() {
        let Some(mut omm) = run.omm else { continue };
        // The exporter has gone through an f64 of a Julian date, and its numbers through radians.
        assert!(omm.epoch.us_since(run.elements.epoch).abs() <= 10, "{}", run.elements.label());
        omm.epoch = run.elements.epoch;
        let (one, other) = (Propagator::new(&run.elements).unwrap(), Propagator::new(&omm).unwrap());
        for hours in 0..=168 {
            let minutes = f64::from(hours) * 60.0;
            let (Ok(a), Ok(b)) = (one.at_minutes(minutes), other.at_minutes(minutes)) else { continue };
            for (a, b) in a.r_teme_km.iter().zip(b.r_teme_km) {
                assert!((a - b).abs() < 1e-6, "{} after {hours} h", run.elements.label());
            }
        }
    }
}

#[test]
fn every_field_survives_every_form() {
    for run in runs() {
        let mut elements = run.elements.clone();
        elements.name = Some("1 <ODD> \"NAME\", & CO".to_owned());
        for form in Form::ALL {
            let text = formats::write(form, std::slice::from_ref(&elements)).unwrap();
            let mut sets = formats::sets(&text, Checksums::Strict).unwrap();
            assert_eq!(sets.form(), form, "{text}");
            let mut back = sets.next().unwrap().unwrap_or_else(|error| panic!("{error}\n{text}")).elements;
            assert!(sets.next().is_none());
            if form == Form::TwoLine {
                assert_eq!(back.name, None);
                back.name.clone_from(&elements.name);
            }
            assert_eq!(back, elements, "{}\n{text}", form.name());
        }
    }
}

#[test]
fn state_is_refused_far_from_the_epoch_and_at_no_time() {
    let propagator = Propagator::new(&runs()[0].elements).unwrap();
    for minutes in [f64::NAN, f64::INFINITY, -1e300, 6e7] {
        assert_eq!(propagator.at_minutes(minutes).unwrap_err().fault, tle::Fault::TooFarFromEpoch);
    }
    assert!(propagator.at(UtcInstant::from_unix_us(i64::MAX)).is_err());
}
