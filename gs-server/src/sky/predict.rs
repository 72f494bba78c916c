//! Passes of a catalogue over places, on all cores.
//!
//! An object with several sets is predicted with the one that was the newest at the time: the window is split at every
//! epoch inside it. A pass belongs to the set in force at its AOS and is computed to its end with that set, so a new
//! epoch during a pass neither cuts it nor shows it twice.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use api::{PassView, SkyGapView};
use rayon::prelude::*;
use tle::passes::{EndCause, Gap, Pass, PassFinder, PassSearch, SatellitePasses, SearchError};
use tle::propagator::ElementsError;
use tle::{Elements, Station, UtcInstant};

use super::row::{Seen, fine_time};
use super::{Object, Place};

/// Passes that one prediction may have: half a gigabyte of them.
pub const PASSES_MAX: usize = 1_000_000;

/// Passes, and where nothing is known of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Prediction {
    /// The passes, in order of their AOS.
    pub passes: Vec<PassView>,
    /// Where elements had no state.
    pub gaps: Vec<SkyGapView>,
}

/// A prediction that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PredictError {
    /// The window or threshold cannot be searched.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// Elements that describe no orbit.
    #[error("{object}: {error}")]
    Elements {
        /// The object.
        object: String,
        /// What is wrong with its elements.
        error: ElementsError,
    },
    /// More than [`PASSES_MAX`].
    #[error(
        "there are more than {PASSES_MAX} passes: choose a shorter window, fewer satellites or stations, or a higher least \
         elevation"
    )]
    TooMany,
}

/// All passes of the objects over the places. `progress` hears from several threads how many objects are done, and ends
/// the job by [`ControlFlow::Break`].
///
/// # Errors
/// A window or threshold that cannot be searched, too many passes, and [`SearchError::Stopped`].
pub fn predict(
    objects: &[Object],
    places: &[Place],
    search: &PassSearch,
    frequency_hz: Option<f64>,
    progress: impl Fn(usize) -> ControlFlow<()> + Sync,
) -> Result<Prediction, PredictError> {
    let stations: Vec<Station> = places.iter().map(|place| place.station.clone()).collect();
    let (done, count, stopped) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    let predicted = objects
        .par_iter()
        .map(|object| {
            if stopped.load(Ordering::Relaxed) {
                let done = done.load(Ordering::Relaxed);
                return Err(SearchError::Stopped { done, total: objects.len() }.into());
            }
            let found = of_object(object, places, &stations, search, frequency_hz)?;
            if count.fetch_add(found.passes.len(), Ordering::Relaxed) + found.passes.len() > PASSES_MAX {
                stopped.store(true, Ordering::Relaxed);
                return Err(PredictError::TooMany);
            }
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if progress(done).is_break() {
                stopped.store(true, Ordering::Relaxed);
            }
            Ok(found)
        })
        .collect::<Result<Vec<Prediction>, PredictError>>();
    if count.load(Ordering::Relaxed) > PASSES_MAX {
        return Err(PredictError::TooMany);
    }
    let mut all = Prediction::default();
    for found in predicted? {
        all.passes.extend(found.passes);
        all.gaps.extend(found.gaps);
    }
    all.passes.sort_by_key(|pass| pass.aos);
    Ok(all)
}

/// A part of the window with the set in force in it.
struct Part<'a> {
    elements: &'a Elements,
    from: UtcInstant,
    until: UtcInstant,
}

fn parts<'a>(object: &'a Object, search: &PassSearch) -> Vec<Part<'a>> {
    let mut parts =
        vec![Part { elements: object.set_for(search.start), from: search.start, until: search.stop }];
    for set in object.sets() {
        let inside = search.start < set.epoch && set.epoch < search.stop;
        let newer = object.set_for(set.epoch);
        if let Some(last) = parts.last_mut().filter(|last| inside && last.elements != newer) {
            last.until = set.epoch;
            parts.push(Part { elements: newer, from: set.epoch, until: search.stop });
        }
    }
    parts
}

