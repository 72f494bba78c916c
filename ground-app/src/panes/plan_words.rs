//! Steps of plans in a few words, and who may do something with plans.

use api::{ConditionText, StepText};
use ui::format;

use super::Scene;

/// Why a plan cannot be handed over, armed or rehearsed just now; `None`: it can.
pub(super) fn hindrance(scene: &Scene<'_>) -> Option<String> {
    scene.may("plan").err()
}

/// What a step does, in a few words.
pub(super) fn step(step: &StepText) -> String {
    let seconds = |value: Option<f64>| value.map_or_else(|| format::UNKNOWN.to_owned(), seconds);
    match step.what.as_str() {
        "listen" => format!("listen for {}", seconds(step.for_s)),
        "command" => step.command.clone().unwrap_or_else(|| "no command".to_owned()),
        "wait-for" => format!(
            "wait until {}, at most {}",
            step.until.as_ref().map_or_else(|| "nothing".to_owned(), condition),
            seconds(step.timeout_s)
        ),
        "download-image" => "download the image".to_owned(),
        "upload-schedule" => match (&step.slots, &step.entries) {
            (Some(slots), _) => format!("downlink schedule, {} slots", slots.len()),
            (None, Some(entries)) => format!("schedule, {} entries", entries.len()),
            (None, None) => "empty schedule".to_owned(),
        },
        "repeat-until" => format!("repeat, at most {} times", step.at_most.unwrap_or(0)),
        "" => "choose what it does".to_owned(),
        other => other.to_owned(),
    }
}

/// A condition in a few words.
pub(super) fn condition(of: &ConditionText) -> String {
    let mut parts = Vec::new();
    let mut part = |value: Option<f64>, words: &dyn Fn(String) -> String| {
        if let Some(value) = value {
            parts.push(words(plain(value)));
        }
    };
    part(of.elevation_deg, &|value| format!("{value}° high"));
    part(of.heard_within_s, &|value| format!("heard within {value} s"));
    part(of.after_aos_s, &|value| format!("{value} s after AOS"));
    part(of.before_los_s, &|value| format!("{value} s before LOS"));
    for guard in &of.telemetry {
        parts.push(format!("{} {} {}", guard.parameter, guard.op, plain(guard.value)));
    }
    if parts.is_empty() { "nothing".to_owned() } else { parts.join(" and ") }
}

fn seconds(value: f64) -> String {
    format!("{} s", plain(value))
}

/// A number without needless decimals.
pub(super) fn plain(value: f64) -> String {
    format::number(value, if value.fract() == 0.0 { 0 } else { 1 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_told_in_a_few_words() {
        let read = |text: &str| serde_json::from_str::<StepText>(text).unwrap();
        assert_eq!(step(&read(r#"{"do":"listen","for_s":30}"#)), "listen for 30 s");
        let wait = r#"{"do":"wait-for","until":{"elevation_deg":10.5,"heard_within_s":60},"timeout_s":300}"#;
        assert_eq!(step(&read(wait)), "wait until 10.5° high and heard within 60 s, at most 300 s");
        assert_eq!(step(&read(r#"{"do":"upload-schedule","slots":[]}"#)), "downlink schedule, 0 slots");
        assert_eq!(step(&read(r#"{"do":"listen"}"#)), "listen for –");
    }
}
