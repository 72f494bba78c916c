//! Where the antenna should look while an entry is sent.

use tle::vector::{Vec3, cross, dot, norm, scale};

/// The attitude (modified Rodrigues parameters, body against TEME) that brings a body axis straight down over a place
/// `r_teme_km`, by the shortest turn. `None` without a direction.
pub(super) fn nadir_mrp(axis_body: Vec3, r_teme_km: Vec3) -> Option<[f32; 3]> {
    let unit = |v: Vec3| (norm(v) > 1e-9).then(|| scale(v, 1.0 / norm(v)));
    let (axis, down) = (unit(axis_body)?, unit(scale(r_teme_km, -1.0))?);
    let angle = norm(cross(axis, down)).atan2(dot(axis, down));
    let about = unit(cross(axis, down)).or_else(|| {
        // Along the axis already, or straight against it: any direction across will do.
        let aside = if axis[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        unit(cross(axis, aside))
    })?;
    Some(scale(about, (angle / 4.0).tan()).map(|part| part as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns a vector by modified Rodrigues parameters, body to reference.
    fn turned(mrp: Vec3, v: Vec3) -> Vec3 {
        let square = dot(mrp, mrp);
        let (w, q) = ((1.0 - square) / (1.0 + square), scale(mrp, 2.0 / (1.0 + square)));
        let twice = scale(cross(q, v), 2.0);
        tle::vector::add(tle::vector::add(v, scale(twice, w)), cross(q, twice))
    }

    #[test]
    fn axis_looks_down_and_the_turn_is_the_shortest() {
        let places = [[7000.0, 0.0, 0.0], [-3000.0, 5000.0, 4000.0], [0.0, 0.0, -6900.0], [0.0, 0.0, 6900.0]];
        for axis in [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, -0.8, 0.0]] {
            for place in places {
                let mrp = nadir_mrp(axis, place).unwrap().map(f64::from);
                let down = scale(place, -1.0 / norm(place));
                let off = norm(tle::vector::sub(turned(mrp, axis), down));
                assert!(off < 1e-5, "{axis:?} over {place:?}: {mrp:?}");
                assert!(norm(mrp) <= 1.0 + 1e-6, "{mrp:?}");
            }
        }
        assert_eq!(nadir_mrp([0.0; 3], [7000.0, 0.0, 0.0]), None);
    }
}
