//! The clock on the wall steps; what waits does not care.

use mission::Stage;
use protocol::Telecommand;

use crate::frames::frame;
use crate::world::{S, World};

const YEAR: i64 = 365 * 24 * 3_600_000_000;

#[test]
fn steps_of_ten_years_hold_up_no_exchange() {
    for step in [-10 * YEAR, 10 * YEAR] {
        let mut world = World::in_contact();
        let ping = world.command(Telecommand::Ping);
        world.radiate();
        world.step_utc(step);
        let (tag, _) = world.last_request();
        world.hear(&frame(0, tag, &[]));
        assert_eq!(world.stage(ping), Stage::Answered);
        let next = world.command(Telecommand::GetAdcsInfo);
        world.pass(S);
        assert_eq!(world.stage(next), Stage::Radiating, "{step}: {}", world.note());
    }
}

#[test]
fn a_step_of_the_clock_tells_no_lie_about_a_reset() {
    // Obeyed: up for 25 s, 27 s after the radiation. The wall clock would say anything.
    for step in [-10 * YEAR, -20_000_000, 20_000_000, 3_600_000_000, 10 * YEAR] {
        let mut world = World::in_contact();
        let reset = world.command(Telecommand::Reset);
        world.radiate();
        world.step_utc(step);
        world.pass(27 * S);
        world.heartbeat_with_uptime(25_000);
        assert_ne!(world.stage(reset), Stage::Failed, "{step}");
    }
}

#[test]
fn a_second_reset_waits_a_minute_and_not_ten_years() {
    for step in [-10 * YEAR, 0, 10 * YEAR] {
        let mut world = World::in_contact();
        world.command(Telecommand::Reset);
        let second = world.command(Telecommand::Reset);
        world.radiate();
        world.step_utc(step);
        world.pass(20 * S);
        assert_eq!(world.stage(second), Stage::Queued);
        world.pass(34 * S);
        world.heartbeat_with_uptime(40_000);
        world.pass(20 * S);
        assert_eq!(world.stage(second), Stage::Radiating, "{step}: {}", world.note());
    }
}

#[test]
fn after_a_restart_with_a_clock_that_went_back_nothing_waits_for_years() {
    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    world.radiate();
    world.step_utc(-10 * YEAR);
    world.restart();
    world.pass(60 * S);
    assert_ne!(world.stage(ping), Stage::Radiated);
    world.come_into_contact();
    world.pass(5 * S);
    assert_eq!(world.transmits.len(), 2, "{}", world.note());
}

#[test]
fn unknown_outcomes_do_not_pile_up_when_the_clock_goes_back() {
    let mut world = World::in_contact();
    let image = crate::frames::info_frame(0, true, 2_000, 2_000 * 222, 408);
    world.hear(&image);
    world.download();
    for turn in 0..600 {
        world.heartbeat();
        world.pass(7 * S);
        if world.station.status(world.now).links[0].on_air {
            world.radiate();
            if world.last_request().1 == Telecommand::GetImageInfo {
                let (tag, _) = world.last_request();
                world.hear(&crate::frames::info_frame(tag, true, 2_000, 2_000 * 222, 408));
            }
        }
        world.step_utc(if turn % 2 == 0 { -9 * S as i64 } else { 0 });
    }
    // A cancel of a command that is forgotten is told apart from one that is known.
    let known = (1..600).filter(|id| {
        !matches!(world.cancel(mission::CommandId(*id)), Err(mission::Refusal::UnknownCommand(_)))
    });
    assert!(known.count() < 300);
}
