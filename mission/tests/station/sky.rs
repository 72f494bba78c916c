//! Elements and passes: what the orbit says of the presence of a satellite, and what follows from it.

use mission::record::{EventKind, PassRecord};
use mission::sky::{ElementsAge, passes_of};
use mission::{
    ElementSet, ElementsId, Gate, Intent, Level, LinkState, PassAhead, Record, Refusal, Site, Stage, UtcUs,
};
use protocol::Telecommand;
use tle::{EarthOrientation, Elements, UtcInstant};

use crate::world::{S, Setup, UTC0, World};

const DAY: u64 = 86_400 * S;

/// A CubeSat at about 510 km, sun-synchronous; `shift_deg` moves it along its orbit.
pub(crate) fn elements(epoch_us: i64, shift_deg: f64) -> Elements {
    Elements {
        name: Some("PIXELSAT".to_owned()),
        object_id: None,
        norad_cat_id: Some(270_001),
        epoch: UtcInstant::from_unix_us(epoch_us),
        mean_motion_rev_day: 15.18,
        eccentricity: 0.001,
        inclination_deg: 97.4,
        raan_deg: 40.0,
        arg_of_perigee_deg: 90.0,
        mean_anomaly_deg: (10.0 + shift_deg).rem_euclid(360.0),
        bstar: 1e-4,
        mean_motion_dot: 5e-5,
        mean_motion_ddot: 0.0,
        ephemeris_type: Some(0),
        classification: Some('U'),
        element_set_no: None,
        rev_at_epoch: None,
        further: Vec::new(),
    }
}

pub(crate) fn site() -> Site {
    Site {
        place: tle::Station::new(48.2, 16.4, 200.0).unwrap(),
        min_elevation_deg: 0.0,
        orientation: EarthOrientation::UT1_IS_UTC,
    }
}

fn world() -> World {
    World::new(Setup { site: Some(site()), ..Setup::default() })
}

pub(crate) fn add(world: &mut World, sets: Vec<Elements>) -> Result<mission::Accepted, Refusal> {
    let satellite = world.satellite.clone();
    let id = world.want(Intent::AddElements { satellite, elements: sets, source: "a test".to_owned() });
    world.reply(id).unwrap().clone()
}

pub(crate) fn expected(set: &Elements, id: u64, days: i64) -> Vec<PassAhead> {
    let set = ElementSet { id: ElementsId(id), elements: std::sync::Arc::new(set.clone()) };
    passes_of(&set, &site(), UtcUs(UTC0), UtcUs(UTC0 + days * 86_400_000_000)).unwrap()
}

/// The passes as they are stored, the newest state of each.
fn stored(world: &World) -> Vec<PassRecord> {
    let mut passes: Vec<PassRecord> = Vec::new();
    for record in &world.stored {
        if let Record::Pass(pass) = record {
            passes.retain(|found| found.id != pass.id);
            passes.push(pass.clone());
        }
    }
    passes
}

fn in_view(world: &World) -> Option<bool> {
    world.station.status(world.now).satellites[0].in_view
}

fn expectation(world: &World) -> String {
    world.station.status(world.now).satellites[0].expectation.clone()
}

#[test]
fn passes_of_a_week_begin_and_end_when_the_orbit_says() {
    let mut world = world();
    assert_eq!(in_view(&world), None);
    assert!(expectation(&world).contains("add elements"));
    let set = elements(UTC0, 0.0);
    add(&mut world, vec![set.clone()]).unwrap();
    assert!(expectation(&world).starts_with("no contact expected until "), "{}", expectation(&world));
    world.pass(7 * DAY);
    let expected = expected(&set, 1, 7);
    let stored = stored(&world);
    assert!(expected.len() > 30, "{}", expected.len());
    assert_eq!(stored.len(), expected.len());
    for (pass, ahead) in stored.iter().zip(&expected) {
        assert!(pass.aos_at.0.abs_diff(ahead.aos_at.0) < 1_000, "{pass:?} {ahead:?}");
        assert!(pass.los_at.unwrap().0.abs_diff(ahead.los_at.unwrap().0) < 1_000);
        let late = pass.ended_at.unwrap().0 - pass.los_at.unwrap().0;
        assert!((0..2_000).contains(&late), "ended {late} us after LOS");
        assert_eq!(pass.elements.iter().map(|(id, _)| id.0).collect::<Vec<_>>(), [1]);
        let begun = pass.elements[0].1.0 - pass.aos_at.0;
        assert!((0..2_000).contains(&begun), "begun {begun} us after AOS");
    }
}

