//! Turning vectors, and seeing them from somewhere.

/// A vector in space.
pub(super) type Vector = [f64; 3];

/// Turns a vector by a unit quaternion (w, x, y, z).
pub(super) fn turn([w, x, y, z]: [f64; 4], v: Vector) -> Vector {
    let axis = [x, y, z];
    let t = cross(axis, v).map(|part| 2.0 * part);
    let u = cross(axis, t);
    [v[0] + w * t[0] + u[0], v[1] + w * t[1] + u[1], v[2] + w * t[2] + u[2]]
}

/// The quaternion of length one; none for one that has no direction.
pub(super) fn unit4(q: [f64; 4]) -> Option<[f64; 4]> {
    let length = q.iter().map(|part| part * part).sum::<f64>().sqrt();
    (length.is_finite() && length > 1e-9).then(|| q.map(|part| part / length))
}

/// The vector of length one; none for one that has no direction.
pub(super) fn unit(v: Vector) -> Option<Vector> {
    let length = dot(v, v).sqrt();
    (length.is_finite() && length > 1e-12).then(|| v.map(|part| part / length))
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn scaled(v: Vector, by: f64) -> Vector {
    v.map(|part| part * by)
}

/// The angle between two directions in degrees.
pub(super) fn angle_deg(a: Vector, b: Vector) -> Option<f64> {
    let (a, b) = (unit(a)?, unit(b)?);
    Some(dot(a, b).clamp(-1.0, 1.0).acos().to_degrees())
}

/// As seen from a place at this azimuth and elevation of the frame, whose third axis points up: to the right, upwards,
/// towards the one who looks.
pub(super) fn seen(v: Vector, azimuth_deg: f64, elevation_deg: f64) -> Vector {
    let (sa, ca) = azimuth_deg.to_radians().sin_cos();
    let (se, ce) = elevation_deg.to_radians().sin_cos();
    let towards = [ce * ca, ce * sa, se];
    let right = [-sa, ca, 0.0];
    let up = cross(towards, right);
    [dot(v, right), dot(v, up), dot(v, towards)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn near(a: Vector, b: Vector) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert!(near(turn([half, 0.0, 0.0, half], [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]));
        assert!(near(turn([half, half, 0.0, 0.0], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]));
    }

    #[test]
    fn from_above_x_points_down_and_y_to_the_right() {
        assert!(near(seen([1.0, 0.0, 0.0], 0.0, 90.0), [0.0, -1.0, 0.0]));
        assert!(near(seen([0.0, 1.0, 0.0], 0.0, 90.0), [1.0, 0.0, 0.0]));
        assert!(near(seen([0.0, 0.0, 1.0], 123.0, 0.0), [0.0, 1.0, 0.0]));
    }

    proptest! {
        #[test]
        fn neither_turning_nor_looking_changes_lengths(
            q in prop::array::uniform4(-1.0..1.0_f64), v in prop::array::uniform3(-5.0..5.0_f64),
            azimuth in -360.0..360.0_f64, elevation in -90.0..90.0_f64,
        ) {
            prop_assume!(unit4(q).is_some());
            let turned = turn(unit4(q).unwrap(), v);
            prop_assert!((dot(turned, turned) - dot(v, v)).abs() < 1e-6);
            let seen = seen(v, azimuth, elevation);
            prop_assert!((dot(seen, seen) - dot(v, v)).abs() < 1e-6);
        }
    }
}
