//! The edge cases of a pass search that no reference programme knows.

#![expect(clippy::unwrap_used, reason = "a test's helpers fail by panicking")]

mod common;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::{EPOCH, Kind, elements, stations};
use proptest::prelude::*;
use tle::passes::{EndCause, LONGEST_WINDOW_DAYS, Pass, PassFinder, PassSearch, SearchError, find_many};
use tle::{EarthOrientation, Elements, HorizonMask, Station, UtcInstant, ecef_from_teme, gmst_rad};

const DAY_S: f64 = 86_400.0;

fn search(days: f64, threshold_deg: f64) -> PassSearch {
    PassSearch::new(EPOCH, EPOCH.plus_seconds(days * DAY_S), threshold_deg)
}

fn passes(elements: &Elements, station: &Station, search: &PassSearch) -> Vec<Pass> {
    let found = PassFinder::new(elements).unwrap().find(std::slice::from_ref(station), search).unwrap();
    found.stations.into_iter().next().unwrap()
}

fn geostationary() -> Elements {
    let mut orbit = elements(Kind::Deep, 0);
    (orbit.mean_motion_rev_day, orbit.eccentricity, orbit.inclination_deg) = (1.0027, 0.0002, 0.05);
    orbit
}

#[test]
fn geostationary_object_is_one_pass_clipped_at_both_ends_or_none() {
    let orbit = geostationary();
    let finder = PassFinder::new(&orbit).unwrap();
    let state = finder.propagator().at(EPOCH).unwrap();
    let below = tle::ground::subpoint(&ecef_from_teme(&state, gmst_rad(EPOCH, EarthOrientation::UT1_IS_UTC)));
    let longitude = below.longitude_rad.to_degrees();
    let near = Station::new(20.0, longitude, 0.0).unwrap();
    let far = Station::new(-20.0, longitude + if longitude > 0.0 { -180.0 } else { 180.0 }, 0.0).unwrap();
    let found = finder.find(&[near, far], &search(30.0, 0.0)).unwrap();
    assert_eq!(found.stations[1], []);
    let [pass] = found.stations[0].as_slice() else { panic!("{:?}", found.stations[0]) };
    assert_eq!(pass.aos.cause, EndCause::Window { crossing: None });
    assert_eq!(pass.los.cause, EndCause::Window { crossing: None });
    assert_eq!((pass.aos.at, pass.los.at), (EPOCH, EPOCH.plus_seconds(30.0 * DAY_S)));
    assert!(pass.other_summits.len() >= 25, "one summit a day: {}", pass.other_summits.len());
    assert!(pass.tca.look.elevation_deg > 60.0);
}

#[test]
fn pass_in_progress_at_either_end_tells_its_true_ends() {
    let (orbit, station) = (elements(Kind::Cubesat, 4), stations()[2].clone());
    let whole = passes(&orbit, &station, &search(2.0, 0.0));
    let pass = &whole[5];
    let window = PassSearch::new(pass.aos.at.plus_seconds(60.0), pass.los.at.plus_seconds(-60.0), 0.0);
    let [cut] = passes(&orbit, &station, &window).try_into().unwrap();
    let cut: Pass = cut;
    let beyond = |cause| {
        if let EndCause::Window { crossing } = cause { crossing.unwrap() } else { panic!("{cause:?}") }
    };
    assert_eq!((cut.aos.at, cut.los.at), (window.start, window.stop));
    assert!(beyond(cut.aos.cause).us_since(pass.aos.at).abs() <= 1, "{cut:?}");
    assert!(beyond(cut.los.cause).us_since(pass.los.at).abs() <= 1, "{cut:?}");
    assert!(cut.is_clipped() && !pass.is_clipped());
    let short = PassSearch { beyond_window: false, ..window };
    assert_eq!(passes(&orbit, &station, &short)[0].aos.cause, EndCause::Window { crossing: None });
}

#[test]
fn window_of_a_second_inside_a_pass_has_that_pass() {
    let (orbit, station) = (elements(Kind::Cubesat, 4), stations()[2].clone());
    let middle = passes(&orbit, &station, &search(2.0, 0.0))[5].tca.at.plus_seconds(40.0);
    let window = PassSearch::new(middle, middle.plus_seconds(1.0), 0.0);
    assert_eq!(passes(&orbit, &station, &window).len(), 1);
    assert_eq!(passes(&orbit, &station, &PassSearch::new(middle, middle.plus_us(3), 0.0)).len(), 1);
    assert_eq!(passes(&orbit, &station, &PassSearch::new(middle, middle, 0.0)), []);
}

