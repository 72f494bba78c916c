//! Words to what the engine takes; every mistake with its place.

use api::{
    ApprovalText, AtLosWord, AttachText, ConditionText, GateWord, OnFailureWord, PlanText, StepText,
    telecommand,
};
use mission::plan::check::nearest;
use mission::plan::{
    Action, Approval, AtLos, AttachRule, Condition, Finding, Guard, Hours, MinPass, OnFailure, Op, Plan,
    Send, Step,
};
use mission::{Gate, PlanName, Principal, SatelliteId, UtcUs};
use protocol::Telecommand;

use super::upload;

/// The plan, or everything that is wrong with its words; never an empty list.
pub(super) fn plan(words: &PlanText) -> Result<Plan, Vec<Finding>> {
    let mut reader = Reader { findings: Vec::new() };
    let plan = reader.plan(words);
    match plan {
        Some(plan) if reader.findings.is_empty() => Ok(plan),
        _ => Err(reader.findings),
    }
}

/// Collects what is wrong.
pub(super) struct Reader {
    pub(super) findings: Vec<Finding>,
}

const TIME: &str = "Give a number of seconds, 0 to 86400.";

impl Reader {
    pub(super) fn wrong(
        &mut self,
        place: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) {
        self.findings.push(Finding::error(place, problem, remedy));
    }

    fn plan(&mut self, words: &PlanText) -> Option<Plan> {
        let name = PlanName::new(&words.name).map_err(|error| {
            self.wrong("name", error.to_string(), "Choose another name.");
        });
        let satellite = SatelliteId::new(&words.satellite).map_err(|error| {
            self.wrong("satellite", error.to_string(), "Give the name that the configuration has.");
        });
        let limit_us = self.maybe_us("limit_s", words.limit_s);
        let duration_us = self.us("min_pass.duration_s", words.min_pass.duration_s);
        let attach = words.attach.as_ref().map(|attach| self.attach(attach));
        let steps = self.steps("steps", &words.steps);
        Some(Plan {
            name: name.ok()?,
            satellite: satellite.ok()?,
            priority: words.priority,
            worth: words.worth,
            min_pass: MinPass {
                max_elevation_deg: words.min_pass.max_elevation_deg,
                duration_us: duration_us?,
            },
            limit_us,
            at_los: match words.at_los {
                AtLosWord::Stop => AtLos::Stop,
                AtLosWord::FinishLater => AtLos::FinishLater,
            },
            transmit: words.transmit,
            attach,
            steps: steps?,
        })
    }

    fn attach(&mut self, words: &AttachText) -> AttachRule {
        let mut hours_utc = Vec::new();
        for (at, text) in words.hours_utc.iter().enumerate() {
            match hours(text) {
                Some(hours) => hours_utc.push(hours),
                None => self.wrong(
                    format!("attach.hours_utc[{at}]"),
                    format!("'{}' is no span of hours", shown(text)),
                    "Write two UTC times, e.g. \"18:00-06:00\"; it may go over midnight.",
                ),
            }
        }
        AttachRule {
            min_max_elevation_deg: words.min_max_elevation_deg,
            hours_utc,
            sunlit: words.sunlit,
            every: words.every,
        }
    }

    fn steps(&mut self, place: &str, words: &[StepText]) -> Option<Vec<Step>> {
        let steps: Vec<Option<Step>> =
            words.iter().enumerate().map(|(at, step)| self.step(&format!("{place}[{at}]"), step)).collect();
        steps.into_iter().collect()
    }

