//! One pass of `tle` to its words on the wire.

use api::{ElementsView, FineTime, PassEndWord, PassView};
use tle::passes::{EndCause, Pass, PassEnd, PassPoint};
use tle::shadow::{DARK_SKY_SUN_ELEVATION_DEG, Light, light, optically_visible};
use tle::sun::sun_elevation_deg;
use tle::{EarthOrientation, Elements, Propagator, UtcInstant, doppler};

use super::{Object, Place};

/// Longest step between the moments at which a pass is tried for visibility, and the most moments tried.
const VISIBILITY_STEP_S: f64 = 30.0;
const VISIBILITY_MOMENTS_MAX: f64 = 120.0;

/// An instant on the wire.
#[must_use]
pub fn fine_time(at: UtcInstant) -> FineTime {
    FineTime::from_unix_us(at.unix_us())
}

/// An instant from the wire.
#[must_use]
pub fn instant(at: FineTime) -> UtcInstant {
    UtcInstant::from_unix_us(at.unix_us())
}

/// What a pass is seen with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen<'a> {
    pub(super) object: &'a Object,
    /// The set of the object that was used, and its theory.
    pub(super) elements: &'a Elements,
    pub(super) propagator: &'a Propagator,
    pub(super) place: &'a Place,
    pub(super) orientation: EarthOrientation,
    pub(super) frequency_hz: Option<f64>,
}

/// A pass of one set of elements over a station. `propagator` is that of `elements`.
#[must_use]
pub fn pass_view(
    elements: &Elements,
    propagator: &Propagator,
    place: &Place,
    orientation: EarthOrientation,
    frequency_hz: Option<f64>,
    pass: &Pass,
) -> PassView {
    let object = Object::of(elements.clone());
    Seen { object: &object, elements, propagator, place, orientation, frequency_hz }.pass(pass)
}

impl Seen<'_> {
    pub(super) fn pass(&self, pass: &Pass) -> PassView {
        let doppler_hz = |point: &PassPoint| {
            self.frequency_hz.map(|hz| doppler::downlink_shift_hz(hz, point.look.range_rate_km_s))
        };
        let point = |end: &PassEnd| PassPoint { at: end.at, look: end.look };
        let (aos, tca, los) = (point(&pass.aos), pass.tca, point(&pass.los));
        let sunlit = |point: &PassPoint| self.light(point.at).map(|light| light == Light::Sunlit);
        let (aos_cause, true_aos, aos_error) = cause(&pass.aos);
        let (los_cause, true_los, los_error) = cause(&pass.los);
        PassView {
            satellite: self.object.label(),
            norad_cat_id: self.object.norad_cat_id(),
            station: self.place.name.clone(),
            aos: fine_time(aos.at),
            tca: fine_time(tca.at),
            los: fine_time(los.at),
            duration_s: pass.duration_s(),
            max_elevation_deg: tca.look.elevation_deg,
            aos_clipped: aos_cause != PassEndWord::Horizon,
            los_clipped: los_cause != PassEndWord::Horizon,
            aos_cause,
            los_cause,
            true_aos,
            true_los,
            aos_error,
            los_error,
            aos_azimuth_deg: aos.look.azimuth_deg,
            tca_azimuth_deg: tca.look.azimuth_deg,
            los_azimuth_deg: los.look.azimuth_deg,
            aos_elevation_deg: aos.look.elevation_deg,
            los_elevation_deg: los.look.elevation_deg,
            aos_range_km: aos.look.range_km,
            tca_range_km: tca.look.range_km,
            los_range_km: los.look.range_km,
            aos_range_rate_km_s: aos.look.range_rate_km_s,
            tca_range_rate_km_s: tca.look.range_rate_km_s,
            los_range_rate_km_s: los.look.range_rate_km_s,
            frequency_hz: self.frequency_hz,
            aos_doppler_hz: doppler_hz(&aos),
            tca_doppler_hz: doppler_hz(&tca),
            los_doppler_hz: doppler_hz(&los),
            aos_sunlit: sunlit(&aos),
            tca_sunlit: sunlit(&tca),
            los_sunlit: sunlit(&los),
            optically_visible: self.visible(aos.at, los.at),
            epoch: fine_time(self.elements.epoch),
            age_days: self.elements.age_days(tca.at),
        }
    }

    /// `None` where there is no state, as at the end of a pass that decay cuts.
    fn light(&self, at: UtcInstant) -> Option<Light> {
        self.propagator.at(at).ok().map(|state| light(state.r_teme_km, at))
    }

    fn visible(&self, aos: UtcInstant, los: UtcInstant) -> bool {
        let duration_s = los.seconds_since(aos);
        let steps = (duration_s / VISIBILITY_STEP_S).ceil().clamp(2.0, VISIBILITY_MOMENTS_MAX);
        let moment = |step: u32| aos.plus_seconds(duration_s * (f64::from(step) / steps));
        let sun_deg = |at| sun_elevation_deg(&self.place.station, at, self.orientation);
        // The Sun moves by a degree in 4 min: if it is far too high at both ends of a short pass, nothing is asked of SGP4.
        let turned_deg = duration_s / 240.0;
        if sun_deg(aos).min(sun_deg(los)) > DARK_SKY_SUN_ELEVATION_DEG + turned_deg {
            return false;
        }
        (0..=steps as u32).map(moment).any(|at| {
            let sun_deg = sun_deg(at);
            sun_deg < DARK_SKY_SUN_ELEVATION_DEG
                && self.light(at).is_some_and(|light| optically_visible(light, sun_deg))
        })
    }
}

