//! The satellite's body: what its sensors say. Smooth values from orbit and attitude, with a little repeatable noise.

use protocol::{AdcsInfo, Heartbeat};

use crate::{
    attitude::{Attitude, AttitudeMode},
    noise::{mix, unit},
    orbit::Orbit,
    place::Place,
    vector::{Rotation, Vec3, add, dot, length, scale, unit_of},
};

/// Centre of the South Atlantic Anomaly, where radiation is strong: latitude and longitude, degrees.
const ANOMALY_DEG: [f64; 2] = [-26.0, -49.0];
/// The camera looks along this body axis.
const CAMERA_AXIS: Vec3 = [0.0, 0.0, 1.0];

/// Status words of AdcsInfo when all is well.
const ESTIMATOR_CONVERGED: u16 = 1;
const CONTROLLER_ACTIVE: u16 = 1;
/// Status word when the sensors are lost.
const STATUS_FAULT: u16 = 0x8000;

/// What the satellite's computer knows about time and faults when it reads its sensors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// Moment on the monotonic scale, µs.
    pub(crate) now_us: u64,
    /// True time, ms since 1970 UTC: where the orbit is.
    pub(crate) utc_ms: u64,
    /// Time since boot, ms.
    pub(crate) uptime_ms: u32,
    /// What the satellite's clock says, ms since 1970 UTC; 0 = none.
    pub(crate) timestamp_ms: u64,
    /// An image is stored.
    pub(crate) cam: bool,
    /// The inertial sensors and the sun sensors answer NaN.
    pub(crate) sensor_nan: bool,
}

/// Orbit, attitude and sensors.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    seed: u64,
    orbit: Orbit,
    attitude: Attitude,
    gyro_bias_rad_s: Vec3,
}

/// Everything the sensors measure, in body axes.
struct Sensed {
    place: Place,
    rotation: Rotation,
    omega_rad_s: Vec3,
    mag_t: Vec3,
    accel_m_s2: Vec3,
    css: [f64; 6],
    rad: f64,
    temp_c: f64,
}

impl Body {
    pub(crate) fn new(seed: u64, now_us: u64, orbit: Orbit) -> Self {
        let pick = |key: u64| f64::from(unit(mix(seed ^ 0xb0d7) ^ key)) * 2.0 - 1.0;
        let from = Rotation::from_mrp([pick(1) * 0.5, pick(2) * 0.5, pick(3) * 0.5]);
        let omega = [pick(4) * 0.06, pick(5) * 0.06, 0.03 + pick(6) * 0.03];
        Self {
            seed,
            orbit,
            attitude: Attitude::tumbling(now_us, from, omega),
            gyro_bias_rad_s: [pick(7) * 2e-3, pick(8) * 2e-3, pick(9) * 2e-3],
        }
    }

    /// The orbit it flies.
    pub(crate) fn orbit(&self) -> &Orbit {
        &self.orbit
    }

    /// It flies another orbit from now on.
    pub(crate) fn set_orbit(&mut self, orbit: Orbit) {
        self.orbit = orbit;
    }

    pub(crate) fn kill_rotation(&mut self, now_us: u64) {
        self.attitude.kill_rotation(now_us);
    }

    pub(crate) fn point_attitude(&mut self, now_us: u64, mrp: [f32; 3]) {
        let target = Rotation::from_mrp(mrp.map(f64::from));
        self.attitude.turn_to(now_us, target, AttitudeMode::AttitudeTarget);
    }

    /// Turns the camera to a place on the ground.
    pub(crate) fn point_ground(&mut self, now_us: u64, utc_ms: u64, latitude_deg: f32, longitude_deg: f32) {
        let place = Place::of(&self.orbit, utc_ms);
        let sight = place.towards_ground(latitude_deg.into(), longitude_deg.into(), utc_ms);
        let target = Rotation::between(CAMERA_AXIS, sight);
        self.attitude.turn_to(now_us, target, AttitudeMode::TrackingTarget);
    }

