//! The promises of the module, over paths that satellites go and paths that none does.

use proptest::prelude::*;
use tle::formats::{Checksums, sets};
use tle::passes::{PassFinder, PassSearch};
use tle::{EarthOrientation, Elements, Station, UtcInstant};

use super::*;
use crate::clock::{MonoUs, UtcUs};
use crate::sky::Site;

const ISS: &str = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
                   2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";

fn iss() -> Elements {
    sets(ISS, Checksums::Strict).unwrap().next().unwrap().unwrap().elements
}

fn site(latitude_deg: f64, longitude_deg: f64) -> Site {
    Site {
        place: Station::new(latitude_deg, longitude_deg, 100.0).unwrap(),
        min_elevation_deg: 0.0,
        orientation: EarthOrientation::UT1_IS_UTC,
    }
}

/// The passes of a day, as paths.
fn passes(latitude_deg: f64, longitude_deg: f64) -> Vec<Vec<SkySample>> {
    let (elements, site) = (iss(), site(latitude_deg, longitude_deg));
    let start: UtcInstant = "2020-07-13T00:00:00Z".parse().unwrap();
    let search = PassSearch::new(start, start.plus_seconds(86_400.0), 0.0);
    let found = PassFinder::new(&elements).unwrap().find(std::slice::from_ref(&site.place), &search).unwrap();
    let path = |pass: &tle::passes::Pass| {
        sky_path(&elements, &site, UtcUs(pass.aos.at.unix_us()), UtcUs(pass.los.at.unix_us())).unwrap()
    };
    found.stations[0].iter().map(path).collect()
}

fn mount(azimuth_deg: (f64, f64), flip: bool) -> Mount {
    let elevation_deg = if flip { (0.0, 180.0) } else { (0.0, 90.0) };
    Mount::new(MountSettings { azimuth_deg, elevation_deg, flip, ..MountSettings::default() }).unwrap()
}

fn line(from_deg: f64, to_deg: f64, elevation_deg: f64, seconds: i64) -> Vec<SkySample> {
    (0..=seconds)
        .map(|s| {
            let share = s as f64 / seconds as f64;
            let direction = Direction::new(from_deg + (to_deg - from_deg) * share, elevation_deg);
            SkySample { at: UtcUs(s * 1_000_000), direction }
        })
        .collect()
}

#[test]
fn a_mount_with_overlap_goes_through_north_without_unwinding() {
    for (range, first, last) in [((0.0, 450.0), 300.0, 400.0), ((-180.0, 180.0), -60.0, 40.0)] {
        let route = Route::plan(&mount(range, false), &line(300.0, 400.0, 20.0, 300), None).unwrap();
        assert!(route.unwindings().is_empty() && route.keyholes().is_empty(), "{range:?}");
        assert!((route.at(UtcUs(0)).azimuth_deg - first).abs() < 1e-9);
        assert!((route.at(UtcUs(300_000_000)).azimuth_deg - last).abs() < 1e-9);
    }
}

#[test]
fn a_mount_that_flips_goes_through_north_leaning_backwards() {
    let route = Route::plan(&mount((0.0, 360.0), true), &line(300.0, 400.0, 20.0, 300), None).unwrap();
    assert!(route.unwindings().is_empty() && route.keyholes().is_empty());
    assert_eq!(route.at(UtcUs(0)), Position { azimuth_deg: 120.0, elevation_deg: 160.0 });
}

#[test]
fn a_mount_without_either_says_where_it_must_turn_round() {
    let route = Route::plan(&mount((0.0, 360.0), false), &line(300.0, 420.0, 20.0, 300), None).unwrap();
    let [unwinding] = route.unwindings() else { panic!("{:?}", route.unwindings()) };
    assert!((unwinding.at.0 - 150_000_000).abs() <= 10_000_000, "{unwinding:?}");
    assert!(unwinding.turn_deg > 355.0 && (unwinding.takes_s - 60.0).abs() < 2.0, "{unwinding:?}");
    assert!(!route.keyholes().is_empty(), "it looks elsewhere meanwhile");
}

#[test]
fn a_mount_that_would_only_peep_over_its_stop_waits_there() {
    let route = Route::plan(&mount((0.0, 360.0), false), &line(300.0, 365.0, 20.0, 300), None).unwrap();
    assert!(route.unwindings().is_empty());
    let [keyhole] = route.keyholes() else { panic!("{:?}", route.keyholes()) };
    assert!((keyhole.worst_deg - 4.7).abs() < 0.1, "{keyhole:?}");
}

