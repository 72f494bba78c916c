//! The search over one satellite and its stations.

use crate::elements::Elements;
use crate::look::LookAngles;
use crate::propagator::{ElementsError, PropagationError, Propagator};
use crate::station::Station;
use crate::time::UtcInstant;
use crate::vector::dot;

use super::grid::{Block, Grid, OrbitShape, Reach};
use super::horizon;
use super::motion::{Lanes, Motion};
use super::pass::{EndCause, GAPS_MAX, Gap, Pass, PassEnd, PassPoint, SatellitePasses};
use super::refine::{Place, sine_elevation};
use super::request::{PassSearch, SearchError};
use super::scan::Scan;
use super::settle::settle;
use super::sky::Sky;

/// How far outside the window the true ends of clipped passes are looked for: at most so many seconds, and revolutions.
const BEYOND_MAX_S: f64 = 2.0 * 86_400.0;
const BEYOND_REVOLUTIONS: f64 = 2.0;

/// A satellite made ready for pass searches.
#[derive(Debug, Clone)]
pub struct PassFinder {
    propagator: Propagator,
    lanes: Option<Lanes>,
    mean_anomaly_rad: f64,
}

/// The end of a pass with its state, before it is written in instants and angles.
#[derive(Debug, Clone, Copy)]
pub(super) struct RawEnd {
    pub(super) place: Place,
    pub(super) cause: EndCause,
}

/// A pass with its states.
#[derive(Debug, Clone)]
pub(super) struct RawPass {
    pub(super) rise: RawEnd,
    pub(super) fall: RawEnd,
    /// In order of time; may be empty.
    pub(super) summits: Vec<Place>,
}

/// Passes per station, and the gaps, in seconds since the window began.
struct Raw {
    stations: Vec<Vec<RawPass>>,
    gaps: Vec<(f64, f64, PropagationError)>,
}

impl PassFinder {
    /// Makes a satellite ready.
    ///
    /// # Errors
    /// Elements that describe no orbit.
    pub fn new(elements: &Elements) -> Result<Self, ElementsError> {
        Ok(Self {
            propagator: Propagator::new(elements)?,
            lanes: Lanes::new(elements),
            mean_anomaly_rad: elements.mean_anomaly_deg.to_radians(),
        })
    }

    /// The satellite's theory.
    #[must_use]
    pub const fn propagator(&self) -> &Propagator {
        &self.propagator
    }

    /// All passes over the stations in the window.
    ///
    /// # Errors
    /// A window or threshold that cannot be searched. Times at which the elements have no state are no error: they come back
    /// as [`SatellitePasses::gaps`], and cut the passes beside them.
    pub fn find(&self, stations: &[Station], search: &PassSearch) -> Result<SatellitePasses, SearchError> {
        search.check()?;
        let mut motion = Motion::new(&self.propagator, self.lanes.as_ref(), search.start, search.orientation);
        let places: Vec<&Station> = stations.iter().collect();
        let window_s = search.stop.seconds_since(search.start);
        let mut raw = self.run(&places, search.min_elevation_deg, &mut motion, 0.0, window_s);
        if search.beyond_window {
            self.look_beyond(&places, search, &mut motion, window_s, &mut raw);
        }
        let instant = |t_s: f64| search.start.plus_seconds(t_s);
        let gap = |&(from_s, until_s, fault): &(f64, f64, PropagationError)| Gap {
            from: instant(from_s),
            until: instant(until_s),
            fault,
        };
        Ok(SatellitePasses {
            stations: raw
                .stations
                .iter()
                .zip(stations)
                .map(|(passes, station)| {
                    passes.iter().map(|pass| told(pass, station, search.start)).collect()
                })
                .collect(),
            gaps: raw.gaps.iter().map(gap).collect(),
            sgp4_calls: motion.calls,
        })
    }

    /// The search from one second of the window's clock to another.
    fn run(
        &self,
        stations: &[&Station],
        min_elevation_deg: f64,
        motion: &mut Motion<'_>,
        start_s: f64,
        stop_s: f64,
    ) -> Raw {
        let thresholds: Vec<f64> =
            stations.iter().map(|station| horizon::lowest_deg(station, min_elevation_deg)).collect();
        let mut scans: Vec<Scan<'_>> = stations
            .iter()
            .zip(&thresholds)
            .map(|(station, &threshold)| Scan::new(Sky::new(station.axes(), threshold)))
            .collect();
        let lowest = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
        let reach = Reach {
            lowest_threshold_rad: lowest(&mut thresholds.iter().copied()).min(90.0).to_radians(),
            lowest_station_km: lowest(
                &mut stations.iter().map(|station| dot(station.axes().r_ecef_km, station.axes().up)),
            )
            .min(6400.0),
        };
        let since_epoch_s = motion.origin_since_epoch_s() + start_s;
        let rate = std::f64::consts::TAU / (self.propagator.period_min() * 60.0);
        let shape = OrbitShape {
            period_min: self.propagator.period_min(),
            eccentricity: self.propagator.eccentricity(),
            mean_anomaly_rad: self.mean_anomaly_rad + rate * since_epoch_s,
        };
        let mut grid = Grid::new(shape, reach, start_s, stop_s);
        let mut block = Block::default();
        let mut gaps = Gaps { open_since_s: start_s, found: Vec::new() };
        let mut first = true;
        while grid.next(motion, &mut block) {
            gaps.take_in(&block);
            for scan in &mut scans {
                scan.block(&mut block, motion, first);
            }
            first = false;
        }
        if let Some(fault) = block.closes_into {
            gaps.push(stop_s, fault);
        }
        let stations = scans
            .into_iter()
            .zip(stations)
            .map(|(mut scan, station)| {
                scan.finish(stop_s);
                let sky = *scan.sky();
                let passes = settle(&sky, motion, &scan.drafts, start_s, stop_s);
                horizon::cut(station, min_elevation_deg, motion, passes)
            })
            .collect();
        Raw { stations, gaps: gaps.found }
    }