    /// Turns the camera straight down.
    pub(crate) fn point_nadir(&mut self, now_us: u64, utc_ms: u64) {
        let down = unit_of(scale(Place::of(&self.orbit, utc_ms).r_teme_km, -1.0));
        let target = Rotation::between(CAMERA_AXIS, down);
        self.attitude.turn_to(now_us, target, AttitudeMode::TrackingTarget);
    }

    /// Angular impulse of a torque profile, N·m·s, body axes.
    pub(crate) fn push(&mut self, now_us: u64, impulse_n_m_s: Vec3) {
        self.attitude.push(now_us, impulse_n_m_s);
    }

    pub(crate) fn heartbeat(&self, reading: &Reading) -> Heartbeat {
        let sensed = self.sense(reading);
        let failed = |value: f64| if reading.sensor_nan { f32::NAN } else { value as f32 };
        Heartbeat {
            r_teme_km: sensed.place.r_teme_km.map(|axis| axis as f32),
            v_teme_km_s: sensed.place.v_teme_km_s.map(|axis| axis as f32),
            mag_t: sensed.mag_t.map(failed),
            omega_rad_s: sensed.omega_rad_s.map(failed),
            accel_m_s2: sensed.accel_m_s2.map(failed),
            css: sensed.css.map(failed),
            att_mrp: sensed.rotation.mrp().map(failed),
            rad: sensed.rad as f32,
            temp_c: sensed.temp_c as f32,
            uptime_ms: reading.uptime_ms,
            timestamp_ms: reading.timestamp_ms,
            cam: reading.cam,
        }
    }

    pub(crate) fn adcs_info(&self, reading: &Reading) -> AdcsInfo {
        let sensed = self.sense(reading);
        let failed = |value: f64| if reading.sensor_nan { f32::NAN } else { value as f32 };
        let target = self.attitude.target();
        let error = sensed.rotation.inverse().after(target);
        let (estimator_status, controller_status) = if reading.sensor_nan {
            (STATUS_FAULT, STATUS_FAULT)
        } else {
            (ESTIMATOR_CONVERGED, CONTROLLER_ACTIVE)
        };
        AdcsInfo {
            uptime_ms: reading.uptime_ms,
            mode: self.attitude.mode().code(),
            estimator_status,
            controller_status,
            gyro_rad_s: add(sensed.omega_rad_s, self.gyro_bias_rad_s).map(failed),
            mag_t: sensed.mag_t.map(failed),
            accel_m_s2: sensed.accel_m_s2.map(failed),
            css: sensed.css.map(failed),
            attitude_mrp: sensed.rotation.mrp().map(failed),
            angular_velocity_rad_s: sensed.omega_rad_s.map(failed),
            gyro_bias_rad_s: self.gyro_bias_rad_s.map(failed),
            target_attitude_mrp: target.mrp().map(|axis| axis as f32),
            attitude_error_mrp: error.mrp().map(failed),
            commanded_torque_n_m: self.attitude.torque_n_m(reading.now_us).map(|axis| axis as f32),
        }
    }

    fn sense(&self, reading: &Reading) -> Sensed {
        let place = Place::of(&self.orbit, reading.utc_ms);
        let rotation = self.attitude.rotation(reading.now_us);
        let to_body = rotation.inverse();
        let grain = |channel: u64, size: f64| {
            size * (f64::from(unit(mix(self.seed ^ channel) ^ reading.utc_ms)) - 0.5)
        };
        let grains = |channel: u64, size: f64| {
            [grain(channel, size), grain(channel + 1, size), grain(channel + 2, size)]
        };
        let sun = to_body.turn(place.sun_teme);
        let side = |index: usize, towards: f64| {
            (place.lit * towards.max(0.0) + grain(20 + index as u64, 0.01)).max(0.0)
        };
        let css = [
            side(0, sun[0]),
            side(1, -sun[0]),
            side(2, sun[1]),
            side(3, -sun[1]),
            side(4, sun[2]),
            side(5, -sun[2]),
        ];
        // warmest a while after the sub-solar point, coldest before sunrise
        let ahead = unit_of(add(unit_of(place.r_teme_km), scale(unit_of(place.v_teme_km_s), -0.6)));
        let temp_c = 9.0 + 14.0 * dot(ahead, place.sun_teme) + grain(30, 0.2);
        Sensed {
            omega_rad_s: add(self.attitude.omega_rad_s(reading.now_us), grains(1, 4e-4)),
            mag_t: add(to_body.turn(place.field_teme_t), grains(4, 2e-7)),
            // free fall: what is left is noise of the sensor
            accel_m_s2: grains(7, 6e-3),
            css,
            rad: radiation(&place) + grain(31, 0.4).abs(),
            temp_c,
            rotation,
            place,
        }
    }
}

