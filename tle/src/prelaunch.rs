//! Elements before anybody has tracked the satellite: from the launcher's state vector, and for another lift-off time.

use crate::elements::Elements;
use crate::frames::EARTH_RATE_RAD_S;
use crate::propagator::{
    ElementsError, PropagationError, Propagator, SGP4_EARTH_RADIUS_KM, SGP4_MU_KM3_S2, State,
};
use crate::time::UtcInstant;
use crate::vector::{Vec3, add, cross, dot, norm, scale, sub};
use std::f64::consts::TAU;

/// Steps after which a state that SGP4 does not meet is given up. Usual are less than ten.
const STEPS_MAX: usize = 60;
/// A state is met within a millimetre and a micrometre a second.
const MET_KM: f64 = 1e-6;
const MET_KM_S: f64 = 1e-9;

/// A state vector for which there are no elements.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StateVectorError {
    /// The state describes no closed orbit round the Earth.
    #[error(
        "position and velocity describe no closed orbit: give km and km/s, and the velocity in the frame that does not turn \
         (an Earth-fixed one goes through teme_from_ecef first)"
    )]
    NoOrbit,
    /// The orbit meets the Earth before its next revolution.
    #[error(
        "the orbit's perigee is {perigee_height_km} km above the equator's radius: this flight comes down again"
    )]
    Suborbital {
        /// Height of the osculating perigee, km: negative.
        perigee_height_km: f64,
    },
    /// SGP4 has no answer for the elements at their epoch.
    #[error("SGP4 cannot follow this orbit")]
    Propagation(#[source] PropagationError),
    /// Elements that SGP4 refuses.
    #[error("SGP4 cannot follow this orbit")]
    Elements(#[source] ElementsError),
    /// No elements were found that meet the state.
    #[error("no elements meet this state: {off_km} km are left")]
    NotMet {
        /// How far the best elements miss the position, km.
        off_km: f64,
    },
}

/// Mean elements whose SGP4 state at `epoch` is `state`, to a millimetre: what a launcher's separation vector becomes
/// before the first tracked elements are there. Name, numbers and designator are for the caller to add. `bstar` in
/// 1/Earth radii is a guess too: 2e-4 for a CubeSat at 500 km, 0 for none.
///
/// # Errors
/// See [`StateVectorError`].
pub fn elements_from_state(
    epoch: UtcInstant,
    state: &State,
    bstar: f64,
) -> Result<Elements, StateVectorError> {
    // Mean elements differ from osculating ones by thousandths. A point is sought whose osculating elements, taken for
    // mean ones, meet the state; in these coordinates nothing is singular, neither a circle nor an equatorial orbit.
    let first = osculating(epoch, state, bstar).ok_or(StateVectorError::NoOrbit)?;
    let axis_km = (SGP4_MU_KM3_S2 * (86_400.0 / TAU / first.mean_motion_rev_day).powi(2)).cbrt();
    let perigee_height_km = axis_km * (1.0 - first.eccentricity) - SGP4_EARTH_RADIUS_KM;
    if perigee_height_km < 0.0 {
        return Err(StateVectorError::Suborbital { perigee_height_km });
    }
    let mut guess = *state;
    let mut off_km = f64::INFINITY;
    for _ in 0..STEPS_MAX {
        let elements = osculating(epoch, &guess, bstar).ok_or(StateVectorError::NoOrbit)?;
        let propagator = Propagator::new(&elements).map_err(StateVectorError::Elements)?;
        let found = propagator.at_minutes(0.0).map_err(StateVectorError::Propagation)?;
        let r_off = sub(state.r_teme_km, found.r_teme_km);
        let v_off = sub(state.v_teme_km_s, found.v_teme_km_s);
        off_km = norm(r_off);
        if off_km < MET_KM && norm(v_off) < MET_KM_S {
            return Ok(elements);
        }
        guess.r_teme_km = add(guess.r_teme_km, r_off);
        guess.v_teme_km_s = add(guess.v_teme_km_s, v_off);
    }
    Err(StateVectorError::NotMet { off_km })
}

/// The same flight after a lift-off `delay_s` seconds later (earlier, when negative): the epoch moves with the lift-off,
/// and the node with the Earth that has turned on below. For elements that were made for a nominal lift-off.
#[must_use]
pub fn after_delayed_launch(elements: &Elements, delay_s: f64) -> Elements {
    let turned_deg = (EARTH_RATE_RAD_S * delay_s).to_degrees();
    Elements {
        epoch: elements.epoch.plus_seconds(delay_s),
        raan_deg: (elements.raan_deg + turned_deg).rem_euclid(360.0),
        ..elements.clone()
    }
}

/// The ellipse that two bodies alone would follow from here.
fn osculating(epoch: UtcInstant, state: &State, bstar: f64) -> Option<Elements> {
    let (r, v) = (state.r_teme_km, state.v_teme_km_s);
    let (radius, momentum) = (norm(r), cross(r, v));
    let axis_km = 1.0 / (2.0 / radius - dot(v, v) / SGP4_MU_KM3_S2);
    let eccentricity_vector = sub(scale(cross(v, momentum), 1.0 / SGP4_MU_KM3_S2), scale(r, 1.0 / radius));
    let eccentricity = norm(eccentricity_vector);
    let fits = axis_km.is_finite() && axis_km > 0.0 && eccentricity < 1.0 && norm(momentum) > 0.0;
    if !fits {
        return None;
    }
    let up = scale(momentum, 1.0 / norm(momentum));
    let level = up[0].hypot(up[1]);
    // An equatorial orbit has no node: the x axis stands for it.
    let node: Vec3 = if level > 0.0 { [-up[1] / level, up[0] / level, 0.0] } else { [1.0, 0.0, 0.0] };
    let ahead = cross(up, node);
    let perigee = dot(eccentricity_vector, ahead).atan2(dot(eccentricity_vector, node));
    let true_anomaly = dot(r, ahead).atan2(dot(r, node)) - perigee;
    let eccentric_anomaly = ((1.0 - eccentricity * eccentricity).sqrt() * true_anomaly.sin())
        .atan2(eccentricity + true_anomaly.cos());
    let mean_anomaly = eccentric_anomaly - eccentricity * eccentric_anomaly.sin();
    let degrees = |angle: f64| angle.rem_euclid(TAU).to_degrees();
    Some(Elements {
        name: None,
        object_id: None,
        norad_cat_id: None,
        epoch,
        mean_motion_rev_day: (SGP4_MU_KM3_S2 / axis_km.powi(3)).sqrt() * 86_400.0 / TAU,
        eccentricity,
        inclination_deg: level.atan2(up[2]).to_degrees(),
        raan_deg: degrees(node[1].atan2(node[0])),
        arg_of_perigee_deg: degrees(perigee),
        mean_anomaly_deg: degrees(mean_anomaly),
        bstar,
        mean_motion_dot: 0.0,
        mean_motion_ddot: 0.0,
        ephemeris_type: Some(0),
        classification: Some('U'),
        element_set_no: None,
        rev_at_epoch: None,
        further: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Checksums, sets};

    const VECTORS: &str = include_str!("../vectors/look.txt");

    fn orbits() -> Vec<Elements> {
        let cards: String = VECTORS
            .lines()
            .filter_map(|line| line.split_once(": ").filter(|(key, _)| key.starts_with("line")))
            .map(|(_, card)| format!("{card}\n"))
            .collect();
        sets(&cards, Checksums::Strict).unwrap().map(|set| set.unwrap().elements).collect()
    }

    #[test]
    fn elements_of_a_state_meet_it_and_stay_with_it() {
        let orbits = orbits();
        assert_eq!(orbits.len(), 7);
        for elements in orbits {
            let truth = Propagator::new(&elements).unwrap();
            for minutes in [0.0, 17.0, 333.0] {
                let state = truth.at_minutes(minutes).unwrap();
                let epoch = elements.epoch.plus_seconds(minutes * 60.0);
                let fitted = elements_from_state(epoch, &state, elements.bstar).unwrap();
                let ours = Propagator::new(&fitted).unwrap();
                let start = ours.at_minutes(0.0).unwrap();
                assert!(norm(sub(start.r_teme_km, state.r_teme_km)) < 1e-6);
                // A day later the fit is as good as SGP4 agrees with itself from another epoch.
                let later = ours.at_minutes(1440.0).unwrap();
                let wanted = truth.at_minutes(minutes + 1440.0).unwrap();
                let off_km = norm(sub(later.r_teme_km, wanted.r_teme_km));
                assert!(off_km < 5.0, "{off_km} km after a day: {elements:?}");
            }
        }
    }

    #[test]
    fn state_without_an_orbit_is_refused() {
        let epoch = UtcInstant::from_unix_us(0);
        let of = |r, v| elements_from_state(epoch, &State { r_teme_km: r, v_teme_km_s: v }, 0.0);
        assert_eq!(of([7000.0, 0.0, 0.0], [0.0, 12.0, 0.0]), Err(StateVectorError::NoOrbit));
        assert_eq!(of([0.0; 3], [0.0; 3]), Err(StateVectorError::NoOrbit));
        assert_eq!(of([7000.0, 0.0, 0.0], [f64::NAN; 3]), Err(StateVectorError::NoOrbit));
        assert!(matches!(of([6400.0, 0.0, 0.0], [0.0, 5.0, 0.0]), Err(StateVectorError::Suborbital { .. })));
    }

    #[test]
    fn delayed_launch_passes_over_the_same_places_later() {
        use crate::{EarthOrientation, ecef_from_teme, gmst_rad};
        let nominal = &orbits()[0];
        let delayed = after_delayed_launch(nominal, 1800.0);
        let place = |elements: &Elements, at: UtcInstant| {
            let state = Propagator::new(elements).unwrap().at(at).unwrap();
            ecef_from_teme(&state, gmst_rad(at, EarthOrientation::UT1_IS_UTC)).r_ecef_km
        };
        let at = nominal.epoch.plus_seconds(4000.0);
        assert!(norm(sub(place(nominal, at), place(&delayed, at.plus_seconds(1800.0)))) < 0.01);
    }
}
