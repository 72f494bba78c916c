//! Whom the antenna follows, from statuses made by hand.

use std::sync::Arc;

use mission::schedule::{Contact, PassKey, Role, Schedule, Window, Worth};
use mission::sky::ElementsAge;
use mission::status::{SatelliteStatus, SkyStatus, StorageStatus};
use mission::{
    AntennaId, ElementSet, ElementsId, MonoUs, Now, PassAhead, SatelliteId, StationId, Status, UtcUs,
};
use tle::formats::{Checksums, sets};

use super::lead_us;
use super::target::{Rules, Target, target};
use crate::config::RotatorSection;

/// A second.
const S: i64 = 1_000_000;

fn at(s: i64) -> UtcUs {
    UtcUs(1_800_000_000 * S + s * S)
}

fn rules() -> Rules {
    Rules { blackouts: Vec::new(), lead_us: 120 * S }
}

fn closed(from_s: i64, until_s: i64) -> Rules {
    Rules { blackouts: vec![Window { start: at(from_s), stop: at(until_s) }], ..rules() }
}

fn pass(aos_s: i64, los_s: i64, max_elevation_deg: f64) -> PassAhead {
    PassAhead {
        aos_at: at(aos_s),
        tca_at: at((aos_s + los_s) / 2),
        los_at: Some(at(los_s)),
        max_elevation_deg,
        azimuths_deg: [0.0, 90.0, 180.0],
        elements: ElementsId(1),
    }
}

fn satellite(name: &str, elements: u64, passes: Vec<PassAhead>) -> SatelliteStatus {
    let text = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
                2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";
    let set = sets(text, Checksums::Strict).unwrap().next().unwrap().unwrap().elements;
    SatelliteStatus {
        satellite: SatelliteId::new(name).unwrap(),
        heard_at: None,
        heartbeat_at: None,
        next_heartbeat_at: None,
        in_contact: false,
        in_view: None,
        los_at: None,
        expectation: String::new(),
        sky: Some(SkyStatus {
            age: ElementsAge::at(&set, at(0)),
            elements: ElementSet { id: ElementsId(elements), elements: Arc::new(set) },
            fault: None,
            passes,
        }),
        uplink: String::new(),
        wants_lease: false,
        outstanding: None,
        queued: 0,
        image: None,
        download: None,
    }
}

fn contact(name: &str, start_s: i64, stop_s: i64, whole: bool) -> Contact {
    let satellite = SatelliteId::new(name).unwrap();
    let station = StationId::new("here").unwrap();
    Contact {
        key: PassKey { satellite: satellite.clone(), station: station.clone(), minute: start_s },
        satellite,
        station,
        antenna: AntennaId::new("here").unwrap(),
        start: at(start_s),
        stop: at(stop_s),
        whole,
        worth: Worth::default(),
        role: Role::Lead,
        transmit: None,
        kept: false,
        cut_start: None,
        cut_stop: None,
        over: Vec::new(),
        plan: None,
    }
}

fn status(satellites: Vec<SatelliteStatus>, contacts: Vec<Contact>) -> Status {
    Status {
        station: StationId::new("here").unwrap(),
        at: Now { mono: MonoUs(0), utc: at(0) },
        links: Vec::new(),
        satellites,
        sealing: Vec::new(),
        storage: StorageStatus::default(),
        plans: Vec::new(),
        schedule: Arc::new(Schedule { contacts, ..Schedule::default() }),
        runs: Vec::new(),
        antenna: None,
    }
}

/// What a station that looks every ten seconds follows: name, from when, and each LOS it was told.
fn followed(status: &Status, rules: &Rules, until_s: i64) -> Vec<(String, i64, i64)> {
    let mut current: Option<Target> = None;
    let mut told = Vec::new();
    for s in (0..until_s).step_by(10) {
        let now = at(s);
        let wanted = target(status, rules, now, current.as_ref());
        if let Some(wanted) = &wanted
            && !current.as_ref().is_some_and(|current| current.is_as(wanted, now))
        {
            told.push((wanted.satellite.to_string(), s, (wanted.los.0 - at(0).0) / S));
        }
        current = wanted;
    }
    told
}

fn told(name: &str, from_s: i64, until_s: i64) -> (String, i64, i64) {
    (name.to_owned(), from_s, until_s)
}

#[test]
fn without_plans_it_follows_pass_after_pass_and_rests_between() {
    let status = status(
        vec![
            satellite("a", 1, vec![pass(600, 1200, 20.0), pass(6000, 6600, 50.0)]),
            satellite("b", 2, vec![pass(3000, 3600, 10.0)]),
        ],
        vec![],
    );
    assert_eq!(
        followed(&status, &rules(), 7000),
        [told("a", 480, 1200), told("b", 2880, 3600), told("a", 5880, 6600)],
        "two minutes before each AOS, not earlier: until then it rests"
    );
    assert_eq!(target(&status, &rules(), at(1200), None), None);
}

#[test]
fn of_passes_that_overlap_the_higher_wins_and_the_lower_gets_what_is_left() {
    let low_first =
        |low, high| status(vec![satellite("a", 1, vec![low]), satellite("b", 2, vec![high])], vec![]);
    let long_before = low_first(pass(600, 1200, 20.0), pass(1100, 1700, 60.0));
    assert_eq!(
        followed(&long_before, &rules(), 2000),
        [told("a", 480, 980), told("b", 980, 1700)],
        "the lower one until it is time to turn"
    );
    let nearly_at_once = low_first(pass(600, 1200, 20.0), pass(700, 1300, 60.0));
    assert_eq!(followed(&nearly_at_once, &rules(), 2000), [told("b", 580, 1300)]);
    let high_first = low_first(pass(600, 1200, 60.0), pass(700, 1500, 20.0));
    assert_eq!(
        followed(&high_first, &rules(), 2000),
        [told("a", 480, 1200), told("b", 1200, 1500)],
        "what is left of the lower one after the higher one"
    );
}

