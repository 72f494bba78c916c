//! Conditions in the words of the API and back.

use api::{ConditionText, GuardText};
use mission::plan::{Condition, Finding};

use super::words::Reader;

/// What the words mean; `place` is how findings call it, e.g. `when`.
///
/// # Errors
/// Everything that is wrong with them.
pub fn condition_of(place: &str, words: &ConditionText) -> Result<Condition, Vec<Finding>> {
    let mut reader = Reader { findings: Vec::new() };
    let condition = reader.condition(place, words);
    if let Some(deg) = words.elevation_deg
        && !(0.0..=90.0).contains(&deg)
    {
        reader.wrong(format!("{place}.elevation_deg"), format!("{deg}°"), "Give 0 to 90 degrees.");
    }
    if reader.findings.is_empty() { Ok(condition) } else { Err(reader.findings) }
}

/// The same in words.
pub fn condition_text(condition: &Condition) -> ConditionText {
    let seconds = |us: u64| us as f64 / 1e6;
    ConditionText {
        elevation_deg: condition.min_elevation_deg,
        heard_within_s: condition.heard_within_us.map(seconds),
        after_aos_s: condition.after_aos_us.map(seconds),
        before_los_s: condition.before_los_us.map(seconds),
        telemetry: condition
            .telemetry
            .iter()
            .map(|guard| GuardText {
                parameter: guard.parameter.clone(),
                op: guard.op.sign().to_owned(),
                value: guard.value,
                max_age_s: seconds(guard.max_age_us),
            })
            .collect(),
    }
}
