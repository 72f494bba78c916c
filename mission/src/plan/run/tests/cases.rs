//! Small stories.

use super::*;

fn ping() -> Step {
    step(send([Telecommand::Ping]))
}

#[test]
fn steps_follow_each_other_when_answered() {
    let mut world = World::new(plan(vec![ping(), step(send([Telecommand::GetAdcsInfo]))]), 480);
    assert!(world.advance(false).is_empty(), "before AOS");
    assert_eq!(world.run.next_wakeup(), Some(world.now.mono.plus(10 * S)));
    world.go_to(0);
    let wishes = world.advance(false);
    assert_eq!(commands(&wishes), ["Ping"]);
    let Some(Wish::Command { priority: 3, expires_at, .. }) = wishes.get(1) else { panic!("{wishes:?}") };
    assert_eq!(*expires_at, world.window.los);
    world.set(0, Stage::Radiated);
    assert!(world.advance(false).is_empty());
    world.set(0, Stage::Answered);
    assert_eq!(commands(&world.advance(false)), ["GetAdcsInfo"]);
    world.set(1, Stage::Answered);
    world.advance(false);
    assert_eq!(world.end(), Some(&RunEnd::Completed { failures: 0 }));
    assert_eq!(world.run.next_wakeup(), None);
}

#[test]
fn a_step_of_several_telecommands_sends_each_in_every_round() {
    let two = step(send([Telecommand::Ping, Telecommand::GetAdcsInfo]));
    let repeat = step(Action::Repeat { steps: vec![two, ping()], until: None, at_most: 2 });
    let mut world = World::new(plan(vec![repeat, ping()]), 480);
    world.go_to(0);
    let mut sent = Vec::new();
    while world.end().is_none() {
        for wish in world.advance(false) {
            if let Wish::Command { ordinal, telecommand, .. } = wish {
                sent.push((ordinal.0, telecommand.name()));
                world.set(ordinal.0, Stage::Answered);
            }
        }
    }
    let round = ["Ping", "GetAdcsInfo", "Ping"];
    let wanted = round.into_iter().chain(round).chain(["Ping"]);
    assert_eq!(sent, (0..).zip(wanted).collect::<Vec<_>>());
}

#[test]
fn an_ask_that_is_not_accepted_yet_is_waited_for() {
    let mut world = World::new(plan(vec![ping()]), 480);
    world.go_to(0);
    let wishes = world.advance(true);
    assert_eq!(commands(&wishes), ["Ping"]);
    assert_eq!(commands(&world.advance(true)), [""; 0]);
    world.carry_out(&wishes);
    assert_eq!(commands(&world.advance(false)), [""; 0]);
    world.asked.insert(Ordinal(0), AskState::Refused("the queue is full".to_owned()));
    world.advance(false);
    assert!(matches!(world.end(), Some(RunEnd::Aborted { why, .. }) if why.contains("queue is full")));
}

#[test]
fn a_step_waits_for_all_its_conditions() {
    let when = Condition {
        min_elevation_deg: Some(20.0),
        heard_within_us: Some(70 * S),
        after_aos_us: Some(30 * S),
        ..Condition::default()
    };
    let mut world = World::new(plan(vec![Step { when, ..ping() }]), 480);
    (world.elevation_deg, world.heard_ago_us) = (Some(5.0), None);
    world.go_to(0);
    assert_eq!(commands(&world.advance(false)), [""; 0]);
    assert_eq!(world.run.next_wakeup(), Some(world.now.mono.plus(30 * S)));
    world.go_to(31);
    world.advance(false);
    assert_eq!(
        world.run.next_wakeup(),
        Some(world.now.mono.plus(S)),
        "the elevation is looked at each second"
    );
    world.elevation_deg = Some(20.0);
    assert_eq!(commands(&world.advance(false)), [""; 0], "not heard");
    world.heard_ago_us = Some(0);
    assert_eq!(commands(&world.advance(false)), ["Ping"]);
}

#[test]
fn a_guard_wants_a_young_and_valid_value() {
    let guard = Guard { parameter: "x.y".to_owned(), op: Op::AtLeast, value: 3.5, max_age_us: 60 * S };
    let when = Condition { telemetry: vec![guard], ..Condition::default() };
    let mut world = World::new(plan(vec![Step { when, ..ping() }]), 480);
    assert_eq!(world.run.parameters().into_iter().collect::<Vec<_>>(), ["x.y"]);
    world.go_to(1);
    for (value, age_us) in [(None, 0), (Some(4.0), 61 * S), (Some(3.4), 0), (Some(f64::NAN), 0)] {
        world.telemetry.insert("x.y".to_owned(), Reading { value, age_us });
        assert_eq!(commands(&world.advance(false)), [""; 0], "{value:?} {age_us}");
    }
    world.telemetry.insert("x.y".to_owned(), Reading { value: Some(3.5), age_us: 60 * S });
    assert_eq!(commands(&world.advance(false)), ["Ping"]);
}

