//! What must not happen twice does not, and what ended says what is known.

use mission::record::DownloadState;
use mission::{Gate, Intent, MaybeRadiated, Refusal, Stage};
use protocol::{Resolution, Telecommand};

use crate::frames::{chunk_frame, frame, heartbeat_frame, info_frame};
use crate::world::{S, World};

const CAPTURE: Telecommand =
    Telecommand::CaptureImage { resolution: Resolution::Cif, grey: false, strong_compression: false };

#[test]
fn an_unanswered_ping_is_repeated_with_a_new_tag_and_nonce_until_its_attempts_are_used_up() {
    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    let mut seen = Vec::new();
    for attempt in 1..=5 {
        for _ in 0..40 {
            if world.transmits.len() == attempt {
                break;
            }
            world.heartbeat();
            world.pass(5 * S);
        }
        seen.push((world.last_request().0, crate::world::counter_of(world.last_tx())));
        world.radiate();
    }
    for _ in 0..20 {
        world.heartbeat();
        world.pass(5 * S);
    }
    assert_eq!((world.transmits.len(), world.stage(ping)), (5, Stage::Unknown));
    assert!(seen.windows(2).all(|w| w[0].0 + 1 == w[1].0 && w[0].1 < w[1].1), "{seen:?}");
}

#[test]
fn a_reset_a_capture_and_a_torque_profile_are_radiated_once() {
    for telecommand in
        [Telecommand::Reset, CAPTURE, Telecommand::ExecuteTorqueProfile(protocol::TorqueProfile::default())]
    {
        let mut world = World::in_contact();
        let command = world.command(telecommand);
        world.radiate();
        for _ in 0..20 {
            // The uptime says nothing of a Reset: it booted long after.
            world.heartbeat_with_uptime(1_000);
            world.pass(60 * S);
        }
        assert_eq!((world.transmits.len(), world.stage(command)), (1, Stage::Unknown));
    }
}

#[test]
fn a_radio_that_cannot_say_makes_it_unknown_and_only_what_is_idempotent_goes_again() {
    for (telecommand, times) in [(Telecommand::Reset, 1), (Telecommand::Ping, 2)] {
        let mut world = World::in_contact();
        let command = world.command(telecommand);
        world.tx_failed(MaybeRadiated::Maybe);
        world.pass(20 * S);
        assert_eq!(world.transmits.len(), times);
        assert!(world.stages(command).contains(&Stage::Unknown));
    }
}

#[test]
fn a_radio_that_says_nothing_for_thirty_seconds_leaves_it_unknown() {
    let mut world = World::in_contact();
    let reset = world.command(Telecommand::Reset);
    let tx = world.last_tx().tx;
    world.pass(31 * S);
    assert_eq!(world.stage(reset), Stage::Unknown);
    world.tx_done(tx);
    world.pass(S);
    assert_eq!(world.stage(reset), Stage::Unknown, "what comes later tells nothing");
}

