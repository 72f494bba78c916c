//! How numbers, units, times and ages are written: everywhere the same, UTC always named, unknown as a dash.

use jiff::tz::TimeZone;
use jiff::{SignedDuration, Timestamp, civil};

/// What stands where nothing is known. Never a zero.
pub const UNKNOWN: &str = "–";

/// A number and its unit, apart, since the unit is drawn dim.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// The figures with their sign, or [`UNKNOWN`].
    pub number: String,
    /// The unit without the space before it; empty when there is none.
    pub unit: String,
}

impl Quantity {
    /// Both as given.
    #[must_use]
    pub fn new(number: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { number: number.into(), unit: unit.into() }
    }

    /// A value with so many decimals; what is not known is a dash without a unit.
    #[must_use]
    pub fn of(value: Option<f64>, decimals: usize, unit: &str) -> Self {
        match value {
            Some(value) => Self::new(number(value, decimals), unit),
            None => Self::new(UNKNOWN, ""),
        }
    }

    /// What stands between number and unit: one space, but a degree sign clings to its figures.
    #[must_use]
    pub fn gap(&self) -> &'static str {
        if self.unit.is_empty() || self.unit.starts_with('°') && self.unit != "°C" { "" } else { " " }
    }
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}{}", self.number, self.gap(), self.unit)
    }
}

/// A number with so many decimals and a true minus; NaN and the infinities are called what they are, and what rounds to
/// zero has no sign.
#[must_use]
pub fn number(value: f64, decimals: usize) -> String {
    if value.is_nan() {
        return "NaN".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "+inf".into() } else { "−inf".into() };
    }
    let written = format!("{:.decimals$}", value.abs());
    let is_zero = written.chars().all(|figure| matches!(figure, '0' | '.'));
    if value < 0.0 && !is_zero { format!("−{written}") } else { written }
}

/// As [`number`], with a plus before what is above zero: offsets, drifts, Doppler.
#[must_use]
pub fn signed(value: f64, decimals: usize) -> String {
    let written = number(value, decimals);
    let is_plain = written.starts_with(|first: char| first.is_ascii_digit());
    let is_zero = written.chars().all(|figure| matches!(figure, '0' | '.'));
    if is_plain && !is_zero { format!("+{written}") } else { written }
}

/// Bytes in steps of 1000: `999 B`, `1.0 kB`, `12.3 MB`.
#[must_use]
pub fn bytes(count: u64) -> Quantity {
    if count < 1000 {
        return Quantity::new(count.to_string(), "B");
    }
    let mut value = count as f64 / 1000.0;
    let mut unit = "kB";
    for next in ["MB", "GB", "TB", "PB"] {
        // 999.95 would be written as 1000.0
        if value < 999.95 {
            break;
        }
        value /= 1000.0;
        unit = next;
    }
    Quantity::new(number(value, 1), unit)
}

/// A ratio or a level in dB, one decimal.
#[must_use]
pub fn db(value: Option<f64>) -> Quantity {
    Quantity::of(value, 1, "dB")
}

/// A power in dBm, one decimal.
#[must_use]
pub fn dbm(value: Option<f64>) -> Quantity {
    Quantity::of(value, 1, "dBm")
}

/// A radio frequency in MHz to the hertz: `436.703250 MHz`.
#[must_use]
pub fn frequency(hz: Option<f64>) -> Quantity {
    Quantity::of(hz.map(|hz| hz / 1e6), 6, "MHz")
}

/// An offset of a frequency, signed: `+812 Hz`, `−9.314 kHz`.
#[must_use]
pub fn offset_hz(hz: Option<f64>) -> Quantity {
    match hz {
        Some(hz) if hz.abs() >= 999.5 => Quantity::new(signed(hz / 1e3, 3), "kHz"),
        Some(hz) => Quantity::new(signed(hz, 0), "Hz"),
        None => Quantity::new(UNKNOWN, ""),
    }
}

/// An angle in degrees, one decimal: `12.3°`.
#[must_use]
pub fn degrees(value: Option<f64>) -> Quantity {
    Quantity::of(value, 1, "°")
}

/// A place as people read it: `45.0° N 40.0° W`. Longitudes of any turn are brought to ±180.
#[must_use]
pub fn place(longitude_deg: f64, latitude_deg: f64) -> String {
    let longitude_deg = crate::geo::wrap_deg(longitude_deg);
    let (ns, ew) = (if latitude_deg < 0.0 { "S" } else { "N" }, if longitude_deg < 0.0 { "W" } else { "E" });
    format!("{}° {ns} {}° {ew}", number(latitude_deg.abs(), 1), number(longitude_deg.abs(), 1))
}

