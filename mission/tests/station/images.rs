//! What an image is, who may say so, and what is asked for.

use mission::record::DownloadState;
use mission::{Input, MaybeRadiated, ReservedFrame, Source, Stage, UtcUs};
use protocol::{Resolution, Telecommand};

use crate::frames::{chunk_frame, frame, info_frame};
use crate::world::{S, World};

const CAPTURE: Telecommand =
    Telecommand::CaptureImage { resolution: Resolution::Cif, grey: false, strong_compression: false };

fn answer_info(world: &mut World, chunks: u32) {
    let (tag, _) = world.last_request();
    world.hear(&info_frame(tag, true, chunks, chunks * 222, 408));
}

#[test]
fn the_same_image_info_again_is_the_same_image() {
    let mut world = World::in_contact();
    for _ in 0..3 {
        world.hear(&info_frame(0, true, 3, 600, 408));
        world.pass(40 * S);
    }
    assert_eq!(world.images().len(), 1);
    world.hear(&info_frame(0, true, 3, 601, 408));
    world.hear(&info_frame(0, true, 3, 601, 818));
    assert_eq!(world.images().len(), 3, "another size, another resolution");
}

#[test]
fn what_follows_a_capture_is_a_new_image_though_it_looks_the_same() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 3, 600, 408));
    let capture = world.command(CAPTURE);
    world.radiate();
    let (tag, _) = world.last_request();
    world.hear(&info_frame(tag, false, 0, 0, 0));
    assert_eq!((world.images().len(), world.stage(capture)), (1, Stage::Radiated), "still capturing");
    world.pass(5 * S);
    world.hear(&info_frame(tag, true, 3, 600, 408));
    assert_eq!((world.images().len(), world.stage(capture)), (2, Stage::Answered));
    world.hear(&info_frame(0, true, 3, 600, 408));
    assert_eq!(world.images().len(), 2);
}

#[test]
fn a_capture_that_was_refused_or_never_radiated_declares_nothing() {
    for refused_by_radio in [true, false] {
        let mut world = World::in_contact();
        world.hear(&info_frame(0, true, 3, 600, 408));
        let capture = world.command(CAPTURE);
        if refused_by_radio {
            world.tx_failed(MaybeRadiated::No);
            assert!(world.cancel(capture).is_ok());
        } else {
            world.radiate();
            let (tag, _) = world.last_request();
            world.hear(&frame(1, tag, &[34]));
            assert_eq!(world.stage(capture), Stage::Rejected);
        }
        world.hear(&info_frame(0, true, 3, 600, 408));
        assert_eq!(world.images().len(), 1);
    }
}

#[test]
fn a_capture_is_remembered_over_a_restart_until_its_image_was_declared() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 3, 600, 408));
    let capture = world.command(CAPTURE);
    world.radiate();
    world.restart();
    world.hear(&info_frame(0, true, 3, 600, 408));
    assert_eq!(world.images().len(), 2);
    world.pass(400 * S);
    assert_eq!(world.stage(capture), Stage::Unknown);
    world.restart();
    world.hear(&info_frame(0, true, 3, 600, 408));
    assert_eq!(world.images().len(), 2, "declared after the capture, though it became unknown later");
}

#[test]
fn an_image_info_that_does_not_add_up_is_not_used() {
    let mut world = World::in_contact();
    for (chunks, size) in [(3, 700), (0, 1), (u32::MAX, u32::MAX), (0, 0), (70_000, 70_000 * 222)] {
        world.hear(&info_frame(0, true, chunks, size, 408));
    }
    assert!(world.images().is_empty());
    assert_eq!(world.events(mission::record::EventKind::ImageDeclared).len(), 5);
}

#[test]
fn a_file_fills_the_image_and_declares_none() {
    let mut world = World::in_contact();
    world.hear_from_file(&info_frame(0, true, 3, 600, 408));
    assert!(world.images().is_empty());
    world.hear(&info_frame(0, true, 2, 444, 408));
    world.hear_from_file(&info_frame(0, true, 3, 600, 408));
    world.hear_from_file(&chunk_frame(0, 1, 5));
    assert_eq!((world.images().len(), world.images()[0].held), (1, 1));
}

#[test]
fn what_the_reserve_brings_back_does_not_displace_a_newer_image() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 2, 444, 408));
    let route = world.images()[0].route.clone();
    let kept = |bytes: Vec<u8>, at: UtcUs| ReservedFrame {
        route: route.clone(),
        source: Source::Radio,
        received_at: at,
        rssi_dbm: None,
        bytes: bytes.into(),
    };
    let before = world.now.utc.plus(-3_600_000_000);
    world.handle(Input::Recovered(&kept(info_frame(0, true, 9, 9 * 222, 408), before)));
    world.handle(Input::Recovered(&kept(chunk_frame(0, 1, 9), before)));
    assert_eq!((world.images().len(), world.images()[0].held), (1, 0));
    let after = world.now.utc.plus(1_000_000);
    world.handle(Input::Recovered(&kept(chunk_frame(0, 1, 8), after)));
    world.handle(Input::Recovered(&kept(info_frame(0, true, 9, 9 * 222, 408), after)));
    assert_eq!(world.images().len(), 2);
}

