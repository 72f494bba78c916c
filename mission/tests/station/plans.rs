//! Plans in their passes: armed, run, held, killed, moved; and commands that wait for more than contact.

use std::sync::Arc;

use mission::config::Times;
use mission::plan::{
    Action, AtLos, AttachRule, Condition, MinPass, OnFailure, Plan, RunEnd, Send, Step, StepEnd,
};
use mission::record::EventKind;
use mission::run::{RunRecord, RunState};
use mission::schedule::Window;
use mission::{
    Accepted, CommandId, Gate, Input, Intent, LinkState, PassAhead, PlanName, Record, Refusal, Stage, UtcUs,
};
use protocol::Telecommand;

use crate::frames::frame;
use crate::sky::{add, elements, expected, site};
use crate::world::{S, Setup, UTC0, World};

pub(crate) fn send(telecommand: Telecommand) -> Step {
    Step {
        action: Action::Send(Send {
            telecommands: vec![telecommand],
            priority: None,
            attempts: None,
            gate: Gate::Heard,
            approval: None,
        }),
        when: Condition::default(),
        limit_us: None,
        on_failure: OnFailure::Continue,
    }
}

pub(crate) fn plan(name: &str, steps: Vec<Step>) -> Plan {
    Plan {
        name: PlanName::new(name).unwrap(),
        satellite: mission::SatelliteId::new("pixelsat-1").unwrap(),
        priority: 0,
        worth: 1.0,
        min_pass: MinPass::default(),
        limit_us: None,
        at_los: AtLos::Stop,
        transmit: true,
        attach: Some(AttachRule { every: 1, ..AttachRule::default() }),
        steps,
    }
}

pub(crate) fn want(world: &mut World, intent: Intent) -> Result<Accepted, Refusal> {
    let id = world.want(intent);
    world.reply(id).unwrap().clone()
}

pub(crate) fn hand_over(world: &mut World, plan: Plan) -> Result<Accepted, Refusal> {
    let text: Arc<str> = format!("{plan:?}").into();
    want(world, Intent::AddPlan { plan: Arc::new(plan), text })
}

pub(crate) fn arm(world: &mut World, name: &str, armed: bool) {
    want(world, Intent::ArmPlan { plan: PlanName::new(name).unwrap(), armed }).unwrap();
}

pub(crate) fn world() -> (World, Vec<PassAhead>) {
    world_with(Times::default())
}

pub(crate) fn world_with(times: Times) -> (World, Vec<PassAhead>) {
    let mut world = World::new(Setup { site: Some(site()), times, ..Setup::default() });
    world.link_state(LinkState::Ok);
    let set = elements(UTC0, 0.0);
    add(&mut world, vec![set.clone()]).unwrap();
    (world, expected(&set, 1, 2))
}

pub(crate) fn to(world: &mut World, at: UtcUs) {
    world.pass(u64::try_from(at.0 - world.now.utc.0).unwrap());
}

/// The newest state of each run.
pub(crate) fn runs(world: &World) -> Vec<RunRecord> {
    let mut runs: std::collections::BTreeMap<_, RunRecord> = std::collections::BTreeMap::new();
    for record in &world.stored {
        if let Record::Run(run) = record {
            runs.insert(run.id, (**run).clone());
        }
    }
    runs.into_values().collect()
}

/// A satellite that beats every minute in view and answers what it is asked, until `until`.
pub(crate) fn live(world: &mut World, until: UtcUs) {
    let mut beat = 0_u64;
    // What is on the air at the begin was not answered yet.
    let on_air = world.station.status(world.now).links[0].on_air;
    let mut answered = world.transmits.len() - usize::from(on_air);
    while world.now.utc < until {
        let in_view = world.station.status(world.now).satellites[0].in_view == Some(true);
        if in_view && world.now.mono.0 >= beat {
            world.heartbeat();
            beat = world.now.mono.0 + 60 * S;
        }
        if world.transmits.len() > answered {
            answered = world.transmits.len();
            assert!(in_view, "radiated out of view");
            world.radiate();
            let (tag, _) = world.last_request();
            world.hear(&frame(0, tag, &[]));
        }
        world.pass(S / 2);
    }
}

