//! State of attitude determination and control (ICD section 4).

use core::fmt;

use crate::wire::packet;

packet! {
    /// AdcsInfo, 141 bytes. Vectors are in body axes.
    pub struct AdcsInfo (141 bytes) {
        /// Time since boot, ms; wraps after 49.7 days.
        uptime_ms: u32 = ["uptime"], "ms";
        /// Control mode, see [`AdcsInfo::adcs_mode`].
        mode: u8 = ["mode"], "";
        /// Status word of the estimator; bits unknown.
        estimator_status: u16 = ["estimator_status"], "";
        /// Status word of the controller; bits unknown.
        controller_status: u16 = ["controller_status"], "";
        /// Gyroscope, rad/s.
        gyro_rad_s: [f32; 3] = ["gyro.x", "gyro.y", "gyro.z"], "rad/s";
        /// Magnetic field, tesla.
        mag_t: [f32; 3] = ["mag.x", "mag.y", "mag.z"], "T";
        /// Acceleration, m/s².
        accel_m_s2: [f32; 3] = ["accel.x", "accel.y", "accel.z"], "m/s²";
        /// Coarse sun sensors on +X, -X, +Y, -Y, +Z, -Z; unit unknown.
        css: [f32; 6] = ["css.plus_x", "css.minus_x", "css.plus_y", "css.minus_y", "css.plus_z", "css.minus_z"], "";
        /// Estimated attitude, modified Rodrigues parameters.
        attitude_mrp: [f32; 3] = ["attitude.x", "attitude.y", "attitude.z"], "MRP";
        /// Estimated angular velocity, rad/s.
        angular_velocity_rad_s: [f32; 3] = ["angular_velocity.x", "angular_velocity.y", "angular_velocity.z"], "rad/s";
        /// Estimated bias of the gyroscope, rad/s.
        gyro_bias_rad_s: [f32; 3] = ["gyro_bias.x", "gyro_bias.y", "gyro_bias.z"], "rad/s";
        /// Attitude aimed at, modified Rodrigues parameters.
        target_attitude_mrp: [f32; 3] = ["target_attitude.x", "target_attitude.y", "target_attitude.z"], "MRP";
        /// Attitude error, modified Rodrigues parameters.
        attitude_error_mrp: [f32; 3] = ["attitude_error.x", "attitude_error.y", "attitude_error.z"], "MRP";
        /// Torque commanded, N·m.
        commanded_torque_n_m: [f32; 3] = ["commanded_torque.x", "commanded_torque.y", "commanded_torque.z"], "N·m";
    }
}

impl AdcsInfo {
    /// The mode by name.
    #[must_use]
    pub const fn adcs_mode(&self) -> AdcsMode {
        match self.mode {
            0 => AdcsMode::VelocityKill,
            1 => AdcsMode::AttitudeTarget,
            2 => AdcsMode::TrackingTarget,
            other => AdcsMode::Unknown(other),
        }
    }
}

/// What attitude control is doing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum AdcsMode {
    /// Damps every rotation (0).
    VelocityKill,
    /// Holds an attitude (1).
    AttitudeTarget,
    /// Points at a place on the ground (2).
    TrackingTarget,
    /// A code the ICD does not name.
    Unknown(u8),
}

impl fmt::Display for AdcsMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::VelocityKill => f.write_str("VelocityKill"),
            Self::AttitudeTarget => f.write_str("AttitudeTarget"),
            Self::TrackingTarget => f.write_str("TrackingTarget"),
            Self::Unknown(code) => write!(f, "Unknown({code})"),
        }
    }
}
