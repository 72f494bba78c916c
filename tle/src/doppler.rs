//! Doppler, both ways: what the station hears, and what it must send.
//!
//! To first order in range rate over the speed of light; the second order is 0.1 Hz at 435 MHz for a low satellite.

use crate::frames::EarthFixed;
use crate::gravity::acceleration_ecef_km_s2;
use crate::station::LocalAxes;
use crate::vector::{dot, norm, sub};

/// Speed of light, km/s.
pub const LIGHT_KM_S: f64 = 299_792.458;

/// How far above `frequency_hz` the satellite's transmission is heard, Hz: positive while it approaches.
#[must_use]
pub fn downlink_shift_hz(frequency_hz: f64, range_rate_km_s: f64) -> f64 {
    -frequency_hz * range_rate_km_s / LIGHT_KM_S
}

/// Where a transmission of `frequency_hz` is heard, Hz.
#[must_use]
pub fn received_hz(frequency_hz: f64, range_rate_km_s: f64) -> f64 {
    frequency_hz * (1.0 - range_rate_km_s / LIGHT_KM_S)
}

/// What to send so that it arrives at the satellite at `frequency_hz`, Hz: lower while it approaches.
#[must_use]
pub fn uplink_hz(frequency_hz: f64, range_rate_km_s: f64) -> f64 {
    frequency_hz / (1.0 - range_rate_km_s / LIGHT_KM_S)
}

/// How the downlink's shift changes, Hz/s.
#[must_use]
pub fn downlink_shift_rate_hz_s(frequency_hz: f64, range_acceleration_km_s2: f64) -> f64 {
    -frequency_hz * range_acceleration_km_s2 / LIGHT_KM_S
}

/// How the range rate changes, km/s^2, with the acceleration of gravity (J2 included) and of the turning frame.
#[must_use]
pub fn range_acceleration_km_s2(axes: &LocalAxes, object: &EarthFixed) -> f64 {
    let d = sub(object.r_ecef_km, axes.r_ecef_km);
    let v = object.v_ecef_km_s;
    let range_km = norm(d);
    if range_km == 0.0 {
        return 0.0;
    }
    let range_rate = dot(d, v) / range_km;
    (dot(v, v) + dot(d, acceleration_ecef_km_s2(object)) - range_rate * range_rate) / range_km
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uplink_and_downlink_shift_opposite_ways_and_differ_by_the_second_order() {
        let f = 435e6;
        assert!(downlink_shift_hz(f, -7.5) > 10_882.0 && downlink_shift_hz(f, -7.5) < 10_883.0);
        assert!((received_hz(f, -7.5) - f - downlink_shift_hz(f, -7.5)).abs() < 1e-6);
        let sent = uplink_hz(f, -7.5);
        assert!((received_hz(sent, -7.5) - f).abs() < 1e-6, "the satellite hears what was meant");
        let second_order = (f - sent) - downlink_shift_hz(f, -7.5);
        assert!((second_order.abs() - 0.27).abs() < 0.01, "{second_order}");
    }
}
