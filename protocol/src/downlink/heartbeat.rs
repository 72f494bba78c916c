//! The periodic sign of life (ICD section 4).

use crate::wire::packet;

packet! {
    /// Heartbeat, 117 bytes, every 60 s (240 s at low battery; by profile).
    ///
    /// The paper's table says 113 bytes, its structure adds up to 117: the structure wins. The units are our reading of
    /// it; those of `rad` and the meaning of `cam` are unknown, so they are shown raw.
    pub struct Heartbeat (117 bytes) {
        /// Position, TEME, km.
        r_teme_km: [f32; 3] = ["r_teme.x", "r_teme.y", "r_teme.z"], "km";
        /// Velocity, TEME, km/s.
        v_teme_km_s: [f32; 3] = ["v_teme.x", "v_teme.y", "v_teme.z"], "km/s";
        /// Magnetic field, body axes, tesla.
        mag_t: [f32; 3] = ["mag.x", "mag.y", "mag.z"], "T";
        /// Angular velocity, body axes, rad/s.
        omega_rad_s: [f32; 3] = ["omega.x", "omega.y", "omega.z"], "rad/s";
        /// Acceleration, body axes, m/s².
        accel_m_s2: [f32; 3] = ["accel.x", "accel.y", "accel.z"], "m/s²";
        /// Coarse sun sensors on +X, -X, +Y, -Y, +Z, -Z; unit unknown.
        css: [f32; 6] = ["css.plus_x", "css.minus_x", "css.plus_y", "css.minus_y", "css.plus_z", "css.minus_z"], "";
        /// Attitude, modified Rodrigues parameters.
        att_mrp: [f32; 3] = ["att.x", "att.y", "att.z"], "MRP";
        /// Radiation sensor; unit unknown.
        rad: f32 = ["rad"], "";
        /// Temperature, °C.
        temp_c: f32 = ["temp"], "°C";
        /// Time since boot, ms; wraps after 49.7 days.
        uptime_ms: u32 = ["uptime"], "ms";
        /// Time since 1970 UTC, ms; 0 when the satellite has no clock.
        timestamp_ms: u64 = ["timestamp"], "ms";
        /// Camera flag; meaning unknown.
        cam: bool = ["cam"], "";
    }
}
