//! Ticks of time in UTC, and scales of values whose labels are round numbers.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::Offset;

const SECOND_US: i64 = 1_000_000;
const DAY_US: i64 = 86_400 * SECOND_US;

/// Steps between ticks in microseconds.
const STEPS_US: [i64; 27] = [
    1_000,
    2_000,
    5_000,
    10_000,
    20_000,
    50_000,
    100_000,
    200_000,
    500_000,
    SECOND_US,
    2 * SECOND_US,
    5 * SECOND_US,
    10 * SECOND_US,
    15 * SECOND_US,
    30 * SECOND_US,
    60 * SECOND_US,
    120 * SECOND_US,
    300 * SECOND_US,
    600 * SECOND_US,
    900 * SECOND_US,
    1_800 * SECOND_US,
    3_600 * SECOND_US,
    2 * 3_600 * SECOND_US,
    3 * 3_600 * SECOND_US,
    6 * 3_600 * SECOND_US,
    12 * 3_600 * SECOND_US,
    DAY_US,
];

/// Moments for ticks from `from_us` to `to_us`, at most `most` of them, with the step between them: full seconds,
/// minutes, hours, days, months or years of UTC.
pub(super) fn time_ticks(from_us: i64, to_us: i64, most: usize) -> (Vec<i64>, i64) {
    let wanted_us = (to_us - from_us) / most.max(1) as i64;
    if let Some(&step_us) = STEPS_US.iter().find(|&&step_us| step_us >= wanted_us) {
        return (multiples(from_us, to_us, step_us), step_us);
    }
    // Of a calendar: months, and for still longer stretches years.
    let months = [1_i64, 3, 6, 12, 24, 60, 120, 240, 600].into_iter();
    let months = months.clone().find(|months| months * 28 * DAY_US > wanted_us).unwrap_or(1_200);
    for days in [2, 5, 10] {
        if days * DAY_US > wanted_us {
            return (multiples(from_us, to_us, days * DAY_US), days * DAY_US);
        }
    }
    let mut ticks = Vec::new();
    let first = civil(from_us);
    let mut month = i64::from(first.year()) * 12 + i64::from(first.month()) - 1;
    month = month.div_euclid(months) * months;
    while ticks.len() <= most + 2 {
        let (year, of_year) = (month.div_euclid(12), month.rem_euclid(12) + 1);
        let date =
            i16::try_from(year).ok().and_then(|year| DateTime::new(year, of_year as i8, 1, 0, 0, 0, 0).ok());
        let Some(tick) = date.and_then(|date| Offset::UTC.to_timestamp(date).ok()) else { break };
        if tick.as_microsecond() > to_us {
            break;
        }
        if tick.as_microsecond() >= from_us {
            ticks.push(tick.as_microsecond());
        }
        month += months;
    }
    (ticks, months * 30 * DAY_US)
}

fn multiples(from_us: i64, to_us: i64, step_us: i64) -> Vec<i64> {
    let first = from_us.div_euclid(step_us) + i64::from(from_us.rem_euclid(step_us) > 0);
    (first..=to_us.div_euclid(step_us)).map(|count| count * step_us).collect()
}

/// The text of a tick: the date at midnight, else as much of the time as the step needs, with the letter of UTC.
pub(super) fn tick_text(at_us: i64, step_us: i64) -> String {
    let time = civil(at_us);
    if step_us >= 12 * 30 * DAY_US {
        return time.strftime("%Y").to_string();
    }
    if step_us >= 28 * DAY_US {
        return time.strftime("%Y-%m").to_string();
    }
    if at_us.rem_euclid(DAY_US) == 0 {
        return time.strftime("%Y-%m-%d").to_string();
    }
    if step_us >= 60 * SECOND_US {
        return time.strftime("%H:%MZ").to_string();
    }
    if step_us >= SECOND_US {
        return time.strftime("%H:%M:%SZ").to_string();
    }
    format!("{}.{:03}Z", time.strftime("%H:%M:%S"), time.subsec_nanosecond() / 1_000_000)
}

fn civil(at_us: i64) -> DateTime {
    Offset::UTC.to_datetime(Timestamp::from_microsecond(at_us).unwrap_or(Timestamp::UNIX_EPOCH))
}

/// A scale of values, cut into equal steps of a round number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Value at the lower end.
    pub(super) low: f64,
    /// Value from one mark to the next.
    pub(super) step: f64,
    /// Number of steps.
    pub(super) steps: usize,
}