#[test]
fn what_is_followed_is_followed_to_its_los() {
    // A higher pass of another satellite turns up with new elements in the middle of a pass.
    let before = status(vec![satellite("a", 1, vec![pass(600, 1200, 20.0)])], vec![]);
    let current = target(&before, &rules(), at(700), None);
    let after = status(
        vec![satellite("a", 1, vec![pass(600, 1200, 20.0)]), satellite("b", 2, vec![pass(650, 1300, 80.0)])],
        vec![],
    );
    let name = |current| target(&after, &rules(), at(710), current).unwrap().satellite.to_string();
    assert_eq!(name(current.as_ref()), "a");
    assert_eq!(name(None), "b");
}

#[test]
fn newer_elements_are_told_in_the_middle_of_a_pass_and_the_same_ones_only_once() {
    let with = |elements, aos_s, los_s| {
        status(vec![satellite("a", elements, vec![pass(aos_s, los_s, 20.0)])], vec![])
    };
    let now = at(900);
    let first = target(&with(1, 600, 1200), &rules(), now, None).unwrap();
    let again = target(&with(1, 601, 1200), &rules(), now, Some(&first)).unwrap();
    assert!(first.is_as(&again, now), "an AOS that is over is of no account");
    let newer = target(&with(2, 600, 1200), &rules(), now, Some(&first)).unwrap();
    assert!(!first.is_as(&newer, now));
    let moved = target(&with(1, 600, 1203), &rules(), now, Some(&first)).unwrap();
    assert!(!first.is_as(&moved, now));
}

#[test]
fn a_scheduled_contact_goes_before_every_other_pass() {
    let satellites = || {
        vec![
            satellite("a", 1, vec![pass(600, 1200, 80.0)]),
            satellite("b", 2, vec![pass(1000, 1600, 10.0)]),
            satellite("c", 3, vec![pass(5000, 5600, 10.0)]),
        ]
    };
    let scheduled = status(satellites(), vec![contact("b", 1000, 1600, true)]);
    assert_eq!(
        followed(&scheduled, &rules(), 6000),
        [told("a", 480, 880), told("b", 880, 1600), told("c", 4880, 5600)],
        "the unplanned pass ends in time to turn; after the contact the others have their turn"
    );
    // Cut by the schedule.
    let cut = status(satellites(), vec![contact("b", 1100, 1300, false)]);
    assert_eq!(
        followed(&cut, &rules(), 2000),
        [told("a", 480, 980), told("b", 980, 1300), told("b", 1300, 1600)],
        "by the times of the schedule, and afterwards it listens on"
    );
    // A contact elsewhere, or of a satellite that is nowhere, is no reason to turn.
    let mut elsewhere = contact("b", 1000, 1600, true);
    elsewhere.station = StationId::new("there").unwrap();
    let others = status(satellites(), vec![elsewhere, contact("unknown", 1000, 1600, true)]);
    assert_eq!(followed(&others, &rules(), 2000), [told("a", 480, 1200), told("b", 1200, 1600)]);
}

#[test]
fn nothing_is_followed_in_a_blackout() {
    let one = status(vec![satellite("a", 1, vec![pass(600, 1200, 80.0)])], vec![]);
    assert_eq!(followed(&one, &closed(0, 2000), 2000), []);
    assert_eq!(followed(&one, &closed(900, 1000), 2000), [told("a", 480, 900), told("a", 1000, 1200)]);
    assert_eq!(followed(&one, &closed(0, 800), 2000), [told("a", 800, 1200)], "it does not turn before");
    let scheduled =
        status(vec![satellite("a", 1, vec![pass(600, 1200, 80.0)])], vec![contact("a", 1000, 1200, false)]);
    assert_eq!(followed(&scheduled, &closed(500, 1000), 2000), [told("a", 1000, 1200)]);
}

#[test]
fn elements_that_tell_nothing_turn_nothing_and_what_does_not_set_is_followed_in_stretches() {
    let mut ill = satellite("a", 1, vec![pass(600, 1200, 80.0)]);
    ill.sky.as_mut().unwrap().fault = Some("decayed".into());
    let mut unknown = satellite("b", 1, vec![]);
    unknown.sky = None;
    assert_eq!(followed(&status(vec![ill, unknown], vec![]), &rules(), 2000), []);
    let stays = PassAhead { los_at: None, ..pass(-10_000, 0, 30.0) };
    let geo = status(vec![satellite("g", 1, vec![stays])], vec![]);
    assert_eq!(
        followed(&geo, &rules(), 7200),
        [told("g", 0, 3600), told("g", 3000, 6600), told("g", 6000, 9600)]
    );
}

#[test]
fn the_antenna_is_told_early_enough_to_turn_all_the_way_round() {
    let slow = RotatorSection { azimuth_rate_deg_s: 2.0, ..RotatorSection::default() };
    assert_eq!(lead_us(Some(&slow)), 240 * S);
    assert_eq!(lead_us(Some(&RotatorSection::default())), 120 * S);
    assert_eq!(lead_us(None), 60 * S);
}
