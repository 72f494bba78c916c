//! Made-up orbits, listeners and missing chunks.

use mission::UtcUs;
use mission::downlink::{Listener, Task};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tle::{Elements, Station, UtcInstant};

/// 2026-09-21T14:13:20Z.
pub(crate) const START: UtcUs = UtcUs(1_790_000_000_000_000);
pub(crate) const HOUR_US: i64 = 3_600_000_000;

/// Places where stations of the public networks stand close together: latitude, longitude, spread in degrees, weight.
const REGIONS: [(f64, f64, f64, f64); 8] = [
    (49.0, 9.0, 7.0, 0.45),
    (39.0, -95.0, 12.0, 0.18),
    (-33.0, -60.0, 8.0, 0.06),
    (35.0, 137.0, 5.0, 0.08),
    (-34.0, 147.0, 7.0, 0.06),
    (20.0, 78.0, 8.0, 0.07),
    (-29.0, 26.0, 5.0, 0.04),
    (55.0, 60.0, 12.0, 0.06),
];

/// A circular orbit of a CubeSat, turned at random.
pub(crate) fn orbit(rng: &mut impl Rng) -> Elements {
    let height_km = rng.random_range(420.0..650.0);
    let inclination_deg = if rng.random_bool(0.6) { 97.5 } else { rng.random_range(45.0..85.0) };
    let axis_km: f64 = 6378.135 + height_km;
    Elements {
        name: Some("TEST".to_owned()),
        object_id: None,
        norad_cat_id: Some(99_999),
        epoch: UtcInstant::from_unix_us(START.0),
        mean_motion_rev_day: 86_400.0 / (std::f64::consts::TAU * (axis_km.powi(3) / 398_600.8).sqrt()),
        eccentricity: rng.random_range(0.0003..0.003),
        inclination_deg,
        raan_deg: rng.random_range(0.0..360.0),
        arg_of_perigee_deg: rng.random_range(0.0..360.0),
        mean_anomaly_deg: rng.random_range(0.0..360.0),
        bstar: 0.0,
        mean_motion_dot: 0.0,
        mean_motion_ddot: 0.0,
        ephemeris_type: Some(0),
        classification: Some('U'),
        element_set_no: None,
        rev_at_epoch: None,
        further: Vec::new(),
    }
}

/// A station somewhere in a region, or at sea in one case of ten.
pub(crate) fn listener(rng: &mut impl Rng, number: usize) -> Listener {
    let mut draw = rng.random_range(0.0..1.0);
    let region = REGIONS.iter().find(|region| {
        draw -= region.3;
        draw < 0.0
    });
    let (latitude, longitude) = match region.filter(|_| rng.random_bool(0.9)) {
        Some(&(latitude, longitude, spread, _)) => {
            (latitude + rng.random_range(-spread..spread), longitude + rng.random_range(-spread..spread))
        }
        None => (rng.random_range(-60.0..70.0), rng.random_range(-180.0..180.0)),
    };
    Listener {
        name: format!("station {number}"),
        place: Station::new(latitude, longitude, 100.0).unwrap(),
        last_seen: Some(UtcUs(START.0 - rng.random_range(0..14 * 24 * HOUR_US))),
        success: rng.random_bool(0.8).then(|| rng.random_range(0.05..0.95)),
    }
}

/// What is missing: all of an image, its end, or some runs of it.
pub(crate) fn missing(rng: &mut impl Rng) -> Vec<u16> {
    let chunks = rng.random_range(40..200_u16);
    match rng.random_range(0..3) {
        0 => (0..chunks).collect(),
        1 => (chunks / 3..chunks).collect(),
        _ => {
            let hole = rng.random_range(chunks / 4..chunks / 2);
            let width = rng.random_range(2..12);
            (0..chunks).filter(|chunk| !(hole..hole + width).contains(chunk)).collect()
        }
    }
}

/// A task of a seed.
pub(crate) fn task(seed: u64) -> Task {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let elements = orbit(&mut rng);
    let count = [3, 8, 20, 60, 150][(seed % 5) as usize];
    let listeners = (0..count).map(|number| listener(&mut rng, number)).collect();
    let hours = rng.random_range(6..30_i64);
    let missing = missing(&mut rng);
    Task::new(elements, listeners, missing, START, UtcUs(START.0 + hours * HOUR_US))
}