/// Counts of the radiation sensor: a floor, more near the poles, most over the anomaly.
fn radiation(place: &Place) -> f64 {
    let east = (place.longitude_deg - ANOMALY_DEG[1] + 180.0).rem_euclid(360.0) - 180.0;
    let away =
        length([place.latitude_deg - ANOMALY_DEG[0], east * place.latitude_deg.to_radians().cos(), 0.0]);
    let polar = ((place.latitude_deg.abs() - 62.0) / 8.0).clamp(0.0, 1.0);
    0.8 + 3.0 * polar + 24.0 * (-(away / 22.0).powi(2)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(seed: u64) -> Body {
        Body::new(seed, 0, Orbit::fictional(seed, tle::UtcInstant::from_unix_us(1_790_000_000_000_000)))
    }

    fn reading(now_us: u64) -> Reading {
        Reading {
            now_us,
            utc_ms: 1_790_000_000_000 + now_us / 1000,
            uptime_ms: (now_us / 1000) as u32,
            timestamp_ms: 0,
            cam: true,
            sensor_nan: false,
        }
    }

    #[test]
    fn a_day_of_heartbeats_is_finite_and_plausible() {
        let body = body(11);
        for minute in 0..1_440 {
            let beat = body.heartbeat(&reading(minute * 60_000_000));
            assert!((-20.0..45.0).contains(&beat.temp_c), "{}", beat.temp_c);
            assert!((0.5..40.0).contains(&beat.rad));
            assert!(beat.css.iter().all(|side| (0.0..1.1).contains(side)));
            assert!(beat.omega_rad_s.iter().all(|axis| axis.abs() < 0.2));
            assert!(beat.att_mrp.iter().all(|axis| axis.abs() <= 1.0));
            assert!(beat.mag_t.iter().all(|axis| axis.abs() < 7e-5));
        }
    }

    #[test]
    fn failed_sensors_say_nan_and_the_rest_goes_on() {
        let body = body(11);
        let beat = body.heartbeat(&Reading { sensor_nan: true, ..reading(0) });
        assert!(beat.omega_rad_s.iter().chain(&beat.css).all(|value| value.is_nan()));
        assert!(beat.r_teme_km.iter().all(|axis| axis.is_finite()) && beat.temp_c.is_finite());
        assert_eq!(
            body.adcs_info(&Reading { sensor_nan: true, ..reading(0) }).estimator_status,
            STATUS_FAULT
        );
    }

    #[test]
    fn pointing_settles_at_the_target() {
        let mut body = body(2);
        body.point_attitude(0, [0.1, 0.2, -0.1]);
        let info = body.adcs_info(&reading(600_000_000));
        assert_eq!(info.mode, 1);
        assert!(info.attitude_error_mrp.iter().all(|axis| axis.abs() < 1e-3));
        body.point_nadir(600_000_000, 1_790_000_600_000);
        assert_eq!(body.adcs_info(&reading(601_000_000)).mode, 2);
        body.kill_rotation(700_000_000);
        assert_eq!(body.adcs_info(&reading(701_000_000)).mode, 0);
    }
}