#[test]
fn window_is_cut_anywhere_and_the_pieces_are_the_whole() {
    for kind in [Kind::Cubesat, Kind::Eccentric, Kind::Deep] {
        for k in 0..6 {
            let (orbit, station) = (elements(kind, k), stations()[(k as usize * 3) % 10].clone());
            let whole = passes(&orbit, &station, &search(3.0, 2.0));
            let cuts: Vec<UtcInstant> =
                (0..=13).map(|c| EPOCH.plus_seconds(3.0 * DAY_S / 13.0 * f64::from(c))).collect();
            let mut joined: Vec<(UtcInstant, UtcInstant)> = Vec::new();
            for pair in cuts.windows(2) {
                for pass in passes(&orbit, &station, &PassSearch::new(pair[0], pair[1], 2.0)) {
                    match joined.last_mut() {
                        Some(last) if last.1 == pass.aos.at => last.1 = pass.los.at,
                        _ => joined.push((pass.aos.at, pass.los.at)),
                    }
                }
            }
            assert_eq!(joined.len(), whole.len(), "{kind:?} {k}");
            for (pass, ends) in whole.iter().zip(joined) {
                assert!(pass.aos.at.us_since(ends.0).abs() <= 2, "{kind:?} {k} {pass:?} {ends:?}");
                assert!(pass.los.at.us_since(ends.1).abs() <= 2, "{kind:?} {k} {pass:?} {ends:?}");
            }
        }
    }
}

#[test]
fn many_stations_find_what_each_finds_alone() {
    let stations = stations();
    for kind in [Kind::Low, Kind::Eccentric, Kind::Deep] {
        let finder = PassFinder::new(&elements(kind, 7)).unwrap();
        let together = finder.find(&stations, &search(2.0, 5.0)).unwrap();
        for (station, passes) in stations.iter().zip(&together.stations) {
            let alone = finder.find(std::slice::from_ref(station), &search(2.0, 5.0)).unwrap();
            assert_eq!(&alone.stations[0], passes);
        }
    }
}

#[test]
fn object_that_comes_down_leaves_a_gap() {
    let mut orbit = elements(Kind::Low, 0);
    (orbit.mean_motion_rev_day, orbit.eccentricity, orbit.inclination_deg, orbit.bstar) =
        (16.35, 0.0008, 51.6, 0.001);
    let finder = PassFinder::new(&orbit).unwrap();
    let found = finder.find(&[], &search(30.0, 0.0)).unwrap();
    let [gap] = found.gaps.as_slice() else { panic!("{:?}", found.gaps) };
    assert_eq!(gap.until, EPOCH.plus_seconds(30.0 * DAY_S));
    assert!(finder.propagator().at(gap.from.plus_us(-2)).is_ok());
    assert_eq!(finder.propagator().at(gap.from.plus_us(2)).unwrap_err().fault, gap.fault.fault);
    // A window wholly after the end has no pass and one gap.
    let after = PassSearch::new(gap.from.plus_seconds(DAY_S), gap.from.plus_seconds(2.0 * DAY_S), 0.0);
    let found = finder.find(&stations(), &after).unwrap();
    assert_eq!(found.count(), 0);
    assert_eq!((found.gaps.len(), found.gaps[0].from, found.gaps[0].until), (1, after.start, after.stop));
}

#[test]
fn window_that_cannot_be_searched_is_refused_with_a_remedy() {
    let finder = PassFinder::new(&elements(Kind::Low, 0)).unwrap();
    let ask = |search: PassSearch| finder.find(&stations(), &search).unwrap_err();
    let reversed = PassSearch::new(EPOCH.plus_us(1), EPOCH, 0.0);
    assert!(matches!(ask(reversed), SearchError::Reversed { .. }));
    assert!(ask(reversed).to_string().contains("exchange the two"));
    let days = LONGEST_WINDOW_DAYS as f64 + 1.0;
    assert!(matches!(ask(search(days, 0.0)), SearchError::WindowTooLong { .. }));
    let longest = PassSearch::new(EPOCH, EPOCH.plus_seconds(LONGEST_WINDOW_DAYS as f64 * 86_400.0), 90.0);
    assert!(finder.find(&stations(), &longest).is_ok(), "the days that the refusal names may be searched");
    for elevation in [91.0, -90.5, f64::NAN, f64::INFINITY] {
        assert!(matches!(ask(search(1.0, elevation)), SearchError::Elevation { .. }));
    }
    let early = PassSearch::new(UtcInstant::EARLIEST.plus_us(-1), UtcInstant::EARLIEST, 0.0);
    assert!(matches!(ask(early), SearchError::OutsideCalendar { .. }));
}

