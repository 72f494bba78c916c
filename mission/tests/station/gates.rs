//! Listen first: when the uplink may be used, and how long an answer is awaited.

use mission::{Gate, Input, Intent, Lease, LinkState, MaybeRadiated, Refusal, Stage};
use protocol::{Resolution, Telecommand};
use radio::airtime::LinkTiming;

use crate::frames::{chunk_frame, frame, info_frame};
use crate::world::{S, Setup, World};

fn blind(world: &mut World, telecommand: Telecommand) -> mission::CommandId {
    let intent = mission::CommandIntent { gate: Gate::Blind, ..world.intent_of(telecommand) };
    world.command_with(intent)
}

#[test]
fn nothing_is_sent_to_a_satellite_that_was_not_heard_unless_blind_is_wanted() {
    let mut world = World::new(Setup::default());
    world.link_state(LinkState::Ok);
    let heard = world.command(Telecommand::Ping);
    world.pass(60 * S);
    assert!(world.transmits.is_empty());
    let blind = blind(&mut world, Telecommand::Ping);
    assert_eq!((world.stage(blind), world.stage(heard)), (Stage::Radiating, Stage::Queued));
}

/// Whoever could send nothing anyhow must not keep the key from others.
#[test]
fn the_lease_of_a_key_is_wanted_when_nothing_else_is_missing() {
    let mut world = World::new(Setup::default());
    world.link_state(LinkState::Ok);
    let key = world.key();
    let why = "key is used by station b".to_owned();
    world.handle(Input::Lease { key, lease: Lease::NotOurs { why: why.clone() } });
    world.command(Telecommand::Ping);
    world.pass(10 * S);
    let wants = |world: &World| world.station.status(world.now).satellites[0].wants_lease;
    assert!(!wants(&world), "{}", world.note());
    world.heartbeat();
    world.pass(10 * S);
    assert!(wants(&world), "{}", world.note());
    assert_eq!(world.note(), why);
    world
        .handle(Input::Lease { key, lease: Lease::Ours { until: world.now.mono.plus(30 * S), spent: None } });
    assert_eq!(world.transmits.len(), 1);
    assert!(!wants(&world), "it is on its way");
}

