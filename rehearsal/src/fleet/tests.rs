//! The checks can fail: each is shown a fleet in which something is wrong.

use std::sync::Arc;

use super::scene::{DAY_US, HOUR_US, ZERO, issued, utc_at};
use super::*;
use crate::checks::Invariant;

/// A calm fleet, tampered with at the end of its first day.
fn tampered(with: impl Fn(&mut Fleet)) -> Option<Invariant> {
    let mut fleet = Fleet::new(3, 3, true);
    while fleet.now_us < DAY_US {
        fleet.step().unwrap();
    }
    with(&mut fleet);
    fleet.run().err().map(|violation| violation.invariant)
}

#[test]
fn untouched_fleet_holds() {
    assert_eq!(tampered(|_| ()), None);
}

#[test]
fn what_is_radiated_in_a_blackout_or_outside_the_licence_is_seen() {
    let closed = |fleet: &mut Fleet| {
        let always = mission::schedule::Window { start: utc_at(0), stop: utc_at(30 * DAY_US) };
        fleet
            .grounds
            .iter_mut()
            .for_each(|ground| ground.times.blackouts.push((always, "never open".to_owned())));
    };
    assert_eq!(tampered(closed), Some(Invariant::InWindow));
    let unlicensed = |fleet: &mut Fleet| {
        fleet.grounds.iter_mut().for_each(|ground| ground.times.licence = Some(Vec::new()))
    };
    assert_eq!(tampered(unlicensed), Some(Invariant::InWindow));
}

#[test]
fn what_is_radiated_below_the_horizon_or_unarmed_is_seen() {
    let elsewhere = |fleet: &mut Fleet| {
        for s in 0..super::scene::SATELLITES {
            let half_a_turn = issued(&fleet.orbits[s], ZERO.plus_seconds(86_401.0), 2_800.0);
            for ground in &mut fleet.grounds {
                ground.sets[s] = vec![Arc::new(half_a_turn.clone())];
            }
        }
    };
    assert_eq!(tampered(elsewhere), Some(Invariant::InWindow));
    let unarmed = |fleet: &mut Fleet| {
        fleet.grounds.iter_mut().flat_map(|ground| &mut ground.radios).for_each(|radio| radio.armed = false);
    };
    assert_eq!(tampered(unarmed), Some(Invariant::InWindow));
}

#[test]
fn station_that_forgets_its_plans_is_seen() {
    let forgetful = |fleet: &mut Fleet| {
        let ground = &mut fleet.grounds[1];
        let keys = [None, None, ground.keys[2].as_ref().map(protocol::Key::id)];
        let names = (0..3).map(super::scene::satellite_name).zip(keys);
        ground.stores = super::store::Stores::new(names);
        fleet.kill(1, 1_000_000);
        fleet.grounds[1].down_since = fleet.now_us - HOUR_US / 60;
    };
    assert!(tampered(forgetful).is_some());
}
