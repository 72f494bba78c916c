use proptest::prelude::*;
use protocol::Telecommand;

use super::*;
use crate::plan::condition::Condition;
use crate::plan::need::{exchange_us, least_us};
use crate::plan::step::{MinPass, OnFailure, Send};
use crate::record::Gate;
use crate::{PlanName, SatelliteId};

const S: u64 = 1_000_000;

fn step(action: Action) -> Step {
    Step { action, when: Condition::default(), limit_us: None, on_failure: OnFailure::Abort }
}

fn pings(n: usize) -> Step {
    step(Action::Send(Send {
        telecommands: vec![Telecommand::Ping; n],
        priority: None,
        attempts: None,
        gate: Gate::Heard,
        approval: None,
    }))
}

fn plan(steps: Vec<Step>) -> Plan {
    Plan {
        name: PlanName::new("test").unwrap(),
        satellite: SatelliteId::new("pixelsat-1").unwrap(),
        priority: 0,
        worth: 1.0,
        min_pass: MinPass::default(),
        limit_us: None,
        at_los: AtLos::Stop,
        transmit: true,
        attach: None,
        steps,
    }
}

fn errors(plan: &Plan, duration_us: u64) -> Vec<String> {
    let pass = Some(PassShape { duration_us, max_elevation_deg: None });
    let context = CheckContext { timing: LinkTiming::default(), profile: None, pass, now: None };
    let findings = check(plan, &context).into_iter();
    findings.filter(|found| found.severity == Severity::Error).map(|found| found.place).collect()
}

#[test]
fn a_late_step_is_told_unless_the_next_pass_can_do_it() {
    let mut late = pings(1);
    late.when.before_los_us = Some(100 * S);
    let mut plan = plan(vec![step(Action::Listen { for_us: 350 * S }), late]);
    assert_eq!(errors(&plan, 400 * S), ["steps[1].when.before_los_s"]);
    assert_eq!(errors(&plan, 450 * S), [""; 0]);
    plan.at_los = AtLos::FinishLater;
    assert_eq!(errors(&plan, 400 * S), [""; 0]);
    plan.steps[1].when.after_aos_us = Some(350 * S);
    assert_eq!(errors(&plan, 400 * S), ["steps[1].when.before_los_s"]);
}

#[test]
fn rounds_are_counted_once_with_an_end_and_all_without() {
    let timing = LinkTiming::default();
    let ping = exchange_us(&Telecommand::Ping, &timing);
    let repeat = |until, at_most| vec![step(Action::Repeat { steps: vec![pings(2)], until, at_most })];
    for rounds in [1, 2, 3, 7] {
        assert_eq!(least_us(&repeat(None, rounds), &timing), 2 * u64::from(rounds) * ping);
    }
    let until = Condition { heard_within_us: Some(S), ..Condition::default() };
    assert_eq!(least_us(&repeat(Some(until), 7), &timing), 2 * ping);
}

#[test]
fn a_word_near_another_is_found_and_a_far_one_is_not() {
    let known = ["listen", "command", "wait-for"];
    assert_eq!(nearest("lisen", known), Some("listen"));
    assert_eq!(nearest("Wait_For", known), Some("wait-for"));
    assert_eq!(nearest("dance", known), None);
    assert_eq!(nearest("", known), None);
}

proptest! {
    /// What the checker lets pass can be done: in a world where all goes well, in no more than the bound.
    #[test]
    fn the_bound_is_monotonous(listens in prop::collection::vec(1..100_u64, 1..6), extra in 1..50_u64) {
        let timing = LinkTiming::default();
        let mut steps: Vec<Step> =
            listens.iter().map(|s| step(Action::Listen { for_us: s * S })).collect();
        let bound = least_us(&steps, &timing);
        prop_assert_eq!(bound, listens.iter().sum::<u64>() * S);
        prop_assert!(errors(&plan(steps.clone()), bound).is_empty());
        prop_assert_eq!(errors(&plan(steps.clone()), bound - 1), ["steps"]);
        steps.push(pings(usize::try_from(extra).unwrap()));
        prop_assert!(least_us(&steps, &timing) > bound);
    }
}