#[test]
fn armed_plan_runs_in_each_of_its_passes_and_tells_what_came_of_it() {
    let (mut world, passes) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping), send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    live(&mut world, passes[2].los_at.unwrap().plus(60_000_000));
    let runs = runs(&world);
    let ended: Vec<_> = runs.iter().filter(|run| run.state == RunState::Ended).collect();
    assert_eq!(ended.len(), 3, "{runs:?}");
    for (run, pass) in ended.iter().zip(&passes) {
        assert!(run.aos_at.0.abs_diff(pass.aos_at.0) < 2_000_000);
        assert!(run.pass.is_some() && run.progress.asked.len() <= 2);
    }
    let whole =
        ended.iter().filter(|run| run.progress.end == Some(RunEnd::Completed { failures: 0 })).count();
    assert!(whole >= 2, "{ended:?}");
    assert!(world.events(EventKind::Plan).iter().any(|text| text.contains("everything was done")));
}

#[test]
fn plan_that_is_not_armed_radiates_nothing() {
    let (mut world, passes) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    live(&mut world, passes[0].los_at.unwrap());
    assert!(world.transmits.is_empty() && runs(&world).is_empty());
    assert_eq!(
        world.station.status(world.now).schedule.contacts.len(),
        passes.len() - 1,
        "it is shown all the same"
    );
}

#[test]
fn killed_at_any_moment_of_a_pass_it_goes_on_and_asks_nothing_twice() {
    let (first, passes) = world();
    drop(first);
    let (aos, los) = (passes[0].aos_at, passes[0].los_at.unwrap());
    for kill_s in (0..u64::try_from(los.0 - aos.0).unwrap() / S).step_by(7) {
        let (mut world, _) = world();
        let steps = vec![send(capture()), send(Telecommand::Ping)];
        hand_over(&mut world, plan("picture", steps)).unwrap();
        arm(&mut world, "picture", true);
        live(&mut world, aos.plus(i64::try_from(kill_s * S).unwrap()));
        world.restart();
        world.link_state(LinkState::Ok);
        live(&mut world, los.plus(1_000_000));
        let captures = world.stored.iter().filter(|record| {
            matches!(record, Record::Command(row) if matches!(row.telecommand, Telecommand::CaptureImage { .. }))
        });
        assert_eq!(
            captures.count(),
            1,
            "killed {kill_s} s after AOS: {:#?} {:#?}",
            world.events(EventKind::Plan),
            runs(&world)
        );
        let ended: Vec<_> = runs(&world).into_iter().filter(|run| run.state == RunState::Ended).collect();
        assert_eq!(ended.len(), 1, "killed {kill_s} s after AOS: {ended:?}");
    }
}

#[test]
fn link_that_is_away_is_waited_for_and_a_pass_without_it_is_reported() {
    let (mut world, passes) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    // So shortly before the pass that the station still counts on it.
    to(&mut world, passes[0].aos_at.plus(-200_000_000));
    world.link_state(LinkState::Unavailable { reason: "no such port".to_owned() });
    live(&mut world, passes[0].los_at.unwrap().plus(S as i64));
    assert!(matches!(&runs(&world)[0].state, RunState::Missed(why) if why.contains("radio is unavailable")));
    let warned =
        world.events(EventKind::Plan).iter().filter(|text| text.contains("radio is unavailable")).count();
    assert!(warned >= 2, "before the pass, at AOS and at LOS: {:?}", world.events(EventKind::Plan));
    // In the second pass it comes back half-way.
    let half = UtcUs(passes[1].aos_at.0 / 2 + passes[1].los_at.unwrap().0 / 2);
    live(&mut world, half);
    world.link_state(LinkState::Ok);
    live(&mut world, passes[1].los_at.unwrap().plus(S as i64));
    assert!(runs(&world).iter().any(|run| run.state == RunState::Ended));
}