#[test]
fn a_mount_that_is_late_takes_the_branch_that_is_near() {
    let mount = mount((0.0, 450.0), false);
    let path = line(10.0, 60.0, 20.0, 300);
    let stands = Position { azimuth_deg: 400.0, elevation_deg: 0.0 };
    let at_once = Start { at: UtcUs(0), position: stands };
    let route = Route::plan(&mount, &path, Some(at_once)).unwrap();
    assert!((route.at(UtcUs(0)).azimuth_deg - 370.0).abs() < 1e-9, "{:?}", route.at(UtcUs(0)));
    assert!(
        (route.leave_at(&mount, Some(stands), 10.0).0 + 16_666_667).abs() <= 10,
        "20 degrees up at 3 a second"
    );
    assert_eq!(route.leave_at(&mount, None, 0.0), UtcUs(-75_000_000));
}

#[test]
fn a_pass_through_the_zenith_leans_over_where_the_mount_can_and_tells_the_keyhole_where_not() {
    // Up in the south, 1.5 degrees past the zenith, down in the north.
    let path: Vec<SkySample> = (0..=240)
        .map(|s| {
            let along = f64::from(s - 120) * 0.7;
            let (sin, cos) = along.to_radians().sin_cos();
            let lean = 1.5_f64.to_radians();
            let (east, north, up) = (cos * lean.sin(), sin, cos * lean.cos());
            let azimuth = east.atan2(north).to_degrees();
            let direction = Direction::new(azimuth, up.atan2(east.hypot(north)).to_degrees());
            SkySample { at: UtcUs(i64::from(s) * 1_000_000), direction }
        })
        .collect();
    let worst = |route: &Route| route.keyholes().iter().map(|k| k.worst_deg).fold(0.0, f64::max);
    let plain = Route::plan(&mount((0.0, 450.0), false), &path, None).unwrap();
    assert!(worst(&plain) > 5.0, "{:?}", plain.keyholes());
    let flipping = Route::plan(&mount((0.0, 450.0), true), &path, None).unwrap();
    assert!(worst(&flipping) < 3.0, "{:?}", flipping.keyholes());
    assert!(flipping.unwindings().is_empty());
}

#[test]
fn real_passes_unwind_never_with_half_a_turn_of_overlap_and_sometimes_without() {
    let mut unwound = 0;
    for latitude in [-60.0, -33.0, 0.5, 21.0, 45.0, 51.6] {
        for path in passes(latitude, 11.0) {
            for mount in [mount((0.0, 540.0), false), mount((0.0, 360.0), true)] {
                let route = Route::plan(&mount, &path, None).unwrap();
                assert!(route.unwindings().is_empty(), "{latitude} {:?}", route.unwindings());
            }
            let route = Route::plan(&mount((0.0, 360.0), false), &path, None).unwrap();
            unwound += route.unwindings().len();
        }
    }
    assert!(unwound > 5, "{unwound}");
}

#[test]
fn an_elevation_of_minus_nothing_and_an_object_at_the_zenith_are_directions() {
    let path =
        [(0, 0.0, -0.0), (1, 359.999_999, -1e-12), (2, 123.0, 90.0), (3, f64::NAN, 10.0), (4, -0.0, 0.0)]
            .map(|(s, az, el)| SkySample { at: UtcUs(s * 1_000_000), direction: Direction::new(az, el) });
    let mount = mount((0.0, 360.0), false);
    let route = Route::plan(&mount, &path, None).unwrap();
    for us in 0..5_000 {
        assert!(mount.allows(route.at(UtcUs(us * 1_000))));
    }
    assert!(Route::plan(&mount, &path[3..4], None).is_none(), "nothing finite");
    assert!(Route::plan(&mount, &[], None).is_none());
}

