//! A pass as points for a plot.

use tle::propagator::PropagationError;
use tle::shadow::{Light, light};
use tle::{EarthOrientation, Propagator, Station, UtcInstant, ecef_from_teme, gmst_rad};

/// Points of a path.
const PATH_POINTS: u32 = 240;
/// Time ticks that a path may have; beyond, they stand further apart.
const TICKS_MAX: i64 = 30;
const MINUTE_US: i64 = 60_000_000;

/// A place in the station's sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackPoint {
    /// When.
    pub at: UtcInstant,
    /// From north through east.
    pub azimuth_deg: f64,
    /// Geometric.
    pub elevation_deg: f64,
    /// Distance.
    pub range_km: f64,
    /// The satellite sees the whole Sun.
    pub sunlit: bool,
}

impl TrackPoint {
    /// Where the satellite stands at an instant.
    ///
    /// # Errors
    /// No state there.
    pub fn at(
        propagator: &Propagator,
        station: &Station,
        orientation: EarthOrientation,
        at: UtcInstant,
    ) -> Result<Self, PropagationError> {
        let state = propagator.at(at)?;
        let look = station.look(&ecef_from_teme(&state, gmst_rad(at, orientation)));
        Ok(Self {
            at,
            azimuth_deg: look.azimuth_deg,
            elevation_deg: look.elevation_deg,
            range_km: look.range_km,
            sunlit: light(state.r_teme_km, at) == Light::Sunlit,
        })
    }
}

/// The way of a satellite across a station's sky.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyTrack {
    /// From AOS to LOS.
    pub path: Vec<TrackPoint>,
    /// At every full minute; on long passes every 5, 10, 30, 60 ... minutes.
    pub ticks: Vec<TrackPoint>,
    /// Where the pass begins.
    pub aos: TrackPoint,
    /// Greatest elevation.
    pub tca: TrackPoint,
    /// Where the pass ends.
    pub los: TrackPoint,
}

impl SkyTrack {
    /// The way between AOS and LOS.
    ///
    /// # Errors
    /// Elements without a state at TCA: they are not those of the pass.
    pub fn new(
        propagator: &Propagator,
        station: &Station,
        orientation: EarthOrientation,
        (aos, tca, los): (UtcInstant, UtcInstant, UtcInstant),
    ) -> Result<Self, PropagationError> {
        let point = |at: UtcInstant| TrackPoint::at(propagator, station, orientation, at);
        let duration_s = los.seconds_since(aos);
        // A pass that ends where the elements end may have no state at its very last moment.
        let path: Vec<TrackPoint> = (0..=PATH_POINTS)
            .map(|step| aos.plus_seconds(duration_s * f64::from(step) / f64::from(PATH_POINTS)))
            .filter_map(|at| point(at).ok())
            .collect();
        let tca = point(tca)?;
        let tick_us = MINUTE_US
            * [1, 2, 5, 10, 30, 60, 120, 360, 720]
                .into_iter()
                .find(|minutes| los.us_since(aos) / (minutes * MINUTE_US) <= TICKS_MAX)
                .unwrap_or(1440 * (1 + los.us_since(aos) / (1440 * MINUTE_US * TICKS_MAX)));
        let first = aos.unix_us().div_euclid(tick_us) + 1;
        let ticks = (first..=los.unix_us().div_euclid(tick_us))
            .filter_map(|tick| point(UtcInstant::from_unix_us(tick * tick_us)).ok())
            .collect();
        let aos = path.first().copied().unwrap_or(tca);
        let los = path.last().copied().unwrap_or(tca);
        Ok(Self { path, ticks, aos, tca, los })
    }
}