fn of_object(
    object: &Object,
    places: &[Place],
    stations: &[Station],
    search: &PassSearch,
    frequency_hz: Option<f64>,
) -> Result<Prediction, PredictError> {
    let mut found = Prediction::default();
    let mut last_los: Vec<Option<UtcInstant>> = vec![None; places.len()];
    for part in parts(object, search) {
        let finder = PassFinder::new(part.elements)
            .map_err(|error| PredictError::Elements { object: object.label(), error })?;
        let passes = search_part(&finder, &part, stations, search)?;
        for ((place, last_los), passes) in places.iter().zip(&mut last_los).zip(&passes.stations) {
            let seen = Seen {
                object,
                elements: part.elements,
                propagator: finder.propagator(),
                place,
                orientation: search.orientation,
                frequency_hz,
            };
            let first = part.from == search.start;
            let last = part.until == search.stop;
            for pass in passes {
                let before = !first && pass.los.at <= part.from;
                let after = !last && pass.aos.at >= part.until;
                let same_as_last = last_los.is_some_and(|los| pass.aos.at < los);
                if !before && !after && !same_as_last {
                    *last_los = Some(pass.los.at);
                    found.passes.push(seen.pass(pass));
                }
            }
        }
        for gap in &passes.gaps {
            found.gaps.extend(gap_view(object, gap, &part));
        }
        if found.passes.len() > PASSES_MAX {
            return Err(PredictError::TooMany);
        }
    }
    Ok(found)
}

/// Searches a part, and beyond its inner ends as far as passes may reach that begin or end in it.
fn search_part(
    finder: &PassFinder,
    part: &Part<'_>,
    stations: &[Station],
    search: &PassSearch,
) -> Result<SatellitePasses, SearchError> {
    let margin_s = (finder.propagator().period_min() * 60.0).clamp(600.0, 2.0 * 86_400.0);
    let start = part.from.plus_seconds(-margin_s).max(search.start);
    let stop = part.until.plus_seconds(margin_s).min(search.stop);
    let found = finder.find(stations, &PassSearch { start, stop, ..*search })?;
    let is_cut = |pass: &Pass| {
        pass.aos.at < part.until && pass.los.at == stop && matches!(pass.los.cause, EndCause::Window { .. })
    };
    if stop < search.stop && found.stations.iter().flatten().any(is_cut) {
        // It stays up for longer than a revolution, as a geostationary satellite does.
        return finder.find(stations, &PassSearch { start, ..*search });
    }
    Ok(found)
}