fn civil_time(at: Timestamp) -> civil::DateTime {
    at.to_zoned(TimeZone::UTC).datetime()
}

/// Date and time: `2026-11-22T14:03:07Z`.
#[must_use]
pub fn utc(at: Timestamp) -> String {
    format!("{}T{}", date(at), time(at))
}

/// Date and time to the millisecond: `2026-11-22T14:03:07.250Z`.
#[must_use]
pub fn utc_ms(at: Timestamp) -> String {
    let t = civil_time(at);
    format!(
        "{}T{:02}:{:02}:{:02}.{:03}Z",
        date(at),
        t.hour(),
        t.minute(),
        t.second(),
        t.subsec_nanosecond() / 1_000_000
    )
}

/// Year and day of the year: `2026-326T14:03:07Z`.
#[must_use]
pub fn utc_day_of_year(at: Timestamp) -> String {
    let t = civil_time(at);
    format!("{:04}-{:03}T{}", t.year(), t.date().day_of_year(), time(at))
}

/// The date alone: `2026-11-22`.
#[must_use]
pub fn date(at: Timestamp) -> String {
    let t = civil_time(at);
    format!("{:04}-{:02}-{:02}", t.year(), t.month(), t.day())
}

/// The time of the day: `14:03:07Z`.
#[must_use]
pub fn time(at: Timestamp) -> String {
    let t = civil_time(at);
    format!("{:02}:{:02}:{:02}Z", t.hour(), t.minute(), t.second())
}

/// The time of the day to the minute: `14:03Z`.
#[must_use]
pub fn minute(at: Timestamp) -> String {
    let t = civil_time(at);
    format!("{:02}:{:02}Z", t.hour(), t.minute())
}

/// The shortest that is not mistaken beside `now`: the minute today, with its date on any other day.
#[must_use]
pub fn near(at: Timestamp, now: Timestamp) -> String {
    if date(at) == date(now) { minute(at) } else { format!("{} {}", date(at), minute(at)) }
}

/// How old something is, in the one unit that tells it: `0 s`, `37 s`, `4 min`, `23 h`, `3 d`. Full units only, never
/// rounded up. What lies ahead (a clock that is wrong) has a minus.
#[must_use]
pub fn age(age: SignedDuration) -> String {
    let seconds = age.as_secs();
    let sign = if seconds < 0 { "−" } else { "" };
    let seconds = seconds.unsigned_abs();
    let (count, unit) = match seconds {
        0..120 => (seconds, "s"),
        120..7_200 => (seconds / 60, "min"),
        7_200..172_800 => (seconds / 3_600, "h"),
        _ => (seconds / 86_400, "d"),
    };
    format!("{sign}{count} {unit}")
}

/// The time from `event` to `now` as a clock: `−00:04:12` before it, `+00:02:10` after it, `−2d 03:04:12` far from it.
/// Before the event a started second counts in full, so that zero is read when it is there.
#[must_use]
pub fn countdown(event: Timestamp, now: Timestamp) -> String {
    let since = now.duration_since(event);
    let ms = since.as_millis();
    let seconds =
        if ms < 0 { (-ms).div_euclid(1000) + i128::from((-ms).rem_euclid(1000) > 0) } else { ms / 1000 };
    let sign = if ms < 0 { '−' } else { '+' };
    let (days, hours) = (seconds / 86_400, seconds / 3_600 % 24);
    let clock = format!("{hours:02}:{:02}:{:02}", seconds / 60 % 60, seconds % 60);
    if days > 0 { format!("{sign}{days}d {clock}") } else { format!("{sign}{clock}") }
}