    fn step(&mut self, place: &str, words: &StepText) -> Option<Step> {
        let kind = words.what.as_str();
        let Some(own) = fields_of(kind) else {
            let near = nearest(kind, Action::NAMES).map(|near| format!("Did you mean '{near}'? "));
            self.wrong(
                format!("{place}.do"),
                format!("'{}' is no step", shown(kind)),
                format!("{}Known are {}.", near.unwrap_or_default(), Action::NAMES.join(", ")),
            );
            return None;
        };
        for field in given(words).into_iter().filter(|field| !own.contains(field)) {
            let takes = if own.is_empty() { "no fields of its own".to_owned() } else { own.join(", ") };
            self.wrong(
                format!("{place}.{field}"),
                format!("a '{kind}' has no '{field}'"),
                format!("Take it out; it has {takes}."),
            );
        }
        let when = words.when.as_ref().map(|when| self.condition(&format!("{place}.when"), when));
        let limit_us = self.maybe_us(&format!("{place}.limit_s"), words.limit_s);
        let action = match kind {
            "listen" => {
                let for_s = self.required(place, "for_s", words.for_s, "how many seconds to listen");
                for_s
                    .and_then(|s| self.us(&format!("{place}.for_s"), s))
                    .map(|for_us| Action::Listen { for_us })
            }
            "command" => self.command(place, words),
            "upload-schedule" => {
                let telecommands = upload::telecommands(self, place, words);
                telecommands.and_then(|telecommands| self.send(place, words, telecommands))
            }
            "wait-for" => {
                let until = self.required(
                    place,
                    "until",
                    words.until.as_ref(),
                    "what to wait for, e.g. { heard_within_s = 70 }",
                );
                let until = until.map(|until| self.condition(&format!("{place}.until"), until));
                let timeout = self.required(place, "timeout_s", words.timeout_s, "how many seconds at most");
                let timeout_us = timeout.and_then(|s| self.us(&format!("{place}.timeout_s"), s));
                until.zip(timeout_us).map(|(until, timeout_us)| Action::WaitFor { until, timeout_us })
            }
            "download-image" => Some(Action::DownloadImage),
            _ => {
                let steps = self.required(place, "steps", words.steps.as_ref(), "the steps of each round");
                let steps = steps.and_then(|steps| self.steps(&format!("{place}.steps"), steps));
                let until =
                    words.until.as_ref().map(|until| self.condition(&format!("{place}.until"), until));
                let at_most = self.required(
                    place,
                    "at_most",
                    words.at_most,
                    "how many rounds at most: a repeat has a bound",
                );
                steps.zip(at_most).map(|(steps, at_most)| Action::Repeat { steps, until, at_most })
            }
        };
        Some(Step {
            action: action?,
            when: when.unwrap_or_default(),
            limit_us,
            on_failure: match words.on_failure.unwrap_or_default() {
                OnFailureWord::Abort => OnFailure::Abort,
                OnFailureWord::Skip => OnFailure::Skip,
                OnFailureWord::Continue => OnFailure::Continue,
            },
        })
    }

    fn command(&mut self, place: &str, words: &StepText) -> Option<Action> {
        let name = self.required(place, "command", words.command.as_deref(), "the name of a telecommand")?;
        let mut arguments = words.arguments.clone().unwrap_or_default();
        if name == "SetTimestamp" && arguments.get("utc").is_some_and(|utc| utc == "now") {
            // In the engine's words: the time at which it is asked for.
            arguments.insert("utc".to_owned(), "1970-01-01T00:00:00Z".into());
        }
        upload::toml_times_as_text(&mut arguments);
        match telecommand::parse(name, &arguments) {
            Ok(telecommand) => self.send(place, words, vec![telecommand]),
            Err(errors) => {
                for error in errors {
                    let near = nearest(name, telecommand::NAMES).filter(|_| error.field == "command");
                    let remedy = match near {
                        Some(near) => format!("Did you mean '{near}'?"),
                        None => "The arguments of each telecommand are in docs/api.md.".to_owned(),
                    };
                    self.wrong(format!("{place}.{}", error.field), error.message, remedy);
                }
                None
            }
        }
    }

    fn send(&mut self, place: &str, words: &StepText, telecommands: Vec<Telecommand>) -> Option<Action> {
        let approval = words.approved_by.as_ref().map(|words| self.approval(place, words));
        Some(Action::Send(Send {
            telecommands,
            priority: words.priority,
            attempts: words.attempts,
            gate: match words.gate.unwrap_or_default() {
                GateWord::Heard => Gate::Heard,
                GateWord::Blind => Gate::Blind,
            },
            approval,
        }))
    }

    fn approval(&mut self, place: &str, words: &ApprovalText) -> Approval {
        if let Some(digest) = &words.digest
            && !(digest.len() == 16 && digest.bytes().all(|b| b.is_ascii_hexdigit()))
        {
            self.wrong(
                format!("{place}.approved_by.digest"),
                format!("'{}' is no digest", shown(digest)),
                "Give the 16 hex digits that `plan check` tells.",
            );
        }
        Approval {
            by: Principal::new(words.name.trim()),
            digest: words.digest.as_ref().map(|digest| digest.to_ascii_lowercase()),
            expires_at: words.expires_at.map(|time| UtcUs(time.unix_us())),
        }
    }

