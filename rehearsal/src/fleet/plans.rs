//! What is planned: the usual templates, one set for each satellite.

use std::sync::Arc;

use mission::plan::{
    Action, Approval, AtLos, AttachRule, Condition, Guard, MinPass, OnFailure, Op, Plan, Send, Step, approval,
};
use mission::record::Gate;
use mission::{PlanName, Principal};
use protocol::{Resolution, Telecommand};

use super::scene::satellite_name;

/// A plan, and how it comes to its passes.
#[derive(Clone)]
pub(super) struct Planned {
    pub(super) plan: Arc<Plan>,
    pub(super) text: Arc<str>,
    /// An operator chooses its passes.
    pub(super) by_hand: bool,
}

const fn seconds(s: u64) -> u64 {
    s * 1_000_000
}

fn heard(within_s: u64) -> Condition {
    Condition { heard_within_us: Some(seconds(within_s)), ..Condition::default() }
}

fn wait_heard() -> Step {
    Step {
        action: Action::WaitFor { until: heard(90), timeout_us: seconds(240) },
        when: Condition::default(),
        limit_us: None,
        on_failure: OnFailure::Abort,
    }
}

fn send(telecommand: Telecommand, when: Condition, limit_s: u64, on_failure: OnFailure) -> Step {
    let approved = telecommand.is_critical().then(|| Approval {
        by: Principal::new("A. Verma"),
        digest: Some(approval::digest(std::slice::from_ref(&telecommand))),
        expires_at: None,
    });
    let send = Send {
        telecommands: vec![telecommand],
        priority: None,
        attempts: None,
        gate: Gate::Heard,
        approval: approved,
    };
    Step { action: Action::Send(send), when, limit_us: Some(seconds(limit_s)), on_failure }
}

fn plan(
    s: usize,
    name: &str,
    worth: f64,
    least: (f64, u64),
    rule: Option<AttachRule>,
    steps: Vec<Step>,
) -> Plan {
    #[expect(clippy::expect_used, reason = "literals that keep the rule of names")]
    let name = PlanName::new(&format!("{}-{name}", satellite_name(s))).expect("a legal name");
    Plan {
        name,
        satellite: satellite_name(s),
        priority: 0,
        worth,
        min_pass: MinPass { max_elevation_deg: least.0, duration_us: seconds(least.1) },
        limit_us: None,
        at_los: AtLos::Stop,
        transmit: steps
            .iter()
            .any(|step| step.action.transmits() || matches!(step.action, Action::Repeat { .. })),
        attach: rule,
        steps,
    }
}

fn rule(min_deg: f64, every: u32) -> Option<AttachRule> {
    Some(AttachRule { min_max_elevation_deg: Some(min_deg), every, ..AttachRule::default() })
}

/// The least elevation of a pass that some plan wants in any case.
pub(super) const WANTED_FROM_DEG: f64 = 10.0;
/// The least length of such a pass, s.
pub(super) const WANTED_FROM_S: u64 = 120;

/// Hears what the satellite says.
fn listen(s: usize) -> Plan {
    let wait = Step {
        action: Action::WaitFor { until: heard(60), timeout_us: seconds(300) },
        on_failure: OnFailure::Continue,
        ..wait_heard()
    };
    let hear =
        Step { action: Action::Listen { for_us: seconds(60) }, on_failure: OnFailure::Abort, ..wait_heard() };
    plan(s, "listen", 1.0, (WANTED_FROM_DEG, WANTED_FROM_S), rule(WANTED_FROM_DEG, 1), vec![wait, hear])
}

/// Ping, then GetAdcsInfo.
fn status(s: usize) -> Plan {
    let ping =
        Condition { min_elevation_deg: Some(5.0), before_los_us: Some(seconds(30)), ..Condition::default() };
    let adcs = Condition { before_los_us: Some(seconds(30)), ..heard(90) };
    let steps = vec![
        wait_heard(),
        send(Telecommand::Ping, ping, 120, OnFailure::Continue),
        send(Telecommand::GetAdcsInfo, adcs, 60, OnFailure::Continue),
    ];
    plan(s, "status", 2.0, (15.0, 180), rule(15.0, 1), steps)
}

/// Takes a picture in the light and brings it home, over several passes if needed.
fn picture(s: usize) -> Plan {
    let capture =
        Telecommand::CaptureImage { resolution: Resolution::Cif, grey: false, strong_compression: true };
    let warm = Guard {
        parameter: "heartbeat.temp".to_owned(),
        op: Op::Greater,
        value: -60.0,
        max_age_us: seconds(180),
    };
    let when = Condition {
        min_elevation_deg: Some(10.0),
        before_los_us: Some(seconds(120)),
        telemetry: vec![warm],
        ..Condition::default()
    };
    let settle = Step {
        action: Action::WaitFor { until: heard(30), timeout_us: seconds(70) },
        on_failure: OnFailure::Continue,
        ..wait_heard()
    };
    let download = Step {
        action: Action::DownloadImage,
        when: Condition { min_elevation_deg: Some(10.0), ..Condition::default() },
        limit_us: Some(seconds(600)),
        on_failure: OnFailure::Abort,
    };
    let steps = vec![wait_heard(), send(capture, when, 240, OnFailure::Abort), settle, download];
    let sunlit = AttachRule {
        min_max_elevation_deg: Some(30.0),
        sunlit: Some(true),
        every: 2,
        ..AttachRule::default()
    };
    Plan {
        at_los: AtLos::FinishLater,
        priority: 1,
        ..plan(s, "picture", 5.0, (30.0, 240), Some(sunlit), steps)
    }
}

/// SetTimestamp: critical, approved beforehand; its passes are chosen by hand.
fn set_clock(s: usize) -> Plan {
    let when = Condition { before_los_us: Some(seconds(30)), ..heard(60) };
    let set = send(Telecommand::SetTimestamp { utc_ms: 0 }, when, 60, OnFailure::Continue);
    let fresh = Guard {
        parameter: "heartbeat.timestamp".to_owned(),
        op: Op::Greater,
        value: 0.0,
        max_age_us: seconds(5),
    };
    let repeat = Step {
        action: Action::Repeat {
            steps: vec![set],
            until: Some(Condition { telemetry: vec![fresh], ..Condition::default() }),
            at_most: 3,
        },
        when: Condition::default(),
        limit_us: None,
        on_failure: OnFailure::Abort,
    };
    Plan { priority: 3, ..plan(s, "set-clock", 2.0, (15.0, 180), None, vec![wait_heard(), repeat]) }
}

/// The plans for a satellite; those that transmit only where it has a key.
pub(super) fn plans(s: usize, is_commanded: bool) -> Vec<Planned> {
    let mut all = vec![listen(s)];
    if is_commanded {
        all.extend([status(s), picture(s), set_clock(s)]);
    }
    let planned = |plan: Plan| Planned {
        text: format!("{plan:?}").into(),
        by_hand: plan.attach.is_none(),
        plan: Arc::new(plan),
    };
    all.into_iter().map(planned).collect()
}
