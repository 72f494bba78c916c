//! Small changes move nothing; large ones move what they must.

use mission::schedule::{Candidate, Problem, Reason, Role, Schedule, plan};
use rand::RngExt as _;

use crate::cases::{chance, days, mast, moved, pass, tight};
use crate::rules::check;

fn by_key<'a>(problem: &'a Problem, schedule: &Schedule, index: usize) -> &'a Candidate {
    let key = &schedule.contacts[index].key;
    problem.candidates.iter().find(|c| c.key == *key).expect("a candidate")
}

/// How many contacts of `before` are not in `after` although they still fit their pass.
fn lost(problem: &Problem, before: &Schedule, after: &Schedule) -> Vec<String> {
    (0..before.contacts.len())
        .filter(|&i| {
            let (contact, candidate) = (&before.contacts[i], by_key(problem, before, i));
            let long_us = candidate.los.0 - candidate.aos.0;
            let fits = long_us >= i64::from(candidate.min_duration_s) * 1_000_000 + 2_000_000;
            let there = after
                .contact(&contact.key)
                .is_some_and(|c| c.antenna == contact.antenna && c.role == contact.role);
            fits && !there
        })
        .map(|i| {
            let contact = &before.contacts[i];
            let now = after.refused.iter().find(|r| r.key == contact.key);
            let other = after.contact(&contact.key);
            format!("{contact:?} is now {other:?}, refused: {now:?}")
        })
        .collect()
}

/// Passes too short for their minimum.
fn short(schedule: &Schedule) -> usize {
    schedule.refused.iter().filter(|r| matches!(r.reason, Reason::TooShort { .. })).count()
}

#[test]
fn a_change_below_five_seconds_moves_nothing() {
    let (mut contacts, mut turns) = (0, 0);
    for seed in 0..500 {
        let mut rng = chance(seed ^ 0x5eed);
        let problem = days(seed, rng.random_range(2..14), rng.random_range(1..4), rng.random_range(1..3), 1);
        let mut before = plan(&problem, &[]);
        // Several times in a row: what was remembered must not creep.
        for turn in 0..3 {
            let later = moved(&problem, &mut rng, 5_000_000);
            let after = plan(&later, &before.memory);
            check(&later, &after, &format!("seed {seed} turn {turn}"));
            let gone = lost(&later, &before, &after);
            assert!(gone.is_empty(), "seed {seed} turn {turn}: {gone:#?}");
            contacts += before.contacts.len();
            turns += 1;
            // A pass that fell below its minimum, or rose above it, is a larger change: it may free an antenna.
            if short(&after) != short(&before) {
                break;
            }
            before = after;
        }
    }
    println!("{turns} changes, {contacts} contacts");
    assert!(contacts > 10_000 && turns > 1_000, "{contacts} in {turns} turns");
}

/// The tight cases have no room: a change of a few seconds is a large one there. Promises are kept where the margin says so.
#[test]
fn the_same_question_gets_the_same_answer() {
    for seed in 0..200 {
        let problem = tight(seed);
        let first = plan(&problem, &[]);
        let again = plan(&problem, &first.memory);
        let times = |s: &Schedule| {
            s.contacts.iter().map(|c| (c.key.clone(), c.antenna.clone(), c.start, c.stop)).collect::<Vec<_>>()
        };
        assert_eq!(times(&first), times(&again), "seed {seed}");
        assert_eq!((first.worth, first.bound), (again.worth, again.bound), "seed {seed}");
    }
}

#[test]
fn a_promise_gives_way_to_what_is_clearly_better() {
    let problem = |newcomer: u32| {
        let mut candidates = vec![pass("pixelsat-1", "home", 0, 600, 300)];
        candidates[0].partial = mission::schedule::Partial::Worthless;
        if newcomer > 0 {
            candidates.push(pass("chess", "home", 10, 610, newcomer));
            candidates[1].partial = mission::schedule::Partial::Worthless;
        }
        Problem { candidates, antennas: vec![mast("yagi", "home", 60)], ..Problem::default() }
    };
    let promised = plan(&problem(0), &[]);
    let slightly = plan(&problem(310), &promised.memory);
    assert_eq!(slightly.contacts[0].satellite.as_str(), "pixelsat-1");
    assert!(slightly.contacts[0].kept);
    assert!(slightly.gap() > 0.0, "the promise costs something, and that is told");
    assert!(slightly.refused[0].to_string().contains("but promised before"), "{}", slightly.refused[0]);
    let clearly = plan(&problem(340), &promised.memory);
    assert_eq!(clearly.contacts[0].satellite.as_str(), "chess");
    assert_eq!(clearly.contacts[0].role, Role::Lead);
    // Without a promise the better one wins by any margin.
    assert_eq!(plan(&problem(310), &[]).contacts[0].satellite.as_str(), "chess");
}

#[test]
fn a_contact_follows_its_pass_and_a_pass_that_moved_far_is_asked_anew() {
    let one = |shift_s: i64| Problem {
        candidates: vec![Candidate {
            aos: crate::cases::at(shift_s),
            los: crate::cases::at(600 + shift_s),
            ..pass("pixelsat-1", "home", 0, 600, 300)
        }],
        antennas: vec![mast("yagi", "home", 60)],
        ..Problem::default()
    };
    let first = plan(&one(0), &[]);
    for shift_s in [-400, -5, 3, 5, 6, 1000] {
        let after = plan(&one(shift_s), &first.memory);
        assert_eq!(after.contacts[0].start, crate::cases::at(shift_s));
        assert_eq!(after.contacts[0].stop, crate::cases::at(600 + shift_s));
        assert!(after.contacts[0].whole && after.contacts[0].kept);
    }
}