#[test]
fn mask_cuts_passes_where_the_true_margin_changes_sign() {
    let wall = HorizonMask::from_table(&[
        (0.0, 2.0),
        (60.0, 2.0),
        (61.0, 25.0),
        (120.0, 30.0),
        (121.0, 3.0),
        (200.0, 3.0),
        (250.0, 12.0),
        (300.0, 1.0),
    ])
    .unwrap();
    let mut parts = 0;
    for k in 0..12 {
        let orbit = elements(if k < 10 { Kind::Cubesat } else { Kind::Eccentric }, k);
        let station = stations()[(k % 10) as usize].clone().with_mask(wall.clone());
        let finder = PassFinder::new(&orbit).unwrap();
        let request = search(1.0, 2.5);
        let above = |at: UtcInstant| {
            let state = finder.propagator().at(at).unwrap();
            let look = station.look(&ecef_from_teme(&state, gmst_rad(at, request.orientation)));
            look.elevation_deg > wall.elevation_deg(look.azimuth_deg).max(2.5)
        };
        let passes = passes(&orbit, &station, &request);
        for pass in &passes {
            for (end, outwards) in [(&pass.aos, -20), (&pass.los, 20)] {
                if end.cause == EndCause::Horizon {
                    assert!(!above(end.at.plus_us(outwards)) && above(end.at.plus_us(-outwards)), "{pass:?}");
                }
            }
            assert!(pass.tca.at >= pass.aos.at && pass.tca.at <= pass.los.at);
        }
        let mut at = request.start;
        while at < request.stop {
            let within = passes.iter().any(|pass| pass.aos.at <= at && at <= pass.los.at);
            let near = passes
                .iter()
                .any(|pass| pass.aos.at.us_since(at).abs() < 20 || pass.los.at.us_since(at).abs() < 20);
            assert!(near || within == above(at), "{orbit:?} {at}");
            at = at.plus_us(2_000_000);
        }
        parts += passes.len();
    }
    assert!(parts > 50, "{parts}");
}

#[test]
fn flat_mask_is_a_threshold() {
    let (orbit, station) = (elements(Kind::Cubesat, 1), stations()[3].clone());
    let high = station.clone().with_mask(HorizonMask::flat(7.0).unwrap());
    assert_eq!(passes(&orbit, &high, &search(3.0, 0.0)), passes(&orbit, &station, &search(3.0, 7.0)));
    assert_eq!(passes(&orbit, &high, &search(3.0, 9.0)), passes(&orbit, &station, &search(3.0, 9.0)));
}

#[test]
fn many_satellites_come_in_order_and_can_be_stopped() {
    let finders: Vec<_> = (0..40).map(|k| PassFinder::new(&elements(Kind::Cubesat, k)).unwrap()).collect();
    let heard = AtomicUsize::new(0);
    let found = find_many(&finders, &stations(), &search(1.0, 0.0), |_| {
        heard.fetch_add(1, Ordering::Relaxed);
        ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(heard.into_inner(), 40);
    for (finder, found) in finders.iter().zip(&found) {
        assert_eq!(&finder.find(&stations(), &search(1.0, 0.0)).unwrap(), found);
    }
    let stopped = find_many(&finders, &stations(), &search(1.0, 0.0), |done| {
        if done >= 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(stopped, Err(SearchError::Stopped { total: 40, .. })), "{stopped:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the elements: no panic, an end in bounded work, passes in order and within the window.
    #[test]
    fn any_elements_are_searched_in_bounded_work(
        mean_motion in prop_oneof![0.01..20.0f64, 0.0..0.01f64, 20.0..1e6f64],
        eccentricity in prop_oneof![0.0..0.05f64, 0.0..1.0f64, 0.9..1.0f64],
        angles in prop::array::uniform4(0.0..360.0f64),
        bstar in prop_oneof![-1.0..1.0f64, -1e-3..1e-3f64],
        latitude in -90.0..=90.0f64,
        longitude in -180.0..=180.0f64,
        threshold in -90.0..=90.0f64,
        offset_days in -1000.0..1000.0f64,
        days in 0.0..4.0f64,
    ) {
        let mut orbit = elements(Kind::Low, 0);
        orbit.mean_motion_rev_day = mean_motion;
        orbit.eccentricity = eccentricity;
        orbit.inclination_deg = angles[0] / 2.0;
        orbit.raan_deg = angles[1];
        orbit.arg_of_perigee_deg = angles[2];
        orbit.mean_anomaly_deg = angles[3];
        orbit.bstar = bstar;
        let station = Station::new(latitude, longitude, 0.0).unwrap();
        let start = EPOCH.plus_seconds(offset_days * DAY_S);
        let request = PassSearch::new(start, start.plus_seconds(days * DAY_S), threshold);
        if let Ok(finder) = PassFinder::new(&orbit) {
            let found = finder.find(std::slice::from_ref(&station), &request).unwrap();
            prop_assert!(found.sgp4_calls < 100_000, "{} calls", found.sgp4_calls);
            let mut last = request.start;
            for pass in &found.stations[0] {
                prop_assert!(pass.aos.at >= last && pass.aos.at <= pass.los.at && pass.los.at <= request.stop, "{pass:?}");
                last = pass.los.at;
            }
        }
    }
}