#[test]
fn a_limit_withdraws_what_was_asked_for() {
    let limited = Step { limit_us: Some(20 * S), on_failure: OnFailure::Continue, ..ping() };
    let mut world = World::new(plan(vec![limited, step(Action::Listen { for_us: 5 * S })]), 480);
    world.go_to(0);
    let wishes = world.advance(false);
    let Some(Wish::Command { expires_at, .. }) = wishes.get(1) else { panic!("{wishes:?}") };
    assert_eq!(*expires_at, at(20));
    assert_eq!(world.run.next_wakeup(), Some(world.now.mono.plus(20 * S)));
    world.go_to(20);
    assert_eq!(commands(&world.advance(false)), ["cancel"]);
    world.go_to(25);
    world.advance(false);
    assert_eq!(world.end(), Some(&RunEnd::Completed { failures: 1 }));
}

#[test]
fn failure_aborts_skips_or_goes_on() {
    for (on_failure, ended, pings) in [
        (OnFailure::Abort, "aborted", 0),
        (OnFailure::Skip, "completed", 0),
        (OnFailure::Continue, "completed", 3),
    ] {
        let failing = Step { on_failure, ..step(send([Telecommand::GetImageInfo])) };
        let repeat = Action::Repeat { steps: vec![failing, ping()], until: None, at_most: 3 };
        let mut world = World::new(plan(vec![step(repeat)]), 480);
        world.go_to(0);
        let mut seen = 0;
        for _ in 0..20 {
            let wishes = world.advance(false);
            seen += commands(&wishes).iter().filter(|name| **name == "Ping").count();
            for wish in &wishes {
                if let Wish::Command { ordinal, telecommand, .. } = wish {
                    let ping = *telecommand == Telecommand::Ping;
                    world.set(ordinal.0, if ping { Stage::Answered } else { Stage::Rejected });
                }
            }
        }
        assert_eq!((world.end().unwrap().name(), seen), (ended, pings), "{on_failure:?}");
    }
}

#[test]
fn a_repeat_ends_by_its_condition_or_fails_by_its_bound() {
    let until = Condition { heard_within_us: Some(10 * S), ..Condition::default() };
    let listen = step(Action::Listen { for_us: 20 * S });
    let repeat = step(Action::Repeat { steps: vec![listen], until: Some(until), at_most: 3 });
    for (heard_at, ended) in [(Some(2), "completed"), (None, "aborted")] {
        let mut world = World::new(plan(vec![repeat.clone()]), 480);
        world.heard_ago_us = None;
        for round in 0..4 {
            world.go_to(round * 20);
            if heard_at == Some(round) {
                world.heard_ago_us = Some(0);
            }
            world.advance(false);
        }
        assert_eq!(world.end().unwrap().name(), ended);
    }
}

#[test]
fn a_download_ends_whole_or_with_what_came() {
    let limited = Step { limit_us: Some(100 * S), ..step(Action::DownloadImage) };
    for (complete, end) in [(true, StepEnd::Done), (false, StepEnd::Partly(String::new()))] {
        let mut world = World::new(plan(vec![limited.clone()]), 480);
        world.go_to(0);
        assert_eq!(commands(&world.advance(false)), ["download"]);
        if complete {
            world.asked.insert(Ordinal(0), AskState::Download(DownloadId(1), DownloadView::Complete));
        }
        world.go_to(100);
        assert_eq!(commands(&world.advance(false)).len(), usize::from(!complete));
        assert_eq!(world.end(), Some(&RunEnd::Completed { failures: 0 }));
        let found = &world.run.progress().results[0].end;
        assert_eq!(std::mem::discriminant(found), std::mem::discriminant(&end), "{found:?}");
    }
}

#[test]
fn the_clock_is_set_to_the_time_of_asking_and_never_repeated() {
    let mut clock = step(send([Telecommand::SetTimestamp { utc_ms: 0 }]));
    let mut world = World::new(plan(vec![clock.clone()]), 480);
    world.go_to(7);
    assert_eq!(commands(&world.advance(false)), [""; 0]);
    assert!(matches!(world.end(), Some(RunEnd::Aborted { why, .. }) if why.contains("nobody approved")));

    let Action::Send(send) = &mut clock.action else { unreachable!() };
    let by = crate::Principal::new("verma");
    send.approval = Some(Approval { by: by.clone(), digest: None, expires_at: Some(at(100)) });
    let mut world = World::new(plan(vec![clock.clone()]), 480);
    world.go_to(7);
    let wishes = world.advance(false);
    let Some(Wish::Command { telecommand, attempts, expires_at, approved_by, .. }) = wishes.get(1) else {
        panic!("{wishes:?}")
    };
    assert_eq!(*telecommand, Telecommand::SetTimestamp { utc_ms: 1_800_000_007_000 });
    assert_eq!((*attempts, *expires_at, approved_by), (Some(1), at(22), &Some(by)));

    let mut late = World::new(plan(vec![clock]), 480);
    late.go_to(100);
    late.advance(false);
    assert!(matches!(late.end(), Some(RunEnd::Aborted { why, .. }) if why.contains("expired")));
}

