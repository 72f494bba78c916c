//! Whether the satellite is, or was within 20 minutes, over somebody who hears it: our own station, or one that has before.

use mission::{SatelliteId, Site, UtcUs};
use tle::{EarthOrientation, Elements, Propagator, Station, UtcInstant, ecef_from_teme, gmst_rad};

use super::rhythm::MINUTE_US;
use crate::storage::{During, ReceiversQuery, Store};

/// After a pass reports still come in.
const AFTER_US: i64 = 20 * MINUTE_US;
/// Instants that are looked at lie so far apart.
const STEP_US: i64 = MINUTE_US;
/// Stations that are looked at.
const STATIONS: usize = 64;
/// Who hears is asked anew so often, of the last 60 days.
const ASK_US: i64 = 60 * MINUTE_US;
const BACK_US: i64 = 60 * 86_400_000_000;
/// Sets of elements that are looked through.
const SETS: u32 = 4;

/// Where the satellite is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Over {
    /// Over somebody, or it was a moment ago.
    Somebody,
    /// Over nobody.
    Nobody,
    /// There are no elements, or no stations.
    Unknown,
}

/// Who hears, and where the satellite is.
pub(super) struct Near {
    store: Store,
    satellite: SatelliteId,
    own: Option<Station>,
    stations: Vec<Station>,
    asked_at: Option<UtcUs>,
}

impl Near {
    pub(super) fn new(store: Store, satellite: SatelliteId, site: Option<Site>) -> Self {
        Self { store, satellite, own: site.map(|site| site.place), stations: Vec::new(), asked_at: None }
    }

    pub(super) async fn look(&mut self, now: UtcUs) -> Over {
        if self.asked_at.is_none_or(|asked| now.0 - asked.0 >= ASK_US) {
            self.asked_at = Some(now);
            let during = During { start_us: Some(now.0 - BACK_US), stop_us: None };
            let query = ReceiversQuery { satellite: Some(self.satellite.to_string()), during };
            if let Ok(receivers) = self.store.receivers(&query).await {
                let places = receivers.iter().filter_map(|receiver| receiver.place);
                let stations =
                    places.filter_map(|(latitude, longitude)| Station::new(latitude, longitude, 0.0).ok());
                self.stations = self.own.iter().cloned().chain(stations).take(STATIONS).collect();
            }
        }
        let window = (now.0 - AFTER_US, now.0);
        let rows =
            self.store.elements_between(self.satellite.as_str(), window, SETS).await.unwrap_or_default();
        let Some(set) = rows.iter().find_map(|row| row.elements().ok()) else { return Over::Unknown };
        if self.stations.is_empty() {
            return Over::Unknown;
        }
        let stations = self.stations.clone();
        let looked = tokio::task::spawn_blocking(move || is_over(&set, &stations, now));
        looked.await.unwrap_or(Over::Unknown)
    }
}

fn is_over(set: &Elements, stations: &[Station], now: UtcUs) -> Over {
    let Ok(propagator) = Propagator::new(set) else { return Over::Unknown };
    let mut back_us = 0;
    while back_us <= AFTER_US {
        let at = UtcInstant::from_unix_us(now.0 - back_us);
        let Ok(state) = propagator.at(at) else { return Over::Unknown };
        let fixed = ecef_from_teme(&state, gmst_rad(at, EarthOrientation::default()));
        if stations.iter().any(|station| station.look(&fixed).elevation_deg > 0.0) {
            return Over::Somebody;
        }
        back_us += STEP_US;
    }
    Over::Nobody
}
