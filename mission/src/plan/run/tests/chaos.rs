//! Random plans under random skies, with deaths at every point.

use proptest::prelude::*;

use super::*;

fn condition() -> impl Strategy<Value = Condition> {
    let guard =
        Guard { parameter: "heartbeat.temp".to_owned(), op: Op::Less, value: 30.0, max_age_us: 60 * S };
    (
        prop::option::weighted(0.2, 0.0..60.0),
        prop::option::weighted(0.2, 1..90_u64),
        prop::bool::weighted(0.1),
        prop::option::weighted(0.2, 0..200_u64),
        prop::option::weighted(0.1, 1..200_u64),
    )
        .prop_map(move |(min_elevation_deg, heard, guarded, after, before)| Condition {
            min_elevation_deg,
            heard_within_us: heard.map(|s| s * S),
            telemetry: if guarded { vec![guard.clone()] } else { Vec::new() },
            after_aos_us: after.map(|s| s * S),
            before_los_us: before.map(|s| s * S),
        })
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        2 => (1..40_u64).prop_map(|s| Action::Listen { for_us: s * S }),
        4 => prop::collection::vec(
            prop_oneof![
                Just(Telecommand::Ping),
                Just(Telecommand::GetAdcsInfo),
                Just(Telecommand::SetTransmitter { on: false }),
                Just(Telecommand::CaptureImage {
                    resolution: protocol::Resolution::Cif,
                    grey: false,
                    strong_compression: false,
                }),
            ],
            1..4,
        ).prop_map(send),
        1 => Just(Action::DownloadImage),
        2 => (condition(), 1..60_u64)
            .prop_map(|(until, s)| Action::WaitFor { until, timeout_us: s * S }),
    ]
}

fn wrap(action: impl Strategy<Value = Action>) -> impl Strategy<Value = Step> {
    let on_failure = prop_oneof![
        1 => Just(OnFailure::Abort), 3 => Just(OnFailure::Skip), 3 => Just(OnFailure::Continue)
    ];
    (action, condition(), prop::option::weighted(0.5, 1..120_u64), on_failure).prop_map(
        |(action, when, limit, on_failure)| Step { action, when, limit_us: limit.map(|s| s * S), on_failure },
    )
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let leaf = wrap(action()).boxed();
    let any = leaf.prop_recursive(2, 12, 3, |inner| {
        let repeat = (prop::collection::vec(inner, 1..4), prop::option::of(condition()), 1..4_u32)
            .prop_map(|(steps, until, at_most)| Action::Repeat { steps, until, at_most });
        wrap(repeat).boxed()
    });
    prop::collection::vec(any, 1..6)
}

fn plans() -> impl Strategy<Value = Plan> {
    (steps(), prop::option::weighted(0.2, 1..400_u64), any::<bool>(), prop::bool::weighted(0.95)).prop_map(
        |(steps, limit, later, transmit)| Plan {
            limit_us: limit.map(|s| s * S),
            at_los: if later { AtLos::FinishLater } else { AtLos::Stop },
            transmit,
            ..plan(steps)
        },
    )
}

/// What happens between two calls.
#[derive(Debug, Clone)]
struct Turn {
    us: u64,
    elevation_deg: f64,
    heard_s: Option<u64>,
    temp: Option<f64>,
    /// How far each open ask comes.
    luck: u8,
    held: bool,
    los_s: i64,
    clock_us: i64,
    death: u8,
}

fn turns() -> impl Strategy<Value = Vec<Turn>> {
    let sky = (0..25_000_000_u64, 0.0..80.0, prop::option::of(0..120_u64), prop::option::of(20.0..40.0));
    let rest = (any::<u8>(), prop::bool::weighted(0.05), -3..3_i64, -500_000..500_000_i64, 0..6_u8);
    let turn =
        (sky, rest).prop_map(|((us, elevation_deg, heard_s, temp), (luck, held, los_s, clock_us, death))| {
            Turn { us, elevation_deg, heard_s, temp, luck, held, los_s, clock_us, death }
        });
    prop::collection::vec(turn, 10..80)
}

fn come_further(asked: &mut BTreeMap<Ordinal, AskState>, luck: u8) {
    for (ordinal, state) in asked {
        let luck = luck.wrapping_mul(31).wrapping_add(u8::try_from(ordinal.0 % 251).unwrap()) % 16;
        match state {
            AskState::Command(_, stage) if !stage.is_final() => {
                *stage = match (luck, *stage) {
                    (0..6, stage) => stage,
                    (6, _) => Stage::Unknown,
                    (7, Stage::Radiated) => Stage::Rejected,
                    (8, Stage::Queued) => Stage::Expired,
                    (_, Stage::Queued) => Stage::Sealed,
                    (_, Stage::Sealed) => Stage::Radiating,
                    (_, Stage::Radiating) => Stage::Radiated,
                    (_, stage) => {
                        if stage == Stage::Radiated {
                            Stage::Answered
                        } else {
                            stage
                        }
                    }
                };
            }
            AskState::Download(_, state @ DownloadView::Active) => match luck {
                0..12 => {}
                12 => *state = DownloadView::Ended,
                _ => *state = DownloadView::Complete,
            },
            _ => {}
        }
    }
}

