//! What a draft comes to: the request, its bytes as they will be sealed, and what is wrong with each field.

use std::collections::BTreeMap;

use api::{CommandRequest, ConditionText, Time};
use protocol::{Telecommand, UP_PAYLOAD_MAX};

use crate::desk::{Draft, Gate};

/// A draft, looked at.
#[derive(Debug, Clone, Default)]
pub(super) struct Checked {
    /// What it was made of: looked at again when that changes.
    of: Draft,
    /// The telecommand, when the arguments are right.
    pub(super) telecommand: Option<Telecommand>,
    /// Its payload.
    pub(super) payload: Vec<u8>,
    /// What is wrong, by field: `count`, `slots[0].time`, `gate.elevation_deg`.
    pub(super) errors: BTreeMap<String, String>,
    condition: Option<ConditionText>,
    attempts: Option<u16>,
    expires_min: Option<f64>,
}

impl Checked {
    /// The same as before when nothing was typed.
    pub(super) fn look(&mut self, draft: &Draft) {
        if self.of.command == draft.command && self.of == *draft {
            return;
        }
        *self = Self { of: draft.clone(), ..Self::default() };
        match api::telecommand::parse(&draft.command, &draft.arguments()) {
            Ok(telecommand) => {
                let mut payload = [0; UP_PAYLOAD_MAX];
                let length = telecommand.encode_payload(&mut payload);
                self.payload = payload.iter().take(length).copied().collect();
                self.telecommand = Some(telecommand);
            }
            Err(errors) => {
                for error in errors {
                    let field = error.field.strip_prefix("arguments.").unwrap_or(&error.field);
                    self.errors.insert(field.to_owned(), error.message);
                }
            }
        }
        self.gate(&draft.gate);
    }

    fn gate(&mut self, gate: &Gate) {
        let elevation_deg = self.number("elevation_deg", &gate.elevation_deg, -90.0, 90.0);
        let heard_within_s = self.number("heard_within_s", &gate.heard_within_s, 1.0, 86_400.0);
        self.expires_min = self.number("expires_min", &gate.expires_min, 0.1, 525_600.0);
        let attempts = self.number("attempts", &gate.attempts, 1.0, 1000.0);
        self.attempts = attempts.filter(|attempts| attempts.fract() == 0.0).map(|attempts| attempts as u16);
        if self.attempts.is_none() && attempts.is_some() {
            self.errors.insert("gate.attempts".to_owned(), "must be a whole number".to_owned());
        }
        let condition = ConditionText { elevation_deg, heard_within_s, ..ConditionText::default() };
        self.condition = (condition != ConditionText::default()).then_some(condition);
    }

    fn number(&mut self, field: &str, text: &str, min: f64, max: f64) -> Option<f64> {
        let text = text.trim();
        if text.is_empty() {
            return None;
        }
        let number = text.parse::<f64>().ok().filter(|number| (min..=max).contains(number));
        if number.is_none() {
            let shown: String = text.chars().take(40).collect();
            let message = format!("must be a number from {min} to {max}, found \"{shown}\"");
            self.errors.insert(format!("gate.{field}"), message);
        }
        number
    }

    /// Whether it must be armed and then fired.
    pub(super) fn is_critical(&self) -> bool {
        self.telecommand.as_ref().is_some_and(Telecommand::is_critical)
    }

    /// Whether it can be sent as it is.
    pub(super) fn is_right(&self) -> bool {
        self.telecommand.is_some() && self.errors.is_empty()
    }

    /// What is asked of the server.
    pub(super) fn request(&self, satellite: Option<&str>, now_us: Option<i64>) -> Option<CommandRequest> {
        let draft = &self.of;
        let telecommand = self.telecommand.as_ref().filter(|_| self.errors.is_empty())?;
        let expires = self.expires_min.zip(now_us).map(|(minutes, now)| now + (minutes * 60e6) as i64);
        let given = |text: &str| Some(text.trim()).filter(|text| !text.is_empty()).map(ToOwned::to_owned);
        Some(CommandRequest {
            satellite: given(&draft.gate.satellite).or_else(|| satellite.map(ToOwned::to_owned)),
            link: given(&draft.gate.link),
            command: draft.command.clone(),
            arguments: draft.arguments(),
            priority: draft.gate.priority,
            gate: draft.gate_word(),
            when: self.condition.clone(),
            expires_at: expires.map(Time::from_unix_us),
            attempts: self.attempts,
            confirm: telecommand.is_critical().then(|| draft.command.clone()),
        })
    }

    /// What must hold before it leaves, for a step of a plan.
    pub(super) fn condition(&self) -> Option<ConditionText> {
        self.condition.clone()
    }

    /// How often it may be radiated.
    pub(super) fn attempts(&self) -> Option<u16> {
        self.attempts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draft_becomes_the_request_and_the_bytes_that_the_codec_makes() {
        let mut draft = Draft::with_words("GetImageChunk", "3 10".split(' '));
        draft.gate.elevation_deg = "10".into();
        draft.gate.expires_min = "2".into();
        let mut checked = Checked::default();
        checked.look(&draft);
        assert_eq!(checked.payload, [0, 3, 0, 10]);
        let request = checked.request(Some("pixelsat-1"), Some(1_000_000)).unwrap();
        assert_eq!(request.when.unwrap().elevation_deg, Some(10.0));
        assert_eq!(request.expires_at, Some(Time::from_unix_us(121_000_000)));
        assert_eq!((request.confirm, request.satellite.as_deref()), (None, Some("pixelsat-1")));
        checked.look(&Draft::of("Reset"));
        assert_eq!(checked.request(None, None).unwrap().confirm.as_deref(), Some("Reset"));
    }

    #[test]
    fn each_wrong_field_has_its_own_error_and_nothing_is_asked_for() {
        let mut draft = Draft::with_words("GetImageChunk", "3 100".split(' '));
        draft.gate.elevation_deg = "high".into();
        draft.gate.attempts = "1.5".into();
        let mut checked = Checked::default();
        checked.look(&draft);
        let fields: Vec<&str> = checked.errors.keys().map(String::as_str).collect();
        assert_eq!(fields, ["count", "gate.attempts", "gate.elevation_deg"]);
        assert!(checked.request(None, None).is_none());
        draft.fields.insert("count".into(), "64".into());
        draft.gate = Gate::default();
        checked.look(&draft);
        assert!(checked.errors.is_empty() && checked.is_right());
    }
}
