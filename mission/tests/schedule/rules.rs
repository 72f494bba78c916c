//! What holds for every schedule.

use std::collections::BTreeSet;

use mission::schedule::{Partial, Problem, Reason, Role, Schedule, Scope};

use crate::cases::{days, tight};

/// Panics where a schedule breaks a rule.
pub(crate) fn check(problem: &Problem, schedule: &Schedule, name: &str) {
    let mut seen = BTreeSet::new();
    let explained = schedule.refused.iter().map(|r| &r.key);
    for key in schedule.contacts.iter().map(|c| &c.key).chain(explained) {
        assert!(seen.insert(key), "{name}: {key} is both chosen and refused");
    }
    for candidate in &problem.candidates {
        assert!(seen.contains(&candidate.key), "{name}: {} is neither chosen nor explained", candidate.key);
    }
    for contact in &schedule.contacts {
        let candidate = problem.candidates.iter().find(|c| c.key == contact.key).expect("a candidate");
        let antenna = problem.antennas.iter().find(|a| a.id == contact.antenna).expect("an antenna");
        assert_eq!(antenna.station, candidate.station, "{name}: {contact:?}");
        assert!(
            candidate.antennas.is_empty() || candidate.antennas.contains(&antenna.id),
            "{name}: {contact:?}"
        );
        assert!(candidate.aos <= contact.start && contact.stop <= candidate.los, "{name}: {contact:?}");
        let long_us = contact.stop.0 - contact.start.0;
        assert!(long_us >= i64::from(candidate.min_duration_s) * 1_000_000, "{name}: too short: {contact:?}");
        let spare_us = contact.start.0 - candidate.aos.0 + candidate.los.0 - contact.stop.0;
        let whole =
            contact.start.0 - candidate.aos.0 < 1_000_000 && candidate.los.0 - contact.stop.0 < 1_000_000;
        assert_eq!(whole, contact.whole, "{name}: {spare_us} us short: {contact:?}");
        assert!(contact.whole || candidate.partial == Partial::Proportional, "{name}: {contact:?}");
        assert_eq!(
            contact.cut_start.is_some() || contact.cut_stop.is_some(),
            !contact.whole,
            "{name}: {contact:?}"
        );
        for blackout in &problem.blackouts {
            let covers = match &blackout.scope {
                Scope::Station(s) => *s == contact.station,
                Scope::Antenna(a) => *a == contact.antenna,
                Scope::Satellite(s) => *s == contact.satellite,
            };
            let clear = blackout.window.stop <= contact.start || contact.stop <= blackout.window.start;
            assert!(!covers || clear, "{name}: in a blackout: {contact:?} {blackout:?}");
        }
        for other in schedule.contacts.iter().filter(|o| o.key != contact.key) {
            if other.antenna == contact.antenna && other.start >= contact.start {
                let between_us = other.start.0 - contact.stop.0;
                assert!(
                    between_us >= i64::from(antenna.switch_over_s) * 1_000_000,
                    "{name}: no time to switch over: {contact:?} {other:?}"
                );
            }
            if let (Some(a), Some(b)) = (&contact.transmit, &other.transmit) {
                let apart = contact.satellite != other.satellite || !a.overlaps(b);
                assert!(apart, "{name}: two transmit to one: {contact:?} {other:?}");
            }
        }
        if let Role::Ear(lead) = &contact.role {
            let lead = schedule.contact(lead).expect("the lead is a contact");
            assert_eq!(lead.role, Role::Lead, "{name}");
            assert_eq!((contact.worth.0, contact.transmit), (0, None), "{name}: {contact:?}");
        }
    }
    for refused in &schedule.refused {
        if let Reason::Loses { to } = &refused.reason {
            assert!(!to.is_empty(), "{name}: loses to nobody: {refused:?}");
        }
    }
    let sum: i64 = schedule.contacts.iter().map(|c| c.worth.0).sum();
    assert_eq!(sum, schedule.worth.0, "{name}");
    assert!(schedule.bound >= schedule.worth, "{name}");
}

#[test]
fn schedules_of_days_keep_the_rules() {
    for seed in 0..30 {
        let problem = days(seed, 12, 1 + seed as usize % 3, 1 + seed as usize % 2, 2);
        check(&problem, &mission::schedule::plan(&problem, &[]), &format!("seed {seed}"));
    }
}

#[test]
fn a_loser_without_promises_is_worth_no_more_than_who_beat_it() {
    for seed in 1000..1200 {
        let problem = tight(seed);
        for refused in mission::schedule::plan(&problem, &[]).refused {
            if let Reason::Loses { to } = &refused.reason {
                let theirs: i64 = to.iter().map(|r| r.worth.0).sum();
                // What a blackout leaves of the loser may be less than the whole.
                let whole = problem.blackouts.is_empty() && problem.sites.is_empty();
                assert!(!whole || theirs + 100 >= refused.worth.0, "seed {seed}: {refused}");
            }
        }
    }
}
