//! What is in the sky: passes, looks, element sets.

use std::fmt;
use std::str::FromStr;

use jiff::Timestamp;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::TimeError;

/// An instant in UTC to the microsecond. On the wire `2026-11-22T05:19:25.123456Z`: RFC 3339, always `Z`, always six
/// decimals. Orbits need more than [`Time`](crate::Time) tells: in a millisecond a low satellite moves 7 m.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct FineTime(Timestamp);

impl FineTime {
    /// From microseconds since 1970-01-01T00:00:00Z; what lies outside the years -9999 to 9999 is brought to their end.
    #[must_use]
    pub fn from_unix_us(us: i64) -> Self {
        Self(Timestamp::from_microsecond(us).unwrap_or(if us < 0 { Timestamp::MIN } else { Timestamp::MAX }))
    }

    /// Microseconds since 1970-01-01T00:00:00Z.
    #[must_use]
    pub fn unix_us(self) -> i64 {
        self.0.as_microsecond()
    }
}

impl FromStr for FineTime {
    type Err = TimeError;

    fn from_str(text: &str) -> Result<Self, TimeError> {
        text.parse().map(Self).map_err(|_| TimeError::of(text))
    }
}

impl fmt::Display for FineTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.6}", self.0)
    }
}

impl Serialize for FineTime {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for FineTime {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(feature = "openapi")]
impl utoipa::PartialSchema for FineTime {
    fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::Schema> {
        crate::openapi::time(
            "An instant in UTC with microseconds; read from any offset and precision.",
            "2026-11-22T05:19:25.123456Z",
        )
    }
}

#[cfg(feature = "openapi")]
impl utoipa::ToSchema for FineTime {}

/// Why a pass begins or ends where it does.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PassEndWord {
    /// The satellite crosses the threshold or the horizon mask: the true AOS or LOS.
    Horizon,
    /// The window that was searched begins or ends while the satellite is up.
    Window,
    /// The elements have no state beyond: decayed, as a rule.
    NoState,
}

/// A satellite above a station, from AOS to LOS. Angles are geometric, without refraction. A Doppler shift is that of the
/// downlink, positive while the satellite approaches, and `null` when no frequency was given.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassView {
    /// Name of the satellite; without one its catalogue number or designator.
    pub satellite: String,
    /// Catalogue number; `null` when the elements have none.
    pub norad_cat_id: Option<u32>,
    /// Station.
    pub station: String,
    /// Acquisition of signal: where the pass begins.
    pub aos: FineTime,
    /// Time of the greatest elevation.
    pub tca: FineTime,
    /// Loss of signal: where the pass ends.
    pub los: FineTime,
    /// Seconds from AOS to LOS.
    pub duration_s: f64,
    /// Elevation at TCA.
    pub max_elevation_deg: f64,
    /// The pass does not begin at the horizon: `aos_cause` says why.
    pub aos_clipped: bool,
    /// The pass does not end at the horizon: `los_cause` says why.
    pub los_clipped: bool,
    /// Why it begins there.
    pub aos_cause: PassEndWord,
    /// Why it ends there.
    pub los_cause: PassEndWord,
    /// The true AOS of a pass that the window cuts; `null` when nothing cuts it, or the true one is further away than two
    /// revolutions or two days.
    pub true_aos: Option<FineTime>,
    /// The true LOS of a pass that the window cuts; `null` as for `true_aos`.
    pub true_los: Option<FineTime>,
    /// What the theory said where the elements have no state before AOS.
    pub aos_error: Option<String>,
    /// What the theory said where the elements have no state after LOS.
    pub los_error: Option<String>,
    /// Azimuth at AOS, from north through east.
    pub aos_azimuth_deg: f64,
    /// Azimuth at TCA.
    pub tca_azimuth_deg: f64,
    /// Azimuth at LOS.
    pub los_azimuth_deg: f64,
    /// Elevation at AOS.
    pub aos_elevation_deg: f64,
    /// Elevation at LOS.
    pub los_elevation_deg: f64,
    /// Distance at AOS.
    pub aos_range_km: f64,
    /// Distance at TCA.
    pub tca_range_km: f64,
    /// Distance at LOS.
    pub los_range_km: f64,
    /// How the distance changes at AOS: negative while approaching.
    pub aos_range_rate_km_s: f64,
    /// How the distance changes at TCA.
    pub tca_range_rate_km_s: f64,
    /// How the distance changes at LOS.
    pub los_range_rate_km_s: f64,
    /// The frequency of the Doppler shifts; `null` when none was given.
    pub frequency_hz: Option<f64>,
    /// Shift of the downlink at AOS.
    pub aos_doppler_hz: Option<f64>,
    /// Shift of the downlink at TCA.
    pub tca_doppler_hz: Option<f64>,
    /// Shift of the downlink at LOS.
    pub los_doppler_hz: Option<f64>,
    /// The satellite sees the whole Sun at AOS; `null` when the elements have no state there.
    pub aos_sunlit: Option<bool>,
    /// The satellite sees the whole Sun at TCA.
    pub tca_sunlit: Option<bool>,
    /// The satellite sees the whole Sun at LOS.
    pub los_sunlit: Option<bool>,
    /// At some moment of the pass the satellite is sunlit while the Sun is lower than 6 degrees below the horizon at the
    /// station.
    pub optically_visible: bool,
    /// Epoch of the elements.
    pub epoch: FineTime,
    /// How old the elements are at TCA, in days; negative before their epoch.
    pub age_days: f64,
}

