//! How the twin turns: closed forms between commands, so that jumping an hour ahead costs what a second does.

use crate::vector::{Rotation, Vec3, add, length, scale, unit_of};

/// Time in which a commanded rotation dies down to 1/e, s.
const SETTLE_S: f64 = 45.0;
/// The same for the tumbling of a satellite nobody controls, s: residual magnetism.
const TUMBLE_S: f64 = 4_000.0;
/// Moment of inertia of a 1U satellite, kg·m².
const INERTIA_KG_M2: f64 = 1.7e-3;
/// Faster than this no torque makes it, rad/s.
const RATE_MAX_RAD_S: f64 = 1.5;

/// What attitude control is told to do (codes of AdcsInfo).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AttitudeMode {
    VelocityKill,
    AttitudeTarget,
    TrackingTarget,
}

impl AttitudeMode {
    pub(crate) const fn code(self) -> u8 {
        match self {
            Self::VelocityKill => 0,
            Self::AttitudeTarget => 1,
            Self::TrackingTarget => 2,
        }
    }
}

/// A stretch of motion about one axis: the rate decays from `rate_rad_s` to nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attitude {
    since_us: u64,
    from: Rotation,
    axis: Vec3,
    rate_rad_s: f64,
    decay_s: f64,
    mode: AttitudeMode,
    target: Rotation,
}

impl Attitude {
    /// Tumbling freely.
    pub(crate) fn tumbling(now_us: u64, from: Rotation, omega_rad_s: Vec3) -> Self {
        Self {
            since_us: now_us,
            from,
            axis: unit_of(omega_rad_s),
            rate_rad_s: length(omega_rad_s),
            decay_s: TUMBLE_S,
            mode: AttitudeMode::VelocityKill,
            target: from,
        }
    }

    /// Rotation from body axes to TEME.
    pub(crate) fn rotation(&self, now_us: u64) -> Rotation {
        let angle = self.rate_rad_s * self.decay_s * (1.0 - self.fade(now_us));
        self.from.after(Rotation::about(self.axis, angle))
    }

    /// Angular velocity in body axes, rad/s.
    pub(crate) fn omega_rad_s(&self, now_us: u64) -> Vec3 {
        scale(self.axis, self.rate_rad_s * self.fade(now_us))
    }

    /// Torque of the controller in body axes, N·m.
    pub(crate) fn torque_n_m(&self, now_us: u64) -> Vec3 {
        scale(self.omega_rad_s(now_us), -INERTIA_KG_M2 / self.decay_s)
    }

    pub(crate) const fn mode(&self) -> AttitudeMode {
        self.mode
    }

    pub(crate) const fn target(&self) -> Rotation {
        self.target
    }

    /// Lets every rotation die down.
    pub(crate) fn kill_rotation(&mut self, now_us: u64) {
        let omega = self.omega_rad_s(now_us);
        *self = Self { decay_s: SETTLE_S, ..Self::tumbling(now_us, self.rotation(now_us), omega) };
    }

    /// Turns to an attitude and stays there.
    pub(crate) fn turn_to(&mut self, now_us: u64, target: Rotation, mode: AttitudeMode) {
        let from = self.rotation(now_us);
        let (axis, angle) = from.inverse().after(target).axis_angle();
        *self = Self {
            since_us: now_us,
            from,
            axis,
            rate_rad_s: angle / SETTLE_S,
            decay_s: SETTLE_S,
            mode,
            target,
        };
    }

    /// What an angular impulse in body axes (N·m·s) leaves behind.
    pub(crate) fn push(&mut self, now_us: u64, impulse_n_m_s: Vec3) {
        let gained = scale(impulse_n_m_s, 1.0 / INERTIA_KG_M2);
        let omega = add(self.omega_rad_s(now_us), gained);
        let rate = length(omega).min(RATE_MAX_RAD_S);
        *self = Self::tumbling(now_us, self.rotation(now_us), scale(unit_of(omega), rate));
    }

    fn fade(&self, now_us: u64) -> f64 {
        (-(now_us.saturating_sub(self.since_us) as f64) / 1e6 / self.decay_s).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> Attitude {
        Attitude::tumbling(0, Rotation::about([0.0, 0.0, 1.0], 0.4), [0.02, -0.05, 0.03])
    }

    #[test]
    fn the_spin_decays_and_faster_when_told_to() {
        let mut attitude = start();
        let first = length(attitude.omega_rad_s(0));
        let later = length(attitude.omega_rad_s(600_000_000));
        assert!(later < first && later > first * 0.8);
        attitude.kill_rotation(600_000_000);
        assert!(length(attitude.omega_rad_s(900_000_000)) < first * 0.01);
    }

    #[test]
    fn commands_never_make_the_attitude_jump() {
        let mut attitude = start();
        let at = 77_000_000;
        let before = attitude.rotation(at).turn([1.0, 0.0, 0.0]);
        attitude.turn_to(at, Rotation::from_mrp([0.3, 0.1, -0.2]), AttitudeMode::AttitudeTarget);
        let after = attitude.rotation(at).turn([1.0, 0.0, 0.0]);
        assert!(length(add(before, scale(after, -1.0))) < 1e-9);
        let settled = attitude.rotation(at + 1_000_000_000).mrp();
        assert!(length(add(settled, [-0.3, -0.1, 0.2])) < 1e-6);
    }

    #[test]
    fn a_push_changes_the_rate_by_impulse_over_inertia() {
        let mut attitude = Attitude::tumbling(0, Rotation::from_mrp([0.0; 3]), [0.0; 3]);
        attitude.push(0, [1.7e-4, 0.0, 0.0]);
        assert!((attitude.omega_rad_s(0)[0] - 0.1).abs() < 1e-9);
        attitude.push(0, [1e30, 0.0, 0.0]);
        assert!(attitude.omega_rad_s(0)[0] <= RATE_MAX_RAD_S);
    }
}
