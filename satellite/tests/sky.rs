//! The sky that an orbit fills, held against `tle` directly: elevation, views, changes, and what the air makes of it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use protocol::Key;
use radio::model::ModelConfig;
use satellite::{
    Channel, ChannelConfig, ChannelStats, DOPPLER_TOLERANCE_HZ, Device, DeviceConfig, LossCause, Orbit,
    PassProfile, Sky, Transit, TwinConfig, mean_rssi_dbm,
};
use tle::{
    EarthOrientation, Elements, HorizonMask, Propagator, Station, UtcInstant, ecef_from_teme, gmst_rad,
    passes::{Pass, PassFinder, PassSearch},
};

const SECOND_US: u64 = 1_000_000;
const DAY_US: u64 = 86_400 * SECOND_US;
/// 2026-09-21T13:33:20Z: not midnight.
const ZERO: UtcInstant = UtcInstant::from_unix_us(1_790_000_000_000_000);

fn lausanne() -> Station {
    Station::new(46.5191, 6.5668, 410.0).unwrap()
}

fn sky_over(station: &Station, orbit: &Orbit) -> Sky {
    Sky::new(&PassProfile::seen_from(station.clone()), orbit, ZERO)
}

/// The passes of some days by one search over all of them.
fn passes(station: &Station, elements: &Elements, days: u64) -> Vec<Pass> {
    let stop = ZERO.plus_us((days * DAY_US).cast_signed());
    let search = PassSearch::new(ZERO, stop, station.mask().range_deg().0);
    let found = PassFinder::new(elements).unwrap().find(std::slice::from_ref(station), &search).unwrap();
    found.stations.into_iter().next().unwrap()
}

fn since_zero_us(at: UtcInstant) -> u64 {
    at.us_since(ZERO).cast_unsigned()
}

#[test]
fn elevation_range_and_rate_are_those_of_tle_at_every_instant() {
    let orbit = Orbit::fictional(5, ZERO);
    let mut sky = sky_over(&lausanne(), &orbit);
    let propagator = Propagator::new(orbit.elements()).unwrap();
    for step in 0..2_000_u64 {
        let now_us = step * 43_123_457;
        let at = ZERO.plus_us(now_us.cast_signed());
        let object = ecef_from_teme(&propagator.at(at).unwrap(), gmst_rad(at, EarthOrientation::UT1_IS_UTC));
        let (ours, theirs) = (sky.look(now_us), lausanne().look(&object));
        assert_eq!(ours.elevation_deg, theirs.elevation_deg);
        assert_eq!((ours.range_km, ours.range_rate_km_s), (theirs.range_km, theirs.range_rate_km_s));
        assert_eq!(sky.in_view(now_us), ours.elevation_deg > 0.0, "at {at}");
        assert!((ours.delay_us() as f64 - theirs.range_km / 0.299_792_458).abs() < 1.0);
    }
}

#[test]
fn changes_of_view_are_the_aos_and_los_of_the_pass_search() {
    let mask = HorizonMask::from_table(&[(0.0, 3.0), (90.0, 12.0), (180.0, 1.0), (270.0, 6.0)]).unwrap();
    let stations = [
        lausanne(),
        lausanne().with_mask(mask),
        // On a mountain that sees below the horizon.
        Station::new(-33.0, -70.0, 4_000.0).unwrap().with_mask(HorizonMask::flat(-2.0).unwrap()),
        Station::new(78.2, 15.4, 450.0).unwrap(),
    ];
    for (station, seed) in stations.iter().zip(1..) {
        let orbit = Orbit::fictional(seed, ZERO);
        let mut sky = sky_over(station, &orbit);
        let (mut now_us, mut edges) = (0, 0);
        for pass in passes(station, orbit.elements(), 14).iter().filter(|pass| !pass.is_clipped()) {
            for (at, up) in [(pass.aos.at, true), (pass.los.at, false)] {
                let next_us = sky.next_change_us(now_us).unwrap();
                // A search from another moment may round a crossing to the next microsecond.
                assert!(
                    next_us.abs_diff(since_zero_us(at)) <= 2,
                    "{} {next_us} {at}",
                    station.latitude_deg()
                );
                assert!(sky.in_view(next_us) == up && sky.in_view(next_us - 1) != up);
                (now_us, edges) = (next_us, edges + 1);
            }
        }
        assert!(edges > 60, "{edges}");
        assert_eq!(sky.in_view(0), sky_over(station, &orbit).in_view(0), "backwards too");
    }
}

#[test]
fn answers_do_not_depend_on_what_was_asked_before() {
    let orbit = Orbit::fictional(9, ZERO);
    let mut walked = sky_over(&lausanne(), &orbit);
    for step in 0..3_000_u64 {
        // Hither and thither through ten days.
        let now_us = step * 7_919_777_777 % (10 * DAY_US);
        let mut fresh = sky_over(&lausanne(), &orbit);
        assert_eq!(walked.in_view(now_us), fresh.in_view(now_us), "{now_us}");
        assert_eq!(walked.next_change_us(now_us), fresh.next_change_us(now_us), "{now_us}");
    }
}

