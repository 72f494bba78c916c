//! Orbits and stations that tests, benches and comparisons with other programs share.

#![expect(clippy::unwrap_used, reason = "what is written here is valid")]
#![allow(dead_code, clippy::allow_attributes, reason = "each user takes what it needs")]

use tle::{Elements, Station, UtcInstant};

/// The epoch of all elements here: 2026-09-21T14:13:20.123456Z.
pub(crate) const EPOCH: UtcInstant = UtcInstant::from_unix_us(1_790_000_000_123_456);

/// Families of orbits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Near the Earth and round: 13 to 16 revolutions a day, eccentricity below 0.019.
    Low,
    /// What stations of amateurs and universities follow: 400 to 800 km, half of them Sun-synchronous.
    Cubesat,
    /// Perigee 250 to 1450 km, eccentricity up to 0.52; periods on both sides of 225 minutes.
    Eccentric,
    /// Molniya, geosynchronous, navigation, transfer orbits and others.
    Deep,
}

/// The k-th orbit of a family: steps through the ranges without repeating.
pub(crate) fn elements(kind: Kind, k: u32) -> Elements {
    let part = |step: f64| (f64::from(k + 1) * step).fract();
    let rev_day = |a_km: f64| 86_400.0 / (std::f64::consts::TAU * (a_km.powi(3) / 398_600.8).sqrt());
    let mut inclination_deg = 180.0 * part(0.754_878);
    let (mean_motion_rev_day, eccentricity) = match kind {
        Kind::Low => (13.0 + 3.0 * part(0.445), 0.019 * part(0.618_034)),
        Kind::Cubesat => {
            inclination_deg = if k.is_multiple_of(2) {
                97.0 + 1.5 * part(0.754_878)
            } else {
                30.0 + 55.0 * part(0.754_878)
            };
            (rev_day(6378.0 + 400.0 + 400.0 * part(0.445)), 0.003 * part(0.618_034))
        }
        Kind::Eccentric => {
            let e = 0.02 + 0.5 * part(0.618_034);
            (rev_day((6378.0 + 250.0 + 1200.0 * part(0.31)) / (1.0 - e)), e)
        }
        Kind::Deep => match k % 5 {
            0 => (2.0057 + 0.001 * part(0.4), 0.69 + 0.05 * part(0.3)),
            1 => (1.0027 + 0.0005 * (part(0.4) - 0.5), 0.02 * part(0.3)),
            2 => (2.0057, 0.001 + 0.01 * part(0.7)),
            3 => (2.2, 0.73),
            _ => (0.4 + 4.0 * part(0.77), 0.6 * part(0.123)),
        },
    };
    Elements {
        name: Some(format!("{kind:?} {k}")),
        object_id: None,
        norad_cat_id: Some(k + 1),
        epoch: EPOCH,
        mean_motion_rev_day,
        eccentricity,
        inclination_deg,
        raan_deg: 360.0 * part(0.569_84),
        arg_of_perigee_deg: 360.0 * part(0.819_173),
        mean_anomaly_deg: 360.0 * part(0.671_044),
        bstar: 2e-4 * part(0.549_7),
        mean_motion_dot: 0.0,
        mean_motion_ddot: 0.0,
        ephemeris_type: Some(0),
        classification: Some('U'),
        element_set_no: Some(1),
        rev_at_epoch: Some(1),
        further: Vec::new(),
    }
}

/// Stations at the poles, on both sides of the date line, below the sea and elsewhere.
pub(crate) fn stations() -> Vec<Station> {
    [
        (90.0, 0.0, 2800.0),
        (-90.0, 77.0, 2800.0),
        (78.23, 15.4, 450.0),
        (47.4, 8.5, 500.0),
        (0.0, -179.999, 0.0),
        (-16.5, 180.0, 10.0),
        (31.5, 35.5, -430.0),
        (-33.1, -70.7, 900.0),
        (64.8, -147.7, 200.0),
        (35.7, 139.8, 40.0),
    ]
    .map(|(latitude, longitude, height)| Station::new(latitude, longitude, height).unwrap())
    .to_vec()
}
