//! What the archive says of those who heard the satellite before.

use mission::UtcUs;
use mission::downlink::{HeardBy, Listener, joined, listeners};
use mission::sky::{instant, utc};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use tle::passes::{PassFinder, PassSearch};
use tle::{EarthOrientation, Elements, Station};

use crate::world::{HOUR_US, START, orbit};

const UNTIL: UtcUs = UtcUs(START.0 + 10 * 24 * HOUR_US);

/// Times of closest approach of the passes that count.
fn passes(elements: &Elements, place: &Station) -> Vec<UtcUs> {
    let search = PassSearch::new(instant(START), instant(UNTIL), 0.0);
    let found = PassFinder::new(elements).unwrap().find(std::slice::from_ref(place), &search).unwrap();
    let high = found.stations[0].iter().filter(|pass| pass.tca.look.elevation_deg >= 10.0);
    high.map(|pass| utc(pass.tca.at)).collect()
}

fn of(elements: &Elements, heard: &[HeardBy]) -> Vec<Listener> {
    listeners(elements, EarthOrientation::UT1_IS_UTC, heard, UNTIL).unwrap()
}

#[test]
fn shares_are_those_of_the_passes_and_one_lucky_pass_proves_nothing() {
    let elements = orbit(&mut ChaCha8Rng::seed_from_u64(7));
    let place = Station::new(47.0, 8.0, 400.0).unwrap();
    let all = passes(&elements, &place);
    assert!(all.len() > 15, "{}", all.len());
    let heard =
        |name: &str, at: UtcUs| HeardBy { id: name.into(), name: name.into(), place: place.clone(), at };
    let mut reports = Vec::new();
    for (index, &at) in all.iter().enumerate() {
        // Several frames of a pass are one pass.
        reports.extend([heard("always", at), heard("always", UtcUs(at.0 + 20_000_000))]);
        if index % 2 == 0 {
            reports.push(heard("every other", at));
        }
    }
    let (first, last) = (all[0], *all.last().unwrap());
    reports.push(heard("once", first));
    reports.push(heard("newcomer", last));
    // A clock that is wrong by hours, or the report of another satellite: in no pass.
    reports.push(heard("never above", UtcUs(first.0 + (all[1].0 - first.0) / 2)));
    let found = of(&elements, &reports);
    let share = |name: &str| found.iter().find(|one| one.name == name).unwrap().success.unwrap();
    assert!(share("always") > 0.85, "{}", share("always"));
    assert!((share("every other") - 0.47).abs() < 0.08, "{}", share("every other"));
    assert!(share("once") < 0.07, "{}", share("once"));
    assert!((share("newcomer") - 0.3).abs() < 1e-9, "nothing is known but that it is there");
    assert!(share("never above") < 0.1, "{}", share("never above"));
    assert_eq!(found.iter().find(|one| one.name == "once").unwrap().last_seen, Some(first));
    assert!(of(&elements, &[heard("tomorrow", UtcUs(UNTIL.0 + 1))]).is_empty());
}

#[test]
fn lists_and_archive_are_joined_by_name() {
    let place = |latitude| Station::new(latitude, 8.0, 0.0).unwrap();
    let station = |name: &str, latitude, seen: Option<i64>, success| Listener {
        name: name.into(),
        place: place(latitude),
        last_seen: seen.map(UtcUs),
        success,
    };
    let listed = vec![station("Bern_1", 46.9, Some(5), None), station("Uppsala", 59.0, None, Some(0.9))];
    let archive = vec![
        station("bern_1", 40.0, Some(9), Some(0.4)),
        station("uppsala", 59.0, Some(3), Some(0.1)),
        station("new", 1.0, Some(7), Some(0.2)),
    ];
    let all = joined(listed, archive);
    let told: Vec<_> =
        all.iter().map(|one| (one.name.as_str(), one.last_seen.map(|at| at.0), one.success)).collect();
    assert_eq!(
        told,
        [("Bern_1", Some(9), Some(0.4)), ("Uppsala", Some(3), Some(0.9)), ("new", Some(7), Some(0.2)),]
    );
    assert_eq!(all[0].place, place(46.9), "the list knows better where it stands");
}