fn gap_view(object: &Object, gap: &Gap, part: &Part<'_>) -> Option<SkyGapView> {
    let (from, until) = (gap.from.max(part.from), gap.until.min(part.until));
    (from < until).then(|| SkyGapView {
        satellite: object.label(),
        norad_cat_id: object.norad_cat_id(),
        from: fine_time(from),
        until: fine_time(until),
        error: gap.fault.to_string(),
        sgp4_code: gap.fault.code(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::Catalogue;
    use tle::formats::Checksums;

    const ISS: &str = "ISS (ZARYA)\n\
        1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
        2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";

    fn iss() -> Object {
        let mut catalogue = Catalogue::default();
        catalogue.read("test", ISS.as_bytes(), Checksums::Strict).unwrap();
        catalogue.objects.remove(0)
    }

    fn lausanne() -> Place {
        "Lausanne=46.5191,6.5668,410".parse().unwrap()
    }

    fn passes(object: &Object) -> Vec<PassView> {
        let start: UtcInstant = "2020-07-13T00:00:00Z".parse().unwrap();
        let search = PassSearch::new(start, start.plus_seconds(2.0 * 86_400.0), 0.0);
        predict(std::slice::from_ref(object), &[lausanne()], &search, Some(437e6), |_| {
            ControlFlow::Continue(())
        })
        .unwrap()
        .passes
    }

    #[test]
    fn epoch_during_a_pass_neither_cuts_nor_repeats_it() {
        let one = iss();
        let alone = passes(&one);
        assert!(alone.len() > 8);
        for (pass, offset_s) in alone.iter().flat_map(|pass| [-1.0, 1.0, 100.0].map(|offset| (pass, offset)))
        {
            // The same orbit, told at an epoch within the pass: what SGP4 says there, as mean elements a revolution later,
            // differs; so the same set is told again with another number, at its own epoch moved by nothing but the label.
            let mut newer = one.sets()[0].clone();
            let epoch = UtcInstant::from_unix_us(pass.aos.unix_us()).plus_seconds(offset_s);
            let revolutions = newer.mean_motion_rev_day * epoch.seconds_since(newer.epoch) / 86_400.0;
            newer.mean_anomaly_deg = (newer.mean_anomaly_deg + 360.0 * revolutions).rem_euclid(360.0);
            newer.epoch = epoch;
            let mut catalogue = Catalogue { objects: vec![one.clone()], ..Catalogue::default() };
            let text = tle::formats::write(tle::formats::Form::OmmJson, &[newer]).unwrap();
            catalogue.read("newer", text.as_bytes(), Checksums::Strict).unwrap();
            assert_eq!(catalogue.objects.len(), 1);
            let both = passes(&catalogue.objects[0]);
            let near: Vec<_> =
                both.iter().filter(|other| other.aos < pass.los && pass.aos < other.los).collect();
            assert_eq!(near.len(), 1, "{offset_s}: {near:#?}");
            assert!(!near[0].aos_clipped && !near[0].los_clipped);
            assert!(both.windows(2).all(|pair| pair[0].los <= pair[1].aos));
            let used = if offset_s > 0.0 { one.sets()[0].epoch } else { epoch };
            assert_eq!(near[0].epoch, fine_time(used), "the set in force at AOS");
        }
    }

    #[test]
    fn satellite_that_never_sets_is_one_pass_whatever_epochs_lie_in_the_window() {
        let mut geo = iss().sets()[0].clone();
        geo.mean_motion_rev_day = 1.0027;
        geo.inclination_deg = 0.05;
        geo.mean_anomaly_deg = 0.0;
        let start: UtcInstant = "2020-07-13T00:00:00Z".parse().unwrap();
        let mut newer = geo.clone();
        newer.epoch = start.plus_seconds(40_000.0);
        let text = tle::formats::write(tle::formats::Form::OmmJson, &[geo.clone(), newer]).unwrap();
        let mut catalogue = Catalogue::default();
        catalogue.read("geo", text.as_bytes(), Checksums::Strict).unwrap();
        let search = PassSearch::new(start, start.plus_seconds(10.0 * 86_400.0), 0.0);
        let below = tle::Propagator::new(&geo).unwrap().at(start).unwrap();
        let below =
            tle::ground::subpoint(&tle::ecef_from_teme(&below, tle::gmst_rad(start, search.orientation)));
        let place: Place = format!("0,{},0", below.longitude_rad.to_degrees()).parse().unwrap();
        let found =
            predict(&catalogue.objects, &[place], &search, None, |_| ControlFlow::Continue(())).unwrap();
        assert_eq!(found.passes.len(), 1, "{found:#?}");
        assert_eq!((found.passes[0].aos, found.passes[0].los), (fine_time(start), fine_time(search.stop)));
        assert!(found.passes[0].aos_clipped && found.passes[0].los_clipped);
    }

    #[test]
    fn watcher_can_end_the_job() {
        let start: UtcInstant = "2020-07-13T00:00:00Z".parse().unwrap();
        let search = PassSearch::new(start, start.plus_seconds(86_400.0), 0.0);
        let objects = vec![iss(); 64];
        let error = predict(&objects, &[lausanne()], &search, None, |_| ControlFlow::Break(())).unwrap_err();
        assert!(matches!(error, PredictError::Search(SearchError::Stopped { total: 64, .. })), "{error}");
    }
}