#[test]
fn a_pass_over_midnight_is_one_pass() {
    let midnight_us = since_zero_us("2026-09-22T00:00:00Z".parse().unwrap());
    let orbit = Orbit::passing_over(&lausanne(), ZERO.plus_us(midnight_us.cast_signed()));
    let mut sky = sky_over(&lausanne(), &orbit);
    let aos_us = sky.next_change_us(midnight_us - 900 * SECOND_US).unwrap();
    let los_us = sky.next_change_us(aos_us).unwrap();
    assert!(aos_us < midnight_us - 240 * SECOND_US && los_us > midnight_us + 240 * SECOND_US);
    assert!(sky.in_view(midnight_us - 1) && sky.in_view(midnight_us));
    assert_eq!(sky.next_change_us(midnight_us), Some(los_us));
}

fn geostationary() -> Elements {
    let circle = Orbit::fictional(1, ZERO).elements().clone();
    Elements { mean_motion_rev_day: 1.002_738, inclination_deg: 0.02, ..circle }
}

#[test]
fn a_satellite_that_never_sets_or_never_rises_has_no_change() {
    let orbit = Orbit::new(geostationary()).unwrap();
    let state = Propagator::new(orbit.elements()).unwrap().at(ZERO).unwrap();
    let below = tle::ground::subpoint(&ecef_from_teme(&state, gmst_rad(ZERO, EarthOrientation::default())));
    let longitude_deg = below.longitude_rad.to_degrees();
    for (away_deg, up) in [(0.0, true), (180.0, false)] {
        let station = Station::new(0.0, (longitude_deg + away_deg).rem_euclid(360.0), 0.0).unwrap();
        let mut sky = sky_over(&station, &orbit);
        assert_eq!((sky.in_view(0), sky.next_change_us(0)), (up, None));
        assert_eq!(
            (sky.in_view(u64::MAX), sky.next_change_us(u64::MAX)),
            (false, None),
            "the end of the calendar"
        );
    }
}

#[test]
fn other_elements_in_flight_change_sky_and_telemetry_at_once() {
    let (one, other) = (Orbit::fictional(1, ZERO), Orbit::fictional(2, ZERO));
    let config = |orbit: &Orbit| {
        let utc_at_zero_ms = (ZERO.unix_us() / 1000).cast_unsigned();
        let orbit = Some(orbit.clone());
        let twin = TwinConfig { utc_at_zero_ms, orbit, ..TwinConfig::new(1, Key::from_bytes([1; 16])) };
        let channel =
            ChannelConfig { passes: PassProfile::seen_from(lausanne()), ..ChannelConfig::default() };
        DeviceConfig::new(twin, channel, ModelConfig::prepared(true))
    };
    let (mut device, mut meant) = (Device::new(config(&one)), Device::new(config(&other)));
    let now_us = 7_200 * SECOND_US;
    assert_ne!(device.next_view_change_us(now_us), meant.next_view_change_us(now_us));
    device.set_orbit(other);
    assert_eq!(device.next_view_change_us(now_us), meant.next_view_change_us(now_us));
    assert_eq!(device.twin().orbit(), meant.twin().orbit());
}

#[test]
fn elements_without_a_state_are_below_the_horizon_and_it_is_told_once() {
    // Sixty days from now these elements are a hundred years old, and SGP4 gives no more answer.
    let epoch = ZERO.plus_seconds((60.0 - 36_525.0) * 86_400.0);
    let orbit = Orbit::fictional(3, epoch);
    let mut sky = sky_over(&lausanne(), &orbit);
    assert!(sky.look(0).range_km > 300.0);
    assert_eq!(sky.take_fault(), None);
    assert!(sky.next_change_us(0).is_some());
    for day in 61..90 {
        assert_eq!(sky.look(day * DAY_US).elevation_deg, -90.0);
        assert!(!sky.in_view(day * DAY_US));
        assert_eq!(sky.take_fault().is_some(), day == 61);
    }
    sky.exchange(&Orbit::fictional(3, ZERO));
    assert!(sky.look(61 * DAY_US).range_km > 300.0);
    assert_eq!(sky.take_fault(), None);
}

