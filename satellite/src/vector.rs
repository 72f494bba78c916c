//! Three-dimensional vectors and rotations, as little as the twin needs.

/// A vector.
pub(crate) type Vec3 = [f64; 3];

pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn scale(a: Vec3, by: f64) -> Vec3 {
    a.map(|axis| axis * by)
}

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// The direction of a vector; +Z for one without.
pub(crate) fn unit_of(a: Vec3) -> Vec3 {
    let length = length(a);
    if length > 0.0 { scale(a, 1.0 / length) } else { [0.0, 0.0, 1.0] }
}

/// A rotation from body axes to TEME, as a unit quaternion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rotation {
    w: f64,
    v: Vec3,
}

impl Rotation {
    /// Turns by `angle_rad` about a unit axis.
    pub(crate) fn about(axis: Vec3, angle_rad: f64) -> Self {
        let (sin, cos) = (angle_rad / 2.0).sin_cos();
        Self { w: cos, v: scale(axis, sin) }
    }

    /// From modified Rodrigues parameters.
    pub(crate) fn from_mrp(mrp: Vec3) -> Self {
        let square = dot(mrp, mrp);
        Self { w: (1.0 - square) / (1.0 + square), v: scale(mrp, 2.0 / (1.0 + square)) }
    }

    /// As modified Rodrigues parameters of at most length 1.
    pub(crate) fn mrp(self) -> Vec3 {
        let sign = if self.w < 0.0 { -1.0 } else { 1.0 };
        scale(self.v, sign / (1.0 + self.w.abs()))
    }

    /// The shortest turn that brings one unit vector onto another.
    pub(crate) fn between(from: Vec3, to: Vec3) -> Self {
        let cosine = dot(from, to);
        if cosine < -0.999_999 {
            let aside = if from[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            return Self::about(unit_of(cross(from, aside)), std::f64::consts::PI);
        }
        Self { w: 1.0 + cosine, v: cross(from, to) }.normalised()
    }

    /// `self` after `first`.
    pub(crate) fn after(self, first: Self) -> Self {
        let v = add(add(scale(first.v, self.w), scale(self.v, first.w)), cross(self.v, first.v));
        Self { w: self.w * first.w - dot(self.v, first.v), v }.normalised()
    }

    pub(crate) fn inverse(self) -> Self {
        Self { w: self.w, v: scale(self.v, -1.0) }
    }

    /// Turns a vector.
    pub(crate) fn turn(self, a: Vec3) -> Vec3 {
        let twice = scale(cross(self.v, a), 2.0);
        add(add(a, scale(twice, self.w)), cross(self.v, twice))
    }

    /// Unit axis and angle, 0..=π.
    pub(crate) fn axis_angle(self) -> (Vec3, f64) {
        let sign = if self.w < 0.0 { -1.0 } else { 1.0 };
        (unit_of(scale(self.v, sign)), 2.0 * length(self.v).atan2(self.w.abs()))
    }

    fn normalised(self) -> Self {
        let norm = (self.w * self.w + dot(self.v, self.v)).sqrt();
        if norm > 0.0 {
            Self { w: self.w / norm, v: scale(self.v, 1.0 / norm) }
        } else {
            Self { w: 1.0, v: [0.0; 3] }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Vec3, b: Vec3) -> bool {
        length(add(a, scale(b, -1.0))) < 1e-9
    }

    #[test]
    fn a_quarter_turn_about_z_brings_x_to_y() {
        let turn = Rotation::about([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2);
        assert!(close(turn.turn([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]));
        assert!(close(turn.inverse().turn([0.0, 1.0, 0.0]), [1.0, 0.0, 0.0]));
        assert!(close(turn.after(turn).turn([1.0, 0.0, 0.0]), [-1.0, 0.0, 0.0]));
    }

    #[test]
    fn mrp_goes_there_and_back() {
        let turn = Rotation::about(unit_of([1.0, -2.0, 0.5]), 2.5);
        let again = Rotation::from_mrp(turn.mrp());
        assert!(close(turn.turn([0.3, 0.4, 0.5]), again.turn([0.3, 0.4, 0.5])));
        assert!(length(Rotation::about([1.0, 0.0, 0.0], 5.0).mrp()) <= 1.0);
    }

    #[test]
    fn between_also_turns_a_vector_onto_its_opposite() {
        for to in [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]] {
            assert!(close(Rotation::between([1.0, 0.0, 0.0], to).turn([1.0, 0.0, 0.0]), to));
        }
    }
}
