//! How long propagation and pass searches take. Comparisons with other programs: `scripts/bench-orbits`.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{EPOCH, Kind, elements, stations};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use tle::Propagator;
use tle::batch::{NearEarth, StateColumns};
use tle::passes::{PassFinder, PassSearch};

const WEEK_S: f64 = 7.0 * 86_400.0;

fn main() {
    divan::main();
}

/// A week in 2016 steps by the scalar path.
#[divan::bench]
fn week_scalar(bencher: Bencher<'_, '_>) {
    let Ok(orbit) = Propagator::new(&elements(Kind::Low, 3)) else { return };
    bencher.counter(ItemsCount::new(2016usize)).bench_local(|| {
        (0..2016).filter(|&k| black_box(orbit.at_minutes(f64::from(k) * 5.0)).is_ok()).count()
    });
}

/// The same in vector lanes.
#[divan::bench]
fn week_in_lanes(bencher: Bencher<'_, '_>) {
    let Some(orbit) = NearEarth::new(&elements(Kind::Low, 3)) else { return };
    let minutes: Vec<f64> = (0..2016).map(|k| f64::from(k) * 5.0).collect();
    let mut states = StateColumns::default();
    bencher.counter(ItemsCount::new(minutes.len())).bench_local(|| {
        orbit.propagate(black_box(&minutes), &mut states);
    });
}

/// Ten satellites over ten stations, a week above 0 degrees; counts passes.
#[divan::bench(args = [Kind::Cubesat, Kind::Eccentric, Kind::Deep])]
fn week_of_passes(bencher: Bencher<'_, '_>, kind: Kind) {
    let stations = stations();
    let search = PassSearch::new(EPOCH, EPOCH.plus_seconds(WEEK_S), 0.0);
    let finders: Vec<PassFinder> = (0..10).filter_map(|k| PassFinder::new(&elements(kind, k)).ok()).collect();
    let find = || -> usize {
        finders.iter().filter_map(|finder| finder.find(&stations, &search).ok()).map(|f| f.count()).sum()
    };
    bencher.counter(ItemsCount::new(find())).bench_local(find);
}