impl Scale {
    /// The scale that holds both values with the least waste.
    pub(super) fn holding(low: f64, high: f64, steps: usize) -> Self {
        let steps = steps.max(1);
        // One value, or none that a float can tell apart: some room around it.
        let room = (low.abs().max(high.abs()) * 1e-9).max(1e-12);
        let (low, high) = if high - low < room {
            let around = if low == 0.0 { 1.0 } else { low.abs() * 0.05 };
            (low - around, high + around)
        } else {
            (low, high)
        };
        let raw = (high - low) / steps as f64;
        let mut exponent = raw.log10().floor();
        loop {
            for factor in [1.0, 2.0, 2.5, 5.0] {
                let step = factor * 10_f64.powf(exponent);
                let start = (low / step + 1e-9).floor() * step;
                if start + step * steps as f64 >= high - step * 1e-9 {
                    return Self { low: start, step, steps };
                }
            }
            exponent += 1.0;
        }
    }

    /// 0 at the lower end, 1 at the upper one.
    pub(super) fn part(&self, value: f64) -> f64 {
        (value - self.low) / (self.step * self.steps as f64)
    }

    /// The value at a part.
    pub(super) fn value(&self, part: f64) -> f64 {
        self.low + part * self.step * self.steps as f64
    }

    /// Decimals that its marks need.
    pub(super) fn decimals(&self) -> usize {
        let exponent = self.step.log10().floor();
        let is_quarter = (self.step / 10_f64.powf(exponent) - 2.5).abs() < 0.01;
        (-exponent + f64::from(u8::from(is_quarter))).clamp(0.0, 9.0) as usize
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn us(text: &str) -> i64 {
        text.parse::<Timestamp>().unwrap().as_microsecond()
    }

    #[test]
    fn midnight_has_the_date_and_all_else_the_letter_of_utc() {
        let (ticks, step_us) = time_ticks(us("2026-11-21T20:00:00Z"), us("2026-11-22T04:00:00Z"), 5);
        let texts: Vec<String> = ticks.iter().map(|&tick| tick_text(tick, step_us)).collect();
        assert_eq!(texts, ["20:00Z", "22:00Z", "2026-11-22", "02:00Z", "04:00Z"]);
        let (ticks, step_us) = time_ticks(us("2026-01-30T00:00:00Z"), us("2026-08-02T00:00:00Z"), 8);
        let texts: Vec<String> = ticks.iter().map(|&tick| tick_text(tick, step_us)).collect();
        assert_eq!(texts, ["2026-02", "2026-03", "2026-04", "2026-05", "2026-06", "2026-07", "2026-08"]);
        assert_eq!(tick_text(us("2026-11-22T14:03:07.25Z"), 50_000), "14:03:07.250Z");
    }

    proptest! {
        #[test]
        fn ticks_lie_inside_and_are_never_too_many(
            from_us in 0_i64..4_000_000_000_000_000, length in 3.0_f64..15.2, most in 2_usize..12,
        ) {
            let to_us = from_us + 10_f64.powf(length) as i64;
            let (ticks, _) = time_ticks(from_us, to_us, most);
            prop_assert!(ticks.iter().all(|tick| (from_us..=to_us).contains(tick)));
            prop_assert!(ticks.is_sorted());
            prop_assert!(ticks.len() <= most + 1, "{} of {most}", ticks.len());
        }

        #[test]
        fn a_scale_holds_its_values_and_wastes_little(
            low in -1e3..1e3_f64, size in -4.0..6.0_f64, steps in 2_usize..8,
        ) {
            let high = low + 10_f64.powf(size);
            let scale = Scale::holding(low, high, steps);
            let room = 1e-6 + scale.step * 1e-6;
            prop_assert!(scale.low <= low + room && scale.value(1.0) >= high - room, "{scale:?}");
            prop_assert!(scale.step * steps as f64 <= (high - low) * 6.0 + room, "{scale:?} for {low} {high}");
        }
    }

    #[test]
    fn marks_are_round_numbers() {
        assert_eq!(Scale::holding(7.31, 8.22, 4), Scale { low: 7.25, step: 0.25, steps: 4 });
        assert_eq!(Scale::holding(7.31, 8.22, 4).decimals(), 2);
        assert_eq!(Scale::holding(-40.0, 85.0, 3).decimals(), 0);
        assert!(Scale::holding(0.0, 0.0, 4).step > 0.0);
    }
}