    /// Finds the true ends of the passes that the window cuts.
    fn look_beyond(
        &self,
        stations: &[&Station],
        search: &PassSearch,
        motion: &mut Motion<'_>,
        window_s: f64,
        raw: &mut Raw,
    ) {
        let span_s = (BEYOND_REVOLUTIONS * self.propagator.period_min() * 60.0).clamp(3600.0, BEYOND_MAX_S);
        let cut = |end: Option<&RawEnd>| end.is_some_and(|end| matches!(end.cause, EndCause::Window { .. }));
        let early: Vec<usize> = (0..stations.len())
            .filter(|&index| cut(raw.stations[index].first().map(|pass| &pass.rise)))
            .collect();
        if !early.is_empty() {
            let some: Vec<&Station> = early.iter().map(|&index| stations[index]).collect();
            let before = self.run(&some, search.min_elevation_deg, motion, -span_s, 0.0);
            for (&index, passes) in early.iter().zip(&before.stations) {
                let joined = passes.last().filter(|pass| cut(Some(&pass.fall)));
                if let (Some(before), Some(pass)) = (joined, raw.stations[index].first_mut()) {
                    pass.rise.cause = EndCause::Window { crossing: crossing(&before.rise, search.start) };
                }
            }
        }
        let late: Vec<usize> = (0..stations.len())
            .filter(|&index| cut(raw.stations[index].last().map(|pass| &pass.fall)))
            .collect();
        if !late.is_empty() {
            let some: Vec<&Station> = late.iter().map(|&index| stations[index]).collect();
            let after = self.run(&some, search.min_elevation_deg, motion, window_s, window_s + span_s);
            for (&index, passes) in late.iter().zip(&after.stations) {
                let joined = passes.first().filter(|pass| cut(Some(&pass.rise)));
                if let (Some(after), Some(pass)) = (joined, raw.stations[index].last_mut()) {
                    pass.fall.cause = EndCause::Window { crossing: crossing(&after.fall, search.start) };
                }
            }
        }
    }
}

/// The instant of an end outside the window, if the satellite crosses the threshold there.
fn crossing(end: &RawEnd, origin: UtcInstant) -> Option<UtcInstant> {
    (end.cause == EndCause::Horizon).then(|| origin.plus_seconds(end.place.t_s))
}

/// Collects the times without states from block to block.
struct Gaps {
    open_since_s: f64,
    found: Vec<(f64, f64, PropagationError)>,
}

impl Gaps {
    fn push(&mut self, until_s: f64, fault: PropagationError) {
        if self.found.len() < GAPS_MAX {
            self.found.push((self.open_since_s, until_s, fault));
        }
    }

    fn take_in(&mut self, block: &Block) {
        let (Some(first), Some(last)) = (block.nodes.first(), block.nodes.last()) else { return };
        if let Some(fault) = block.opens_after {
            self.push(first.t_s, fault);
        }
        for (pair, fault) in block.nodes.windows(2).zip(&block.faults) {
            if let Some(fault) = fault {
                self.open_since_s = pair[0].t_s;
                self.push(pair[1].t_s, *fault);
            }
        }
        self.open_since_s = last.t_s;
    }
}

/// Writes a pass in instants and angles.
fn told(pass: &RawPass, station: &Station, origin: UtcInstant) -> Pass {
    let point = |place: &Place| PassPoint {
        at: origin.plus_seconds(place.t_s),
        look: LookAngles::from_axes(station.axes(), &place.state),
    };
    let end = |end: &RawEnd| {
        let PassPoint { at, look } = point(&end.place);
        PassEnd { at, look, cause: end.cause }
    };
    // A clipped end may stand higher than every summit.
    let mut best =
        if pass.rise.place.t_s < pass.fall.place.t_s { &pass.rise.place } else { &pass.fall.place };
    let sky = Sky::new(station.axes(), 0.0);
    let mut height = sine_elevation(&sky, best.state.r_ecef_km);
    for place in pass.summits.iter().chain([&pass.fall.place]) {
        let here = sine_elevation(&sky, place.state.r_ecef_km);
        if here > height {
            (best, height) = (place, here);
        }
    }
    Pass {
        aos: end(&pass.rise),
        tca: point(best),
        los: end(&pass.fall),
        other_summits: pass.summits.iter().filter(|place| place.t_s != best.t_s).map(point).collect(),
    }
}
