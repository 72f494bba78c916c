//! Times our propagation and pass search beside the crate sgp4-predict, in turns, in one thread, by the processor's time:
//! other programs' share of the machine does not count.
//!
//! `orbit-peers DIRECTORY` writes the element sets there as OMM (JSON) with the stations, for the peers in Python, and
//! its own figures as `ours.json`. `scripts/bench-orbits` runs it and prints the table.

#[path = "../../../tests/common/mod.rs"]
mod common;

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use chrono::DateTime;
use common::{EPOCH, Kind, elements, stations};
use rustix::time::{ClockId, clock_gettime};
use serde_json::{Value, json};
use sgp4_predict::{Degrees, GeodeticPoint, Predictor, Tle};
use tle::batch::{NearEarth, StateColumns};
use tle::formats::{Form, write};
use tle::passes::{EndCause, PassFinder, PassSearch, find_many};
use tle::{Elements, Propagator};

const SATELLITES: u32 = 100;
/// The peers get every so-manieth of them, and their time is multiplied: all would take many minutes.
/// Families repeat their kinds of orbit after 2 and after 5.
const PEERS_EVERY: usize = 9;
const WEEK_S: f64 = 7.0 * 86_400.0;
/// Repetitions; the fastest counts.
const ROUNDS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args().nth(1).ok_or("give a directory to write to")?;
    let directory = Path::new(&directory);
    let mut searches = Vec::new();
    for (name, kind) in [("low", Kind::Cubesat), ("eccentric", Kind::Eccentric), ("deep", Kind::Deep)] {
        let sets: Vec<Elements> = (0..SATELLITES).map(|k| elements(kind, k)).collect();
        std::fs::write(directory.join(format!("{name}.json")), write(Form::OmmJson, &sets)?)?;
        for threshold_deg in [0.0, 10.0] {
            searches.push(passes(name, &sets, threshold_deg)?);
        }
    }
    let places: Vec<[f64; 3]> =
        stations().iter().map(|s| [s.latitude_deg(), s.longitude_deg(), s.height_m()]).collect();
    let figures = json!({
        "start_us": EPOCH.unix_us(),
        "days": WEEK_S / 86_400.0,
        "stations": places,
        "searches": searches,
        "propagation": propagation(),
        "catalogue": catalogue()?,
    });
    std::fs::write(directory.join("ours.json"), serde_json::to_string_pretty(&figures)?)?;
    Ok(())
}

/// Seconds of processor time that this thread has had.
fn thread_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

/// The fastest of some runs, in seconds of this thread, and what the last gave.
fn fastest<T>(rounds: usize, mut run: impl FnMut() -> T) -> (f64, Option<T>) {
    let (mut best, mut given) = (f64::INFINITY, None);
    for _ in 0..rounds {
        let start = thread_s();
        given = Some(std::hint::black_box(run()));
        best = best.min(thread_s() - start);
    }
    (best, given)
}