    pub(super) fn condition(&mut self, place: &str, words: &ConditionText) -> Condition {
        let mut us = |field: &str, s: Option<f64>| self.maybe_us(&format!("{place}.{field}"), s);
        let heard_within_us = us("heard_within_s", words.heard_within_s);
        let after_aos_us = us("after_aos_s", words.after_aos_s);
        let before_los_us = us("before_los_s", words.before_los_s);
        let mut telemetry = Vec::new();
        for (at, guard) in words.telemetry.iter().enumerate() {
            let place = format!("{place}.telemetry[{at}]");
            let max_age_us = self.us(&format!("{place}.max_age_s"), guard.max_age_s);
            let op = Op::ALL.into_iter().find(|op| op.sign() == guard.op);
            if op.is_none() {
                let known: Vec<&str> = Op::ALL.iter().map(|op| op.sign()).collect();
                self.wrong(
                    format!("{place}.op"),
                    format!("'{}' is no comparison", shown(&guard.op)),
                    format!("Write one of {}.", known.join(" ")),
                );
            }
            if let (Some(op), Some(max_age_us)) = (op, max_age_us) {
                let parameter = guard.parameter.clone();
                telemetry.push(Guard { parameter, op, value: guard.value, max_age_us });
            }
        }
        Condition {
            min_elevation_deg: words.elevation_deg,
            heard_within_us,
            telemetry,
            after_aos_us,
            before_los_us,
        }
    }

    pub(super) fn required<T>(
        &mut self,
        place: &str,
        field: &str,
        value: Option<T>,
        what: &str,
    ) -> Option<T> {
        if value.is_none() {
            self.wrong(format!("{place}.{field}"), format!("'{field}' is missing"), format!("Give {what}."));
        }
        value
    }

    fn maybe_us(&mut self, place: &str, s: Option<f64>) -> Option<u64> {
        s.and_then(|s| self.us(place, s))
    }

    /// Seconds in microseconds.
    fn us(&mut self, place: &str, s: f64) -> Option<u64> {
        if s.is_finite() && (0.0..=86_400.0).contains(&s) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 86,400 s")]
            return Some((s * 1e6).round() as u64);
        }
        self.wrong(place, format!("{s} s"), TIME);
        None
    }
}

/// `18:00-06:00`.
fn hours(text: &str) -> Option<Hours> {
    let minute = |text: &str| {
        let (hour, minute) = text.trim().split_once(':')?;
        let two = |text: &str| (text.len() == 2).then(|| text.parse::<u16>().ok()).flatten();
        let (hour, minute) = (two(hour)?, two(minute)?);
        (hour < 24 && minute < 60).then_some(hour * 60 + minute)
    };
    let (from, to) = text.split_once('-')?;
    Some(Hours { from_min: minute(from)?, to_min: minute(to)? })
}

/// The fields that belong to a step of this kind, besides those of any step.
fn fields_of(kind: &str) -> Option<&'static [&'static str]> {
    Some(match kind {
        "listen" => &["for_s"],
        "command" => &["command", "arguments", "priority", "attempts", "gate", "approved_by"],
        "wait-for" => &["until", "timeout_s"],
        "download-image" => &[],
        "upload-schedule" => &["slots", "entries", "schedule", "priority", "attempts", "gate", "approved_by"],
        "repeat-until" => &["steps", "until", "at_most"],
        _ => return None,
    })
}

/// The fields that were given, besides those of any step.
fn given(step: &StepText) -> Vec<&'static str> {
    [
        ("for_s", step.for_s.is_some()),
        ("command", step.command.is_some()),
        ("arguments", step.arguments.is_some()),
        ("priority", step.priority.is_some()),
        ("attempts", step.attempts.is_some()),
        ("gate", step.gate.is_some()),
        ("approved_by", step.approved_by.is_some()),
        ("until", step.until.is_some()),
        ("timeout_s", step.timeout_s.is_some()),
        ("slots", step.slots.is_some()),
        ("entries", step.entries.is_some()),
        ("schedule", step.schedule.is_some()),
        ("steps", step.steps.is_some()),
        ("at_most", step.at_most.is_some()),
    ]
    .into_iter()
    .filter_map(|(field, is_given)| is_given.then_some(field))
    .collect()
}

/// What was found, short enough to be told.
fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}
