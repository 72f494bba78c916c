//! What strangers publish as orbits.

use tle::Propagator;
use tle::formats::{self, Checksums, Form};

/// Any bytes as a file of elements: no reader panics, every place is inside the text, what is read can be written and
/// read again, and the theory made of it answers or says why not.
pub fn elements(data: &[u8]) {
    let Ok(text) = formats::text_of(data) else { return };
    let lines = text.split('\n').count();
    for checksums in [Checksums::Strict, Checksums::Lenient] {
        let Ok(sets) = formats::sets(&text, checksums) else { continue };
        // A set has at least one byte, and at most one more is made of what is left at the end.
        for (index, set) in sets.enumerate() {
            assert!(index <= data.len() + 1, "more sets than bytes");
            match set {
                Ok(found) => {
                    assert!((1..=lines).contains(&found.line), "line {} of {lines}", found.line);
                    sound(&found.elements);
                }
                Err(error) => {
                    assert!((1..=lines).contains(&error.line), "{error}, of {lines} lines");
                    assert!(!error.to_string().contains('\n'), "an error is one line: {error}");
                }
            }
        }
    }
}

fn sound(elements: &tle::Elements) {
    assert!((0.0..1.0).contains(&elements.eccentricity) && elements.mean_motion_rev_day > 0.0);
    assert!((0.0..=180.0).contains(&elements.inclination_deg));
    assert_ne!(elements.ephemeris_type, Some(4), "elements of another theory");
    if let Ok(text) = formats::write(Form::OmmJson, std::slice::from_ref(elements)) {
        let again = formats::sets(&text, Checksums::Strict).map(|mut sets| sets.next());
        let Ok(Some(Ok(again))) = again else { unreachable!("our own text is not read: {text}") };
        assert_eq!(again.elements.epoch, elements.epoch);
        assert_eq!(again.elements.mean_motion_rev_day.to_bits(), elements.mean_motion_rev_day.to_bits());
        assert_eq!(again.elements.norad_cat_id, elements.norad_cat_id);
    }
    let Ok(propagator) = Propagator::new(elements) else { return };
    for minutes in [0.0, 90.0, -1440.0] {
        if let Ok(state) = propagator.at_minutes(minutes) {
            assert!(state.r_teme_km.iter().chain(&state.v_teme_km_s).all(|value| value.is_finite()));
        }
    }
}
