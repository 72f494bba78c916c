//! A station that does not work gets no passes, says why, and gets them back; and a new life keeps what was promised.

use mission::config::Times;
use mission::plan::{MinPass, Plan};
use mission::record::EventKind;
use mission::run::RunState;
use mission::{Input, Intent, LinkId, LinkState, SatelliteId};
use protocol::Telecommand;

use crate::plans::{arm, hand_over, live, plan, runs, send, want, world};
use crate::sky::{add, elements, site};
use crate::world::{S, Setup, UTC0, World};

/// What the schedule serves, and what it says of the rest.
fn schedule(world: &World) -> (usize, Vec<String>) {
    let schedule = world.station.status(world.now).schedule;
    (schedule.contacts.len(), schedule.refused.iter().map(ToString::to_string).collect())
}

fn planned(world: &World) -> usize {
    runs(world).iter().filter(|run| run.state == RunState::Planned).count()
}

#[test]
fn radio_that_is_away_for_minutes_costs_its_passes_until_it_is_back() {
    let (mut world, passes) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    let (all, refused) = schedule(&world);
    assert!(all > 3 && refused.is_empty() && planned(&world) == all, "{all} {refused:?}");

    world.link_state(LinkState::Unavailable { reason: "no such port".to_owned() });
    world.pass(290 * S);
    assert_eq!(schedule(&world), (all, Vec::new()), "a cable that is plugged anew costs nothing");
    world.pass(20 * S);
    let (served, refused) = schedule(&world);
    assert_eq!((served, refused.len(), planned(&world)), (0, all, 0));
    assert!(refused.iter().all(|why| why.contains("link radio is unavailable: no such port")), "{refused:?}");
    let told = world.events(EventKind::Plan);
    assert!(
        told.iter().any(|text| text.contains("does not get the pass") && text.contains("no such port")),
        "{told:?}"
    );

    world.link_state(LinkState::Ok);
    world.pass(S);
    assert_eq!((schedule(&world).0, planned(&world)), (all, all));
    live(&mut world, passes[0].los_at.unwrap().plus(S as i64));
    assert!(runs(&world).iter().any(|run| run.state == RunState::Ended), "{:?}", runs(&world));
}

#[test]
fn rotator_that_is_dead_for_minutes_makes_the_station_unfit_until_it_turns() {
    let (mut world, _) = world();
    hand_over(&mut world, plan("status", vec![send(Telecommand::Ping)])).unwrap();
    arm(&mut world, "status", true);
    let all = schedule(&world).0;
    world.handle(Input::Antenna { fault: Some("it refuses to move") });
    world.pass(200 * S);
    // It turned for a moment: the time begins anew.
    world.handle(Input::Antenna { fault: None });
    world.handle(Input::Antenna { fault: Some("nobody answers") });
    world.pass(290 * S);
    assert_eq!(schedule(&world), (all, Vec::new()));
    world.pass(20 * S);
    let (served, refused) = schedule(&world);
    assert_eq!((served, refused.len(), planned(&world)), (0, all, 0));
    assert!(refused[0].contains("home is not used: the rotator: nobody answers"), "{refused:?}");
    world.handle(Input::Antenna { fault: None });
    world.pass(S);
    assert_eq!((schedule(&world).0, planned(&world)), (all, all));
}

/// Two satellites that pass together, and one antenna.
fn twins() -> World {
    let mut world = World::new(Setup {
        site: Some(site()),
        times: Times::default(),
        second_satellite: true,
        ..Setup::default()
    });
    world.link_state(LinkState::Ok);
    let second = LinkId::new("radio-2").unwrap();
    world.handle(Input::Link { link: &second, state: LinkState::Ok });
    add(&mut world, vec![elements(UTC0, 0.0)]).unwrap();
    let (satellite, other) = (SatelliteId::new("pixelsat-2").unwrap(), elements(UTC0, -1.0));
    want(&mut world, Intent::AddElements { satellite, elements: vec![other], source: "a test".to_owned() })
        .unwrap();
    world
}

#[test]
fn what_was_promised_stays_promised_in_the_next_life() {
    let mut world = twins();
    // So long that one pass cannot serve both.
    let whole = MinPass { max_elevation_deg: 0.0, duration_us: 400_000_000 };
    hand_over(&mut world, Plan { min_pass: whole, ..plan("first", vec![send(Telecommand::Ping)]) }).unwrap();
    arm(&mut world, "first", true);
    // A little better, and not by the tenth that a promise gives way to.
    let mut rival = plan("second", vec![send(Telecommand::Ping)]);
    rival.satellite = SatelliteId::new("pixelsat-2").unwrap();
    rival.worth = 1.05;
    rival.min_pass = whole;
    hand_over(&mut world, rival).unwrap();
    arm(&mut world, "second", true);
    let times = |world: &World| -> Vec<(String, i64, i64)> {
        let schedule = world.station.status(world.now).schedule;
        schedule.contacts.iter().map(|c| (c.satellite.to_string(), c.start.0, c.stop.0)).collect()
    };
    let before = times(&world);
    assert!(before.iter().filter(|(name, ..)| name == "pixelsat-1").count() > 3, "{before:?}");
    let ids: Vec<_> = runs(&world).iter().map(|run| (run.id, run.state.clone())).collect();
    world.restart();
    world.link_state(LinkState::Ok);
    let second = LinkId::new("radio-2").unwrap();
    world.handle(Input::Link { link: &second, state: LinkState::Ok });
    world.pass(S);
    assert_eq!(times(&world), before);
    assert_eq!(
        runs(&world).iter().map(|run| (run.id, run.state.clone())).collect::<Vec<_>>(),
        ids,
        "no run was moved"
    );
    // Without the promise the other would have it: the test can fail.
    let mut fresh = twins();
    for (name, satellite, worth) in [("second", "pixelsat-2", 1.05), ("first", "pixelsat-1", 1.0)] {
        let mut other = plan(name, vec![send(Telecommand::Ping)]);
        other.satellite = SatelliteId::new(satellite).unwrap();
        other.worth = worth;
        other.min_pass = whole;
        hand_over(&mut fresh, other).unwrap();
        arm(&mut fresh, name, true);
    }
    assert_ne!(times(&fresh), before);
}
