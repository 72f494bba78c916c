//! Where everything stands at instants.

use api::LookView;
use tle::shadow::{Light, light};
use tle::{EarthOrientation, Propagator, UtcInstant, doppler, ecef_from_teme, gmst_rad, ground};

use super::predict::PredictError;
use super::row::fine_time;
use super::{Object, Place};

/// What to look at, from where and when.
#[derive(Debug, Clone, Copy)]
pub struct Looks<'a> {
    /// The satellites.
    pub objects: &'a [Object],
    /// The stations.
    pub places: &'a [Place],
    /// The instants.
    pub at: &'a [UtcInstant],
    /// How far the Earth has turned.
    pub orientation: EarthOrientation,
    /// For the Doppler shifts; none without it.
    pub frequency_hz: Option<f64>,
}

/// Every satellite at every instant from every station, in this order. An instant without a state is a row with its error.
///
/// # Errors
/// Elements that describe no orbit.
pub fn look_at(looks: &Looks<'_>) -> Result<Vec<LookView>, PredictError> {
    let mut rows = Vec::with_capacity(looks.objects.len() * looks.places.len() * looks.at.len());
    for object in looks.objects {
        for &at in looks.at {
            let set = object.set_for(at);
            let propagator = Propagator::new(set)
                .map_err(|error| PredictError::Elements { object: object.label(), error })?;
            let mut row = LookView {
                satellite: object.label(),
                norad_cat_id: object.norad_cat_id(),
                station: String::new(),
                at: fine_time(at),
                azimuth_deg: None,
                elevation_deg: None,
                azimuth_rate_deg_s: None,
                elevation_rate_deg_s: None,
                range_km: None,
                range_rate_km_s: None,
                frequency_hz: looks.frequency_hz,
                doppler_hz: None,
                received_hz: None,
                uplink_hz: None,
                latitude_deg: None,
                longitude_deg: None,
                height_km: None,
                eclipse: None,
                sun_fraction: None,
                epoch: fine_time(set.epoch),
                age_days: set.age_days(at),
                error: None,
            };
            let fixed = match propagator.at(at) {
                Ok(state) => {
                    let light = light(state.r_teme_km, at);
                    row.eclipse = Some(word(light).to_owned());
                    row.sun_fraction = Some(light.lit());
                    let fixed = ecef_from_teme(&state, gmst_rad(at, looks.orientation));
                    let below = ground::subpoint(&fixed);
                    row.latitude_deg = Some(below.latitude_rad.to_degrees());
                    row.longitude_deg = Some(below.longitude_rad.to_degrees());
                    row.height_km = Some(below.height_km);
                    Some(fixed)
                }
                Err(error) => {
                    row.error = Some(error.to_string());
                    None
                }
            };
            for place in looks.places {
                let mut row = LookView { station: place.name.clone(), ..row.clone() };
                if let Some(fixed) = &fixed {
                    let look = place.station.look(fixed);
                    row.azimuth_deg = Some(look.azimuth_deg);
                    row.elevation_deg = Some(look.elevation_deg);
                    row.azimuth_rate_deg_s = Some(look.azimuth_rate_deg_s);
                    row.elevation_rate_deg_s = Some(look.elevation_rate_deg_s);
                    row.range_km = Some(look.range_km);
                    row.range_rate_km_s = Some(look.range_rate_km_s);
                    let rate = look.range_rate_km_s;
                    row.doppler_hz = looks.frequency_hz.map(|hz| doppler::downlink_shift_hz(hz, rate));
                    row.received_hz = looks.frequency_hz.map(|hz| doppler::received_hz(hz, rate));
                    row.uplink_hz = looks.frequency_hz.map(|hz| doppler::uplink_hz(hz, rate));
                }
                rows.push(row);
            }
        }
    }
    Ok(rows)
}

/// What a satellite sees of the Sun, in a word.
fn word(light: Light) -> &'static str {
    match light {
        Light::Sunlit => "sunlit",
        Light::Penumbra { .. } => "penumbra",
        Light::Annular { .. } => "annular",
        Light::Umbra => "umbra",
    }
}