#[test]
fn impossible_mounts_are_refused_with_key_and_remedy() {
    let base = MountSettings::default();
    let cases: [(&str, MountSettings); 9] = [
        ("azimuth_range", MountSettings { azimuth_deg: (360.0, 0.0), ..base }),
        ("azimuth_range", MountSettings { azimuth_deg: (0.0, f64::NAN), ..base }),
        ("azimuth_range", MountSettings { azimuth_deg: (-400.0, 0.0), ..base }),
        ("elevation_range", MountSettings { elevation_deg: (0.0, 200.0), ..base }),
        ("flip", MountSettings { flip: true, ..base }),
        ("azimuth_rate_deg_s", MountSettings { azimuth_rate_deg_s: 0.0, ..base }),
        ("dead_band_deg", MountSettings { dead_band_deg: f64::NAN, ..base }),
        ("minimum_elevation", MountSettings { minimum_elevation_deg: 95.0, ..base }),
        ("park", MountSettings { park: Some(Position { azimuth_deg: 0.0, elevation_deg: 120.0 }), ..base }),
    ];
    for (key, settings) in cases {
        let fault = Mount::new(settings).unwrap_err();
        assert_eq!(fault.key, key);
        assert!(fault.remedy.contains("Give"), "{fault}");
    }
}

#[test]
fn a_mount_is_held_to_what_its_daemon_allows() {
    let park = Some(Position { azimuth_deg: 10.0, elevation_deg: 170.0 });
    let wide = MountSettings {
        azimuth_deg: (0.0, 450.0),
        elevation_deg: (0.0, 180.0),
        flip: true,
        park,
        ..MountSettings::default()
    };
    let held = Mount::new(wide).unwrap().held_to((-180.0, 360.0), (0.0, 90.0)).unwrap();
    assert_eq!((held.settings().azimuth_deg, held.settings().elevation_deg), ((0.0, 360.0), (0.0, 90.0)));
    assert!(!held.settings().flip && held.settings().park.unwrap().elevation_deg == 90.0);
    assert!(Mount::new(wide).unwrap().held_to((500.0, 600.0), (0.0, 90.0)).is_err());
    assert!(
        Mount::new(wide).unwrap().held_to((f64::NAN, f64::NAN), (f64::NAN, f64::NAN)).is_ok(),
        "told nothing"
    );
}

#[test]
fn a_stuck_mount_is_told_again_and_a_jump_is_no_motion() {
    let mut pointer = Pointer::new(mount((0.0, 360.0), false));
    let at = |azimuth_deg: f64| Position { azimuth_deg, elevation_deg: 10.0 };
    let second = |s: u64| MonoUs(s * 1_000_000);
    assert_eq!(pointer.next(second(0), at(90.0)), Some(at(90.0)));
    let mut told = Vec::new();
    for s in 1..=20 {
        let seen = pointer.observe(second(s), at(0.0));
        assert_eq!(seen.is_stuck, s >= 9, "{s}");
        told.extend(pointer.next(second(s), at(90.0)).map(|_| s));
    }
    assert_eq!(told, [9, 17]);
    assert!(!pointer.observe(second(21), at(6.0)).is_stuck, "it moves");
    let jumped = pointer.observe(second(22), at(300.0));
    assert!(jumped.has_jumped && !jumped.is_on_target, "{jumped:?}");
    assert!(pointer.observe(second(23), at(12.0)).has_jumped, "and back");
    assert!(!pointer.observe(second(24), at(18.0)).has_jumped);
}

#[test]
fn a_mount_that_lags_behind_a_moving_target_is_not_stuck_but_one_that_stands_is() {
    let moves = |rate: f64| {
        let mut pointer = Pointer::new(mount((0.0, 360.0), false));
        let (mut stuck, mut position) = (false, Position { azimuth_deg: 0.0, elevation_deg: 0.0 });
        for s in 0..60_u64 {
            let wanted = Position { azimuth_deg: 20.0 + 2.0 * s as f64, elevation_deg: 0.0 };
            stuck |= pointer.observe(MonoUs(s * 1_000_000), position).is_stuck;
            let _ = pointer.next(MonoUs(s * 1_000_000), wanted);
            position.azimuth_deg += rate;
        }
        stuck
    };
    assert!(!moves(2.0) && !moves(0.6));
    assert!(moves(0.0));
}

