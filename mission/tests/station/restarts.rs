//! A new life begins from what is stored, and from nothing else.

use mission::snapshot::Witness;
use mission::{Effect, Intent, MaybeRadiated, Stage};
use protocol::{Counter, Telecommand};

use crate::frames::frame;
use crate::world::{S, Setup, World, counter_of};

/// A station that dies after so many confirmations of what a Reset or Ping needs.
fn dies_after(steps: usize, telecommand: Telecommand) -> World {
    let mut world = World::after_an_exchange();
    world.confirms = false;
    let intent = world.intent_of(telecommand);
    world.want(Intent::Command(intent));
    for _ in 0..steps {
        if !world.waiting.is_empty() {
            world.confirm();
        }
    }
    world.restart();
    world
}

#[test]
fn what_was_sealed_goes_on_with_the_same_bytes() {
    let mut world = World::after_an_exchange();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Reset);
    world.want(Intent::Command(intent));
    while !matches!(world.waiting.front(), Some(Effect::Witness { .. })) {
        world.confirm();
    }
    let sealed = world.snapshot().satellites[0].commands[0].sealed.clone().unwrap();
    world.restart();
    world.come_into_contact();
    assert_eq!(world.transmits.len(), 1);
    assert_eq!(world.last_tx().frame, sealed.bytes);
    assert_eq!(world.witness, Witness::At(sealed.counter), "raised silently, before anything was radiated");
    assert_eq!(world.locked(), None);
}

#[test]
fn what_was_marked_is_unknown_and_never_radiated_again_unless_idempotent() {
    for (telecommand, again) in [(Telecommand::Reset, false), (Telecommand::Ping, true)] {
        let mut world = World::after_an_exchange();
        world.confirms = false;
        let intent = world.intent_of(telecommand);
        world.want(Intent::Command(intent));
        while world.transmits.is_empty() {
            world.confirm();
        }
        world.transmits.clear();
        world.restart();
        assert!(world.stages(mission::CommandId(2)).contains(&Stage::Unknown));
        world.come_into_contact();
        for _ in 0..4 {
            world.pass(50 * S);
            world.heartbeat();
        }
        assert_eq!(!world.transmits.is_empty(), again);
    }
}

#[test]
fn every_moment_of_death_leaves_at_most_one_reset_on_the_air() {
    let mut on_air = Vec::new();
    for steps in 0..4 {
        let mut world = dies_after(steps, Telecommand::Reset);
        world.come_into_contact();
        world.pass(5 * S);
        assert_eq!(world.locked(), None);
        on_air.push(world.transmits.len());
    }
    // Not stored; sealed, without and with its witness: goes on; handed over: it was on the air before.
    assert_eq!(on_air, [0, 1, 1, 1]);
}

#[test]
fn what_was_radiated_still_awaits_its_answer() {
    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    world.radiate();
    let (tag, _) = world.last_request();
    world.restart();
    assert_eq!(world.stage(ping), Stage::Radiated);
    world.hear(&frame(0, tag, &[]));
    assert_eq!(world.stage(ping), Stage::Answered);
}

#[test]
fn after_a_restart_the_answer_that_may_be_coming_is_not_talked_over() {
    let mut world = World::in_contact();
    world.command(Telecommand::Ping);
    world.radiate();
    world.restart();
    world.command(Telecommand::GetAdcsInfo);
    let before = world.transmits.len();
    world.link_state(mission::LinkState::Ok);
    world.heartbeat();
    world.pass(3 * S);
    assert_eq!(world.transmits.len(), before, "{}", world.note());
    world.pass(30 * S);
    assert!(world.transmits.len() > before);
}

#[test]
fn a_refused_reset_waits_over_a_restart_and_can_be_cancelled_then() {
    let mut world = World::in_contact();
    let reset = world.command(Telecommand::Reset);
    world.tx_failed(MaybeRadiated::No);
    world.restart();
    assert!(world.cancel(reset).is_ok());
    assert_eq!(world.stage(reset), Stage::Cancelled);
    world.come_into_contact();
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn a_request_of_the_machine_that_waited_is_worked_out_anew() {
    let mut world = World::in_contact();
    world.download();
    world.tx_failed(MaybeRadiated::No);
    let request = mission::CommandId(1);
    assert_eq!(world.stage(request), Stage::Cancelled);
    world.restart();
    world.come_into_contact();
    assert_eq!((world.transmits.len(), world.last_tx().command), (2, mission::CommandId(2)));
}

#[test]
fn bytes_sealed_with_another_key_are_not_radiated() {
    let mut world = World::after_an_exchange();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(Intent::Command(intent));
    while !matches!(world.waiting.front(), Some(Effect::Witness { .. })) {
        world.confirm();
    }
    let snapshot = world.snapshot();
    let old = snapshot.satellites[0].commands[0].sealed.clone().unwrap();
    world.setup = Setup { key: [9; 16], ..world.setup.clone() };
    world.witness = Witness::Missing;
    world.restart_from(snapshot);
    world.come_into_contact();
    world.pass(5 * S);
    assert_eq!(world.transmits.len(), 1);
    assert_ne!(world.last_tx().frame, old.bytes);
    assert_eq!(world.last_request().1, Telecommand::Ping, "opened with the new key");
}

#[test]
fn a_database_that_went_back_repeats_nothing_that_must_not_be() {
    let mut world = World::in_contact();
    let backup = {
        world.link_state(mission::LinkState::Disabled);
        world.command(Telecommand::Reset);
        world.command(Telecommand::Ping);
        world.snapshot()
    };
    world.link_state(mission::LinkState::Ok);
    world.pass(S);
    world.radiate();
    let newest = counter_of(world.last_tx());
    world.transmits.clear();
    world.stored.clear();
    let witness = world.witness.clone();
    world.restart_from(mission::Snapshot {
        keys: vec![mission::snapshot::KeySnapshot { key: world.key(), counter: None, witness }],
        ..backup
    });
    assert!(world.locked().is_some());
    assert_eq!(
        world.stage(mission::CommandId(1)),
        Stage::Unknown,
        "it may have been radiated in the lost time"
    );
    world.want(Intent::ConfirmCounter { key: world.key(), above: None });
    assert_eq!(world.locked(), None);
    world.come_into_contact();
    assert_eq!(world.last_request().1, Telecommand::Ping);
    assert!(counter_of(world.last_tx()) > newest);
    world.radiate();
    world.pass(60 * S);
    assert!(world.transmits.iter().all(|tx| tx.command != mission::CommandId(1)));
}

#[test]
fn sealed_bytes_below_a_confirmed_floor_are_sealed_anew() {
    let mut world = World::after_an_exchange();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(Intent::Command(intent));
    while !matches!(world.waiting.front(), Some(Effect::Witness { .. })) {
        world.confirm();
    }
    let sealed = world.snapshot().satellites[0].commands[0].sealed.clone().unwrap();
    let ahead = Counter(sealed.counter.0 + 1_000_000_000);
    world.witness = Witness::At(ahead);
    world.restart();
    world.want(Intent::ConfirmCounter { key: world.key(), above: None });
    world.come_into_contact();
    world.pass(5 * S);
    assert_eq!(world.transmits.len(), 1);
    assert!(counter_of(world.last_tx()) > ahead.0, "no older frame after a newer one");
}
