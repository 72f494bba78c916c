//! Each step by itself: its times, its telecommands, its conditions.

use protocol::Telecommand;

use super::fits::up;
use super::{Checker, ROUNDS_MAX, STEPS_MAX, TIME_MAX_US, nearest};
use crate::config::Profile;
use crate::plan::approval::digest;
use crate::plan::condition::{Condition, seconds};
use crate::plan::need::step_us;
use crate::plan::run::first_past_entry;
use crate::plan::step::{Action, Send, Step};
use crate::telemetry::known_parameters;

impl Checker<'_> {
    /// Whether the list is of a size that can be looked at as a whole.
    pub(super) fn list(&mut self, place: &str, steps: &[Step]) -> bool {
        if steps.is_empty() {
            self.error(place, "there is no step", "Add one, e.g. do = \"listen\" with for_s = 60.");
        }
        if steps.len() > STEPS_MAX {
            self.error(
                place,
                format!("{} steps", steps.len()),
                format!("{STEPS_MAX} fit: make two plans of it."),
            );
            return false;
        }
        let mut bounded = true;
        for (at, step) in steps.iter().enumerate() {
            bounded &= self.step(&format!("{place}[{at}]"), step);
        }
        bounded
    }

    pub(super) fn step(&mut self, place: &str, step: &Step) -> bool {
        self.condition(&format!("{place}.when"), &step.when);
        if let Some(limit_us) = step.limit_us {
            self.time(format!("{place}.limit_s"), limit_us);
            let least_us =
                step_us(&Step { when: Condition::default(), ..step.clone() }, &self.context.timing, 0);
            if limit_us < least_us {
                self.error(
                    format!("{place}.limit_s"),
                    format!(
                        "the step takes {} s at least, its limit is {} s",
                        up(least_us),
                        seconds(limit_us)
                    ),
                    "Give it more time, or less to do.",
                );
            }
        }
        if step.action.transmits() && !self.plan.transmit {
            self.error(
                format!("{place}.do"),
                format!(
                    "'{}' makes the station transmit, and the plan says transmit = false",
                    step.action.name()
                ),
                "Say transmit = true, or take the step out.",
            );
        }
        match &step.action {
            Action::Listen { for_us } => self.time(format!("{place}.for_s"), *for_us),
            Action::WaitFor { until, timeout_us } => {
                self.time(format!("{place}.timeout_s"), *timeout_us);
                self.condition(&format!("{place}.until"), until);
                if until.is_empty() {
                    self.error(
                        format!("{place}.until"),
                        "nothing is waited for",
                        "Give a condition, e.g. until = { heard_within_s = 70 }, or use 'listen'.",
                    );
                }
            }
            Action::DownloadImage => {}
            Action::Send(send) => self.send(place, send),
            Action::Repeat { steps, until, at_most } => {
                if let Some(until) = until {
                    self.condition(&format!("{place}.until"), until);
                    if until.is_empty() {
                        self.error(
                            format!("{place}.until"),
                            "an empty condition always holds",
                            "Give a condition, or leave 'until' out to do every round.",
                        );
                    }
                }
                if *at_most == 0 || *at_most > ROUNDS_MAX {
                    self.error(
                        format!("{place}.at_most"),
                        format!("{at_most} rounds"),
                        format!("Give 1 to {ROUNDS_MAX}: a repeat has a bound."),
                    );
                }
                return self.list(&format!("{place}.steps"), steps);
            }
        }
        true
    }

    pub(super) fn send(&mut self, place: &str, send: &Send) {
        if send.telecommands.is_empty() {
            self.error(place, "there is nothing to send", "Name a telecommand.");
        }
        if send.attempts == Some(0) {
            self.error(format!("{place}.attempts"), "0", "Give 1 or more, or leave it out.");
        }
        for telecommand in &send.telecommands {
            self.telecommand(place, send, telecommand);
        }
        let critical = send.telecommands.iter().find(|telecommand| telecommand.is_critical());
        let now = self.context.now;
        match (critical, &send.approval) {
            (Some(critical), None) => self.error(
                format!("{place}.approved_by"),
                format!("{} is critical, and nobody has approved it", critical.name()),
                format!(
                    "Have somebody look at it and add approved_by = {{ name = \"their name\", digest = \"{}\" }}.",
                    digest(&send.telecommands)
                ),
            ),
            (_, Some(approval)) => {
                if let Err(why) = approval.allows(&send.telecommands, now) {
                    self.error(format!("{place}.approved_by"), why, "Have it approved again, as it stands now.");
                } else if approval.digest.is_none() {
                    self.warning(
                        format!("{place}.approved_by"),
                        "the approval is not bound to what it approves",
                        format!(
                            "Add digest = \"{}\": then a changed argument voids it.",
                            digest(&send.telecommands)
                        ),
                    );
                }
            }
            (None, None) => {}
        }
    }

    pub(super) fn telecommand(&mut self, place: &str, send: &Send, telecommand: &Telecommand) {
        if let Err(error) = telecommand.validate() {
            self.error(
                format!("{place}.arguments"),
                error.to_string(),
                "See the telecommand in docs/icd.md.",
            );
        }
        if let (Some(n @ 2..), false) = (send.attempts, telecommand.is_idempotent()) {
            self.error(
                format!("{place}.attempts"),
                format!("{n}, and {} must not be repeated", telecommand.name()),
                "Say 1 or leave it out: it is radiated once, and telemetry tells what became of it.",
            );
        }
        if let (Telecommand::GetImageRanges(_), Some(Profile { ranges: false, .. })) =
            (telecommand, self.context.profile)
        {
            self.error(
                format!("{place}.command"),
                "GetImageRanges is not in this satellite's profile",
                "Use GetImageChunk or download-image.",
            );
        }
        if let Telecommand::SetTimestamp { utc_ms: 1.. } = telecommand {
            self.warning(
                format!("{place}.arguments.utc"),
                "a fixed time sets the satellite's clock wrong unless it is radiated at that very moment",
                "Say utc = \"now\".",
            );
        }
        let past = self.context.now.and_then(|now| first_past_entry(telecommand, now));
        if let Some(entry) = past {
            let (list, entry) = match telecommand {
                Telecommand::UploadSchedule(upload) => ("entries", entry + 8 * usize::from(upload.part)),
                _ => ("slots", entry),
            };
            self.error(
                format!("{place}.{list}[{entry}].time"),
                "it lies in the past",
                "Give a time that is still ahead when the pass is over.",
            );
        }
    }

    pub(super) fn condition(&mut self, place: &str, condition: &Condition) {
        if let Some(deg) = condition.min_elevation_deg {
            self.elevation(format!("{place}.elevation_deg"), deg);
            let best = self.context.pass.and_then(|pass| pass.max_elevation_deg);
            if let Some(best) = best.filter(|best| *best < deg) {
                self.error(
                    format!("{place}.elevation_deg"),
                    format!("{deg}° is wanted, this pass comes to {best}° at most"),
                    "Ask for less, or take a higher pass.",
                );
            } else if self.plan.min_pass.max_elevation_deg < deg && self.context.pass.is_none() {
                self.warning(
                    format!("{place}.elevation_deg"),
                    format!(
                        "{deg}° is wanted, the plan takes passes of {}°",
                        self.plan.min_pass.max_elevation_deg
                    ),
                    "Set min_pass.max_elevation_deg to as much, or some passes are for nothing.",
                );
            }
        }
        for (field, us) in
            [("heard_within_s", condition.heard_within_us), ("before_los_s", condition.before_los_us)]
        {
            if let Some(us) = us {
                self.time(format!("{place}.{field}"), us);
            }
        }
        if condition.after_aos_us.is_some_and(|us| us > TIME_MAX_US) {
            self.error(format!("{place}.after_aos_s"), "longer than a day", "Give 0 to 86400.");
        }
        for (at, guard) in condition.telemetry.iter().enumerate() {
            let place = format!("{place}.telemetry[{at}]");
            if !guard.value.is_finite() {
                self.error(format!("{place}.value"), format!("{}", guard.value), "Give a number.");
            }
            self.time(format!("{place}.max_age_s"), guard.max_age_us);
            let known = known_parameters();
            if !known.contains(&guard.parameter) {
                let near = nearest(&guard.parameter, known.iter().map(String::as_str));
                let remedy = near.map_or_else(
                    || "Write packet.field, e.g. heartbeat.temp.".to_owned(),
                    |near| format!("Did you mean {near}?"),
                );
                self.error(
                    format!("{place}.parameter"),
                    format!("no packet has '{}'", guard.parameter.chars().take(60).collect::<String>()),
                    remedy,
                );
            }
        }
    }
}
