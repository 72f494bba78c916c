//! What no operator wants, found without flying: what the check finds in this pass, commands and transmissions outside of
//! it, elements that are too old.

use mission::plan::need::least_us;
use mission::plan::step::Action;
use mission::plan::{CheckContext, Finding, NoMatch, PassFacts, PassShape, Plan, Severity, check};
use mission::sky::{ElementsAge, PassAhead, instant, sunlit_at};
use mission::{Level, UtcUs};
use protocol::Telecommand;
use tle::{Elements, Propagator};

use super::{Rehearsal, passes};

/// A second.
const SECOND_US: u64 = 1_000_000;

/// Why the station would not take the plan at all, or not for this pass: what must be mended before it is rehearsed.
#[must_use]
pub fn refusals(what: &Rehearsal) -> Vec<Finding> {
    let context = CheckContext { pass: None, ..context(what) };
    let mut found: Vec<Finding> = check(&what.plan, &context)
        .into_iter()
        .filter(|finding| finding.severity == Severity::Error)
        .collect();
    if let Err(why) = takes(&what.plan, &what.pass, &what.elements) {
        let problem = format!("the plan does not take this pass: {why}");
        found.push(Finding::error("min_pass", problem, "Choose another pass, or ask for less."));
    }
    found
}

/// Everything that is odd about the plan in this pass, before anything is flown.
#[must_use]
pub fn warnings(what: &Rehearsal) -> Vec<Finding> {
    let mut found = check(&what.plan, &context(what));
    let duration_us = duration_us(&what.pass);
    for (at, step) in what.plan.steps.iter().enumerate() {
        let place = format!("steps[{at}]");
        let from_us = least_us(&what.plan.steps[..at], &what.timing).max(step.when.after_aos_us.unwrap_or(0));
        if step.action.transmits() && from_us >= duration_us {
            let problem = format!(
                "a command outside the pass: it is come to {} s after AOS at the earliest, this pass lasts {} s",
                from_us.div_ceil(SECOND_US),
                duration_us / SECOND_US
            );
            found.push(Finding::warning(
                &place,
                problem,
                "It is not sent. Put it earlier, or choose a longer pass.",
            ));
        }
        slots(what, &place, &step.action, &mut found);
    }
    let age = ElementsAge::at(&what.elements, what.pass.aos_at);
    if age.level >= Level::Watch {
        let problem = format!(
            "the elements are {:.1} days from their epoch at AOS, expect {:.0} s of error",
            age.age_days, age.timing_error_s
        );
        found.push(Finding::warning("", problem, "Fetch newer ones."));
    }
    found
}

/// Scheduled transmissions that this station cannot hear.
fn slots(what: &Rehearsal, place: &str, action: &Action, found: &mut Vec<Finding>) {
    match action {
        Action::Send(send) => {
            for telecommand in &send.telecommands {
                let Telecommand::SetDownlinkSchedule(schedule) = telecommand else { continue };
                for (slot, entry) in schedule.slots.iter().enumerate() {
                    let at =
                        UtcUs(i64::try_from(entry.time_ms).unwrap_or(i64::MAX / 1000).saturating_mul(1000));
                    let seen = passes(&what.elements, &what.site, at, UtcUs(at.0.saturating_add(1_000_000)));
                    if at > what.pass.aos_at
                        && seen.is_ok_and(|passes| !passes.iter().any(|pass| pass.lasts_at(at)))
                    {
                        found.push(Finding::warning(
                            format!("{place}.slots[{slot}].time"),
                            format!("at {} the satellite is in no pass over this station", instant(at)),
                            "Nobody here will hear it: give a time within a pass, or leave it to others.",
                        ));
                    }
                }
            }
        }
        Action::Repeat { steps, .. } => {
            for (at, step) in steps.iter().enumerate() {
                slots(what, &format!("{place}.steps[{at}]"), &step.action, found);
            }
        }
        _ => {}
    }
}

fn context(what: &Rehearsal) -> CheckContext {
    CheckContext {
        timing: what.timing,
        profile: Some(what.profile),
        pass: Some(PassShape {
            duration_us: duration_us(&what.pass),
            max_elevation_deg: Some(what.pass.max_elevation_deg),
        }),
        now: Some(what.pass.aos_at),
    }
}

fn duration_us(pass: &PassAhead) -> u64 {
    let los = pass.los_at.unwrap_or(pass.tca_at);
    u64::try_from(los.0.saturating_sub(pass.aos_at.0)).unwrap_or(0)
}

/// Whether the plan takes a pass, chosen by hand.
pub(super) fn takes(plan: &Plan, pass: &PassAhead, elements: &Elements) -> Result<(), NoMatch> {
    plan.takes(&PassFacts {
        satellite: plan.satellite.clone(),
        tca: pass.tca_at,
        max_elevation_deg: pass.max_elevation_deg,
        duration_us: duration_us(pass),
        sunlit: Propagator::new(elements).ok().and_then(|orbit| sunlit_at(&orbit, pass.tca_at)),
        matched_before: 0,
    })
}
