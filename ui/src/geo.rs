//! Places on the Earth as the maps need them: degrees, and lines made whole where a flat map would cut them.

/// A place: longitude east and latitude north in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Place {
    /// East of Greenwich, degrees; any turn is understood.
    pub longitude_deg: f64,
    /// North of the equator, degrees, −90 to 90.
    pub latitude_deg: f64,
}

impl Place {
    /// A place by longitude east and latitude north, degrees.
    #[must_use]
    pub const fn new(longitude_deg: f64, latitude_deg: f64) -> Self {
        Self { longitude_deg, latitude_deg }
    }
}

/// The angle brought to −180 (included) .. 180 degrees.
#[must_use]
pub fn wrap_deg(angle_deg: f64) -> f64 {
    if (-180.0..180.0).contains(&angle_deg) {
        return angle_deg;
    }
    let turned = (angle_deg + 180.0).rem_euclid(360.0) - 180.0;
    // rem_euclid of a tiny negative number rounds to the divisor itself
    if turned >= 180.0 { -180.0 } else { turned }
}

/// A line whose longitudes go on over ±180 instead of jumping: each lies within 180 degrees of the one before it, and
/// the middle of them all in −180..180. What is drawn of it at −360, 0 and +360 degrees is the line on a flat map.
#[must_use]
pub fn unroll(line: impl IntoIterator<Item = Place>) -> Vec<Place> {
    let mut unrolled: Vec<Place> = Vec::new();
    for place in line {
        let longitude_deg = match unrolled.last() {
            Some(last) => last.longitude_deg + wrap_deg(place.longitude_deg - last.longitude_deg),
            None => wrap_deg(place.longitude_deg),
        };
        unrolled.push(Place { longitude_deg, ..place });
    }
    let (low, high) = span_deg(&unrolled);
    let middle = (low + high) / 2.0;
    let shift = if middle.is_finite() { wrap_deg(middle) - middle } else { 0.0 };
    for place in &mut unrolled {
        place.longitude_deg += shift;
    }
    unrolled
}

/// A ring (the last corner leads to the first) as an area of a flat map: unrolled, and closed along the map's edge at
/// the pole when it goes round one.
#[must_use]
pub fn area(ring: &[Place]) -> Vec<Place> {
    let Some(&first) = ring.first() else { return Vec::new() };
    let mut area = unroll(ring.iter().copied().chain([first]));
    let (Some(start), Some(end)) = (area.first().copied(), area.last().copied()) else { return area };
    if (end.longitude_deg - start.longitude_deg).abs() > 180.0 {
        let mean = ring.iter().map(|place| place.latitude_deg).sum::<f64>() / ring.len() as f64;
        let pole = if mean < 0.0 { -90.0 } else { 90.0 };
        area.push(Place::new(end.longitude_deg, pole));
        area.push(Place::new(start.longitude_deg, pole));
    } else {
        area.pop();
    }
    area
}

/// The least and the greatest longitude, degrees.
#[must_use]
pub fn span_deg(line: &[Place]) -> (f64, f64) {
    line.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
        (low.min(place.longitude_deg), high.max(place.longitude_deg))
    })
}

/// The circle of this radius round a place, closed, with so many corners: a footprint, a beam.
#[must_use]
pub fn circle(centre: Place, radius_deg: f64, corners: u32) -> Vec<Place> {
    let (sin_radius, cos_radius) = radius_deg.to_radians().sin_cos();
    let (sin_latitude, cos_latitude) = centre.latitude_deg.to_radians().sin_cos();
    (0..=corners)
        .map(|corner| {
            let bearing = f64::from(corner) / f64::from(corners.max(1)) * std::f64::consts::TAU;
            let (sin_bearing, cos_bearing) = bearing.sin_cos();
            let sine = sin_latitude * cos_radius + cos_latitude * sin_radius * cos_bearing;
            let east = (sin_bearing * sin_radius * cos_latitude).atan2(cos_radius - sin_latitude * sine);
            Place::new(
                wrap_deg(centre.longitude_deg + east.to_degrees()),
                sine.clamp(-1.0, 1.0).asin().to_degrees(),
            )
        })
        .collect()
}

/// How high the Sun stands at a place when it is overhead at `subsolar`, degrees.
#[must_use]
pub fn sun_elevation_deg(at: Place, subsolar: Place) -> f64 {
    let (sin_here, cos_here) = at.latitude_deg.to_radians().sin_cos();
    let (sin_sun, cos_sun) = subsolar.latitude_deg.to_radians().sin_cos();
    let hour = (at.longitude_deg - subsolar.longitude_deg).to_radians();
    (sin_here * sin_sun + cos_here * cos_sun * hour.cos()).clamp(-1.0, 1.0).asin().to_degrees()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn places() -> impl Strategy<Value = Vec<Place>> {
        prop::collection::vec((-720.0..720.0_f64, -89.0..89.0_f64), 1..40)
            .prop_map(|all| all.into_iter().map(|(x, y)| Place::new(x, y)).collect())
    }

    proptest! {
        #[test]
        fn an_unrolled_line_never_jumps_and_stays_where_it_was(line in places()) {
            let unrolled = unroll(line.iter().copied());
            prop_assert_eq!(unrolled.len(), line.len());
            for pair in unrolled.windows(2) {
                prop_assert!((pair[1].longitude_deg - pair[0].longitude_deg).abs() <= 180.0 + 1e-9);
            }
            for (was, is) in line.iter().zip(&unrolled) {
                prop_assert!(wrap_deg(was.longitude_deg - is.longitude_deg).abs() < 1e-6);
                prop_assert_eq!(was.latitude_deg, is.latitude_deg);
            }
            let (low, high) = span_deg(&unrolled);
            prop_assert!((-180.0 - 1e-6..=180.0 + 1e-6).contains(&((low + high) / 2.0)));
        }

        #[test]
        fn an_angle_is_wrapped_into_one_turn(angle in -1e6..1e6_f64) {
            let wrapped = wrap_deg(angle);
            prop_assert!((-180.0..180.0).contains(&wrapped));
            prop_assert!(((wrapped - angle) / 360.0 - ((wrapped - angle) / 360.0).round()).abs() < 1e-6);
        }

        #[test]
        fn a_circle_has_its_radius(x in -180.0..180.0_f64, y in -89.0..89.0_f64, radius in 1.0..80.0_f64) {
            let centre = Place::new(x, y);
            for place in circle(centre, radius, 16) {
                // The Sun overhead at the centre stands 90° − distance high
                prop_assert!((90.0 - sun_elevation_deg(place, centre) - radius).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn a_ring_round_the_pole_is_closed_at_the_edge_of_the_map() {
        let cap = circle(Place::new(30.0, -80.0), 20.0, 36);
        let area = area(&cap[..36]);
        assert_eq!(area.iter().filter(|place| place.latitude_deg == -90.0).count(), 2);
        let (low, high) = span_deg(&area);
        assert!((high - low - 360.0).abs() < 1e-6, "{low} {high}");
    }

    #[test]
    fn a_ring_over_the_date_line_stays_in_one_piece() {
        let area = area(&[
            Place::new(170.0, 0.0),
            Place::new(-170.0, 0.0),
            Place::new(-170.0, 10.0),
            Place::new(170.0, 10.0),
        ]);
        let (low, high) = span_deg(&area);
        assert_eq!((high - low, area.len()), (20.0, 4));
    }
}
