//! Where the satellite is, computed here from the elements that the station goes by: a window that asks the server for
//! each frame would stutter with the line.
//!
//! [`Orbits`] is made anew when elements or passes were told anew, and asked by the panes. What it cannot tell it says
//! why ([`NoOrbit`]).

use std::collections::BTreeMap;

use api::{ElementsView, PassView};
use jiff::Timestamp;
use tle::{
    EarthFixed, EarthOrientation, Elements, Geodetic, HorizonMask, LookAngles, Propagator, Station,
    UtcInstant,
};
use ui::geo::Place;
use ui::map::TrackPoint;
use ui::sky::{Direction, SkySample};

use crate::model::Model;

/// Points of a footprint's edge.
const FOOTPRINT_POINTS: usize = 90;
/// A pass has no more samples, whatever its length.
const SAMPLES_MAX: i64 = 2_000;

/// Why nothing can be said about where a satellite is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoOrbit {
    /// The server was not asked yet.
    NotAsked,
    /// The archive holds no elements of it.
    NoElements,
    /// The elements describe no orbit: why.
    Unusable(String),
}

impl std::fmt::Display for NoOrbit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotAsked => f.write_str("Waiting for the elements"),
            Self::NoElements => f.write_str("No elements of this satellite: add some on the pane Elements"),
            Self::Unusable(why) => write!(f, "The elements in use describe no orbit: {why}"),
        }
    }
}

/// One satellite's way, from the elements in use.
#[derive(Debug, Clone)]
pub struct Orbit {
    propagator: Propagator,
    orientation: EarthOrientation,
    period_s: f64,
    /// Number of the elements in the archive.
    pub elements: u64,
}

/// All satellites' ways, and where the station stands.
#[derive(Debug, Default)]
pub struct Orbits {
    made_of: Option<(u64, u64)>,
    orbits: BTreeMap<String, Result<Orbit, NoOrbit>>,
    station: Option<Station>,
    horizon: Vec<(f64, f64)>,
    orientation: EarthOrientation,
    /// Rises with each change.
    revision: u64,
}

impl Orbits {
    /// Looks whether there is something new.
    pub fn renew(&mut self, model: &Model) {
        let made_of = (model.elements.revision(), model.passes.revision());
        if self.made_of == Some(made_of) {
            return;
        }
        self.made_of = Some(made_of);
        self.revision += 1;
        if let Some(list) = model.passes.value() {
            self.orientation = EarthOrientation::new(list.ut1_minus_utc_s).unwrap_or_default();
            if let Some(place) = &list.place {
                self.horizon = place.horizon_deg.iter().map(|&[azimuth, up]| (azimuth, up)).collect();
                let mask = HorizonMask::from_table(&self.horizon).unwrap_or(HorizonMask::OPEN);
                let station = Station::new(place.latitude_deg, place.longitude_deg, place.height_m);
                self.station = station.ok().map(|station| station.with_mask(mask));
            }
        }
        let Some(page) = model.elements.value() else { return };
        self.orbits.clear();
        for held in page.items.iter().filter(|held| held.in_use) {
            let propagator = Propagator::new(&elements(&held.elements));
            let orbit =
                propagator.map_err(|error| NoOrbit::Unusable(error.to_string())).map(|propagator| Orbit {
                    propagator,
                    orientation: self.orientation,
                    period_s: 86_400.0 / held.elements.mean_motion_rev_day.max(0.01),
                    elements: held.id,
                });
            self.orbits.insert(held.satellite.clone(), orbit);
        }
    }

    /// Rises whenever an answer of this may have changed.
    #[must_use]
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The way of this satellite.
    ///
    /// # Errors
    /// [`NoOrbit`]: why there is none.
    pub fn of(&self, model: &Model, satellite: &str) -> Result<&Orbit, NoOrbit> {
        match self.orbits.get(satellite) {
            Some(Ok(orbit)) => Ok(orbit),
            Some(Err(why)) => Err(why.clone()),
            None if model.elements.value().is_none() => Err(NoOrbit::NotAsked),
            None => Err(NoOrbit::NoElements),
        }
    }

    /// Where the station stands; `None` when it does not know or was not asked yet.
    #[must_use]
    pub fn station(&self) -> Option<&Station> {
        self.station.as_ref()
    }

    /// The horizon there, azimuth and elevation in degrees.
    #[must_use]
    pub fn horizon(&self) -> &[(f64, f64)] {
        &self.horizon
    }

    /// The Sun in the station's sky.
    #[must_use]
    pub fn sun(&self, at_us: i64) -> Option<Direction> {
        let at = UtcInstant::from_unix_us(at_us);
        let gmst = tle::frames::gmst_rad(at, self.orientation);
        let r_ecef_km = tle::frames::turn_z(gmst, tle::sun::sun_teme_km(at));
        let look = self.station.as_ref()?.look(&EarthFixed { r_ecef_km, v_ecef_km_s: [0.0; 3] });
        Some(Direction::new(look.azimuth_deg, look.elevation_deg))
    }
}

impl Orbit {
    /// Where it is over the turning Earth; `None` where the elements have no state.
    fn fixed(&self, at_us: i64) -> Option<EarthFixed> {
        let at = UtcInstant::from_unix_us(at_us);
        let state = self.propagator.at(at).ok()?;
        Some(tle::frames::ecef_from_teme(&state, tle::frames::gmst_rad(at, self.orientation)))
    }

    /// Where it stands in a station's sky.
    #[must_use]
    pub fn look(&self, station: &Station, at_us: i64) -> Option<LookAngles> {
        Some(station.look(&self.fixed(at_us)?))
    }

