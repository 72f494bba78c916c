//! Storage fails, hangs and recovers.

use mission::{Effect, Input, Intent, Record, Refusal, Stage};
use protocol::Telecommand;

use crate::frames::{chunk_frame, info_frame};
use crate::world::{S, World};

/// A world whose storage has just failed, with a batch out.
fn failing() -> World {
    let mut world = World::in_contact();
    world.confirms = false;
    world.heartbeat();
    world.refuse();
    world
}

#[test]
fn nothing_is_radiated_and_nothing_is_accepted_while_storage_fails() {
    let mut world = failing();
    let intent = world.intent_of(Telecommand::Ping);
    let id = world.want(Intent::Command(intent));
    assert!(matches!(world.reply(id), Some(Err(Refusal::Storage(_)))));
    world.pass(10 * S);
    assert!(world.transmits.is_empty());
}

#[test]
fn a_mark_that_is_not_durable_is_not_handed_over() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Reset);
    world.want(Intent::Command(intent));
    world.confirm_persists();
    world.confirm();
    for _ in 0..5 {
        world.refuse();
        assert!(world.transmits.is_empty());
        while world.waiting.is_empty() {
            world.pass(S);
        }
    }
    world.confirms = true;
    world.settle();
    world.pass(5 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn every_frame_goes_to_the_reserve_and_the_reserve_is_emptied_when_all_is_durable() {
    let mut world = failing();
    assert_eq!(world.reserve.len(), 1, "the one that waited");
    for n in 0..10 {
        world.pass(S / 3);
        world.heartbeat();
        assert_eq!(world.reserve.len(), 2 + n);
    }
    assert_eq!(world.reserve_clears, 0);
    world.confirms = true;
    world.pass(2 * S);
    assert_eq!(world.reserve_clears, 1);
    let frames = world.stored.iter().filter(|r| matches!(r, Record::Frame(_))).count();
    assert_eq!(frames, 12);
}

#[test]
fn a_failed_batch_is_tried_again_whole_and_in_order() {
    let mut world = World::in_contact();
    world.confirms = false;
    world.heartbeat();
    let Some(Effect::Persist(first)) = world.waiting.front().cloned() else { panic!() };
    world.refuse();
    world.heartbeat();
    assert!(world.waiting.is_empty(), "not at once");
    world.pass(1_100_000);
    assert_eq!(world.waiting.front(), Some(&Effect::Persist(first)));
}

#[test]
fn a_storm_on_a_storage_that_fails_or_hangs_stays_bounded_and_poisons_no_batch() {
    for fails in [true, false] {
        let mut world = World::in_contact();
        world.hear(&info_frame(0, true, 65_536, 65_536 * 222, 408));
        world.confirms = false;
        world.heartbeat();
        if fails {
            world.refuse();
        }
        for n in 0..60_000u32 {
            world.hear(&chunk_frame(0, u16::try_from(n).unwrap_or(u16::MAX), 3));
            if n % 7 == 0 {
                world.hear(&chunk_frame(0, u16::try_from(n).unwrap_or(u16::MAX), 3));
            }
            world.reserve.truncate(10);
        }
        let status = world.station.status(world.now).storage;
        assert!(status.waiting < 101_000, "{status:?}");
        assert!(status.frames_lost > 0);
        world.confirms = true;
        world.pass(3 * S);
        assert_eq!(world.station.status(world.now).storage.failing, None);
        let frames: std::collections::HashSet<_> = world
            .stored
            .iter()
            .filter_map(|r| if let Record::Frame(f) = r { Some(f.id) } else { None })
            .collect();
        for record in &world.stored {
            match record {
                Record::Chunk(row) => assert!(frames.contains(&row.frame), "its frame is not stored"),
                Record::Reception(row) => assert!(frames.contains(&row.frame), "its frame is not stored"),
                _ => {}
            }
        }
        assert_eq!(world.reserve_clears, 0, "some frames lie there alone");
    }
}

#[test]
fn a_hanging_storage_takes_no_intents_without_end() {
    let mut world = World::in_contact();
    world.confirms = false;
    world.heartbeat();
    let mut refused = 0;
    for _ in 0..60_000 {
        let id = world.want(Intent::VouchClock);
        refused += usize::from(matches!(world.reply(id), Some(Err(Refusal::Storage(_)))));
        world.replies.clear();
    }
    assert!(refused > 0 && world.station.status(world.now).storage.waiting < 101_000);
}

#[test]
fn a_recovered_frame_of_a_link_that_is_gone_is_kept() {
    let mut world = failing();
    let mut kept = world.reserve[0].clone();
    kept.route.link = "gone".parse().unwrap();
    world.confirms = true;
    world.pass(3 * S);
    let before = world.stored.iter().filter(|r| matches!(r, Record::Frame(_))).count();
    world.handle(Input::Recovered(&kept));
    let after = world.stored.iter().filter(|r| matches!(r, Record::Frame(_))).count();
    assert_eq!(after, before + 1);
    assert_eq!(world.reserve_clears, 2);
}

#[test]
fn a_command_in_preparation_goes_on_when_storage_recovers() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(Intent::Command(intent));
    world.refuse();
    world.confirms = true;
    world.pass(5 * S);
    assert_eq!(world.stage(mission::CommandId(1)), Stage::Radiating);
}