/// A week over ten stations: ours and sgp4-predict's.
fn passes(name: &str, sets: &[Elements], threshold_deg: f64) -> Result<Value, Box<dyn Error>> {
    let stations = stations();
    let search = PassSearch::new(EPOCH, EPOCH.plus_seconds(WEEK_S), threshold_deg);
    let ours = || -> Result<(usize, u64, usize), Box<dyn Error>> {
        let (mut count, mut calls, mut sample_rises) = (0, 0, 0);
        for (index, set) in sets.iter().enumerate() {
            let found = PassFinder::new(set)?.find(&stations, &search)?;
            count += found.count();
            calls += found.sgp4_calls;
            if index.is_multiple_of(PEERS_EVERY) {
                let passes = found.stations.iter().flatten();
                sample_rises += passes.filter(|pass| pass.aos.cause == EndCause::Horizon).count();
            }
        }
        Ok((count, calls, sample_rises))
    };
    let predictors: Vec<Predictor> = sets
        .iter()
        .step_by(PEERS_EVERY)
        .map(|set| {
            Ok(Predictor::from_tle(&write(Form::ThreeLine, std::slice::from_ref(set))?.parse::<Tle>()?)?)
        })
        .collect::<Result<_, Box<dyn Error>>>()?;
    let instant = |us: i64| DateTime::from_timestamp_micros(us).ok_or("no such time");
    let window = instant(search.start.unix_us())?..instant(search.stop.unix_us())?;
    let theirs = || -> usize {
        let mut count = 0;
        for predictor in &predictors {
            for station in &stations {
                let observer = GeodeticPoint {
                    latitude: Degrees(station.latitude_deg()),
                    longitude: Degrees(station.longitude_deg()),
                    altitude: station.height_m(),
                };
                count += predictor
                    .transits_iter(observer, &window, Degrees(threshold_deg))
                    .filter(Result::is_ok)
                    .count();
            }
        }
        count
    };
    let (before_s, _) = fastest(ROUNDS, ours);
    let (theirs_s, theirs_count) = fastest(1, theirs);
    let (after_s, given) = fastest(ROUNDS, ours);
    let (count, calls, sample_rises) = given.ok_or("no run")??;
    Ok(json!({
        "set": name,
        "threshold_deg": threshold_deg,
        "passes": count,
        "ours_s": before_s.min(after_s),
        "calls_per_pass": calls as f64 / count as f64,
        "sample_rises": sample_rises,
        "sgp4_predict_s": theirs_s * sets.len() as f64 / predictors.len() as f64,
        "sgp4_predict_sample_passes": theirs_count,
    }))
}

/// A hundred low orbits at 2016 instants of a week, ns a state.
fn propagation() -> Value {
    let minutes: Vec<f64> = (0..2016).map(|k| f64::from(k) * 5.0).collect();
    let sets: Vec<Elements> = (0..SATELLITES).map(|k| elements(Kind::Cubesat, k)).collect();
    let lanes: Vec<NearEarth> = sets.iter().filter_map(NearEarth::new).collect();
    let scalar: Vec<Propagator> = sets.iter().filter_map(|set| Propagator::new(set).ok()).collect();
    let states = (SATELLITES as usize * minutes.len()) as f64;
    let mut columns = StateColumns::default();
    let (lanes_s, _) = fastest(20, || {
        for orbit in &lanes {
            orbit.propagate(std::hint::black_box(&minutes), &mut columns);
        }
    });
    let (scalar_s, _) = fastest(3, || {
        scalar
            .iter()
            .map(|orbit| minutes.iter().filter(|&&t| orbit.at_minutes(t).is_ok()).count())
            .sum::<usize>()
    });
    json!({ "lanes_ns": lanes_s / states * 1e9, "scalar_ns": scalar_s / states * 1e9 })
}

/// 30,000 objects over one station for a day, two threads.
fn catalogue() -> Result<Value, Box<dyn Error>> {
    let sets: Vec<Elements> = (0..30_000)
        .map(|k| {
            let kind = match k % 20 {
                0..=16 => Kind::Low,
                17 | 18 => Kind::Eccentric,
                _ => Kind::Deep,
            };
            elements(kind, k)
        })
        .collect();
    let station = &stations()[3..4];
    let search = PassSearch::new(EPOCH, EPOCH.plus_seconds(86_400.0), 0.0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    let run = || -> Result<usize, Box<dyn Error + Send + Sync>> {
        let finders: Vec<PassFinder> = sets.iter().map(PassFinder::new).collect::<Result<_, _>>()?;
        let found = find_many(&finders, station, &search, |_| ControlFlow::Continue(()))?;
        Ok(found.iter().map(|found| found.count()).sum())
    };
    let start = Instant::now();
    let count = pool.install(run).map_err(|error| error.to_string())?;
    let seconds = start.elapsed().as_secs_f64();
    Ok(json!({ "objects": sets.len(), "threads": 2, "passes": count, "seconds": seconds }))
}