#[test]
fn a_rig_is_tuned_in_steps_worth_a_command_and_never_to_nonsense() {
    let mut tuner = Tuner::new(RigSteps::default());
    assert_eq!(tuner.next(MonoUs(0), 435_010_203.7), Some(435_010_200));
    assert_eq!(tuner.next(MonoUs(2_000_000), 435_010_290.0), None, "90 Hz are not worth it");
    assert_eq!(tuner.residual_hz(435_010_290.0), Some(90.0));
    assert_eq!(tuner.next(MonoUs(500_000), 435_020_000.0), None, "not that soon");
    assert_eq!(tuner.next(MonoUs(1_000_000), 435_020_000.0), Some(435_020_000));
    for nonsense in [f64::NAN, f64::INFINITY, -5.0, 0.0, 1e15] {
        assert_eq!(Tuner::new(RigSteps::default()).next(MonoUs(0), nonsense), None);
    }
    tuner.forget();
    assert_eq!(tuner.next(MonoUs(1_000_001), 435_020_000.0), Some(435_020_000));
}

#[test]
fn the_margins_are_those_of_the_data_sheets() {
    use radio::airtime::LoraPhy;
    let margin = doppler_margin(&LoraPhy::LIKELY_2K4, -10_200.0, 156.0, 1.2, 900.0);
    assert!(
        (margin.allowed_offset_hz - 125_000.0).abs() < 1e-6 && (margin.offset_share - 0.0888).abs() < 1e-4
    );
    assert!(
        (margin.allowed_drift_hz - 1302.0).abs() < 1.0 && (margin.drift_share - 187.2 / 1302.08).abs() < 1e-3
    );
    let other =
        doppler_margin(&LoraPhy { low_data_rate: false, ..LoraPhy::OTHER_2K4 }, 10_200.0, -156.0, 1.2, 0.0);
    assert!((other.allowed_offset_hz - 31_250.0).abs() < 1e-6 && (other.allowed_drift_hz - 81.4).abs() < 0.1);
    assert!(other.drift_share > 2.0, "marginal near the zenith");
}

prop_compose! {
    fn any_mount()(
        start in -360.0..0.0f64,
        span in 200.0..700.0f64,
        low in -5.0..10.0f64,
        high in 60.0..180.0f64,
        rates in (0.5..20.0f64, 0.5..10.0f64),
        dead_band in 0.1..8.0f64,
        flip in any::<bool>(),
    ) -> Mount {
        Mount::new(MountSettings {
            azimuth_deg: (start, start + span),
            elevation_deg: (low, high),
            flip: flip && high > 90.0,
            azimuth_rate_deg_s: rates.0,
            elevation_rate_deg_s: rates.1,
            dead_band_deg: dead_band,
            minimum_elevation_deg: low.max(0.0),
            park: None,
        }).unwrap()
    }
}

prop_compose! {
    /// A smooth way over the sky: a great circle, tilted and turned, gone along at its own pace.
    fn any_path()(
        tilt in 0.0..90.0f64,
        turn in 0.0..360.0f64,
        pace in 0.1..1.5f64,
        backwards in any::<bool>(),
    ) -> Vec<SkySample> {
        let steps = (170.0 / pace) as i64;
        (0..=steps).map(|s| {
            let along = (-85.0 + pace * s as f64).to_radians() * if backwards { -1.0 } else { 1.0 };
            let (sin, cos) = along.sin_cos();
            let lean = tilt.to_radians();
            let (east, north, up) = (cos * lean.sin(), sin, cos * lean.cos());
            let direction = Direction::new(east.atan2(north).to_degrees() + turn, up.asin().to_degrees());
            SkySample { at: UtcUs(1_600_000_000_000_000 + s * 1_000_000), direction }
        }).collect()
    }
}