/// A part of the window in which the elements have no state: nothing is known of passes there.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkyGapView {
    /// Satellite.
    pub satellite: String,
    /// Catalogue number.
    pub norad_cat_id: Option<u32>,
    /// First instant without a state.
    pub from: FineTime,
    /// The instant from which there are states again, or the end of the window.
    pub until: FineTime,
    /// What the theory said.
    pub error: String,
    /// The code of the reference implementation of SGP4: 1, 2, 3, 4 or 6.
    pub sgp4_code: Option<u8>,
}

/// The passes of a window of time, computed when they were asked for. Same words as `gs-server passes --json`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassList {
    /// Station.
    pub station: String,
    /// Where the window begins.
    pub start: FineTime,
    /// Where it ends.
    pub stop: FineTime,
    /// The elevation above which a pass is a pass; where the horizon mask is higher, the mask counts.
    pub min_elevation_deg: f64,
    /// The frequency of the Doppler shifts; `null` when none was given.
    pub frequency_hz: Option<f64>,
    /// UT1-UTC.
    pub ut1_minus_utc_s: f64,
    /// Where the station stands; `null` from a server that does not tell it yet.
    #[serde(default)]
    pub place: Option<PlaceView>,
    /// The passes, in order of AOS.
    pub passes: Vec<PassView>,
    /// Where the elements have no state.
    pub gaps: Vec<SkyGapView>,
    /// Satellites that were asked for and have no elements.
    pub without_elements: Vec<String>,
}

/// A place from which the sky is looked at.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceView {
    /// Geodetic latitude (WGS84), north positive.
    pub latitude_deg: f64,
    /// Longitude, east positive.
    pub longitude_deg: f64,
    /// Height above the ellipsoid.
    pub height_m: f64,
    /// What the horizon hides: pairs of azimuth and elevation, straight lines between them; empty for a free view.
    pub horizon_deg: Vec<[f64; 2]>,
}

/// Where satellites stand at instants, computed when it was asked for. Same words as `gs-server look --json`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LookList {
    /// The frequency of the Doppler shifts; `null` when none was given.
    pub frequency_hz: Option<f64>,
    /// UT1-UTC.
    pub ut1_minus_utc_s: f64,
    /// For each satellite every instant, in the order in which they were asked for.
    pub looks: Vec<LookView>,
    /// Satellites that were asked for and have no elements.
    pub without_elements: Vec<String>,
}

/// A pass that began, as it is kept, with the elements it used.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassKept {
    /// Its number in the archive.
    pub id: u64,
    /// Satellite.
    pub satellite: String,
    /// Station.
    pub station: String,
    /// Acquisition of signal, as the last elements told it.
    pub aos: FineTime,
    /// Time of the greatest elevation.
    pub tca: FineTime,
    /// Loss of signal; `null` for an object that does not set.
    pub los: Option<FineTime>,
    /// Elevation at TCA.
    pub max_elevation_deg: f64,
    /// When it ended; `null` while it lasts.
    pub ended_at: Option<FineTime>,
    /// The elements it used, in order of time.
    pub elements: Vec<ElementsUsed>,
}

