//! Small questions: the answer is the best one.

use mission::schedule::{Partial, Policy, Problem, Role, plan};

use crate::brute;
use crate::cases::{mast, pass, tight, tight_pair};
use crate::rules::check;

#[test]
fn one_station_equals_brute_force() {
    let (mut cut, mut refused) = (0, 0);
    for seed in 0..500 {
        let problem = tight(seed);
        let schedule = plan(&problem, &[]);
        check(&problem, &schedule, &format!("seed {seed}"));
        assert_eq!(schedule.worth.0, brute::best(&problem), "seed {seed}: {problem:#?} {schedule:#?}");
        assert!(schedule.is_proved(), "seed {seed}: {schedule:#?}");
        cut += schedule.contacts.iter().filter(|c| !c.whole).count();
        refused += schedule.refused.len();
    }
    // The cases are worth asking: many contacts are cut, many passes refused.
    assert!(cut > 200 && refused > 500, "{cut} cut, {refused} refused");
}

#[test]
fn the_order_of_the_question_does_not_matter() {
    for seed in 500..560 {
        let problem = tight(seed);
        let mut turned = problem.clone();
        turned.candidates.reverse();
        assert_eq!(plan(&problem, &[]).worth, plan(&turned, &[]).worth, "seed {seed}");
    }
}

#[test]
fn two_stations_that_share_passages_equal_brute_force() {
    let mut ears = 0;
    for seed in 0..300 {
        let problem = tight_pair(seed);
        let schedule = plan(&problem, &[]);
        check(&problem, &schedule, &format!("seed {seed}"));
        assert_eq!(schedule.worth.0, brute::best(&problem), "seed {seed}: {problem:#?} {schedule:#?}");
        assert!(schedule.is_proved(), "seed {seed}: {schedule:#?}");
        ears += schedule.contacts.iter().filter(|c| c.role != Role::Lead).count();
    }
    assert!(ears > 20, "{ears}");
}

/// The first is cut neither for its neighbour's begin nor for its end, but so that the neighbour at its shortest is done when the
/// third begins.
#[test]
fn a_contact_is_cut_for_the_one_after_the_next() {
    let mut candidates =
        vec![pass("a", "home", 0, 22, 220), pass("b", "home", 5, 33, 196), pass("c", "home", 26, 30, 100)];
    (candidates[0].min_duration_s, candidates[1].min_duration_s) = (2, 4);
    (candidates[2].min_duration_s, candidates[2].partial) = (1, Partial::Worthless);
    let problem = Problem {
        candidates,
        antennas: vec![mast("yagi", "home", 1)],
        policy: Policy { drift_s: 0, ..Policy::default() },
        ..Problem::default()
    };
    let schedule = plan(&problem, &[]);
    assert_eq!(schedule.worth.0, brute::best(&problem));
    let ends: Vec<i64> =
        schedule.contacts.iter().map(|c| (c.stop.0 - problem.candidates[0].aos.0) / 1_000_000).collect();
    assert_eq!(ends, [20, 25, 30]);
}