#[test]
fn nothing_is_radiated_outside_a_pass_even_blind() {
    let mut world = world();
    world.link_state(LinkState::Ok);
    let set = elements(UTC0, 0.0);
    add(&mut world, vec![set.clone()]).unwrap();
    let first = expected(&set, 1, 1)[0];
    let to_aos = u64::try_from(first.aos_at.0 - world.now.utc.0).unwrap();
    let intent = mission::CommandIntent { gate: Gate::Blind, ..world.intent_of(Telecommand::Ping) };
    let command = world.command_with(intent);
    world.pass(to_aos - S);
    assert!(world.transmits.is_empty());
    assert!(world.note().starts_with("below the horizon until "), "{}", world.note());
    world.pass(3 * S);
    assert_eq!((world.transmits.len(), world.stage(command)), (1, Stage::Radiating));
}

#[test]
fn new_elements_move_the_pass_that_lasts() {
    let mut world = world();
    let old = elements(UTC0, 0.0);
    add(&mut world, vec![old.clone()]).unwrap();
    let first = expected(&old, 1, 1)[0];
    world.pass(u64::try_from(first.aos_at.0 - UTC0).unwrap() + 100 * S);
    assert_eq!(in_view(&world), Some(true));
    // A quarter of a degree on: four seconds earlier.
    let newer = elements(UTC0 + 1, 0.25);
    add(&mut world, vec![newer.clone()]).unwrap();
    let moved = expected(&newer, 2, 1)[0];
    let status = world.station.status(world.now);
    assert_eq!(status.satellites[0].los_at, moved.los_at);
    assert!(moved.los_at.unwrap().0 < first.los_at.unwrap().0 - 1_000_000);
    let passes = stored(&world);
    assert_eq!(passes.len(), 1, "one pass, told anew");
    assert_eq!(passes[0].elements.iter().map(|(id, _)| id.0).collect::<Vec<_>>(), [1, 2]);
    world.pass(DAY / 48);
    assert!(stored(&world)[0].ended_at.is_some());
}

#[test]
fn pass_goes_on_after_a_restart_and_elements_are_still_there() {
    let mut world = world();
    let set = elements(UTC0, 0.0);
    add(&mut world, vec![set.clone()]).unwrap();
    let first = expected(&set, 1, 1)[0];
    world.pass(u64::try_from(first.aos_at.0 - UTC0).unwrap() + 100 * S);
    world.restart();
    assert_eq!(in_view(&world), Some(true));
    world.pass(DAY / 48);
    let passes = stored(&world);
    assert_eq!(passes.len(), 1);
    assert!(passes[0].ended_at.is_some());
    // The same set again is no new set.
    add(&mut world, vec![set]).unwrap();
    assert_eq!(world.stored.iter().filter(|record| matches!(record, Record::Elements(_))).count(), 1);
}

#[test]
fn pass_that_ended_while_the_station_was_down_is_ended_at_the_start() {
    let mut world = world();
    let set = elements(UTC0, 0.0);
    add(&mut world, vec![set.clone()]).unwrap();
    let first = expected(&set, 1, 1)[0];
    world.pass(u64::try_from(first.aos_at.0 - UTC0).unwrap() + 100 * S);
    let snapshot = world.snapshot();
    world.step_utc(3_000_000_000);
    world.restart_from(snapshot);
    assert_eq!(stored(&world).iter().filter(|pass| pass.ended_at.is_some()).count(), 1);
}