/// Elements that a pass used.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ElementsUsed {
    /// Their number in the archive; `/elements` tells them.
    pub id: u64,
    /// Since when the pass went by them.
    pub from: FineTime,
    /// Their epoch.
    pub epoch: FineTime,
}

/// Where a satellite stands at an instant, seen from a station. Where the elements have no state, `error` says why and
/// every value is `null`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LookView {
    /// Name of the satellite.
    pub satellite: String,
    /// Catalogue number.
    pub norad_cat_id: Option<u32>,
    /// Station.
    pub station: String,
    /// The instant.
    pub at: FineTime,
    /// From north through east.
    pub azimuth_deg: Option<f64>,
    /// Above the horizontal plane, geometric; negative below.
    pub elevation_deg: Option<f64>,
    /// How the azimuth changes.
    pub azimuth_rate_deg_s: Option<f64>,
    /// How the elevation changes.
    pub elevation_rate_deg_s: Option<f64>,
    /// Distance.
    pub range_km: Option<f64>,
    /// How the distance changes: negative while approaching.
    pub range_rate_km_s: Option<f64>,
    /// The frequency of the next three; `null` when none was given.
    pub frequency_hz: Option<f64>,
    /// How far above the frequency the downlink is heard.
    pub doppler_hz: Option<f64>,
    /// Where the downlink is heard.
    pub received_hz: Option<f64>,
    /// What to send so that it arrives at the satellite at the frequency.
    pub uplink_hz: Option<f64>,
    /// Geodetic latitude of the place straight below (WGS84).
    pub latitude_deg: Option<f64>,
    /// Longitude of that place, -180 to 180, east positive.
    pub longitude_deg: Option<f64>,
    /// Height above the ellipsoid.
    pub height_km: Option<f64>,
    /// `sunlit`, `penumbra`, `umbra`, or `annular` (far away, the Earth stands within the Sun's disc).
    pub eclipse: Option<String>,
    /// Uncovered part of the Sun's disc: 1 sunlit, 0 umbra.
    pub sun_fraction: Option<f64>,
    /// Epoch of the elements.
    pub epoch: FineTime,
    /// How old the elements are at the instant, in days; negative before their epoch.
    pub age_days: f64,
    /// Why there is no state.
    pub error: Option<String>,
}

/// A set of elements of a list or file that could not be used.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RefusedElements {
    /// The file or address it stands in.
    pub source: String,
    /// The line, counted from 1.
    pub line: u64,
    /// Name or number, when it could be read.
    pub object: Option<String>,
    /// What is wrong with it.
    pub error: String,
}

/// A set of mean elements, as a published OMM or TLE has them.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ElementsView {
    /// Name of the object.
    pub satellite: String,
    /// Catalogue number.
    pub norad_cat_id: Option<u32>,
    /// International designator with the full year, `1998-067A`.
    pub object_id: Option<String>,
    /// Epoch.
    pub epoch: FineTime,
    /// Mean motion by Kozai's definition.
    pub mean_motion_rev_day: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Inclination.
    pub inclination_deg: f64,
    /// Right ascension of the ascending node.
    pub raan_deg: f64,
    /// Argument of perigee.
    pub arg_of_perigee_deg: f64,
    /// Mean anomaly.
    pub mean_anomaly_deg: f64,
    /// Drag term, 1/Earth radii.
    pub bstar: f64,
    /// Counted by the publisher.
    pub element_set_no: Option<u32>,
    /// Revolutions since launch.
    pub rev_at_epoch: Option<u32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fine_time_has_six_decimals_and_z_and_reads_back() {
        let time = FineTime::from_unix_us(1_795_324_765_123_456);
        assert_eq!(time.to_string(), "2026-11-22T05:19:25.123456Z");
        assert_eq!(time.to_string().parse::<FineTime>().unwrap(), time);
        assert!("tomorrow".parse::<FineTime>().unwrap_err().to_string().contains("RFC 3339"));
    }
}