/// Follows a route as a mount does, polled once a second; the largest error on the sky, and every command.
fn follow(mount: &Mount, route: &Route, path: &[SkySample]) -> (f64, Vec<Position>) {
    let mut pointer = Pointer::new(*mount);
    let (begin, _) = route.span();
    let mut position = route.at(begin);
    let (mut worst, mut commands) = (0.0_f64, Vec::new());
    for (s, sample) in path.iter().enumerate() {
        let now = MonoUs(s as u64 * 1_000_000);
        let _ = pointer.observe(now, position);
        commands.extend(pointer.next(now, route.at(sample.at)));
        worst = worst.max(position.direction().angle_deg(mount.wanted(sample.direction)));
        position = mount.after(position, pointer.target().unwrap(), 1.0);
    }
    (worst, commands)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn every_command_is_inside_the_limits(
        mount in any_mount(), path in any_path(),
        start in proptest::option::of((-720.0..720.0f64, -90.0..180.0f64)),
        asked in proptest::collection::vec((any::<f64>(), any::<f64>()), 0..20),
    ) {
        let start = start.map(|(azimuth_deg, elevation_deg)| Start {
            at: path[0].at.plus(-30_000_000), position: Position { azimuth_deg, elevation_deg } });
        let route = Route::plan(&mount, &path, start).unwrap();
        for us in (-5_000_000..=400_000_000).step_by(333_333) {
            prop_assert!(mount.allows(route.at(path[0].at.plus(us))));
        }
        for position in follow(&mount, &route, &path).1 {
            prop_assert!(mount.allows(position));
        }
        let mut pointer = Pointer::new(mount);
        for (s, (azimuth_deg, elevation_deg)) in asked.into_iter().enumerate() {
            let now = MonoUs(s as u64 * 1_500_000);
            let _ = pointer.observe(now, Position { azimuth_deg: elevation_deg, elevation_deg: azimuth_deg });
            if let Some(position) = pointer.next(now, Position { azimuth_deg, elevation_deg }) {
                prop_assert!(mount.allows(position));
            }
        }
    }

    #[test]
    fn a_mount_that_is_fast_enough_follows_within_dead_band_and_lag(mount in any_mount(), path in any_path()) {
        let route = Route::plan(&mount, &path, None).unwrap();
        let s = *mount.settings();
        let steps = path.windows(2).map(|pair| {
            let (a, b) = (route.at(pair[0].at), route.at(pair[1].at));
            ((a.azimuth_deg - b.azimuth_deg).abs(), (a.elevation_deg - b.elevation_deg).abs())
        });
        let (azimuth, elevation) = steps.fold((0.0_f64, 0.0_f64), |m, d| (m.0.max(d.0), m.1.max(d.1)));
        prop_assume!(azimuth < s.azimuth_rate_deg_s && elevation < s.elevation_rate_deg_s);
        let unreachable = path.iter().map(|sample| {
            route.at(sample.at).direction().angle_deg(mount.wanted(sample.direction))
        }).fold(0.0, f64::max);
        let (worst, _) = follow(&mount, &route, &path);
        // Both axes may be a dead band behind, and a second of travel.
        let bound = unreachable + (s.dead_band_deg + azimuth).hypot(s.dead_band_deg + elevation) + 1e-6;
        prop_assert!(worst <= bound, "{worst} > {bound}");
    }

    #[test]
    fn nothing_unwinds_where_one_branch_holds_the_pass(mount in any_mount(), path in any_path()) {
        let s = *mount.settings();
        // The azimuth as it goes on and on, and the room it needs.
        let mut unwrapped = vec![path[0].direction.azimuth_deg];
        for pair in path.windows(2) {
            let step = (pair[1].direction.azimuth_deg - pair[0].direction.azimuth_deg + 540.0).rem_euclid(360.0) - 180.0;
            unwrapped.push(unwrapped.last().unwrap() + step);
        }
        let steps_are_slow = unwrapped.windows(2).all(|w| (w[1] - w[0]).abs() <= s.azimuth_rate_deg_s)
            && path.windows(2).all(|p| {
                (mount.wanted(p[1].direction).elevation_deg - mount.wanted(p[0].direction).elevation_deg).abs()
                    <= s.elevation_rate_deg_s
            });
        let (low, high) = unwrapped.iter().fold((f64::MAX, f64::MIN), |m, a| (m.0.min(*a), m.1.max(*a)));
        let top = path.iter().map(|p| p.direction.elevation_deg).fold(f64::MIN, f64::max);
        let fits = |shift: f64| (-3..=3).map(|k| shift + 360.0 * f64::from(k)).any(|shift| {
            low + shift >= s.azimuth_deg.0 && high + shift <= s.azimuth_deg.1
        });
        let plain = top <= s.elevation_deg.1 && fits(0.0);
        let flipped = s.flip && 180.0 - s.minimum_elevation_deg <= s.elevation_deg.1 && fits(180.0);
        prop_assume!(steps_are_slow && (plain || flipped));
        let route = Route::plan(&mount, &path, None).unwrap();
        prop_assert!(route.unwindings().is_empty(), "{:?}", route.unwindings());
        prop_assert!(route.keyholes().is_empty(), "{:?}", route.keyholes());
    }
}
