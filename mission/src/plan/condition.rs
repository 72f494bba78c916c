//! What must hold before a step begins, or is waited for.

use std::fmt;

use super::view::RunView;

/// All of what is given must hold; an empty one always holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Condition {
    /// The satellite stands at least so high, degrees.
    pub min_elevation_deg: Option<f64>,
    /// It was heard within so many microseconds.
    pub heard_within_us: Option<u64>,
    /// Its values are so.
    pub telemetry: Vec<Guard>,
    /// The pass has lasted so long, microseconds since AOS.
    pub after_aos_us: Option<u64>,
    /// At least so much of the pass is left, microseconds before LOS.
    pub before_los_us: Option<u64>,
}

/// A value of the satellite compared with a number.
#[derive(Debug, Clone, PartialEq)]
pub struct Guard {
    /// Which, e.g. `heartbeat.temp`.
    pub parameter: String,
    /// How.
    pub op: Op,
    /// With what, in the parameter's unit.
    pub value: f64,
    /// Not older than this, microseconds.
    pub max_age_us: u64,
}

/// A comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Op {
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `>`
    Greater,
    /// `>=`
    AtLeast,
    /// `==`
    Equal,
    /// `!=`
    NotEqual,
}

impl Op {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Less, Self::AtMost, Self::Greater, Self::AtLeast, Self::Equal, Self::NotEqual];

    /// The sign, as plans have it.
    pub const fn sign(self) -> &'static str {
        match self {
            Self::Less => "<",
            Self::AtMost => "<=",
            Self::Greater => ">",
            Self::AtLeast => ">=",
            Self::Equal => "==",
            Self::NotEqual => "!=",
        }
    }

    /// Whether `found` compares so with `value`. NaN does not, in any way.
    pub fn holds(self, found: f64, value: f64) -> bool {
        match self {
            Self::Less => found < value,
            Self::AtMost => found <= value,
            Self::Greater => found > value,
            Self::AtLeast => found >= value,
            #[expect(clippy::float_cmp, reason = "for codes and flags, which are whole numbers")]
            Self::Equal => found == value,
            // For NaN `!=` would do.
            #[expect(clippy::float_cmp, reason = "for codes and flags, which are whole numbers")]
            Self::NotEqual => found != value && !found.is_nan() && !value.is_nan(),
        }
    }
}

/// The newest value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The value; `None` when invalid (a failed sensor).
    pub value: Option<f64>,
    /// How long ago it was heard, microseconds.
    pub age_us: u64,
}

/// Whether a condition holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Holds {
    /// Now.
    Yes,
    /// Not now.
    NotYet {
        /// What is missing, as a sentence.
        why: String,
        /// Look again after this long; `None`: it changes only by what is heard.
        look_after_us: Option<u64>,
    },
    /// Not in this pass any more.
    Never(String),
}

/// How often the elevation is looked at.
const ELEVATION_LOOK_US: u64 = 1_000_000;

impl Condition {
    /// Whether it asks for nothing.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether it holds in this view.
    pub fn holds(&self, view: &RunView<'_>) -> Holds {
        let utc = view.now.utc;
        if let Some(left_us) = self.before_los_us {
            let left = us_between(utc, view.window.los);
            if left < left_us {
                return Holds::Never(format!(
                    "{} s are left before LOS, {} are wanted",
                    seconds(left),
                    seconds(left_us)
                ));
            }
        }
        if let Some(after_us) = self.after_aos_us {
            let since = us_between(view.window.aos, utc);
            if since < after_us {
                return not_yet(
                    format!("{} s after AOS are waited for", seconds(after_us)),
                    Some(after_us - since),
                );
            }
        }
        if let Some(wanted) = self.min_elevation_deg
            && !view.elevation_deg.is_some_and(|found| found >= wanted)
        {
            let found = view.elevation_deg.map_or("unknown".to_owned(), |found| format!("{found:.1}°"));
            return not_yet(
                format!("elevation is {found}, {wanted}° is waited for"),
                Some(ELEVATION_LOOK_US),
            );
        }
        if let Some(within_us) = self.heard_within_us
            && view.heard_ago_us.is_none_or(|ago| ago > within_us)
        {
            let why = match view.heard_ago_us {
                Some(ago) => {
                    format!("the satellite was last heard {} ago, {} is the most", span(ago), span(within_us))
                }
                None => "the satellite was not heard since the station started".to_owned(),
            };
            return not_yet(why, None);
        }
        match self.telemetry.iter().find_map(|guard| guard.missing(view)) {
            Some(why) => not_yet(why, None),
            None => Holds::Yes,
        }
    }
}

impl Guard {
    /// What is missing; `None` when it holds.
    fn missing(&self, view: &RunView<'_>) -> Option<String> {
        match view.telemetry.get(&self.parameter) {
            None => Some(format!("{} was not heard since the station started", self.parameter)),
            Some(reading) if reading.age_us > self.max_age_us => Some(format!(
                "the newest {} is {} old, {} is the most",
                self.parameter,
                span(reading.age_us),
                span(self.max_age_us)
            )),
            Some(Reading { value: None, .. }) => Some(format!("{} is invalid", self.parameter)),
            Some(Reading { value: Some(found), .. }) if self.op.holds(*found, self.value) => None,
            Some(Reading { value: Some(found), .. }) => Some(format!("{self} does not hold: it is {found}")),
        }
    }
}

impl fmt::Display for Guard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.parameter, self.op.sign(), self.value)
    }
}

fn not_yet(why: String, look_after_us: Option<u64>) -> Holds {
    Holds::NotYet { why, look_after_us }
}

/// Microseconds from one time to a later one; 0 when it is not later.
pub(super) fn us_between(from: crate::UtcUs, to: crate::UtcUs) -> u64 {
    u64::try_from(to.0.saturating_sub(from.0)).unwrap_or(0)
}

/// For sentences: a time in the unit that people would take.
fn span(us: u64) -> String {
    const MINUTE_US: u64 = 60_000_000;
    match us / MINUTE_US {
        0..=3 => format!("{} s", seconds(us)),
        minutes @ 4..=180 => format!("{minutes} min"),
        minutes => format!("{} h", minutes / 60),
    }
}

/// For sentences: seconds with one decimal at most.
pub(super) fn seconds(us: u64) -> String {
    let tenths = us / 100_000;
    if tenths.is_multiple_of(10) {
        (tenths / 10).to_string()
    } else {
        format!("{}.{}", tenths / 10, tenths % 10)
    }
}