#[test]
fn blind_listens_for_five_seconds_first() {
    let mut world = World::new(Setup::default());
    world.link_state(LinkState::Ok);
    blind(&mut world, Telecommand::Ping);
    world.pass(4_900_000);
    assert!(world.transmits.is_empty());
    world.pass(200_000);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn contact_ends_two_and_a_half_periods_after_the_last_frame() {
    let mut world = World::in_contact();
    world.pass(145 * S - 10);
    assert!(world.station.status(world.now).satellites[0].in_contact);
    world.pass(20);
    assert!(!world.station.status(world.now).satellites[0].in_contact);
    world.command(Telecommand::Ping);
    world.pass(60 * S);
    assert!(world.transmits.is_empty());
}

#[test]
fn nothing_of_ours_is_on_the_air_when_a_heartbeat_is_due() {
    let mut world = World::in_contact();
    let rhythm = world.now.mono.0 - 5 * S;
    let airtime = LinkTiming::default().uplink_us();
    for second in 0..120u64 {
        let mut at = world.now.mono.0;
        if world.transmits.len() < usize::try_from(second).unwrap() {
            world.command(Telecommand::Ping);
        }
        if let Some(tx) = world.transmits.last().map(|tx| tx.tx) {
            let phase = (at - rhythm) % (60 * S);
            if world.station.status(world.now).links[0].on_air {
                assert!(phase + airtime < 60 * S - S, "handed over {phase} us into the period");
                world.radiate();
                let (tag, _) = world.last_request();
                world.hear(&frame(0, tag, &[]));
            }
            at = tx.0;
        }
        let _ = at;
        world.pass(S / 2);
        if (world.now.mono.0 - rhythm) % (60 * S) < S / 2 {
            world.heartbeat();
        }
    }
    assert!(world.transmits.len() > 10);
}

#[test]
fn a_frame_that_is_being_received_is_not_talked_over() {
    let mut world = World::in_contact();
    let whole = chunk_frame(0, 0, 1);
    world.hear(&whole[..100]);
    world.command(Telecommand::Ping);
    world.pass(50_000);
    assert!(world.transmits.is_empty(), "{}", world.note());
    world.pass(200_000);
    assert_eq!(world.transmits.len(), 1, "it ended in nothing");
}

#[test]
fn chunks_that_come_by_the_satellites_own_schedule_are_not_talked_over() {
    let mut world = World::in_contact();
    world.hear(&chunk_frame(0, 0, 1));
    world.command(Telecommand::Ping);
    world.pass(S);
    assert!(world.transmits.is_empty(), "{}", world.note());
    world.pass(4 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn an_answer_to_somebody_else_is_let_finish() {
    let mut world = World::in_contact();
    world.hear(&chunk_frame(99, 0, 1));
    world.command(Telecommand::Ping);
    world.pass(S);
    assert!(world.transmits.is_empty());
}

#[test]
fn an_answer_must_end_before_loss_of_signal() {
    let mut world = World::in_contact();
    let los = world.now.utc.plus(20_000_000);
    world.view(Some(Some(los)));
    let long = world.command(Telecommand::GetImageChunk { first: 0, count: 64 });
    let short = world.command(Telecommand::GetImageInfo);
    world.pass(S / 10);
    assert_eq!((world.stage(long), world.stage(short)), (Stage::Queued, Stage::Radiating));
}

#[test]
fn below_the_horizon_nothing_is_sent() {
    let mut world = World::in_contact();
    world.view(None);
    world.command(Telecommand::Ping);
    world.pass(20 * S);
    assert!(world.transmits.is_empty());
    world.view(Some(None));
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn a_download_asks_for_no_more_than_the_pass_carries() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 200, 200 * 222, 408));
    let los = world.now.utc.plus(30_000_000);
    world.view(Some(Some(los)));
    world.download();
    world.radiate();
    world.hear(&info_frame(world.last_request().0, true, 200, 200 * 222, 408));
    world.pass(S / 10);
    match world.last_request().1 {
        Telecommand::GetImageChunk { count, .. } => assert!((5..20).contains(&count), "{count}"),
        other => panic!("{other}"),
    }
}

#[test]
fn the_time_out_is_the_expected_end_and_at_least_five_seconds_while_nothing_was_measured() {
    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    world.radiate();
    world.pass(5 * S);
    assert_eq!(world.stage(ping), Stage::Radiated);
    world.pass(3 * S);
    assert_ne!(world.stage(ping), Stage::Radiated);
}

#[test]
fn a_measured_link_waits_two_turn_rounds_only() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 30, 30 * 222, 408));
    world.command(Telecommand::GetImageChunk { first: 0, count: 20 });
    while world.transmits.is_empty() {
        world.pass(S);
    }
    world.radiate();
    let (tag, _) = world.last_request();
    for index in 0..20 {
        world.pass(1_300_000);
        world.hear(&chunk_frame(tag, index, 1));
    }
    let ping = world.command(Telecommand::Ping);
    while world.stage(ping) != Stage::Radiating {
        world.pass(S / 10);
    }
    world.radiate();
    world.pass(3_500_000);
    assert_ne!(world.stage(ping), Stage::Radiated);
}

#[test]
fn a_chunk_that_was_not_asked_for_does_not_end_the_answer() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 30, 30 * 222, 408));
    world.command(Telecommand::GetImageChunk { first: 0, count: 5 });
    let next = world.command(Telecommand::Ping);
    world.radiate();
    let (tag, _) = world.last_request();
    world.pass(1_500_000);
    world.hear(&chunk_frame(tag, 0, 1));
    world.hear(&chunk_frame(tag, 29, 1));
    world.pass(2 * S);
    assert_eq!(world.stage(next), Stage::Queued, "four are still to come");
    for index in 1..5 {
        world.hear(&chunk_frame(tag, index, 1));
    }
    world.pass(S / 10);
    assert_eq!(world.stage(next), Stage::Radiating);
}