#[test]
fn what_the_radio_refused_can_be_cancelled_and_then_is_never_radiated() {
    let mut world = World::in_contact();
    let reset = world.command(Telecommand::Reset);
    world.tx_failed(MaybeRadiated::No);
    assert_eq!(world.stage(reset), Stage::Queued);
    assert!(world.cancel(reset).is_ok());
    assert_eq!(world.stage(reset), Stage::Cancelled, "it was certainly not obeyed");
    world.pass(30 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn an_answer_that_is_forged_for_a_refused_reset_changes_nothing() {
    let mut world = World::in_contact();
    let reset = world.command(Telecommand::Reset);
    let (tag, _) = world.last_request();
    world.tx_failed(MaybeRadiated::No);
    world.hear(&frame(1, tag, &[1]));
    assert_eq!(world.stage(reset), Stage::Queued);
}

#[test]
fn a_cancel_in_time_stops_it_at_every_stage_before_the_mark_and_is_refused_after() {
    for steps in 0..5 {
        let mut world = World::in_contact();
        world.confirms = false;
        let intent = world.intent_of(Telecommand::Reset);
        let id = world.want(Intent::Command(intent));
        for _ in 0..steps {
            if !world.waiting.is_empty() {
                world.confirm();
            }
        }
        let handed = world.transmits.len();
        let cancel = world.want(Intent::Cancel(mission::CommandId(1)));
        world.confirms = true;
        world.settle();
        world.pass(30 * S);
        assert!(matches!(world.reply(id), Some(Ok(_))));
        match world.reply(cancel).unwrap() {
            Ok(_) => assert_eq!((world.transmits.len(), handed), (0, 0), "after {steps} steps"),
            Err(Refusal::TooLate { .. }) => assert_eq!(world.transmits.len(), 1, "after {steps} steps"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_command_that_waits_to_be_repeated_becomes_unknown_when_it_is_withdrawn() {
    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    world.radiate();
    while world.stage(ping) != Stage::Queued {
        world.pass(S / 10);
    }
    assert!(world.cancel(ping).is_ok());
    assert_eq!(world.stage(ping), Stage::Unknown);
    world.pass(30 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn a_late_answer_settles_what_waits_to_be_repeated() {
    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    world.radiate();
    let (tag, _) = world.last_request();
    while world.stage(ping) != Stage::Queued {
        world.pass(S / 10);
    }
    world.hear(&frame(0, tag, &[]));
    assert_eq!(world.stage(ping), Stage::Answered);
    world.pass(30 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn an_answer_may_come_before_the_radio_reports() {
    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    let (tag, _) = world.last_request();
    world.hear(&frame(0, tag, &[]));
    world.radiate();
    assert_eq!(world.stages(ping), [Stage::Queued, Stage::Sealed, Stage::Radiating, Stage::Answered]);
}

#[test]
fn an_error_with_the_tag_rejects_and_one_with_another_tag_does_not() {
    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    world.radiate();
    let (tag, _) = world.last_request();
    world.hear(&frame(1, tag.wrapping_add(1), &[1]));
    assert_eq!(world.stage(ping), Stage::Radiated);
    world.hear(&frame(1, 0, &[36]));
    assert_eq!(world.stage(ping), Stage::Radiated);
    world.hear(&frame(0, tag, &[1, 2]));
    assert_eq!(world.stage(ping), Stage::Radiated, "a Pong with a payload is none");
    world.hear(&frame(1, tag, &[1]));
    assert_eq!(world.stage(ping), Stage::Rejected);
    let row = world.stage_rows(ping).last().unwrap();
    assert!(row.frame.is_some(), "the frame that proves it");
}

#[test]
fn without_tags_an_error_of_its_own_accord_does_not_reject_a_reset() {
    let profile = mission::Profile { tags: false, rssi: false, ..Default::default() };
    let mut world = World::in_contact_with(crate::world::Setup { profile, ..Default::default() });
    let reset = world.command(Telecommand::Reset);
    world.radiate();
    world.pass(10 * S);
    world.hear(&frame(1, 0, &[32]));
    assert_eq!(world.stage(reset), Stage::Radiated);
    world.heartbeat_with_uptime(9_000);
    assert_eq!(world.stage(reset), Stage::Answered);
}

#[test]
fn a_small_uptime_proves_a_reset_and_a_large_one_disproves_it() {
    for (uptime_ms, stage) in [(25_000, Stage::Answered), (4_000_000, Stage::Failed)] {
        let mut world = World::in_contact();
        let reset = world.command(Telecommand::Reset);
        world.radiate();
        world.pass(27 * S);
        world.heartbeat_with_uptime(uptime_ms);
        assert_eq!(world.stage(reset), stage);
    }
}

#[test]
fn a_heartbeat_that_comes_right_after_a_reset_may_be_older_than_it() {
    let mut world = World::in_contact();
    let reset = world.command(Telecommand::Reset);
    world.radiate();
    world.pass(S);
    world.heartbeat();
    assert_eq!(world.stage(reset), Stage::Radiated);
}

#[test]
fn switching_the_transmitter_off_is_not_repeated_into_its_own_success() {
    let mut world = World::in_contact();
    let off = world.command(Telecommand::SetTransmitter { on: false });
    world.radiate();
    world.pass(400 * S);
    assert_eq!(world.stage(off), Stage::Unknown, "silence proves nothing");
    let on = Telecommand::SetTransmitter { on: true };
    let on = mission::CommandIntent { gate: Gate::Blind, ..world.intent_of(on) };
    world.command_with(on);
    assert_eq!(world.transmits.len(), 2);
    world.radiate();
    let (tag, _) = world.last_request();
    world.hear(&heartbeat_frame(tag, 5_000_000, 1));
    world.pass(300 * S);
    assert_eq!(world.transmits.len(), 2, "it stays on");
}

#[test]
fn a_satellite_that_is_heard_after_it_was_switched_off_still_transmits() {
    let mut world = World::in_contact();
    let off = world.command(Telecommand::SetTransmitter { on: false });
    world.radiate();
    world.pass(30 * S);
    world.heartbeat();
    assert_eq!(world.stage(off), Stage::Failed);
}

#[test]
fn a_repeat_does_not_undo_what_was_set_after_it() {
    let mut world = World::in_contact();
    let old = world.command(Telecommand::SetAdcsAttitude { attitude_mrp: [0.1, 0.0, 0.0] });
    let new = mission::CommandIntent { priority: 5, ..world.intent_of(Telecommand::SetAdcsAuto) };
    let new = world.command_with(new);
    world.radiate();
    while world.stage(new) != Stage::Radiating {
        world.pass(S / 10);
    }
    world.radiate();
    world.hear(&frame(4, world.last_request().0, &[0; 141]));
    assert_eq!(world.stage(new), Stage::Answered);
    world.pass(30 * S);
    assert_eq!((world.transmits.len(), world.stage(old)), (2, Stage::Unknown));
}

#[test]
fn tags_go_from_1_to_255_and_round_again() {
    let mut world = World::in_contact();
    let mut tags = Vec::new();
    for _ in 0..300 {
        world.command(Telecommand::Ping);
        while world.transmits.len() == tags.len() {
            world.pass(S);
        }
        let (tag, _) = world.last_request();
        world.radiate();
        world.hear(&frame(0, tag, &[]));
        tags.push(tag);
        world.pass(S / 10);
        if tags.len() % 5 == 0 {
            world.heartbeat();
        }
    }
    assert!(tags.iter().all(|tag| *tag != 0));
    assert_eq!((tags[0], tags[254], tags[255]), (1, 255, 1));
}

#[test]
fn more_than_64_chunks_at_a_time_are_refused() {
    let mut world = World::in_contact();
    let intent = world.intent_of(Telecommand::GetImageChunk { first: 0, count: 65 });
    let id = world.want(Intent::Command(intent));
    assert!(matches!(world.reply(id), Some(Err(Refusal::Argument(_)))), "{:?}", world.reply(id));
}

#[test]
fn a_withdrawn_download_asks_for_nothing_more() {
    for steps in 0..5 {
        let mut world = World::in_contact();
        world.hear(&info_frame(0, true, 3, 600, 408));
        world.confirms = false;
        world.want(Intent::Download { satellite: world.satellite.clone(), link: None });
        for _ in 0..steps {
            if !world.waiting.is_empty() {
                world.confirm();
            }
        }
        let before = world.transmits.len();
        world.want(Intent::CancelDownload(mission::DownloadId(1)));
        world.confirms = true;
        world.settle();
        world.pass(30 * S);
        assert_eq!(world.transmits.len(), before, "after {steps} steps");
        assert_eq!(world.download_state(mission::DownloadId(1)), DownloadState::Cancelled);
    }
}

#[test]
fn a_request_that_the_radio_refused_is_worked_out_anew() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 2, 444, 408));
    world.download();
    world.radiate();
    world.hear(&info_frame(world.last_request().0, true, 2, 444, 408));
    world.pass(S / 10);
    assert_eq!(world.last_request().1, Telecommand::GetImageChunk { first: 0, count: 2 });
    world.tx_failed(MaybeRadiated::No);
    world.hear(&chunk_frame(0, 0, 1));
    world.pass(10 * S);
    assert_eq!(world.last_request().1, Telecommand::GetImageChunk { first: 1, count: 1 });
}
