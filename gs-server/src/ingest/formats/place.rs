//! Where a receiver is, from the grid square in the name of an observer (`Y0UR-JO62qn`).

/// Latitude and longitude in degrees of the middle of a Maidenhead locator of 4 or 6 characters at the end of the name.
pub(super) fn of_observer(observer: &str) -> Option<(f64, f64)> {
    let locator = observer.rsplit('-').next().filter(|locator| locator.len() < observer.len())?;
    let characters: Vec<u8> = locator.to_ascii_uppercase().bytes().collect();
    let within = |at: usize, first: u8, count: u8| {
        let value = characters.get(at)?.checked_sub(first)?;
        (value < count).then_some(f64::from(value))
    };
    let mut longitude = within(0, b'A', 18)? * 20.0 - 180.0 + within(2, b'0', 10)? * 2.0;
    let mut latitude = within(1, b'A', 18)? * 10.0 - 90.0 + within(3, b'0', 10)?;
    match characters.len() {
        4 => {
            longitude += 1.0;
            latitude += 0.5;
        }
        6 => {
            longitude += (within(4, b'A', 24)? + 0.5) / 12.0;
            latitude += (within(5, b'A', 24)? + 0.5) / 24.0;
        }
        _ => return None,
    }
    Some((latitude, longitude))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_square_is_a_place() {
        let (latitude, longitude) = of_observer("DL0XYZ-JO62qn").unwrap();
        assert!(
            (latitude - 52.5625).abs() < 0.03 && (longitude - 13.375).abs() < 0.05,
            "{latitude} {longitude}"
        );
        assert_eq!(of_observer("X-AA00"), Some((-89.5, -179.0)));
        for wrong in ["", "JO62qn", "X-", "X-JO6", "X-ZZ62qn", "X-JO62q\u{e4}"] {
            assert_eq!(of_observer(wrong), None, "{wrong}");
        }
    }
}