#[test]
fn pass_that_was_slept_through_is_reported_at_the_start() {
    let (mut world, passes) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    let snapshot = world.snapshot();
    world.step_utc(passes[0].los_at.unwrap().0 + 1 - world.now.utc.0);
    world.restart_from(snapshot);
    assert!(matches!(&runs(&world)[0].state, RunState::Missed(why) if why.contains("not running")));
}

#[test]
fn operator_takes_over_and_gives_back() {
    let (mut world, passes) = world();
    let listen = Step { action: Action::Listen { for_us: 60 * S }, ..send(Telecommand::Ping) };
    hand_over(&mut world, plan("status", vec![listen, send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    let satellite = world.satellite.clone();
    let over = |held| Intent::TakeOver { satellite: satellite.clone(), held };
    assert!(matches!(want(&mut world, over(true)), Err(Refusal::NothingRuns(_))));
    live(&mut world, passes[0].aos_at.plus(30 * S as i64));
    want(&mut world, over(true)).unwrap();
    live(&mut world, passes[0].aos_at.plus(180 * S as i64));
    assert!(world.transmits.is_empty(), "held");
    want(&mut world, over(false)).unwrap();
    live(&mut world, passes[0].los_at.unwrap());
    assert_eq!(world.transmits.len(), 1, "{:#?}", world.events(EventKind::Plan));
}

#[test]
fn disarmed_in_mid_pass_it_stops() {
    let (mut world, passes) = world();
    let steps = (0..90).map(|_| send(Telecommand::Ping)).collect();
    hand_over(&mut world, plan("status", steps)).unwrap();
    arm(&mut world, "status", true);
    live(&mut world, passes[0].aos_at.plus(100 * S as i64));
    let before = world.transmits.len();
    assert!(before > 0);
    arm(&mut world, "status", false);
    live(&mut world, passes[0].los_at.unwrap());
    assert!(world.transmits.len() <= before + 1);
    assert!(matches!(runs(&world)[0].progress.end, Some(RunEnd::Stopped(_))));
}

#[test]
fn what_is_undone_at_los_is_done_in_the_next_pass() {
    let (mut world, passes) = world();
    let steps = (0..60)
        .map(|_| Step { action: Action::Listen { for_us: 20 * S }, ..send(Telecommand::Ping) })
        .collect();
    hand_over(&mut world, Plan { at_los: AtLos::FinishLater, ..plan("long", steps) }).unwrap();
    arm(&mut world, "long", true);
    live(&mut world, passes[0].los_at.unwrap().plus(S as i64));
    let first = runs(&world).iter().find(|run| run.state == RunState::Ended).cloned().unwrap();
    assert_eq!(first.progress.end, Some(RunEnd::Later));
    live(&mut world, passes[1].los_at.unwrap().plus(S as i64));
    let second = runs(&world).iter().filter(|run| run.state == RunState::Ended).nth(1).cloned().unwrap();
    let begun = second.progress.results.first().map(|result| result.step.clone()).unwrap();
    assert_ne!(begun, "steps[0]");
    assert!(second.progress.results.iter().all(|result| result.end != StepEnd::Skipped));
}

#[test]
fn chosen_pass_that_new_elements_take_away_is_told() {
    let (mut world, passes) = world();
    hand_over(&mut world, Plan { attach: None, ..plan("status", vec![send(Telecommand::Ping)]) }).unwrap();
    arm(&mut world, "status", true);
    let name = PlanName::new("status").unwrap();
    let attach = |at| Intent::AttachPlan { plan: name.clone(), at, attach: true };
    let refusal = want(&mut world, attach(passes[0].aos_at.plus(-60_000_000))).unwrap_err().to_string();
    assert!(refusal.contains("not in view") && refusal.contains("next one begins"), "{refusal}");
    want(&mut world, attach(passes[1].tca_at)).unwrap();
    assert_eq!(world.station.status(world.now).schedule.contacts.len(), 1);
    // Half a revolution on: no pass at that time.
    add(&mut world, vec![elements(UTC0, 180.0)]).unwrap();
    assert!(world.events(EventKind::Plan).iter().any(|text| text.contains("attach it anew")));
    live(&mut world, passes[1].los_at.unwrap());
    assert!(world.transmits.is_empty());
}

#[test]
fn licence_and_blackout_are_obeyed() {
    let (_, passes) = world();
    let closed = Window { start: passes[1].aos_at.plus(-1), stop: passes[1].los_at.unwrap() };
    let times = Times {
        licence: Some(vec![Window { start: passes[1].aos_at.plus(-1), stop: passes[3].los_at.unwrap() }]),
        blackouts: vec![(closed, "people on the roof".to_owned())],
        switch_over_s: 30,
    };
    let (mut world, _) = world_with(times);
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    // An operator's command waits for the licence as well.
    let command = world.command(Telecommand::Ping);
    live(&mut world, passes[0].los_at.unwrap());
    assert!(world.transmits.is_empty());
    assert_eq!(world.stage(command), Stage::Queued);
    assert!(!runs(&world).iter().any(|run| run.aos_at < passes[2].aos_at.plus(-1)), "{:?}", runs(&world));
    live(&mut world, passes[2].los_at.unwrap());
    assert!(runs(&world).iter().any(|run| run.state == RunState::Ended));
}

#[test]
fn twenty_commands_leave_when_their_conditions_hold_and_not_before() {
    let (mut world, passes) = world();
    let high = passes.iter().map(|pass| pass.max_elevation_deg).fold(0.0, f64::max);
    let mut waiting: Vec<(CommandId, Condition)> = Vec::new();
    for n in 0..20_u32 {
        let when = match n % 4 {
            0 => Condition { min_elevation_deg: Some(f64::from(n) * high / 24.0), ..Condition::default() },
            1 => Condition { heard_within_us: Some(10 * S), ..Condition::default() },
            2 => Condition { after_aos_us: Some(u64::from(n) * 12 * S), ..Condition::default() },
            _ => Condition { before_los_us: Some(200 * S), ..Condition::default() },
        };
        let intent = mission::CommandIntent {
            when: Some(Box::new(when.clone())),
            ..world.intent_of(Telecommand::Ping)
        };
        waiting.push((world.command_with(intent), when));
    }
    let mut radiated = Vec::new();
    let mut killed = 0;
    let mut beat = 0_u64;
    let mut beaten = 0_u64;
    let end = passes.last().unwrap().aos_at;
    while world.now.utc < end {
        let status = world.station.status(world.now);
        let in_view = status.satellites[0].in_view == Some(true);
        if in_view && world.now.mono.0 >= beat {
            world.heartbeat();
            beaten = world.now.mono.0;
            beat = beaten + 60 * S;
        }
        let count = world.transmits.len();
        if count > radiated.len() {
            let id = world.last_tx().command;
            let (_, when) = waiting.iter().find(|(command, _)| *command == id).unwrap();
            let pass = passes.iter().find(|pass| pass.lasts_at(world.now.utc)).expect("in a pass");
            let since_us = u64::try_from(world.now.utc.0 - pass.aos_at.0).unwrap();
            let left_us = u64::try_from(pass.los_at.unwrap().0 - world.now.utc.0).unwrap();
            assert!(when.after_aos_us.is_none_or(|us| since_us >= us), "{when:?}");
            assert!(when.before_los_us.is_none_or(|us| left_us + S >= us), "{when:?} {left_us}");
            assert!(when.heard_within_us.is_none_or(|us| world.now.mono.0 - beaten <= us + S), "{when:?}");
            assert!(left_us > S, "its answer ends before LOS");
            radiated.push(id);
            if radiated.len() % 3 == 0 {
                killed += 1;
                world.tx_failed(mission::MaybeRadiated::Maybe);
                world.restart();
                world.link_state(LinkState::Ok);
            } else {
                world.radiate();
                let (tag, _) = world.last_request();
                world.hear(&frame(0, tag, &[]));
            }
        }
        world.pass(S / 2);
    }
    assert!(killed > 3);
    let mut left: Vec<CommandId> =
        waiting.iter().map(|(id, _)| *id).filter(|id| !radiated.contains(id)).collect();
    left.retain(|id| world.stage(*id) != Stage::Queued);
    assert!(left.is_empty(), "neither radiated nor queued: {left:?}");
    let gone = waiting.iter().filter(|(id, _)| radiated.contains(id)).count();
    assert!(gone >= 15, "{gone} of 20 left");
}

#[test]
fn command_with_a_condition_holds_up_no_other_and_no_download() {
    let (mut world, passes) = world();
    let never = Condition { min_elevation_deg: Some(89.9), ..Condition::default() };
    let intent = mission::CommandIntent {
        when: Some(Box::new(never)),
        priority: 10,
        ..world.intent_of(Telecommand::Ping)
    };
    let held = world.command_with(intent);
    let other = world.command(Telecommand::Ping);
    to(&mut world, passes[0].aos_at.plus(20 * S as i64));
    world.heartbeat();
    world.pass(5 * S);
    assert_eq!(world.last_tx().command, other);
    world.radiate();
    let (tag, _) = world.last_request();
    world.hear(&frame(0, tag, &[]));
    world.download();
    world.pass(5 * S);
    assert_eq!(world.transmits.len(), 2, "the download asks on");
    assert_eq!(world.stage(held), Stage::Queued);
}

#[test]
fn wrong_plans_are_refused_with_place_and_remedy() {
    let (mut world, _) = world();
    let critical = plan("boom", vec![send(Telecommand::Reset)]);
    let refusal = hand_over(&mut world, critical).unwrap_err().to_string();
    assert!(refusal.contains("steps[0]") && refusal.contains("approv"), "{refusal}");
    let unknown = Plan { satellite: mission::SatelliteId::new("other").unwrap(), ..plan("x", vec![]) };
    assert!(matches!(hand_over(&mut world, unknown), Err(Refusal::UnknownSatellite(_))));
    let arm = Intent::ArmPlan { plan: PlanName::new("nobody").unwrap(), armed: true };
    assert!(matches!(want(&mut world, arm), Err(Refusal::UnknownPlan(_))));
}

#[test]
fn rotator_fault_is_told_before_the_pass() {
    let (mut world, passes) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    world.handle(Input::Antenna { fault: Some("it refuses to move") });
    live(&mut world, passes[0].aos_at);
    let told = world.events(EventKind::Plan);
    assert!(told.iter().any(|text| text.contains("rotator: it refuses to move")), "{told:?}");
}

fn capture() -> Telecommand {
    Telecommand::CaptureImage {
        resolution: protocol::Resolution::Cif,
        grey: false,
        strong_compression: false,
    }
}

#[test]
fn plans_follow_no_elements_that_are_too_old_to_be_believed() {
    let (mut world, _) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    assert!(!world.station.status(world.now).schedule.contacts.is_empty());
    world.pass(60 * 86_400 * S);
    assert!(world.station.status(world.now).schedule.contacts.is_empty());
    assert!(world.station.status(world.now).runs.is_empty());
    assert!(world.events(EventKind::Plan).iter().any(|text| text.contains("add newer ones")));
}

#[test]
fn nothing_is_transmitted_in_a_blackout() {
    let (_, passes) = world();
    let closed = Window { start: passes[0].aos_at.plus(-1), stop: passes[0].los_at.unwrap() };
    let blackouts = vec![(closed, "people on the roof".to_owned())];
    let (mut world, _) = world_with(Times { blackouts, ..Times::default() });
    let command = world.command(Telecommand::Ping);
    to(&mut world, passes[0].tca_at);
    world.heartbeat();
    world.pass(5 * S);
    assert!(world.note().contains("people on the roof"), "{}", world.note());
    live(&mut world, passes[0].los_at.unwrap());
    assert!(world.transmits.is_empty());
    live(&mut world, passes[1].los_at.unwrap());
    assert_eq!(world.stage(command), Stage::Answered);
}

#[test]
fn run_by_a_clock_that_was_an_hour_ahead_leaves_the_true_pass_its_own() {
    const HOUR_US: i64 = 3_600_000_000;
    let (mut world, passes) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    let (aos, los) = (passes[1].aos_at, passes[1].los_at.unwrap());
    to(&mut world, aos.plus(-HOUR_US - 600_000_000));
    world.step_utc(HOUR_US);
    live(&mut world, los.plus(10_000_000));
    let of_pass = |world: &World| {
        let runs = runs(world);
        runs.into_iter()
            .filter(|run| run.state == RunState::Ended && run.los_at.0.abs_diff(los.0) < S)
            .count()
    };
    assert_eq!(of_pass(&world), 1);
    world.step_utc(-HOUR_US);
    world.handle(Input::Clock { synchronised: true });
    // Not forgotten over a restart either.
    world.restart();
    world.link_state(LinkState::Ok);
    live(&mut world, los.plus(10_000_000));
    assert_eq!(of_pass(&world), 2);
    // A second more or less is the same pass.
    world.step_utc(-11_000_000);
    live(&mut world, los.plus(10_000_000));
    assert_eq!(of_pass(&world), 2);
}

#[test]
fn pass_that_is_given_away_finishes_nothing() {
    let (mut world, passes) = world();
    let steps = (0..60)
        .map(|_| Step { action: Action::Listen { for_us: 20 * S }, ..send(Telecommand::Ping) })
        .collect();
    hand_over(&mut world, Plan { at_los: AtLos::FinishLater, ..plan("long", steps) }).unwrap();
    arm(&mut world, "long", true);
    live(&mut world, passes[0].los_at.unwrap().plus(S as i64));
    arm(&mut world, "long", false);
    assert!(runs(&world).iter().any(|run| matches!(run.state, RunState::Dropped(_))));
    arm(&mut world, "long", true);
    live(&mut world, passes[1].los_at.unwrap().plus(S as i64));
    let second = runs(&world).iter().filter(|run| run.state == RunState::Ended).nth(1).cloned().unwrap();
    let begun = second.progress.results.first().map(|result| result.step.clone()).unwrap();
    assert_ne!(begun, "steps[0]");
}

#[test]
fn pass_that_another_plan_gets_says_so() {
    let (mut world, _) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    hand_over(&mut world, Plan { priority: 1, ..plan("better", vec![send(Telecommand::Ping)]) }).unwrap();
    arm(&mut world, "better", true);
    let told = world.events(EventKind::Plan);
    assert!(told.iter().any(|text| text.ends_with("plan better gets this pass")), "{told:?}");
}

#[test]
fn what_a_stopped_plan_has_on_the_air_is_not_repeated() {
    let (mut world, passes) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    to(&mut world, passes[0].aos_at.plus(20 * S as i64));
    world.heartbeat();
    world.pass(5 * S);
    let command = world.last_tx().command;
    world.radiate();
    arm(&mut world, "status", false);
    for _ in 0..4 {
        world.pass(50 * S);
        world.heartbeat();
    }
    assert_eq!(world.transmits.len(), 1, "{:?}", world.stages(command));
    assert_eq!(world.stage(command), Stage::Unknown);
    assert!(!world.stages(command)[1..].contains(&Stage::Queued));
}