#[test]
fn a_command_expires_wherever_it_waits_and_is_never_radiated_after() {
    for confirmed in 0..4 {
        let mut world = World::in_contact();
        world.confirms = false;
        let expires_at = Some(world.now.utc.plus(3_000_000));
        let intent = mission::CommandIntent { expires_at, ..world.intent_of(Telecommand::Reset) };
        world.want(Intent::Command(intent));
        for _ in 0..confirmed {
            if !world.waiting.is_empty() {
                world.confirm();
            }
        }
        let before = world.transmits.len();
        world.pass(4 * S);
        world.confirms = true;
        world.settle();
        world.pass(10 * S);
        assert_eq!(world.transmits.len(), before, "{confirmed} confirmed");
        if before == 0 {
            assert_eq!(world.stage(mission::CommandId(1)), Stage::Expired, "{confirmed} confirmed");
        }
    }
}

#[test]
fn a_transmitter_that_is_disarmed_before_the_hand_over_stays_silent() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Reset);
    world.want(Intent::Command(intent));
    world.confirm_persists();
    world.confirm();
    let link = world.link.clone();
    world.want(Intent::ArmLink { link: link.clone(), armed: false });
    world.confirms = true;
    world.settle();
    world.pass(30 * S);
    assert!(world.transmits.is_empty());
    assert_eq!(world.stage(mission::CommandId(1)), Stage::Queued);
    world.want(Intent::ArmLink { link, armed: true });
    world.pass(5 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn a_commit_that_takes_long_does_not_send_into_a_heartbeat_or_below_the_horizon() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(Intent::Command(intent));
    world.confirm_persists();
    world.confirm();
    world.pass(54 * S);
    world.confirms = true;
    world.settle();
    assert!(world.transmits.is_empty(), "a heartbeat is due");
    world.heartbeat();
    world.pass(10 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn after_stop_nothing_new_is_radiated_and_nothing_new_is_taken() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(Intent::Command(intent));
    world.confirm_persists();
    world.handle(Input::Stop);
    world.confirms = true;
    world.settle();
    world.pass(60 * S);
    assert!(world.transmits.is_empty());
    let id = world.want(Intent::VouchClock);
    assert_eq!(world.reply(id), Some(&Err(Refusal::Stopping)));
}

#[test]
fn a_link_that_only_receives_takes_no_command() {
    let mut world = World::in_contact();
    let link = Some("file".parse().unwrap());
    let intent = mission::CommandIntent { link, ..world.intent_of(Telecommand::Ping) };
    let id = world.want(Intent::Command(intent));
    assert!(matches!(world.reply(id), Some(Err(Refusal::Argument(_)))));
}

#[test]
fn a_long_answer_does_not_hold_up_the_uplink_but_its_moment_is_kept_free() {
    let mut world = World::in_contact();
    let step = protocol::TorqueStep { torque_n_m: [0.0; 3], duration_ms: 30_000 };
    let mut profile = protocol::TorqueProfile::default();
    profile.steps.push(step).unwrap();
    let torque = world.command(Telecommand::ExecuteTorqueProfile(profile));
    world.radiate();
    let (torque_tag, _) = world.last_request();
    let ping = world.command(Telecommand::Ping);
    assert_eq!(world.stage(ping), Stage::Radiating);
    world.radiate();
    world.hear(&frame(0, world.last_request().0, &[]));
    world.pass(27 * S);
    let late = world.command(Telecommand::GetImageInfo);
    world.pass(2 * S);
    assert_eq!(world.stage(late), Stage::Queued, "{}", world.note());
    world.hear(&frame(4, torque_tag, &[0; 141]));
    assert_eq!(world.stage(torque), Stage::Answered);
    world.pass(S);
    assert_eq!(world.stage(late), Stage::Radiating);
}

#[test]
fn a_refused_frame_is_not_tried_again_at_once() {
    let mut world = World::in_contact();
    world.command(Telecommand::CaptureImage {
        resolution: Resolution::Cif,
        grey: false,
        strong_compression: false,
    });
    for n in 1..5 {
        assert_eq!(world.transmits.len(), n);
        world.tx_failed(MaybeRadiated::No);
        world.pass(1_900_000);
        assert_eq!(world.transmits.len(), n);
        world.pass(200_000);
    }
}