/// Frames, one a second through thirty days, by tens of degrees of elevation: (sent, lost).
fn losses(orbit: &Orbit) -> ([(u32, u32); 9], ChannelStats) {
    let config = ChannelConfig { passes: PassProfile::seen_from(lausanne()), ..ChannelConfig::default() };
    let (mut sky, mut channel) = (sky_over(&lausanne(), orbit), Channel::new(config, orbit, ZERO));
    let mut bands = [(0, 0); 9];
    let mut now_us = 0;
    while let Some(aos_us) = sky.next_change_us(now_us).filter(|us| *us < 30 * DAY_US) {
        assert_eq!(channel.down(aos_us - 1, &[1]), Transit::Lost(LossCause::OutOfView));
        let los_us = sky.next_change_us(aos_us).unwrap();
        for at_us in (aos_us..los_us).step_by(SECOND_US as usize) {
            let look = sky.look(at_us);
            let band = &mut bands[((look.elevation_deg.max(0.0) / 10.0) as usize).min(8)];
            band.0 += 1;
            match channel.down(at_us, &[1]) {
                Transit::Lost(cause) => {
                    assert_eq!(cause, LossCause::Weak);
                    band.1 += 1;
                }
                Transit::Received(reception) => {
                    let mean_dbm = mean_rssi_dbm(&look);
                    let off_db = f64::from(reception.rssi_dbm) - mean_dbm.clamp(-125.0, -104.0);
                    assert!(off_db.abs() < 2.1, "{reception:?} {look:?}");
                }
            }
        }
        assert_eq!(channel.up(los_us, &[1]), Transit::Lost(LossCause::OutOfView));
        now_us = los_us;
    }
    (bands, *channel.stats())
}

#[test]
fn frames_are_lost_below_the_horizon_and_low_in_the_sky() {
    let (bands, stats) = losses(&Orbit::fictional(4, ZERO));
    // The frames of the satellite, and one of ground's for each pass, which is below the horizon.
    let counted = stats.by_elevation.map(|band| (band.sent as u32, band.lost as u32));
    assert_eq!(counted, bands);
    let share = |band: usize| f64::from(bands[band].1) / f64::from(bands[band].0);
    println!("sent and lost by tens of degrees: {bands:?}");
    assert!(bands.iter().all(|(sent, _)| *sent > 100), "{bands:?}");
    assert!(share(0) > 0.1 && share(0) > 50.0 * share(3), "{bands:?}");
    assert!((3..9).all(|band| share(band) < 0.002), "{bands:?}");
    assert_eq!(u64::from(bands.iter().map(|band| band.1).sum::<u32>()), stats.lost_down);
}

#[test]
fn power_falls_with_the_square_of_the_true_range() {
    let orbit = Orbit::passing_over(&lausanne(), ZERO.plus_seconds(600.0));
    let mut sky = sky_over(&lausanne(), &orbit);
    let (high, low) = (sky.look(600 * SECOND_US), sky.look(450 * SECOND_US));
    assert!(high.elevation_deg > 70.0 && (6.0..30.0).contains(&low.elevation_deg), "{high:?} {low:?}");
    let expected_db = 20.0 * (low.range_km / high.range_km).log10();
    assert!((mean_rssi_dbm(&high) - mean_rssi_dbm(&low) - expected_db).abs() < 1e-9);
}

#[test]
fn doppler_is_counted_and_stays_within_what_the_module_takes() {
    let orbit = Orbit::passing_over(&lausanne(), ZERO.plus_seconds(600.0));
    let utc_at_zero_ms = (ZERO.unix_us() / 1000).cast_unsigned();
    let key = Key::from_bytes([1; 16]);
    let twin = TwinConfig {
        utc_at_zero_ms,
        orbit: Some(orbit),
        heartbeat_period_us: 5 * SECOND_US,
        ..TwinConfig::new(1, key)
    };
    let channel = ChannelConfig { passes: PassProfile::seen_from(lausanne()), ..ChannelConfig::default() };
    let mut device = Device::new(DeviceConfig::new(twin, channel, ModelConfig::prepared(true)));
    while device.poll(1_200 * SECOND_US).is_some() {}
    let worst_hz = device.stats().doppler_max_hz;
    // 435 MHz, 510 km: up to 10 kHz (docs/twin.md), the Earth's turning included.
    assert!((9_300..10_900).contains(&worst_hz) && worst_hz < DOPPLER_TOLERANCE_HZ, "{worst_hz}");
}

#[test]
#[ignore = "a measurement: cargo test -p satellite --test sky -- --ignored --nocapture"]
#[expect(clippy::disallowed_methods, reason = "a measurement reads the clock")]
fn cost_of_a_question() {
    let orbit = Orbit::fictional(6, ZERO);
    let mut sky = sky_over(&lausanne(), &orbit);
    let time = |name: &str, count: u64, mut ask: Box<dyn FnMut(u64) -> f64 + '_>| {
        let start = std::time::Instant::now();
        let sum: f64 = (0..count).map(|step| ask(step * SECOND_US)).sum();
        println!("{name}: {:.0}/s ({sum:.0})", count as f64 / start.elapsed().as_secs_f64());
    };
    time("elevations", 1_000_000, Box::new(|at| sky.look(at).elevation_deg));
    time("in view, second by second", 10_000_000, Box::new(|at| f64::from(u8::from(sky.in_view(at)))));
    time("changes, day by day", 10_000, Box::new(|at| sky.next_change_us(at * 86_400).unwrap() as f64));
}
