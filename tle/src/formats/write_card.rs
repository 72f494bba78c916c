//! The two lines of a TLE from elements, as far as they fit.

use super::card::{FIRST_YEAR, checksum};
use super::{ALPHA5_MAX, WriteError, catalogue};
use crate::elements::Elements;
use crate::time::{DAY_US, UtcInstant, civil_from_days, days_from_civil};

/// The last digit of a TLE's epoch in microseconds.
const EPOCH_COUNT_US: i64 = 864;

/// Lines 1 and 2.
pub(super) fn pair(elements: &Elements) -> Result<[String; 2], WriteError> {
    let refuse = |field: &'static str, wanted: &'static str| WriteError::DoesNotFit {
        object: elements.label(),
        field,
        wanted,
    };
    let number = elements.norad_cat_id.unwrap_or(0);
    let number = catalogue::to_columns(number).ok_or_else(|| WriteError::NumberTooGreat {
        object: elements.label(),
        found: number,
        max: ALPHA5_MAX,
    })?;
    let epoch = epoch(elements.epoch).ok_or_else(|| refuse("EPOCH", "1957 to 2056"))?;
    let dot = fixed_dot(elements.mean_motion_dot)
        .ok_or_else(|| refuse("MEAN_MOTION_DOT", "less than 1 rev/day^2"))?;
    let ddot = with_exponent(elements.mean_motion_ddot)
        .ok_or_else(|| refuse("MEAN_MOTION_DDOT", "less than 1e9 rev/day^3"))?;
    let bstar = with_exponent(elements.bstar).ok_or_else(|| refuse("BSTAR", "less than 1e9"))?;
    let set_number =
        elements.element_set_no.map_or_else(|| "    ".to_owned(), |n| format!("{:4}", n % 10_000));
    let first = format!(
        "1 {number}{} {:8} {epoch} {dot} {ddot} {bstar} {} {set_number}",
        elements.classification.unwrap_or(' '),
        designator(elements.object_id.as_deref()),
        elements.ephemeris_type.filter(|&kind| kind < 10).map_or(' ', |kind| char::from(b'0' + kind)),
    );
    let angles = [
        ("INCLINATION", elements.inclination_deg),
        ("RA_OF_ASC_NODE", elements.raan_deg),
        ("ARG_OF_PERICENTER", elements.arg_of_perigee_deg),
        ("MEAN_ANOMALY", elements.mean_anomaly_deg),
    ];
    for (field, degrees) in angles {
        if !(-99.0..1000.0).contains(&degrees) {
            return Err(refuse(field, "-99 to 360 degrees"));
        }
    }
    if !(0.0..99.999_999_99).contains(&elements.mean_motion_rev_day) {
        return Err(refuse("MEAN_MOTION", "less than 100 rev/day"));
    }
    if !(0.0..1.0).contains(&elements.eccentricity) {
        return Err(refuse("ECCENTRICITY", "0 to below 1"));
    }
    // Rounding must not make a 1 of 0.99999999: seven digits hold no 1.
    let eccentricity = (elements.eccentricity * 1e7).round().min(9_999_999.0) as u32;
    let revolution =
        elements.rev_at_epoch.map_or_else(|| "     ".to_owned(), |n| format!("{:5}", n % 100_000));
    let second = format!(
        "2 {number} {:8.4} {:8.4} {eccentricity:07} {:8.4} {:8.4} {:11.8}{revolution}",
        elements.inclination_deg,
        elements.raan_deg,
        elements.arg_of_perigee_deg,
        elements.mean_anomaly_deg,
        elements.mean_motion_rev_day,
    );
    Ok([first, second].map(|line| {
        let digit = checksum(&line);
        format!("{line}{digit}")
    }))
}

/// Year and day of the year with eight decimals.
fn epoch(epoch: UtcInstant) -> Option<String> {
    let unix_us = epoch.unix_us();
    let rounded = (unix_us + EPOCH_COUNT_US / 2).div_euclid(EPOCH_COUNT_US) * EPOCH_COUNT_US;
    let (year, _, _) = civil_from_days(rounded.div_euclid(DAY_US));
    if !(1900 + FIRST_YEAR..2000 + FIRST_YEAR).contains(&year) {
        return None;
    }
    let of_year_us = rounded - days_from_civil(year, 1, 1) * DAY_US;
    let day = of_year_us / DAY_US + 1;
    let decimals = of_year_us % DAY_US / EPOCH_COUNT_US;
    Some(format!("{:02}{day:03}.{decimals:08}", year % 100))
}

/// Sign, point and eight digits.
fn fixed_dot(value: f64) -> Option<String> {
    let counts = (value.abs() * 1e8).round();
    let sign = if value < 0.0 { '-' } else { ' ' };
    (counts < 1e8).then(|| format!("{sign}.{:08}", counts as u64))
}

/// Sign, five digits after an implied point, and a signed power of ten of one digit.
fn with_exponent(value: f64) -> Option<String> {
    let sign = if value < 0.0 { '-' } else { ' ' };
    let size = value.abs();
    if size == 0.0 {
        return Some(" 00000+0".to_owned());
    }
    // Rust writes 1.2345e-3; here it is 0.12345e-2. Below 1e-10 the digits move right under the smallest power.
    let text = format!("{size:.4e}");
    let (mantissa, exponent) = text.split_once('e')?;
    let exponent = exponent.parse::<i32>().ok()? + 1;
    if exponent > 9 {
        return None;
    }
    if exponent < -9 {
        let counts = (size * 1e14).round() as u64;
        return Some(format!("{sign}{counts:05}-9"));
    }
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    let exponent_sign = if exponent < 0 || (exponent == 0 && size < 1.0) { '-' } else { '+' };
    Some(format!("{sign}{digits}{exponent_sign}{}", exponent.abs()))
}

/// Eight columns: `98067A` of `1998-067A`; whatever else fits as it is; nothing for what does not.
fn designator(object_id: Option<&str>) -> String {
    let Some(id) = object_id else { return String::new() };
    if let Some((year, piece)) = id.split_once('-')
        && let Ok(number) = year.parse::<i64>()
        && year.len() == 4
        && (1900 + FIRST_YEAR..2000 + FIRST_YEAR).contains(&number)
        && (4..=6).contains(&piece.len())
        && piece.is_ascii()
    {
        return format!("{:02}{piece}", number % 100);
    }
    if id.len() <= 8 && id.bytes().all(|byte| (b' '..=b'~').contains(&byte)) {
        id.to_owned()
    } else {
        String::new()
    }
}