#[test]
fn a_schedule_in_the_past_is_not_sent() {
    let mut slots = protocol::heapless::Vec::new();
    let time_ms = u64::try_from(at(50).0 / 1000).unwrap();
    slots.push(protocol::DownlinkSlot { time_ms, first: 0, count: 1, attitude_mrp: None }).unwrap();
    let schedule = Telecommand::SetDownlinkSchedule(protocol::DownlinkSchedule { slots });
    for (s, sent) in [(49, 1), (50, 0)] {
        let mut world = World::new(plan(vec![step(send([schedule.clone()]))]), 480);
        world.go_to(s);
        assert_eq!(commands(&world.advance(false)).len(), sent);
    }
}

#[test]
fn what_may_have_been_obeyed_is_not_asked_for_in_the_next_pass() {
    let capture = Telecommand::CaptureImage {
        resolution: protocol::Resolution::Cif,
        grey: false,
        strong_compression: false,
    };
    for (stage, again) in [(Stage::Queued, true), (Stage::Radiated, false), (Stage::Sealed, false)] {
        let two = plan(vec![ping(), step(send([capture.clone()])), step(Action::DownloadImage)]);
        let two = Plan { at_los: AtLos::FinishLater, ..two };
        let mut world = World::new(two, 100);
        world.go_to(0);
        world.advance(false);
        world.set(0, Stage::Answered);
        assert_eq!(commands(&world.advance(false)), ["CaptureImage"]);
        world.set(1, stage);
        world.go_to(100);
        assert_eq!(commands(&world.advance(false)), ["cancel"]);
        assert_eq!(world.end(), Some(&RunEnd::Later));

        let mut next = World::new((*world.plan).clone(), 100);
        let progress = world.run.progress().for_next_pass();
        next.run = PlanRun::resume(Arc::clone(&next.plan), next.window, progress);
        next.go_to(0);
        let wanted = if again { "CaptureImage" } else { "download" };
        assert_eq!(commands(&next.advance(false)), [wanted], "{stage}");
    }
}

#[test]
fn the_next_pass_counts_its_times_anew() {
    let steps = vec![step(Action::Listen { for_us: 50 * S }), step(Action::Listen { for_us: 60 * S })];
    let mut world = World::new(Plan { at_los: AtLos::FinishLater, ..plan(steps) }, 100);
    for s in [0, 50, 100] {
        world.go_to(s);
        world.advance(false);
    }
    assert_eq!(world.end(), Some(&RunEnd::Later));
    let mut next = World::new((*world.plan).clone(), 100);
    let progress = world.run.progress().for_next_pass();
    next.run = PlanRun::resume(Arc::clone(&next.plan), next.window, progress);
    next.go_to(10);
    next.advance(false);
    assert_eq!(next.run.current_step(), "steps[1]");
    assert_eq!(next.run.next_wakeup(), Some(next.now.mono.plus(60 * S)));
}

#[test]
fn an_operator_takes_over_and_gives_back() {
    let mut world = World::new(plan(vec![ping()]), 480);
    world.held = true;
    world.go_to(0);
    assert_eq!(commands(&world.advance(false)), [""; 0]);
    world.held = false;
    world.go_to(100);
    assert_eq!(commands(&world.advance(false)), ["Ping"]);
    let asked = world.asked.clone();
    let view = RunView {
        now: world.now,
        window: world.window,
        elevation_deg: None,
        heard_ago_us: None,
        telemetry: &BTreeMap::new(),
        asked: &asked,
        held: false,
    };
    assert_eq!(commands(&world.run.stop(&view, "verma disarms it")), ["cancel"]);
    assert_eq!(world.end(), Some(&RunEnd::Stopped("verma disarms it".to_owned())));
}

#[test]
fn a_step_of_the_clock_shortens_no_wait() {
    let mut world = World::new(plan(vec![step(Action::Listen { for_us: 60 * S })]), 480);
    world.go_to(0);
    world.advance(false);
    world.pass(10 * S);
    world.now.utc = world.now.utc.plus(100_000_000);
    world.advance(false);
    assert_eq!(world.end(), None);
    world.pass(50 * S);
    world.advance(false);
    assert_eq!(world.end(), Some(&RunEnd::Completed { failures: 0 }));
}

#[test]
fn a_wait_goes_on_after_a_restart() {
    let mut world = World::new(plan(vec![step(Action::Listen { for_us: 60 * S })]), 480);
    world.go_to(0);
    world.advance(false);
    world.kill();
    world.go_to(40);
    world.advance(false);
    assert_eq!((world.end(), world.run.next_wakeup()), (None, Some(world.now.mono.plus(20 * S))));
    world.go_to(60);
    world.advance(false);
    assert_eq!(world.end(), Some(&RunEnd::Completed { failures: 0 }));
}

#[test]
fn progress_of_another_plan_ends_it() {
    let mut world = World::new(plan(vec![ping()]), 480);
    let frame = Frame { index: 0, ..Frame::default() };
    let progress = Progress { cursor: vec![frame, frame, frame], ..Progress::default() };
    world.run = PlanRun::resume(Arc::clone(&world.plan), world.window, progress);
    world.go_to(0);
    world.advance(false);
    assert!(matches!(world.end(), Some(RunEnd::Aborted { why, .. }) if why.contains("does not fit")));
}
