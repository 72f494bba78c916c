//! Whatever the text: no reader panics, and what is read can be propagated or says why not.

use proptest::prelude::*;
use tle::formats::{self, Checksums, Form};
use tle::{Elements, Propagator, UtcInstant};

const ONE: &str = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992";
const TWO: &str = "2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008";

fn read_all(text: &str) {
    let _ = text.parse::<UtcInstant>();
    let Ok(sets) = formats::sets(text, Checksums::Lenient) else { return };
    // No reader makes more sets than there are lines or braces to make them of.
    let mut left = text.len() + 2;
    for set in sets {
        left -= 1;
        match set {
            Err(error) => assert!(!error.to_string().is_empty()),
            Ok(found) => {
                if let Ok(propagator) = Propagator::new(&found.elements) {
                    for minutes in [0.0, -1e6, 1e4, 5e7] {
                        if let Ok(state) = propagator.at_minutes(minutes) {
                            assert!(state.r_teme_km.iter().chain(&state.v_teme_km_s).all(|x| x.is_finite()));
                        }
                    }
                }
            }
        }
        assert!(left > 0);
    }
}

fn elements() -> impl Strategy<Value = Elements> {
    let orbit =
        (0.001..18.0_f64, 0.0..0.999_f64, 0.0..=180.0_f64, 0.0..360.0_f64, 0.0..360.0_f64, 0.0..360.0_f64);
    let drag = (-0.9..0.9_f64, -0.9..0.9_f64, -0.9..0.9_f64);
    let texts = (
        proptest::option::of("[A-Z0-9(&<\"',][A-Z0-9 ()&<\"',=;-]{0,10}[A-Z0-9)]"),
        proptest::option::of("(19[6-9][0-9]|20[0-4][0-9])-[0-9]{3}[A-Z]{1,3}"),
        proptest::collection::vec("[A-Z_]{2,12}", 0..4),
    );
    let numbers = (
        proptest::option::of(0..1_000_000_000_u32),
        proptest::option::of(0..10_000_u32),
        proptest::option::of(0..100_000_u32),
        proptest::option::of(proptest::sample::select(vec!['U', 'C', 'S'])),
    );
    let epoch_us = -200_000_000_000_000_i64..2_700_000_000_000_000;
    (orbit, drag, texts, numbers, epoch_us).prop_map(|(orbit, drag, texts, numbers, epoch_us)| {
        let mut further: Vec<(String, String)> = Vec::new();
        for key in texts.2 {
            let key = format!("X_{key}");
            if !further.iter().any(|(known, _)| *known == key) {
                further.push((key, "12, \"3\" & <4>".to_owned()));
            }
        }
        Elements {
            name: texts.0,
            object_id: texts.1,
            norad_cat_id: numbers.0,
            epoch: UtcInstant::from_unix_us(epoch_us),
            mean_motion_rev_day: orbit.0,
            eccentricity: orbit.1,
            inclination_deg: orbit.2,
            raan_deg: orbit.3,
            arg_of_perigee_deg: orbit.4,
            mean_anomaly_deg: orbit.5,
            bstar: drag.0,
            mean_motion_dot: drag.1,
            mean_motion_ddot: drag.2,
            ephemeris_type: Some(0),
            classification: numbers.3,
            element_set_no: numbers.1,
            rev_at_epoch: numbers.2,
            further,
        }
    })
}

proptest! {
    #[test]
    fn any_text_is_read_without_panic(text in any::<String>()) {
        read_all(&text);
    }

    #[test]
    fn any_bytes_are_read_without_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        if let Ok(text) = formats::text_of(&bytes) {
            read_all(&text);
        }
    }

    #[test]
    fn damaged_sets_are_read_without_panic(
        set in elements(),
        form in proptest::sample::select(Form::ALL.to_vec()),
        damage in proptest::collection::vec((any::<prop::sample::Index>(), any::<char>(), 0..3_u8), 1..8),
    ) {
        let mut set = set;
        set.norad_cat_id = Some(25_544);
        let mut text: Vec<char> = formats::write(form, &[set.clone(), set]).unwrap().chars().collect();
        for (place, character, what) in damage {
            let place = place.index(text.len());
            match what {
                0 => text[place] = character,
                1 => text.insert(place, character),
                _ => text.truncate(place.max(1)),
            }
        }
        read_all(&text.into_iter().collect::<String>());
    }

    #[test]
    fn damaged_columns_are_refused_or_change_nothing_else(place in 0..138_usize, byte in b' '..=b'~') {
        let mut text = format!("{ONE}\n{TWO}").into_bytes();
        if text[place] == b'\n' {
            return Ok(());
        }
        let before = text[place];
        text[place] = byte;
        let text = String::from_utf8(text).unwrap();
        read_all(&text);
        // A checksum notices every changed digit.
        if before.is_ascii_digit() && byte.is_ascii_digit() && before != byte {
            let read = formats::sets(&text, Checksums::Strict);
            prop_assert!(read.is_err() || read.unwrap().all(|set| set.is_err()), "{}", text);
        }
    }

    #[test]
    fn omm_keeps_every_bit(set in elements(), form in proptest::sample::select(Form::ALL[..4].to_vec())) {
        let text = formats::write(form, std::slice::from_ref(&set)).unwrap();
        let back: Vec<_> = formats::sets(&text, Checksums::Strict).unwrap().collect();
        prop_assert_eq!(back.len(), 1);
        prop_assert_eq!(&back[0].as_ref().unwrap().elements, &set, "{}", text);
    }

    #[test]
    fn tle_is_stable_after_its_first_rounding(set in elements()) {
        let mut set = set;
        set.norad_cat_id = set.norad_cat_id.map(|id| id % 340_000);
        let Ok(text) = formats::write(Form::ThreeLine, std::slice::from_ref(&set)) else {
            // The epoch is outside 1957 to 2056.
            return Ok(());
        };
        let once = formats::sets(&text, Checksums::Strict).unwrap().next().unwrap();
        let once = once.map_err(|error| TestCaseError::fail(format!("{error}\n{text}")))?.elements;
        prop_assert!((once.raan_deg - set.raan_deg).abs() < 5.1e-5);
        prop_assert!((once.mean_motion_rev_day - set.mean_motion_rev_day).abs() < 5.1e-9);
        prop_assert!(once.epoch.us_since(set.epoch).abs() <= 432);
        prop_assert!((once.bstar - set.bstar).abs() <= set.bstar.abs() * 1e-4 + 1e-14);
        let again = formats::write(Form::ThreeLine, std::slice::from_ref(&once)).unwrap();
        prop_assert_eq!(again, text);
    }
}