#[test]
fn other_bytes_for_a_held_chunk_are_a_conflict_and_overwrite_nothing() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 2, 444, 408));
    world.hear(&chunk_frame(0, 0, 1));
    for fill in 2..5 {
        world.hear(&chunk_frame(0, 0, fill));
    }
    world.hear(&chunk_frame(0, 1, 1));
    let image = world.images()[0].clone();
    assert_eq!((image.held, image.conflicts), (2, 1));
    assert!(image.completed_at.is_some());
    let kept: Vec<(bool, u8)> = world
        .stored
        .iter()
        .filter_map(|r| match r {
            mission::Record::Chunk(c) => Some((c.conflict, c.data[0])),
            _ => None,
        })
        .collect();
    assert_eq!(kept, [(false, 1), (true, 2), (true, 3), (true, 4), (false, 1)]);
    world.hear(&chunk_frame(0, 9, 1));
    assert_eq!(world.images()[0].held, 2, "outside");
}

#[test]
fn versions_of_a_chunk_are_kept_up_to_a_bound_over_restarts() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 2, 444, 408));
    world.hear(&chunk_frame(0, 0, 0));
    let forge = |world: &mut World, from: u16| {
        for n in from..from + 800 {
            let mut payload = vec![0, 0];
            payload.extend([1; 220]);
            payload.extend(n.to_be_bytes());
            world.hear(&frame(3, 0, &payload));
        }
    };
    forge(&mut world, 0);
    world.restart();
    forge(&mut world, 800);
    let kept = world.stored.iter().filter(|r| matches!(r, mission::Record::Chunk(c) if c.conflict)).count();
    assert_eq!(kept, 1_024);
}

#[test]
fn a_download_asks_what_is_missing_and_ends_when_nothing_is() {
    let mut world = World::in_contact();
    let download = world.download();
    assert_eq!(world.last_request().1, Telecommand::GetImageInfo);
    world.radiate();
    answer_info(&mut world, 3);
    world.pass(S / 10);
    assert_eq!(world.last_request().1, Telecommand::GetImageChunk { first: 0, count: 3 });
    world.radiate();
    let (tag, _) = world.last_request();
    world.hear(&chunk_frame(tag, 0, 1));
    world.pass(1_300_000);
    world.hear(&chunk_frame(tag, 2, 1));
    world.pass(S / 10);
    assert_eq!(world.last_request().1, Telecommand::GetImageChunk { first: 1, count: 1 });
    world.radiate();
    world.hear(&chunk_frame(world.last_request().0, 1, 1));
    assert_eq!(world.download_state(download), DownloadState::Complete);
    let sent = world.transmits.len();
    world.pass(30 * S);
    assert_eq!(world.transmits.len(), sent);
}

#[test]
fn held_chunks_are_not_asked_for_after_a_crash_either() {
    let mut world = World::in_contact();
    world.download();
    world.radiate();
    answer_info(&mut world, 40);
    world.pass(S / 10);
    world.radiate();
    let (tag, _) = world.last_request();
    for index in 0..30 {
        world.hear(&chunk_frame(tag, index, 1));
    }
    world.restart();
    world.come_into_contact();
    while world.last_request().0 == tag {
        world.pass(S);
        world.heartbeat();
    }
    assert_eq!(world.last_request().1, Telecommand::GetImageChunk { first: 30, count: 10 });
}

#[test]
fn a_satellite_without_an_image_is_asked_again_with_pauses_and_then_given_up() {
    type Answer = fn(u8) -> Vec<u8>;
    let answers: [Answer; 3] = [
        |tag| info_frame(tag, false, 0, 0, 0),
        |tag| info_frame(tag, true, 7, 7, 7),
        |tag| frame(1, tag, &[34]),
    ];
    for answer in answers {
        let mut world = World::in_contact();
        let download = world.download();
        let begun = world.now.mono;
        for _ in 0..200 {
            if world.station.status(world.now).links[0].on_air {
                world.radiate();
                world.hear(&answer(world.last_request().0));
            }
            world.pass(S);
            if world.now.mono.0 % (30 * S) < S {
                world.heartbeat();
            }
        }
        assert_eq!(world.download_state(download), DownloadState::Failed);
        assert_eq!(world.transmits.len(), 6, "in {} s", world.now.mono.since(begun) / S);
    }
}

#[test]
fn a_replayed_file_moves_no_limit_and_opens_no_contact() {
    let rule = mission::LimitRule {
        parameter: "heartbeat.temp".into(),
        below: vec![],
        above: vec![(mission::Level::Severe, -1.0)],
        deadband: 0.0,
        persistence: 1,
    };
    let setup = crate::world::Setup { limits: vec![rule], ..Default::default() };
    let mut world = World::new(setup);
    world.hear_from_file(&crate::frames::heartbeat_frame(0, 1, 1));
    assert!(world.events(mission::record::EventKind::Limit).is_empty());
    assert!(!world.station.status(world.now).satellites[0].in_contact);
    world.hear(&crate::frames::heartbeat_frame(0, 1, 2));
    assert_eq!(world.events(mission::record::EventKind::Limit).len(), 1);
}

#[test]
fn a_storm_of_image_infos_keeps_memory_flat() {
    let mut world = World::in_contact();
    for n in 1..2_000u32 {
        world.hear(&info_frame(0, true, 65_536, 65_536 * 222 - n % 222, u16::try_from(n).unwrap()));
        world.stored.clear();
        world.seen.clear();
    }
    assert_eq!(world.station.status(world.now).storage.waiting, 0);
}