fn live(world: &mut World, turn: &Turn) {
    world.pass(turn.us);
    world.now.utc = world.now.utc.plus(turn.clock_us);
    world.window.los = world.window.los.plus(turn.los_s * 1_000_000);
    world.elevation_deg = Some(turn.elevation_deg);
    world.heard_ago_us = turn.heard_s.map(|s| s * S);
    world.telemetry.clear();
    if let Some(value) = turn.temp {
        let reading = Reading { value: Some(value), age_us: turn.us };
        world.telemetry.insert("heartbeat.temp".to_owned(), reading);
    }
    world.held = turn.held;
    come_further(&mut world.asked, turn.luck);
}

/// What is not repeatable and was once accepted is asked for in no later pass, unless it certainly did not happen.
fn check_next_pass(world: &World) {
    if world.end() != Some(&RunEnd::Later) {
        return;
    }
    let mut next = World::new((*world.plan).clone(), 400);
    let progress = world.run.progress().for_next_pass();
    let Some(frame) = progress.cursor.last().copied() else { return };
    next.run = PlanRun::resume(Arc::clone(&world.plan), next.window, progress.clone());
    next.progress = progress;
    let place = next.run.current_step();
    if let Some(Action::Send(send)) = try_find(&world.plan.steps, &place).map(|step| &step.action)
        && let Some(telecommand) = send.telecommands.get(frame.part as usize)
        && !telecommand.is_idempotent()
    {
        let ordinal = next.run.ordinal();
        let went = matches!(
            world.asked.get(&ordinal),
            Some(AskState::Command(_, Stage::Radiating | Stage::Radiated | Stage::Unknown | Stage::Answered))
        );
        assert!(!went, "{place} would be sent again");
    }
}

fn try_find<'a>(steps: &'a [Step], place: &str) -> Option<&'a Step> {
    let (first, rest) = place.split_once('.').map_or((place, None), |(first, rest)| (first, Some(rest)));
    let index: usize = first.trim_start_matches("steps[").trim_end_matches(']').parse().ok()?;
    match (rest, &steps.get(index)?.action) {
        (None, _) => steps.get(index),
        (Some(rest), Action::Repeat { steps, .. }) => try_find(steps, rest),
        _ => None,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// The promises are asserted by the world at every call; here the process dies before or after the commit, whenever
    /// it likes.
    #[test]
    fn nothing_twice_nothing_outside_and_an_end_at_los(plan in plans(), turns in turns()) {
        let mut world = World::new(plan, 400);
        for turn in &turns {
            live(&mut world, turn);
            world.advance(turn.death == 0);
            if turn.death <= 1 {
                world.kill();
            }
        }
        if world.now.utc < world.window.los {
            let left = u64::try_from(world.window.los.0 - world.now.utc.0).unwrap();
            world.pass(left);
        }
        world.advance(false);
        prop_assert!(world.end().is_some());
        prop_assert!(!world.run.progress().results.is_empty() || world.run.progress().started_at.is_none());
        check_next_pass(&world);
    }

    /// A process that dies after every single call does just what one does that lives.
    #[test]
    fn deaths_change_nothing(plan in plans(), turns in turns()) {
        let (mut lives, mut dies) = (World::new(plan.clone(), 400), World::new(plan, 400));
        for turn in turns {
            let turn = Turn { clock_us: 0, ..turn };
            live(&mut lives, &turn);
            lives.advance(false);
            live(&mut dies, &turn);
            dies.advance(false);
            dies.kill();
            prop_assert_eq!(&lives.asked, &dies.asked);
            prop_assert_eq!(&lives.progress.cursor, &dies.progress.cursor);
            prop_assert_eq!(&lives.progress.results, &dies.progress.results);
            prop_assert_eq!(&lives.progress.end, &dies.progress.end);
        }
    }

    /// Called at its wake-ups alone it comes to its end in bounded time.
    #[test]
    fn it_wakes_itself(plan in plans(), luck in any::<u8>()) {
        let mut world = World::new(plan, 400);
        let mut calls = 0;
        while world.end().is_none() {
            come_further(&mut world.asked, luck.wrapping_add(u8::try_from(calls % 256).unwrap()));
            world.advance(false);
            if let Some(at) = world.run.next_wakeup() {
                world.pass(at.since(world.now.mono));
            }
            calls += 1;
            prop_assert!(calls < 2000);
        }
    }
}