/// A length of time as a clock without a sign: `07:32`, `1:07:32`.
#[must_use]
pub fn length(of: SignedDuration) -> String {
    let seconds = of.as_secs().unsigned_abs();
    let (hours, minutes, seconds) = (seconds / 3_600, seconds / 60 % 60, seconds % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes:02}:{seconds:02}")
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn at(text: &str) -> Timestamp {
        text.parse().unwrap()
    }

    #[test]
    fn times_are_utc_and_say_so() {
        let t = at("2026-11-22T14:03:07.250Z");
        assert_eq!(utc(t), "2026-11-22T14:03:07Z");
        assert_eq!(utc_ms(t), "2026-11-22T14:03:07.250Z");
        assert_eq!(utc_day_of_year(t), "2026-326T14:03:07Z");
        assert_eq!(time(t), "14:03:07Z");
        assert_eq!(near(t, at("2026-11-22T23:00:00Z")), "14:03Z");
        assert_eq!(near(t, at("2026-11-23T00:00:00Z")), "2026-11-22 14:03Z");
        assert_eq!(utc_day_of_year(at("2028-12-31T00:00:00Z")), "2028-366T00:00:00Z");
    }

    #[test]
    fn an_age_has_one_unit_and_is_never_made_older() {
        for (seconds, text) in [
            (0, "0 s"),
            (37, "37 s"),
            (119, "119 s"),
            (120, "2 min"),
            (299, "4 min"),
            (7_199, "119 min"),
            (7_200, "2 h"),
            (172_799, "47 h"),
            (280_000, "3 d"),
            (-5, "−5 s"),
        ] {
            assert_eq!(age(SignedDuration::from_secs(seconds)), text);
        }
    }

    #[test]
    fn the_countdown_is_zero_at_the_event_and_not_before() {
        let event = at("2026-11-22T14:00:00Z");
        assert_eq!(countdown(event, at("2026-11-22T13:55:48Z")), "−00:04:12");
        assert_eq!(countdown(event, at("2026-11-22T13:59:59.900Z")), "−00:00:01");
        assert_eq!(countdown(event, event), "+00:00:00");
        assert_eq!(countdown(event, at("2026-11-22T14:02:10.999Z")), "+00:02:10");
        assert_eq!(countdown(event, at("2026-11-20T10:55:48Z")), "−2d 03:04:12");
    }

    #[test]
    fn unknown_is_a_dash_and_what_is_no_number_says_so() {
        assert_eq!(dbm(None).to_string(), "–");
        assert_eq!(dbm(Some(-112.54)).to_string(), "−112.5 dBm");
        assert_eq!(db(Some(f64::NAN)).to_string(), "NaN dB");
        assert_eq!(number(f64::NEG_INFINITY, 2), "−inf");
        assert_eq!(number(-0.04, 1), "0.0");
        assert_eq!(signed(0.04, 1), "0.0");
        assert_eq!(degrees(Some(12.34)).to_string(), "12.3°");
        assert_eq!(Quantity::of(Some(21.0), 1, "°C").to_string(), "21.0 °C");
        assert_eq!(offset_hz(Some(-9_314.2)).to_string(), "−9.314 kHz");
        assert_eq!(offset_hz(Some(812.0)).to_string(), "+812 Hz");
        assert_eq!(frequency(Some(436_703_250.0)).to_string(), "436.703250 MHz");
        assert_eq!(place(320.0, -45.0), "45.0° S 40.0° W");
    }

    #[test]
    fn bytes_step_at_a_thousand() {
        for (count, text) in [
            (0, "0 B"),
            (999, "999 B"),
            (1_000, "1.0 kB"),
            (999_949, "999.9 kB"),
            (999_950, "1.0 MB"),
            (u64::MAX, "18446.7 PB"),
        ] {
            assert_eq!(bytes(count).to_string(), text);
        }
    }

    proptest! {
        #[test]
        fn any_number_can_be_written_and_read_back(value: f64, decimals in 0_usize..6) {
            let written = number(value, decimals).replace('−', "-");
            let read: f64 = written.parse().unwrap();
            if value.is_nan() {
                prop_assert!(read.is_nan());
            } else if value.is_infinite() {
                prop_assert_eq!(read, value);
            } else {
                let half = 0.5 * 10_f64.powi(-(decimals as i32));
                prop_assert!((read - value).abs() <= half + value.abs() * 1e-15);
                prop_assert!(written != "-0" && !written.starts_with("-0.0") || read != 0.0);
            }
        }

        #[test]
        fn a_countdown_reads_the_same_from_both_sides(seconds in -400_000_i64..400_000) {
            let event = at("2026-11-22T14:00:00Z");
            let now = event + SignedDuration::from_secs(seconds);
            let (one, other) = (countdown(event, now), countdown(now, event));
            let figures = |text: &str| text.trim_start_matches(['+', '−']).to_owned();
            prop_assert_eq!(figures(&one), figures(&other));
            prop_assert_eq!(one.starts_with('−'), seconds < 0);
        }

        #[test]
        fn any_time_reads_back_to_its_second(second in -62_000_000_000_i64..250_000_000_000) {
            let t = Timestamp::from_second(second).unwrap();
            prop_assume!((0..10_000).contains(&civil_time(t).year()));
            prop_assert_eq!(at(&utc(t)), t);
        }
    }
}
