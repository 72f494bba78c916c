//! When nothing is sealed, and what unlocks it.

use mission::snapshot::{KeySnapshot, Witness};
use mission::{Effect, Input, Intent, Refusal, Snapshot, Stage, UtcUs};
use protocol::{Counter, Key, Telecommand};

use crate::world::{S, Setup, UTC0, World, counter_of, sequence_profile};

const HOUR: i64 = 3_600_000_000;
const LAST: u64 = 1_790_000_000_000_000;

fn with_key(counter: Option<u64>, witness: Witness) -> World {
    let setup = Setup::default();
    let key = Key::from_bytes(setup.key).id();
    let keys = vec![KeySnapshot { key, counter: counter.map(Counter), witness }];
    World::from_snapshot(setup, Snapshot { keys, ..Snapshot::default() })
}

fn unsynchronised(mut world: World) -> World {
    world.handle(Input::Clock { synchronised: false });
    world
}

#[test]
fn no_counter_and_no_voucher_is_a_refusal_until_somebody_vouches() {
    let mut world = unsynchronised(World::new(Setup::default()));
    world.come_into_contact();
    world.command(Telecommand::Ping);
    world.pass(10 * S);
    assert!(world.transmits.is_empty() && world.locked().is_some());
    world.want(Intent::VouchClock);
    world.pass(10 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn a_database_ahead_of_the_witness_raises_it_without_a_word() {
    let mut world = with_key(Some(LAST + 9), Witness::At(Counter(LAST)));
    assert_eq!((world.locked(), world.witness.clone()), (None, Witness::At(Counter(LAST + 9))));
    world.come_into_contact();
    world.command(Telecommand::Ping);
    assert!(counter_of(world.last_tx()) > LAST + 9);
}

#[test]
fn a_witness_ahead_missing_or_damaged_locks_until_an_operator_confirms() {
    for (counter, witness) in [
        (Some(LAST), Witness::At(Counter(LAST + 500))),
        (None, Witness::At(Counter(LAST))),
        (Some(LAST), Witness::Missing),
        (Some(LAST), Witness::Damaged("torn".into())),
        (None, Witness::Damaged("torn".into())),
        (Some(LAST), Witness::Restored(None)),
        (None, Witness::Restored(Some(Counter(LAST)))),
        (None, Witness::Restored(None)),
    ] {
        let mut world = with_key(counter, witness.clone());
        world.come_into_contact();
        world.command(Telecommand::Ping);
        world.pass(20 * S);
        assert!(world.transmits.is_empty(), "{witness:?}");
        world.seen.clear();
        world.confirms = false;
        world.want(Intent::ConfirmCounter { key: world.key(), above: None });
        assert!(!world.waiting.iter().any(|effect| matches!(effect, Effect::Witness { .. })));
        world.confirm_persists();
        assert!(world.locked().is_some(), "the floor is durable, the witness is not");
        world.confirm();
        assert_eq!(world.locked(), None, "{witness:?}");
        world.confirms = true;
        world.settle();
        world.pass(10 * S);
        assert_eq!(world.transmits.len(), 1);
        assert!(counter_of(world.last_tx()) > LAST + 500 || counter.is_none());
    }
}

#[test]
fn what_was_restored_is_not_unlocked_while_nobody_vouches_for_the_clock() {
    let mut world = unsynchronised(with_key(Some(LAST), Witness::Restored(None)));
    world.come_into_contact();
    world.command(Telecommand::Ping);
    let id = world.want(Intent::ConfirmCounter { key: world.key(), above: None });
    assert!(matches!(world.reply(id), Some(Err(Refusal::ClockNotVouched(_)))));
    world.pass(10 * S);
    assert!(world.transmits.is_empty() && world.locked().is_some());
    world.want(Intent::VouchClock);
    world.want(Intent::ConfirmCounter { key: world.key(), above: None });
    world.pass(10 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn a_restored_sequence_is_unlocked_by_a_number_only() {
    let setup = Setup { profile: sequence_profile(), ..Setup::default() };
    let key = Key::from_bytes(setup.key).id();
    let keys = vec![KeySnapshot { key, counter: Some(Counter(7)), witness: Witness::Restored(None) }];
    let mut world = World::from_snapshot(setup, Snapshot { keys, ..Snapshot::default() });
    world.come_into_contact();
    world.command(Telecommand::Ping);
    let id = world.want(Intent::ConfirmCounter { key, above: None });
    let Some(Err(refusal)) = world.reply(id) else { panic!("it was taken") };
    assert_eq!(*refusal, Refusal::FloorNeeded { key, known: Counter(7) });
    let says = refusal.to_string();
    assert!(
        says.contains("--above") && says.contains("satellite") && says.contains("it knows of 7"),
        "{says}"
    );
    let id = world.want(Intent::ConfirmCounter { key, above: Some(Counter(6)) });
    assert!(matches!(world.reply(id), Some(Err(Refusal::FloorOutOfRange { .. }))));
    world.pass(10 * S);
    assert!(world.transmits.is_empty() && world.locked().is_some());
    world.want(Intent::ConfirmCounter { key, above: Some(Counter(500)) });
    world.pass(10 * S);
    assert_eq!(counter_of(world.last_tx()), 501);
}

#[test]
fn a_confirmed_floor_of_nothing_is_no_counter_while_nobody_vouches() {
    let mut world = unsynchronised(with_key(None, Witness::Damaged("torn".into())));
    world.come_into_contact();
    world.command(Telecommand::Ping);
    world.want(Intent::ConfirmCounter { key: world.key(), above: None });
    world.pass(20 * S);
    assert!(world.transmits.is_empty(), "{:?}", world.locked());
    world.handle(Input::Clock { synchronised: true });
    world.pass(S);
    assert!(counter_of(world.last_tx()) >= u64::try_from(UTC0).unwrap());
}

#[test]
fn confirming_a_counter_that_is_not_locked_is_refused() {
    let mut world = World::in_contact();
    let id = world.want(Intent::ConfirmCounter { key: world.key(), above: None });
    assert!(matches!(world.reply(id), Some(Err(Refusal::NotLocked(_)))));
}

#[test]
fn a_witness_that_cannot_be_raised_stops_everything_until_it_can() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(Intent::Command(intent));
    world.confirm_persists();
    for _ in 0..3 {
        world.refuse();
        world.confirm_persists();
        assert!(world.transmits.is_empty());
        while !world.waiting.iter().any(|effect| matches!(effect, Effect::Witness { .. })) {
            world.pass(S);
            world.confirm_persists();
        }
    }
    world.confirms = true;
    world.settle();
    world.pass(S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn a_witness_that_fails_after_the_command_was_withdrawn_is_raised_all_the_same() {
    let mut world = World::in_contact();
    world.confirms = false;
    let intent = world.intent_of(Telecommand::Ping);
    world.want(Intent::Command(intent));
    world.confirm_persists();
    world.want(Intent::Cancel(mission::CommandId(1)));
    world.refuse();
    world.confirms = true;
    world.settle();
    assert!(world.locked().is_some());
    world.pass(5 * S);
    assert_eq!(world.locked(), None);
    let ping = world.command(Telecommand::Ping);
    world.pass(S);
    assert_eq!(world.stage(ping), Stage::Radiating);
}

#[test]
fn a_clock_48_hours_past_the_last_counter_needs_somebody_who_vouches() {
    for (ahead, vouched, leaps) in
        [(47 * HOUR, false, true), (49 * HOUR, false, false), (49 * HOUR, true, true)]
    {
        let last = u64::try_from(UTC0 - ahead).unwrap();
        let mut world = with_key(Some(last), Witness::At(Counter(last)));
        world.handle(Input::Clock { synchronised: vouched });
        world.come_into_contact();
        world.command(Telecommand::Ping);
        let counter = counter_of(world.last_tx());
        assert_eq!(counter > last + 1, leaps, "{ahead} {vouched}");
        let told = world.events(mission::record::EventKind::Sealing).iter().any(|m| m.contains("48 h"));
        assert_eq!(told, !leaps);
    }
}

#[test]
fn a_clock_that_goes_back_ten_years_never_takes_a_counter_twice() {
    let mut world = World::in_contact();
    world.command(Telecommand::Ping);
    world.radiate();
    let first = counter_of(world.last_tx());
    world.step_utc(-10 * 365 * 24 * HOUR);
    world.pass(20 * S);
    assert_eq!(world.transmits.len(), 2, "{}", world.note());
    assert_eq!(counter_of(world.last_tx()), first + 1);
}

#[test]
fn a_sequence_counts_by_one() {
    let setup = Setup { profile: sequence_profile(), ..Setup::default() };
    let mut world = World::in_contact_with(setup);
    for n in 1..4 {
        world.command(Telecommand::Ping);
        assert_eq!(counter_of(world.last_tx()), n);
        world.radiate();
        world.hear(&crate::frames::frame(0, world.last_request().0, &[]));
        world.pass(S / 10);
    }
}

#[test]
fn a_key_whose_counter_is_used_up_seals_nothing() {
    for last in [i64::MAX as u64, u64::MAX] {
        let mut world = with_key(Some(last), Witness::At(Counter(last)));
        world.come_into_contact();
        world.command(Telecommand::Ping);
        world.pass(10 * S);
        assert!(world.transmits.is_empty() && world.locked().is_some());
    }
}

#[test]
fn a_clock_before_1970_is_no_panic() {
    let mut world = World::in_contact();
    world.now.utc = UtcUs(i64::MIN);
    world.command(Telecommand::Ping);
    world.heartbeat();
    world.pass(100 * S);
    world.now.utc = UtcUs(i64::MAX);
    world.heartbeat();
    world.pass(100 * S);
}