#[test]
fn the_clock_may_step_either_way() {
    let mut world = world();
    let set = elements(UTC0, 0.0);
    add(&mut world, vec![set.clone()]).unwrap();
    let passes = expected(&set, 1, 3);
    let inside = |pass: &PassAhead| (pass.aos_at.0 + pass.los_at.unwrap().0) / 2;
    for at in [inside(&passes[9]), inside(&passes[2]), inside(&passes[12])] {
        world.step_utc(at - world.now.utc.0);
        world.pass(2 * S);
        assert_eq!(in_view(&world), Some(true));
        world.step_utc(1_200_000_000);
        world.pass(2 * S);
        assert_eq!(in_view(&world), Some(false));
    }
}

#[test]
fn old_elements_are_told_and_in_the_end_believed_no_more() {
    let mut world = world();
    add(&mut world, vec![elements(UTC0 - 15 * 86_400_000_000, 0.0)]).unwrap();
    assert!(world.events(EventKind::Elements).iter().any(|text| text.contains("15 days old")));
    assert!(in_view(&world).is_some());
    world.pass(30 * DAY);
    assert_eq!(in_view(&world), None, "an orbit of six weeks ago is no reason to be silent");
    let told = world.events(EventKind::Elements).iter().filter(|text| text.contains("days old")).count();
    assert_eq!(told, 2, "once a level");
    let believed = stored(&world).len();
    for _ in 0..1440 {
        let expected = expectation(&world);
        assert!(expected.contains("add elements"), "useless elements tell no contact: {expected}");
        world.pass(60 * S);
    }
    assert_eq!(stored(&world).len(), believed, "nor a pass");
    assert!(stored(&world).iter().all(|pass| pass.ended_at.is_some()));
    let fresh = elements(world.now.utc.0, 0.0);
    add(&mut world, vec![fresh]).unwrap();
    assert!(in_view(&world).is_some());
}

#[test]
fn beacon_that_is_missed_in_view_is_told_once_a_pass_and_gaps_never() {
    let mut world = world();
    let set = elements(UTC0, 0.0);
    add(&mut world, vec![set.clone()]).unwrap();
    world.pass(2 * DAY);
    let high = expected(&set, 1, 2).iter().filter(|pass| pass.max_elevation_deg >= 10.0).count();
    let overdue =
        |world: &World| world.events(EventKind::Pass).iter().filter(|text| text.contains("overdue")).count();
    let silent = overdue(&world);
    assert!(silent > 0 && silent <= high, "{silent} of {high}");
    // Heard every minute in view from now on: no more of it.
    for _ in 0..2 * 1440 {
        if in_view(&world) == Some(true) {
            world.heartbeat();
        }
        world.pass(60 * S);
    }
    assert_eq!(overdue(&world), silent);
}

#[test]
fn age_is_worth_a_warning_after_two_weeks() {
    let set = elements(UTC0, 0.0);
    let at = |days: i64| ElementsAge::at(&set, UtcUs(UTC0 + days * 86_400_000_000));
    assert_eq!(at(0).level, Level::Normal);
    assert_eq!(at(3).level, Level::Normal);
    assert_eq!(at(8).level, Level::Watch);
    assert_eq!(at(14).level, Level::Warning);
    assert_eq!(at(400).level, Level::Distress);
    assert!(at(10).timing_error_s > at(5).timing_error_s);
    assert!(at(-20).timing_error_s > 5.0, "before the epoch too");
}

#[test]
fn elements_that_make_no_orbit_are_refused_by_name() {
    let mut world = world();
    let mut bad = elements(UTC0, 0.0);
    bad.mean_motion_rev_day = -1.0;
    let refusal = add(&mut world, vec![bad]).unwrap_err().to_string();
    assert!(refusal.contains("PIXELSAT"), "{refusal}");
    assert!(add(&mut world, Vec::new()).is_err());
}