    /// The place below it, and its height in km.
    #[must_use]
    pub fn below(&self, at_us: i64) -> Option<(Place, f64)> {
        let below = tle::ground::subpoint(&self.fixed(at_us)?);
        Some((place_of(below), below.height_km))
    }

    /// Who sees it at 0°: the edge of that circle.
    #[must_use]
    pub fn footprint(&self, at_us: i64) -> Vec<Place> {
        let Some(fixed) = self.fixed(at_us) else { return Vec::new() };
        let edge = tle::ground::footprint(&fixed, 0.0, FOOTPRINT_POINTS);
        edge.into_iter().map(|(east, north)| Place::new(east.to_degrees(), north.to_degrees())).collect()
    }

    /// The places below it from one instant to another.
    #[must_use]
    pub fn track(&self, from_us: i64, until_us: i64, step_us: i64) -> Vec<TrackPoint> {
        let instants = instants(from_us, until_us, step_us);
        let point = |at_us| Some(TrackPoint { at: timestamp(at_us), place: self.below(at_us)?.0 });
        instants.filter_map(point).collect()
    }

    /// Its way through a station's sky, every so often from one instant to another.
    pub fn looks(
        &self,
        station: &Station,
        from_us: i64,
        until_us: i64,
        step_us: i64,
    ) -> impl Iterator<Item = (i64, LookAngles)> {
        let instants = instants(from_us, until_us, step_us);
        instants.filter_map(move |at_us| Some((at_us, self.look(station, at_us)?)))
    }

    /// The same for a sky plot.
    #[must_use]
    pub fn path(&self, station: &Station, from_us: i64, until_us: i64) -> Vec<SkySample> {
        let sample = |(at_us, look): (i64, LookAngles)| {
            let direction = Direction::new(look.azimuth_deg, look.elevation_deg);
            SkySample { at: timestamp(at_us), direction }
        };
        self.looks(station, from_us, until_us, 10_000_000).map(sample).collect()
    }

    /// One revolution, microseconds.
    #[must_use]
    pub fn period_us(&self) -> i64 {
        (self.period_s * 1e6) as i64
    }
}

/// Both ends, and every so often between them; a long span gets a longer step.
fn instants(from_us: i64, until_us: i64, step_us: i64) -> impl Iterator<Item = i64> {
    let span_us = until_us.saturating_sub(from_us).max(0);
    let step_us = step_us.max(span_us / SAMPLES_MAX).max(1);
    let whole = span_us / step_us;
    let last = (span_us % step_us != 0).then_some(until_us);
    (0..=whole).map(move |step| from_us + step * step_us).chain(last)
}

fn place_of(below: Geodetic) -> Place {
    Place::new(below.longitude_rad.to_degrees(), below.latitude_rad.to_degrees())
}

/// The place on the Earth over which the Sun stands.
#[must_use]
pub fn subsolar(at_us: i64) -> Place {
    let at = UtcInstant::from_unix_us(at_us);
    let gmst = tle::frames::gmst_rad(at, EarthOrientation::UT1_IS_UTC);
    let [x, y, z] = tle::frames::turn_z(gmst, tle::sun::sun_teme_km(at));
    Place::new(y.atan2(x).to_degrees(), z.atan2(x.hypot(y)).to_degrees())
}

/// The instant as the widgets take it.
#[must_use]
pub fn timestamp(at_us: i64) -> Timestamp {
    Timestamp::from_microsecond(at_us).unwrap_or(if at_us < 0 { Timestamp::MIN } else { Timestamp::MAX })
}

/// A pass from its true begin to its true end, in microseconds since 1970.
#[must_use]
pub fn span_us(pass: &PassView) -> (i64, i64) {
    (pass.true_aos.unwrap_or(pass.aos).unix_us(), pass.true_los.unwrap_or(pass.los).unix_us())
}

/// The pass that lasts, or else the next one.
#[must_use]
pub fn current_pass<'a>(model: &'a Model, satellite: &str, now_us: i64) -> Option<&'a PassView> {
    let list = model.passes.value()?;
    let of_it = list.passes.iter().filter(|pass| pass.satellite == satellite);
    of_it.filter(|pass| span_us(pass).1 > now_us).min_by_key(|pass| pass.aos)
}

/// As the publisher had them. What the view leaves out SGP4 does not use.
fn elements(view: &ElementsView) -> Elements {
    Elements {
        name: Some(view.satellite.clone()),
        object_id: view.object_id.clone(),
        norad_cat_id: view.norad_cat_id,
        epoch: UtcInstant::from_unix_us(view.epoch.unix_us()),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_stands_over_the_tropic_at_the_solstice_and_over_greenwich_at_noon() {
        let at: Timestamp = "2026-06-21T12:00:00Z".parse().unwrap();
        let below = subsolar(at.as_microsecond());
        assert!((below.latitude_deg - 23.44).abs() < 0.02, "{below:?}");
        // The equation of time is about two minutes then.
        assert!(below.longitude_deg.abs() < 1.0, "{below:?}");
    }

    #[test]
    fn a_span_has_both_its_ends_and_is_never_endless() {
        assert_eq!(instants(0, 25, 10).collect::<Vec<_>>(), [0, 10, 20, 25]);
        assert_eq!(instants(0, 20, 10).collect::<Vec<_>>(), [0, 10, 20]);
        assert_eq!(instants(5, 5, 10).collect::<Vec<_>>(), [5]);
        assert!(instants(0, 1_000_000_000_000, 1).count() as i64 <= SAMPLES_MAX + 2);
    }
}