fn cause(end: &PassEnd) -> (PassEndWord, Option<FineTime>, Option<String>) {
    match end.cause {
        EndCause::Horizon => (PassEndWord::Horizon, None, None),
        EndCause::Window { crossing } => (PassEndWord::Window, crossing.map(fine_time), None),
        EndCause::NoState(error) => (PassEndWord::NoState, None, Some(error.to_string())),
    }
}

/// A set of elements on the wire.
#[must_use]
pub fn elements_view(elements: &Elements) -> ElementsView {
    ElementsView {
        satellite: elements.label(),
        norad_cat_id: elements.norad_cat_id,
        object_id: elements.object_id.clone(),
        epoch: fine_time(elements.epoch),
        mean_motion_rev_day: elements.mean_motion_rev_day,
        eccentricity: elements.eccentricity,
        inclination_deg: elements.inclination_deg,
        raan_deg: elements.raan_deg,
        arg_of_perigee_deg: elements.arg_of_perigee_deg,
        mean_anomaly_deg: elements.mean_anomaly_deg,
        bstar: elements.bstar,
        element_set_no: elements.element_set_no,
        rev_at_epoch: elements.rev_at_epoch,
    }
}

/// A set of elements from the wire, as far as SGP4 needs it.
#[must_use]
pub fn elements_of(view: &ElementsView) -> Elements {
    Elements {
        name: Some(view.satellite.clone()),
        object_id: view.object_id.clone(),
        norad_cat_id: view.norad_cat_id,
        epoch: instant(view.epoch),
        mean_motion_rev_day: view.mean_motion_rev_day,
        eccentricity: view.eccentricity,
        inclination_deg: view.inclination_deg,
        raan_deg: view.raan_deg,
        arg_of_perigee_deg: view.arg_of_perigee_deg,
        mean_anomaly_deg: view.mean_anomaly_deg,
        bstar: view.bstar,
        mean_motion_dot: 0.0,
        mean_motion_ddot: 0.0,
        ephemeris_type: None,
        classification: None,
        element_set_no: view.element_set_no,
        rev_at_epoch: view.rev_at_epoch,
        further: Vec::new(),
    }
}
