//! Where the satellite stood, by the elements that the pass used.

use std::sync::Arc;

use api::{NextPass, PathPoint, Time};
use mission::sky::{best_set, passes_of};
use mission::{ElementSet, PassAhead, Site, UtcUs};
use tle::{Elements, Propagator, UtcInstant};

use crate::sky::TrackPoint;

/// Points of the way from AOS to LOS.
const PATH_POINTS: i64 = 120;
/// How far ahead the next pass is sought.
const AHEAD_US: i64 = 2 * 86_400_000_000;

/// What a pass used: sets, each in force from an instant on, in order of time.
pub(super) struct Orbit<'a> {
    site: &'a Site,
    sets: Vec<(i64, Propagator)>,
}

impl<'a> Orbit<'a> {
    /// Sets that describe no orbit are left out: nothing can have been followed by them.
    pub(super) fn new(site: &'a Site, used: &[(i64, Elements)]) -> Option<Self> {
        let sets: Vec<_> =
            used.iter().filter_map(|(from_us, set)| Some((*from_us, Propagator::new(set).ok()?))).collect();
        (!sets.is_empty()).then_some(Self { site, sets })
    }

    fn at(&self, us: i64) -> Option<TrackPoint> {
        let in_force = self.sets.iter().rev().find(|(from_us, _)| *from_us <= us);
        let (_, propagator) = in_force.or_else(|| self.sets.first())?;
        let instant = UtcInstant::from_unix_us(us);
        TrackPoint::at(propagator, &self.site.place, self.site.orientation, instant).ok()
    }

    /// How high it stood, degrees, to a hundredth.
    pub(super) fn elevation_deg(&self, us: i64) -> Option<f64> {
        self.at(us).map(|point| rounded(point.elevation_deg, 100.0))
    }

    /// Its way between two instants.
    pub(super) fn path(&self, (aos_us, los_us): (i64, i64)) -> Vec<PathPoint> {
        (0..=PATH_POINTS)
            .filter_map(|step| {
                let us =
                    aos_us.saturating_add(los_us.saturating_sub(aos_us).saturating_mul(step) / PATH_POINTS);
                let point = self.at(us)?;
                Some(PathPoint {
                    at: Time::from_unix_us(us),
                    elevation_deg: rounded(point.elevation_deg, 100.0),
                    azimuth_deg: rounded(point.azimuth_deg, 100.0),
                    range_km: rounded(point.range_km, 10.0),
                })
            })
            .collect()
    }
}

/// The passes of the two days after an instant.
pub(super) fn passes_ahead(site: &Site, sets: &[ElementSet], after_us: i64) -> Vec<PassAhead> {
    let after = UtcUs(after_us);
    let Some(set) = best_set(sets, after) else { return Vec::new() };
    let found = passes_of(set, site, after, after.plus(AHEAD_US));
    found.unwrap_or_default().into_iter().filter(|pass| pass.aos_at >= after).collect()
}

pub(super) fn next_pass(pass: &PassAhead) -> NextPass {
    let time = |at: UtcUs| Time::from_unix_us(at.0);
    NextPass {
        aos: time(pass.aos_at),
        tca: time(pass.tca_at),
        los: pass.los_at.map(time),
        max_elevation_deg: rounded(pass.max_elevation_deg, 100.0),
        azimuths_deg: pass.azimuths_deg.map(|azimuth| rounded(azimuth, 100.0)),
        elements: pass.elements.0,
    }
}

/// Sets with their numbers, for what seeks among them.
pub(super) fn numbered(id: u64, elements: Elements) -> ElementSet {
    ElementSet { id: mission::ElementsId(id), elements: Arc::new(elements) }
}

/// More digits than these are noise, and differ from machine to machine.
pub(super) fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit + 0.0
}
