//! Commit, witness, mark, transmit: in this order and in no other.

use mission::{Effect, Input, LinkState, Stage};
use protocol::Telecommand;

use crate::frames::frame;
use crate::world::{S, Seen, World};

#[test]
fn commit_then_witness_then_the_mark_then_the_radio() {
    let mut world = World::in_contact();
    world.seen.clear();
    world.command(Telecommand::Ping);
    let position = |what: &dyn Fn(&Seen) -> bool| world.seen.iter().position(what).expect("it happened");
    let holds = |seen: &Seen, word: &str| matches!(seen, Seen::Stored(rows) if rows.iter().any(|r| r.starts_with(word)));
    let sealed = position(&|seen| holds(seen, "sealed bytes"));
    let witness = position(&|seen| matches!(seen, Seen::Witness(_)));
    let marked = position(&|seen| holds(seen, "radiating"));
    let handed = position(&|seen| matches!(seen, Seen::Transmit(_)));
    assert!(sealed < witness && witness < marked && marked < handed, "{:?}", world.seen);
    assert_eq!(world.seen[witness], Seen::Witness(crate::world::counter_of(world.last_tx())));
}

#[test]
fn nothing_goes_on_while_a_step_is_unconfirmed() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(mission::Intent::Command(intent));
    world.pass(20 * S);
    // The order was stored and sealed in one batch or two; no witness before they are confirmed.
    assert!(world.waiting.iter().all(|effect| matches!(effect, Effect::Persist(_))), "{:?}", world.waiting);
    world.confirm_persists();
    assert!(matches!(world.waiting.front(), Some(Effect::Witness { .. })), "{:?}", world.waiting);
    world.pass(3 * S);
    assert_eq!(world.waiting.len(), 1, "asked once");
    world.confirm();
    assert!(matches!(world.waiting.front(), Some(Effect::Persist(_))), "the mark");
    assert!(world.transmits.is_empty());
    world.confirm_persists();
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn a_reply_waits_for_what_it_tells() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    let id = world.want(mission::Intent::Command(intent));
    assert_eq!(world.reply(id), None);
    world.unknown_batch();
    assert_eq!(world.reply(id), None, "a batch that nobody sent confirms nothing");
    world.confirm();
    assert!(world.reply(id).is_some());
}

#[test]
fn a_second_command_waits_until_the_first_is_answered() {
    let mut world = World::in_contact();
    let first = world.command(Telecommand::Ping);
    let second = world.command(Telecommand::GetAdcsInfo);
    world.radiate();
    world.pass(S / 2);
    assert_eq!(world.transmits.len(), 1);
    let (tag, _) = world.last_request();
    world.hear(&frame(0, tag, &[]));
    assert_eq!(world.stage(first), Stage::Answered);
    world.pass(S / 2);
    assert_eq!((world.transmits.len(), world.stage(second)), (2, Stage::Radiating));
}

#[test]
fn two_radios_of_one_station_never_send_together() {
    let setup = crate::world::Setup { second_satellite: true, ..Default::default() };
    let mut world = World::in_contact_with(setup);
    let (link, satellite) = ("radio-2".parse().unwrap(), "pixelsat-2".parse().unwrap());
    world.handle(Input::Link { link: &link, state: LinkState::Ok });
    world.pass(6 * S);
    world.command(Telecommand::Ping);
    let other = mission::CommandIntent {
        satellite,
        gate: mission::Gate::Blind,
        ..world.intent_of(Telecommand::Ping)
    };
    world.command_with(other);
    world.pass(S);
    assert_eq!(world.transmits.len(), 1, "the other one waits");
    world.radiate();
    world.pass(S);
    assert_eq!(world.transmits.len(), 1, "a station that sends to one does not hear the other's answer");
    world.hear(&frame(0, 1, &[]));
    world.pass(S);
    assert_eq!(world.transmits.len(), 2);
    let counters: Vec<u64> = world.transmits.iter().map(crate::world::counter_of).collect();
    assert!(counters[0] < counters[1], "one key, one counter: {counters:?}");
}

#[test]
fn confirmations_of_things_that_nobody_asked_for_change_nothing() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(mission::Intent::Command(intent));
    let key = world.key();
    world.handle(Input::TxDone { tx: mission::TxId(1), airtime_us: u64::MAX, measured: true });
    world.handle(Input::TxFailed {
        tx: mission::TxId(9),
        radiated: mission::MaybeRadiated::Maybe,
        reason: "",
    });
    world.handle(Input::WitnessDone { key, counter: protocol::Counter(5) });
    world.handle(Input::PersistFailed { batch: mission::BatchId(77), reason: "", again_us: 1_000_000 });
    world.unknown_batch();
    assert!(world.transmits.is_empty());
    assert!(world.station.status(world.now).storage.failing.is_none());
}
